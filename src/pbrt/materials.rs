//! Materials of both dialects, reduced to the kinds of [`MaterialKind`].
//!
//! A material of one BSDF is read by the file of that BSDF ([`table`]). Those that are made of
//! several, or of one or the other, are read here, in `mixtures` and in `coats`.

use super::built::{Built, MaterialNames};
use super::coats;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::given::Given;
use super::mixtures;
use super::params::ParamSet;
use super::textures::{Channels, Tables, TextureNames, float_param};
use crate::pbrt::image::Encoding;
use crate::scene::{Bump, MaterialKind, Param, Tangents};
use crate::surface::table;

/// v3 looks for the parameters of a material in the lists of shapes first; these are the ones it
/// may find there.
const OVERRIDABLE: [&str; 39] = [
    "Kd",
    "Ks",
    "Kr",
    "Kt",
    "reflect",
    "transmit",
    "sigma",
    "eta",
    "k",
    "index",
    "roughness",
    "uroughness",
    "vroughness",
    "remaproughness",
    "opacity",
    "amount",
    "bumpmap",
    "color",
    "sigma_a",
    "sigma_s",
    "mfp",
    "scale",
    "g",
    "eumelanin",
    "pheomelanin",
    "beta_m",
    "beta_n",
    "metallic",
    "speculartint",
    "anisotropic",
    "sheen",
    "sheentint",
    "clearcoat",
    "clearcoatgloss",
    "spectrans",
    "scatterdistance",
    "thin",
    "flatness",
    "difftrans",
];

/// Whether a v3 shape's own parameters change its material.
pub(super) fn overrides(shape: &ParamSet) -> bool {
    OVERRIDABLE.iter().any(|name| shape.has(name))
}

/// The material of a `Material` or `MakeNamedMaterial` directive of type `kind`.
pub(super) fn build(
    kind: &str,
    set: &ParamSet,
    names: &TextureNames,
    materials: &MaterialNames,
) -> Result<Built, SceneError> {
    let built = match (set.dialect, kind) {
        (_, "mix") => mixtures::mix(set, names, materials)?,
        (Dialect::V4, "coateddiffuse") => coats::diffuse(set, names)?,
        (Dialect::V4, "coatedconductor") => coats::conductor(set, names)?,
        (Dialect::V3, "uber") => mixtures::uber(set, names)?,
        (Dialect::V3, "translucent") => mixtures::translucent(set, names)?,
        (_, "" | "none") | (Dialect::V4, "interface") => Built::One(MaterialKind::Interface),
        _ => match table::read(kind, &Given { kind, set, names }) {
            Some(material) => Built::One(material?),
            None => return Err(unknown(kind, set)),
        },
    };
    set.accept(&["type"]);
    Ok(built)
}

fn unknown(kind: &str, set: &ParamSet) -> SceneError {
    let several = match set.dialect {
        Dialect::V3 => "translucent, uber, mix or none",
        Dialect::V4 => "coateddiffuse, coatedconductor, mix or interface",
    };
    let mut supported: Vec<_> = table::names(set.dialect).collect();
    supported.push(several);
    let supported = supported.join(", ");
    set.error(format_args!(
        "material \"{kind}\" is unknown; use {supported}"
    ))
}

/// What tilts the shading normals of a material of type `kind`.
pub(super) fn bump(
    kind: &str,
    set: &ParamSet,
    names: &TextureNames,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Option<Bump>, SceneError> {
    // pbrt's hair has none.
    if matches!(kind, "" | "none" | "interface" | "hair") {
        return Ok(None);
    }
    let (name, tangents) = match set.dialect {
        Dialect::V3 => {
            set.refuse(
                &["displacement", "normalmap"],
                "is of pbrt-v4; use \"bumpmap\", a float texture of heights",
            )?;
            ("bumpmap", Tangents::Unit)
        }
        Dialect::V4 => {
            set.refuse(
                &["bumpmap"],
                "is of pbrt-v3; use \"displacement\", a float texture of heights",
            )?;
            ("displacement", Tangents::LikeU)
        }
    };
    let height = float_param(set, names, name)?;
    if set.dialect == Dialect::V4
        && let Some(filename) = set.string("normalmap")?
    {
        if let Some(param) = set.find("displacement") {
            report.warn_at(
                &set.site_of(param),
                "ignored beside a normal map, as in pbrt",
            );
        }
        let path = set.dir.join(filename);
        let image = tables.image(path, Encoding::Linear, Channels::Rgb);
        let image = image.map_err(|e| set.error(e))?;
        return Ok(Some(Bump::Normal { image }));
    }
    Ok(match height {
        // The same height everywhere tilts nothing.
        None | Some(Param::Constant(_)) => None,
        Some(height) => Some(Bump::Height { height, tangents }),
    })
}
