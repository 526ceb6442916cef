//! The kinds of textures.

use glam::DVec3;

use super::image::{image_map, note_filtering};
use super::mapping::{Ctm, mapping, solid};
use super::{Class, Tables, TextureNames, color_param, float_param_or};
use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::params::ParamSet;
use crate::scene::{Mapping, MarbleSpline, Octaves, Param, Rgb, Texture, ToTexture};

/// Beyond this an octave has no digits left: 1.99^64 is 10^19.
const MAX_OCTAVES: i64 = 64;

/// Builds the texture of a `Texture "name" "class" "kind"` directive made under the transform
/// `ctm`; constants need no entry in the table.
pub(in crate::pbrt) fn build(
    kind: &str,
    class: Class,
    set: &ParamSet,
    ctm: &Ctm,
    names: &TextureNames,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Param, SceneError> {
    exists(kind, class, set)?;
    let mut making = Making {
        class,
        set,
        ctm,
        names,
        tables,
        report,
    };
    let texture = making.texture(kind)?;
    set.finish(report);
    Ok(texture)
}

/// A texture under way.
struct Making<'a> {
    class: Class,
    set: &'a ParamSet,
    ctm: &'a Ctm,
    names: &'a TextureNames,
    tables: &'a mut Tables,
    report: &'a mut Report,
}

impl Making<'_> {
    fn texture(&mut self, kind: &str) -> Result<Param, SceneError> {
        match kind {
            "constant" => self.child("value", 1.0),
            "scale" => self.scale(),
            "mix" => self.mix(),
            "directionmix" => self.direction_mix(),
            "checkerboard" => self.checkerboard(),
            "dots" => self.dots(),
            "bilerp" => self.bilerp(),
            "uv" => self.planar(|mapping| Texture::Uv { mapping }),
            "fbm" => {
                let octaves = octaves(self.set)?;
                self.solid(|to_texture| Texture::Fbm {
                    octaves,
                    to_texture,
                })
            }
            "wrinkled" => {
                let octaves = octaves(self.set)?;
                self.solid(|to_texture| Texture::Wrinkled {
                    octaves,
                    to_texture,
                })
            }
            "windy" => self.solid(|to_texture| Texture::Windy { to_texture }),
            "marble" => self.marble(),
            // Of the kinds that there are, the last.
            _ => image_map(self.class, self.set, self.ctm, self.tables, self.report),
        }
    }

    /// A child of the texture's own class.
    fn child(&self, name: &str, default: f32) -> Result<Param, SceneError> {
        match self.class {
            Class::Float => float_param_or(self.set, self.names, name, default),
            Class::Color => Ok(color_param(self.set, self.names, name, Use::Unbounded)?
                .unwrap_or(Param::Constant([default; 3]))),
        }
    }

    fn number(&self, name: &str, default: f32) -> Result<Param, SceneError> {
        float_param_or(self.set, self.names, name, default)
    }

    /// A texture over texture coordinates or what stands in for them.
    fn planar(&mut self, of: impl FnOnce(Mapping) -> Texture) -> Result<Param, SceneError> {
        self.tables
            .push(mapping(self.set, self.ctm)?.map(of), self.set)
    }

    /// A texture over points.
    fn solid(&mut self, of: impl FnOnce(ToTexture) -> Texture) -> Result<Param, SceneError> {
        self.tables
            .push(solid(self.set, self.ctm)?.map(of), self.set)
    }

    fn scale(&mut self) -> Result<Param, SceneError> {
        let (a, b) = match self.set.dialect {
            Dialect::V3 => (self.child("tex1", 1.0)?, self.child("tex2", 1.0)?),
            Dialect::V4 => (self.child("tex", 1.0)?, self.number("scale", 1.0)?),
        };
        match (a, b) {
            (Param::Constant(a), Param::Constant(b)) => {
                Ok(Param::Constant(zip(a, b, |a, b| a * b)))
            }
            (Param::Constant([1.0, 1.0, 1.0]), x) | (x, Param::Constant([1.0, 1.0, 1.0])) => Ok(x),
            _ => self.tables.push(Texture::Scale { a, b }.into(), self.set),
        }
    }

    fn mix(&mut self) -> Result<Param, SceneError> {
        let (a, b) = (self.child("tex1", 0.0)?, self.child("tex2", 1.0)?);
        let amount = self.number("amount", 0.5)?;
        match (a, b, amount) {
            (Param::Constant(a), Param::Constant(b), Param::Constant([t, ..])) => {
                Ok(Param::Constant(zip(a, b, |a, b| (1.0 - t) * a + t * b)))
            }
            _ => self
                .tables
                .push(Texture::Mix { a, b, amount }.into(), self.set),
        }
    }

    fn direction_mix(&mut self) -> Result<Param, SceneError> {
        let (a, b) = (self.child("tex1", 0.0)?, self.child("tex2", 1.0)?);
        let world = (self.ctm.clone()?).transform_vector3(self.set.vector_or("dir", DVec3::Y)?);
        // Scaled first: the square of its length may be zero or infinite.
        let unit = (world / world.abs().max_element()).try_normalize();
        let direction = unit.ok_or_else(|| {
            (self.set).error("its \"dir\" has no direction under the current transform")
        })?;
        if a == b {
            return Ok(a);
        }
        let direction = direction.as_vec3().to_array();
        let texture = Texture::DirectionMix { a, b, direction };
        self.tables.push(texture.into(), self.set)
    }

    fn checkerboard(&mut self) -> Result<Param, SceneError> {
        let (set, ctm) = (self.set, self.ctm);
        let (a, b) = (self.child("tex1", 1.0)?, self.child("tex2", 0.0)?);
        let texture = if set.int_in("dimension", 2, 2, 3)? == 2 {
            if set.dialect == Dialect::V3 {
                note_filtering(set, &["aamode"], self.report);
            }
            mapping(set, ctm)?.map(|mapping| Texture::Checkerboard { a, b, mapping })
        } else {
            solid(set, ctm)?.map(|to_texture| Texture::Blocks { a, b, to_texture })
        };
        if a == b {
            return Ok(a);
        }
        self.tables.push(texture, set)
    }

    fn dots(&mut self) -> Result<Param, SceneError> {
        // pbrt-v3 and pbrt-v4 both take the two for each other when they make the texture, so that
        // the dots are what is called "outside", and scenes are made to look right with it.
        let (ground, dot) = (self.child("inside", 1.0)?, self.child("outside", 0.0)?);
        let texture = mapping(self.set, self.ctm)?.map(|mapping| Texture::Dots {
            dot,
            ground,
            mapping,
        });
        if dot == ground {
            return Ok(dot);
        }
        self.tables.push(texture, self.set)
    }

    fn bilerp(&mut self) -> Result<Param, SceneError> {
        let corner = |name: &str, default: f32| -> Result<Rgb, SceneError> {
            let given = match self.class {
                Class::Float => self.set.float(name)?.map(|x| [x as f32; 3]),
                Class::Color => self.set.color(name, Use::Unbounded)?,
            };
            Ok(given.unwrap_or([default; 3]))
        };
        let (v00, v01) = (corner("v00", 0.0)?, corner("v01", 1.0)?);
        let (v10, v11) = (corner("v10", 0.0)?, corner("v11", 1.0)?);
        self.planar(|mapping| Texture::Bilerp {
            v00,
            v01,
            v10,
            v11,
            mapping,
        })
    }

    fn marble(&mut self) -> Result<Param, SceneError> {
        let octaves = octaves(self.set)?;
        let scale = self.set.float_or("scale", 1.0)? as f32;
        let variation = self.set.float_or("variation", 0.2)? as f32;
        let spline = match self.set.dialect {
            Dialect::V3 => MarbleSpline::V3,
            Dialect::V4 => MarbleSpline::V4,
        };
        self.solid(|to_texture| Texture::Marble {
            octaves,
            scale,
            variation,
            spline,
            to_texture,
        })
    }
}

/// An error unless the dialect has textures of this kind and class, and they are supported.
fn exists(kind: &str, class: Class, set: &ParamSet) -> Result<(), SceneError> {
    use Class::{Color, Float};
    use Dialect::{V3, V4};
    let error = match (kind, set.dialect, class) {
        (
            "constant" | "scale" | "mix" | "checkerboard" | "dots" | "bilerp" | "imagemap",
            _,
            _,
        )
        | ("directionmix", V4, _)
        | ("fbm" | "wrinkled" | "windy", V3, _)
        | ("fbm" | "wrinkled" | "windy", V4, Float)
        | ("marble", _, Color)
        | ("uv", V3, Color) => return Ok(()),
        ("fbm" | "wrinkled" | "windy", V4, Color) => {
            set.error("is a number in pbrt-v4; declare it \"float\", or mix two colours by it")
        }
        ("marble", _, Float) | ("uv", V3, Float) => {
            set.error("is a colour; declare it \"spectrum\"")
        }
        ("uv", V4, _) => set.error("is of pbrt-v3; use bilerp"),
        ("directionmix", V3, _) => set.error("is of pbrt-v4; use mix"),
        ("ptex", _, _) => set.error("Ptex is not supported; bake it into an image"),
        _ => set.error(format_args!(
            "texture \"{kind}\" is unknown; use constant, scale, mix, {}checkerboard, dots, bilerp, fbm, wrinkled, windy, \
             marble or imagemap",
            match set.dialect {
                V3 => "uv, ",
                V4 => "directionmix, ",
            }
        )),
    };
    Err(error)
}

fn octaves(set: &ParamSet) -> Result<Octaves, SceneError> {
    Ok(Octaves {
        count: set.int_in("octaves", 8, 0, MAX_OCTAVES)? as u32,
        roughness: set.float_or("roughness", 0.5)? as f32,
    })
}

fn zip(a: Rgb, b: Rgb, f: impl Fn(f32, f32) -> f32) -> Rgb {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}
