//! What chains march over: the one door between Markov chains and what they mutate.
//!
//! A chain at `x` proposes `y` with the density `q(x -> y)` and goes there with the probability
//!
//! ```text
//! a = min(1, T(y) q(y -> x) / (T(x) q(x -> y)))
//! ```
//!
//! (Metropolis et al. 1953, Hastings 1970), where `T` is the scalar target of
//! [`accept`](super::accept). Chains know no more of their states than this trait says: they are
//! drawn, proposed, evaluated, and committed, a batch at a time. Where proposals are as probable as
//! their reversals the ratio of the `q` is 1; chains over such targets are compiled without it.
//!
//! [`PrimarySampleSpace`](super::primary::PrimarySampleSpace) is a target whose states are primary
//! samples. States could as well be paths with vertices: those propose by [`Target::log_ratio`],
//! and keep the vertices that a mutation leaves alone.

use crate::simd::Lanes;
use crate::transport::{Paths, World};

/// What an iteration finds out about the steps of all chains, before the target is asked for
/// proposals: one number a chain, padded to a multiple of eight chains.
pub struct Steps<'a> {
    /// Global chain numbers.
    pub ids: &'a [u32],
    /// Iteration, the same for all.
    pub iteration: u32,
    /// To be set: 1 for large steps (independent of the current state), 0 for others.
    pub large: &'a mut [f32],
    /// To be set: the uniform numbers in `[0, 1)` of the acceptance test.
    pub decide: &'a mut [f32],
}

/// Current and proposed states of a batch of chains.
pub trait Target {
    /// Parameters of proposals.
    type Proposals;
    /// A state, kept aside.
    type State;
    /// All proposals are as probable as their reversals: [`Self::log_ratio`] is never asked.
    const SYMMETRIC: bool;

    /// Tells the targets of a render apart: the depth, or 0 for all depths at once.
    fn id(&self) -> u32;

    /// Chains there is room for.
    fn chains(&self) -> usize;

    /// Splats that a state makes, at most.
    fn splats(&self) -> usize;

    /// Light vertices of the strategies that a state chooses among, ascending; empty where it
    /// chooses none.
    fn strategies(&self) -> &[u32];

    /// Proposes independent states, drawn afresh: bootstrap path `index(i)` of the run with this
    /// `seed` for each of the first `n` chains.
    fn draw<L: Lanes>(&mut self, seed: u64, n: usize, index: impl Fn(usize) -> u64);

    /// Proposes a state to every chain, and says of what kind.
    fn propose<L: Lanes>(&mut self, proposals: &Self::Proposals, steps: Steps);

    /// Evaluates the proposals of the first `n` chains. Their splats are then in
    /// [`Paths::splat_row`], with `n` in each of the first [`Self::splats`] rows: contributions
    /// over the density of the state, in linear sRGB, and raster positions in pixels.
    fn evaluate<L: Lanes>(&self, world: &World, n: usize, paths: &mut Paths);

    /// Natural logarithm of `q(y -> x) / q(x -> y)` for the latest proposals of chains
    /// `start..start + N`.
    fn log_ratio<L: Lanes>(&self, _start: usize) -> L {
        L::zero()
    }

    /// The proposals of chains for which `taken` (padded to a multiple of eight) is positive become
    /// their states.
    fn commit<L: Lanes>(&mut self, taken: &[f32]);

    /// Where a chain stands.
    fn current(&self, chain: usize) -> Self::State;

    /// What it proposed last.
    fn proposed(&self, chain: usize) -> Self::State;
}
