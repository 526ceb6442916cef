//! Samples so far, written and read.

use super::Sampling;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::integrate::state::Made;

impl Sampling<'_> {
    /// Writes how many there are, and their film.
    pub fn save(&self, to: &mut Writer) -> Made {
        let Self {
            // Of the render and its settings.
            run: _,
            method: _,
            pairs: _,
            fill: _,
            stream: _,
            grid: _,
            total,
            // Of the step at hand.
            workspaces: _,
            sums,
            done,
            rays,
            rejected,
            before,
            since,
        } = self;
        to.value([*done, *rays, *rejected]);
        to.value(before + since.elapsed().as_secs_f64());
        sums.save(to);
        Made {
            samples: *done,
            part: *done as f64 / (*total).max(1) as f64,
            ..Made::default()
        }
    }

    /// Reads them.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        [self.done, self.rays, self.rejected] = from.value()?;
        self.before = from.value()?;
        let right = self.before >= 0.0 && self.before.is_finite();
        Malformed::unless(right, "a time is out of range")?;
        self.sums.load(from)
    }
}
