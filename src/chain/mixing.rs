//! How well the chains of a sampler have mixed.
//!
//! Every chain's segments ([`super::monitor`]) are sequences of equal length `n`. With `W` the mean
//! variance within sequences and `V` the variance of their means, split R-hat is
//!
//! ```text
//! sqrt(((n - 1) / n * W + V) / W)
//! ```
//!
//! (Gelman and Rubin 1992; Gelman et al. 2013, section 11.4, with as many segments as there are).
//! It is near 1 when every part of every chain has seen the same; it compares
//! distributions as they are, without the rank normalisation of Vehtari et al. 2021, because raster
//! positions are bounded and targets enter by their logarithm.
//!
//! With thousands of chains no autocorrelation needs to be estimated: the variance of the chains'
//! own means says directly how many independent samples a chain is worth.

use super::monitor::{EVERY, Monitor, SCALARS, Stay, Tally};
use serde::Serialize;

/// Mixing of the chains of a depth, or of all depths at once.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Mixing {
    /// Largest split R-hat of raster x, raster y and log target; `None` where the chains are too
    /// short to tell.
    pub rhat: Option<f64>,
    /// Smallest effective sample size of the three, over all chains; `None` likewise.
    pub ess: Option<f64>,
    /// Part of all small proposals that carries no light; `None` if there was none.
    pub dark_small: Option<f64>,
    /// Part of all large proposals that carries no light; `None` if there was none.
    pub dark_large: Option<f64>,
    /// None for all depths at once: every state has all strategies.
    pub strategies: Vec<StrategyMixing>,
    /// Chains that stayed in one state for more than [`LONG_STAY`] iterations and a tenth of their
    /// length.
    pub stuck: Vec<Stuck>,
}

/// The same for one strategy `(s, t)`, over the scalar that is 1 where a state belongs to it and 0
/// elsewhere.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StrategyMixing {
    /// Light vertices.
    pub s: u32,
    /// Camera vertices.
    pub t: u32,
    /// Part of the depth's light that it carries.
    pub share: f64,
    /// Split R-hat; `None` where the chains are too short to tell.
    pub rhat: Option<f64>,
    /// Effective sample size over all chains; `None` likewise.
    pub ess: Option<f64>,
    /// Mean acceptance probability of small steps to this strategy; `None` if there was none.
    pub acceptance_small: Option<f64>,
    /// The same of large steps.
    pub acceptance_large: Option<f64>,
    /// Part of the small proposals without light; `None` if there was none.
    pub dark_small: Option<f64>,
    /// Part of the large proposals without light; `None` if there was none.
    pub dark_large: Option<f64>,
}

/// A chain that does not move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stuck {
    /// Light vertices of the state's strategy; `None` if it has all of them.
    pub s: Option<u32>,
    /// Camera vertices, with `s`.
    pub t: Option<u32>,
    /// Raster position of the state, in pixels from the left.
    pub x: f32,
    /// In pixels from the top.
    pub y: f32,
    /// Iterations it stayed.
    pub iterations: u32,
}

/// Iterations in one state that are never called stuck.
pub const LONG_STAY: u32 = 100;

/// Records that a sequence needs for its variance to mean anything.
const FEWEST_RECORDS: u32 = 4;

impl Mixing {
    /// Judges all batches of a depth (`None`: of all depths at once), which have made the same
    /// number of iterations.
    pub fn of(depth: Option<u32>, iterations: u32, monitors: &[&Monitor]) -> Self {
        let Some(first) = monitors.first() else {
            return Self::default();
        };
        let scalars: [Scalar; SCALARS] = std::array::from_fn(|c| {
            let mut scalar = Scalar::default();
            for monitor in monitors {
                let (segments, length) = monitor.segments();
                for chain in 0..monitor.stays().len() {
                    let of = |segment: &super::monitor::Segment| {
                        (segment.sums[c][chain], segment.squares[c][chain])
                    };
                    scalar.add(segments.iter().map(of), length);
                }
            }
            scalar
        });
        let worst = |values: [Option<f64>; SCALARS], than: fn(f64, f64) -> f64| {
            values.into_iter().flatten().reduce(than)
        };
        let strategies = depth.into_iter().flat_map(|depth| {
            (0..first.strategies().len()).map(move |i| strategy(depth, i, monitors))
        });
        let dark = |kind: usize| {
            let mut all = Tally::default();
            for tally in monitors.iter().flat_map(|m| &m.tallies()[kind]) {
                all.merge(tally);
            }
            (all.proposals > 0).then(|| all.dark as f64 / all.proposals as f64)
        };
        Self {
            dark_small: dark(0),
            dark_large: dark(1),
            rhat: worst(scalars.each_ref().map(Scalar::rhat), f64::max),
            ess: worst(scalars.each_ref().map(Scalar::ess), f64::min),
            strategies: strategies.collect(),
            stuck: stuck(depth, iterations, monitors),
        }
    }
}

fn strategy(depth: u32, i: usize, monitors: &[&Monitor]) -> StrategyMixing {
    let all = monitors[0].strategies();
    let mut scalar = Scalar::default();
    let mut tallies = [Tally::default(); 2];
    for monitor in monitors {
        let (segments, length) = monitor.segments();
        for chain in 0..monitor.stays().len() {
            let visits = |segment: &super::monitor::Segment| {
                let visits = f64::from(segment.visits[chain * all.len() + i]);
                (visits, visits)
            };
            scalar.add(segments.iter().map(visits), length);
        }
        for (to, from) in tallies.iter_mut().zip(monitor.tallies()) {
            to.merge(&from[i]);
        }
    }
    let over =
        |tally: &Tally, sum: f64| (tally.proposals > 0).then(|| sum / tally.proposals as f64);
    let [small, large] = &tallies;
    StrategyMixing {
        s: all[i],
        t: depth + 2 - all[i],
        share: scalar.mean(),
        rhat: scalar.rhat(),
        ess: scalar.ess(),
        acceptance_small: over(small, small.acceptance()),
        acceptance_large: over(large, large.acceptance()),
        dark_small: over(small, small.dark as f64),
        dark_large: over(large, large.dark as f64),
    }
}

/// Longest first.
fn stuck(depth: Option<u32>, iterations: u32, monitors: &[&Monitor]) -> Vec<Stuck> {
    let long = |stay: &&Stay| {
        // A tenth of a short run is no time at all.
        stay.iterations > LONG_STAY && stay.iterations > iterations / 10
    };
    let mut list: Vec<Stuck> = (monitors.iter().flat_map(|m| m.stays()))
        .filter(long)
        .map(|stay| Stuck {
            s: depth.map(|_| stay.s),
            t: depth.map(|depth| depth + 2 - stay.s),
            x: stay.raster[0],
            y: stay.raster[1],
            iterations: stay.iterations,
        })
        .collect();
    list.sort_by(|a, b| {
        let place = |s: &Stuck| (s.y, s.x);
        (b.iterations.cmp(&a.iterations)).then(
            place(a)
                .partial_cmp(&place(b))
                .unwrap_or(std::cmp::Ordering::Equal),
        )
    });
    list
}

/// What is known of one scalar, over all chains.
#[derive(Clone, Debug, Default)]
struct Scalar {
    /// Records in a segment, and segments.
    length: u32,
    segments: u64,
    /// Sums over segments: of their means, of the means' squares, of their variances.
    means: f64,
    squares: f64,
    within: f64,
    /// Sums over chains: of their means, and squares.
    chains: u64,
    chain_means: f64,
    chain_squares: f64,
}

impl Scalar {
    /// Adds a chain, by sums and sums of squares over its segments of `length` records.
    fn add(&mut self, segments: impl Iterator<Item = (f64, f64)>, length: u32) {
        self.length = length;
        let n = f64::from(length);
        let (mut sum, mut count) = (0.0, 0);
        for (s, squares) in segments {
            let mean = s / n;
            self.segments += 1;
            self.means += mean;
            self.squares += mean * mean;
            self.within += (squares - s * mean).max(0.0) / (n - 1.0).max(1.0);
            sum += mean;
            count += 1;
        }
        if count > 0 {
            let mean = sum / f64::from(count);
            self.chains += 1;
            self.chain_means += mean;
            self.chain_squares += mean * mean;
        }
    }

    fn mean(&self) -> f64 {
        if self.segments > 0 {
            self.means / self.segments as f64
        } else {
            0.0
        }
    }

    /// Enough to tell variances.
    fn tells(&self) -> bool {
        self.length >= FEWEST_RECORDS && self.chains >= 2 && self.segments > self.chains
    }

    /// Mean variance within segments, and the variance of their means; `None` if too little is
    /// known.
    fn variances(&self) -> Option<(f64, f64)> {
        if !self.tells() {
            return None;
        }
        let m = self.segments as f64;
        let within = self.within / m;
        let between = (self.squares - self.means * self.means / m).max(0.0) / (m - 1.0);
        // Below this it is rounding: the scalar is a constant, of which all chains have seen
        // everything.
        let least = 1e-12 * self.squares / m;
        Some(if within + between > least {
            (within, between)
        } else {
            (1.0, 0.0)
        })
    }

    /// Split R-hat; infinite if the chains differ and none of them moves.
    fn rhat(&self) -> Option<f64> {
        let (within, between) = self.variances()?;
        let n = f64::from(self.length);
        Some((((n - 1.0) / n * within + between) / within).sqrt())
    }

    /// The number of independent samples whose mean has the variance of the mean of all chains; at
    /// most the number of iterations.
    fn ess(&self) -> Option<f64> {
        let (within, between) = self.variances()?;
        let n = f64::from(self.length);
        let chains = self.chains as f64;
        let spread =
            (self.chain_squares - self.chain_means.powi(2) / chains).max(0.0) / (chains - 1.0);
        let variance = (n - 1.0) / n * within + between;
        let most = f64::from(EVERY) * n * self.segments as f64;
        Some(if spread > 0.0 {
            (chains * variance / spread).min(most)
        } else {
            most
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of `segments * n` values that keeps its value with probability `keep`, else draws a
    /// standard normal one, plus `shift`.
    fn chain(state: &mut u64, segments: usize, n: u32, keep: f64, shift: f64) -> Vec<(f64, f64)> {
        let mut uniform = || {
            *state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            ((*state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        let mut normal = || {
            let r = (-2.0 * uniform().ln()).sqrt();
            r * (std::f64::consts::TAU * uniform()).cos()
        };
        let mut x = normal();
        (0..segments)
            .map(|_| {
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..n {
                    if (normal() * 0.5).abs() > keep {
                        x = normal();
                    }
                    sum += x + shift;
                    squares += (x + shift).powi(2);
                }
                (sum, squares)
            })
            .collect()
    }

    fn scalar(chains: usize, n: u32, keep: f64, shifts: f64) -> Scalar {
        let mut state = 1;
        let mut scalar = Scalar::default();
        for i in 0..chains {
            let shift = if i % 2 == 0 { shifts } else { 0.0 };
            scalar.add(chain(&mut state, 4, n, keep, shift).into_iter(), n);
        }
        scalar
    }

    #[test]
    fn independent_values_have_rhat_1_and_count_fully() {
        let s = scalar(1000, 100, 0.0, 0.0);
        let (rhat, ess) = (s.rhat().unwrap(), s.ess().unwrap());
        assert!((rhat - 1.0).abs() < 2e-3, "{rhat}");
        // The variance of 1000 chain means is known to one part in 22.
        assert!((ess / 400_000.0 - 1.0).abs() < 5.0 / 22.0, "{ess}");
    }

    #[test]
    fn sticky_chains_count_less() {
        // |normal / 2| > keep has probability 0.1: values live for 10 records, and count as one
        // over 19 (2 / p - 1).
        let s = scalar(1000, 400, 0.822_427, 0.0);
        let ess = s.ess().unwrap();
        assert!(
            (ess / (1_600_000.0 / 19.0) - 1.0).abs() < 5.0 / 22.0,
            "{ess}"
        );
        let rhat = s.rhat().unwrap();
        // R-hat^2 - 1 is the number of records that count as one over those of a segment.
        assert!((rhat * rhat - 1.0 - 19.0 / 400.0).abs() < 0.01, "{rhat}");
    }

    #[test]
    fn chains_in_different_places_are_found_out() {
        let s = scalar(1000, 100, 0.0, 1.0);
        let rhat = s.rhat().unwrap();
        assert!((rhat - 1.25f64.sqrt()).abs() < 0.01, "{rhat}");
        assert!(s.ess().unwrap() < 6000.0);
        // Not one of them moves.
        let mut stuck = Scalar::default();
        stuck.add([(4.0, 4.0); 2].into_iter(), 4);
        stuck.add([(8.0, 16.0); 2].into_iter(), 4);
        assert_eq!(stuck.rhat(), Some(f64::INFINITY));
    }

    #[test]
    fn too_little_is_told_as_such() {
        assert_eq!(scalar(1000, 3, 0.0, 0.0).rhat(), None);
        assert_eq!(scalar(1, 100, 0.0, 0.0).ess(), None);
        let mut constant = Scalar::default();
        constant.add([(4.0, 4.0); 2].into_iter(), 4);
        constant.add([(4.0, 4.0); 2].into_iter(), 4);
        assert_eq!(constant.rhat(), Some(0.75f64.sqrt()));
    }
}
