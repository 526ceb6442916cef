//! Where chains stand, written and read.

use super::{Batch, Combined, Monitor, PrimarySampleSpace};
use crate::chain::counts::{Counts, LargeSteps, MAX_CHAINS_PER_DEPTH};
use crate::chain::splats::ChainSplat;
use crate::chain::target::Target;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::film::Tiling;
use crate::transport::{PathSampler, World};

impl Batch {
    /// Writes all that a later step depends on. What is not written is of the latest step, and
    /// has reached the film.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            target,
            // Of the render's settings.
            combined: _,
            // They follow from the first.
            ids: _,
            order,
            targets,
            states,
            weights,
            large: _,
            decide: _,
            share: _,
            taken: _,
            lit: _,
            seen: _,
            left: _,
            left_weights: _,
            iteration,
            large_moments,
            monitor,
            counts,
        } = self;
        to.count(order.len());
        to.count(self.first());
        target.save(to);
        to.table(targets);
        to.table(states);
        to.table(weights);
        to.value(*iteration);
        large_moments.save(to);
        to.option(monitor.as_ref(), |to, monitor| monitor.save(to));
        to.value(*counts);
    }

    /// The number of its first chain, among those of its sampler.
    pub fn first(&self) -> usize {
        let first = self.ids.first().copied().unwrap_or(0);
        first as usize % MAX_CHAINS_PER_DEPTH
    }

    /// Reads a batch of a sampler that has so many chains. `combined` is the layer and the constant
    /// of [`Self::combine`]; `tiling` that of [`Self::watch`], if chains are watched.
    ///
    /// # Errors
    /// It is of another render.
    pub fn load(
        world: &World,
        sampler: &PathSampler,
        chains: usize,
        combined: Option<(f32, usize)>,
        tiling: Option<&Tiling>,
        from: &mut Reader,
    ) -> Result<Self, Malformed> {
        let n = from.count(chains)?;
        let first = from.count(chains - n)?;
        let mut target = PrimarySampleSpace::new(sampler, n);
        target.load(from)?;
        let targets = from.vector(n.next_multiple_of(8))?;
        let states: Vec<ChainSplat> = from.vector(n * target.splats())?;
        let region = world.camera.region;
        let low = [region.x0, region.y0];
        let size = [region.width, region.height];
        let inside = |splat: &ChainSplat| {
            // Splats of a state that has fewer than it could have lie anywhere.
            let within =
                |axis: usize| (-1.0..=size[axis] + 1.0).contains(&(splat.raster[axis] - low[axis]));
            splat.colour == [0.0; 3] || (within(0) && within(1))
        };
        Malformed::unless(states.iter().all(inside), "a chain has left the picture")?;
        let mut batch = Self::at(target, first, n, targets, states);
        let Self {
            weights,
            iteration,
            large_moments,
            monitor,
            counts,
            ..
        } = &mut batch;
        from.table(weights)?;
        *iteration = from.value()?;
        *large_moments = LargeSteps::load(n, from)?;
        let watched = from.flag()?;
        Malformed::unless(watched == tiling.is_some(), "chains are not watched alike")?;
        if let Some(tiling) = tiling {
            let strategies = sampler.strategies();
            let loaded = Monitor::load(n, strategies, combined.is_some(), tiling, from)?;
            *monitor = Some(loaded);
        }
        *counts = from.value::<Counts>()?;
        // States have been weighed when they were splatted first.
        batch.combined = combined.map(|(constant, layer)| Combined { constant, layer });
        Ok(batch)
    }
}
