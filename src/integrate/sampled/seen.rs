//! The picture of independent samples, while they are made.

use super::Sampling;
use crate::integrate::show::Seen;
use rayon::prelude::*;

/// Pixels that a thread resolves at a time.
const PART: usize = 1 << 14;

impl Sampling<'_> {
    /// The picture so far; if it is to be `judged`, with its errors and what there is to warn of.
    pub fn see(&self, judged: bool) -> Seen {
        if !judged || !self.is_judged() {
            return Seen {
                pixels: self.picture(),
                deviation: None,
                warnings: None,
            };
        }
        let count = self.sums.filter().pixels();
        let firsts: Vec<usize> = (0..count).step_by(PART).collect();
        let parts: Vec<_> = (firsts.into_par_iter())
            .map(|first| self.with_error(first..count.min(first + PART), 1.0))
            .collect();
        let (pixels, deviations): (Vec<_>, Vec<_>) = parts.into_iter().map(<_>::into).unzip();
        Seen {
            pixels: pixels.concat(),
            deviation: Some(deviations.concat()),
            warnings: Some(self.warned()),
        }
    }
}
