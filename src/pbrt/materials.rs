//! Materials of both dialects, reduced to the kinds of [`MaterialKind`].
//!
//! A material of one BSDF is read by the file of that BSDF ([`table`]). Those that are made of
//! several, or of one or the other, are read here, in `mixtures` and in `coats`.

use super::coats;
use super::color::Use;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::mixtures;
use super::params::ParamSet;
use super::spectrum;
use super::state::{MaterialDef, MaterialNames};
use super::textures::{Channels, Tables, TextureNames, color_param, float_param};
use crate::pbrt::image::Encoding;
use crate::scene::spectrum::IndexCurve;
use crate::scene::{Bump, MaterialKind, Param, Parameters, Rgb, Tangents, Weight};
use crate::surface::table;
use std::fmt;
use std::rc::Rc;

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
            Self::One(kind) => kind.bytes() + kind.dispersion().map_or(0, |_| CURVE_BYTES),
            Self::Mixture(parts) => (parts.iter())
                .map(|part| size_of::<Part>() + part.material.bytes() + CURVE_BYTES / 8)
                .sum(),
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

impl PartMaterial {
    fn bytes(&self) -> usize {
        match self {
            Self::Own(kind) => kind.bytes(),
            Self::Named(_) => 0,
        }
    }
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
    let built = match (set.dialect, kind) {
        (_, "mix") => mixtures::mix(set, names, materials)?,
        (Dialect::V4, "coateddiffuse") => coats::diffuse(set, names)?,
        (Dialect::V4, "coatedconductor") => coats::conductor(set, names)?,
        (Dialect::V3, "uber") => mixtures::uber(set, names)?,
        (Dialect::V3, "translucent") => mixtures::translucent(set, names)?,
        (_, "" | "none") | (Dialect::V4, "interface") => Built::One(MaterialKind::Interface),
        _ => match table::read(kind, &Given { set, names }) {
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
    match instead_of(kind) {
        Some(instead) => set.error(format_args!(
            "this material is not supported; use {instead} (supported: {supported})"
        )),
        None => set.error(format_args!(
            "material \"{kind}\" is unknown; use {supported}"
        )),
    }
}

/// The parameters of a directive, and the textures that they may name.
pub(super) struct Given<'a> {
    pub set: &'a ParamSet,
    pub names: &'a TextureNames,
}

impl Parameters for Given<'_> {
    type Error = SceneError;

    fn dialect(&self) -> Dialect {
        self.set.dialect
    }

    fn has(&self, name: &str) -> bool {
        self.set.has(name)
    }

    fn error(&self, message: impl fmt::Display) -> SceneError {
        self.set.error(message)
    }

    fn albedo(&self, name: &str) -> Result<Option<Param>, SceneError> {
        color_param(self.set, self.names, name, Use::Albedo)
    }

    fn float(&self, name: &str) -> Result<Option<Param>, SceneError> {
        float_param(self.set, self.names, name)
    }

    fn constant(&self, name: &str, default: f64, low: f64, high: f64) -> Result<f64, SceneError> {
        self.set.float_in(name, default, low, high)
    }

    fn flag(&self, name: &str, default: bool) -> Result<bool, SceneError> {
        self.set.bool_or(name, default)
    }

    fn index(&self, name: &str) -> Result<Option<Param>, SceneError> {
        color_param(self.set, self.names, name, Use::Index)
    }

    fn grey_index(&self, name: &str) -> Result<Option<Param>, SceneError> {
        let given = self.set.find(name);
        if given.is_some_and(|p| p.ty == super::params::Type::Float) {
            return self.float(name);
        }
        // A colour is no spectrum: the index is one number, that of its green.
        Ok(self.index(name)?.map(|eta| match eta {
            Param::Constant(c) => Param::Constant([c[1]; 3]),
            texture => texture,
        }))
    }

    fn index_curve(&self, name: &str) -> Result<Option<IndexCurve>, SceneError> {
        match self.set.find(name) {
            Some(given) => self.set.index_curve(given),
            None => Ok(None),
        }
    }

    fn known_index(&self, name: &str) -> Option<Rgb> {
        match self.set.dialect {
            Dialect::V3 => spectrum::named_spd_file(name),
            Dialect::V4 => spectrum::named(name),
        }
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
