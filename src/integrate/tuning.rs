//! Tuning of proposals between bootstrap and render, by chains of its own. It goes in rounds, so
//! that progress is shown and stops are seen soon.

use super::schedule::ChainBudget;
use super::{EndedBy, Run};
use crate::chain::bootstrap::Bootstrap;
use crate::chain::tune::{Tuner, chains};
use crate::simd::Lanes;
use rayon::prelude::*;

/// Steps of a round.
const STEPS: u32 = 8;

/// What tuning has come to.
pub(super) struct Tuned {
    /// Of the steps that it should have made.
    pub part: f64,
    /// What has cut it short.
    pub ended_by: Option<EndedBy>,
    pub rays: u64,
}

/// Mutations that tuning makes if all of so many samplers carry light.
pub(super) fn mutations(run: &Run, samplers: usize) -> u64 {
    let tune = run.settings.tune;
    let each = chains(tune, run.settings.bootstrap) as u64 * u64::from(tune.steps());
    each * samplers as u64
}

/// Tunes the proposals of all budgets, as the settings ask for. `ended` is asked whether to stop,
/// and by whom; proposals that are not tuned by then stay as they are. `progress` is told which
/// part of the tuning is done.
pub(super) fn tune<L: Lanes>(
    run: &Run,
    budgets: &mut [ChainBudget],
    bootstraps: &[Bootstrap],
    ended: &dyn Fn() -> Option<EndedBy>,
    mut progress: impl FnMut(f64),
) -> Tuned {
    let settings = run.settings;
    let steps = settings.tune.steps();
    let mut done = 0;
    let mut ended_by = if steps > 0 { ended() } else { None };
    let mut rays = 0;
    if steps > 0 && ended_by.is_none() {
        let start = |a: &ChainBudget| {
            let bootstrap = &bootstraps[a.index];
            let (seed, tune) = (settings.seed, settings.tune);
            Tuner::new::<L>(
                run.world,
                &a.sampler,
                bootstrap,
                seed,
                a.proposals,
                tune,
                a.iterations,
            )
        };
        let mut tuners: Vec<Tuner> = budgets.par_iter().map(start).collect();
        while done < steps && ended_by.is_none() {
            (tuners.par_iter_mut()).for_each(|tuner| tuner.advance::<L>(run.world, STEPS));
            done = (done + STEPS).min(steps);
            progress(f64::from(done) / f64::from(steps));
            ended_by = ended().filter(|_| done < steps);
        }
        let tuned = tuners.par_iter().map(Tuner::proposals);
        (budgets.par_iter_mut().zip(tuned)).for_each(|(a, proposals)| a.proposals = proposals);
        rays = tuners.iter().map(Tuner::rays).sum();
    }
    let part = if steps > 0 {
        f64::from(done) / f64::from(steps)
    } else {
        1.0
    };
    Tuned {
        part,
        ended_by,
        rays,
    }
}
