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
