//! Lights that shine by an image: goniometric, projection, infinite.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::power::{check_exclusive, emission, emission_or_image, scaled, with_unit};
use super::world::WorldLightKind;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::image::Encoding;
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::{Channels, Tables};
use crate::pbrt::transform::similarity;
use crate::scene::spectrum::luminance;
use crate::scene::{EnvLayout, Filtering, Image, Rgb};

/// The image of a light: v3 `mapname`, v4 `filename`.
pub(super) fn image_of<'a>(
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

/// World to light space, for lights that show an image.
pub(super) fn turned(set: &ParamSet, ctm: &DAffine3) -> Result<DMat3, SceneError> {
    // The inverse, which of an orthonormal frame is its transpose. Directions do not feel the
    // scale.
    similarity(ctm).map(|s| s.frame.transpose()).ok_or_else(|| {
        set.error("this light can be rotated and mirrored, but not sheared or stretched")
    })
}

/// Whether nothing of the image shines.
pub(super) fn is_black(image: &Image) -> bool {
    image.texels.iter().flatten().all(|c| *c <= 0.0)
}

pub(super) fn check_square(set: &ParamSet, image: &Image) -> Result<(), SceneError> {
    if image.width == image.height {
        return Ok(());
    }
    Err(set.error(format_args!(
        "{} is {}x{}, but must be a square equal-area map; convert it with `imgtool makeequiarea`",
        image.name, image.width, image.height
    )))
}

pub(super) fn goniometric(
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

pub(super) fn projection(
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

/// Luminous flux of a projected image of scale 1, as pbrt-v4 has it for `power`: negative texels
/// count.
pub(super) fn projected_flux(image: &Image, extent: [f64; 2]) -> f64 {
    let (w, h) = (image.width as usize, image.height as usize);
    let place = |i: usize, n: usize, e: f64| (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) * e;
    let mut sum = 0.0;
    for (i, texel) in image.texels.iter().enumerate() {
        let (x, y) = (place(i % w, w, extent[0]), place(i / w, h, extent[1]));
        sum += f64::from(luminance(*texel)) * (1.0 + x * x + y * y).powf(-1.5);
    }
    4.0 * extent[0] * extent[1] * sum / (w * h) as f64
}

pub(super) fn infinite(
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

/// Illuminance of an upward-facing patch under an equal-area octahedral map as pbrt-v4 estimates it
/// for `illuminance`: the sum over texels of the upper hemisphere, each of solid angle `2 pi /
/// texels` (sic, half of what a texel has).
pub(super) fn upward_illuminance(image: &Image) -> f64 {
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
