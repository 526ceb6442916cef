//! Materials that are several in one place.

use super::built::{Built, Part, PartMaterial};
use super::built::{MaterialDef, MaterialNames};
use super::color::Use;
use super::dialect::Dialect;
use super::error::SceneError;
use super::given::Given;
use super::params::{self, ParamSet, Type, Values};
use super::textures::{TextureNames, color_param, color_param_or, float_param_or};
use crate::scene::{MAX_NESTING, MaterialKind, Param, Parameters, Remap, Roughness, Weight};
use crate::surface::dielectric::read_v3_index;
use crate::surface::{DielectricMaterial, DiffuseMaterial, DiffuseTransmissionMaterial};
use std::rc::Rc;

/// `mix` of two named materials. In v3 `amount`, a colour, is the weight of the first; in v4 a
/// number, that of the second.
pub(super) fn mix(
    set: &ParamSet,
    names: &TextureNames,
    materials: &MaterialNames,
) -> Result<Built, SceneError> {
    let [first, second] = match set.dialect {
        Dialect::V3 => [
            component(set, names, materials, "namedmaterial1")?,
            component(set, names, materials, "namedmaterial2")?,
        ],
        Dialect::V4 => components(set, materials)?.map(PartMaterial::Named),
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
    let part = |material: PartMaterial, weight| Part {
        material,
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

const BLACK: Param = Param::Constant([0.0; 3]);
const SMOOTH: Roughness = Roughness {
    u: BLACK,
    v: BLACK,
    remap: Remap::None,
};

/// v3's `uber`: what its `opacity` leaves passes straight through; of the rest, a Lambertian lobe,
/// a glossy one, and a delta reflection and refraction, the last three under the Fresnel term of
/// one index.
pub(super) fn uber(set: &ParamSet, names: &TextureNames) -> Result<Built, SceneError> {
    let color = |name: &str, default: f32| color_param_or(set, names, name, default);
    let (kd, ks) = (color("Kd", 0.25)?, color("Ks", 0.25)?);
    let (kr, kt) = (color("Kr", 0.0)?, color("Kt", 0.0)?);
    let opacity = color("opacity", 1.0)?;
    let given = Given::plain(set, names);
    let eta = read_v3_index(&given)?;
    let gloss = given.roughness(0.1)?;
    let glass = |reflectance, transmittance, eta, roughness| {
        MaterialKind::from(DielectricMaterial {
            reflectance,
            transmittance,
            eta,
            dispersion: None,
            roughness,
        })
    };
    let mut parts = Vec::new();
    let mut add = |kind: MaterialKind, weight, albedo: &[Param]| {
        parts.push(Part {
            material: PartMaterial::Own(kind),
            weight,
            albedo: albedo.to_vec(),
        });
    };
    let one = Param::Constant([1.0; 3]);
    if !is_white(opacity) {
        add(glass(BLACK, one, one, SMOOTH), Weight::Rest(opacity), &[]);
    }
    if !is_black(opacity) {
        let weight = Weight::Amount(opacity);
        if !is_black(kd) {
            let diffuse = DiffuseMaterial {
                reflectance: kd,
                sigma: BLACK,
            };
            add(diffuse.into(), weight, &[kd]);
        }
        if !is_black(ks) {
            add(
                glass(ks, BLACK, eta, glossy(gloss)),
                weight,
                &[reflected(ks)],
            );
        }
        if !is_black(kr) || !is_black(kt) {
            add(glass(kr, kt, eta, SMOOTH), weight, &[reflected(kr), kt]);
        }
    }
    let nothing = DiffuseMaterial {
        reflectance: BLACK,
        sigma: BLACK,
    };
    Ok(together(parts, nothing.into()))
}

/// v3's `translucent`: Lambertian and glossy lobes on either side.
pub(super) fn translucent(set: &ParamSet, names: &TextureNames) -> Result<Built, SceneError> {
    let color = |name: &str, default: f32| color_param_or(set, names, name, default);
    let (kd, ks) = (color("Kd", 0.25)?, color("Ks", 0.25)?);
    let (reflect, transmit) = (color("reflect", 0.5)?, color("transmit", 0.5)?);
    let gloss = Given::plain(set, names).isotropic_roughness(0.1)?;
    let diffuse = MaterialKind::from(DiffuseTransmissionMaterial {
        reflectance: [kd, reflect],
        transmittance: [kd, transmit],
        scale: 1.0,
    });
    let mut parts = Vec::new();
    if !is_black(reflect) || !is_black(transmit) {
        if !is_black(kd) {
            parts.push(Part {
                material: PartMaterial::Own(diffuse.clone()),
                weight: Weight::ONE,
                albedo: vec![kd],
            });
        }
        if !is_black(ks) {
            parts.push(Part {
                material: PartMaterial::Own(MaterialKind::from(DielectricMaterial {
                    reflectance: reflect,
                    transmittance: transmit,
                    eta: Param::Constant([1.5; 3]),
                    dispersion: None,
                    roughness: glossy(gloss),
                })),
                weight: Weight::Amount(ks),
                albedo: Vec::new(),
            });
        }
    }
    Ok(together(parts, diffuse))
}

/// A mixture of these parts, or the one material that they come to; `nothing` if there are none.
fn together(parts: Vec<Part>, nothing: MaterialKind) -> Built {
    match &parts[..] {
        [] => Built::One(nothing),
        [
            Part {
                material: PartMaterial::Own(kind),
                weight: Weight::Amount(amount),
                ..
            },
        ] if is_white(*amount) => Built::One(kind.clone()),
        _ => Built::Mixture(parts),
    }
}

/// What a colour under a Fresnel term counts for when a component is chosen: more than the few
/// percent that are reflected on average, as what is reflected at grazing angles is bright.
fn reflected(color: Param) -> Param {
    const SHARE: f32 = 0.25;
    match color {
        Param::Constant(c) => Param::Constant(c.map(|x| SHARE * x)),
        texture => texture,
    }
}

/// Of a lobe that no roughness makes smooth: as glass, 0 would be; v3 remaps it as it does 1e-3
/// (`RoughnessToAlpha`).
fn glossy(roughness: Roughness) -> Roughness {
    let lift = |r: Param| match r {
        Param::Constant([x, ..]) if roughness.remap == Remap::V3 => {
            Param::Constant([x.max(1e-3); 3])
        }
        r => r,
    };
    Roughness {
        u: lift(roughness.u),
        v: lift(roughness.v),
        ..roughness
    }
}

fn is_black(param: Param) -> bool {
    matches!(param, Param::Constant(c) if c.iter().all(|x| *x <= 0.0))
}

fn is_white(param: Param) -> bool {
    matches!(param, Param::Constant(c) if c.iter().all(|x| *x >= 1.0))
}

/// v3: the material that one parameter names; if there is none, matte with the parameters of the
/// mixture.
fn component(
    set: &ParamSet,
    names: &TextureNames,
    materials: &MaterialNames,
    param: &str,
) -> Result<PartMaterial, SceneError> {
    let name = set.string(param)?.unwrap_or_default();
    if let (Some(given), true) = (set.find(param), materials.contains_key(name)) {
        return named(set, materials, given, name).map(PartMaterial::Named);
    }
    set.note(format_args!(
        "there is no material named \"{name}\" for \"{param}\": \"matte\" is used"
    ));
    Ok(PartMaterial::Own(MaterialKind::from(DiffuseMaterial {
        reflectance: color_param_or(set, names, "Kd", 0.5)?,
        sigma: float_param_or(set, names, "sigma", 0.0)?,
    })))
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
    given: &params::Param,
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
    if matches!(&made.built, Ok((Built::One(MaterialKind::Interface), _))) {
        return Err(set.error_at(
            given,
            format_args!("\"{name}\" lets rays pass, which is no part of a mixture; use a material that scatters"),
        ));
    }
    Ok(Rc::clone(made))
}

impl Built {
    /// The first of the named materials that this one is made of.
    pub(super) fn first_named(&self) -> Option<&MaterialDef> {
        match self {
            Built::Mixture(parts) => parts.iter().find_map(|part| match &part.material {
                PartMaterial::Named(made) => Some(&**made),
                PartMaterial::Own(_) => None,
            }),
            Built::One(_) => None,
        }
    }

    /// Mixtures within each other, at most.
    fn nesting(&self) -> usize {
        match self {
            Built::One(_) => 0,
            Built::Mixture(parts) => {
                let below = parts.iter().map(|part| match &part.material {
                    PartMaterial::Named(made) => {
                        made.built.as_ref().map_or(0, |(built, _)| built.nesting())
                    }
                    PartMaterial::Own(_) => 0,
                });
                1 + below.max().unwrap_or(0)
            }
        }
    }
}
