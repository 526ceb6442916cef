//! The bootstrap of all samplers, in rounds: however early it is stopped, every sampler has had
//! about as many paths as the others, and the picture has all its light.

use super::{EndedBy, ROUND, Settings};
use crate::chain::bootstrap::{Bootstrap, CHUNK};
use crate::simd::Lanes;
use crate::transport::{PathSampler, World};
use rayon::prelude::*;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// What the first round still gets after a stop: without all of it there is no picture to write. It
/// mostly takes a few milliseconds.
const GRACE: Duration = Duration::from_secs(2);
/// Shortest round aimed at: its end is a barrier.
const SHORTEST: Duration = Duration::from_millis(50);

/// The bootstraps of all samplers.
pub(super) struct Bootstraps {
    /// In their order; empty where no path can carry light.
    pub samplers: Vec<Bootstrap>,
    /// What has cut it short.
    pub ended_by: Option<EndedBy>,
}

impl Bootstraps {
    /// A part of the paths asked for.
    pub fn part(&self, wanted: u64) -> f64 {
        let least = self.samplers.iter().filter(|b| b.is_short());
        let least = least.map(Bootstrap::len).min();
        least.map_or(1.0, |n| n as f64 / wanted as f64)
    }

    /// A sampler that could carry light has had no path: nothing is known of the whole picture.
    pub fn is_void(&self) -> bool {
        self.samplers.iter().any(|b| b.is_empty() && b.is_short())
    }
}

/// Runs the bootstraps. `ended` is asked whether to stop, and by whom; `progress` is told paths
/// done and wanted.
pub(super) fn bootstraps<L: Lanes>(
    world: &World,
    samplers: &[PathSampler],
    settings: &Settings,
    ended: &(dyn Fn() -> Option<EndedBy> + Sync),
    progress: impl FnMut(u64, u64),
) -> Bootstraps {
    let all = fresh(samplers, settings.bootstrap);
    complete::<L>(world, samplers, settings, all, ended, progress)
}

/// Bootstraps of so many paths each that have none yet.
pub(super) fn fresh(samplers: &[PathSampler], wanted: u64) -> Vec<Bootstrap> {
    let paths = |sampler: &PathSampler| if sampler.carries_light() { wanted } else { 0 };
    (samplers.iter())
        .map(|sampler| Bootstrap::new(paths(sampler)))
        .collect()
}

/// Completes bootstraps that have been begun, all alike.
pub(super) fn complete<L: Lanes>(
    world: &World,
    samplers: &[PathSampler],
    settings: &Settings,
    mut all: Vec<Bootstrap>,
    ended: &(dyn Fn() -> Option<EndedBy> + Sync),
    mut progress: impl FnMut(u64, u64),
) -> Bootstraps {
    let wanted = settings.bootstrap;
    let total = wanted * all.len() as u64;
    let stopped: OnceLock<(EndedBy, Instant)> = OnceLock::new();
    let begun = all.iter().map(Bootstrap::len).max().unwrap_or(0);
    let (mut done, mut step) = (begun, CHUNK);
    while done < wanted {
        let begin = Instant::now();
        let first = done == 0;
        let cancelled = || {
            if stopped.get().is_none()
                && let Some(by) = ended()
            {
                stopped.get_or_init(|| (by, Instant::now()));
            }
            let since = stopped.get().map(|(_, since)| since);
            since.is_some_and(|since| !first || since.elapsed() >= GRACE)
        };
        let until = (done + step).min(wanted);
        (all.par_iter_mut().zip(samplers)).for_each(|(bootstrap, sampler)| {
            bootstrap.extend::<L>(world, sampler, settings.seed, until, &cancelled);
        });
        done = until;
        progress(done * all.len() as u64, total);
        cancelled();
        if stopped.get().is_some() {
            break;
        }
        let ratio = ROUND.as_secs_f64() / begin.elapsed().max(SHORTEST).as_secs_f64();
        step = ((step as f64 * ratio) as u64)
            .clamp(CHUNK, 16 * step)
            .next_multiple_of(CHUNK);
    }
    all.iter_mut().for_each(Bootstrap::settle);
    let short = all.iter().any(Bootstrap::is_short);
    Bootstraps {
        ended_by: stopped.get().map(|(by, _)| *by).filter(|_| short),
        samplers: all,
    }
}
