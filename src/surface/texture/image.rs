//! Look-ups in images.

use crate::scene::{Image, Rgb, Wrap};
use crate::simd::prefetch::prefetch;

fn texel_coordinates(image: &Image, s: f32, t: f32) -> (f32, f32) {
    (
        s * image.width as f32 - 0.5,
        (1.0 - t) * image.height as f32 - 0.5,
    )
}

/// Asks for the texels that [`bilinear`] will read.
pub fn prefetch_texels(image: &Image, s: f32, t: f32, wrap: Wrap) {
    let (x, y) = texel_coordinates(image, s, t);
    let row = |y: f32| wrapped(y as i64, image.height, wrap);
    if let Some(x) = wrapped(x.floor() as i64, image.width, wrap) {
        for y in [row(y.floor()), row(y.floor() + 1.0)].into_iter().flatten() {
            prefetch::<24, _>(&image.texels, y * image.width as usize + x);
        }
    }
}

/// Bilinear look-up at `(s, t)`; the image's row 0 is at `t = 1`, texel centres at half-integers.
pub fn bilinear(image: &Image, s: f32, t: f32, wrap: Wrap) -> Rgb {
    let (x, y) = texel_coordinates(image, s, t);
    if !(x.is_finite() && y.is_finite()) {
        return [0.0; 3];
    }
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (x0, y0) = (x0 as i64, y0 as i64);
    if wrap == Wrap::Octahedral {
        return octahedral(image, [x0, y0], [fx, fy]);
    }
    let column = |x: i64| wrapped(x, image.width, wrap);
    let row = |y: i64| wrapped(y, image.height, wrap);
    let columns = [column(x0), column(x0.saturating_add(1))];
    let rows = [row(y0), row(y0.saturating_add(1))];
    // Loops and not `array::from_fn`, which is not reliably inlined.
    let mut value = [0.0; 3];
    for (row, wy) in rows.into_iter().zip([1.0 - fy, fy]) {
        let mut line = [0.0; 3];
        for (column, wx) in columns.into_iter().zip([1.0 - fx, fx]) {
            if let (Some(x), Some(y)) = (column, row) {
                let texel = image.texels[y * image.width as usize + x];
                for c in 0..3 {
                    line[c] += wx * texel[c];
                }
            }
        }
        for c in 0..3 {
            value[c] += wy * line[c];
        }
    }
    value
}

/// The same between four texels of an octahedral map, the first of them given, and where between
/// them.
#[cold]
fn octahedral(image: &Image, [x0, y0]: [i64; 2], [fx, fy]: [f32; 2]) -> Rgb {
    let size = [image.width, image.height];
    let mut value = [0.0; 3];
    for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
        for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
            let at = [x0.saturating_add(dx), y0.saturating_add(dy)];
            let [x, y] = folded(at, size);
            let texel = image.texels[y * image.width as usize + x];
            for c in 0..3 {
                value[c] += wx * wy * texel[c];
            }
        }
    }
    value
}

/// A texel of an octahedral map. As pbrt-v4 has it: below 0 it turns about the first texel's
/// centre, not about the edge. Farther out than the map is wide there is nothing to find, so that
/// is cut off.
fn folded([x, y]: [i64; 2], [width, height]: [u32; 2]) -> [usize; 2] {
    let (w, h) = (i64::from(width), i64::from(height));
    let (mut x, mut y) = (x.clamp(1 - w, 2 * w - 1), y.clamp(1 - h, 2 * h - 1));
    if !(0..w).contains(&x) {
        x = if x < 0 { -x } else { 2 * w - 1 - x };
        y = h - 1 - y;
    }
    if !(0..h).contains(&y) {
        x = w - 1 - x;
        y = if y < 0 { -y } else { 2 * h - 1 - y };
    }
    [x.clamp(0, w - 1) as usize, y.clamp(0, h - 1) as usize]
}

#[inline(always)]
fn wrapped(i: i64, size: u32, wrap: Wrap) -> Option<usize> {
    let size = i64::from(size);
    let within = (0..size).contains(&i);
    match wrap {
        // Divisions are slow, and most look-ups need none.
        Wrap::Repeat => Some(if within { i } else { i.rem_euclid(size) } as usize),
        // Where it is asked for ahead, near enough.
        Wrap::Clamp | Wrap::Octahedral => Some(i.clamp(0, size - 1) as usize),
        Wrap::Black => within.then_some(i as usize),
    }
}
