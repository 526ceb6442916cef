//! Images in `f64`: densities that are constant over their texels, and look-ups between them.
//!
//! The probability of a texel is by definition what the renderer's tables say, cells of the primary
//! samples' grid. The tables are made once more here.

use super::vector::V;
use crate::light::distribution::intervals;

/// A density over the unit square.
pub struct Table {
    width: usize,
    height: usize,
    /// Upper ends of the rows' intervals, and of the texels' within each row.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Table {
    /// In proportion to `weight(x, y)`, and to `of_row(y)`.
    pub fn new(
        [width, height]: [usize; 2],
        weight: impl Fn(i64, i64) -> f64,
        of_row: impl Fn(i64) -> f64,
    ) -> Self {
        let mut columns = Vec::with_capacity(width * height);
        let mut rows = Vec::with_capacity(height);
        for y in 0..height as i64 {
            let row: Vec<f64> = (0..width as i64).map(|x| weight(x, y)).collect();
            columns.extend(intervals(&row).into_iter().map(f64::from));
            rows.push(row.iter().sum::<f64>() * of_row(y));
        }
        Self {
            width,
            height,
            rows: intervals(&rows).into_iter().map(f64::from).collect(),
            columns,
        }
    }

    /// Density at a place of the unit square.
    pub fn density(&self, u: f64, v: f64) -> f64 {
        let (w, h) = (self.width, self.height);
        let x = ((u * w as f64) as usize).min(w - 1);
        let y = ((v * h as f64) as usize).min(h - 1);
        let step = |ends: &[f64], i: usize| {
            let end = |i: usize| ends.get(i).copied().unwrap_or(0.0);
            if i == 0 { end(0) } else { end(i) - end(i - 1) }
        };
        step(&self.rows, y) * step(self.row(y), x) * (w * h) as f64
    }

    /// The place that two primary samples stand for.
    pub fn sample(&self, u: f64, v: f64) -> [f64; 2] {
        let (y, fy) = invert(&self.rows, v);
        let (x, fx) = invert(self.row(y), u);
        [
            (x as f64 + fx) / self.width as f64,
            (y as f64 + fy) / self.height as f64,
        ]
    }

    fn row(&self, y: usize) -> &[f64] {
        let start = y * self.width;
        self.columns.get(start..start + self.width).unwrap_or(&[])
    }
}

/// Mean of the channels of a texel, in the renderer's precision.
pub fn brightness(texel: V) -> f64 {
    let [r, g, b] = texel.map(|v| v as f32);
    f64::from(((r + g + b) / 3.0).clamp(0.0, f32::MAX))
}

/// An image seen through a tent of two texels' radius.
pub fn tent(value: impl Fn(i64, i64) -> f64, x: i64, y: i64) -> f64 {
    let weight = |d: i64| if d == 0 { 0.5 } else { 0.25 };
    (-1..=1)
        .flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)))
        .map(|(dx, dy)| weight(dx) * weight(dy) * value(x + dx, y + dy))
        .sum()
}

/// Between texel centres; coordinates less one half.
pub fn bilinear(texel: impl Fn(i64, i64) -> V, x: f64, y: f64) -> V {
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let mut sum = [0.0; 3];
    for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
        for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
            let texel = texel(x0 as i64 + dx, y0 as i64 + dy);
            for c in 0..3 {
                sum[c] += wx * wy * texel[c];
            }
        }
    }
    sum
}

/// The interval that holds `u`, and where in it.
fn invert(ends: &[f64], u: f64) -> (usize, f64) {
    let i = ends.partition_point(|end| *end <= u);
    let i = i.min(ends.len().saturating_sub(1));
    let start = if i == 0 { 0.0 } else { ends[i - 1] };
    let width = ends.get(i).copied().unwrap_or(1.0) - start;
    let f = if width > 0.0 {
        (u - start) / width
    } else {
        0.5
    };
    (i, f.clamp(0.0, 1.0 - f64::EPSILON))
}
