//! The chains of a decision: their samplers, and a bootstrap that is as long as they need.
//!
//! Chains that start from one path are copies of each other until a large step sets them free: what
//! the bootstrap found by luck is then in the picture as often as there are copies. Paths are added
//! so that each depth finds as many different ones as it has chains, unless that takes more than a
//! part of the whole budget. Seeds are different paths by their effective number,
//! `(sum T)^2 / sum T^2` of their targets `T`: a path with half of the light is not worth a
//! thousand.

use crate::chain::bootstrap::{Bootstrap, CHUNK};
use crate::integrate::bootstraps::{complete, fresh};
use crate::integrate::chains::{Ready, ready};
use crate::integrate::method::Method;
use crate::integrate::{Phase, Run, Settings};
use crate::plan::DepthPlan;
use crate::simd::Lanes;
use crate::transport::PathSampler;
use std::time::Instant;

/// Most of the budget that bootstrap paths may take beyond those asked for.
const PART: f64 = 0.15;

/// The samplers of depths of which something is left to chains, with the most that samples keep at
/// each.
pub(super) fn method_of(run: &Run, kept: &[f32]) -> Method {
    let depths = run.world.plan.depths.iter().zip(kept);
    let left = depths.filter(|(_, kept)| kept.is_finite());
    let sampler = |(plan, kept): (&DepthPlan, &f32)| {
        PathSampler::Multiplexed(DepthPlan {
            kept: *kept,
            ..plan.clone()
        })
    };
    Method {
        name: "auto",
        samplers: left.map(sampler).collect(),
        combined: false,
    }
}

/// Completes the bootstraps of depths that have chains, which make so many mutations in all.
/// `begun` are those of all depths.
pub(super) fn finish_bootstrap<L: Lanes>(
    run: &Run,
    method: &Method,
    begun: Vec<Bootstrap>,
    mutations: f64,
    start: Instant,
) -> Ready {
    let plans: Vec<&DepthPlan> = method.samplers.iter().filter_map(|s| s.plan()).collect();
    let whole: Vec<PathSampler> = (plans.iter())
        .map(|plan| PathSampler::from(&run.world.plan.depths[plan.depth as usize]))
        .collect();
    let mut begun = begun.into_iter().enumerate();
    let mut all: Vec<Bootstrap> = (plans.iter())
        .filter_map(|plan| begun.find(|(k, _)| *k == plan.depth as usize))
        .map(|(_, bootstrap)| bootstrap)
        .collect();
    if all.is_empty() {
        // A stop came before them.
        all = fresh(&whole, run.settings.bootstrap);
    }
    let progress = |done, total| run.observer.progress(Phase::Bootstrap, done, total);
    let ended = || ready(run);
    // Decided once, by paths that do not count for the estimate: a bootstrap that went on until it
    // had seen enough would end too early where it has missed the brightest paths.
    let most = (PART * mutations / whole.len().max(1) as f64) as u64;
    let asked = run.settings.bootstrap;
    let until = match all.iter().all(|b| b.len().is_multiple_of(CHUNK)) {
        true => needed(run, &all).min(most).min(MOST) / CHUNK * CHUNK,
        // All that were asked for have been made.
        false => 0,
    };
    let first = match until > asked {
        true => asked.next_multiple_of(CHUNK),
        false => asked,
    };
    all.iter_mut().for_each(Bootstrap::decide);
    let up_to = |count: u64, mut begun: Vec<Bootstrap>| {
        let settings = Settings {
            bootstrap: count,
            ..run.settings.clone()
        };
        begun.iter_mut().for_each(|b| b.want(count));
        complete::<L>(run.world, &whole, &settings, begun, &ended, progress)
    };
    let mut all = up_to(first, all);
    let mut len = first;
    while all.ended_by.is_none() && len < until {
        // The next round takes as long as all before.
        let limit = run.settings.time.map(|limit| limit.mul_f64(0.5 * PART));
        if limit.is_some_and(|limit| run.start.elapsed() > limit) {
            break;
        }
        len = (2 * len).min(until);
        all = up_to(len, all.samplers);
    }
    for (bootstrap, plan) in all.samplers.iter_mut().zip(&plans) {
        if plan.kept > 0.0 {
            let kept = plan.kept * plan.strategies.len() as f32;
            bootstrap.leave(|target| target / (target + kept));
            bootstrap.settle();
        }
    }
    Ready::new(run, all, start)
}

/// Bootstrap paths of a depth that memory has room for, four bytes each.
const MOST: u64 = 1 << 24;

/// How many paths it takes until each depth has found as many different ones as it has chains, as
/// far as the paths so far tell.
fn needed(run: &Run, all: &[Bootstrap]) -> u64 {
    let light: f64 = all.iter().map(|b| b.estimate.mean()).sum();
    let of = |b: &Bootstrap| {
        let found = b.estimate.bootstrap;
        let chains = run.settings.chains as f64 * found.mean() / light;
        // As many as one of these paths is worth.
        let each = found.sum.powi(2) / found.sum_squares / found.count as f64;
        (found.sum > 0.0).then_some((chains / each) as u64)
    };
    all.iter().filter_map(of).max().unwrap_or(0)
}
