//! Primary sample space: states are the numbers in `[0, 1)` that a sampler makes paths of (Kelemen
//! et al. 2002).
//!
//! Some states are drawn afresh, by number: the paths of the bootstrap. The dimensions that decide
//! where on the film a path starts and which strategy it takes are not drawn independently: they
//! follow additive recurrences (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom
//! Sequences"), [`REPLICAS`] of them, each with a random offset. A small bright light in view is
//! then counted by area and not by luck: most of the variance of `b` in common scenes. The replicas
//! are independent, so their scatter is an honest standard error.
//!
//! # Where chains choose strategies otherwise than the bootstrap
//!
//! A bootstrap path chooses its strategy uniformly, whatever the choice of the chains that start
//! from it. Only the sample that chooses the strategy differs: it moves to the same part of that
//! strategy's interval ([`Choice::carry`]). A path `x` of strategy `s` then has the target `F'(x) =
//! f(x) / q_s` in place of `F(x) = n f(x)`, with `q_s` the new probability and `n` the number of
//! strategies; and first states drawn in proportion to `F` are what first states should be, in
//! proportion to `F'`: the density of the state at `u'`, the image of `u`, is `F(u) du / du'`, and
//! the map stretches an interval of length `1 / n` to `q_s`, so that `du / du' = 1 / (n q_s)` and
//! the density is `n f / (n q_s) = f / q_s = F'(u')`. Both integrate to the same `b`. So neither
//! the bootstrap's estimate nor [`Bootstrap::seeds`](super::bootstrap::Bootstrap::seeds) has to
//! know of the new choice, and chains start in equilibrium.

use super::mutate::{ONE_MINUS_EPSILON, ProposalDistribution};
use super::target::{Steps, Target};
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::plan::Choice;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::samples::Samples;
use crate::transport::{PathSampler, Paths, World};

/// Independent quasirandom sets; path `i` is point `i / REPLICAS` of set `i % REPLICAS`.
pub const REPLICAS: usize = 8;

/// Additive recurrences in two and three dimensions: powers of the reciprocals of the plastic
/// number and its analogue.
const RECURRENCE_2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
const RECURRENCE_3: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_3,
];

/// Beyond every block of dimensions.
const OFFSET_BLOCK: u32 = u32::MAX;

/// Primary samples of a batch of chains over one sampler, current and proposed.
pub struct PrimarySampleSpace {
    sampler: PathSampler,
    /// Empty before the first commit.
    current: Samples,
    proposed: Samples,
    chains: usize,
}

impl PrimarySampleSpace {
    /// Room for so many chains.
    pub fn new(sampler: impl Into<PathSampler>, chains: usize) -> Self {
        let sampler = sampler.into();
        Self {
            current: Samples::default(),
            proposed: Samples::new(sampler.dimensions(), chains),
            sampler,
            chains,
        }
    }

    /// Rows of the sample matrix that follow an additive recurrence, and its steps.
    fn recurrences(&self) -> ([usize; 3], &'static [f64]) {
        match self.sampler.foremost() {
            (Some(strategy), raster) => ([strategy, raster, raster + 1], &RECURRENCE_3),
            (None, raster) => ([raster, raster + 1, 0], &RECURRENCE_2),
        }
    }
}

impl PrimarySampleSpace {
    /// Writes the states of its chains.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            sampler: _,
            current,
            // It belongs to the step at hand.
            proposed: _,
            chains: _,
        } = self;
        current.save(to);
    }

    /// Reads the states of as many chains as there is room for.
    ///
    /// # Errors
    /// They are of another sampler.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        (self.current).resize(self.sampler.dimensions(), self.chains);
        self.current.load(from)
    }
}

impl Target for PrimarySampleSpace {
    type Proposals = ProposalDistribution;
    /// Laid out as the sampler says.
    type State = Vec<f32>;
    // Offsets are as probable as their negatives, and large steps do not look at the current state.
    const SYMMETRIC: bool = true;

    fn id(&self) -> u32 {
        self.sampler.id()
    }

    fn chains(&self) -> usize {
        self.chains
    }

    fn splats(&self) -> usize {
        self.sampler.splats()
    }

    fn strategies(&self) -> &[u32] {
        self.sampler.strategies()
    }

    fn draw<L: Lanes>(&mut self, seed: u64, n: usize, index: impl Fn(usize) -> u64) {
        if n == 0 {
            return;
        }
        let stream = Stream::new(seed, Purpose::Bootstrap);
        let id = self.sampler.id();
        self.proposed.fill::<L>(&stream, n, |i| {
            let path = index(i);
            [path as u32, id | ((path >> 32) as u32) << 16]
        });
        let offsets: [[f64; 4]; REPLICAS] = std::array::from_fn(|r| {
            let words = stream.words::<f32>(r as u32, id, OFFSET_BLOCK);
            words.map(|w| f64::from(w) / 2f64.powi(32))
        });
        let (rows, steps) = self.recurrences();
        for (axis, (row, step)) in rows.into_iter().zip(steps).enumerate() {
            for (i, u) in self.proposed.row_mut(row)[..n].iter_mut().enumerate() {
                let path = index(i);
                let (replica, point) = (path % REPLICAS as u64, path / REPLICAS as u64);
                let v = (offsets[replica as usize][axis] + point as f64 * step).fract();
                *u = (v as f32).min(ONE_MINUS_EPSILON);
            }
        }
        if let PathSampler::Multiplexed(depth) = &self.sampler
            && !depth.choice.is_uniform()
        {
            let uniform = Choice::uniform(&depth.strategies);
            for u in &mut self.proposed.row_mut(depth.layout.strategy)[..n] {
                *u = depth.choice.carry(&uniform, *u);
            }
        }
    }

    fn propose<L: Lanes>(&mut self, proposals: &ProposalDistribution, steps: Steps) {
        let Steps {
            ids,
            iteration,
            large,
            decide,
        } = steps;
        let (current, proposed) = (&self.current, &mut self.proposed);
        proposals.propose::<L>(ids, iteration, current, proposed, large, decide);
    }

    #[inline(always)]
    fn evaluate<L: Lanes>(&self, world: &World, n: usize, paths: &mut Paths) {
        world.evaluate_sampler::<L>(&self.sampler, &self.proposed, n, paths);
    }

    fn commit<L: Lanes>(&mut self, taken: &[f32]) {
        if self.current.dimensions() == 0 {
            self.current.resize(self.sampler.dimensions(), self.chains);
        }
        for d in 0..self.sampler.dimensions() {
            let to = self.current.row_mut(d).chunks_exact_mut(L::N);
            let from = self.proposed.row(d).chunks_exact(L::N);
            for ((to, from), taken) in to.zip(from).zip(taken.chunks_exact(L::N)) {
                let taken = L::load(taken).gt(L::zero());
                L::select(taken, L::load(from), L::load(to)).store(to);
            }
        }
    }

    fn current(&self, chain: usize) -> Vec<f32> {
        self.current.column(chain)
    }

    fn proposed(&self, chain: usize) -> Vec<f32> {
        self.proposed.column(chain)
    }
}

/// The primary samples of bootstrap paths `indices` of the run with this `seed`, as columns of a
/// new matrix.
pub fn regenerate<L: Lanes>(
    sampler: impl Into<PathSampler>,
    seed: u64,
    indices: &[u64],
) -> Samples {
    let mut target = PrimarySampleSpace::new(sampler, indices.len());
    target.draw::<L>(seed, indices.len(), |i| indices[i]);
    target.proposed
}
