//! Reconstruction filters, normalised to integrate to 1 over the raster plane.
//!
//! A sample at raster position `p` adds `filter(p - centre) * value` to every pixel whose centre is in reach; with samples over the whole
//! [`crate::camera::Region`] that is the filtered picture in expectation, also for light subpaths, whose positions are not chosen.

use crate::scene::{Filter, FilterKind};

/// A filter over the pixels of a crop window.
#[derive(Clone, Debug)]
pub struct FilterTable {
    kind: FilterKind,
    radius: [f32; 2],
    /// One over the integral, per axis.
    norm: [f64; 2],
    /// `[x0, x1, y0, y1]`
    crop: [i64; 4],
    /// The same.
    edges: [f32; 4],
    /// A box of one pixel: a sample belongs to the pixel it is in.
    single: bool,
}

impl FilterTable {
    pub fn new(filter: &Filter, crop: [u32; 4]) -> Self {
        let radius = filter.radius.to_array();
        let mut table = Self {
            kind: filter.kind,
            radius,
            norm: [1.0; 2],
            crop: crop.map(i64::from),
            edges: crop.map(|v| v as f32),
            single: filter.kind == FilterKind::Box && radius == [0.5, 0.5],
        };
        for axis in 0..2 {
            // Simpson's rule; the kernels are smooth pieces.
            let n = 2000;
            let h = 2.0 * f64::from(radius[axis]) / f64::from(n);
            let at = |i: i32| table.axis(axis, (f64::from(i) * h - f64::from(radius[axis])) as f32);
            let sum: f64 = (0..=n)
                .map(|i| {
                    let w = if i == 0 || i == n {
                        1.0
                    } else if i % 2 == 1 {
                        4.0
                    } else {
                        2.0
                    };
                    w * at(i)
                })
                .sum();
            table.norm[axis] = 3.0 / (h * sum);
        }
        table
    }

    /// Unnormalised value along one axis, `|x| <= radius`.
    fn axis(&self, axis: usize, x: f32) -> f64 {
        let (x, r) = (f64::from(x.abs()), f64::from(self.radius[axis]));
        if x > r {
            return 0.0;
        }
        match self.kind {
            FilterKind::Box => 1.0,
            FilterKind::Triangle => r - x,
            FilterKind::Gaussian { alpha } => {
                let a = f64::from(alpha);
                ((-a * x * x).exp() - (-a * r * r).exp()).max(0.0)
            }
            FilterKind::Mitchell { b, c } => {
                let (b, c) = (f64::from(b), f64::from(c));
                let x = 2.0 * x / r;
                if x > 1.0 {
                    ((-b - 6.0 * c) * x.powi(3)
                        + (6.0 * b + 30.0 * c) * x * x
                        + (-12.0 * b - 48.0 * c) * x
                        + (8.0 * b + 24.0 * c))
                        / 6.0
                } else {
                    ((12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
                        + (-18.0 + 12.0 * b + 6.0 * c) * x * x
                        + (6.0 - 2.0 * b))
                        / 6.0
                }
            }
            FilterKind::Sinc { tau } => {
                let sinc = |x: f64| {
                    let x = x * std::f64::consts::PI;
                    if x < 1e-5 { 1.0 } else { x.sin() / x }
                };
                sinc(x) * sinc(x / f64::from(tau))
            }
        }
    }

    /// Largest absolute weight, for bounds.
    pub fn peak(&self) -> f64 {
        (0..2)
            .map(|axis| {
                let r = self.radius[axis];
                let values = (0..=64).map(|i| self.axis(axis, r * i as f32 / 64.0).abs());
                self.norm[axis] * values.fold(0.0, f64::max)
            })
            .product()
    }

    /// Pixels of the crop window.
    pub fn pixels(&self) -> usize {
        ((self.crop[1] - self.crop[0]) * (self.crop[3] - self.crop[2])) as usize
    }

    /// Whether a sample reaches the pixel it is in, with weight 1, and no other.
    #[inline(always)]
    pub fn is_single(&self) -> bool {
        self.single
    }

    /// Whether `raster` is in the crop window.
    #[inline(always)]
    pub fn contains(&self, raster: [f32; 2]) -> bool {
        let [x0, x1, y0, y1] = self.edges;
        let [x, y] = raster;
        (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
    }

    /// The pixel at `raster`, or the nearest to it in the crop window.
    #[inline]
    pub fn nearest(&self, raster: [f32; 2]) -> usize {
        let [x0, x1, y0, y1] = self.crop;
        let x = i64::from(raster[0] as i32).clamp(x0, x1 - 1) - x0;
        let y = i64::from(raster[1] as i32).clamp(y0, y1 - 1) - y0;
        (y * (x1 - x0) + x) as usize
    }

    /// Calls `add(pixel, weight)` for every pixel of the crop window (row by row from its top left) that a sample at `raster` reaches.
    #[inline]
    pub fn splat(&self, raster: [f32; 2], mut add: impl FnMut(usize, f64)) {
        let [x0, x1, y0, y1] = self.crop;
        let width = (x1 - x0) as usize;
        let index = |x: i64, y: i64| (y - y0) as usize * width + (x - x0) as usize;
        // `as` saturates, and NaN becomes 0: positions are finite and in the region anyway.
        let (fx, fy) = (raster[0].floor() as i64, raster[1].floor() as i64);
        if self.single {
            if self.contains(raster) {
                add(index(fx, fy), 1.0);
            }
            return;
        }
        let reach = |p: f32, r: f32, low: i64, high: i64| {
            let first = ((p - 0.5 - r).ceil() as i64).max(low);
            let last = ((p - 0.5 + r).floor() as i64).min(high - 1);
            first..=last
        };
        for y in reach(raster[1], self.radius[1], y0, y1) {
            let wy = self.axis(1, y as f32 + 0.5 - raster[1]) * self.norm[1];
            for x in reach(raster[0], self.radius[0], x0, x1) {
                let wx = self.axis(0, x as f32 + 0.5 - raster[0]) * self.norm[0];
                add(index(x, y), wx * wy);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn weights_integrate_to_one() {
        let kinds = [
            (FilterKind::Box, 0.5),
            (FilterKind::Box, 1.3),
            (FilterKind::Triangle, 2.0),
            (FilterKind::Gaussian { alpha: 2.0 }, 2.0),
            (
                FilterKind::Mitchell {
                    b: 1.0 / 3.0,
                    c: 1.0 / 3.0,
                },
                2.0,
            ),
            (FilterKind::Sinc { tau: 3.0 }, 4.0),
        ];
        for (kind, r) in kinds {
            let filter = Filter {
                radius: Vec2::splat(r),
                kind,
            };
            let table = FilterTable::new(&filter, [0, 16, 0, 16]);
            // Samples on a fine grid around a pixel: what it collects is its filter's integral.
            let n = 64 * 9;
            let mut integral = 0.0;
            for i in 0..n {
                for j in 0..n {
                    let at = [i, j].map(|k| 4.0 + (k as f32 + 0.5) / 64.0);
                    table.splat(at, |p, w| {
                        if p == 8 * 16 + 8 {
                            integral += w / (64.0 * 64.0);
                        }
                    });
                }
            }
            // The grid resolves the edges of a box 2.6 pixels wide to one part in 166, twice.
            assert!((integral - 1.0).abs() < 0.013, "{kind:?} {integral}");
        }
    }
}
