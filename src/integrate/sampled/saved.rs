//! Samples so far, written and read.

use super::{Sampling, lock};
use crate::chain::discoveries::Discoveries;
use crate::checkpoint::{Malformed, Packed, Reader, Writer};
use crate::integrate::Shard;
use crate::integrate::handed_over::take;
use crate::integrate::state::Made;
use crate::integrate::team::joined;
use std::time::Instant;

/// Counts of samples, the seconds that they have taken, and what they have found.
fn save_counts(
    counts: [u64; 3],
    found: &Discoveries,
    before: f64,
    since: Instant,
    to: &mut Writer,
) {
    to.value(counts);
    to.value(before + since.elapsed().as_secs_f64());
    found.save(to);
}

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
        let counts = [*done, *rays, *rejected];
        save_counts(counts, &lock(found), *before, *since, to);
        sums.save(to);
        Made {
            samples: done - range.start,
            part: ((done - range.start) as f64 / (range.end - range.start).max(1) as f64).min(1.0),
            ..Made::default()
        }
    }

    /// Writes the same for other processes of a team: without sums.
    pub fn save_start(&self, to: &mut Writer) {
        let counts = [self.done, self.rays, self.rejected];
        save_counts(counts, &Discoveries::default(), self.before, self.since, to);
    }

    /// What the processes of a team have made comes together at the first.
    pub fn gather(&mut self) -> Result<(), Malformed> {
        let team = self.run.team();
        if team.is_alone() {
            return Ok(());
        }
        take(self.run, &mut |pieces| self.take(pieces))?;
        if let Some(parent) = team.parent() {
            team.send(parent, &joined(&self.hand_over()));
        }
        Ok(())
    }

    /// Gives away what has been made since this was done last, in packed pieces.
    pub fn hand_over(&mut self) -> Vec<Vec<u8>> {
        let counts = [self.rays, self.rejected].map(u64::to_le_bytes);
        (self.rays, self.rejected) = (0, 0);
        let mut pieces = self.sums.hand_over();
        let mut found = Writer::new();
        std::mem::take(&mut *lock(&self.found)).save(&mut found);
        pieces.push(found.finish().into_bytes());
        pieces.push(counts.as_flattened().to_vec());
        pieces
    }

    /// Adds what another process has handed over.
    pub fn take(&mut self, mut pieces: Vec<Vec<u8>>) -> Result<(), Malformed> {
        let counts = pieces.pop().unwrap_or_default();
        let (counts, _) = counts
            .as_chunks()
            .0
            .split_at_checked(2)
            .ok_or_else(|| Malformed::new("there are no counts"))?;
        let [rays, rejected] = [counts[0], counts[1]].map(u64::from_le_bytes);
        self.rays = self.rays.saturating_add(rays);
        self.rejected = self.rejected.saturating_add(rejected);
        let found = Packed::from_bytes(pieces.pop().unwrap_or_default());
        let mut from = Reader::new(&found);
        lock(&self.found).merge(&Discoveries::load(&mut from)?);
        from.end()?;
        self.sums.take(pieces)
    }

    /// Reads them: from the state of one render, or from those of all of its shards. Of a team the
    /// first has all, and others begin with none.
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
            if !self.run.team().leads() {
                (self.rays, self.rejected) = (0, 0);
                continue;
            }
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
