//! How far small steps go, and how often steps are large: tuned on chains of their own before any
//! sample counts, then frozen.
//!
//! The chains that tune a sampler (a depth, if paths are multiplexed) start from its bootstrap like
//! those that count, so that they are in equilibrium from the first step on, and make small steps
//! only. Whatever comes of it the picture's expectation is the same: a chain keeps its target with
//! any fixed proposal distribution.
//!
//! **Sigma** is moved until small steps are accepted with the probability [`ACCEPTANCE`] on
//! average: stochastic approximation (Robbins and Monro 1951) of the logarithm, as in Andrieu and
//! Thoms 2008 ("A tutorial on adaptive MCMC", section 5), with the mean over all chains in place of
//! one, and the mean of the second half of the iterates (Polyak and Juditsky 1992) as the result.
//! In many dimensions and for smooth targets 0.234 would be best (Roberts, Gelman and Gilks 1997);
//! [`ACCEPTANCE`] is what renders liked better (PERF.md).
//!
//! **The probability of large steps.** Zsolnai and Szirmay-Kalos 2013 ("Automatic Parameter Control
//! for Metropolis Light Transport") gather statistics in the first phase of a render and set the
//! probability for the rest from a model of the error. That plan is theirs; the model here
//! is another. Let chains make small steps only, and let `c(j)` be the probability that states `j`
//! steps apart are in one pixel, less that of two independent states. With large steps in between,
//! of probability `p` and accepted with probability `a`, after which all is forgotten, a chain has
//! made `j` small steps since for a mean of `h g^j` mutations, `h = 1 / (1 - p + p a)`, `g = (1 -
//! p) h`: rejected large steps leave it where it is. The squared error of the pixels, for a number
//! of mutations, is then in proportion to the integrated autocorrelation
//!
//! ```text
//! t(p) = 2 h sum over j of c(j) g^j  -  1
//! ```
//!
//! and `p` the minimum of its mean over chains, each with its own `a` and `c`. Of a chain of `n`
//! mutations, pairs `k` apart count with weight `1 - k / n` only: each mutation also ends it with
//! the probability `2 / n`, which gives the same sum. Chains that are short start independently
//! often enough. `c` is counted up to `LAGS`; beyond, it falls from each octave of `j` to the next
//! as in the last two (small steps diffuse: a power law, by a half an octave over a plane, by
//! nothing for chains in a corner that they cannot leave). `a` is exact for the targets that the
//! bootstrap has seen: the mean of `min(1, f / f(x))` over its paths `f`, along the states `x`.
//! (Where strategies are chosen as learned it is that of uniform choice.)

use super::batch::Batch;
use super::bootstrap::Bootstrap;
use super::correlation::{Curve, LAGS, LargeSteps, coincidence, error, octave};
use super::mutate::ProposalDistribution;
use crate::simd::rng::{Purpose, Stream};
use crate::simd::{Lanes, math};
use crate::transport::{PathSampler, Paths, World};

/// What is tuned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tune {
    /// The scale of small steps.
    pub sigma: bool,
    /// The probability of large steps.
    pub large_step: bool,
}

impl Tune {
    /// Whether chains have to march for it at all.
    pub fn any(self) -> bool {
        self.sigma || self.large_step
    }

    /// Steps that each chain makes for it.
    pub fn steps(self) -> u32 {
        let sigma = if self.sigma { SIGMA_STEPS } else { 0 };
        sigma + if self.large_step { STEPS } else { 0 }
    }
}

/// Mean acceptance probability of small steps that sigma is tuned for.
pub const ACCEPTANCE: f64 = 0.5;

/// Between these sigma stays: a hundredth of a pixel of a large picture, and anywhere.
const SIGMA: [f32; 2] = [1e-6, 0.5];
const SIGMA_STEPS: u32 = 64;
/// Gains are `GAIN * SLOWDOWN / (SLOWDOWN + n)` in step `n`. In ordinary scenes acceptance falls by
/// 0.1 to 0.25 where sigma grows by a factor of e: the first gain is that of Newton's method, and
/// later ones average.
const GAIN: f64 = 4.0;
const SLOWDOWN: f64 = 8.0;

/// Steps between which coincidences are counted.
pub const STEPS: u32 = 128;
/// Probabilities that are compared are multiples of this, between these: large steps are never left
/// out, for what small ones cannot reach, nor small ones, for what the bootstrap has not seen.
const GRID: f32 = 1.0 / 64.0;
const LARGE: [u32; 2] = [3, 61];

/// Most chains that tune a sampler.
pub const CHAINS: usize = 512;
/// Values that acceptance probabilities of large steps are computed from; more would not tell more.
const VALUES: usize = 1 << 16;

/// Tunes one sampler.
pub struct Tuner {
    tune: Tune,
    batch: Batch,
    paths: Paths,
    /// Of the chains that count, as far as it is known.
    proposals: ProposalDistribution,
    seed: u64,
    /// Probability that a chain that counts ends with a mutation, see above.
    end: f64,
    ln_sigma: f64,
    /// Sum of iterates of the second half, and their number.
    iterates: (f64, u32),
    /// Bootstrap path that each chain started from.
    seeds: Vec<u64>,
    chance: LargeSteps,
    /// Pixels and acceptance probabilities of large steps, step by step.
    pixels: Vec<Vec<u64>>,
    accepted: Vec<f64>,
    /// Steps made.
    done: u32,
}

/// Chains that tune a sampler with so many bootstrap paths: those make about as many steps.
pub fn chains(tune: Tune, bootstrap: u64) -> usize {
    let chains = bootstrap / u64::from(tune.steps().max(1));
    (chains as usize).clamp(64, CHAINS).next_multiple_of(8)
}

impl Tuner {
    /// `proposals` is what chains have that is not tuned, and where the search for sigma begins.
    /// `sampler` is that of the chains that count, which make so many `iterations`.
    pub fn new<L: Lanes>(
        world: &World,
        sampler: &PathSampler,
        bootstrap: &Bootstrap,
        seed: u64,
        proposals: ProposalDistribution,
        tune: Tune,
        iterations: u32,
    ) -> Self {
        let stream = Stream::new(seed, Purpose::TuningSeeding);
        let seeds = bootstrap.draw(&stream, sampler.id(), chains(tune, bootstrap.len()));
        let mut paths = Paths::new(world);
        let batch = Batch::new::<L>(world, sampler, 0, &seeds, seed, &mut paths);
        let sigma = proposals.sigma.clamp(SIGMA[0], SIGMA[1]);
        Self {
            tune,
            accepted: vec![0.0; batch.len()],
            batch,
            paths,
            proposals,
            seed,
            end: (2.0 / f64::from(iterations.max(1))).min(1.0),
            ln_sigma: f64::from(math::ln(sigma)),
            iterates: (0.0, 0),
            seeds,
            chance: LargeSteps::new(if tune.large_step {
                thin(bootstrap)
            } else {
                Vec::new()
            }),
            pixels: Vec::new(),
            done: 0,
        }
    }

    /// Steps that chains have made.
    pub fn done(&self) -> u32 {
        self.done
    }

    /// Chains that march for it, each with a sigma of its own.
    pub fn chains(&self) -> usize {
        self.seeds.len()
    }

    /// Rays traced.
    pub fn rays(&self) -> u64 {
        self.paths.rays.traced
    }

    /// Goes on for so many steps, or to the end.
    pub fn advance<L: Lanes>(&mut self, world: &World, steps: u32) {
        let until = (self.done + steps).min(self.tune.steps());
        while self.done < until {
            let sigma_steps = self.tune.steps() - if self.tune.large_step { STEPS } else { 0 };
            if self.done < sigma_steps {
                self.search::<L>(world);
            } else {
                self.watch::<L>(world);
            }
            self.done += 1;
        }
    }

    /// As tuned so far. Parameters that are not tuned yet keep their first values.
    pub fn proposals(&self) -> ProposalDistribution {
        let mut proposals = self.proposals;
        if self.pixels.len() > LAGS {
            proposals.large_step_probability = self.best();
        }
        proposals
    }

    fn step<L: Lanes>(&mut self, world: &World, sigma: f32) {
        let mut proposals = self.proposals.tuning(self.seed);
        (proposals.large_step_probability, proposals.sigma) = (0.0, sigma);
        self.batch.step::<L>(world, &proposals, &mut self.paths);
    }

    /// A step of the search for sigma.
    fn search<L: Lanes>(&mut self, world: &World) {
        self.batch.counts = Default::default();
        self.step::<L>(world, exp(self.ln_sigma));
        // Exact, whatever the order.
        let (_, accepted) = self.batch.counts.acceptance();
        let gain = GAIN * SLOWDOWN / (SLOWDOWN + f64::from(self.done));
        let [least, most] = SIGMA.map(|s| f64::from(math::ln(s)));
        self.ln_sigma = (self.ln_sigma + gain * (accepted - ACCEPTANCE)).clamp(least, most);
        if self.done >= SIGMA_STEPS / 2 {
            self.iterates.0 += self.ln_sigma;
            self.iterates.1 += 1;
        }
        let (sum, n) = self.iterates;
        self.proposals.sigma = exp(if n > 0 {
            sum / f64::from(n)
        } else {
            self.ln_sigma
        });
    }

    /// A step of which states are recorded.
    fn watch<L: Lanes>(&mut self, world: &World) {
        let n = self.batch.len();
        let mut pixels = Vec::with_capacity(n);
        for (i, (place, target)) in self.batch.places().take(n).enumerate() {
            let [x, y] = place.map(|v| v.floor() as i32 as u32);
            pixels.push(u64::from(y) << 32 | u64::from(x));
            self.accepted[i] += self.chance.accepted(target);
        }
        self.pixels.push(pixels);
        self.step::<L>(world, self.proposals.sigma);
    }

    /// The probability of large steps that has the smallest error.
    fn best(&self) -> f32 {
        let chance = coincidence(&self.pixels[0], &self.seeds);
        let steps = self.pixels.len();
        // The states of a chain, in a row.
        let chains: Vec<Curve> = (0..self.batch.len())
            .map(|i| {
                let track: Vec<u64> = self.pixels.iter().map(|step| step[i]).collect();
                Curve::new(&track, chance, self.accepted[i] / steps as f64)
            })
            .collect();
        let octave = octave(&chains);
        let errors = (LARGE[0]..=LARGE[1]).map(|i| {
            let p = i as f32 * GRID;
            (p, error(&chains, octave, self.end, f64::from(p)))
        });
        let best = errors.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(self.proposals.large_step_probability, |(p, _)| p)
    }
}

/// By polynomial: systems' libraries differ.
fn exp(x: f64) -> f32 {
    math::exp(x as f32)
}

/// Targets of some of the paths, evenly spread; of all, if they are few.
pub(super) fn thin(bootstrap: &Bootstrap) -> Vec<f32> {
    // Odd: quasirandom sets take turns.
    let step = (bootstrap.len() as usize).div_ceil(VALUES) | 1;
    bootstrap.all().step_by(step).collect()
}
