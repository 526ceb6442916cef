//! Materials of both dialects, reduced to the kinds of [`MaterialKind`]. Defaults are those of the
//! dialect.

use super::coats;
use super::color::Use;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::mixtures;
use super::params::ParamSet;
use super::spectrum;
use super::state::{MaterialDef, MaterialNames};
use super::textures::{
    Channels, Tables, TextureNames, color_param, color_param_or, float_param, float_param_or,
};
use crate::pbrt::image::Encoding;
use crate::scene::spectrum::IndexCurve;
use crate::scene::{
    Bump, CoatedBase, ConductorFresnel, MaterialKind, Param, Remap, Roughness, Tangents, Texture,
    Weight,
};
use std::rc::Rc;
use std::sync::Arc;

/// v3 looks for the parameters of a material in the lists of shapes first; these are the ones it
/// may find there.
const OVERRIDABLE: [&str; 17] = [
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
];

/// A material as it was read: of one kind, or several in one place.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Built {
    One(MaterialKind),
    /// At most [`MAX_COMPONENTS`](crate::scene::MAX_COMPONENTS).
    Mixture(Vec<Part>),
}

/// Memory of an index over the wavelengths, roughly.
const CURVE_BYTES: usize = 2048;

impl Built {
    /// Memory that it takes besides its own size, roughly.
    pub fn bytes(&self) -> usize {
        match self {
            Self::One(kind) => kind.dispersion().map_or(0, |_| CURVE_BYTES),
            Self::Mixture(parts) => parts.len() * (size_of::<Part>() + CURVE_BYTES / 8),
        }
    }
}

/// A part of a mixture, as [`Component`](crate::scene::Component).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub material: PartMaterial,
    pub weight: Weight,
    pub albedo: Vec<Param>,
}

#[derive(Clone, Debug)]
pub(super) enum PartMaterial {
    /// Belongs to this mixture alone.
    Own(MaterialKind),
    Named(Rc<MaterialDef>),
}

impl PartialEq for PartMaterial {
    /// Names stand for what they name.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Own(a), Self::Own(b)) => a == b,
            (Self::Named(a), Self::Named(b)) => Rc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// Whether a v3 shape's own parameters change its material.
pub(super) fn overrides(shape: &ParamSet) -> bool {
    OVERRIDABLE.iter().any(|name| shape.has(name))
}

/// What could be used instead of a material that is not supported.
fn instead_of(kind: &str) -> Option<&'static str> {
    Some(match kind {
        "disney" => "uber, plastic or matte",
        "fourier" | "measured" => "metal (v3) or conductor (v4)",
        "hair" | "subsurface" | "kdsubsurface" => "plastic (v3) or diffuse (v4)",
        _ => return None,
    })
}

/// The material of a `Material` or `MakeNamedMaterial` directive of type `kind`.
pub(super) fn build(
    kind: &str,
    set: &ParamSet,
    names: &TextureNames,
    materials: &MaterialNames,
) -> Result<Built, SceneError> {
    let material = match (set.dialect, kind) {
        (_, "mix") => {
            let mixture = mixtures::mix(set, names, materials)?;
            set.accept(&["type"]);
            return Ok(mixture);
        }
        (Dialect::V4, "coateddiffuse" | "coatedconductor") => {
            let coated = match kind {
                "coateddiffuse" => coats::diffuse(set, names)?,
                _ => coats::conductor(set, names)?,
            };
            set.accept(&["type"]);
            return Ok(coated);
        }
        (Dialect::V3, "uber" | "translucent") => {
            let built = match kind {
                "uber" => mixtures::uber(set, names)?,
                _ => mixtures::translucent(set, names)?,
            };
            set.accept(&["type"]);
            return Ok(built);
        }
        (_, "" | "none") | (Dialect::V4, "interface") => MaterialKind::Interface,
        (Dialect::V3, "matte") => MaterialKind::Diffuse {
            reflectance: color_param_or(set, names, "Kd", 0.5)?,
            sigma: float_param_or(set, names, "sigma", 0.0)?,
        },
        (Dialect::V4, "diffuse") => MaterialKind::Diffuse {
            reflectance: color_param_or(set, names, "reflectance", 0.5)?,
            sigma: Param::Constant([0.0; 3]),
        },
        (Dialect::V3, "mirror") => MaterialKind::Mirror {
            reflectance: color_param_or(set, names, "Kr", 0.9)?,
        },
        (Dialect::V3, "metal") => MaterialKind::Conductor {
            fresnel: eta_k(set, names, "")?,
            roughness: roughness(set, names, 0.01)?,
        },
        (Dialect::V4, "conductor") => MaterialKind::Conductor {
            fresnel: conductor_fresnel(set, names, "")?,
            roughness: roughness(set, names, 0.0)?,
        },
        (Dialect::V3, "plastic") => MaterialKind::Plastic {
            diffuse: color_param_or(set, names, "Kd", 0.25)?,
            specular: color_param_or(set, names, "Ks", 0.25)?,
            roughness: roughness(set, names, 0.1)?,
        },
        (Dialect::V3, "glass") => {
            let eta = glass_index(set, names)?;
            MaterialKind::Dielectric {
                reflectance: color_param_or(set, names, "Kr", 1.0)?,
                transmittance: color_param_or(set, names, "Kt", 1.0)?,
                eta,
                // v3's index is a number.
                dispersion: None,
                roughness: roughness_or(set, names, Param::Constant([0.0; 3]))?,
            }
        }
        (Dialect::V4, "dielectric") => {
            let (eta, dispersion) = index(set, names, "eta")?;
            MaterialKind::Dielectric {
                reflectance: Param::Constant([1.0; 3]),
                transmittance: Param::Constant([1.0; 3]),
                eta,
                dispersion,
                roughness: roughness(set, names, 0.0)?,
            }
        }
        (Dialect::V4, "thindielectric") => {
            let (eta, dispersion) = index(set, names, "eta")?;
            MaterialKind::ThinDielectric { eta, dispersion }
        }
        (Dialect::V4, "diffusetransmission") => {
            let one = Param::Constant([1.0; 3]);
            MaterialKind::DiffuseTransmission {
                reflectance: [color_param_or(set, names, "reflectance", 0.25)?, one],
                transmittance: [color_param_or(set, names, "transmittance", 0.25)?, one],
                // Finite in `f32`, too: times 0 it must be 0.
                scale: (set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32).min(f32::MAX),
            }
        }
        (Dialect::V3, "substrate") => MaterialKind::Substrate {
            diffuse: color_param_or(set, names, "Kd", 0.5)?,
            specular: color_param_or(set, names, "Ks", 0.5)?,
            // It has no "roughness" for both directions.
            roughness: roughness_or(set, names, Param::Constant([0.1; 3]))?,
        },
        (dialect, other) => {
            let supported = match dialect {
                Dialect::V3 => {
                    "matte, mirror, metal, glass, plastic, substrate, translucent, uber, mix or none"
                }
                Dialect::V4 => {
                    "diffuse, conductor, dielectric, thindielectric, diffusetransmission, coateddiffuse, coatedconductor, mix or interface"
                }
            };
            return Err(match instead_of(other) {
                Some(instead) => set.error(format_args!(
                    "this material is not supported; use {instead} (supported: {supported})"
                )),
                None => set.error(format_args!(
                    "material \"{other}\" is unknown; use {supported}"
                )),
            });
        }
    };
    set.accept(&["type"]);
    Ok(Built::One(material))
}

/// Of v4's conductors: `reflectance`, or `eta` and `k`, whose names begin with `prefix`.
pub(super) fn conductor_fresnel(
    set: &ParamSet,
    names: &TextureNames,
    prefix: &str,
) -> Result<ConductorFresnel, SceneError> {
    let given = |name: &str| set.has(&format!("{prefix}{name}"));
    match color_param(set, names, "reflectance", Use::Albedo)? {
        Some(_) if given("eta") || given("k") => Err(set.error(format_args!(
            "\"reflectance\" and \"{prefix}eta\" or \"{prefix}k\" exclude each other; give one"
        ))),
        Some(reflectance) => Ok(ConductorFresnel::Reflectance(reflectance)),
        None => eta_k(set, names, prefix),
    }
}

/// What tilts the shading normals of a material of type `kind`.
pub(super) fn bump(
    kind: &str,
    set: &ParamSet,
    names: &TextureNames,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Option<Bump>, SceneError> {
    if matches!(kind, "" | "none" | "interface") {
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

fn eta_k(
    set: &ParamSet,
    names: &TextureNames,
    prefix: &str,
) -> Result<ConductorFresnel, SceneError> {
    // Copper is pbrt's default metal; the dialects reduce its spectra differently.
    let or_copper = |name: &str| -> Result<Param, SceneError> {
        if let Some(param) = color_param(set, names, &format!("{prefix}{name}"), Use::Index)? {
            return Ok(param);
        }
        let copper = match set.dialect {
            Dialect::V3 => spectrum::named_spd_file(&format!("Cu.{name}.spd")),
            Dialect::V4 => spectrum::named(&format!("metal-Cu-{name}")),
        };
        let copper = copper.ok_or_else(|| set.error(format_args!("needs \"{name}\"")))?;
        Ok(Param::Constant(copper))
    };
    Ok(ConductorFresnel::EtaK {
        eta: or_copper("eta")?,
        k: or_copper("k")?,
    })
}

/// Of `roughness`, `uroughness` and `vroughness`.
pub(super) fn roughness(
    set: &ParamSet,
    names: &TextureNames,
    default: f32,
) -> Result<Roughness, SceneError> {
    let both = float_param_or(set, names, "roughness", default)?;
    roughness_or(set, names, both)
}

/// Of `uroughness` and `vroughness`, or `both`.
fn roughness_or(
    set: &ParamSet,
    names: &TextureNames,
    both: Param,
) -> Result<Roughness, SceneError> {
    let u = float_param(set, names, "uroughness")?.unwrap_or(both);
    let v = float_param(set, names, "vroughness")?.unwrap_or(both);
    remapped(set, u, v)
}

/// Of a material that has no other parameter for it than `roughness`.
pub(super) fn isotropic(
    set: &ParamSet,
    names: &TextureNames,
    default: f32,
) -> Result<Roughness, SceneError> {
    let both = float_param_or(set, names, "roughness", default)?;
    remapped(set, both, both)
}

fn remapped(set: &ParamSet, u: Param, v: Param) -> Result<Roughness, SceneError> {
    for value in [u, v] {
        if let Param::Constant([x, ..]) = value
            && x < 0.0
        {
            return Err(set.error(format_args!("roughness {x} is negative")));
        }
    }
    let remap = match (set.bool_or("remaproughness", true)?, set.dialect) {
        (false, _) => Remap::None,
        (true, Dialect::V3) => Remap::V3,
        (true, Dialect::V4) => Remap::V4,
    };
    Ok(Roughness { u, v, remap })
}

/// v3's `eta` or, in its absence, `index`.
pub(super) fn glass_index(set: &ParamSet, names: &TextureNames) -> Result<Param, SceneError> {
    let eta = match float_param(set, names, "eta")? {
        Some(eta) => eta,
        None => float_param_or(set, names, "index", 1.5)?,
    };
    positive(set, eta)
}

/// The wavelength that an index of refraction is given for where it is one number (helium d), in
/// nanometres.
const D_LINE: f32 = 587.56;

/// v4's index of a dielectric, a number or a spectrum, and how it depends on the wavelength, if it
/// does.
pub(super) fn index(
    set: &ParamSet,
    names: &TextureNames,
    name: &str,
) -> Result<(Param, Option<Arc<IndexCurve>>), SceneError> {
    if let Some(param) = set.find(name)
        && let Some(curve) = set.index_curve(param)?
    {
        let eta = positive(set, Param::Constant([curve.at(D_LINE); 3]))?;
        return Ok((eta, Some(Arc::new(curve))));
    }
    Ok((grey_index(set, names, name)?, None))
}

fn grey_index(set: &ParamSet, names: &TextureNames, name: &str) -> Result<Param, SceneError> {
    let is_number = set
        .find(name)
        .is_some_and(|p| p.ty == super::params::Type::Float);
    let eta = if is_number {
        float_param(set, names, name)?
    } else {
        // A colour is no spectrum: the index is one number, that of its green.
        color_param(set, names, name, Use::Index)?.map(|eta| match eta {
            Param::Constant(c) => Param::Constant([c[1]; 3]),
            texture => texture,
        })
    };
    positive(set, eta.unwrap_or(Param::Constant([1.5; 3])))
}

fn positive(set: &ParamSet, eta: Param) -> Result<Param, SceneError> {
    match eta {
        // v4 reads an index of 0 as "no change".
        Param::Constant([0.0, ..]) if set.dialect == Dialect::V4 => Ok(Param::Constant([1.0; 3])),
        Param::Constant([x, ..]) if x <= 0.0 => Err(set.error(format_args!(
            "index of refraction {x} is not positive; glass has 1.5"
        ))),
        eta => Ok(eta),
    }
}

/// Whether evaluating a material depends on texture coordinates (or the tangents derived from
/// them). `below` says it of the materials that this one is made of.
pub(super) fn needs_uv(
    kind: &MaterialKind,
    textures: &[Texture],
    below: &dyn Fn(u32) -> bool,
) -> bool {
    let textured = |p: &Param| p.uses_uv(textures);
    let anisotropic = |r: &Roughness| r.u != r.v || textured(&r.u);
    match kind {
        MaterialKind::Diffuse { reflectance, sigma } => textured(reflectance) || textured(sigma),
        MaterialKind::Mirror { reflectance } => textured(reflectance),
        MaterialKind::Conductor { fresnel, roughness } => {
            let fresnel = match fresnel {
                ConductorFresnel::EtaK { eta, k } => textured(eta) || textured(k),
                ConductorFresnel::Reflectance(r) => textured(r),
            };
            fresnel || anisotropic(roughness)
        }
        MaterialKind::Dielectric {
            reflectance,
            transmittance,
            eta,
            dispersion: _,
            roughness,
        } => {
            textured(reflectance)
                || textured(transmittance)
                || textured(eta)
                || anisotropic(roughness)
        }
        MaterialKind::Plastic {
            diffuse,
            specular,
            roughness,
        }
        | MaterialKind::Substrate {
            diffuse,
            specular,
            roughness,
        } => textured(diffuse) || textured(specular) || anisotropic(roughness),
        MaterialKind::ThinDielectric { eta, .. } => textured(eta),
        MaterialKind::DiffuseTransmission {
            reflectance,
            transmittance,
            ..
        } => reflectance.iter().chain(transmittance).any(textured),
        MaterialKind::CoatedDiffuse { reflectance, coat } => {
            textured(reflectance) || coat.alphas[0] != coat.alphas[1]
        }
        MaterialKind::CoatedConductor { alphas, coat, .. } => {
            alphas[0] != alphas[1] || coat.alphas[0] != coat.alphas[1]
        }
        MaterialKind::TexturedCoat {
            base, interface, ..
        } => {
            let base = match base {
                CoatedBase::Diffuse(reflectance) => textured(reflectance),
                CoatedBase::Conductor { fresnel, roughness } => {
                    anisotropic(roughness)
                        || match fresnel {
                            ConductorFresnel::EtaK { eta, k } => textured(eta) || textured(k),
                            ConductorFresnel::Reflectance(r) => textured(r),
                        }
                }
            };
            base || anisotropic(interface)
        }
        MaterialKind::Coat { .. } => false,
        MaterialKind::Mixture { components } => components.iter().any(|c| {
            below(c.material) || textured(&c.weight.param()) || c.albedo.iter().any(textured)
        }),
        MaterialKind::Interface => false,
    }
}

/// Whether turning the tangents of a surface around its normal changes what it looks like. `below`
/// says it of the materials that this one is made of.
pub(super) fn sees_tangents(kind: &MaterialKind, below: &dyn Fn(u32) -> bool) -> bool {
    let uneven = |alphas: [f32; 2]| alphas[0] != alphas[1];
    match kind {
        MaterialKind::Conductor { roughness, .. }
        | MaterialKind::Dielectric { roughness, .. }
        | MaterialKind::Plastic { roughness, .. }
        | MaterialKind::Substrate { roughness, .. } => roughness.u != roughness.v,
        MaterialKind::CoatedDiffuse { coat, .. } => uneven(coat.alphas),
        MaterialKind::CoatedConductor { alphas, coat, .. } => {
            uneven(*alphas) || uneven(coat.alphas)
        }
        MaterialKind::Mixture { components } => components.iter().any(|c| below(c.material)),
        _ => false,
    }
}
