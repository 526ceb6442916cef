//! Distributions of relative errors.

use std::fmt;

/// Relative errors of one figure, of many paths.
#[derive(Default)]
pub struct Tail {
    errors: Vec<f32>,
}

/// Parts of the paths whose error is at most so much.
pub const QUANTILES: [f64; 5] = [0.5, 0.9, 0.99, 0.999, 0.9999];

impl Tail {
    pub fn add(&mut self, error: f64) {
        self.errors.push(error as f32);
    }

    pub fn merge(&mut self, other: &Self) {
        self.errors.extend(&other.errors);
    }

    /// In order; for [`Self::quantile`].
    pub fn sort(&mut self) {
        self.errors.sort_by(f32::total_cmp);
    }

    pub fn len(&self) -> usize {
        self.errors.len()
    }

    pub fn quantile(&self, q: f64) -> f64 {
        let last = self.errors.len().saturating_sub(1);
        let i = (q * self.errors.len() as f64).ceil() as usize;
        let found = self.errors.get(i.saturating_sub(1).min(last));
        found.map_or(0.0, |e| f64::from(*e))
    }

    pub fn above(&self, limit: f32) -> usize {
        self.errors.len() - self.errors.partition_point(|e| *e <= limit)
    }

    /// How likely so many errors above `limit`, or more, are if one in `1 / part` is expected
    /// there. Errors come in `groups` of one size, and those of one may depend on each other: they
    /// count as one.
    pub fn chance(&self, limit: f64, part: f64, groups: usize) -> f64 {
        let (groups, all) = (groups.min(self.len()), self.len().max(1));
        let above = self.above(limit as f32) * groups / all;
        binomial_tail(groups, part, above)
    }
}

/// Probability of `k` successes or more in `n` trials that succeed with probability `p`; 1 up to
/// the mean.
fn binomial_tail(n: usize, p: f64, k: usize) -> f64 {
    if k as f64 <= n as f64 * p {
        return 1.0;
    }
    let (n, odds) = (n as f64, p / (1.0 - p));
    // The first term by its logarithm, the others by their ratios, which fall beyond the mean.
    let choose: f64 = (0..k)
        .map(|i| ((n - i as f64) / (i as f64 + 1.0)).ln())
        .sum();
    let mut term = (choose + k as f64 * p.ln() + (n - k as f64) * (-p).ln_1p()).exp();
    let (mut sum, mut i) = (0.0, k as f64);
    while term > 1e-9 * sum && i <= n {
        sum += term;
        term *= (n - i) / (i + 1.0) * odds;
        i += 1.0;
    }
    sum
}

#[test]
fn tails_of_binomials_are_those_of_the_tables() {
    for (n, p, k, expected) in [
        (10, 0.5, 8, 56.0 / 1024.0),
        (4, 0.25, 4, 1.0 / 256.0),
        (3, 0.1, 1, 0.271),
        // 10 % more than expected of 150 000 are 3.9 standard deviations; by the normal limit
        // 5e-5.
        (150_000, 0.01, 1650, 6.608e-5),
        (20, 0.5, 10, 1.0),
    ] {
        let got = binomial_tail(n, p, k);
        assert!((got / expected - 1.0).abs() < 0.05, "{n} {p} {k}: {got:e}");
    }
}

impl fmt::Display for Tail {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} |", self.len())?;
        for q in QUANTILES {
            write!(f, " {:.1e} |", self.quantile(q))?;
        }
        write!(f, " {:.1e} | {}", self.quantile(1.0), self.above(1e-3))
    }
}
