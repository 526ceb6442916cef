//! A piecewise-constant density over the texels of an image, sampled by inversion of rows and then columns.

/// Cumulative tables. The probability of a texel is the width of its interval as rounded, not the wish.
pub struct Distribution {
    width: usize,
    height: usize,
    /// Cumulative probability of rows, and of texels within each row, ending in 1.
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Distribution {
    /// In proportion to `value(x, y) * row_weight(y)`, none of them negative. If all are zero, it is texel (0, 0).
    pub fn new(
        [width, height]: [usize; 2],
        value: impl Fn(i64, i64) -> f64,
        row_weight: impl Fn(usize) -> f64,
    ) -> Self {
        let mut row_sums = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(width * height);
        for y in 0..height {
            let mut running = 0.0;
            let start = columns.len();
            for x in 0..width {
                running += value(x as i64, y as i64);
                columns.push(running);
            }
            for c in &mut columns[start..] {
                *c = if running > 0.0 { *c / running } else { 1.0 };
            }
            row_sums.push(running * row_weight(y));
        }
        let total: f64 = row_sums.iter().sum();
        let mut running = 0.0;
        let mut rows: Vec<f32> = (row_sums.iter())
            .map(|r| {
                running += r;
                if total > 0.0 {
                    (running / total) as f32
                } else {
                    1.0
                }
            })
            .collect();
        if let Some(last) = rows.last_mut() {
            *last = 1.0;
        }
        Self {
            width,
            height,
            rows,
            columns: columns.into_iter().map(|c| c as f32).collect(),
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

/// What a bilinear look-up within texel `(x, y)` comes to on average: the tent-filtered image, positive wherever the look-up is.
pub fn tent(value: impl Fn(i64, i64) -> f64, x: i64, y: i64) -> f64 {
    let mut sum = 0.0;
    for (dy, wy) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
        for (dx, wx) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
            sum += wx * wy * value(x + dx, y + dy);
        }
    }
    sum
}

/// Bilinear interpolation between texel centres at `(x, y)`, which are texel coordinates less one half.
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
}
