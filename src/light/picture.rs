//! Images on area lights: radiance by texture coordinates.

use super::distribution::{bilinear, mean};
use crate::scene::{Image, Rgb};

/// An image that area lights show.
pub struct Picture {
    /// Index into the scene's images.
    pub image: u32,
    width: usize,
    height: usize,
    texels: Vec<Rgb>,
}

impl Picture {
    pub fn new(index: u32, image: &Image) -> Self {
        Self {
            image: index,
            width: image.width as usize,
            height: image.height as usize,
            texels: image.texels.clone(),
        }
    }

    /// Bilinear, clamped to the border; row 0 is at `v = 1` (pbrt-v4, `DiffuseAreaLight::L`). Not
    /// negative, and 0 where the coordinates are not numbers.
    pub fn at(&self, u: f32, v: f32) -> Rgb {
        let (w, h) = (self.width as f32, self.height as f32);
        let x = (u * w - 0.5).clamp(-1.0, w);
        let y = ((1.0 - v) * h - 0.5).clamp(-1.0, h);
        let texel = |x: i64, y: i64| {
            let x = x.clamp(0, self.width as i64 - 1) as usize;
            let y = y.clamp(0, self.height as i64 - 1) as usize;
            self.texels[y * self.width + x]
        };
        bilinear(texel, x, y).map(|c| c.max(0.0))
    }

    /// Mean over a triangle with these texture coordinates at its corners and of the channels, by
    /// the midpoint rule.
    pub fn mean_over_triangle(&self, corners: [[f32; 2]; 3]) -> f64 {
        // As fine as the texels it covers, within reason: there may be many triangles.
        let [w, h] = [self.width as f32, self.height as f32];
        let side = |a: [f32; 2], b: [f32; 2]| ((a[0] - b[0]) * w).hypot((a[1] - b[1]) * h);
        let [a, b, c] = corners;
        let texels = side(a, b).max(side(b, c)).max(side(c, a));
        let n = (texels.ceil() as usize).clamp(4, 64);
        let mut sum = 0.0;
        let mut add = |s: f32, t: f32| {
            let mix = |k: usize| a[k] + s / n as f32 * (b[k] - a[k]) + t / n as f32 * (c[k] - a[k]);
            sum += f64::from(mean(self.at(mix(0), mix(1))));
        };
        for j in 0..n {
            for i in 0..n - j {
                // The centres of a cell's triangle and, but at the diagonal, of the one that
                // completes the square.
                add(i as f32 + 1.0 / 3.0, j as f32 + 1.0 / 3.0);
                if i + j + 1 < n {
                    add(i as f32 + 2.0 / 3.0, j as f32 + 2.0 / 3.0);
                }
            }
        }
        sum / (n * n) as f64
    }

    /// Mean over a sphere and of the channels.
    pub fn mean_over_sphere(&self) -> f64 {
        let n = 128;
        let mut sum = 0.0;
        for j in 0..n {
            // Heights are uniform over a sphere.
            let z = (j as f32 + 0.5) / n as f32 * 2.0 - 1.0;
            let v = 1.0 - z.acos() * std::f32::consts::FRAC_1_PI;
            for i in 0..n {
                sum += f64::from(mean(self.at((i as f32 + 0.5) / n as f32, v)));
            }
        }
        sum / f64::from(n * n)
    }
}
