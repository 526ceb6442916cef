//! More threads against one: chains of their own, on one scene and one film, as in a render.

use super::bench::{Bench, ROUNDS};
use super::report::{Spread, ThreadFigures};
use super::work::Work;
use crate::simd::f32x8;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Numbers of threads to compare: powers of two, and `most`.
pub fn thread_counts(most: usize) -> Vec<usize> {
    let powers = std::iter::successors(Some(1), |n| Some(2 * n));
    powers.take_while(|n| *n < most).chain([most]).collect()
}

/// Throughput at eight lanes of 1, 2, 4 ... threads, up to all of the pool, in rounds in which
/// every count has its time.
pub(super) fn compare(bench: &Bench, pool: &ThreadPool) -> Vec<ThreadFigures> {
    let most = pool.current_num_threads();
    let works: Vec<Mutex<Work<f32x8>>> = pool.install(|| {
        let numbers = (0..most).into_par_iter();
        numbers
            .map(|number| Mutex::new(Work::new(bench, number, most)))
            .collect()
    });
    let counts = thread_counts(most);
    let time = bench.time / ROUNDS as u32;
    rate(bench, pool, &works, time);
    // `[round][count]`
    let rounds: Vec<Vec<f64>> = (0..ROUNDS)
        .map(|_| {
            let rates = counts.iter().map(|n| rate(bench, pool, &works[..*n], time));
            rates.collect()
        })
        .collect();
    (counts.iter().enumerate())
        .map(|(i, &threads)| ThreadFigures {
            threads,
            mutations_per_second: Spread::of(rounds.iter().map(|r| r[i])),
            speed_up: Spread::of(rounds.iter().map(|r| r[i] / r[0])),
        })
        .collect()
}

/// Mutations a second of as many threads as there are `works`, over at least `time`.
fn rate(bench: &Bench, pool: &ThreadPool, works: &[Mutex<Work<f32x8>>], time: Duration) -> f64 {
    let rates = pool.broadcast(|context| {
        let Some(work) = works.get(context.index()) else {
            return 0.0;
        };
        // A thread that panicked has ended the measurement.
        let mut work = work.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let start = Instant::now();
        let mut mutations = 0;
        loop {
            mutations += work.turns(bench, 1).mutations;
            if start.elapsed() >= time {
                return mutations as f64 / start.elapsed().as_secs_f64();
            }
        }
    });
    rates.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_threads() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(2), [1, 2]);
        assert_eq!(thread_counts(8), [1, 2, 4, 8]);
        assert_eq!(thread_counts(12), [1, 2, 4, 8, 12]);
    }
}
