//! Textures at a point of a surface. Scalar: look-ups are bound by memory, and one implementation
//! serves every width.
//!
//! [`mapping`] takes a place to `(s, t)` or to a point in texture space, [`image`] and
//! [`procedural`] take these to values. Whatever the place and the parameters, values are finite:
//! where a formula has none, it is 0.
//!
//! # Adding a texture
//!
//! More than a file and a line: `windy` stands in six files. It is a [`Texture`], and what it looks
//! at is said beside it, in `scene/texture.rs`; it is read, and tolerated in pbrt-v3, where scene
//! files are read (two files); its formula is in [`procedural`], its arm in [`evaluate`]; `inspect`
//! counts it. Textures are trees that are evaluated by recursion, once a hit, over the scene's
//! plain table. A match is the fastest way to do that, and the scene's table knows no formulas.

pub mod image;
pub mod mapping;
pub mod noise;
pub mod place;
pub mod procedural;

pub use self::place::Place;
use crate::scene::{Image, Param, Rgb, Texture};

/// Evaluates a parameter at a place.
pub fn evaluate(textures: &[Texture], images: &[Image], param: Param, place: &Place) -> Rgb {
    match param {
        Param::Constant(value) => value,
        Param::Texture(index) => {
            at(textures, images, index, place).map(|v| if v.is_finite() { v } else { 0.0 })
        }
    }
}

fn at(textures: &[Texture], images: &[Image], index: u32, place: &Place) -> Rgb {
    let child = |param: Param| match param {
        Param::Constant(value) => value,
        Param::Texture(index) => at(textures, images, index, place),
    };
    match &textures[index as usize] {
        Texture::Constant(value) => *value,
        Texture::Scale { a, b } => combine(child(*a), child(*b), |a, b| a * b),
        Texture::Mix { a, b, amount } => {
            let (a, b, t) = (child(*a), child(*b), child(*amount));
            std::array::from_fn(|c| (1.0 - t[c]) * a[c] + t[c] * b[c])
        }
        Texture::DirectionMix { a, b, direction } => {
            let [x, y, z] = *direction;
            let [nx, ny, nz] = place.n;
            let w = (nx * x + ny * y + nz * z).abs().min(1.0);
            combine(child(*a), child(*b), |a, b| w * a + (1.0 - w) * b)
        }
        Texture::Checkerboard { a, b, mapping } => {
            let (s, t) = mapping::map(mapping, place);
            child(if procedural::is_even([s, t]) { *a } else { *b })
        }
        Texture::Blocks { a, b, to_texture } => {
            let p = mapping::transform(to_texture, place.p);
            child(if procedural::is_even(p) { *a } else { *b })
        }
        Texture::Dots {
            dot,
            ground,
            mapping,
        } => {
            let (s, t) = mapping::map(mapping, place);
            child(if procedural::on_dot(s, t) {
                *dot
            } else {
                *ground
            })
        }
        Texture::Bilerp {
            v00,
            v01,
            v10,
            v11,
            mapping,
        } => {
            let (s, t) = mapping::map(mapping, place);
            procedural::bilerp([v00, v01, v10, v11], s, t)
        }
        Texture::Uv { mapping } => {
            let (s, t) = mapping::map(mapping, place);
            [s - s.floor(), t - t.floor(), 0.0]
        }
        Texture::Fbm {
            octaves,
            to_texture,
        } => [noise::fbm(mapping::transform(to_texture, place.p), *octaves); 3],
        Texture::Wrinkled {
            octaves,
            to_texture,
        } => [noise::turbulence(mapping::transform(to_texture, place.p), *octaves); 3],
        Texture::Windy { to_texture } => {
            [procedural::windy(mapping::transform(to_texture, place.p)); 3]
        }
        Texture::Marble {
            octaves,
            scale,
            variation,
            spline,
            to_texture,
        } => {
            let p = mapping::transform(to_texture, place.p).map(|x| x * scale);
            procedural::marble(p, *octaves, *variation, *spline)
        }
        Texture::Image {
            image,
            mapping,
            wrap,
            scale,
            invert,
        } => {
            let (s, t) = mapping::map(mapping, place);
            let mut value = image::bilinear(&images[*image as usize], s, t, *wrap);
            for v in &mut value {
                *v *= scale;
                if *invert {
                    *v = (1.0 - *v).max(0.0);
                }
            }
            value
        }
    }
}

/// Asks for the texels that [`evaluate`] will read of a texture. Images are larger than caches, and
/// hits are anywhere.
pub fn prefetch_texels(textures: &[Texture], images: &[Image], texture: u32, place: &Place) {
    if let Texture::Image {
        image,
        mapping,
        wrap,
        ..
    } = &textures[texture as usize]
    {
        let (s, t) = mapping::map(mapping, place);
        image::prefetch_texels(&images[*image as usize], s, t, *wrap);
    }
}

fn combine(a: Rgb, b: Rgb, f: impl Fn(f32, f32) -> f32) -> Rgb {
    std::array::from_fn(|c| f(a[c], b[c]))
}
