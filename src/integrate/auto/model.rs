//! Who is to bring the light of each depth: what samples and chains would leave as error, per ray.
//!
//! Wanted is a picture of small mean `w error^2`, with `w` about one over the square of the
//! picture. At each depth samples keep at most `d` of a contribution and chains bring the rest
//! (`transport::share`), in parts `u = d / (y + d)` and `1 - u` of one with the mean channel `y`.
//! Of `n` samples and `m` mutations a pixel there is left
//!
//! ```text
//! S / n,  S = mean of w (difference of two samples of a pixel)^2 / 2, with what each keeps
//!             + sum over splats of w (u y)^2
//! C / m,  C = B sum over depths of E,  E = b <w t (1 - u)>,  B = sum over depths of b <1 - u>
//! ```
//!
//! where `b` is the light of a depth, `<.>` the mean over states of its chains and `t` the
//! integrated autocorrelation of their pixels. If a sample takes `s` rays and a mutation `c`, the
//! best split of a given number of rays leaves `(sqrt(S s) + sqrt(C c))^2` over that number, which
//! is what is minimised over the constants `d`.
//!
//! Depth 0 is for samples, and does not enter.
//!
//! A sample that brings a thousand times the mean is rarely among those of a pilot. Chains are, as
//! often as it is bright: they tell the same `S` once more, as `b <w y u^2>` for each depth, and
//! what samples have missed of that is added.

use super::evidence::{Depth, State};

/// A part of all strategies, and what a sample of them takes.
pub(super) struct Costs<'a> {
    /// Rays of a sample that keeps something at the depths of which this is true.
    pub sample: &'a dyn Fn(&[bool]) -> f64,
    /// Constants between 0 and infinity are possible.
    pub shared: bool,
    /// Depths that chains can bring.
    pub chains: &'a dyn Fn(usize) -> bool,
}

/// Who brings what.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Choice {
    /// By depth: the most of a contribution's mean channel that samples keep.
    pub kept: Vec<f64>,
    /// Of samples and of mutations: expected squared error times their number per pixel.
    pub samples: f64,
    pub chains: f64,
    /// Rays of a sample and, in the mean, of a mutation.
    pub rays: [f64; 2],
    /// Samples are paths from the camera alone.
    pub forward: bool,
}

impl Choice {
    /// Expected squared error times rays.
    pub fn error(&self) -> f64 {
        let [s, c] = self.rays;
        ((self.samples * s).sqrt() + (self.chains * c).sqrt()).powi(2)
    }

    /// Part of all rays that go to samples.
    pub fn part(&self) -> f64 {
        let [s, c] = self.rays;
        let (samples, chains) = ((self.samples * s).sqrt(), (self.chains * c).sqrt());
        if !self.has_chains() {
            1.0
        } else if samples + chains > 0.0 {
            samples / (samples + chains)
        } else {
            0.5
        }
    }

    /// By depth: the most that samples keep.
    pub fn bounds(&self) -> Vec<f32> {
        self.kept.iter().map(|d| *d as f32).collect()
    }

    pub fn has_chains(&self) -> bool {
        self.kept.iter().any(|d| d.is_finite())
    }
}

/// Part of what chains see that is more than the luck of few of them, and of a map that blurs what
/// is bright and small.
const SURE: f64 = 0.25;
/// Error of chains over what a short trial of them tells: it does not see all that they get stuck
/// in, nor how unevenly they start.
const UNSEEN: f64 = 2.0;
/// Constants that are tried, over the mean radiance: powers of four.
const CONSTANTS: std::ops::RangeInclusive<i32> = -3..=4;
/// What else is better by less is not worth the chains' start.
const WORTH: f64 = 0.85;

/// The best constants.
pub(super) fn choose(depths: &[Depth], samples: u32, costs: &Costs) -> Choice {
    let mut search = Search::new(depths, samples, costs);
    let all = search.judge();
    let light: f64 = depths.iter().map(|d| d.light).sum();
    let mut constants = vec![0.0];
    if costs.shared {
        constants.extend(CONSTANTS.map(|j| light * 4f64.powi(j)));
    }
    let mut best = all.clone();
    // One for all depths, then each by itself.
    for &d in &constants {
        (0..depths.len()).for_each(|depth| search.set(depth, d));
        let choice = search.judge();
        if choice.error() < best.error() {
            best = choice;
        }
    }
    constants.push(f64::INFINITY);
    for _ in 0..2 {
        for depth in 0..depths.len() {
            for &d in &constants {
                (0..depths.len()).for_each(|k| search.set(k, best.kept[k]));
                search.set(depth, d);
                let choice = search.judge();
                if choice.error() < best.error() {
                    best = choice;
                }
            }
        }
    }
    if best.error() > WORTH * all.error() {
        best = all;
    }
    best
}

/// All by chains that they can bring.
pub(super) fn whole(depths: &[Depth], samples: u32, costs: &Costs) -> Choice {
    let mut search = Search::new(depths, samples, costs);
    (0..depths.len()).for_each(|depth| search.set(depth, 0.0));
    search.judge()
}

/// All by samples.
pub(super) fn alone(depths: &[Depth], samples: u32, costs: &Costs) -> Choice {
    Search::new(depths, samples, costs).judge()
}

/// Constants on trial, with the sums that they come to.
struct Search<'a> {
    depths: &'a [Depth],
    samples: u32,
    costs: &'a Costs<'a>,
    kept: Vec<f64>,
    /// What samples keep at their own places, over all depths.
    placed: Vec<f64>,
    /// The same of all light.
    whole: Vec<f64>,
    weights: Vec<f64>,
    sums: Vec<Sums>,
}

/// Sums of a depth.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Mean over samples of `w (u y)^2`, of splats.
    splats: f64,
    /// What chains have seen of `w (u y)^2`, and samples have not.
    missed: f64,
    /// `b <1 - u>` and `b <w t (1 - u)>`.
    left: f64,
    error: f64,
}

fn part(d: f64, value: f64) -> f64 {
    if d.is_infinite() {
        1.0
    } else if d <= 0.0 {
        0.0
    } else {
        d / (value + d)
    }
}

impl<'a> Search<'a> {
    /// All kept.
    fn new(depths: &'a [Depth], samples: u32, costs: &'a Costs<'a>) -> Self {
        let mut search = Self {
            depths,
            samples,
            costs,
            kept: vec![0.0; depths.len()],
            placed: vec![0.0; samples as usize],
            whole: vec![0.0; samples as usize],
            weights: vec![0.0; samples as usize],
            sums: vec![Sums::default(); depths.len()],
        };
        for seen in depths.iter().flat_map(|d| &d.samples).filter(|s| s.placed) {
            let i = seen.sample as usize;
            search.weights[i] = search.weights[i].max(seen.weight);
            search.whole[i] += seen.value;
        }
        (0..depths.len()).for_each(|depth| search.set(depth, f64::INFINITY));
        search
    }

    /// Changes the constant of a depth; where chains cannot bring it all is kept, and depth 0
    /// always is.
    fn set(&mut self, depth: usize, d: f64) {
        let d = if depth > 0 && (self.costs.chains)(depth) {
            d
        } else {
            f64::INFINITY
        };
        let before = self.kept[depth];
        if before == d {
            return;
        }
        let (of, n) = (&self.depths[depth], f64::from(self.samples.max(1)));
        let mut sums = Sums::default();
        let mut all = 0.0;
        // What is seen directly is for samples whatever comes of the rest; the edges of a lamp
        // would drown all else.
        for seen in of.samples.iter().filter(|_| depth > 0) {
            let kept = part(d, seen.value) * seen.value;
            let square = seen.weight * kept * kept / n;
            all += square;
            if seen.placed {
                let change = kept - part(before, seen.value) * seen.value;
                self.placed[seen.sample as usize] += change;
            } else {
                sums.splats += square;
            }
        }
        let over = |value: &dyn Fn(&State) -> f64| -> f64 {
            of.light * of.states.iter().map(|s| s.part * value(s)).sum::<f64>()
        };
        let u = |s: &State| part(d, s.value);
        let by_chains = over(&|s| s.weight * s.value * u(s) * u(s));
        sums.missed = (SURE * by_chains - all).max(0.0);
        if d.is_finite() {
            sums.left = over(&|s| 1.0 - u(s));
            sums.error = UNSEEN * over(&|s| s.alone * s.memory * (1.0 - u(s)));
        }
        self.sums[depth] = sums;
        self.kept[depth] = d;
    }

    fn judge(&self) -> Choice {
        let sum = |of: fn(&Sums) -> f64| self.sums.iter().map(of).sum::<f64>();
        let pairs = self
            .placed
            .chunks_exact(2)
            .zip(self.weights.chunks_exact(2));
        // Where both are bright their pixel is, however dim what is around it.
        let differences: f64 = pairs
            .zip(self.whole.chunks_exact(2))
            .map(|((p, w), all)| {
                let bright = all[0].min(all[1]);
                (p[0] - p[1]).powi(2) / (1.0 / w[0].max(w[1]) + bright * bright)
            })
            .filter(|d| d.is_finite())
            .sum();
        // Half a square for each of half as many pairs.
        let placed = differences / f64::from(self.samples.max(1));
        let left = sum(|s| s.left);
        let rays = (self.sums.iter().zip(self.depths)).map(|(s, depth)| s.left * depth.rays);
        let mutation = if left > 0.0 {
            rays.sum::<f64>() / left
        } else {
            1.0
        };
        let on: Vec<bool> = self.kept.iter().map(|d| *d > 0.0).collect();
        Choice {
            kept: self.kept.clone(),
            samples: placed + sum(|s| s.splats + s.missed),
            chains: left * sum(|s| s.error),
            rays: [(self.costs.sample)(&on), MUTATION * mutation],
            forward: false,
        }
    }
}

/// Time of a ray of a mutation over that of one of a sample.
const MUTATION: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::super::evidence::Seen;
    use super::*;

    /// A depth whose samples find the value `y`, each with the probability `p`, and whose chains
    /// have such a memory.
    fn depth(y: f64, p: f64, memory: f64, samples: u32) -> Depth {
        let every = (1.0 / p).round() as u32;
        let weight = 1.0;
        let found = (0..samples).filter(|i| i % every == 0);
        Depth {
            samples: found
                .map(|sample| Seen {
                    sample,
                    placed: true,
                    value: y,
                    weight,
                })
                .collect(),
            light: y * p,
            rays: 2.0,
            states: vec![State {
                part: 1.0,
                value: y,
                weight,
                alone: weight,
                memory,
            }],
        }
    }

    fn costs<'a>() -> Costs<'a> {
        Costs {
            sample: &|on| 2.0 * on.iter().filter(|on| **on).count() as f64,
            shared: false,
            chains: &|_| true,
        }
    }

    #[test]
    fn rare_light_is_for_chains_and_the_rest_for_samples() {
        let n = 1 << 14;
        let depths = [
            depth(0.1, 0.5, 5.0, n),
            depth(1.0, 0.5, 5.0, n),
            depth(1000.0, 1.0 / 4096.0, 5.0, n),
        ];
        let choice = choose(&depths, n, &costs());
        assert_eq!(choice.kept, [f64::INFINITY, f64::INFINITY, 0.0]);
        assert!(choice.has_chains() && (0.0..1.0).contains(&choice.part()));
        // Chains that remember for too long are no help.
        let slow = [depths[0].clone(), depth(1000.0, 1.0 / 4096.0, 1e6, n)];
        assert!(!choose(&slow, n, &costs()).has_chains());
    }

    #[test]
    fn light_that_samples_have_missed_counts() {
        let n = 1 << 10;
        let mut depths = [depth(0.1, 0.5, 5.0, n), depth(1.0, 0.5, 5.0, n)];
        // None of the samples, but chains are where it is a million times as bright.
        depths[1].states[0].value = 1e6;
        let choice = choose(&depths, n, &costs());
        assert_eq!(choice.kept, [f64::INFINITY, 0.0]);
    }
}
