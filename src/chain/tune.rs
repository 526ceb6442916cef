//! How far small steps go, and how often steps are large: tuned on chains of their own before any
//! sample counts, then frozen.
//!
//! The chains that tune a sampler (a depth, if paths are multiplexed) start from its bootstrap like
//! those that count, so that they are in equilibrium from the first step on, and make small steps
//! only. Whatever comes of it the picture's expectation is the same: a chain with any fixed kernel
//! keeps its target.
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
use super::mutate::Kernel;
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

/// Steps between which coincidences are counted, and the longest distance of two.
const STEPS: u32 = 128;
const LAGS: usize = 64;
/// Octaves of distances beyond.
const OCTAVES: u32 = 24;
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
    kernel: Kernel,
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
    /// `kernel` is what chains have that is not tuned, and where the search for sigma begins.
    /// `sampler` is that of the chains that count, which make so many `iterations`.
    pub fn new<L: Lanes>(
        world: &World,
        sampler: &PathSampler,
        bootstrap: &Bootstrap,
        seed: u64,
        kernel: Kernel,
        tune: Tune,
        iterations: u32,
    ) -> Self {
        let stream = Stream::new(seed, Purpose::TuningSeeding);
        let seeds = bootstrap.draw(&stream, sampler.id(), chains(tune, bootstrap.len()));
        let mut paths = Paths::new(world);
        let batch = Batch::new::<L>(world, sampler, 0, &seeds, seed, &mut paths);
        let sigma = kernel.sigma.clamp(SIGMA[0], SIGMA[1]);
        Self {
            tune,
            accepted: vec![0.0; batch.len()],
            batch,
            paths,
            kernel,
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

    /// What is known so far: what is not known yet is as it was.
    pub fn kernel(&self) -> Kernel {
        let mut kernel = self.kernel;
        if self.pixels.len() > LAGS {
            kernel.large_step_probability = self.best();
        }
        kernel
    }

    fn step<L: Lanes>(&mut self, world: &World, sigma: f32) {
        let mut kernel = self.kernel.tuning(self.seed);
        (kernel.large_step_probability, kernel.sigma) = (0.0, sigma);
        self.batch.step::<L>(world, &kernel, &mut self.paths);
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
        self.kernel.sigma = exp(if n > 0 {
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
        self.step::<L>(world, self.kernel.sigma);
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
        best.map_or(self.kernel.large_step_probability, |(p, _)| p)
    }
}

/// By polynomial: systems' libraries differ.
fn exp(x: f64) -> f32 {
    math::exp(x as f32)
}

/// What is known of one chain that makes small steps only.
struct Curve {
    /// Probability, less `chance`, that states are in one pixel, by their distance; and beyond.
    at: Vec<f64>,
    beyond: f64,
    /// Mean acceptance probability of a large step.
    accepted: f64,
}

impl Curve {
    /// `track` has the pixels of the states, one a step.
    fn new(track: &[u64], chance: f64, accepted: f64) -> Self {
        let met = |lag: usize| {
            let pairs = track.iter().zip(&track[lag..]);
            let n = track.len() - lag;
            pairs.filter(|(a, b)| a == b).count() as f64 / n as f64 - chance
        };
        let at: Vec<f64> = (0..LAGS.min(track.len())).map(met).collect();
        let late = &at[at.len() / 2..];
        Self {
            beyond: late.iter().sum::<f64>() / late.len().max(1) as f64,
            at,
            accepted,
        }
    }
}

/// Of all chains: what is left of coincidences when the distance doubles, at the end of what is
/// counted.
fn octave(chains: &[Curve]) -> f64 {
    let early = |c: &Curve| c.at[c.at.len() / 4..c.at.len() / 2].iter().sum::<f64>();
    // Half as many.
    let early = 2.0 * chains.iter().map(early).sum::<f64>();
    let late = |c: &Curve| c.at[c.at.len() / 2..].iter().sum::<f64>();
    let late = chains.iter().map(late).sum::<f64>();
    if early > 0.0 {
        (late / early).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Mean integrated autocorrelation of chains that make large steps with the probability `p` and end
/// with the probability `end`. `octave` is what is left of coincidences when the distance doubles.
fn error(chains: &[Curve], octave: f64, end: f64, p: f64) -> f64 {
    let (mut near, mut far) = (0.0, 0.0);
    for chain in chains {
        let h = 1.0 / (1.0 - (1.0 - end) * p * (1.0 - chain.accepted));
        let g = (1.0 - end) * (1.0 - p) * h;
        let mut power = 1.0;
        for c in &chain.at {
            near += h * c * power;
            power *= g;
        }
        // (1 - g) / h; a chain that could never leave leaves after a very long time.
        let leaves = (end + (1.0 - end) * p * chain.accepted).max(1e-12);
        let mut c = chain.beyond;
        for _ in 0..OCTAVES {
            c *= octave;
            far += c * (power - power * power) / leaves;
            power *= power;
        }
    }
    // Chains that have forgotten all are not better than independent ones: what is below 0 is
    // noise.
    (2.0 * near + 2.0 * far.max(0.0)) / chains.len().max(1) as f64 - 1.0
}

/// Part of all pairs of states, of chains that started apart, that are in one pixel.
fn coincidence(pixels: &[u64], seeds: &[u64]) -> f64 {
    let pairs = |keys: Vec<(u64, u64)>, same: fn(&(u64, u64), &(u64, u64)) -> bool| -> f64 {
        let runs = keys.chunk_by(same).map(|run| run.len() as f64);
        runs.map(|n| n * (n - 1.0)).sum()
    };
    let mut keys: Vec<(u64, u64)> = pixels.iter().copied().zip(seeds.iter().copied()).collect();
    keys.sort_unstable();
    let n = keys.len() as f64;
    let kin = {
        let mut seeds: Vec<(u64, u64)> = seeds.iter().map(|s| (*s, 0)).collect();
        seeds.sort_unstable();
        pairs(seeds, |a, b| a.0 == b.0)
    };
    let met = pairs(keys.clone(), |a, b| a.0 == b.0) - pairs(keys, |a, b| a == b);
    let all = n * (n - 1.0) - kin;
    if all > 0.0 { met / all } else { 0.0 }
}

/// Acceptance probabilities of large steps.
struct LargeSteps {
    /// Targets of independent paths, ascending, and the sums up to each.
    values: Vec<f32>,
    sums: Vec<f64>,
}

impl LargeSteps {
    fn new(mut values: Vec<f32>) -> Self {
        values.sort_unstable_by(f32::total_cmp);
        let sums = (values.iter())
            .scan(0.0, |sum, v| {
                *sum += f64::from(*v);
                Some(*sum)
            })
            .collect();
        Self { values, sums }
    }

    /// From a state of this target.
    fn accepted(&self, target: f32) -> f64 {
        let n = self.values.len();
        if n == 0 || target <= 0.0 {
            return 1.0;
        }
        let below = self.values.partition_point(|v| *v < target);
        let sum = below.checked_sub(1).map_or(0.0, |last| self.sums[last]);
        (sum / f64::from(target) + (n - below) as f64) / n as f64
    }
}

/// Targets of some of the paths, evenly spread; of all, if they are few.
fn thin(bootstrap: &Bootstrap) -> Vec<f32> {
    // Odd: quasirandom sets take turns.
    let step = (bootstrap.len() as usize).div_ceil(VALUES) | 1;
    bootstrap.all().step_by(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain whose small steps leave the part `power` of its correlation each.
    fn curve(power: f64, accepted: f64) -> Curve {
        Curve {
            at: (0..LAGS).map(|j| power.powi(j as i32)).collect(),
            beyond: if power < 1.0 { 0.0 } else { 1.0 },
            accepted,
        }
    }

    #[test]
    fn errors_of_chains_that_are_known() {
        for (accepted, end) in [(0.01, 0.0), (0.3, 0.0), (1.0, 0.0), (0.3, 0.02)] {
            for p in [0.05, 0.3, 0.9] {
                // What is left of the correlation by one mutation.
                let left = |power: f64| (1.0 - end) * (p * (1.0 - accepted) + (1.0 - p) * power);
                // Small steps that lead somewhere, and such that lead nowhere.
                for power in [0.0, 0.3, 0.6, 1.0] {
                    let chains = [curve(power, accepted)];
                    let f = left(power);
                    let exact = (1.0 + f) / (1.0 - f);
                    let found = error(&chains, octave(&chains), end, p);
                    assert!(
                        (found / exact - 1.0).abs() < 1e-6,
                        "{accepted} {end} {p} {power}: {found} {exact}"
                    );
                }
            }
        }
    }

    /// Power laws go on as they were counted.
    #[test]
    fn errors_of_chains_that_diffuse() {
        let at: Vec<f64> = (0..1 << 16).map(|j| 1.0 / f64::from(j + 1)).collect();
        let (p, accepted) = (0.1, 0.02);
        let whole = Curve {
            at: at.clone(),
            beyond: 0.0,
            accepted,
        };
        let late = &at[LAGS / 2..LAGS];
        let counted = [Curve {
            at: at[..LAGS].to_vec(),
            beyond: late.iter().sum::<f64>() / late.len() as f64,
            accepted,
        }];
        let exact = error(&[whole], 0.0, 0.0, p);
        let found = error(&counted, octave(&counted), 0.0, p);
        let blind = error(&counted, 0.0, 0.0, p);
        assert!(
            (found - exact).abs() < 0.05 * (exact - blind),
            "{found} {exact} {blind}"
        );
    }

    #[test]
    fn large_steps_are_accepted_as_often_as_they_are() {
        let values = [0.0f32, 0.0, 3.0, 1.0, 0.25, 1.0, 80.0];
        let chance = LargeSteps::new(values.to_vec());
        for target in [0.0, 1e-6, 0.25, 0.3, 1.0, 2.0, 80.0, 1e6] {
            let ratio = |v: &f32| super::super::accept::acceptance(target, *v);
            // From where there is no light, all that have some.
            let mean = values.iter().map(ratio).sum::<f32>() / values.len() as f32;
            let expected = if target > 0.0 { f64::from(mean) } else { 1.0 };
            assert!(
                (chance.accepted(target) - expected).abs() < 1e-6,
                "{target}"
            );
        }
    }

    #[test]
    fn pairs_of_independent_chains_are_counted() {
        let mut word = 1u64;
        let mut random = |n: u64| {
            word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (word >> 33) % n
        };
        let n = 200;
        let pixels: Vec<u64> = (0..n).map(|_| random(20)).collect();
        let seeds: Vec<u64> = (0..n).map(|_| random(60)).collect();
        let (mut met, mut all) = (0.0, 0.0);
        for i in 0..n {
            for j in (0..n).filter(|j| seeds[i] != seeds[*j]) {
                all += 1.0;
                met += f64::from(u8::from(pixels[i] == pixels[j]));
            }
        }
        assert_eq!(coincidence(&pixels, &seeds), met / all);
        // Nothing to compare.
        assert_eq!(coincidence(&pixels, &vec![7; n]), 0.0);
        assert_eq!(coincidence(&[], &[]), 0.0);
    }

    #[test]
    fn curves_count_what_tracks_do() {
        let track: Vec<u64> = (0..STEPS as u64).map(|i| i / 4).collect();
        let curve = Curve::new(&track, 0.0, 1.0);
        assert_eq!(curve.at[0], 1.0);
        // Of 127 neighbours, 32 times 3 are in one pixel.
        assert_eq!(curve.at[1], 96.0 / 127.0);
        assert!(curve.at[4..].iter().all(|c| *c == 0.0) && curve.beyond == 0.0);
    }
}
