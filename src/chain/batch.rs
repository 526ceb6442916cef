//! A batch of chains of one depth, marching in lockstep.

use super::accept::{acceptance, colour, target};
use super::bootstrap::{Moments, regenerate};
use super::mutate::Kernel;
use crate::film::{Splat, SplatFilm};
use crate::plan::DepthPlan;
use crate::simd::{Lanes, Mask, Row};
use crate::transport::clock::Stage;
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
    /// `0..n`, the chains without padding.
    order: Vec<u32>,
    current: Samples,
    proposed: Samples,
    /// Targets of the current states.
    targets: Vec<f32>,
    /// The rest of the current states, `[colour (3), raster (2), ..]`: colour over target, at most 3 a channel.
    states: Vec<Row>,
    /// Weight each current state has collected since it was accepted.
    weights: Vec<u64>,
    /// 1 for large steps, 0 for small ones.
    large: Vec<f32>,
    decide: Vec<f32>,
    /// Targets of the latest large steps, 0 for small ones.
    seen: Vec<f32>,
    /// Acceptance of the latest proposals, a bit a chain, eight chains a word.
    accepted: Vec<u32>,
    /// What the latest step leaves for the film.
    splats: Vec<Splat>,
    /// Next iteration.
    iteration: u32,
    /// Large-step targets, chain by chain: independent uniform samples.
    large_moments: LargeSteps,
    pub counts: Counts,
}

/// Sums over the large steps of each chain.
struct LargeSteps {
    count: Vec<u32>,
    sum: Vec<f64>,
    squares: Vec<f64>,
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
        let mut targets: Vec<f32> = paths.outcome.iter().map(|o| target(o.rgb)).collect();
        targets.resize(padded, 0.0);
        let states = (paths.outcome.iter().zip(&targets))
            .map(|(o, &target)| {
                let [r, g, b] = colour(o.rgb, target);
                let [x, y] = o.raster;
                Row([r, g, b, x, y, 0.0, 0.0, 0.0])
            })
            .collect();
        Self {
            depth,
            ids: (first..first + padded)
                .map(|j| chain_id(plan.depth, j))
                .collect(),
            order: (0..n as u32).collect(),
            proposed: Samples::new(plan.layout.total, n),
            current,
            targets,
            states,
            weights: vec![0; padded],
            large: vec![0.0; padded],
            decide: vec![0.0; padded],
            seen: vec![0.0; padded],
            accepted: vec![0; padded / 8],
            splats: vec![Splat::default(); n + 1],
            iteration: 0,
            large_moments: LargeSteps {
                count: vec![0; n],
                sum: vec![0.0; n],
                squares: vec![0.0; n],
            },
            counts: Counts::default(),
        }
    }

    pub fn len(&self) -> usize {
        self.order.len()
    }
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }
    /// Iterations made.
    pub fn iterations(&self) -> u32 {
        self.iteration
    }

    /// Large-step targets, chain by chain: independent uniform samples.
    pub fn large_moments(&self) -> impl Iterator<Item = Moments> {
        let LargeSteps {
            count,
            sum,
            squares,
        } = &self.large_moments;
        (0..self.len()).map(|i| Moments {
            count: u64::from(count[i]),
            sum: sum[i],
            sum_squares: squares[i],
        })
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
        let n = self.len();
        let rays = paths.rays;
        let scale = splat_scale / (1u64 << WEIGHT_BITS) as f64;
        paths.clock.skip();
        for _ in 0..iterations {
            kernel.propose::<L>(
                &self.ids,
                self.iteration,
                &self.current,
                &mut self.proposed,
                &mut self.large,
                &mut self.decide,
            );
            paths.clock.count(Stage::Mutate, n, L::N);
            paths.clock.lap(Stage::Mutate);
            world.evaluate_multiplexed::<L>(plan, &self.proposed, n, paths);
            let left = self.accept::<L>(paths);
            self.keep::<L>(plan);
            paths.clock.count(Stage::Accept, n, L::N);
            paths.clock.lap(Stage::Accept);
            film.add_all(layer, &self.splats[..left], scale);
            paths.clock.count(Stage::Splat, left, 1);
            paths.clock.lap(Stage::Splat);
            self.iteration += 1;
        }
        self.counts.rays += paths.rays - rays;
    }

    /// Accepts or rejects every proposal; returns the number of splats. Both states are worth their expected share (`a` and `1 - a`, Veach
    /// and Guibas 1997, section 5.1): the one left behind is splatted, the one that stays collects weight until it is left.
    fn accept<L: Lanes>(&mut self, paths: &Paths) -> usize {
        let one = 1u64 << WEIGHT_BITS;
        let outcomes: &[Row] = bytemuck::cast_slice(&paths.outcome);
        let zero = L::zero();
        let mut gone = [Row::default(); 8];
        let mut left = 0;
        self.accepted.fill(0);
        for list in self.order.chunks(L::N) {
            let start = list[0] as usize;
            let [r, g, b, x, y, ..] = L::load_rows(outcomes, list);
            let proposed = target([r, g, b]);
            let [r, g, b] = colour([r, g, b], proposed);
            let new = [r, g, b, x, y, zero, zero, zero];
            let old = L::load_rows(&self.states, list);
            let current = L::load(&self.targets[start..]);
            let a = acceptance(current, proposed);
            let taken = L::load(&self.decide[start..]).lt(a);
            let large = L::load(&self.large[start..]).gt(zero);
            proposed.or_zero(large).store(&mut self.seen[start..]);
            L::select(taken, proposed, current).store(&mut self.targets[start..]);
            let (mut stays, mut goes) = (old, old);
            for c in 0..5 {
                stays[c] = L::select(taken, new[c], old[c]);
                goes[c] = L::select(taken, old[c], new[c]);
            }
            L::store_rows(stays, &mut self.states, list);
            L::store_rows(goes, &mut gone, &EACH[..list.len()]);
            let lit = L::select(taken, current, proposed).gt(zero).bits();
            let (taken, large) = (taken.bits(), large.bits());
            self.accepted[start / 8] |= taken << (start % 8);
            for (lane, &chain) in list.iter().enumerate() {
                let i = chain as usize;
                let share = (f64::from(a.lane(lane)) * one as f64) as u64;
                let collected = self.weights[i] + (one - share);
                let (stay, go) = if taken >> lane & 1 != 0 {
                    (share, collected)
                } else {
                    (collected, share)
                };
                self.weights[i] = stay;
                let Row([r, g, b, x, y, ..]) = gone[lane];
                self.splats[left] = Splat {
                    colour: [r, g, b],
                    raster: [x, y],
                    weight: go,
                };
                left += usize::from((lit >> lane & 1 != 0) & (go > 0));
                let is_large = u64::from(large >> lane & 1);
                self.counts.large += is_large;
                self.counts.large_accepted += share * is_large;
                self.counts.small += 1 - is_large;
                self.counts.small_accepted += share * (1 - is_large);
                self.counts.rejected += u64::from(paths.outcome[i].rejected);
            }
        }
        let n = self.len();
        let steps = &mut self.large_moments;
        for i in 0..n {
            let v = f64::from(self.seen[i]);
            steps.count[i] += u32::from(self.large[i] > 0.0);
            steps.sum[i] += v;
            steps.squares[i] += v * v;
        }
        left
    }

    /// The primary samples of accepted proposals become current.
    fn keep<L: Lanes>(&mut self, plan: &DepthPlan) {
        for d in 0..plan.layout.total {
            let (to, from) = (self.current.row_mut(d), self.proposed.row(d));
            for (block, bits) in self.accepted.iter().enumerate() {
                for lane in (0..8).step_by(L::N) {
                    let at = 8 * block + lane;
                    let mask = L::Mask::from_bits(bits >> lane);
                    L::select(mask, L::load(&from[at..]), L::load(&to[at..])).store(&mut to[at..]);
                }
            }
        }
    }

    /// Splats what the current states have collected, as at the end of a run.
    pub fn flush(&mut self, film: &SplatFilm, layer: usize, splat_scale: f64) {
        let scale = splat_scale / (1u64 << WEIGHT_BITS) as f64;
        let lit = (0..self.len()).filter(|&i| self.targets[i] > 0.0 && self.weights[i] > 0);
        let splats: Vec<Splat> = lit
            .map(|i| {
                let Row([r, g, b, x, y, ..]) = self.states[i];
                Splat {
                    colour: [r, g, b],
                    raster: [x, y],
                    weight: self.weights[i],
                }
            })
            .collect();
        film.add_all(layer, &splats, scale);
        self.weights.fill(0);
    }
}

const EACH: [u32; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
