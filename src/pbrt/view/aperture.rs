//! What the stop of a v4 `realistic` camera lets through.

use std::f64::consts::PI;

use crate::pbrt::error::SceneError;
use crate::pbrt::image::Encoding;
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::{Channels, Tables};
use crate::scene::lenses::StopMask;

/// Texels a side of the shapes with names, as pbrt has them.
const SIDE: u32 = 256;

/// A point of the square around the stop's disk, `x` and `y` from -1 to 1.
type Point = [f64; 2];

/// `None` is the disk.
pub(super) fn stop_mask(
    set: &ParamSet,
    tables: &mut Tables,
) -> Result<Option<StopMask>, SceneError> {
    let mut mask = match set.string("aperture")?.unwrap_or_default() {
        "" | "circular" => return Ok(None),
        "gaussian" => shape(|[x, y]| ((-x * x - y * y).exp() - (-1.0f64).exp()).max(0.0)),
        "square" => shape(|[x, y]| share(x.abs() < 0.5 && y.abs() < 0.5)),
        "pentagon" => {
            let corners = corners(5, |_| 0.8, PI / 2.0);
            shape(|p| share(is_inside(&corners, p)))
        }
        "star" => {
            let inner = 72f64.to_radians().cos() / 36f64.to_radians().cos();
            let corners = corners(10, |i| if i % 2 == 0 { inner } else { 1.0 }, 0.0);
            shape(|p| share(is_inside(&corners, p)))
        }
        file => picture(set, file, tables)?,
    };
    // As bright as the disk.
    let count = mask.texels.len() as f64;
    let sum: f64 = mask.texels.iter().map(|t| f64::from(*t)).sum();
    let scale = PI / 4.0 * count / sum;
    if !(scale as f32).is_finite() {
        return Err(set.error("its aperture lets no light through"));
    }
    for texel in &mut mask.texels {
        *texel = (f64::from(*texel) * scale) as f32;
    }
    Ok(Some(mask))
}

fn share(inside: bool) -> f64 {
    if inside { 1.0 } else { 0.0 }
}

/// The shape's rows go down: pbrt turns all masks over.
fn shape(of: impl Fn(Point) -> f64) -> StopMask {
    let place = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(SIDE) - 1.0;
    let texels = (0..SIDE * SIDE).map(|i| of([place(i % SIDE), -place(i / SIDE)]) as f32);
    StopMask {
        width: SIDE,
        height: SIDE,
        texels: texels.collect(),
    }
}

/// Corners of a polygon around the middle.
fn corners(count: u32, radius: impl Fn(u32) -> f64, first: f64) -> Vec<Point> {
    let corner = |i: u32| {
        let (sin, cos) = (first + 2.0 * PI * f64::from(i) / f64::from(count)).sin_cos();
        [radius(i) * cos, radius(i) * sin]
    };
    (0..count).map(corner).collect()
}

fn is_inside(corners: &[Point], [x, y]: Point) -> bool {
    let ends = corners.iter().zip(corners.iter().cycle().skip(1));
    // Edges that a ray to the right crosses.
    let crossed = ends.filter(|([ax, ay], [bx, by])| {
        (*ay > y) != (*by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
    });
    crossed.count() % 2 == 1
}

fn picture(set: &ParamSet, file: &str, tables: &mut Tables) -> Result<StopMask, SceneError> {
    let index = tables.image(set.dir.join(file), Encoding::Auto, Channels::Mean);
    let index = index.map_err(|e| set.error(e))?;
    let Some(image) = tables.images.get(index as usize) else {
        return Err(set.error("the image of its aperture is missing"));
    };
    let rows = image.texels.chunks(image.width.max(1) as usize).rev();
    Ok(StopMask {
        width: image.width,
        height: image.height,
        texels: rows.flatten().map(|t| t[0].max(0.0)).collect(),
    })
}
