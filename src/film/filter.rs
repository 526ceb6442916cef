//! Reconstruction filters, normalised to integrate to 1 over the raster plane.
//!
//! A sample at raster position `p` adds `filter(p - centre) * value` to every pixel whose centre is
//! in reach; with samples over the whole [`crate::camera::Region`] that is the filtered picture in
//! expectation, also for light subpaths, whose positions are not chosen. Samples that are placed in
//! the cells of the raster lie in the part of each that its pixel's filter reaches
//! ([`FilterTable::cell`]).

use super::TILE;
use crate::scene::{Filter, FilterKind};
use std::ops::Range;

/// Intervals of a table, even so that kinks at half the radius are at a step. Linear in between:
/// off by some 1e-6 of the peak.
const STEPS: usize = 2048;

/// A filter over the pixels of a crop window.
#[derive(Clone, Debug)]
pub struct FilterTable {
    kind: FilterKind,
    radius: [f32; 2],
    /// One over the integral, per axis.
    norm: [f64; 2],
    /// Normalised values along each axis, at equal steps from 0 to the radius.
    tables: [Vec<f32>; 2],
    /// `[x0, x1, y0, y1]`
    crop: [i64; 4],
    /// The same.
    edges: [f32; 4],
    /// A box of one pixel: a sample belongs to the pixel it is in.
    single: bool,
}

impl FilterTable {
    /// For the pixels of the crop window `[x0, x1, y0, y1]`, whose ends are not in it.
    pub fn new(filter: &Filter, crop: [u32; 4]) -> Self {
        let radius = filter.radius.to_array();
        let mut table = Self {
            kind: filter.kind,
            radius,
            norm: [1.0; 2],
            tables: Default::default(),
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
            let step = radius[axis] / STEPS as f32;
            table.tables[axis] = (0..=STEPS)
                .map(|i| (table.norm[axis] * table.axis(axis, i as f32 * step)) as f32)
                .collect();
            // Read, with no weight, at the end of the last interval.
            table.tables[axis].push(0.0);
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

    /// Weight of the filter of a pixel along one axis up to `x` pixels beyond its centre, of 1 in
    /// all.
    pub fn below(&self, axis: usize, x: f64) -> f64 {
        let r = f64::from(self.radius[axis]);
        if x >= r {
            return 1.0;
        }
        // Midpoints; the table is piecewise linear.
        let h = (x + r).max(0.0) / STEPS as f64;
        let values = (0..STEPS).map(|i| self.weight(axis, ((i as f64 + 0.5) * h - r) as f32));
        values.map(f64::from).sum::<f64>() * h
    }

    /// The crop window, `[x0, x1, y0, y1]`.
    pub fn crop(&self) -> [u32; 4] {
        self.crop.map(|v| v as u32)
    }

    /// Pixels of the crop window.
    pub fn pixels(&self) -> usize {
        ((self.crop[1] - self.crop[0]) * (self.crop[3] - self.crop[2])) as usize
    }

    /// Side of the part of a pixel along one axis that its own filter reaches: 1, or less where the
    /// filter is narrower than the pixel.
    pub fn cell(&self, axis: usize) -> f64 {
        (2.0 * f64::from(self.radius[axis])).min(1.0)
    }

    /// Whether some weights are negative.
    pub fn is_signed(&self) -> bool {
        self.tables.iter().flatten().any(|w| *w < 0.0)
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

    /// Calls `add(pixel, weight)` for every pixel of the crop window (row by row from its top left)
    /// that a sample at `raster` reaches.
    #[inline]
    pub fn splat(&self, raster: [f32; 2], mut add: impl FnMut(usize, f64)) {
        self.rows(raster, |first, weights, row| {
            for (i, w) in weights.iter().enumerate() {
                add(first + i, f64::from(*w) * row);
            }
        });
    }

    /// The same in runs: calls `add(first, weights, row)` for pixels `first..first + weights.len()`
    /// of weights `weights[i] * row`.
    #[inline]
    pub fn rows(&self, raster: [f32; 2], mut add: impl FnMut(usize, &[f32], f64)) {
        if self.single {
            if self.contains(raster) {
                add(self.nearest(raster), &[1.0], 1.0);
            }
            return;
        }
        let [x0, x1, y0, y1] = self.crop;
        let width = (x1 - x0) as usize;
        let rows = reach(raster[1], self.radius[1], y0, y1);
        let mut columns = reach(raster[0], self.radius[0], x0, x1);
        while columns.start < columns.end {
            let mut weights = [0.0; RUN];
            let n = (columns.end - columns.start).min(RUN as i64) as usize;
            for (i, w) in weights[..n].iter_mut().enumerate() {
                let x = (columns.start + i as i64) as f32 + 0.5 - raster[0];
                *w = self.weight(0, x);
            }
            for y in rows.clone() {
                let row = self.weight(1, y as f32 + 0.5 - raster[1]);
                let first = (y - y0) as usize * width + (columns.start - x0) as usize;
                add(first, &weights[..n], f64::from(row));
            }
            columns.start += n as i64;
        }
    }

    /// Calls `add([column, row], weight)` for every tile that a sample at `raster` reaches, with
    /// its weight in all pixels there.
    pub fn by_tile(&self, raster: [f32; 2], mut add: impl FnMut([usize; 2], f64)) {
        let [x0, x1, y0, y1] = self.crop;
        // Weights along an axis, of the pixels of a tile at a time.
        let along = |axis: usize, low: i64, high: i64, add: &mut dyn FnMut(usize, f64)| {
            let mut next = reach(raster[axis], self.radius[axis], low, high);
            while next.start < next.end {
                let tile = (next.start - low) / i64::from(TILE);
                let end = next.end.min(low + (tile + 1) * i64::from(TILE));
                let weights =
                    (next.start..end).map(|i| self.weight(axis, i as f32 + 0.5 - raster[axis]));
                add(tile as usize, weights.map(f64::from).sum());
                next.start = end;
            }
        };
        along(1, y0, y1, &mut |row, wy| {
            along(0, x0, x1, &mut |column, wx| add([column, row], wx * wy));
        });
    }

    /// Calls `touch(pixel)` at both ends of every row that [`Self::rows`] will add to.
    #[inline]
    pub fn prefetch(&self, raster: [f32; 2], mut touch: impl FnMut(usize)) {
        let [x0, x1, y0, y1] = self.crop;
        let width = (x1 - x0) as usize;
        let columns = reach(raster[0], self.radius[0], x0, x1);
        if columns.is_empty() {
            return;
        }
        for y in reach(raster[1], self.radius[1], y0, y1) {
            let row = (y - y0) as usize * width;
            touch(row + (columns.start - x0) as usize);
            touch(row + (columns.end - 1 - x0) as usize);
        }
    }

    /// Normalised value along one axis, from the table.
    #[inline(always)]
    fn weight(&self, axis: usize, x: f32) -> f32 {
        let at = x.abs() * (STEPS as f32 / self.radius[axis]);
        // Rounding can take the edge of the filter beyond the table.
        let at = at.min(STEPS as f32);
        let i = at as i32 as usize;
        let t = at - i as f32;
        let table = &self.tables[axis][i..i + 2];
        table[0] + t * (table[1] - table[0])
    }
}

/// Pixels in `low..high` whose centres are within `r` of `p`. Casts saturate, and NaN becomes 0:
/// positions are finite anyway.
#[inline(always)]
fn reach(p: f32, r: f32, low: i64, high: i64) -> Range<i64> {
    let first = i64::from((p - 0.5 - r).ceil() as i32).max(low);
    let last = i64::from((p - 0.5 + r).floor() as i32).min(high - 1);
    first..last + 1
}

/// Most pixels of a run.
const RUN: usize = 16;

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
