//! Surfaces under a dielectric coat (v4 `coateddiffuse`, `coatedconductor`).

use super::built::{Built, Part, PartMaterial};
use super::color::Use;
use super::error::{SceneError, Site};
use super::given::Given;
use super::params::ParamSet;
use super::textures::{TextureNames, color_param, color_param_or, float_param, float_param_or};
use crate::scene::{MaterialKind, Param, Remap, Roughness, Weight, is_smooth};
use crate::surface::dielectric::read_index;
use crate::surface::{
    CoatLayer, CoatMaterial, CoatedBase, CoatedConductorMaterial, CoatedDiffuseMaterial,
    ConductorFresnel, TexturedCoatMaterial,
};

pub(super) fn diffuse(set: &ParamSet, names: &TextureNames) -> Result<Built, SceneError> {
    let reflectance = color_param_or(set, names, "reflectance", 0.5)?;
    let (coat, interface) = coat(set, names, "")?;
    if alphas(&interface).is_none() {
        return Ok(Built::One(MaterialKind::from(TexturedCoatMaterial {
            base: CoatedBase::Diffuse(reflectance),
            interface,
            coat,
        })));
    }
    let base = CoatedDiffuseMaterial { reflectance, coat };
    Ok(under(coat, base.into(), reflectance))
}

/// Where a coat is said to disperse light, which coats do not.
pub(super) fn undispersed(kind: &str, set: &ParamSet) -> Result<Option<Site>, SceneError> {
    let name = match kind {
        "coateddiffuse" => "eta",
        "coatedconductor" => "interface.eta",
        _ => return Ok(None),
    };
    let Some(eta) = set.find(name) else {
        return Ok(None);
    };
    let disperses = set.index_curve(eta)?.is_some();
    Ok(disperses.then(|| set.site_of(eta)))
}

/// A surface that has its coat in it, unless that is smooth and reflects: then what it reflects, a
/// delta distribution, and what it lets through are two components. `albedo` is about that of the
/// surface without it.
fn under(coat: CoatLayer, base: MaterialKind, albedo: Param) -> Built {
    if !coat.is_smooth() || coat.eta == 1.0 {
        return Built::One(base);
    }
    let reflected = Param::Constant([mean_reflectance(coat.eta); 3]);
    let part = |kind: MaterialKind, albedo: Param| Part {
        material: PartMaterial::Own(kind),
        weight: Weight::ONE,
        albedo: vec![albedo],
    };
    Built::Mixture(vec![
        part(CoatMaterial { eta: coat.eta }.into(), reflected),
        part(base, albedo),
    ])
}

/// Of a smooth dielectric, over a white sky; fits for either side of 1 (Kulla and Conty 2017,
/// "Revisiting Physically Based Shading at Imageworks").
fn mean_reflectance(eta: f32) -> f32 {
    let mean = if eta >= 1.0 {
        (eta - 1.0) / (4.08567 + 1.00071 * eta)
    } else {
        0.997118 + eta * (0.1014 - eta * (0.965241 + 0.130607 * eta))
    };
    // Never left out: at grazing angles everything reflects.
    mean.clamp(0.01, 1.0)
}

pub(super) fn conductor(set: &ParamSet, names: &TextureNames) -> Result<Built, SceneError> {
    let (coat, interface) = coat(set, names, "interface.")?;
    let fresnel = ConductorFresnel::read(&Given::plain(set, names), "conductor.")?;
    let roughness = roughness(set, names, "conductor.")?;
    let below = alphas(&roughness);
    let (Some([eta, k]), Some(alphas), Some(_)) = (fresnel.constant(), below, alphas(&interface))
    else {
        let base = MaterialKind::from(TexturedCoatMaterial {
            base: CoatedBase::Conductor { fresnel, roughness },
            interface,
            coat,
        });
        return Ok(match below {
            Some(alphas) if is_smooth(alphas) => Built::One(base),
            _ => under(coat, base, Param::Constant([0.7; 3])),
        });
    };
    let base = MaterialKind::from(CoatedConductorMaterial {
        // The conductor is what the coat ends at.
        eta: eta.map(|x| x.max(0.0) / coat.eta),
        k: k.map(|x| x.max(0.0) / coat.eta),
        alphas,
        coat,
    });
    // Smooth layers have one direction for all of their light.
    Ok(if is_smooth(alphas) {
        Built::One(base)
    } else {
        under(coat, base, Param::Constant([0.7; 3]))
    })
}

/// The coat of either, and the roughness of its interface; `prefix` is before the names of the
/// interface's parameters.
fn coat(
    set: &ParamSet,
    names: &TextureNames,
    prefix: &str,
) -> Result<(CoatLayer, Roughness), SceneError> {
    let name = format!("{prefix}eta");
    let (eta, _) = read_index(&Given::plain(set, names), &name)?;
    let eta = constant(set, &name, eta)?[0];
    let thickness = number(set, names, "thickness")?.unwrap_or(0.01);
    if thickness < 0.0 {
        return Err(set.error(format_args!("thickness {thickness} is negative")));
    }
    if let Some(albedo) = color_param(set, names, "albedo", Use::Albedo)?
        && albedo != Param::Constant([0.0; 3])
    {
        return Err(set.error(
            "a coat that scatters (\"albedo\" other than 0) is not supported; use \"rgb albedo\" [0 0 0]",
        ));
    }
    // Of the scattering, and of a random walk that is not taken here.
    set.accept(&["g", "nsamples"]);
    let max_depth = set.int_in("maxdepth", 10, 0, i32::MAX.into())? as u32;
    // Nothing bends or reflects where nothing changes, however rough (pbrt-v4, `DielectricBxDF`).
    let given = roughness(set, names, prefix)?;
    let interface = if eta == 1.0 { SMOOTH } else { given };
    let coat = CoatLayer {
        alphas: alphas(&interface).unwrap_or([1.0; 2]),
        eta: eta.clamp(1e-3, 1e3),
        thickness,
        max_depth,
    };
    Ok((coat, interface))
}

const SMOOTH: Roughness = Roughness {
    u: Param::Constant([0.0; 3]),
    v: Param::Constant([0.0; 3]),
    remap: Remap::None,
};

fn roughness(set: &ParamSet, names: &TextureNames, prefix: &str) -> Result<Roughness, SceneError> {
    let remap = match set.bool_or("remaproughness", true)? {
        true => Remap::V4,
        false => Remap::None,
    };
    let both = float_param_or(set, names, &format!("{prefix}roughness"), 0.0)?;
    let one = |axis: &str| {
        let name = format!("{prefix}{axis}roughness");
        let roughness = float_param(set, names, &name)?.unwrap_or(both);
        match roughness {
            Param::Constant([x, ..]) if x < 0.0 => {
                Err(set.error(format_args!("roughness {x} is negative")))
            }
            _ => Ok(roughness),
        }
    };
    Ok(Roughness {
        u: one("u")?,
        v: one("v")?,
        remap,
    })
}

/// The alphas, if they are the same everywhere.
fn alphas(roughness: &Roughness) -> Option<[f32; 2]> {
    let alpha = |x: f32| match roughness.remap {
        Remap::None => x,
        Remap::V3 | Remap::V4 => x.sqrt(),
    };
    match (roughness.u, roughness.v) {
        (Param::Constant([u, ..]), Param::Constant([v, ..])) => {
            Some([u, v].map(|x| alpha(x).min(1e3)))
        }
        _ => None,
    }
}

/// What the closed forms take for constant over a surface.
fn number(set: &ParamSet, names: &TextureNames, name: &str) -> Result<Option<f32>, SceneError> {
    match float_param(set, names, name)? {
        Some(value) => Ok(Some(constant(set, name, value)?[0])),
        None => Ok(None),
    }
}

fn constant(set: &ParamSet, name: &str, value: Param) -> Result<[f32; 3], SceneError> {
    match (value, set.find(name)) {
        (Param::Constant(value), _) => Ok(value),
        (Param::Texture(_), Some(given)) => Err(set.error_at(
            given,
            "textures are not supported here, in a coated material; use a constant",
        )),
        (Param::Texture(_), None) => Err(set.error(format_args!(
            "a texture for \"{name}\" is not supported; use a constant"
        ))),
    }
}
