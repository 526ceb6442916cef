//! What it costs that a render knows its own error: the same chains, watched and splatted to a film
//! that is judged, and neither.

use super::bench::{Bench, ROUNDS};
use super::report::Spread;
use super::work::Work;
use crate::simd::f32x8;

/// Seconds with over seconds without, round by round, at eight lanes on one thread.
pub(super) fn compare(bench: &Bench) -> Spread {
    let mut plain: Work<f32x8> = Work::new(bench, 0, 1);
    let mut judged: Work<f32x8> = Work::judged(bench);
    // The first turns fetch the scene and the films.
    judged.turns(bench, 2);
    let seconds = plain.turns(bench, 2).seconds.max(1e-9);
    // Short turns and many rounds: the machine is noisier than the difference is large.
    let rounds = ROUNDS * 5;
    let turns = (2.0 * bench.time.as_secs_f64() / rounds as f64 / seconds).round();
    let turns = (turns as u64).max(1);
    Spread::of((0..rounds).map(|round| {
        let mut time = |first: bool| {
            let work = if first { &mut judged } else { &mut plain };
            work.turns(bench, turns).seconds
        };
        let (with, without) = if round % 2 == 0 {
            let with = time(true);
            (with, time(false))
        } else {
            let without = time(false);
            (time(true), without)
        };
        with / without
    }))
}
