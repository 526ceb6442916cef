//! Textures at a point of a surface. Scalar: look-ups are bound by memory, and one implementation serves every width.

use crate::scene::{Image, Param, Rgb, Texture, UvMapping, Wrap};

/// Evaluates a parameter at texture coordinates `uv`.
pub fn evaluate(textures: &[Texture], images: &[Image], param: Param, uv: [f32; 2]) -> Rgb {
    let texture = match param {
        Param::Constant(value) => return value,
        Param::Texture(index) => &textures[index as usize],
    };
    let child = |p: Param| evaluate(textures, images, p, uv);
    match *texture {
        Texture::Constant(value) => value,
        Texture::Scale { a, b } => combine(child(a), child(b), |a, b| a * b),
        Texture::Mix { a, b, amount } => {
            let (a, b, t) = (child(a), child(b), child(amount));
            std::array::from_fn(|c| (1.0 - t[c]) * a[c] + t[c] * b[c])
        }
        Texture::Checkerboard { a, b, mapping } => {
            let (s, t) = map(mapping, uv);
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
            let (s, t) = map(mapping, uv);
            let value = bilinear(&images[image as usize], s, t, wrap);
            value.map(|v| {
                if invert {
                    (1.0 - scale * v).max(0.0)
                } else {
                    scale * v
                }
            })
        }
    }
}

fn combine(a: Rgb, b: Rgb, f: impl Fn(f32, f32) -> f32) -> Rgb {
    std::array::from_fn(|c| f(a[c], b[c]))
}

fn map(m: UvMapping, uv: [f32; 2]) -> (f32, f32) {
    (m.su * uv[0] + m.du, m.sv * uv[1] + m.dv)
}

/// Bilinear look-up at `(s, t)`; the image's row 0 is at `t = 1`, texel centres at half-integers.
pub fn bilinear(image: &Image, s: f32, t: f32, wrap: Wrap) -> Rgb {
    let x = s * image.width as f32 - 0.5;
    let y = (1.0 - t) * image.height as f32 - 0.5;
    if !(x.is_finite() && y.is_finite()) {
        return [0.0; 3];
    }
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (x0, y0) = (x0 as i64, y0 as i64);
    let texel = |dx: i64, dy: i64| {
        let x = wrapped(x0.saturating_add(dx), image.width, wrap);
        let y = wrapped(y0.saturating_add(dy), image.height, wrap);
        match (x, y) {
            (Some(x), Some(y)) => image.texels[y * image.width as usize + x],
            _ => [0.0; 3],
        }
    };
    let (a, b, c, d) = (texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1));
    std::array::from_fn(|i| {
        let top = (1.0 - fx) * a[i] + fx * b[i];
        let bottom = (1.0 - fx) * c[i] + fx * d[i];
        (1.0 - fy) * top + fy * bottom
    })
}

fn wrapped(i: i64, size: u32, wrap: Wrap) -> Option<usize> {
    let size = i64::from(size);
    match wrap {
        Wrap::Repeat => Some(i.rem_euclid(size) as usize),
        Wrap::Clamp => Some(i.clamp(0, size - 1) as usize),
        Wrap::Black => (0..size).contains(&i).then_some(i as usize),
    }
}
