//! Spherical maps: radiance or intensity by direction, importance sampled by a piecewise-constant
//! density over their texels.

use super::distribution::{Distribution, bilinear, mean, tent};
use crate::scene::{EnvLayout, Filtering, Image, Rgb};
use crate::simd::{Lanes, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// An image around the scene, or around a point.
pub struct Environment {
    width: usize,
    height: usize,
    /// Radiance, `scale` applied.
    texels: Vec<Rgb>,
    to_light: [[f32; 3]; 3],
    layout: EnvLayout,
    filtering: Filtering,
    distribution: Distribution,
}

impl Environment {
    pub fn new(
        image: &Image,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        layout: EnvLayout,
        filtering: Filtering,
    ) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let texels: Vec<Rgb> = (image.texels.iter())
            .map(|t| std::array::from_fn(|c| (t[c] * scale[c]).clamp(0.0, f32::MAX)))
            .collect();
        let size = [width, height];
        let value = |x: i64, y: i64| {
            f64::from(mean(texels[wrapped(layout, size, x, y)]).clamp(0.0, f32::MAX))
        };
        let distribution = Distribution::new(
            size,
            |x, y| match filtering {
                Filtering::Nearest => value(x, y),
                Filtering::Bilinear => tent(value, x, y),
            },
            |y| row_weight(layout, height, y),
        );
        Self {
            width,
            height,
            texels,
            to_light,
            layout,
            filtering,
            distribution,
        }
    }

    /// Mean over the sphere.
    pub fn mean(&self) -> Rgb {
        let mut sum = [0.0; 3];
        let mut weights = 0.0;
        for y in 0..self.height {
            let w = row_weight(self.layout, self.height, y);
            weights += w * self.width as f64;
            for t in &self.texels[y * self.width..(y + 1) * self.width] {
                for c in 0..3 {
                    sum[c] += w * f64::from(t[c]);
                }
            }
        }
        sum.map(|s| (s / weights) as f32)
    }

    /// What the map has along unit `direction` (internal space, away from its centre) and the
    /// density of sampling it, per solid angle.
    #[inline(always)]
    pub fn radiance_and_pdf<L: Lanes>(&self, direction: Vec3<L>) -> (Vec3<L>, L) {
        let mut out = [[0.0f32; 4]; 8];
        for (i, slot) in out.iter_mut().enumerate().take(L::N) {
            *slot = self.look_up(direction.lane(i));
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        (Vec3::new(column(0), column(1), column(2)), column(3))
    }

    /// The same for one direction.
    pub fn look_up(&self, d: [f32; 3]) -> [f32; 4] {
        let mut local = [0.0; 3];
        for (x, m) in local.iter_mut().zip(&self.to_light) {
            *x = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
        }
        let (u, v, solid) = match self.layout {
            EnvLayout::LatLong => {
                let turns = local[1].atan2(local[0]) / TAU;
                // Not from `1 - z^2`: near the poles nothing is left of it.
                let sin = local[0].hypot(local[1]);
                (
                    if turns < 0.0 { turns + 1.0 } else { turns },
                    sin.atan2(local[2]) * FRAC_1_PI,
                    TAU * PI * sin,
                )
            }
            EnvLayout::EqualArea => {
                let (u, v) = equal_area_square(local);
                (u, v, 2.0 * TAU)
            }
        };
        if !(u.is_finite() && v.is_finite()) {
            return [0.0; 4];
        }
        self.at(u, v, solid)
    }

    /// What the map has at a place of its square, and the density of sampling it, per solid angle;
    /// there are `solid` steradians to the square there.
    fn at(&self, u: f32, v: f32, solid: f32) -> [f32; 4] {
        let (x, y) = (u * self.width as f32, v * self.height as f32);
        let tx = (x as usize).min(self.width - 1);
        let ty = (y as usize).min(self.height - 1);
        let density = self.distribution.density(tx, ty);
        // The density within a texel of a lat-long map varies with the sine; at the very pole it
        // has no limit.
        let pdf = if solid > 0.0 { density / solid } else { 0.0 };
        let [r, g, b] = match self.filtering {
            Filtering::Nearest => self.texels[ty * self.width + tx],
            Filtering::Bilinear => {
                let size = [self.width, self.height];
                let texel = |x, y| self.texels[wrapped(self.layout, size, x, y)];
                bilinear(texel, x - 0.5, y - 0.5)
            }
        };
        [r, g, b, pdf]
    }

    /// A unit direction towards the map, and what [`Self::look_up`] means to find there: of the
    /// sample itself, as its direction may be rounded into the texel beside, which may be a
    /// sun.
    pub fn sample(&self, u: [f32; 2]) -> [f32; 7] {
        let [u, v] = self.distribution.sample(u);
        let (local, solid) = match self.layout {
            EnvLayout::LatLong => {
                let ((sin_t, cos_t), (sin_p, cos_p)) = ((v * PI).sin_cos(), (u * TAU).sin_cos());
                ([sin_t * cos_p, sin_t * sin_p, cos_t], TAU * PI * sin_t)
            }
            EnvLayout::EqualArea => (equal_area_sphere(u, v), 2.0 * TAU),
        };
        let [r, g, b, pdf] = self.at(u, v, solid);
        // Rows are orthonormal: the inverse is the transpose.
        let d: [f32; 3] =
            std::array::from_fn(|c| (0..3).map(|r| self.to_light[r][c] * local[r]).sum::<f32>());
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let [x, y, z] = d.map(|x| x / length);
        [x, y, z, r, g, b, pdf]
    }
}

/// Solid angle of a row's texels, up to a factor.
fn row_weight(layout: EnvLayout, height: usize, y: usize) -> f64 {
    match layout {
        EnvLayout::LatLong => ((y as f64 + 0.5) / height as f64 * std::f64::consts::PI).sin(),
        EnvLayout::EqualArea => 1.0,
    }
}

/// Index of a texel; beyond the border, of what the layout has there.
fn wrapped(layout: EnvLayout, [width, height]: [usize; 2], x: i64, y: i64) -> usize {
    let (w, h) = (width as i64, height as i64);
    let (x, y) = match layout {
        // pbrt-v3 repeats its maps both ways: beyond a pole lies the other one.
        EnvLayout::LatLong => (x.rem_euclid(w), y.rem_euclid(h)),
        EnvLayout::EqualArea => octahedral_wrap(x, y, w),
    };
    (y * w + x) as usize
}

/// Texel coordinates one step outside an octahedral square fold back into it.
fn octahedral_wrap(x: i64, y: i64, n: i64) -> (i64, i64) {
    let (mut x, mut y) = (x, y);
    if x < 0 {
        x = -x - 1;
        y = n - 1 - y;
    } else if x >= n {
        x = 2 * n - 1 - x;
        y = n - 1 - y;
    }
    if y < 0 {
        x = n - 1 - x;
        y = -y - 1;
    } else if y >= n {
        x = n - 1 - x;
        y = 2 * n - 1 - y;
    }
    (x.clamp(0, n - 1), y.clamp(0, n - 1))
}

/// Unit square to sphere (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD").
fn equal_area_sphere(u: f32, v: f32) -> [f32; 3] {
    let (u, v) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (up, vp) = (u.abs(), v.abs());
    let signed = 1.0 - (up + vp);
    let d = signed.abs();
    let r = 1.0 - d;
    let phi = if r == 0.0 { 1.0 } else { (vp - up) / r + 1.0 } * (PI / 4.0);
    let z = (1.0 - r * r).copysign(signed);
    let s = r * (2.0 - r * r).max(0.0).sqrt();
    let (sin, cos) = phi.sin_cos();
    [cos.copysign(u) * s, sin.copysign(v) * s, z]
}

/// The inverse of [`equal_area_sphere`].
fn equal_area_square(d: [f32; 3]) -> (f32, f32) {
    let [x, y, z] = d.map(f32::abs);
    let r = (1.0 - z).max(0.0).sqrt();
    let (a, b) = (x.max(y), x.min(y));
    let ratio = if a == 0.0 { 0.0 } else { b / a };
    let phi = ratio.atan() * 2.0 * FRAC_1_PI;
    let phi = if x < y { 1.0 - phi } else { phi };
    let mut v = phi * r;
    let mut u = r - v;
    if d[2] < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    (
        (u.copysign(d[0]) + 1.0) * 0.5,
        (v.copysign(d[1]) + 1.0) * 0.5,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_area_round_trip() {
        for i in 0..64 {
            for j in 0..64 {
                let (u, v) = ((i as f32 + 0.37) / 64.0, (j as f32 + 0.61) / 64.0);
                let d = equal_area_sphere(u, v);
                let (a, b) = equal_area_square(d);
                // sqrt(1 - |z|) amplifies rounding near the poles: sqrt(eps).
                assert!(
                    (a - u).abs() < 1e-3 && (b - v).abs() < 1e-3,
                    "{u} {v} {a} {b}"
                );
            }
        }
    }
}
