//! The kinds of textures.

use glam::DVec3;

use super::image::{image_map, note_filtering};
use super::mapping::{Ctm, mapping, solid};
use super::{Class, Tables, TextureNames, color_param, float_param_or};
use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::params::ParamSet;
use crate::scene::{MarbleSpline, Octaves, Param, Rgb, Texture};

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
    // A child of the texture's own class.
    let child = |name: &str, default: f32| -> Result<Param, SceneError> {
        match class {
            Class::Float => float_param_or(set, names, name, default),
            Class::Color => Ok(color_param(set, names, name, Use::Unbounded)?
                .unwrap_or(Param::Constant([default; 3]))),
        }
    };
    let texture = match kind {
        "constant" => child("value", 1.0)?,
        "scale" => {
            let (a, b) = match set.dialect {
                Dialect::V3 => (child("tex1", 1.0)?, child("tex2", 1.0)?),
                Dialect::V4 => (
                    child("tex", 1.0)?,
                    float_param_or(set, names, "scale", 1.0)?,
                ),
            };
            match (a, b) {
                (Param::Constant(a), Param::Constant(b)) => {
                    Param::Constant(zip(a, b, |a, b| a * b))
                }
                (Param::Constant([1.0, 1.0, 1.0]), x) | (x, Param::Constant([1.0, 1.0, 1.0])) => x,
                _ => tables.push(Texture::Scale { a, b }.into(), set)?,
            }
        }
        "mix" => {
            let (a, b) = (child("tex1", 0.0)?, child("tex2", 1.0)?);
            let amount = float_param_or(set, names, "amount", 0.5)?;
            match (a, b, amount) {
                (Param::Constant(a), Param::Constant(b), Param::Constant([t, ..])) => {
                    Param::Constant(zip(a, b, |a, b| (1.0 - t) * a + t * b))
                }
                _ => tables.push(Texture::Mix { a, b, amount }.into(), set)?,
            }
        }
        "directionmix" => {
            let (a, b) = (child("tex1", 0.0)?, child("tex2", 1.0)?);
            let world = ctm
                .clone()?
                .transform_vector3(set.vector_or("dir", DVec3::Y)?);
            // Scaled first: the square of its length may be zero or infinite.
            let unit = (world / world.abs().max_element()).try_normalize();
            let direction = unit.ok_or_else(|| {
                set.error("its \"dir\" has no direction under the current transform")
            })?;
            if a == b {
                a
            } else {
                let direction = direction.as_vec3().to_array();
                tables.push(Texture::DirectionMix { a, b, direction }.into(), set)?
            }
        }
        "checkerboard" => {
            let (a, b) = (child("tex1", 1.0)?, child("tex2", 0.0)?);
            let texture = if set.int_in("dimension", 2, 2, 3)? == 2 {
                if set.dialect == Dialect::V3 {
                    note_filtering(set, &["aamode"], report);
                }
                mapping(set, ctm)?.map(|mapping| Texture::Checkerboard { a, b, mapping })
            } else {
                solid(set, ctm)?.map(|to_texture| Texture::Blocks { a, b, to_texture })
            };
            if a == b {
                a
            } else {
                tables.push(texture, set)?
            }
        }
        "dots" => {
            // pbrt-v3 and pbrt-v4 both take the two for each other when they make the texture, so
            // that the dots are what is called "outside", and scenes are made to look
            // right with it.
            let (ground, dot) = (child("inside", 1.0)?, child("outside", 0.0)?);
            let texture = mapping(set, ctm)?.map(|mapping| Texture::Dots {
                dot,
                ground,
                mapping,
            });
            if dot == ground {
                dot
            } else {
                tables.push(texture, set)?
            }
        }
        "bilerp" => {
            let corner = |name: &str, default: f32| -> Result<Rgb, SceneError> {
                let given = match class {
                    Class::Float => set.float(name)?.map(|x| [x as f32; 3]),
                    Class::Color => set.color(name, Use::Unbounded)?,
                };
                Ok(given.unwrap_or([default; 3]))
            };
            let (v00, v01) = (corner("v00", 0.0)?, corner("v01", 1.0)?);
            let (v10, v11) = (corner("v10", 0.0)?, corner("v11", 1.0)?);
            let texture = mapping(set, ctm)?.map(|mapping| Texture::Bilerp {
                v00,
                v01,
                v10,
                v11,
                mapping,
            });
            tables.push(texture, set)?
        }
        "uv" => tables.push(
            mapping(set, ctm)?.map(|mapping| Texture::Uv { mapping }),
            set,
        )?,
        "fbm" => {
            let octaves = octaves(set)?;
            let texture = solid(set, ctm)?.map(|to_texture| Texture::Fbm {
                octaves,
                to_texture,
            });
            tables.push(texture, set)?
        }
        "wrinkled" => {
            let octaves = octaves(set)?;
            let texture = solid(set, ctm)?.map(|to_texture| Texture::Wrinkled {
                octaves,
                to_texture,
            });
            tables.push(texture, set)?
        }
        "windy" => tables.push(
            solid(set, ctm)?.map(|to_texture| Texture::Windy { to_texture }),
            set,
        )?,
        "marble" => {
            let octaves = octaves(set)?;
            let scale = set.float_or("scale", 1.0)? as f32;
            let variation = set.float_or("variation", 0.2)? as f32;
            let spline = match set.dialect {
                Dialect::V3 => MarbleSpline::V3,
                Dialect::V4 => MarbleSpline::V4,
            };
            let texture = solid(set, ctm)?.map(|to_texture| Texture::Marble {
                octaves,
                scale,
                variation,
                spline,
                to_texture,
            });
            tables.push(texture, set)?
        }
        // Of the kinds that there are, the last.
        _ => image_map(class, set, ctm, tables, report)?,
    };
    set.finish(report);
    Ok(texture)
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
