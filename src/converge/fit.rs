//! The statistics: lines through logarithms, and standard errors over seeds.

use serde::Serialize;

/// `log10 y = intercept + slope * log10 x`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    pub intercept: f64,
    pub slope: f64,
}

impl Line {
    /// Least squares through the logarithms of `(x, y)`; `None` for fewer than two different `x`,
    /// or numbers that have no logarithm.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points.iter().map(|p| (p.0.log10(), p.1.log10())).collect();
        if logs.len() < 2 || logs.iter().any(|p| !(p.0.is_finite() && p.1.is_finite())) {
            return None;
        }
        let n = logs.len() as f64;
        let x = logs.iter().map(|p| p.0).sum::<f64>() / n;
        let y = logs.iter().map(|p| p.1).sum::<f64>() / n;
        let xx: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        let xy: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        if xx <= 1e-12 {
            return None;
        }
        let slope = xy / xx;
        Some(Self {
            intercept: y - slope * x,
            slope,
        })
    }

    /// The `x` at which a falling line reaches `y`; `None` if it never does, or not at a number.
    pub fn reach(&self, y: f64) -> Option<f64> {
        let x = 10f64.powf((y.log10() - self.intercept) / self.slope);
        (self.slope < 0.0 && x.is_finite() && x > 0.0).then_some(x)
    }
}

/// A value and its standard error over the seeds; `None` where one seed, or too few that could be
/// used, tell of no error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Estimate {
    pub value: f64,
    pub stderr: Option<f64>,
}

impl Estimate {
    /// Mean and its standard error.
    pub fn mean(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n.max(1.0);
        let square: f64 = values.iter().map(|v| (v - value).powi(2)).sum();
        Self {
            value,
            stderr: (values.len() > 1).then(|| (square / (n * (n - 1.0))).sqrt()),
        }
    }

    /// Jackknife: the standard error is `sqrt((n - 1) / n * sum((theta_i - mean theta)^2))`, with
    /// `theta_i` the statistic without seed `i` of `n` (Efron and Stein 1981). For a mean that
    /// is `s / sqrt(n)`, unlike the bootstrap, which for the handful of seeds that one can
    /// afford is too small by `sqrt((n - 1) / n)`; and it needs no random numbers.
    ///
    /// `statistic` is told the seed to leave out. `None` if it has no value on all seeds.
    pub fn jackknife(
        seeds: &[u64],
        statistic: impl Fn(Option<u64>) -> Option<f64>,
    ) -> Option<Self> {
        let value = statistic(None)?;
        let parts: Option<Vec<f64>> = seeds.iter().map(|seed| statistic(Some(*seed))).collect();
        let stderr = parts.filter(|p| p.len() > 1).map(|parts| {
            let n = parts.len() as f64;
            let mean = parts.iter().sum::<f64>() / n;
            let square: f64 = parts.iter().map(|p| (p - mean).powi(2)).sum();
            (square * (n - 1.0) / n).sqrt()
        });
        Some(Self { value, stderr })
    }

    /// `10^value`, with the error as a fraction of it: for statistics that were computed in
    /// logarithms.
    pub fn exp10(self) -> Self {
        let value = 10f64.powf(self.value);
        Self {
            value,
            stderr: self.stderr.map(|e| value * (10f64.powf(e) - 1.0)),
        }
    }

    /// The error as a fraction of the value.
    pub fn relative(&self) -> Option<f64> {
        self.stderr
            .map(|e| e / self.value.abs())
            .filter(|r| r.is_finite())
    }

    /// Of independent estimates.
    pub fn ratio(self, other: Self) -> Self {
        let value = self.value / other.value;
        let errors = self.relative().zip(other.relative());
        Self {
            value,
            stderr: errors.map(|(a, b)| value.abs() * a.hypot(b)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform in `[0, 1)`; reproducible.
    fn uniform(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn lines_of_known_slope() {
        for slope in [-1.0, -0.5, -2.0] {
            let points: Vec<(f64, f64)> = (0..5)
                .map(|i| 0.25 * 2f64.powi(i))
                .map(|x| (x, 0.03 * x.powf(slope)))
                .collect();
            let line = Line::fit(&points).unwrap();
            assert!((line.slope - slope).abs() < 1e-12);
            assert!((line.intercept - 0.03f64.log10()).abs() < 1e-12);
            let x = line.reach(1e-3).unwrap();
            assert!((0.03 * x.powf(slope) / 1e-3 - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn no_line_is_made_up() {
        assert_eq!(Line::fit(&[]), None);
        assert_eq!(Line::fit(&[(1.0, 1.0)]), None);
        assert_eq!(Line::fit(&[(1.0, 1.0), (1.0, 2.0)]), None);
        assert_eq!(Line::fit(&[(1.0, 1.0), (2.0, 0.0)]), None);
        assert_eq!(Line::fit(&[(1.0, -1.0), (2.0, 1.0)]), None);
        let rising = Line::fit(&[(1.0, 1.0), (2.0, 2.0)]).unwrap();
        assert_eq!(rising.reach(0.1), None);
        let flat = Line::fit(&[(1.0, 1.0), (2.0, 1.0)]).unwrap();
        assert_eq!(flat.reach(0.1), None);
    }

    #[test]
    fn the_jackknife_of_a_mean_is_the_usual_error() {
        let values = [1.0, 4.0, 2.0, 8.0];
        let mean = |out: Option<u64>| {
            let kept = (0..4u64).filter(|i| Some(*i) != out);
            let kept: Vec<f64> = kept.map(|i| values[i as usize]).collect();
            Some(kept.iter().sum::<f64>() / kept.len() as f64)
        };
        let jackknife = Estimate::jackknife(&[0, 1, 2, 3], mean).unwrap();
        let usual = Estimate::mean(&values);
        assert!((jackknife.value - usual.value).abs() < 1e-12);
        assert!((jackknife.stderr.unwrap() - usual.stderr.unwrap()).abs() < 1e-12);
        assert_eq!(Estimate::jackknife(&[0], mean).unwrap().stderr, None);
        assert_eq!(Estimate::jackknife(&[0, 1], |_| None), None);
        assert_eq!(Estimate::mean(&[2.0]).stderr, None);
    }

    #[test]
    fn jackknifed_slopes_err_as_much_as_they_say() {
        // 400 studies of 4 seeds: the scatter of their slopes is what the jackknife says, on
        // average.
        let mut state = 1;
        let (mut squares, mut said) = (0.0, 0.0);
        for _ in 0..400 {
            let error = |x: f64, u: f64| 0.1 / x * (0.8 + 0.4 * u);
            let runs: Vec<[f64; 5]> = (0..4)
                .map(|_| std::array::from_fn(|i| error(2f64.powi(i as i32), uniform(&mut state))))
                .collect();
            let slope = |out: Option<u64>| {
                let points: Vec<(f64, f64)> = (0..5)
                    .map(|i| {
                        let kept =
                            (runs.iter().enumerate()).filter(|(s, _)| Some(*s as u64) != out);
                        let kept: Vec<f64> = kept.map(|(_, run)| run[i]).collect();
                        (
                            2f64.powi(i as i32),
                            kept.iter().sum::<f64>() / kept.len() as f64,
                        )
                    })
                    .collect();
                Line::fit(&points).map(|line| line.slope)
            };
            let estimate = Estimate::jackknife(&[0, 1, 2, 3], slope).unwrap();
            squares += (estimate.value + 1.0).powi(2);
            said += estimate.stderr.unwrap().powi(2);
        }
        let ratio = said / squares;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }

    #[test]
    fn errors_propagate() {
        let tenfold = Estimate {
            value: 1.0,
            stderr: Some(2f64.log10()),
        };
        let e = tenfold.exp10();
        assert!((e.value - 10.0).abs() < 1e-9 && (e.relative().unwrap() - 1.0).abs() < 1e-9);
        let three = Estimate {
            value: 2.0,
            stderr: Some(0.6),
        };
        let four = Estimate {
            value: 1.0,
            stderr: Some(0.4),
        };
        let ratio = three.ratio(four);
        assert!((ratio.value - 2.0).abs() < 1e-12 && (ratio.stderr.unwrap() - 1.0).abs() < 1e-12);
    }
}
