//! A batch of chains of one sampler, marching in lockstep.
//!
//! A step of all chains ([`Batch::step`]) is
//!
//! 1. propose ([`Target::propose`]): a new state for every chain, by a small or a large step;
//! 2. evaluate ([`Target::evaluate`]): the splats of these states, by transport;
//! 3. accept or reject: each of the two states gets its share of the weight;
//! 4. commit ([`Target::commit`]): what was accepted becomes the current state.
//!
//! [`Batch::march`] makes many steps. After each it logs what no longer stands, with its weight,
//! and hands full logs to the film. [`Batch::flush`] splats the current states at the end.
//!
//! If large steps are splatted as independent samples, too ([`Batch::combine`]), splats are weighed
//! by the equations of [`splats`](super::splats). Of the integrators only `pssmlt` does so.

mod saved;

use super::accept::{acceptance, biased_acceptance, colour, target, total, totals};
use super::bootstrap::Moments;
use super::counts::{Counts, LargeSteps, chain_id};
use super::monitor::{Monitor, View};
use super::primary::PrimarySampleSpace;
use super::splats::proposal;
use super::splats::{ChainSplat, ONE, exchange, fixed, in_units, mask, normalised, push, weight};
use super::target::{Steps, Target};
use crate::film::{Destination, SplatFilm, SplatLog, Tiling};
use crate::simd::Lanes;
use crate::transport::clock::Stage;
use crate::transport::records::SplatLanes;
use crate::transport::{PathSampler, Paths, World};

/// Chains of one target and where they stand.
pub struct Batch<T: Target = PrimarySampleSpace> {
    target: T,
    /// How large steps are splatted as independent samples, if they are.
    combined: Option<Combined>,
    /// Global chain numbers, padded to a multiple of eight.
    ids: Vec<u32>,
    /// `0..n`, the chains without padding.
    order: Vec<u32>,
    /// Targets of the current states.
    targets: Vec<f32>,
    /// The rest of the current states, `[splat][chain]`.
    states: Vec<ChainSplat>,
    /// Weight each current state has collected since it was accepted, in units of 2^-32.
    weights: Vec<u64>,
    /// 1 for large steps, 0 for small ones.
    large: Vec<f32>,
    /// Uniform numbers of the latest acceptance tests, in `[0, 1)`.
    decide: Vec<f32>,
    /// Of the latest proposals: acceptance, whether accepted (1 or 0), whether what is in `left`
    /// has light.
    share: Vec<f32>,
    taken: Vec<f32>,
    lit: Vec<f32>,
    /// Targets of the latest large steps, 0 for small ones.
    seen: Vec<f32>,
    /// What no longer stands after the latest step, laid out as `states`: the state that was left
    /// where the proposal was accepted, the proposal where it was rejected.
    left: Vec<ChainSplat>,
    /// Its weights, in units of 2^-32.
    left_weights: Vec<u64>,
    /// Next iteration.
    iteration: u32,
    /// Large-step targets, chain by chain: independent uniform samples.
    large_moments: LargeSteps,
    monitor: Option<Monitor>,
    /// Of all iterations since the batch was made.
    pub counts: Counts,
}

/// Large steps as independent samples.
#[derive(Clone, Copy, Debug)]
struct Combined {
    /// `c` of the equations of [`splats`](super::splats).
    constant: f32,
    /// Their layer of the film.
    layer: usize,
}

/// Where a chain stands.
#[derive(Clone, Debug, PartialEq)]
pub struct State<S = Vec<f32>> {
    /// [`Target::State`]; primary samples are laid out as their sampler says.
    pub samples: S,
    /// The target function at the state, at least 0 and finite.
    pub target: f32,
}

/// What a chain did in an iteration.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainStep<S = Vec<f32>> {
    /// The state it proposed, laid out as [`State::samples`].
    pub proposal: S,
    /// Drawn afresh, not a movement of the current state.
    pub large: bool,
    /// Acceptance probability.
    pub acceptance: f32,
    /// Uniform in `[0, 1)`; the proposal is accepted if it is below [`Self::acceptance`].
    pub drawn: f32,
    /// Whether the proposal has become the current state.
    pub accepted: bool,
}

/// Memory to march in: one for each thread, whatever the batches.
pub struct Workspace {
    /// Paths of the proposals, of one batch at a time.
    pub paths: Paths,
    log: SplatLog,
    /// Of large steps, where they are splatted.
    independent: SplatLog,
}

impl Workspace {
    /// Empty; it grows to what the batches that march in it need.
    pub fn new(world: &World) -> Self {
        Self {
            paths: Paths::new(world),
            log: SplatLog::default(),
            independent: SplatLog::default(),
        }
    }
}

/// Splats collected before they go to the film, 256 KiB: the more, the more of them are neighbours
/// there.
const LOG: usize = 8192;

impl Batch {
    /// Chains `first..first + seeds.len()` of a sampler, started from bootstrap samples. A sampler
    /// of one depth has the world's plan of that depth, or one that differs from it in how
    /// strategies are chosen.
    pub fn new<L: Lanes>(
        world: &World,
        sampler: impl Into<PathSampler>,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Self {
        let target = PrimarySampleSpace::new(sampler, seeds.len());
        Self::over::<L>(world, target, first, seeds, seed, paths)
    }
}

impl<T: Target> Batch<T> {
    /// Chains `first..first + seeds.len()` of a target that has room for as many, started from the
    /// bootstrap samples `seeds` of the run with this `seed`.
    pub fn over<L: Lanes>(
        world: &World,
        mut target: T,
        first: usize,
        seeds: &[u64],
        seed: u64,
        paths: &mut Paths,
    ) -> Self {
        let n = seeds.len();
        let splats = target.splats();
        let padded = n.next_multiple_of(8);
        target.draw::<L>(seed, n, |i| seeds[i]);
        target.evaluate::<L>(world, n, paths);
        let mut targets = totals(paths, splats);
        let state = |row: usize, i: usize| {
            let o = &paths.splat_row(row)[i];
            ChainSplat {
                colour: colour(o.rgb, targets[i]),
                raster: o.raster,
                s: o.s,
                ..ChainSplat::default()
            }
        };
        let states = (0..splats)
            .flat_map(|row| (0..n).map(move |i| (row, i)))
            .map(|(row, i)| state(row, i))
            .collect();
        targets.resize(padded, 0.0);
        let mut taken = vec![0.0; padded];
        taken[..n].fill(1.0);
        target.commit::<L>(&taken);
        Self::at(target, first, n, targets, states)
    }

    /// `n` chains from `first` on that stand at these states and have not made a step.
    fn at(target: T, first: usize, n: usize, targets: Vec<f32>, states: Vec<ChainSplat>) -> Self {
        let padded = n.next_multiple_of(8);
        Self {
            ids: (first..first + padded)
                .map(|j| chain_id(target.id(), j))
                .collect(),
            order: (0..n as u32).collect(),
            targets,
            weights: vec![0; padded],
            large: vec![0.0; padded],
            decide: vec![0.0; padded],
            share: vec![0.0; padded],
            taken: vec![0.0; padded],
            lit: vec![0.0; padded],
            seen: vec![0.0; padded],
            left: vec![ChainSplat::default(); states.len()],
            states,
            left_weights: vec![0; n],
            iteration: 0,
            large_moments: LargeSteps::new(n),
            monitor: None,
            counts: Counts::default(),
            combined: None,
            target,
        }
    }

    /// Watches the chains from now on. `groups` says which of the [`GROUPS`](crate::film::GROUPS)
    /// groups of all chains of the sampler each belongs to, ascending.
    pub fn watch(&mut self, groups: &[u8], tiling: &Tiling) {
        let combined = self.combined.is_some();
        let monitor = Monitor::new(groups, self.target.strategies(), combined, tiling);
        self.monitor = Some(monitor);
    }

    /// From now on large steps are splatted to a layer of their own, too, and all splats are
    /// weighed by the equations of [`splats`](super::splats). To be called before any has been,
    /// and before the chains are watched.
    pub fn combine(&mut self, constant: f32, layer: usize) {
        let n = self.len();
        for row in self.states.chunks_mut(n.max(1)) {
            for (state, target) in row.iter_mut().zip(&self.targets) {
                state.colour = state.colour.map(|v| v * weight(*target, constant));
            }
        }
        self.combined = Some(Combined { constant, layer });
    }

    /// What has been recorded, if the chains are watched.
    pub fn monitor(&self) -> Option<&Monitor> {
        self.monitor.as_ref()
    }

    /// Chains, without the padding to whole packets.
    pub fn len(&self) -> usize {
        self.order.len()
    }
    /// Whether it has no chains.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }
    /// Iterations made.
    pub fn iterations(&self) -> u32 {
        self.iteration
    }

    /// Large-step targets, chain by chain: independent uniform samples.
    pub fn large_moments(&self) -> impl Iterator<Item = Moments> {
        self.large_moments.moments()
    }

    /// Marches `iterations` steps; splats go to the film.
    pub fn march<L: Lanes>(
        &mut self,
        world: &World,
        proposals: &T::Proposals,
        iterations: u32,
        workspace: &mut Workspace,
        film: &SplatFilm,
        to: Destination,
    ) {
        let Workspace {
            paths,
            log,
            independent,
        } = workspace;
        let n = self.len();
        let rays = paths.rays.traced;
        let to = in_units(to);
        let also = self.combined.map(|c| Destination {
            layer: c.layer,
            ..to
        });
        log.reserve(LOG.max(n));
        if also.is_some() {
            independent.reserve(LOG.max(n));
        }
        paths.clock.skip();
        for _ in 0..iterations {
            self.step::<L>(world, proposals, paths);
            for states in self.left.chunks(n.max(1)) {
                if log.room() < n {
                    film.add(to, log);
                }
                push(log, states, &self.left_weights, self.combined.is_some());
            }
            if let Some(also) = also {
                self.splat_large(film, also, independent);
            }
            paths.clock.count(Stage::Splat, n, 1);
            paths.clock.lap(Stage::Splat);
        }
        film.add(to, log);
        if let Some(also) = also {
            film.add(also, independent);
        }
        paths.clock.lap(Stage::Splat);
        self.counts.rays += paths.rays.traced - rays;
    }

    /// Splats the large steps of the latest iteration, whatever has become of them.
    fn splat_large(&self, film: &SplatFilm, to: Destination, log: &mut SplatLog) {
        let n = self.len();
        let rows = self.states.chunks(n.max(1));
        for (current, left) in rows.zip(self.left.chunks(n.max(1))) {
            if log.room() < n {
                film.add(to, log);
            }
            for i in (0..n).filter(|i| self.seen[*i] > 0.0) {
                let state = proposal(self.taken[i], &current[i], &left[i]);
                push(log, std::slice::from_ref(state), &[ONE], true);
            }
        }
    }

    /// One step of all chains. What they leave behind is splatted by [`Self::march`] only;
    /// [`Self::latest`] says what they did.
    #[inline(always)]
    pub fn step<L: Lanes>(&mut self, world: &World, proposals: &T::Proposals, paths: &mut Paths) {
        let n = self.len();
        let steps = Steps {
            ids: &self.ids,
            iteration: self.iteration,
            large: &mut self.large,
            decide: &mut self.decide,
        };
        self.target.propose::<L>(proposals, steps);
        paths.clock.count(Stage::Mutate, n, L::N);
        paths.clock.lap(Stage::Mutate);
        self.target.evaluate::<L>(world, n, paths);
        self.accept::<L>(paths);
        self.target.commit::<L>(&self.taken);
        paths.clock.count(Stage::Accept, n, L::N);
        paths.clock.lap(Stage::Accept);
        self.iteration += 1;
    }

    /// Where chain `i` of the batch stands: its state and target.
    pub fn state(&self, i: usize) -> State<T::State> {
        State {
            samples: self.target.current(i),
            target: self.targets[i],
        }
    }

    /// Raster position (of its first splat) and target of the state of every chain.
    pub fn places(&self) -> impl Iterator<Item = ([f32; 2], f32)> {
        let states = self.states[..self.len()].iter().zip(&self.targets);
        states.map(|(state, target)| (state.raster, *target))
    }

    /// What chain `i` did in the latest step.
    pub fn latest(&self, i: usize) -> ChainStep<T::State> {
        ChainStep {
            proposal: self.target.proposed(i),
            large: self.large[i] > 0.0,
            acceptance: self.share[i],
            drawn: self.decide[i],
            accepted: self.taken[i] > 0.0,
        }
    }

    /// Accepts or rejects every proposal. Both states are worth their expected share (`a` and `1 -
    /// a`, Veach and Guibas 1997, section 5.1): the one left behind is splatted, the one that
    /// stays collects weight until it is left.
    fn accept<L: Lanes>(&mut self, paths: &Paths) {
        let n = self.order.len();
        let splats = self.target.splats();
        // With one splat a state nothing is summed. This is tested once a batch.
        let zero = L::zero();
        for list in self.order.chunks(L::N) {
            let start = list[0] as usize;
            let first = SplatLanes::<L>::load(paths.splat_row(0), list);
            let mut proposed = target(first.rgb.to_array());
            if splats > 1 {
                let others = (1..splats).map(|row| {
                    let splat = SplatLanes::<L>::load(paths.splat_row(row), list);
                    target(splat.rgb.to_array())
                });
                proposed = total(std::iter::once(proposed).chain(others));
            }
            let current = L::load(&self.targets[start..]);
            let a = if T::SYMMETRIC {
                acceptance(current, proposed)
            } else {
                biased_acceptance(current, proposed, self.target.log_ratio(start))
            };
            let taken = L::load(&self.decide[start..]).lt(a);
            let large = L::load(&self.large[start..]).gt(zero);
            a.store(&mut self.share[start..]);
            L::one().or_zero(taken).store(&mut self.taken[start..]);
            proposed.or_zero(large).store(&mut self.seen[start..]);
            L::select(taken, proposed, current).store(&mut self.targets[start..]);
            // Of a state without light nothing is splatted.
            let lit = L::select(taken, current, proposed).gt(zero);
            L::one().or_zero(lit).store(&mut self.lit[start..]);
            let scale = self
                .combined
                .map(|c| weight(proposed, L::splat(c.constant)));
            let new = normalised(&first, proposed, scale);
            let goes = exchange(taken, new, &mut self.states[..n], &mut self.left[..n], list);
            for row in 1..splats {
                let more = SplatLanes::<L>::load(paths.splat_row(row), list);
                let new = normalised(&more, proposed, scale);
                let all = row * n..(row + 1) * n;
                let states = &mut self.states[all.clone()];
                exchange(taken, new, states, &mut self.left[all], list);
            }
            if let Some(monitor) = &mut self.monitor
                && self.combined.is_none()
            {
                monitor.place::<L>(start, goes.raster[0], goes.raster[1]);
            }
        }
        self.collect();
        if let Some(monitor) = &mut self.monitor {
            let view = View {
                combined: self.combined.is_some(),
                states: &self.states,
                left: &self.left,
                targets: &self.targets,
                proposed: paths.splat_row(0),
                share: &self.share,
                taken: &self.taken,
                large: &self.large,
                seen: &self.seen,
                left_weights: &self.left_weights,
            };
            monitor.see(self.iteration, &view);
        }
        self.counts.rejected += paths.rejected(splats);
    }

    /// Weights, and sums over large steps: plain loops over arrays, which compilers turn into
    /// vector code.
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

    /// Splats what the current states have collected, as at the end of a run.
    pub fn flush(&mut self, film: &SplatFilm, to: Destination) {
        let mut log = SplatLog::default();
        log.reserve(self.len());
        for (weight, target) in self.weights.iter_mut().zip(&self.targets) {
            *weight &= mask(f32::from(u8::from(*target > 0.0)));
        }
        let to = in_units(to);
        for states in self.states.chunks(self.order.len().max(1)) {
            push(&mut log, states, &self.weights, self.combined.is_some());
            film.add(to, &mut log);
        }
        if let Some(monitor) = &mut self.monitor {
            if self.combined.is_some() {
                monitor.weigh_splats(&self.states, &self.weights);
            } else {
                monitor.weigh_states(&self.states, &self.weights);
            }
        }
        self.weights.fill(0);
    }
}
