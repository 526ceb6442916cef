//! Slide projectors: an image thrown through a frustum, importance sampled by texel and solid angle
//! (pbrt-v4, section 12.2.3).

use super::distribution::{Distribution, bilinear, mean, tent};
use crate::scene::{Filtering, Image, Rgb};

/// Cosine to the axis from which on pbrt's projection takes directions for such as lie before it:
/// the distance of its near plane.
const HITHER: f32 = 1e-3;

/// Intensity by direction.
pub struct Projector {
    width: usize,
    height: usize,
    /// Intensity, `scale` applied.
    texels: Vec<Rgb>,
    to_light: [[f32; 3]; 3],
    /// Tangents of half the angles of view.
    extent: [f32; 2],
    filtering: Filtering,
    distribution: Distribution,
}

impl Projector {
    /// Arguments as in [`crate::scene::LightKind::Projection`].
    pub fn new(
        image: &Image,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        extent: [f32; 2],
        filtering: Filtering,
    ) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let texels: Vec<Rgb> = (image.texels.iter())
            .map(|t| std::array::from_fn(|c| (t[c] * scale[c]).clamp(0.0, f32::MAX)))
            .collect();
        let value =
            |x: i64, y: i64| f64::from(mean(texels[repeated([width, height], x, y)]).min(f32::MAX));
        let distribution = Distribution::new(
            [width, height],
            |x, y| {
                let v = match filtering {
                    Filtering::Nearest => value(x, y),
                    Filtering::Bilinear => tent(value, x, y),
                };
                v * cos3([width, height], extent, x as usize, y as usize)
            },
            |_| 1.0,
        );
        Self {
            width,
            height,
            texels,
            to_light,
            extent,
            filtering,
            distribution,
        }
    }

    /// Intensity integrated over directions, channel by channel.
    pub fn flux(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (i, t) in self.texels.iter().enumerate() {
            let size = [self.width, self.height];
            let weight = cos3(size, self.extent, i % self.width, i / self.width);
            for c in 0..3 {
                sum[c] += weight * f64::from(t[c]);
            }
        }
        let area = 4.0 * f64::from(self.extent[0]) * f64::from(self.extent[1]);
        sum.map(|s| s * area / self.texels.len() as f64)
    }

    /// Intensity along unit `d` (internal space), and the density of sampling it, per solid angle.
    pub fn look_up(&self, d: [f32; 3]) -> [f32; 4] {
        let [x, y, z] = (self.to_light).map(|m| m[0] * d[0] + m[1] * d[1] + m[2] * d[2]);
        if z.is_nan() || z < HITHER {
            return [0.0; 4];
        }
        let (u, v) = (
            0.5 + 0.5 * (x / z) / self.extent[0],
            0.5 + 0.5 * (y / z) / self.extent[1],
        );
        if !((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)) {
            return [0.0; 4];
        }
        let ([r, g, b], density) = self.at(u, v);
        [r, g, b, self.to_solid_angle(density, z)]
    }

    /// Intensity at a place of the image's square, and the density over it.
    fn at(&self, u: f32, v: f32) -> (Rgb, f32) {
        let (x, y) = (u * self.width as f32, v * self.height as f32);
        let tx = (x as usize).min(self.width - 1);
        let ty = (y as usize).min(self.height - 1);
        let intensity = match self.filtering {
            Filtering::Nearest => self.texels[ty * self.width + tx],
            Filtering::Bilinear => {
                let size = [self.width, self.height];
                bilinear(|x, y| self.texels[repeated(size, x, y)], x - 0.5, y - 0.5)
            }
        };
        (intensity, self.distribution.density(tx, ty))
    }

    /// From a density over the image to one over solid angle, at this cosine to the axis: by the
    /// plane at unit distance.
    fn to_solid_angle(&self, density: f32, cos: f32) -> f32 {
        let area = 4.0 * self.extent[0] * self.extent[1];
        density / (area * (cos * cos * cos))
    }

    /// A unit direction into the frustum, and what [`Self::look_up`] means to find there. It would
    /// not always: narrow frusta are as fine as directions are rounded.
    pub fn sample(&self, u: [f32; 2]) -> [f32; 7] {
        let [u, v] = self.distribution.sample(u);
        let local = [
            (2.0 * u - 1.0) * self.extent[0],
            (2.0 * v - 1.0) * self.extent[1],
            1.0,
        ];
        // Rows are orthonormal: the inverse is the transpose.
        let d: [f32; 3] =
            std::array::from_fn(|c| (0..3).map(|r| self.to_light[r][c] * local[r]).sum::<f32>());
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let [x, y, z] = d.map(|x| x / length);
        if length > 1.0 / HITHER {
            return [x, y, z, 0.0, 0.0, 0.0, 0.0];
        }
        let ([r, g, b], density) = self.at(u, v);
        [x, y, z, r, g, b, self.to_solid_angle(density, 1.0 / length)]
    }
}

/// Solid angle over area of the image plane at unit distance, at the centre of a texel.
fn cos3([width, height]: [usize; 2], extent: [f32; 2], x: usize, y: usize) -> f64 {
    let place =
        |i: usize, n: usize, e: f32| (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) * f64::from(e);
    let (x, y) = (place(x, width, extent[0]), place(y, height, extent[1]));
    (1.0 + x * x + y * y).powf(-1.5)
}

/// Index of a texel of the image repeated over the plane, as pbrt-v3 looks it up; the other way
/// never asks beyond the border.
fn repeated([width, height]: [usize; 2], x: i64, y: i64) -> usize {
    let (x, y) = (x.rem_euclid(width as i64), y.rem_euclid(height as i64));
    y as usize * width + x as usize
}
