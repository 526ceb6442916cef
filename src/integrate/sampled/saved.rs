//! Samples so far, written and read.

use super::{Sampling, lock};
use crate::chain::discoveries::Discoveries;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::integrate::Shard;
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
            range,
            // Of the step at hand.
            workspaces: _,
            sums,
            done,
            rays,
            rejected,
            found,
            before,
            since,
        } = self;
        to.value([*done, *rays, *rejected]);
        to.value(before + since.elapsed().as_secs_f64());
        lock(found).save(to);
        sums.save(to);
        Made {
            samples: done - range.start,
            part: ((done - range.start) as f64 / (range.end - range.start).max(1) as f64).min(1.0),
            ..Made::default()
        }
    }

    /// Reads them: from the state of one render, or from those of all of its shards.
    pub fn load(&mut self, from: &mut [Reader]) -> Result<(), Malformed> {
        let of = from.len() as u32;
        let total = self.range.end;
        (self.rays, self.rejected) = (0, 0);
        for (index, from) in (0..).zip(from) {
            let [done, rays, rejected]: [u64; 3] = from.value()?;
            self.rays = self.rays.saturating_add(rays);
            self.rejected = self.rejected.saturating_add(rejected);
            let before: f64 = from.value()?;
            let right = (0.0..1e12).contains(&before);
            Malformed::unless(right, "a time is out of range")?;
            self.before += before;
            let found = Discoveries::load(from)?;
            lock(&self.found).merge(&found);
            Malformed::unless(done >= self.range.start, "samples are missing")?;
            self.done = done;
            if index == 0 {
                self.sums.load(from)?;
            } else {
                let mut more = self.film();
                more.load(from)?;
                self.sums.absorb(&more);
            }
            let whole = of == 1 || done == Shard { index, of }.share(total, 1).end;
            Malformed::unless(whole, "a shard has not made all of its samples")?;
        }
        Ok(())
    }
}
