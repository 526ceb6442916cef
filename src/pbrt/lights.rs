//! `LightSource` and `AreaLightSource`.
//!
//! v4 gives every light a photometric unit: its spectrum is divided by the luminous efficacy, then `power` (lumen) or
//! `illuminance` (lux) replace that unit. In linear sRGB this comes to: `rgb` values stand as they are, other spectra have
//! luminance 1 (`Use::Emission`), and `power` divides by the geometric factor alone, as pbrt does.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::color::Use;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::params::ParamSet;
use super::textures::{Channels, Tables};
use super::transform::{narrow_point, similarity};
use crate::pbrt::image::Encoding;
use crate::scene::Image;
use crate::scene::spectrum::luminance;
use crate::scene::{EnvLayout, Filtering, Light, LightKind, Rgb, Space, SpotFalloff};

/// A light that is no surface, in world space.
#[derive(Clone, Debug)]
pub(super) struct WorldLight {
    origin: String,
    kind: WorldLightKind,
}

#[derive(Clone, Debug)]
enum WorldLightKind {
    Point {
        p: DVec3,
        i: Rgb,
    },
    Spot {
        p: DVec3,
        axis: DVec3,
        i: Rgb,
        versine_total: f64,
        versine_full: f64,
        falloff: SpotFalloff,
    },
    Goniometric {
        p: DVec3,
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        layout: EnvLayout,
    },
    Projection {
        p: DVec3,
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        extent: [f64; 2],
        filtering: Filtering,
    },
    Distant {
        direction: DVec3,
        l: Rgb,
    },
    Constant {
        l: Rgb,
    },
    Image {
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        layout: EnvLayout,
    },
}

impl WorldLight {
    /// Memory that it takes here, and in the table of the scene.
    pub fn bytes(&self) -> u64 {
        2 * (size_of::<Self>() + size_of::<Light>() + self.origin.len() + 16) as u64
    }

    /// Where it is, if it shines from a point.
    pub fn position(&self) -> Option<DVec3> {
        match self.kind {
            WorldLightKind::Point { p, .. }
            | WorldLightKind::Spot { p, .. }
            | WorldLightKind::Goniometric { p, .. }
            | WorldLightKind::Projection { p, .. } => Some(p),
            _ => None,
        }
    }

    /// The same light in internal space. Lengths shrink by the scale, and so must the square root of intensities.
    pub fn to_internal(&self, space: &Space) -> Light {
        let point = |p: DVec3| narrow_point((p - space.centre) * space.scale);
        let intensity =
            |i: Rgb| i.map(|c| ((f64::from(c) * space.scale * space.scale) as f32).min(f32::MAX));
        let unit = |v: DVec3| v.as_vec3().normalize_or(Vec3::Z);
        let rows = |m: DMat3| m.transpose().as_mat3().to_cols_array_2d();
        let kind = match self.kind {
            WorldLightKind::Point { p, i } => LightKind::Point {
                p: point(p),
                i: intensity(i),
            },
            WorldLightKind::Spot {
                p,
                axis,
                i,
                versine_total,
                versine_full,
                falloff,
            } => LightKind::Spot {
                p: point(p),
                axis: unit(axis),
                i: intensity(i),
                versine_total: versine_total as f32,
                versine_full: versine_full as f32,
                falloff,
            },
            WorldLightKind::Goniometric {
                p,
                image,
                scale,
                to_light,
                layout,
            } => LightKind::Goniometric {
                p: point(p),
                image,
                scale: intensity(scale),
                to_light: rows(to_light),
                layout,
            },
            WorldLightKind::Projection {
                p,
                image,
                scale,
                to_light,
                extent,
                filtering,
            } => LightKind::Projection {
                p: point(p),
                image,
                scale: intensity(scale),
                to_light: rows(to_light),
                extent: extent.map(|x| x as f32),
                filtering,
            },
            WorldLightKind::Distant { direction, l } => LightKind::Distant {
                direction: unit(direction),
                l,
            },
            WorldLightKind::Constant { l } => LightKind::InfiniteConstant { l },
            WorldLightKind::Image {
                image,
                scale,
                to_light,
                layout,
            } => LightKind::InfiniteImage {
                image,
                scale,
                to_light: rows(to_light),
                layout,
            },
        };
        Light {
            origin: self.origin.clone(),
            kind,
        }
    }
}

/// Builds the light of a `LightSource` directive placed by `ctm`; `None` if it emits nothing.
pub(super) fn build(
    kind: &str,
    set: &ParamSet,
    ctm: &DAffine3,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Option<WorldLight>, SceneError> {
    let placed = |p: DVec3| {
        let p = ctm.transform_point3(p);
        if p.is_finite() {
            Ok(p)
        } else {
            Err(set.error("its position overflows"))
        }
    };
    let built = match kind {
        "point" => {
            let mut i = emission(set, "I")?;
            i = with_unit(set, i, "power", 4.0 * PI)?;
            let from = set.point_or("from", DVec3::ZERO)?;
            let p = match set.dialect {
                // v3 adds `from` to where the transform puts the origin, it does not transform it.
                Dialect::V3 => placed(DVec3::ZERO)? + from,
                Dialect::V4 => placed(from)?,
            };
            (i, WorldLightKind::Point { p, i })
        }
        "spot" => {
            let cone = set.float_in("coneangle", 30.0, 0.0, 180.0)?;
            let delta = set.float_in("conedeltaangle", 5.0, 0.0, 180.0)?;
            let (versine_total, versine_full) = (versine(cone), versine(cone - delta));
            let k = PI * (versine_full + versine_total);
            let mut i = with_unit(set, emission(set, "I")?, "power", k)?;
            if versine_total < MIN_VERSINE {
                report.warn_at(&set.site, "its cone is empty, so it sheds no light");
                i = [0.0; 3];
            }
            let from = set.point_or("from", DVec3::ZERO)?;
            let to = set.point_or("to", DVec3::Z)?;
            if similarity(ctm).is_none() {
                report.warn_at(
                    &set.site,
                    "the cone is circular; shear and stretch of the transform only move it",
                );
            }
            let axis = direction(set, ctm, to - from)?;
            let falloff = match set.dialect {
                Dialect::V3 => SpotFalloff::V3,
                Dialect::V4 => SpotFalloff::V4,
            };
            (
                i,
                WorldLightKind::Spot {
                    p: placed(from)?,
                    axis,
                    i,
                    versine_total,
                    versine_full,
                    falloff,
                },
            )
        }
        "distant" => {
            let mut l = emission(set, "L")?;
            l = with_unit(set, l, "illuminance", 1.0)?;
            let from = set.point_or("from", DVec3::ZERO)?;
            let to = set.point_or("to", DVec3::Z)?;
            (
                l,
                WorldLightKind::Distant {
                    direction: direction(set, ctm, to - from)?,
                    l,
                },
            )
        }
        "goniometric" => goniometric(set, ctm, placed(DVec3::ZERO)?, tables)?,
        "projection" => projection(set, ctm, placed(DVec3::ZERO)?, tables)?,
        "infinite" => infinite(set, ctm, tables, report)?,
        "exinfinite" if set.dialect == Dialect::V3 => infinite(set, ctm, tables, report)?,
        _ => {
            return Err(set.error(
                "this light is unknown; use point, spot, goniometric, projection, distant or infinite",
            ));
        }
    };
    set.accept(&["nsamples", "samples"]);
    set.finish(report);
    let (power, kind) = built;
    Ok((power != [0.0; 3]).then(|| WorldLight {
        origin: set.site.origin(),
        kind,
    }))
}

/// One minus the cosine below which a cone is empty: its density over solid angle would come near the ends of `f32`.
const MIN_VERSINE: f64 = 1e-30;

/// One minus the cosine of an angle in degrees, with all its digits however small the angle.
fn versine(degrees: f64) -> f64 {
    2.0 * (degrees.to_radians() / 2.0).sin().powi(2)
}

/// `name` times `scale`; the white of the colour space if there is no `name`.
fn emission(set: &ParamSet, name: &str) -> Result<Rgb, SceneError> {
    let value = set.color(name, Use::Emission)?;
    scaled(set, value.unwrap_or_else(|| set.color_space.illuminant()))
}

/// The same, of a light that may show an image in place of `name`. Images have a white of their own.
fn emission_or_image(set: &ParamSet, name: &str) -> Result<Rgb, SceneError> {
    match set.dialect {
        Dialect::V4 if names_image(set)? => scaled(set, [1.0; 3]),
        _ => emission(set, name),
    }
}

fn scaled(set: &ParamSet, value: Rgb) -> Result<Rgb, SceneError> {
    let scale = match (set.dialect, set.find("scale").map(|p| p.ty)) {
        // A v3 scale is a colour, yet many files write a plain number, as v4 does.
        (Dialect::V3, Some(ty)) if ty != super::params::Type::Float => {
            set.color("scale", Use::Unbounded)?.unwrap_or([1.0; 3])
        }
        _ => [set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32; 3],
    };
    Ok([
        value[0] * scale[0],
        value[1] * scale[1],
        value[2] * scale[2],
    ])
}

/// v4's `power` or `illuminance`: replaces the unit by a target that `k` units of the light reach.
fn with_unit(set: &ParamSet, value: Rgb, name: &str, k: f64) -> Result<Rgb, SceneError> {
    if set.dialect == Dialect::V3 {
        return Ok(value);
    }
    let target = set.float_or(name, -1.0)?;
    let factor = target / k;
    if target <= 0.0 {
        return Ok(value);
    }
    if !(factor as f32).is_finite() {
        return Err(set.error(format_args!(
            "\"{name}\" cannot be reached: the light has no extent"
        )));
    }
    Ok(value.map(|c| c * factor as f32))
}

fn direction(set: &ParamSet, ctm: &DAffine3, v: DVec3) -> Result<DVec3, SceneError> {
    ctm.transform_vector3(v).try_normalize().ok_or_else(|| {
        set.error("\"from\" and \"to\" are the same point, so the light has no direction")
    })
}

/// The image of a light: v3 `mapname`, v4 `filename`.
fn image_of<'a>(
    set: &ParamSet,
    channels: Channels,
    tables: &'a mut Tables,
) -> Result<Option<(u32, &'a Image)>, SceneError> {
    let name = match set.dialect {
        Dialect::V3 => "mapname",
        Dialect::V4 => "filename",
    };
    let Some(file) = set.string(name)?.filter(|f| !f.is_empty()) else {
        return Ok(None);
    };
    if set.dialect == Dialect::V3 && !set.dir.join(file).exists() {
        set.note(format_args!(
            "there is no file {}; the light is without an image, as in pbrt-v3",
            set.dir.join(file).display()
        ));
        return Ok(None);
    }
    // pbrt-v3 leaves the codes of files as they are, but for `imagemap` textures.
    let encoding = match set.dialect {
        Dialect::V3 => Encoding::Linear,
        Dialect::V4 => Encoding::Auto,
    };
    let index = tables
        .image(set.dir.join(file), encoding, channels)
        .map_err(|e| set.error(e))?;
    match tables.images.get(index as usize) {
        Some(image) if image.width > 0 && image.height > 0 => Ok(Some((index, image))),
        _ => Err(set.error("the image is missing")),
    }
}

/// In v4 an image takes the place of a spectrum.
fn check_exclusive(set: &ParamSet) -> Result<(), SceneError> {
    if set.dialect == Dialect::V3 {
        return Ok(());
    }
    if names_image(set)? && set.has("L") {
        return Err(
            set.error("\"L\" and \"filename\" exclude each other; scale the image with \"scale\"")
        );
    }
    Ok(())
}

/// Whether a v4 light shows an image.
fn names_image(set: &ParamSet) -> Result<bool, SceneError> {
    Ok(set.string("filename")?.is_some_and(|f| !f.is_empty()))
}

/// World to light space, for lights that show an image.
fn turned(set: &ParamSet, ctm: &DAffine3) -> Result<DMat3, SceneError> {
    // The inverse, which of an orthonormal frame is its transpose. Directions do not feel the scale.
    similarity(ctm).map(|s| s.frame.transpose()).ok_or_else(|| {
        set.error("this light can be rotated and mirrored, but not sheared or stretched")
    })
}

/// Whether nothing of the image shines.
fn is_black(image: &Image) -> bool {
    image.texels.iter().flatten().all(|c| *c <= 0.0)
}

fn check_square(set: &ParamSet, image: &Image) -> Result<(), SceneError> {
    if image.width == image.height {
        return Ok(());
    }
    Err(set.error(format_args!(
        "{} is {}x{}, but must be a square equal-area map; convert it with `imgtool makeequiarea`",
        image.name, image.width, image.height
    )))
}

fn goniometric(
    set: &ParamSet,
    ctm: &DAffine3,
    p: DVec3,
    tables: &mut Tables,
) -> Result<(Rgb, WorldLightKind), SceneError> {
    let i = emission(set, "I")?;
    // v4 makes a number of each texel, the mean of its channels.
    let (layout, channels) = match set.dialect {
        Dialect::V3 => (EnvLayout::LatLong, Channels::Rgb),
        Dialect::V4 => (EnvLayout::EqualArea, Channels::Mean),
    };
    let Some((index, image)) = image_of(set, channels, tables)? else {
        return match set.dialect {
            Dialect::V3 => Ok((i, WorldLightKind::Point { p, i })),
            Dialect::V4 => {
                Err(set.error("needs an image, \"string filename\"; or use a point light"))
            }
        };
    };
    if layout == EnvLayout::EqualArea {
        check_square(set, image)?;
    }
    let black = is_black(image);
    let sum: f64 = image.texels.iter().map(|t| f64::from(t[0])).sum();
    let mean = sum / image.texels.len() as f64;
    let scale = if black {
        [0.0; 3]
    } else {
        with_unit(set, i, "power", 4.0 * PI * mean)?
    };
    // pbrt exchanges y and z: the pole of the map is the light's y.
    let exchange = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
    Ok((
        scale,
        WorldLightKind::Goniometric {
            p,
            image: index,
            scale,
            to_light: exchange * turned(set, ctm)?,
            layout,
        },
    ))
}

fn projection(
    set: &ParamSet,
    ctm: &DAffine3,
    p: DVec3,
    tables: &mut Tables,
) -> Result<(Rgb, WorldLightKind), SceneError> {
    let (default, i, flip, filtering) = match set.dialect {
        Dialect::V3 => (45.0, emission(set, "I")?, 1.0, Filtering::Bilinear),
        // v4 turns the image upright.
        Dialect::V4 => (90.0, scaled(set, [1.0; 3])?, -1.0, Filtering::Nearest),
    };
    let fov = set.float_in("fov", default, 0.0, 180.0)?;
    let tangent = (fov / 2.0).to_radians().tan();
    if !(1e-6..=1e6).contains(&tangent) {
        return Err(set.error("\"fov\" must lie between 0 and 180 degrees, both excluded"));
    }
    if set.dialect == Dialect::V3 && image_of(set, Channels::Rgb, tables)?.is_none() {
        tables.images.push(Image {
            name: "white".to_owned(),
            width: 1,
            height: 1,
            texels: vec![[1.0; 3]],
        });
        let scale = i;
        let light = WorldLightKind::Projection {
            p,
            image: tables.images.len() as u32 - 1,
            scale,
            to_light: turned(set, ctm)?,
            extent: [tangent; 2],
            filtering,
        };
        return Ok((scale, light));
    }
    let Some((index, image)) = image_of(set, Channels::Rgb, tables)? else {
        return Err(set.error("needs an image, \"string filename\""));
    };
    // The shorter side has the angle of view.
    let aspect = f64::from(image.width) / f64::from(image.height);
    let extent = [tangent * aspect.max(1.0), tangent * (1.0 / aspect).max(1.0)];
    let scale = if is_black(image) {
        [0.0; 3]
    } else {
        with_unit(set, i, "power", projected_flux(image, extent))?
    };
    let upright = DMat3::from_diagonal(DVec3::new(1.0, flip, 1.0));
    Ok((
        scale,
        WorldLightKind::Projection {
            p,
            image: index,
            scale,
            to_light: upright * turned(set, ctm)?,
            extent,
            filtering,
        },
    ))
}

/// Luminous flux of a projected image of scale 1, as pbrt-v4 has it for `power`: negative texels count.
fn projected_flux(image: &Image, extent: [f64; 2]) -> f64 {
    let (w, h) = (image.width as usize, image.height as usize);
    let place = |i: usize, n: usize, e: f64| (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) * e;
    let mut sum = 0.0;
    for (i, texel) in image.texels.iter().enumerate() {
        let (x, y) = (place(i % w, w, extent[0]), place(i / w, h, extent[1]));
        sum += f64::from(luminance(*texel)) * (1.0 + x * x + y * y).powf(-1.5);
    }
    4.0 * extent[0] * extent[1] * sum / (w * h) as f64
}

fn infinite(
    set: &ParamSet,
    ctm: &DAffine3,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<(Rgb, WorldLightKind), SceneError> {
    set.refuse(
        &["portal"],
        "portals are not supported; remove it: the light is then all around, and where the portal is the scene's only opening the picture stays \
         the same but for noise",
    )?;
    check_exclusive(set)?;
    let l = emission_or_image(set, "L")?;
    let Some((image, picture)) = image_of(set, Channels::Rgb, tables)? else {
        let l = with_unit(set, l, "illuminance", PI)?;
        return Ok((l, WorldLightKind::Constant { l }));
    };
    let Some(placed) = similarity(ctm) else {
        return Err(set
            .error("an infinite light can be rotated and mirrored, but not sheared or stretched"));
    };
    if placed.scale != 1.0 && (placed.scale - 1.0).abs() > 1e-3 {
        report.warn_at(
            &set.site,
            "the scale of the transform has no effect on an infinite light",
        );
    }
    let (layout, scale) = match set.dialect {
        Dialect::V3 => (EnvLayout::LatLong, l),
        Dialect::V4 => {
            check_square(set, picture)?;
            let k = upward_illuminance(picture);
            (EnvLayout::EqualArea, with_unit(set, l, "illuminance", k)?)
        }
    };
    // The rows of the inverse, which of an orthonormal frame is its transpose.
    Ok((
        scale,
        WorldLightKind::Image {
            image,
            scale,
            to_light: placed.frame.transpose(),
            layout,
        },
    ))
}

/// Illuminance of an upward-facing patch under an equal-area octahedral map as pbrt-v4 estimates it for `illuminance`: the sum
/// over texels of the upper hemisphere, each of solid angle `2 pi / texels` (sic, half of what a texel has).
fn upward_illuminance(image: &Image) -> f64 {
    let (w, h) = (image.width as usize, image.height as usize);
    let mut sum = 0.0;
    for (i, texel) in image.texels.iter().enumerate() {
        let (x, y) = ((i % w) as f64, (i / w) as f64);
        let u = (2.0 * (x + 0.5) / w as f64 - 1.0).abs();
        let v = (2.0 * (y + 0.5) / h as f64 - 1.0).abs();
        // Clarberg 2008: the inner diamond is the upper hemisphere, with z = 1 - r^2.
        let r = u + v;
        if r < 1.0 {
            sum += f64::from(luminance(*texel)) * (1.0 - r * r);
        }
    }
    sum * 2.0 * PI / (w * h).max(1) as f64
}

/// Emission that the shapes after an `AreaLightSource` have.
#[derive(Clone, Debug)]
pub(super) struct AreaLight {
    pub set: ParamSet,
    l: Rgb,
    pub two_sided: bool,
    /// v4's `power`; the radiance then depends on the area of each primitive.
    power: Option<f64>,
    /// v4's image, that `l` scales.
    pub image: Option<u32>,
    /// Mean luminance of the image as pbrt-v4 has it for `power`, 1 without one.
    mean: f64,
}

impl AreaLight {
    pub fn build(
        kind: &str,
        set: ParamSet,
        tables: &mut Tables,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        if !(kind == "diffuse" || kind == "area" && set.dialect == Dialect::V3) {
            return Err(set.error("this area light is unknown; use \"diffuse\""));
        }
        if set.dialect == Dialect::V3 {
            set.refuse(
                &["filename", "mapname"],
                "area lights of this dialect have no image; use \"rgb L\", or the v4 dialect",
            )?;
        }
        check_exclusive(&set)?;
        let mut l = emission_or_image(&set, "L")?;
        let (mut image, mut mean) = (None, 1.0);
        if set.dialect == Dialect::V4
            && let Some((index, picture)) = image_of(&set, Channels::Rgb, tables)?
        {
            image = Some(index);
            let sum: f64 = (picture.texels.iter())
                .map(|t| f64::from(luminance(*t)))
                .sum();
            mean = sum / picture.texels.len() as f64;
            if is_black(picture) {
                l = [0.0; 3];
            }
        }
        let two_sided = set.bool_or("twosided", false)?;
        let power = match set.dialect {
            Dialect::V3 => None,
            Dialect::V4 => set.float("power")?.filter(|p| *p > 0.0),
        };
        set.accept(&["nsamples", "samples"]);
        set.finish(report);
        Ok(Self {
            set,
            l,
            two_sided,
            power,
            image,
            mean,
        })
    }

    pub fn has_power(&self) -> bool {
        self.power.is_some()
    }

    /// Radiance of a primitive of this area (world space), or what its image is multiplied by.
    pub fn radiance(&self, area: f64) -> Rgb {
        match self.power {
            Some(power) if area > 0.0 && self.mean > 0.0 => {
                let sides = if self.two_sided { 2.0 } else { 1.0 };
                let factor = (power / (sides * area * PI * self.mean)) as f32;
                self.l.map(|c| c * factor)
            }
            _ => self.l,
        }
    }

    pub fn is_black(&self) -> bool {
        self.l == [0.0; 3]
    }
}
