//! Projection lights in `f64`.

use super::texels::{Table, bilinear, brightness, tent};
use super::vector::{V, dot, unit, wide};
use crate::scene::{Filtering, Image, Rgb};

/// An image thrown through a frustum.
pub struct Frustum {
    width: usize,
    height: usize,
    /// Intensity, as the renderer scales it.
    texels: Vec<V>,
    to_light: [V; 3],
    extent: [f64; 2],
    filtering: Filtering,
    table: Table,
}

impl Frustum {
    pub fn new(
        image: &Image,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        extent: [f32; 2],
        filtering: Filtering,
    ) -> Self {
        let size = [image.width as usize, image.height as usize];
        let texels: Vec<V> = (image.texels.iter())
            .map(|t| std::array::from_fn(|c| f64::from((t[c] * scale[c]).clamp(0.0, f32::MAX))))
            .collect();
        let extent = extent.map(f64::from);
        let value = |x, y| brightness(texels[repeated(size, x, y)]);
        let centre = |i: i64, n: usize, e: f64| (2.0 * (i as f64 + 0.5) / n as f64 - 1.0) * e;
        let table = Table::new(
            size,
            |x, y| {
                let seen = match filtering {
                    Filtering::Nearest => value(x, y),
                    Filtering::Bilinear => tent(value, x, y),
                };
                let (a, b) = (centre(x, size[0], extent[0]), centre(y, size[1], extent[1]));
                seen * (1.0 + a * a + b * b).powf(-1.5)
            },
            |_| 1.0,
        );
        Self {
            width: size[0],
            height: size[1],
            texels,
            to_light: to_light.map(wide),
            extent,
            filtering,
            table,
        }
    }

    /// Intensity towards unit `direction`, and density over solid angle of emitting it.
    pub fn seen(&self, direction: V) -> (V, f64) {
        let [x, y, z] = self.to_light.map(|row| dot(row, direction));
        // Where the renderer's near plane is.
        if z < f64::from(1e-3_f32) {
            return ([0.0; 3], 0.0);
        }
        let [u, v] = [x / z / self.extent[0], y / z / self.extent[1]].map(|x| (1.0 + x) / 2.0);
        let inside = |x: f64| (0.0..=1.0).contains(&x);
        if !inside(u) || !inside(v) {
            return ([0.0; 3], 0.0);
        }
        let (a, b) = (u * self.width as f64, v * self.height as f64);
        let texel = |x, y| self.texels[repeated([self.width, self.height], x, y)];
        let intensity = match self.filtering {
            Filtering::Nearest => {
                let last = [self.width - 1, self.height - 1].map(|n| n as i64);
                texel((a as i64).min(last[0]), (b as i64).min(last[1]))
            }
            Filtering::Bilinear => bilinear(texel, a - 0.5, b - 0.5),
        };
        let area = 4.0 * self.extent[0] * self.extent[1];
        (intensity, self.table.density(u, v) / (area * z.powi(3)))
    }

    /// The direction that two primary samples stand for.
    pub fn sample(&self, u: f64, v: f64) -> V {
        let [u, v] = self.table.sample(u, v);
        let local = [
            (2.0 * u - 1.0) * self.extent[0],
            (2.0 * v - 1.0) * self.extent[1],
            1.0,
        ];
        unit([0, 1, 2].map(|c| dot(self.to_light.map(|row| row[c]), local)))
    }
}

fn repeated([w, h]: [usize; 2], x: i64, y: i64) -> usize {
    y.rem_euclid(h as i64) as usize * w + x.rem_euclid(w as i64) as usize
}
