//! A batch of chains of one depth, marching in lockstep.

use super::accept::{acceptance, colour, target};
use super::bootstrap::{Moments, regenerate};
use super::monitor::{Monitor, View};
use super::mutate::Kernel;
use crate::film::{Destination, SplatFilm, SplatLog, Tiling};
use crate::plan::DepthPlan;
use crate::simd::{Lanes, Row};
use crate::transport::clock::Stage;
use crate::transport::samples::Samples;
use crate::transport::{Paths, World};

/// Weights are kept as integers in units of 2^-32, so that a state's weight is exact however its visits are grouped.
const WEIGHT_BITS: u32 = 32;

/// Chains of one depth and where they stand.
pub struct Batch {
    plan: DepthPlan,
    /// Global chain numbers, padded to a multiple of eight.
    ids: Vec<u32>,
    /// `0..n`, the chains without padding.
    order: Vec<u32>,
    current: Samples,
    proposed: Samples,
    /// Targets of the current states.
    targets: Vec<f32>,
    /// The rest of the current states, `[colour (3), raster (2), light vertices (bits), ..]`: colour over target, at most 3 a
    /// channel.
    states: Vec<Row>,
    /// Weight each current state has collected since it was accepted.
    weights: Vec<u64>,
    /// 1 for large steps, 0 for small ones.
    large: Vec<f32>,
    decide: Vec<f32>,
    /// Of the latest proposals: acceptance, whether accepted (1 or 0), whether the state that was left has light.
    share: Vec<f32>,
    taken: Vec<f32>,
    lit: Vec<f32>,
    /// Targets of the latest large steps, 0 for small ones.
    seen: Vec<f32>,
    /// States that the latest step has left, and their weights.
    left: Vec<Row>,
    left_weights: Vec<u64>,
    /// Next iteration.
    iteration: u32,
    /// Large-step targets, chain by chain: independent uniform samples.
    large_moments: LargeSteps,
    monitor: Option<Monitor>,
    pub counts: Counts,
}

/// Where a chain stands.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Laid out as its depth's [`Layout`](crate::plan::Layout).
    pub samples: Vec<f32>,
    pub target: f32,
}

/// What a chain did in an iteration.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    pub proposal: Vec<f32>,
    /// Drawn afresh, not a movement of the current state.
    pub large: bool,
    /// Acceptance probability, and the uniform number that has to be below it.
    pub acceptance: f32,
    pub drawn: f32,
    pub accepted: bool,
}

/// Sums over the large steps of each chain.
struct LargeSteps {
    count: Vec<u32>,
    sum: Vec<f64>,
    squares: Vec<f64>,
}

/// Memory to march in: one for each thread, whatever the batches.
pub struct Workspace {
    pub paths: Paths,
    log: SplatLog,
}

impl Workspace {
    pub fn new(world: &World) -> Self {
        Self {
            paths: Paths::new(world),
            log: SplatLog::default(),
        }
    }
}

/// Splats collected before they go to the film, 256 KiB: the more, the more of them are neighbours there.
const LOG: usize = 8192;

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
    /// Chains `first..first + seeds.len()` of a depth, started from bootstrap samples. `plan` is the world's plan of that depth, or differs
    /// from it in how strategies are chosen.
    pub fn new<L: Lanes>(
        world: &World,
        plan: &DepthPlan,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Self {
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
                Row([r, g, b, x, y, f32::from_bits(o.s), 0.0, 0.0])
            })
            .collect();
        Self {
            plan: plan.clone(),
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
            share: vec![0.0; padded],
            taken: vec![0.0; padded],
            lit: vec![0.0; padded],
            seen: vec![0.0; padded],
            left: vec![Row::default(); n],
            left_weights: vec![0; n],
            iteration: 0,
            large_moments: LargeSteps {
                count: vec![0; n],
                sum: vec![0.0; n],
                squares: vec![0.0; n],
            },
            monitor: None,
            counts: Counts::default(),
        }
    }

    /// Watches the chains from now on. `groups` says which of the depth's [`GROUPS`](crate::film::GROUPS) groups each belongs to, ascending.
    pub fn watch(&mut self, groups: &[u8], tiling: &Tiling) {
        self.monitor = Some(Monitor::new(groups, &self.plan.strategies, tiling));
    }

    /// What has been recorded, if the chains are watched.
    pub fn monitor(&self) -> Option<&Monitor> {
        self.monitor.as_ref()
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

    /// Marches `iterations` steps; splats go to the film.
    pub fn march<L: Lanes>(
        &mut self,
        world: &World,
        kernel: &Kernel,
        iterations: u32,
        workspace: &mut Workspace,
        film: &SplatFilm,
        to: Destination,
    ) {
        let Workspace { paths, log } = workspace;
        let n = self.len();
        let rays = paths.rays;
        let to = in_units(to);
        log.reserve(LOG.max(n));
        paths.clock.skip();
        for _ in 0..iterations {
            self.step::<L>(world, kernel, paths);
            if log.room() < n {
                film.add(to, log);
            }
            for (state, weight) in self.left.iter().zip(&self.left_weights) {
                log.push(state, *weight);
            }
            paths.clock.count(Stage::Splat, n, 1);
            paths.clock.lap(Stage::Splat);
        }
        film.add(to, log);
        paths.clock.lap(Stage::Splat);
        self.counts.rays += paths.rays - rays;
    }

    /// One step of all chains. What they leave behind is splatted by [`Self::march`] only; [`Self::latest`] says what they did.
    #[inline(always)]
    pub fn step<L: Lanes>(&mut self, world: &World, kernel: &Kernel, paths: &mut Paths) {
        let n = self.len();
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
        world.evaluate_multiplexed::<L>(&self.plan, &self.proposed, n, paths);
        self.accept::<L>(paths);
        self.keep::<L>();
        paths.clock.count(Stage::Accept, n, L::N);
        paths.clock.lap(Stage::Accept);
        self.iteration += 1;
    }

    /// Where chain `i` of the batch stands: its primary samples and target.
    pub fn state(&self, i: usize) -> State {
        State {
            samples: self.current.column(i),
            target: self.targets[i],
        }
    }

    /// Raster position and target of the state of every chain.
    pub fn places(&self) -> impl Iterator<Item = ([f32; 2], f32)> {
        let states = self.states.iter().zip(&self.targets);
        states.map(|(Row([_, _, _, x, y, ..]), target)| ([*x, *y], *target))
    }

    /// What chain `i` did in the latest step.
    pub fn latest(&self, i: usize) -> Step {
        Step {
            proposal: self.proposed.column(i),
            large: self.large[i] > 0.0,
            acceptance: self.share[i],
            drawn: self.decide[i],
            accepted: self.taken[i] > 0.0,
        }
    }

    /// Accepts or rejects every proposal. Both states are worth their expected share (`a` and `1 - a`, Veach and Guibas 1997, section 5.1):
    /// the one left behind is splatted, the one that stays collects weight until it is left.
    fn accept<L: Lanes>(&mut self, paths: &Paths) {
        let outcomes: &[Row] = bytemuck::cast_slice(&paths.outcome);
        let zero = L::zero();
        for list in self.order.chunks(L::N) {
            let start = list[0] as usize;
            let [r, g, b, x, y, s, ..] = L::load_rows(outcomes, list);
            let proposed = target([r, g, b]);
            let [r, g, b] = colour([r, g, b], proposed);
            let new = [r, g, b, x, y, s];
            let old = L::load_rows(&self.states, list);
            let current = L::load(&self.targets[start..]);
            let a = acceptance(current, proposed);
            let taken = L::load(&self.decide[start..]).lt(a);
            let large = L::load(&self.large[start..]).gt(zero);
            a.store(&mut self.share[start..]);
            L::one().or_zero(taken).store(&mut self.taken[start..]);
            proposed.or_zero(large).store(&mut self.seen[start..]);
            L::select(taken, proposed, current).store(&mut self.targets[start..]);
            // Of a state without light nothing is splatted.
            let lit = L::select(taken, current, proposed).gt(zero);
            L::one().or_zero(lit).store(&mut self.lit[start..]);
            let (mut stays, mut goes) = (old, old);
            for c in 0..new.len() {
                stays[c] = L::select(taken, new[c], old[c]);
                goes[c] = L::select(taken, old[c], new[c]);
            }
            L::store_rows(stays, &mut self.states, list);
            L::store_rows(goes, &mut self.left, list);
            if let Some(monitor) = &mut self.monitor {
                monitor.place::<L>(start, goes[3], goes[4]);
            }
        }
        self.collect();
        if let Some(monitor) = &mut self.monitor {
            let view = View {
                states: &self.states,
                targets: &self.targets,
                proposed: &paths.outcome,
                share: &self.share,
                taken: &self.taken,
                large: &self.large,
                seen: &self.seen,
                left_weights: &self.left_weights,
            };
            monitor.see(self.iteration, &view);
        }
        let rejected = paths.outcome.iter().map(|o| u64::from(o.rejected));
        self.counts.rejected += rejected.sum::<u64>();
    }

    /// Weights, and sums over large steps: plain loops over arrays, which compilers turn into vector code.
    fn collect(&mut self) {
        let n = self.order.len();
        let (share, taken, lit) = (&self.share[..n], &self.taken[..n], &self.lit[..n]);
        let (large, seen) = (&self.large[..n], &self.seen[..n]);
        let (weights, left) = (&mut self.weights[..n], &mut self.left_weights[..n]);
        let (mut all, mut of_large) = (0, 0);
        for i in 0..n {
            let share = fixed(share[i]);
            let collected = weights[i] + (ONE - share);
            let taken = mask(taken[i]);
            weights[i] = (share & taken) | (collected & !taken);
            left[i] = ((collected & taken) | (share & !taken)) & mask(lit[i]);
            all += share;
            of_large += share & mask(large[i]);
        }
        let LargeSteps {
            count,
            sum,
            squares,
        } = &mut self.large_moments;
        let (count, sum, squares) = (&mut count[..n], &mut sum[..n], &mut squares[..n]);
        let mut steps = 0;
        for i in 0..n {
            let v = f64::from(seen[i]);
            let is_large = u32::from(large[i].to_bits() != 0);
            count[i] += is_large;
            steps += is_large;
            sum[i] += v;
            squares[i] += v * v;
        }
        self.counts.large += u64::from(steps);
        self.counts.small += n as u64 - u64::from(steps);
        self.counts.large_accepted += of_large;
        self.counts.small_accepted += all - of_large;
    }

    /// The primary samples of accepted proposals become current.
    fn keep<L: Lanes>(&mut self) {
        for d in 0..self.plan.layout.total {
            let to = self.current.row_mut(d).chunks_exact_mut(L::N);
            let from = self.proposed.row(d).chunks_exact(L::N);
            for ((to, from), taken) in to.zip(from).zip(self.taken.chunks_exact(L::N)) {
                let taken = L::load(taken).gt(L::zero());
                L::select(taken, L::load(from), L::load(to)).store(to);
            }
        }
    }

    /// Splats what the current states have collected, as at the end of a run.
    pub fn flush(&mut self, film: &SplatFilm, to: Destination) {
        let mut log = SplatLog::default();
        log.reserve(self.len());
        for (weight, target) in self.weights.iter_mut().zip(&self.targets) {
            *weight &= mask(f32::from(u8::from(*target > 0.0)));
        }
        for (state, weight) in self.states.iter().zip(&self.weights) {
            log.push(state, *weight);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.weigh_states(&self.states, &self.weights);
        }
        film.add(in_units(to), &mut log);
        self.weights.fill(0);
    }
}

/// For weights in units of 2^-32.
fn in_units(to: Destination) -> Destination {
    Destination {
        scale: to.scale / ONE as f64,
        ..to
    }
}

/// A weight of 1.
const ONE: u64 = 1 << WEIGHT_BITS;

/// `x` in `[0, 1]` in units of 2^-32, rounded. In a sum with 2^52 the integer is the mantissa; a cast would have to look for numbers
/// that do not fit.
#[inline(always)]
fn fixed(x: f32) -> u64 {
    let sum = f64::from(x) * ONE as f64 + (1u64 << 52) as f64;
    sum.to_bits() & ((1 << 52) - 1)
}

/// All ones for 1, 0 for 0.
#[inline(always)]
fn mask(flag: f32) -> u64 {
    // Not a cast, which would look for numbers that do not fit.
    u64::from(flag.to_bits() != 0).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_rounded_shares() {
        for x in [0.0, 1.0, 0.5, 1e-9, 1e-20, 0.999_999_94, 1.0 / 3.0] {
            let exact = f64::from(x) * ONE as f64;
            assert!((fixed(x) as f64 - exact).abs() <= 0.5, "{x}");
        }
        assert_eq!(fixed(1.0), ONE);
        assert_eq!((mask(0.0), mask(1.0)), (0, u64::MAX));
    }
}
