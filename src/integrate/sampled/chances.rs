//! What samples have found of light that only chance finds.

use super::{Sampling, lock};
use crate::chain::discoveries::Discoveries;
use crate::integrate::chance::{self, ChanceStats, Trials};
use crate::transport::Splat;

impl Sampling<'_> {
    /// Counts what only chance finds.
    pub(super) fn discover(&self, splats: &[Splat]) {
        if self.run.hidden.is_empty() {
            return;
        }
        let mut found = Discoveries::default();
        for splat in splats {
            found.see(splat, splat.rgb.iter().sum::<f32>() / 3.0);
        }
        lock(&self.found).merge(&found);
    }

    /// The samples as trials.
    pub fn trials(&self) -> Trials {
        Trials {
            paths: self.counts().samples as f64,
            chosen: 1.0,
            found: lock(&self.found).clone(),
        }
    }

    /// What may be missing of it, where no chains look for it; `b` is the mean of the picture.
    pub(super) fn chances(&self, b: f64) -> Vec<ChanceStats> {
        chance::judge(self.run.hidden, &[], Some(&self.trials()), b)
    }

    /// No light is missing that only chance finds, as far as can be told.
    pub(super) fn knows_chance(&self) -> bool {
        let mean = || {
            let picture = self.picture();
            let sum: f64 = picture.as_flattened().iter().map(|v| f64::from(*v)).sum();
            sum / (3 * picture.len()).max(1) as f64
        };
        let run = self.run;
        run.hidden.is_empty() || self.chances(mean()).iter().all(ChanceStats::is_known)
    }
}
