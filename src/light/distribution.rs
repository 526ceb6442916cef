//! A piecewise-constant density over the texels of an image, sampled by inversion of rows and then
//! columns.

use super::choice::CELLS;
use crate::scene::Rgb;

/// Cumulative tables. Intervals end on the grid of primary samples ([`CELLS`]), so the probability
/// of a texel is exactly how many of them choose it; one that shines has at least a cell of its
/// row, and its row one of the image, however bright the sun beside it.
pub struct Distribution {
    width: usize,
    height: usize,
    /// Cumulative probability of rows, and of texels within each row, ending in 1.
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Distribution {
    /// In proportion to `value(x, y) * row_weight(y)`, none of them negative. If all are zero, it
    /// is texel (0, 0).
    pub fn new(
        [width, height]: [usize; 2],
        value: impl Fn(i64, i64) -> f64,
        row_weight: impl Fn(usize) -> f64,
    ) -> Self {
        let mut row_sums = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(width * height);
        for y in 0..height {
            let row: Vec<f64> = (0..width).map(|x| value(x as i64, y as i64)).collect();
            columns.extend(intervals(&row));
            row_sums.push(row.iter().sum::<f64>() * row_weight(y));
        }
        Self {
            width,
            height,
            rows: intervals(&row_sums),
            columns,
        }
    }

    /// A place in the unit square.
    pub fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let (y, fy) = invert(&self.rows, u[1]);
        let row = &self.columns[y * self.width..(y + 1) * self.width];
        let (x, fx) = invert(row, u[0]);
        [
            (x as f32 + fx) / self.width as f32,
            (y as f32 + fy) / self.height as f32,
        ]
    }

    /// Density over the unit square within texel `(x, y)`.
    pub fn density(&self, x: usize, y: usize) -> f32 {
        let step = |cdf: &[f32], i: usize| cdf[i] - if i == 0 { 0.0 } else { cdf[i - 1] };
        let row = &self.columns[y * self.width..(y + 1) * self.width];
        step(&self.rows, y) * step(row, x) * (self.width * self.height) as f32
    }
}

/// Upper ends of intervals in proportion to values that are not negative, on the grid of primary
/// samples; a value that is not 0 has a cell or more. If all are zero, the first has all.
pub fn intervals(values: &[f64]) -> Vec<f32> {
    let total: f64 = values.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return vec![1.0; values.len()];
    }
    let least = |value: &f64| u32::from(*value > 0.0);
    let (mut sum, mut before) = (0.0, 0);
    let mut ends: Vec<u32> = (values.iter())
        .map(|value| {
            sum += value;
            let own = (sum / total * f64::from(CELLS)).round() as u32;
            before = own.max(before + least(value));
            before
        })
        .collect();
    // What was set aside may have pushed the last ones beyond the end.
    let mut limit = CELLS;
    for (end, value) in ends.iter_mut().zip(values).rev() {
        *end = (*end).min(limit);
        limit = end.saturating_sub(least(value));
    }
    if let Some(last) = ends.last_mut() {
        *last = CELLS;
    }
    (ends.into_iter())
        .map(|end| end as f32 / CELLS as f32)
        .collect()
}

/// Mean of the channels: what a colour counts for in a density, and in a light's power.
pub fn mean(colour: Rgb) -> f32 {
    (colour[0] + colour[1] + colour[2]) / 3.0
}

/// What a bilinear look-up within texel `(x, y)` comes to on average: the tent-filtered image,
/// positive wherever the look-up is.
pub fn tent(value: impl Fn(i64, i64) -> f64, x: i64, y: i64) -> f64 {
    let mut sum = 0.0;
    for (dy, wy) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
        for (dx, wx) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
            sum += wx * wy * value(x + dx, y + dy);
        }
    }
    sum
}

/// Bilinear interpolation between texel centres at `(x, y)`, which are texel coordinates less one
/// half.
pub fn bilinear(texel: impl Fn(i64, i64) -> [f32; 3], x: f32, y: f32) -> [f32; 3] {
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (x0, y0) = (x0 as i64, y0 as i64);
    let (a, b) = (texel(x0, y0), texel(x0 + 1, y0));
    let (c, d) = (texel(x0, y0 + 1), texel(x0 + 1, y0 + 1));
    std::array::from_fn(|i| {
        let top = (1.0 - fx) * a[i] + fx * b[i];
        let bottom = (1.0 - fx) * c[i] + fx * d[i];
        (1.0 - fy) * top + fy * bottom
    })
}

/// The interval of a cumulative table that holds `u`, and where in it.
fn invert(cdf: &[f32], u: f32) -> (usize, f32) {
    let i = cdf.partition_point(|end| *end <= u).min(cdf.len() - 1);
    let start = if i == 0 { 0.0 } else { cdf[i - 1] };
    let width = cdf[i] - start;
    let f = if width > 0.0 {
        (u - start) / width
    } else {
        0.5
    };
    (i, f.clamp(0.0, 0.999_999_9))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_images_are_sampled_at_one_place() {
        for size in [[1, 1], [3, 2]] {
            let black = Distribution::new(size, |_, _| 0.0, |_| 1.0);
            for u in [0.0, 0.4, 0.999_999_9] {
                let [x, y] = black.sample([u, 1.0 - u - 1e-7]);
                assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                assert!(x < 1.0 / size[0] as f32 && y < 1.0 / size[1] as f32);
            }
            assert_eq!(black.density(0, 0), (size[0] * size[1]) as f32);
        }
    }

    /// Every primary sample, counted: what a texel's width says is how often it is chosen, and
    /// nothing that shines is left out.
    #[test]
    fn beside_a_sun_every_texel_has_its_samples() {
        let n = 4096;
        for (sun, at) in [(1e3, 7), (1e6, 2000), (1e12, 0), (1e12, n - 1)] {
            let values: Vec<f64> = (0..n)
                .map(|i| match i {
                    i if i == at => sun,
                    i if i % 64 == 5 => 0.0,
                    i => 1.0 + f64::from(i as u32 % 3),
                })
                .collect();
            let ends = intervals(&values);
            let mut count = vec![0u32; n];
            for cell in 0..CELLS {
                count[invert(&ends, cell as f32 / CELLS as f32).0] += 1;
            }
            for (i, value) in values.iter().enumerate() {
                let start = if i == 0 { 0.0 } else { ends[i - 1] };
                assert_eq!(count[i] as f32 / CELLS as f32, ends[i] - start, "{i}");
                assert_eq!(count[i] > 0, *value > 0.0, "{i}");
            }
        }
    }
}
