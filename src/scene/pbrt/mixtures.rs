//! Materials that are several in one place.

use super::color::Use;
use super::dialect::Dialect;
use super::error::SceneError;
use super::materials::{Built, Part, PartMaterial};
use super::params::{Param as Given, ParamSet, Type, Values};
use super::state::{MaterialDef, MaterialNames};
use super::textures::{TextureNames, color_param, float_param_or};
use crate::scene::{MAX_NESTING, MaterialKind, Param, Weight};
use std::rc::Rc;

/// `mix` of two named materials. In v3 `amount`, a colour, is the weight of the first; in v4 a number, that of the second.
pub(super) fn mix(
    set: &ParamSet,
    names: &TextureNames,
    materials: &MaterialNames,
) -> Result<Built, SceneError> {
    let [first, second] = match set.dialect {
        Dialect::V3 => [
            component(set, materials, "namedmaterial1")?,
            component(set, materials, "namedmaterial2")?,
        ],
        Dialect::V4 => components(set, materials)?,
    };
    let half = Param::Constant([0.5; 3]);
    let (first_weight, second_weight) = match set.dialect {
        Dialect::V3 => {
            let amount = color_param(set, names, "amount", Use::Unbounded)?.unwrap_or(half);
            (Weight::Amount(amount), Weight::Rest(amount))
        }
        Dialect::V4 => {
            let amount = float_param_or(set, names, "amount", 0.5)?;
            (Weight::Rest(amount), Weight::Amount(amount))
        }
    };
    let part = |made: Rc<MaterialDef>, weight| Part {
        material: PartMaterial::Named(made),
        weight,
        albedo: Vec::new(),
    };
    let mixture = Built::Mixture(vec![part(first, first_weight), part(second, second_weight)]);
    if mixture.nesting() > MAX_NESTING {
        return Err(set.error(format_args!(
            "mixtures are nested more than {MAX_NESTING} deep; mix fewer materials"
        )));
    }
    Ok(mixture)
}

/// v3: the material that one parameter names.
fn component(
    set: &ParamSet,
    materials: &MaterialNames,
    param: &str,
) -> Result<Rc<MaterialDef>, SceneError> {
    let Some(name) = set.string(param)? else {
        return Err(set.error(format_args!("needs a \"string {param}\"")));
    };
    match set.find(param) {
        Some(given) => named(set, materials, given, name),
        None => Err(set.error(format_args!("needs a \"string {param}\""))),
    }
}

/// v4: both names are in one parameter.
fn components(
    set: &ParamSet,
    materials: &MaterialNames,
) -> Result<[Rc<MaterialDef>; 2], SceneError> {
    let Some(given) = set.find("materials") else {
        return Err(set.error("needs the names of two materials, \"string materials\""));
    };
    match &given.values {
        Values::Strings(list) if given.ty == Type::String => match &list[..] {
            [a, b] => Ok([
                named(set, materials, given, a)?,
                named(set, materials, given, b)?,
            ]),
            _ => Err(set.error_at(
                given,
                format_args!("expected the names of 2 materials, found {}", list.len()),
            )),
        },
        _ => Err(set.error_at(given, "expected the names of 2 materials as strings")),
    }
}

fn named(
    set: &ParamSet,
    materials: &MaterialNames,
    given: &Given,
    name: &str,
) -> Result<Rc<MaterialDef>, SceneError> {
    let Some(made) = materials.get(name) else {
        return Err(set.error_at(
            given,
            format_args!(
                "there is no material named \"{name}\"; make it before, with MakeNamedMaterial"
            ),
        ));
    };
    if made.built == Ok(Built::One(MaterialKind::Interface)) {
        return Err(set.error_at(
            given,
            format_args!("\"{name}\" lets rays pass, which is no part of a mixture; use a material that scatters"),
        ));
    }
    Ok(Rc::clone(made))
}

impl Built {
    /// Mixtures within each other, at most.
    fn nesting(&self) -> usize {
        match self {
            Built::One(_) => 0,
            Built::Mixture(parts) => {
                let below = parts.iter().map(|part| match &part.material {
                    PartMaterial::Named(made) => made.built.as_ref().map_or(0, Built::nesting),
                    PartMaterial::Own(_) => 0,
                });
                1 + below.max().unwrap_or(0)
            }
        }
    }
}
