//! Bootstrap: the integral of the target of each sampler (of each depth, if paths are multiplexed),
//! and first states drawn in proportion to it (Veach and Guibas 1997, section 4.3, by systematic
//! resampling).

use super::accept::totals;
use super::primary::{PrimarySampleSpace, REPLICAS};
use super::target::Target;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream, unit_float};
use crate::transport::{PathSampler, Paths, World};
use rayon::prelude::*;

/// Paths evaluated at a time.
pub const CHUNK: u64 = 1024;

/// Sums of independent uniform samples of a target.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Moments {
    /// Samples.
    pub count: u64,
    /// Of their values.
    pub sum: f64,
    /// Of the squares of their values.
    pub sum_squares: f64,
}

impl Moments {
    /// One more sample.
    pub fn add(&mut self, value: f32) {
        self.count += 1;
        self.sum += f64::from(value);
        self.sum_squares += f64::from(value) * f64::from(value);
    }
    /// In an order fixed by the caller: sums of floats depend on it.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.sum_squares += other.sum_squares;
    }
    /// 0 if there are no samples.
    pub fn mean(&self) -> f64 {
        if self.count > 0 {
            self.sum / self.count as f64
        } else {
            0.0
        }
    }
    /// Squared standard error of the mean.
    pub fn error2(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let n = self.count as f64;
        let variance = (self.sum_squares / n - self.mean().powi(2)).max(0.0) * n / (n - 1.0);
        variance / n
    }
}

/// The estimate of one integral: the quasirandom bootstrap, and independent samples that came
/// later.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Estimate {
    /// Quasirandom samples of the target: they are not independent, so that their error comes from
    /// replicas.
    pub bootstrap: Moments,
    /// Squared standard error of the bootstrap's mean, from its replicas.
    replica_error2: f64,
    /// Large steps.
    pub later: Moments,
}

impl Estimate {
    /// How many independent samples a bootstrap sample is worth.
    fn gain(&self) -> f64 {
        let independent = self.bootstrap.error2();
        if self.replica_error2 > 0.0 && independent > 0.0 {
            // A handful of replicas cannot vouch for more.
            (independent / self.replica_error2).clamp(1.0, 100.0)
        } else {
            1.0
        }
    }

    /// Both means, weighted by the independent samples they are worth. The gain is a ratio of two
    /// errors of the same samples: where a rare path was missed both are too small, and the
    /// weights stay right.
    pub fn mean(&self) -> f64 {
        let w = self.bootstrap.count as f64 * self.gain();
        let n = self.later.count as f64;
        if w + n > 0.0 {
            (w * self.bootstrap.mean() + self.later.sum) / (w + n)
        } else {
            0.0
        }
    }

    /// How many samples of equal values would tell the mean as well: the square of the sum over
    /// the sum of squares (Kish 1965, section 11.7). Few samples that carry most of the light are
    /// worth little more than one, however many there are beside them.
    pub fn effective(&self) -> f64 {
        let sum = self.bootstrap.sum + self.later.sum;
        let squares = self.bootstrap.sum_squares + self.later.sum_squares;
        if squares > 0.0 {
            sum * sum / squares
        } else {
            0.0
        }
    }

    /// Squared standard error of [`Self::mean`].
    pub fn error2(&self) -> f64 {
        let w = self.bootstrap.count as f64 * self.gain();
        let n = self.later.count as f64;
        if w + n > 0.0 {
            let independent = self.bootstrap.error2();
            let first = if self.replica_error2 > 0.0 {
                self.replica_error2
            } else {
                independent
            };
            (w * w * first + n * n * self.later.error2()) / (w + n).powi(2)
        } else {
            0.0
        }
    }
}

/// The bootstrap of one integral.
pub struct Bootstrap {
    /// Of the integral of the target over primary sample space.
    pub estimate: Estimate,
    /// Target of every sample, in chunks of [`CHUNK`]: there can be a billion of them.
    values: Vec<Vec<f32>>,
    /// Samples in `values`.
    made: u64,
    /// Chunks at the front that do not count for the estimate.
    uncounted: usize,
    /// Sums over the paths of each strategy, in order; none if no path has been made, or the
    /// sampler has no strategies.
    strategies: Vec<Moments>,
    /// Samples asked for.
    wanted: u64,
    /// Paths whose contribution was no finite number; they count as 0.
    pub rejected: u64,
    /// Rays traced.
    pub rays: u64,
}

/// What a chunk of paths has come to; no values if it was cancelled.
#[derive(Default)]
struct ChunkSums {
    values: Vec<f32>,
    strategies: Vec<Moments>,
    rejected: u64,
    rays: u64,
}

impl Bootstrap {
    /// No path yet of `count`.
    pub fn new(count: u64) -> Self {
        Self {
            estimate: Estimate::default(),
            values: Vec::new(),
            made: 0,
            uncounted: 0,
            strategies: Vec::new(),
            wanted: count,
            rejected: 0,
            rays: 0,
        }
    }

    /// Evaluates `count` uniform paths. `cancelled` is asked between chunks; a cancelled bootstrap
    /// has fewer samples.
    pub fn run<L: Lanes>(
        world: &World,
        sampler: impl Into<PathSampler>,
        seed: u64,
        count: u64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let mut bootstrap = Self::new(count);
        bootstrap.extend::<L>(world, &sampler.into(), seed, count, cancelled);
        bootstrap.settle();
        bootstrap
    }

    /// Paths evaluated.
    pub fn len(&self) -> u64 {
        self.made
    }

    /// Whether no path has been evaluated yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cancelled before all samples were made.
    pub fn is_short(&self) -> bool {
        self.len() < self.wanted
    }

    /// Asks for so many samples in all.
    pub fn want(&mut self, count: u64) {
        if self.wanted > 0 {
            self.wanted = count;
        }
    }

    /// Evaluates further paths until there are `until` (a multiple of [`CHUNK`], or all).
    /// `cancelled` is asked between chunks.
    pub fn extend<L: Lanes>(
        &mut self,
        world: &World,
        sampler: &PathSampler,
        seed: u64,
        until: u64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) {
        let target = || PrimarySampleSpace::new(sampler, CHUNK as usize);
        self.extend_over::<_, L>(world, target, seed, until, cancelled);
    }

    /// The same for any target; `target` makes room for [`CHUNK`] states.
    pub fn extend_over<T: Target, L: Lanes>(
        &mut self,
        world: &World,
        target: impl Fn() -> T + Sync,
        seed: u64,
        until: u64,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) {
        let until = until.min(self.wanted);
        let strategies = target().strategies().to_vec();
        let room = strategies.last().map_or(0, |s| *s as usize + 1);
        let work = |(paths, target): &mut (Paths, T), chunk: u64| {
            if cancelled() {
                return ChunkSums::default();
            }
            let first = chunk * CHUNK;
            let n = (until - first).min(CHUNK) as usize;
            let rays = paths.rays.traced;
            target.draw::<L>(seed, n, |i| first + i as u64);
            target.evaluate::<L>(world, n, paths);
            let rejected = paths.rejected(target.splats());
            let values = totals(paths, target.splats());
            let mut by_light_vertices = vec![Moments::default(); room];
            for (splat, value) in paths.splat_row(0).iter().zip(&values) {
                if let Some(moments) = by_light_vertices.get_mut(splat.s as usize) {
                    moments.add(*value);
                }
            }
            let strategies = strategies.iter();
            ChunkSums {
                strategies: strategies.map(|s| by_light_vertices[*s as usize]).collect(),
                values,
                rejected,
                rays: paths.rays.traced - rays,
            }
        };
        let chunks: Vec<ChunkSums> = (self.len() / CHUNK..until.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(|| (Paths::new(world), target()), work)
            .collect();
        // Path numbers are positions in `values`: what lies beyond the first chunk that a stop left
        // out has lost its place, and counts as if it had not been made.
        let whole = chunks
            .into_iter()
            .take_while(|part| !part.values.is_empty());
        self.strategies.resize(strategies.len(), Moments::default());
        for part in whole {
            // Chunk by chunk: the order of the sum does not depend on threads or rounds.
            let mut sum = Moments::default();
            part.values.iter().for_each(|v| sum.add(*v));
            self.estimate.bootstrap.merge(&sum);
            self.made += sum.count;
            for (to, from) in self.strategies.iter_mut().zip(&part.strategies) {
                to.merge(from);
            }
            self.values.push(part.values);
            self.rejected += part.rejected;
            self.rays += part.rays;
        }
    }

    /// Sums over the paths of each of the sampler's strategies, in order; empty if no path has been
    /// made.
    pub fn strategies(&self) -> &[Moments] {
        &self.strategies
    }

    /// Target of every path, in order.
    pub(super) fn all(&self) -> impl Iterator<Item = f32> {
        self.values.iter().flatten().copied()
    }

    /// What the samples so far have shown has decided about the render. An estimate from them
    /// would not be independent of that, so they only are seeds from here on. The last chunk must
    /// be whole.
    pub fn decide(&mut self) {
        self.uncounted = self.values.len();
        self.estimate.bootstrap = Moments::default();
    }

    /// Leaves a part of every target; sums by strategy stay as they are. To be settled afterwards.
    pub fn leave(&mut self, part: impl Fn(f32) -> f32) {
        for value in self.values.iter_mut().flatten().filter(|v| **v > 0.0) {
            *value *= part(*value);
        }
        self.sum_up();
    }

    /// The estimate's sums anew.
    fn sum_up(&mut self) {
        self.estimate.bootstrap = Moments::default();
        for chunk in &self.values[self.uncounted..] {
            let mut sum = Moments::default();
            chunk.iter().for_each(|v| sum.add(*v));
            self.estimate.bootstrap.merge(&sum);
        }
    }

    /// Completes the estimate after the last path. Paths that decided something do not count,
    /// unless there are no others.
    pub fn settle(&mut self) {
        if self.estimate.bootstrap.count == 0 && self.uncounted > 0 {
            self.uncounted = 0;
            self.sum_up();
        }
        let counted = self.values[self.uncounted..].iter().flatten().copied();
        self.estimate.replica_error2 = replica_error2(self.estimate.bootstrap.count, counted);
    }

    /// Indices of `n` samples drawn in proportion to their target: one uniform offset, then equal
    /// steps through the cumulative sum, so that a sample is drawn as often as its share says,
    /// rounded up or down. `id` is the sampler's ([`PathSampler::id`]).
    pub fn seeds(&self, seed: u64, id: u32, n: usize) -> Vec<u64> {
        self.draw(&Stream::new(seed, Purpose::Seeding), id, n)
    }

    /// The same with the random numbers of `stream`.
    pub(super) fn draw(&self, stream: &Stream, id: u32, n: usize) -> Vec<u64> {
        let [word, ..] = stream.words::<f32>(id, 0, 0);
        let offset = f64::from(unit_float::<f32>(word));
        let total: f64 = self.all().map(f64::from).sum();
        let mut seeds = Vec::with_capacity(n);
        let mut running = 0.0;
        let mut last = 0;
        for (i, value) in self.all().enumerate() {
            if value <= 0.0 {
                continue;
            }
            running += f64::from(value);
            last = i as u64;
            while seeds.len() < n && (seeds.len() as f64 + offset) / n as f64 * total < running {
                seeds.push(i as u64);
            }
        }
        // The last steps can be lost to rounding.
        while seeds.len() < n {
            seeds.push(last);
        }
        seeds
    }
}

/// Squared standard error of the mean of all `n` values, from the scatter of the replicas' means.
fn replica_error2(n: u64, values: impl Iterator<Item = f32>) -> f64 {
    if n < 8 * REPLICAS as u64 {
        return 0.0;
    }
    let mut sums = [0.0; REPLICAS];
    for (i, value) in values.enumerate() {
        sums[i % REPLICAS] += f64::from(value);
    }
    let means: [f64; REPLICAS] =
        std::array::from_fn(|r| sums[r] / (n - r as u64).div_ceil(REPLICAS as u64) as f64);
    let mean = means.iter().sum::<f64>() / REPLICAS as f64;
    let spread: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    spread / (REPLICAS * (REPLICAS - 1)) as f64
}
