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
pub fn announce(image: &Image, s: f32, t: f32, wrap: Wrap) {
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

#[inline(always)]
fn wrapped(i: i64, size: u32, wrap: Wrap) -> Option<usize> {
    let size = i64::from(size);
    let within = (0..size).contains(&i);
    match wrap {
        // Divisions are slow, and most look-ups need none.
        Wrap::Repeat => Some(if within { i } else { i.rem_euclid(size) } as usize),
        Wrap::Clamp => Some(i.clamp(0, size - 1) as usize),
        Wrap::Black => within.then_some(i as usize),
    }
}
