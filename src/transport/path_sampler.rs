//! Path samplers: what a Markov chain hands its primary samples to, and what comes back.
//!
//! Metropolis sampling asks little of a path integrator: a number of primary samples, and, for a
//! batch of them, splats. The multiplexed sampler takes one strategy of one depth and makes one
//! splat; the others cover all depths at once (Kelemen et al. 2002), and a bidirectional sample
//! makes splats in many places.

use super::World;
use super::bidirectional::BidirectionalLayout;
use super::evaluate::UnidirectionalLayout;
use super::paths::Paths;
use super::records::Splat;
use super::samples::Samples;
use super::share;
use crate::plan::DepthPlan;
use crate::simd::Lanes;

/// What primary samples mean.
#[derive(Clone, Debug)]
pub enum PathSampler {
    /// A path of one depth, by one strategy of it ([`World::evaluate_multiplexed`]).
    Multiplexed(DepthPlan),
    /// A path-traced path of any depth ([`World::evaluate_unidirectional`]).
    Unidirectional(UnidirectionalLayout),
    /// Both subpaths of a sample, by all strategies of any depth
    /// ([`World::evaluate_bidirectional`]).
    Bidirectional(BidirectionalLayout),
}

impl From<&DepthPlan> for PathSampler {
    fn from(plan: &DepthPlan) -> Self {
        PathSampler::Multiplexed(plan.clone())
    }
}

impl From<&PathSampler> for PathSampler {
    fn from(sampler: &PathSampler) -> Self {
        sampler.clone()
    }
}

impl PathSampler {
    /// Tells the samplers of a render apart: the depth, or 0 for all depths at once.
    pub fn id(&self) -> u32 {
        self.depth().unwrap_or(0)
    }

    /// The depth of its paths; `None` for all depths at once.
    pub fn depth(&self) -> Option<u32> {
        self.plan().map(|plan| plan.depth)
    }

    /// The plan of its depth, if it has one.
    pub fn plan(&self) -> Option<&DepthPlan> {
        match self {
            PathSampler::Multiplexed(plan) => Some(plan),
            PathSampler::Unidirectional(_) | PathSampler::Bidirectional(_) => None,
        }
    }

    /// Primary samples.
    pub fn dimensions(&self) -> usize {
        match self {
            PathSampler::Multiplexed(plan) => plan.layout.total,
            PathSampler::Unidirectional(layout) => layout.total(),
            PathSampler::Bidirectional(layout) => layout.total(),
        }
    }

    /// Light vertices of the strategies that a path chooses among, ascending; empty where it
    /// chooses none.
    pub fn strategies(&self) -> &[u32] {
        self.plan().map_or(&[], |plan| &plan.strategies)
    }

    /// Paths can carry light.
    pub fn carries_light(&self) -> bool {
        self.plan().is_none_or(|plan| !plan.strategies.is_empty())
    }

    /// The primary samples that say most about where a path goes: the choice of its strategy, if it
    /// has any, and the first of the two that place it on the film.
    pub fn foremost(&self) -> (Option<usize>, usize) {
        match self {
            PathSampler::Multiplexed(plan) => {
                let at = &plan.layout;
                let chooses = plan.strategies.len() > 1;
                (chooses.then_some(at.strategy), at.raster)
            }
            PathSampler::Unidirectional(_) => (None, UnidirectionalLayout::RASTER),
            PathSampler::Bidirectional(layout) => (None, layout.at.raster),
        }
    }

    /// Splats of a path, at most.
    pub fn splats(&self) -> usize {
        match self {
            PathSampler::Multiplexed(_) | PathSampler::Unidirectional(_) => 1,
            // Where the camera looks; and where each light vertex is seen.
            PathSampler::Bidirectional(layout) => 1 + layout.splats(),
        }
    }
}

impl World<'_> {
    /// Evaluates the paths of columns `0..n` of `samples`; their splats are then in
    /// [`Paths::splat_row`].
    #[inline(always)]
    pub fn evaluate_sampler<L: Lanes>(
        &self,
        sampler: &PathSampler,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        match sampler {
            PathSampler::Multiplexed(plan) => {
                self.evaluate_multiplexed::<L>(plan, samples, n, paths);
                if plan.kept > 0.0 {
                    share::leave(plan, &mut paths.splats.camera[..n]);
                }
            }
            PathSampler::Unidirectional(at) => {
                self.evaluate_unidirectional::<L>(at, samples, n, paths)
            }
            PathSampler::Bidirectional(at) => {
                self.evaluate_bidirectional::<L>(at, samples, n, paths)
            }
        }
    }
}

impl Paths {
    /// The splats of all paths in row `row` of [`PathSampler::splats`].
    #[inline(always)]
    pub fn splat_row(&self, row: usize) -> &[Splat] {
        match row {
            0 => &self.splats.camera,
            _ => &self.splats.light[row - 1],
        }
    }

    /// Contributions that were not finite, or negative, in the first `rows` rows.
    pub fn rejected(&self, rows: usize) -> u64 {
        let of_row = |row| {
            self.splat_row(row)
                .iter()
                .map(|o| u64::from(o.rejected))
                .sum::<u64>()
        };
        (0..rows).map(of_row).sum()
    }
}
