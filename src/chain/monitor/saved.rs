//! What is recorded, written and read.

use super::{GroupTiles, Monitor, SEGMENTS, Segment};
use crate::chain::discoveries::Discoveries;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::film::{GROUPS, Tiling};

impl Segment {
    fn save(&self, to: &mut Writer) {
        let Self {
            sums,
            squares,
            visits,
        } = self;
        sums.iter().chain(squares).for_each(|sum| to.table(sum));
        to.table(visits);
    }

    /// Of as many chains and strategies as this one.
    fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        let Self {
            sums,
            squares,
            visits,
        } = self;
        let mut sums = sums.iter_mut().chain(squares);
        sums.try_for_each(|sum| from.table(sum))?;
        from.table(visits)
    }
}

impl GroupTiles {
    fn save(&self, to: &mut Writer) {
        let Self {
            // Told for all groups at once.
            group: _,
            chains: _,
            sums,
            independent,
        } = self;
        to.table(sums);
        to.table(independent);
    }

    /// Of as many tiles as this one.
    fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        from.table(&mut self.sums)?;
        from.table(&mut self.independent)
    }
}

impl Monitor {
    /// Writes all that is recorded.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            groups,
            // Of the step at hand.
            places: _,
            lit: _,
            // Of the sampler and the picture.
            strategies: _,
            index: _,
            tiling: _,
            segments,
            full,
            records,
            length,
            held,
            stays,
            tallies,
            large,
            found,
        } = self;
        let of_chains = groups
            .iter()
            .flat_map(|g| g.chains.clone().map(|_| g.group));
        to.table(&of_chains.collect::<Vec<u8>>());
        groups.iter().for_each(|group| group.save(to));
        segments.iter().for_each(|segment| segment.save(to));
        to.count(*full);
        to.value(*records);
        to.value(*length);
        to.table(held);
        to.table(stays);
        tallies.iter().for_each(|tallies| to.table(tallies));
        to.table(large);
        found.save(to);
    }

    /// Reads what was recorded of so many chains of a sampler with these strategies.
    ///
    /// # Errors
    /// It was recorded of others.
    pub fn load(
        chains: usize,
        strategies: &[u32],
        combined: bool,
        tiling: &Tiling,
        from: &mut Reader,
    ) -> Result<Self, Malformed> {
        let of_chains = from.vector::<u8>(chains)?;
        let right = of_chains.is_sorted() && of_chains.iter().all(|g| usize::from(*g) < GROUPS);
        Malformed::unless(right, "groups of chains are mixed up")?;
        let mut monitor = Self::new(&of_chains, strategies, combined, tiling);
        let Self {
            groups,
            places: _,
            lit: _,
            strategies: _,
            index: _,
            tiling: _,
            segments,
            full,
            records,
            length,
            held,
            stays,
            tallies,
            large,
            found,
        } = &mut monitor;
        groups.iter_mut().try_for_each(|group| group.load(from))?;
        (segments.iter_mut()).try_for_each(|segment| segment.load(from))?;
        *full = from.count(SEGMENTS - 1)?;
        *records = from.value()?;
        *length = from.value()?;
        Malformed::unless(*records < *length, "a segment has too many records")?;
        from.table(held)?;
        from.table(stays)?;
        tallies
            .iter_mut()
            .try_for_each(|tallies| from.table(tallies))?;
        from.table(large)?;
        *found = Discoveries::load(from)?;
        Ok(monitor)
    }
}
