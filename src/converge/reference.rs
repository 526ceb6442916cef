//! References, and what they themselves are wrong by.
//!
//! A measured error is that of the picture and that of the reference together: with `R` the
//! reference, independent of the picture `A` and both right on average, `E (A - R)^2 = Var A + Var
//! R`. A reference rendered here is the mean of `k` independent parts of equal effort; their
//! scatter estimates `Var R` without bias, pixel by pixel, as `sum((P_j - R)^2) / (k (k - 1))` (two
//! halves: `(P_1 - P_2)^2 / 4`). Divided as the relative mean squared error divides, and averaged
//! over the picture, that is what every measurement has too much. The reference in the denominator
//! leaves a bias of second order: the corrected error is too large by a few times the reference's
//! own relMSE, as a fraction.

use crate::metrics::RELATIVE_EPSILON;
use serde::Serialize;

/// The picture that others are compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Linear sRGB of the crop window.
    pub pixels: Vec<[f32; 3]>,
    pub figures: ReferenceFigures,
}

/// What is known of a reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceFigures {
    /// File, or integrator it was rendered by.
    pub source: String,
    /// Its own relative mean squared error, which is subtracted from measured ones; `None` is
    /// unknown, and nothing is subtracted.
    pub relmse: Option<f64>,
    /// Standard error of `relmse`, by the scatter over pixels as if they were independent; `None`
    /// is unknown.
    pub relmse_stderr: Option<f64>,
    /// Independent renders it is the mean of; 0 for files.
    pub parts: u64,
    /// Mutations or samples per pixel, all parts together; 0 for files.
    pub effort: u64,
    pub seconds: f64,
}

impl ReferenceFigures {
    /// A measured error without the reference's share. May be negative, as unbiased estimates of
    /// small numbers are.
    pub fn correct(&self, measured: f64) -> f64 {
        measured - self.relmse.unwrap_or(0.0)
    }

    /// What is left after the correction is no more than what was taken away.
    pub fn drowns(&self, corrected: f64) -> bool {
        self.relmse.is_some_and(|own| corrected <= own)
    }
}

/// Mean and scatter of independent parts, pixel by pixel (Welford 1962).
#[derive(Clone, Debug, Default)]
pub struct Parts {
    count: u64,
    mean: Vec<[f64; 3]>,
    /// Sums of squared deviations from the mean.
    squares: Vec<[f64; 3]>,
}

impl Parts {
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Adds a part; one of another size than the first counts as far as it goes.
    pub fn add(&mut self, pixels: &[[f32; 3]]) {
        if self.count == 0 {
            self.mean = vec![[0.0; 3]; pixels.len()];
            self.squares = self.mean.clone();
        }
        self.count += 1;
        let sums = self.mean.as_flattened_mut().iter_mut();
        let sums = sums.zip(self.squares.as_flattened_mut());
        for ((mean, square), value) in sums.zip(pixels.as_flattened()) {
            let before = f64::from(*value) - *mean;
            *mean += before / self.count as f64;
            *square += before * (f64::from(*value) - *mean);
        }
    }

    pub fn pixels(&self) -> Vec<[f32; 3]> {
        self.mean.iter().map(|p| p.map(|v| v as f32)).collect()
    }

    /// Relative mean squared error of the mean, and its standard error over pixels; `None` of fewer
    /// than two parts.
    pub fn error(&self) -> Option<(f64, f64)> {
        if self.count < 2 || self.mean.is_empty() {
            return None;
        }
        let k = self.count as f64;
        let pixel = |(mean, squares): (&[f64; 3], &[f64; 3])| {
            let channel =
                |c: usize| squares[c] / (k * (k - 1.0)) / (mean[c] * mean[c] + RELATIVE_EPSILON);
            (0..3).map(channel).sum::<f64>() / 3.0
        };
        let errors: Vec<f64> = self.mean.iter().zip(&self.squares).map(pixel).collect();
        let estimate = super::fit::Estimate::mean(&errors);
        Some((estimate.value, estimate.stderr.unwrap_or(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::relmse;

    /// Pictures of independent pixels around a gradient, with standard deviation `noise * truth`.
    struct Source(u64);

    impl Source {
        fn uniform(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn picture(&mut self, noise: f64) -> Vec<[f32; 3]> {
            (0..PIXELS)
                .map(|i| {
                    [0; 3].map(|_| {
                        let truth = 0.2 + i as f64 / PIXELS as f64;
                        let u = (self.uniform() - 0.5) * 12f64.sqrt();
                        (truth * (1.0 + noise * u)) as f32
                    })
                })
                .collect()
        }
    }

    const PIXELS: usize = 4000;
    const NOISE: f64 = 0.02;

    #[test]
    fn halves_differ_by_what_their_mean_is_wrong() {
        let mut halves = Parts::default();
        halves.add(&[[1.0, 2.0, 0.0]]);
        assert_eq!(halves.error(), None);
        halves.add(&[[3.0, 2.0, 0.0]]);
        assert_eq!(halves.pixels(), [[2.0, 2.0, 0.0]]);
        let expected = (4.0 / 4.0) / (4.0 + RELATIVE_EPSILON) / 3.0;
        assert!((halves.error().unwrap().0 - expected).abs() < 1e-12);
    }

    #[test]
    fn subtraction_leaves_the_error_of_the_picture() {
        // The reference is no better than the pictures: uncorrected, errors would be 1.25 to 1.5
        // times too large.
        let mut source = Source(7);
        let truth = source.picture(0.0);
        for parts in [2, 4] {
            let (mut corrected, mut exact) = (Vec::new(), Vec::new());
            for _ in 0..40 {
                let mut reference = Parts::default();
                for _ in 0..parts {
                    reference.add(&source.picture(NOISE));
                }
                let figures = ReferenceFigures {
                    relmse: reference.error().map(|e| e.0),
                    ..ReferenceFigures::default()
                };
                let picture = source.picture(NOISE);
                corrected.push(figures.correct(relmse(&picture, &reference.pixels())));
                exact.push(relmse(&picture, &truth));
            }
            let differences: Vec<f64> = corrected.iter().zip(&exact).map(|(a, b)| a - b).collect();
            let difference = super::super::fit::Estimate::mean(&differences);
            let exact = exact.iter().sum::<f64>() / 40.0;
            // Four standard errors, and the reference in the denominator.
            let bound = 4.0 * difference.stderr.unwrap() + 6.0 * NOISE.powi(2) * exact;
            assert!(bound < 0.02 * exact, "{bound} {exact}");
            assert!(
                difference.value.abs() < bound,
                "{parts}: {difference:?} {exact}"
            );
        }
    }

    #[test]
    fn the_stated_error_errs_as_it_says() {
        let mut source = Source(3);
        let mut values = Vec::new();
        let mut said = 0.0;
        for _ in 0..200 {
            let mut parts = Parts::default();
            parts.add(&source.picture(NOISE));
            parts.add(&source.picture(NOISE));
            let (value, stderr) = parts.error().unwrap();
            values.push(value);
            said += stderr / 200.0;
        }
        let mean = values.iter().sum::<f64>() / 200.0;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 199.0).sqrt();
        assert!((0.8..1.25).contains(&(said / spread)), "{said} {spread}");
    }

    #[test]
    fn drowned_runs_are_marked() {
        let known = ReferenceFigures {
            relmse: Some(1e-3),
            ..ReferenceFigures::default()
        };
        assert!(known.drowns(known.correct(1.9e-3)) && !known.drowns(known.correct(2.1e-3)));
        assert!(known.drowns(known.correct(0.5e-3)));
        let unknown = ReferenceFigures::default();
        assert!(!unknown.drowns(unknown.correct(1e-9)));
    }
}
