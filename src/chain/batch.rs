//! A batch of chains of one depth, marching in lockstep.

use super::accept::{State, acceptance};
use super::bootstrap::{Moments, regenerate};
use super::mutate::Kernel;
use crate::film::SplatFilm;
use crate::plan::DepthPlan;
use crate::simd::Lanes;
use crate::transport::samples::Samples;
use crate::transport::{Paths, World};

/// Weights are kept as integers in units of 2^-32, so that a state's weight is exact however its visits are grouped.
const WEIGHT_BITS: u32 = 32;

/// Chains of one depth and where they stand.
pub struct Batch {
    /// Index into the plan's depths.
    pub depth: usize,
    /// Global chain numbers, padded to a multiple of eight.
    ids: Vec<u32>,
    /// Chains, without padding.
    n: usize,
    current: Samples,
    proposed: Samples,
    states: Vec<State>,
    /// Weight each current state has collected since it was accepted.
    weights: Vec<u64>,
    large: Vec<bool>,
    decide: Vec<f32>,
    /// Acceptance of the latest proposals, a bit a chain, eight chains a word.
    accepted: Vec<u32>,
    /// Next iteration.
    iteration: u32,
    /// Large-step targets, chain by chain: independent uniform samples.
    pub large_moments: Vec<Moments>,
    pub counts: Counts,
}

/// What happened to proposals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub large: u64,
    /// Sum of acceptance probabilities of large steps, in units of 2^-32.
    pub large_accepted: u64,
    pub small: u64,
    pub small_accepted: u64,
    pub rejected: u64,
    pub rays: u64,
}

impl Counts {
    pub fn merge(&mut self, o: &Self) {
        self.large += o.large;
        self.large_accepted += o.large_accepted;
        self.small += o.small;
        self.small_accepted += o.small_accepted;
        self.rejected += o.rejected;
        self.rays += o.rays;
    }
    /// Mean acceptance probability of large and small steps.
    pub fn acceptance(&self) -> (f64, f64) {
        let rate = |sum: u64, n: u64| {
            if n > 0 {
                sum as f64 / 2f64.powi(WEIGHT_BITS as i32) / n as f64
            } else {
                0.0
            }
        };
        (
            rate(self.large_accepted, self.large),
            rate(self.small_accepted, self.small),
        )
    }
}

/// Chain number of chain `j` of a depth. No two chains of a run share one, and none depends on how chains are batched.
fn chain_id(depth: u32, j: usize) -> u32 {
    depth << MAX_CHAINS_BITS | j as u32
}

const MAX_CHAINS_BITS: u32 = 20;
/// Chains a depth can have.
pub const MAX_CHAINS_PER_DEPTH: usize = 1 << MAX_CHAINS_BITS;
/// Depths a run can have.
pub const MAX_DEPTHS: u32 = 1 << (32 - MAX_CHAINS_BITS);

impl Batch {
    /// Chains `first..first + seeds.len()` of a depth, started from bootstrap samples.
    pub fn new<L: Lanes>(
        world: &World,
        depth: usize,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Self {
        let plan = &world.plan.depths[depth];
        let n = seeds.len();
        let padded = n.next_multiple_of(8);
        let current = regenerate::<L>(plan, seed, seeds);
        world.evaluate_multiplexed::<L>(plan, &current, n, paths);
        Self {
            depth,
            ids: (first..first + padded)
                .map(|j| chain_id(plan.depth, j))
                .collect(),
            n,
            proposed: Samples::new(plan.layout.total, n),
            current,
            states: paths.outcome.iter().map(State::new).collect(),
            weights: vec![0; n],
            large: vec![false; padded],
            decide: vec![0.0; padded],
            accepted: vec![0; padded / 8],
            iteration: 0,
            large_moments: vec![Moments::default(); n],
            counts: Counts::default(),
        }
    }

    pub fn len(&self) -> usize {
        self.n
    }
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Marches `iterations` steps; splats go to `layer` of the film, scaled by `splat_scale` (at most 1).
    #[allow(clippy::too_many_arguments)]
    pub fn march<L: Lanes>(
        &mut self,
        world: &World,
        kernel: &Kernel,
        iterations: u32,
        paths: &mut Paths,
        film: &SplatFilm,
        layer: usize,
        splat_scale: f64,
    ) {
        let plan = &world.plan.depths[self.depth];
        let rays = paths.rays;
        for _ in 0..iterations {
            kernel.propose::<L>(
                &self.ids,
                self.iteration,
                &self.current,
                &mut self.proposed,
                &mut self.large,
                &mut self.decide,
            );
            world.evaluate_multiplexed::<L>(plan, &self.proposed, self.n, paths);
            self.accept::<L>(plan, paths, film, layer, splat_scale);
            self.iteration += 1;
        }
        self.counts.rays += paths.rays - rays;
    }

    /// Accepts or rejects every proposal. Both states are worth their expected share (`a` and `1 - a`, Veach and Guibas 1997, section 5.1): the
    /// one left behind is splatted, the one that stays collects weight until it is left.
    fn accept<L: Lanes>(
        &mut self,
        plan: &DepthPlan,
        paths: &Paths,
        film: &SplatFilm,
        layer: usize,
        splat_scale: f64,
    ) {
        let one = 1u64 << WEIGHT_BITS;
        let scale = splat_scale / one as f64;
        self.accepted.fill(0);
        for i in 0..self.n {
            let outcome = &paths.outcome[i];
            let proposal = State::new(outcome);
            let a = acceptance(self.states[i].target, proposal.target);
            let share = (f64::from(a) * one as f64) as u64;
            self.counts.rejected += u64::from(outcome.rejected);
            if self.large[i] {
                self.counts.large += 1;
                self.counts.large_accepted += share;
                self.large_moments[i].add(proposal.target);
            } else {
                self.counts.small += 1;
                self.counts.small_accepted += share;
            }
            self.weights[i] += one - share;
            if self.decide[i] < a {
                flush(&self.states[i], self.weights[i], film, layer, scale);
                self.states[i] = proposal;
                self.weights[i] = share;
                self.accepted[i / 8] |= 1 << (i % 8);
            } else if share > 0 {
                flush(&proposal, share, film, layer, scale);
            }
        }
        for d in 0..plan.layout.total {
            let (to, from) = (self.current.row_mut(d), self.proposed.row(d));
            for (block, bits) in self.accepted.iter().enumerate() {
                for lane in (0..8).step_by(L::N) {
                    let at = 8 * block + lane;
                    let mask = <L::Mask as crate::simd::Mask>::from_bits(bits >> lane);
                    L::select(mask, L::load(&from[at..]), L::load(&to[at..])).store(&mut to[at..]);
                }
            }
        }
    }

    /// Splats what the current states have collected, as at the end of a run.
    pub fn flush(&mut self, film: &SplatFilm, layer: usize, splat_scale: f64) {
        let scale = splat_scale / (1u64 << WEIGHT_BITS) as f64;
        for (state, weight) in self.states.iter().zip(&mut self.weights) {
            flush(state, *weight, film, layer, scale);
            *weight = 0;
        }
    }
}

fn flush(state: &State, weight: u64, film: &SplatFilm, layer: usize, scale: f64) {
    if weight > 0 && state.target > 0.0 {
        film.add(layer, state.raster, state.colour, weight as f64 * scale);
    }
}
