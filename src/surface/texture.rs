//! Textures at a point of a surface. Scalar: look-ups are bound by memory, and one implementation serves every width.

use crate::scene::{Image, Param, Rgb, Texture, UvMapping, Wrap};
use crate::simd::prefetch::prefetch;

/// Where a texture is evaluated: all of a hit point that textures look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Hit point, internal space.
    pub p: [f32; 3],
    /// Unit geometric normal, either side, internal space.
    pub n: [f32; 3],
}

/// Evaluates a parameter at a place.
pub fn evaluate(textures: &[Texture], images: &[Image], param: Param, place: &Place) -> Rgb {
    let texture = match param {
        Param::Constant(value) => return value,
        Param::Texture(index) => &textures[index as usize],
    };
    let child = |p: Param| evaluate(textures, images, p, place);
    match *texture {
        Texture::Constant(value) => value,
        Texture::Scale { a, b } => combine(child(a), child(b), |a, b| a * b),
        Texture::Mix { a, b, amount } => {
            let (a, b, t) = (child(a), child(b), child(amount));
            std::array::from_fn(|c| (1.0 - t[c]) * a[c] + t[c] * b[c])
        }
        Texture::Checkerboard { a, b, mapping } => {
            let (s, t) = map(mapping, place);
            let even = (s.floor() as i64).wrapping_add(t.floor() as i64) & 1 == 0;
            child(if even { a } else { b })
        }
        Texture::Image {
            image,
            mapping,
            wrap,
            scale,
            invert,
        } => {
            let (s, t) = map(mapping, place);
            let mut value = bilinear(&images[image as usize], s, t, wrap);
            for v in &mut value {
                *v *= scale;
                if invert {
                    *v = (1.0 - *v).max(0.0);
                }
            }
            value
        }
    }
}

/// Asks for the texels that [`evaluate`] will read of a texture. Images are larger than caches, and hits are anywhere.
pub fn announce(textures: &[Texture], images: &[Image], texture: u32, place: &Place) {
    if let Texture::Image {
        image,
        mapping,
        wrap,
        ..
    } = textures[texture as usize]
    {
        let image = &images[image as usize];
        let (s, t) = map(mapping, place);
        let (x, y) = texel_coordinates(image, s, t);
        let row = |y: f32| wrapped(y as i64, image.height, wrap);
        if let Some(x) = wrapped(x.floor() as i64, image.width, wrap) {
            for y in [row(y.floor()), row(y.floor() + 1.0)].into_iter().flatten() {
                prefetch::<24, _>(&image.texels, y * image.width as usize + x);
            }
        }
    }
}

fn combine(a: Rgb, b: Rgb, f: impl Fn(f32, f32) -> f32) -> Rgb {
    std::array::from_fn(|c| f(a[c], b[c]))
}

fn map(m: UvMapping, place: &Place) -> (f32, f32) {
    let [u, v] = place.uv;
    (m.su * u + m.du, m.sv * v + m.dv)
}

fn texel_coordinates(image: &Image, s: f32, t: f32) -> (f32, f32) {
    (
        s * image.width as f32 - 0.5,
        (1.0 - t) * image.height as f32 - 0.5,
    )
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
