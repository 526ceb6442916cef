//! Rays are traced: what they hit, or whether anything is in their way.
//!
//! `closest` and `occluded` are those of `alpha_mask.rs`: the tracer's own, and in scenes with
//! alpha masks again for rays that pass what is cut out. `emits`, which other stages ask of points
//! sampled on lights, is there as well.

use super::World;
use super::clock::{Clock, Stage};
use super::paths::Rays;
use crate::simd::Lanes;

impl World<'_> {
    /// The closest hits of the rays of `list`.
    pub(super) fn trace<L: Lanes>(&self, rays: &mut Rays, list: &[u32], clock: &mut Clock) {
        rays.traced += list.len() as u64;
        rays.sorter.sort(&rays.ray, list);
        clock.lap(Stage::Sort);
        let sorted = rays.sorter.sorted();
        rays.traced += self.closest::<L>(&rays.ray, sorted, &mut rays.hit, &mut rays.through);
        clock.finish(Stage::Trace, list.len(), L::N);
    }

    /// Whether the rays of `list` are blocked. Overwrites the hits of these paths: endpoints are
    /// already made from them.
    pub(super) fn trace_visibility<L: Lanes>(
        &self,
        rays: &mut Rays,
        list: &[u32],
        clock: &mut Clock,
    ) {
        rays.traced += list.len() as u64;
        rays.sorter.sort(&rays.ray, list);
        clock.lap(Stage::Sort);
        rays.traced += self.occluded::<L>(
            &rays.ray,
            rays.sorter.sorted(),
            &mut rays.blocked,
            &mut rays.hit,
            &mut rays.through,
        );
        clock.finish(Stage::Occlusion, list.len(), L::N);
    }
}
