//! Kernels at a width chosen at run time.
//!
//! All kernels are generic over lanes, and whoever calls a generic function from another crate
//! compiles it once more. An [`Evaluator`] is not generic: tests and benchmarks that go through it
//! share the kernels that this crate has compiled.

use super::batch::{Batch, Workspace};
use super::bootstrap::Bootstrap;
use super::mutate::ProposalDistribution;
use super::primary;
use crate::film::{Destination, SplatFilm};
use crate::plan::DepthPlan;
use crate::simd::{Width, f32x8};
use crate::trace::{Coherence, Hit, Ray, Tracer};
use crate::transport::alpha_mask::Through;
use crate::transport::bidirectional::BidirectionalLayout;
use crate::transport::evaluate::UnidirectionalLayout;
use crate::transport::samples::Samples;
use crate::transport::{PathSampler, Paths, World};

/// Calls a function at the lanes of a width, as which the given name stands in the call.
macro_rules! at {
    ($width:expr, $lanes:ident => $call:expr) => {
        match $width {
            Width::One => {
                type $lanes = f32;
                $call
            }
            Width::Eight => {
                type $lanes = f32x8;
                $call
            }
        }
    };
}

/// What evaluates paths and marches chains at a width. Results do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evaluator {
    /// Lanes of its kernels.
    pub width: Width,
}

impl Evaluator {
    /// One path at a time.
    pub const ONE: Self = Self { width: Width::One };
    /// Eight at a time.
    pub const EIGHT: Self = Self {
        width: Width::Eight,
    };
    /// Both widths.
    pub const BOTH: [Self; 2] = [Self::ONE, Self::EIGHT];

    /// [`World::evaluate_multiplexed`].
    #[inline(never)]
    pub fn multiplexed(
        self,
        world: &World,
        plan: &DepthPlan,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        at!(self.width, L => world.evaluate_multiplexed::<L>(plan, samples, n, paths))
    }

    /// [`World::evaluate_unidirectional`].
    #[inline(never)]
    pub fn unidirectional(
        self,
        world: &World,
        layout: &UnidirectionalLayout,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        at!(self.width, L => world.evaluate_unidirectional::<L>(layout, samples, n, paths))
    }

    /// [`World::evaluate_bidirectional`].
    #[inline(never)]
    pub fn bidirectional(
        self,
        world: &World,
        layout: &BidirectionalLayout,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        at!(self.width, L => world.evaluate_bidirectional::<L>(layout, samples, n, paths))
    }

    /// [`World::evaluate_sampler`].
    #[inline(never)]
    pub fn sampler(
        self,
        world: &World,
        sampler: &PathSampler,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        at!(self.width, L => world.evaluate_sampler::<L>(sampler, samples, n, paths))
    }

    /// [`World::closest`].
    #[inline(never)]
    pub fn closest(
        self,
        world: &World,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
        through: &mut Through,
    ) -> u64 {
        at!(self.width, L => world.closest::<L>(rays, list, hits, through))
    }

    /// [`World::occluded`].
    #[inline(never)]
    pub fn occluded(
        self,
        world: &World,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
        hits: &mut [Hit],
        through: &mut Through,
    ) -> u64 {
        at!(self.width, L => world.occluded::<L>(rays, list, blocked, hits, through))
    }

    /// [`Tracer::closest_with`].
    #[inline(never)]
    pub fn trace(
        self,
        tracer: &Tracer,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
    ) {
        at!(self.width, L => tracer.closest_with::<L>(coherence, rays, list, hits))
    }

    /// [`Tracer::occluded_with`].
    #[inline(never)]
    pub fn shadow(
        self,
        tracer: &Tracer,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
    ) {
        at!(self.width, L => tracer.occluded_with::<L>(coherence, rays, list, blocked))
    }

    /// [`primary::regenerate`].
    pub fn regenerate(
        self,
        sampler: impl Into<PathSampler>,
        seed: u64,
        indices: &[u64],
    ) -> Samples {
        self.regenerate_of(&sampler.into(), seed, indices)
    }

    #[inline(never)]
    fn regenerate_of(self, sampler: &PathSampler, seed: u64, indices: &[u64]) -> Samples {
        at!(self.width, L => primary::regenerate::<L>(sampler, seed, indices))
    }

    /// [`Bootstrap::run`].
    pub fn bootstrap(
        self,
        world: &World,
        sampler: impl Into<PathSampler>,
        seed: u64,
        count: u64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Bootstrap {
        self.bootstrap_of(world, &sampler.into(), seed, count, cancelled)
    }

    #[inline(never)]
    fn bootstrap_of(
        self,
        world: &World,
        sampler: &PathSampler,
        seed: u64,
        count: u64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Bootstrap {
        at!(self.width, L => Bootstrap::run::<L>(world, sampler, seed, count, cancelled))
    }

    /// [`Batch::new`].
    pub fn batch(
        self,
        world: &World,
        sampler: impl Into<PathSampler>,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Batch {
        self.batch_of(world, &sampler.into(), first, seeds, seed, paths)
    }

    #[inline(never)]
    fn batch_of(
        self,
        world: &World,
        sampler: &PathSampler,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Batch {
        at!(self.width, L => Batch::new::<L>(world, sampler, first, seeds, seed, paths))
    }

    /// [`Batch::step`].
    #[inline(never)]
    pub fn step(
        self,
        batch: &mut Batch,
        world: &World,
        proposals: &ProposalDistribution,
        paths: &mut Paths,
    ) {
        at!(self.width, L => batch.step::<L>(world, proposals, paths))
    }

    /// [`Batch::march`].
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "those of the function it calls")]
    pub fn march(
        self,
        batch: &mut Batch,
        world: &World,
        proposals: &ProposalDistribution,
        iterations: u32,
        workspace: &mut Workspace,
        film: &SplatFilm,
        to: Destination,
    ) {
        at!(self.width, L => batch.march::<L>(world, proposals, iterations, workspace, film, to))
    }

    /// [`ProposalDistribution::propose`].
    #[inline(never)]
    #[expect(clippy::too_many_arguments, reason = "those of the function it calls")]
    pub fn propose(
        self,
        proposals: &ProposalDistribution,
        ids: &[u32],
        iteration: u32,
        current: &Samples,
        proposed: &mut Samples,
        large: &mut [f32],
        decide: &mut [f32],
    ) {
        at!(self.width, L => {
            proposals.propose::<L>(ids, iteration, current, proposed, large, decide)
        })
    }
}
