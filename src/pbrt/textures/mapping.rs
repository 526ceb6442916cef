//! How textures lie on surfaces and in space.

use glam::{DAffine3, DMat3, DVec3};

use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::SceneError;
use crate::pbrt::params::ParamSet;
use crate::pbrt::transform::inverse;
use crate::scene::{Mapping, ToTexture, UvMapping};

/// The current transform where the texture is made, texture to world space, or why there is none.
pub(in crate::pbrt) type Ctm = Result<DAffine3, SceneError>;

/// Something with a map from internal space in it that is not known before the scene is; until then
/// it is [`UNPLACED`].
pub struct Mapped<T> {
    pub what: T,
    /// World to texture space, if it has such a map.
    pub to_texture: Option<DAffine3>,
}

impl<T> Mapped<T> {
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Mapped<U> {
        Mapped {
            what: f(self.what),
            to_texture: self.to_texture,
        }
    }
}

impl<T> From<T> for Mapped<T> {
    /// Of something without such a map.
    fn from(what: T) -> Self {
        Self {
            what,
            to_texture: None,
        }
    }
}

/// Stands in for a map from internal space.
const UNPLACED: ToTexture = [[0.0; 4]; 3];

/// The mapping to `(s, t)` that a texture's parameters describe.
pub fn mapping(set: &ParamSet, ctm: &Ctm) -> Result<Mapped<Mapping>, SceneError> {
    let (what, to_texture) = match set.string("mapping")?.unwrap_or("uv") {
        "uv" => {
            let uv = UvMapping {
                su: set.float_or("uscale", 1.0)? as f32,
                sv: set.float_or("vscale", 1.0)? as f32,
                du: set.float_or("udelta", 0.0)? as f32,
                dv: set.float_or("vdelta", 0.0)? as f32,
            };
            (Mapping::Uv(uv), None)
        }
        "spherical" => (
            Mapping::Spherical(UNPLACED),
            Some(world_to_texture(set, ctm)?),
        ),
        "cylindrical" => {
            let mapping = Mapping::Cylindrical {
                to_texture: UNPLACED,
                unit: set.dialect == Dialect::V3,
            };
            (mapping, Some(world_to_texture(set, ctm)?))
        }
        "planar" => {
            // The transform came with v4.
            let to_texture = match set.dialect {
                Dialect::V3 => DAffine3::IDENTITY,
                Dialect::V4 => world_to_texture(set, ctm)?,
            };
            let plane = DAffine3 {
                matrix3: DMat3::from_cols(
                    set.vector_or("v1", DVec3::X)?,
                    set.vector_or("v2", DVec3::Y)?,
                    DVec3::ZERO,
                )
                .transpose(),
                translation: DVec3::new(
                    set.float_or("udelta", 0.0)?,
                    set.float_or("vdelta", 0.0)?,
                    0.0,
                ),
            };
            (Mapping::Planar(UNPLACED), Some(plane * to_texture))
        }
        other => {
            // pbrt's own default, scale 1; it looks at none of the parameters.
            set.accept(&["uscale", "vscale", "udelta", "vdelta", "v1", "v2"]);
            set.note(format_args!(
                "texture mapping \"{other}\" is unknown; uv is used, without its scales"
            ));
            (
                Mapping::Uv(UvMapping {
                    su: 1.0,
                    sv: 1.0,
                    du: 0.0,
                    dv: 0.0,
                }),
                None,
            )
        }
    };
    Ok(Mapped { what, to_texture })
}

/// Where a texture over points looks them up.
pub fn solid(set: &ParamSet, ctm: &Ctm) -> Result<Mapped<ToTexture>, SceneError> {
    let to_texture = match set.dialect {
        // pbrt-v3 hands `IdentityMapping3D` the transform and not its inverse, and scenes are made
        // to look right with it.
        Dialect::V3 => ctm.clone()?,
        Dialect::V4 => world_to_texture(set, ctm)?,
    };
    Ok(Mapped {
        what: UNPLACED,
        to_texture: Some(to_texture),
    })
}

fn world_to_texture(set: &ParamSet, ctm: &Ctm) -> Result<DAffine3, SceneError> {
    inverse(ctm.as_ref().map_err(Clone::clone)?)
        .ok_or_else(|| set.error("the current transform has no inverse to map the texture by"))
}
