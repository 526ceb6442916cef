//! Eight lanes against one, on one thread: the same chains make the same mutations, so that nothing
//! differs but the width.

use super::bench::{Bench, ROUNDS};
use super::report::{LaneFigures, Rates, Spread, StageFigures};
use super::work::{Taken, Work};
use crate::simd::f32x8;
use crate::transport::clock::{Spent, Stage};

/// One round of both widths.
#[derive(Clone, Copy)]
struct Round {
    eight: Taken,
    one: Taken,
}

struct Pair {
    eight: Work<f32x8>,
    one: Work<f32>,
}

impl Pair {
    /// Rounds of the same turns for both, which take turns at going first.
    fn rounds(&mut self, bench: &Bench, turns: u64, rounds: usize) -> Vec<Round> {
        (0..rounds)
            .map(|round| {
                if round % 2 == 0 {
                    let eight = self.eight.turns(bench, turns);
                    let one = self.one.turns(bench, turns);
                    Round { eight, one }
                } else {
                    let one = self.one.turns(bench, turns);
                    let eight = self.eight.turns(bench, turns);
                    Round { eight, one }
                }
            })
            .collect()
    }
}

/// The whole step with the clock off; then its stages, and groups of them, with the clock on.
pub(super) fn compare(bench: &Bench) -> (LaneFigures, Vec<StageFigures>, Vec<StageFigures>) {
    let mut pair = Pair {
        eight: Work::new(bench, 0, 1),
        one: Work::new(bench, 0, 1),
    };
    // Twice: the first turns fetch the scene and the film.
    pair.rounds(bench, 2, 1);
    let seconds: f64 = (pair.rounds(bench, 2, 1).iter())
        .map(|r| (r.eight.seconds + r.one.seconds) / 2.0)
        .sum();
    let budget = 2.0 * bench.time.as_secs_f64() / ROUNDS as f64;
    let turns = ((budget / seconds.max(1e-9)).round() as u64).max(1);
    let whole = pair.rounds(bench, turns, ROUNDS);
    pair.eight.set_clock(true);
    pair.one.set_clock(true);
    let clocked = pair.rounds(bench, turns, ROUNDS);
    (figures(&whole), stages(&clocked), groups(&clocked))
}

fn figures(rounds: &[Round]) -> LaneFigures {
    let rates = |lanes: u32, of: fn(&Round) -> Taken| {
        let per_second = |count: fn(&Taken) -> u64| {
            Spread::of(rounds.iter().map(of).map(|t| count(&t) as f64 / t.seconds))
        };
        let mutations_per_second = per_second(|t| t.mutations);
        Rates {
            lanes,
            ns_per_mutation: 1e9 / mutations_per_second.median,
            mutations_per_second,
            rays_per_second: per_second(|t| t.rays),
        }
    };
    let (rays, mutations) = rounds.iter().fold((0, 0), |(rays, mutations), r| {
        (rays + r.eight.rays, mutations + r.eight.mutations)
    });
    LaneFigures {
        eight: rates(8, |r| r.eight),
        one: rates(1, |r| r.one),
        gain: Spread::of(rounds.iter().map(|r| r.one.seconds / r.eight.seconds)),
        rays_per_mutation: rays as f64 / mutations as f64,
    }
}

fn stages(rounds: &[Round]) -> Vec<StageFigures> {
    (Stage::ALL.iter())
        .map(|stage| {
            let mut figures = group(rounds, &stage.name().to_lowercase(), |s| s == *stage);
            figures.mean_live_lanes = live_lanes(rounds, *stage);
            figures
        })
        .collect()
}

fn groups(rounds: &[Round]) -> Vec<StageFigures> {
    let traversal = |s| matches!(s, Stage::Trace | Stage::Occlusion);
    vec![
        group(rounds, "total", |_| true),
        group(rounds, "traversal", traversal),
        group(rounds, "rest", |s| !traversal(s)),
        group(rounds, "accept_and_splat", |s| {
            matches!(s, Stage::Accept | Stage::Splat)
        }),
    ]
}

/// Some stages together: the sum of their medians, so that shares add up to 1.
fn group(rounds: &[Round], name: &str, belongs: impl Fn(Stage) -> bool) -> StageFigures {
    let (mut part, mut whole) = ([0.0; 2], [0.0; 2]);
    for stage in Stage::ALL {
        let ns = nanoseconds(rounds, stage);
        for width in 0..2 {
            whole[width] += ns[width];
            part[width] += if belongs(stage) { ns[width] } else { 0.0 };
        }
    }
    StageFigures {
        name: name.into(),
        share: part[0] / whole[0],
        share_one_lane: part[1] / whole[1],
        ns_per_mutation: part[0],
        ns_per_mutation_one_lane: part[1],
        gain: (part[0] > 0.0).then(|| part[1] / part[0]),
        mean_live_lanes: None,
    }
}

/// Of a stage, per mutation, at eight lanes and at one: medians over the rounds.
fn nanoseconds(rounds: &[Round], stage: Stage) -> [f64; 2] {
    let median = |of: fn(&Round) -> Taken| {
        let ns = |t: Taken| t.spent[stage as usize].seconds * 1e9 / t.mutations as f64;
        Spread::of(rounds.iter().map(of).map(ns)).median
    };
    [median(|r| r.eight), median(|r| r.one)]
}

/// Lanes of eight that carry a path; `None` where the clock does not count, or paths go one by one.
fn live_lanes(rounds: &[Round], stage: Stage) -> Option<f64> {
    let mut sum = Spent::default();
    for round in rounds {
        sum.merge(&round.eight.spent[stage as usize]);
    }
    let counted = sum.slots > 0 && stage != Stage::Splat;
    counted.then(|| sum.items as f64 / sum.slots as f64 * 8.0)
}
