//! The estimated error of a whole picture.
//!
//! Wanted is `mean(variance / (truth^2 + eps))` over pixels and channels,
//! [`crate::metrics::relmse`] in expectation. The truth is not known, and the picture is no
//! substitute: where it is noisy its own bright pixels would be found accurate, its dark ones
//! without error. Both sums are therefore taken over windows: of 3 x 3 values where there is little
//! noise, so that edges stay sharp, of 7 x 7 where there is more. In the latter the mean square of
//! the picture is that of the truth once the mean variance is subtracted:
//!
//! ```text
//! sharp  = <variance>_3 / (<picture>_3^2 + eps)
//! smooth = <variance>_7 / (max(<picture^2>_7 - <variance>_7, <picture>_7^2 / 4) + eps)
//! noise  = <variance>_7 / (<picture>_7^2 + eps)
//! error  = (0.1 * sharp + noise * smooth) / (0.1 + noise)
//! ```
//!
//! with `<.>_n` the mean over a window of `n` by `n` pixels, repeated at the border. In the mean
//! over renders it is within a factor of 1.3 of the true error where that is below one; the
//! estimate of a picture that is mostly noise is too low, and that of a small picture whose only
//! noise is at the edges of what is bright up to 1.7 times too high (`tests/renderer/accuracy.rs`).

use crate::metrics::RELATIVE_EPSILON;
use rayon::prelude::*;
use std::ops::Range;

/// Half widths of the windows.
const HALVES: [usize; 2] = [1, 3];
/// Relative variance at which a window counts as much as the smaller one.
const NOISY: [f64; 2] = [0.0, 0.1];

/// Rows of a picture that are judged at a time.
const BAND: usize = 32;

/// Estimated relative mean squared error of a picture of `width` by `height` pixels. `resolve`
/// gives rows of it, and a standard error of each of their values whose square is right in the
/// mean: the whole is never held.
pub fn relmse(
    width: usize,
    height: usize,
    resolve: impl Fn(Range<usize>) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) + Sync,
) -> f64 {
    let margin = HALVES[HALVES.len() - 1];
    let sums: Vec<f64> = (0..height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let (from, to) = (band * BAND, height.min((band + 1) * BAND));
            let first = from.saturating_sub(margin);
            let (picture, deviation) = resolve(first..height.min(to + margin));
            let mut columns = Columns::new(width);
            (from..to)
                .map(|row| columns.relmse(&picture, &deviation, row - first))
                .sum()
        })
        .collect();
    // In the order of rows: the sum does not depend on threads.
    sums.iter().sum::<f64>() / (3 * width * height).max(1) as f64
}

/// What is summed over windows.
const PICTURE: usize = 0;
const SQUARE: usize = 1;
const VARIANCE: usize = 2;

/// Sums over a column of each window, `[quantity][window][3 * x + channel]`.
struct Columns {
    width: usize,
    sums: [[Vec<f64>; 2]; 3],
}

impl Columns {
    fn new(width: usize) -> Self {
        let room = || std::array::from_fn(|_| vec![0.0; 3 * width]);
        Self {
            width,
            sums: std::array::from_fn(|_| room()),
        }
    }

    /// Sum of the estimated relative squared errors of a row.
    fn relmse(&mut self, picture: &[[f32; 3]], deviation: &[[f32; 3]], row: usize) -> f64 {
        let width = self.width;
        self.sum(picture, deviation, row);
        let over = |variance: f64, square: f64| variance / (square + RELATIVE_EPSILON);
        let mut sum = 0.0;
        for x in 0..width {
            for c in 0..3 {
                let mut error = 0.0;
                for (window, half) in HALVES.into_iter().enumerate() {
                    let mean = |quantity: usize| self.mean(quantity, window, half, x, c);
                    let [p, s, v] = [PICTURE, SQUARE, VARIANCE].map(mean);
                    let noise = over(v, p * p);
                    let own = if window == 0 {
                        noise
                    } else {
                        // A mean square is at least the square of the mean, give or take what both
                        // are uncertain.
                        over(v, (s - v).max(0.25 * p * p))
                    };
                    error = if window == 0 || noise == f64::INFINITY {
                        own
                    } else {
                        (NOISY[window] * error + noise * own) / (NOISY[window] + noise)
                    };
                }
                sum += error;
            }
        }
        sum
    }

    /// Mean over a window about pixel `x`.
    fn mean(&self, quantity: usize, window: usize, half: usize, x: usize, c: usize) -> f64 {
        let sums = &self.sums[quantity][window];
        let (from, to) = (x.saturating_sub(half), (x + half + 1).min(self.width));
        // Not as a difference of running sums, in which what is dim drowns beside what is bright.
        let inside: f64 = (from..to).map(|x| sums[3 * x + c]).sum();
        // Beyond the border it is as at the border.
        let left = half.saturating_sub(x) as f64 * sums[c];
        let right = (x + half + 1 - to) as f64 * sums[3 * (self.width - 1) + c];
        ((inside + left + right) / (2 * half + 1).pow(2) as f64).max(0.0)
    }

    /// Sums over columns. Each window holds the smaller ones.
    fn sum(&mut self, picture: &[[f32; 3]], deviation: &[[f32; 3]], row: usize) {
        let width = self.width;
        let height = picture.len() / width;
        let mut inner = None;
        for (window, half) in HALVES.into_iter().enumerate() {
            for quantity in &mut self.sums {
                let (done, rest) = quantity.split_at_mut(window);
                match done.last() {
                    Some(smaller) => rest[0].copy_from_slice(smaller),
                    None => rest[0].fill(0.0),
                }
            }
            let [pictures, squares, variances] = &mut self.sums;
            for (i, y) in around(row, half, height).enumerate() {
                let outside = inner.is_none_or(|inner: usize| i.abs_diff(half) > inner);
                if !outside {
                    continue;
                }
                let at = y * width..(y + 1) * width;
                let values = picture[at.clone()].as_flattened().iter();
                let values = values.zip(deviation[at].as_flattened());
                let sums = pictures[window].iter_mut().zip(&mut squares[window]);
                for ((to, from), v_to) in sums.zip(values).zip(&mut variances[window]) {
                    let (p, d) = (f64::from(*from.0), f64::from(*from.1));
                    *to.0 += p;
                    *to.1 += p * p;
                    *v_to += d * d;
                }
            }
            inner = Some(half);
        }
    }
}

/// Standard errors, from those of one degree of freedom: the root of the mean of their squares over
/// windows of 5 x 5 pixels.
pub fn standard_errors(deviation: &[[f32; 3]], width: usize) -> Vec<[f32; 3]> {
    let height = deviation.len() / width.max(1);
    let error = |i: usize| {
        let mut sum = [0.0; 3];
        for y in around(i / width, SPREAD, height) {
            for x in around(i % width, SPREAD, width) {
                let d = deviation[y * width + x].map(f64::from);
                (0..3).for_each(|c| sum[c] += d[c] * d[c]);
            }
        }
        sum.map(|s| (s / (2 * SPREAD + 1).pow(2) as f64).sqrt() as f32)
    };
    (0..deviation.len()).into_par_iter().map(error).collect()
}

/// Half width of the window that standard errors are taken over.
const SPREAD: usize = 2;

/// The positions in a window about `at`, of `2 * half + 1`, those beyond `0..n` replaced by the
/// border.
fn around(at: usize, half: usize, n: usize) -> impl Iterator<Item = usize> {
    (0..2 * half + 1).map(move |i| (at + i).saturating_sub(half).min(n - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A standard normal number, nearly: the sum of twelve uniform ones.
    fn normal(state: &mut u64) -> f64 {
        let mut uniform = || {
            *state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (*state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// The true relative error and its estimate, of pictures with a bright half, an edge and a
    /// gradient.
    fn both(sigma: f64) -> (f64, f64) {
        let (width, height) = (96, 64);
        let mut state = 7;
        let truth = |x: usize, y: usize| if x < 48 { 1.0 } else { 0.05 + y as f64 / 640.0 };
        let (mut picture, mut deviation, mut exact) = (Vec::new(), Vec::new(), 0.0);
        for y in 0..height {
            for x in 0..width {
                let t = truth(x, y);
                let noise = sigma * t;
                exact += noise * noise / (t * t + RELATIVE_EPSILON);
                // Halves of twice the variance.
                let half = |state: &mut u64| t + noise * 2f64.sqrt() * normal(state);
                let (a, b) = (half(&mut state), half(&mut state));
                picture.push([((a + b) / 2.0) as f32; 3]);
                deviation.push([((a - b) / 2.0) as f32; 3]);
            }
        }
        let n = (width * height) as f64;
        let rows = |r: Range<usize>| {
            let at = r.start * width..r.end * width;
            (picture[at.clone()].to_vec(), deviation[at].to_vec())
        };
        (exact / n, relmse(width, height, rows))
    }

    #[test]
    fn the_estimate_is_near_the_truth_at_any_noise() {
        for sigma in [0.01, 0.1, 0.3, 0.6] {
            let (exact, estimate) = both(sigma);
            let ratio = estimate / exact;
            assert!((0.85..1.15).contains(&ratio), "sigma {sigma}: {ratio}");
        }
    }

    /// A lamp in the same row, with noise of its own.
    #[test]
    fn what_is_dim_is_judged_beside_what_is_bright() {
        let width = 64;
        let row = |lamp: f32, dim: f32| {
            let at = |x: usize| [if x < 8 { lamp } else { dim }; 3];
            (0..width).map(at).collect::<Vec<_>>()
        };
        let own = relmse(width, 1, |_| (row(1.0, 1.0), row(0.0, 0.1)));
        let beside = relmse(width, 1, |_| (row(1e12, 1.0), row(1e5, 0.1)));
        // The lamp hides the next pixels alone.
        assert!((own - beside).abs() < 0.1 * own, "{own} {beside}");
    }

    #[test]
    fn small_pictures_are_all_border() {
        assert_eq!(relmse(0, 0, |_| unreachable!()), 0.0);
        let one = relmse(1, 1, |_| (vec![[2.0; 3]], vec![[1.0; 3]]));
        assert!((0.2..0.4).contains(&one), "{one}");
    }
}
