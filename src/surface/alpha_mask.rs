//! Cut-outs: parts of shapes that are not there.
//!
//! Whether a surface is there depends on the point alone, never on who asks: camera and light
//! subpaths, visibility rays and points sampled on lights must see one and the same scene, or the
//! strategies of a path would not estimate the same integral. pbrt-v4 decides about a partly
//! transparent point by a hash of the ray, which the two ends of a path do not share; here it is a
//! hash of the point, compared with alpha: the surface becomes a screen of grains as fine as `f32`.
//! No two strategies ever meet the same grain, so each of them finds a vertex on the surface with
//! probability alpha and a way through it with probability `1 - alpha`, and that is all their
//! expectations depend on.
//!
//! The one exception is pbrt-v3's `shadowalpha`, by which a shape is seen and casts no shadow.
//! There the strategies of a path do not estimate one integral: pbrt lets the ray that joins two
//! subpaths through, and stops subpaths at the shape. So do we. The picture of `pt` is that of
//! pbrt's path tracer. What `bdpt` and chains show is the mean of both answers, by the weights
//! that their strategies have at each path (pbrt-v3's `bdpt` and `mlt` show such a mean as well).
//! The loader says so.

use super::texture::{self, Place};
use crate::scene::{Alpha, AlphaTest, Image, Scene, Texture};
use crate::simd::rng;

/// The alpha masks of a scene.
pub struct AlphaMasks<'a> {
    alphas: &'a [Alpha],
    textures: &'a [Texture],
    images: &'a [Image],
}

impl<'a> AlphaMasks<'a> {
    /// Of a scene's table [`Scene::alphas`], which it borrows; often none.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            alphas: &scene.alphas,
            textures: &scene.textures,
            images: &scene.images,
        }
    }

    /// Whether the surface of a primitive is there at `place`; `alpha` is that of its shape.
    pub fn is_there(&self, alpha: u32, primitive: u32, place: &Place) -> bool {
        let Alpha { value, test, .. } = self.alphas[alpha as usize];
        let [a, ..] = texture::evaluate(self.textures, self.images, value, place);
        match test {
            AlphaTest::NotZero => a != 0.0,
            // What is not a number hides nothing.
            AlphaTest::Fraction if a >= 1.0 || a.is_nan() => true,
            AlphaTest::Fraction => grain(primitive, place.p) < a,
        }
    }

    /// Whether what is there casts a shadow.
    pub fn casts_shadow(&self, alpha: u32, place: &Place) -> bool {
        let shadow = self.alphas[alpha as usize].shadow;
        shadow.is_none_or(|value| {
            let [a, ..] = texture::evaluate(self.textures, self.images, value, place);
            a != 0.0
        })
    }
}

/// A number in `[0, 1)`, uniform over the points of a primitive.
fn grain(primitive: u32, p: [f32; 3]) -> f32 {
    let [x, y, z] = p.map(f32::to_bits);
    let [word, ..] = rng::hash::<f32>([x, y, z, primitive]);
    rng::unit_float::<f32>(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Param;

    #[test]
    fn alpha_is_the_part_that_is_there() {
        let there = |a: f32, test| {
            let alpha_masks = AlphaMasks {
                alphas: &[Alpha {
                    value: Param::Constant([a; 3]),
                    test,
                    shadow: None,
                }],
                textures: &[],
                images: &[],
            };
            let n = 100_000;
            let place = |i: u32| Place {
                p: [i as f32 * 1e-5, 1.0 - i as f32 * 1e-5, 0.0],
                ..Place::default()
            };
            let count = (0..n)
                .filter(|&i| alpha_masks.is_there(0, 7, &place(i)))
                .count();
            count as f64 / f64::from(n)
        };
        for a in [0.01f32, 0.25, 0.5, 0.9] {
            let expected = f64::from(a);
            let error = (expected * (1.0 - expected) / 1e5).sqrt();
            let part = there(a, AlphaTest::Fraction);
            assert!((part - expected).abs() < 5.0 * error, "{a}: {part}");
        }
        for (a, test, expected) in [
            (0.0, AlphaTest::Fraction, 0.0),
            (-1.0, AlphaTest::Fraction, 0.0),
            (1.0, AlphaTest::Fraction, 1.0),
            (2.0, AlphaTest::Fraction, 1.0),
            (f32::NAN, AlphaTest::Fraction, 1.0),
            (0.0, AlphaTest::NotZero, 0.0),
            (1e-9, AlphaTest::NotZero, 1.0),
            (-0.5, AlphaTest::NotZero, 1.0),
        ] {
            assert_eq!(there(a, test), expected, "{a} {test:?}");
        }
    }
}
