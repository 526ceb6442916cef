//! A render by samples and chains as they have been chosen.

use super::model::Choice;
use super::start::{finish_bootstrap, method_of};
use crate::chain::bootstrap::Bootstrap;
use crate::checkpoint::{Malformed, Reader};
use crate::integrate::chains::{self, mutations};
use crate::integrate::sampled::{self, Sampling};
use crate::integrate::{Render, Run, Settings};
use crate::simd::Lanes;
use crate::simd::rng::Purpose;
use crate::transport::bidirectional::BidirectionalLayout;
use crate::transport::evaluate::UnidirectionalLayout;
use std::time::Instant;

/// What there is to spend, in rays: as many as the mutations per pixel that were asked for would
/// trace.
#[derive(Clone, Copy)]
pub(super) struct Budget {
    /// Rays of a mutation of mmlt.
    pub usual: f64,
    /// Rays that have been traced already.
    pub spent: u64,
    /// Mutations per pixel that there is time for; infinite where time is no limit.
    pub affordable: f64,
}

impl Budget {
    /// What a pilot leaves that has traced so many rays, if a ray goes on taking as long.
    pub fn after(run: &Run, usual: f64, spent: u64) -> Self {
        let affordable = run.settings.time.map_or(f64::INFINITY, |limit| {
            let taken = run.start.elapsed().as_secs_f64().max(1e-6);
            let rays = spent as f64 / taken * limit.as_secs_f64();
            rays / (mutations(run, 1) * usual.max(1.0))
        });
        Self {
            usual,
            spent,
            affordable,
        }
    }
}

/// How much of what.
pub(super) struct Effort {
    /// Per pixel.
    pub samples: u64,
    /// In all.
    pub mutations: f64,
}

/// Fewest passes of samples that chains have beside them, also in a render that time ends: errors
/// are told from two halves.
const PASSES: f64 = 4.0;

impl Effort {
    pub fn of(run: &Run, choice: &Choice, budget: Budget) -> Self {
        let area = mutations(run, 1);
        let rays = run.settings.mutations_per_pixel as f64 * budget.usual;
        // The pilot counts as spent, but at most half of the budget: small budgets get a picture.
        let rays = (rays - budget.spent as f64 / area).max(0.5 * rays);
        let [of_sample, of_mutation] = choice.rays;
        let samples = rays * choice.part() / of_sample.max(1.0);
        let wanted = run.settings.mutations_per_pixel as f64;
        // Samples come in proportion: of those of a render that time ends only a part is made.
        let passes = PASSES * (wanted / budget.affordable).max(1.0);
        let samples = match choice.has_chains() {
            true => samples.max(passes.min(0.5 * rays / of_sample)),
            false => samples,
        };
        let samples = samples.round().clamp(1.0, f64::from(u32::MAX));
        let left = (rays - samples * of_sample).max(0.1 * rays);
        Self {
            samples: samples as u64,
            mutations: (left / of_mutation * area).ceil(),
        }
    }
}

/// Renders. `begun` are bootstraps of all depths that have decided about the choice, or none.
pub(super) fn march<L: Lanes>(
    run: &Run,
    choice: &Choice,
    budget: Budget,
    begun: Vec<Bootstrap>,
    start: Instant,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let effort = Effort::of(run, choice, budget);
    if choice.forward {
        return forward::<L>(run, effort.samples, start, from);
    }
    let kept = choice.bounds();
    let layout = BidirectionalLayout::sharing(run.world, &kept);
    let method = sampled::Method {
        name: "auto",
        purpose: Purpose::Bidirectional,
        layout: &layout.at,
        splats: layout.splats() > 0,
        evaluate: &|samples, n, paths| {
            (run.world).evaluate_bidirectional::<L>(&layout, samples, n, paths);
        },
        collect: &|_, _| {},
    };
    if choice.has_chains() {
        let chains = method_of(run, &kept);
        let mut sampling = Sampling::new::<L>(run, &method, effort.samples);
        let has_samples = !layout.strategies().is_empty();
        let beside = has_samples.then_some(&mut sampling);
        if !from.is_empty() {
            return chains::resumed::<L>(run, &chains, effort.mutations, beside, from);
        }
        let ready = finish_bootstrap::<L>(run, &chains, begun, effort.mutations, start);
        return chains::together::<L>(run, &chains, ready, effort.mutations, beside);
    }
    by_samples::<L>(run, &method, effort.samples, start, from)
}

/// The same by paths from the camera alone.
fn forward<L: Lanes>(
    run: &Run,
    samples: u64,
    start: Instant,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let layout = UnidirectionalLayout::new(&run.world.plan, run.settings.max_depth);
    let method = sampled::Method {
        name: "auto",
        purpose: Purpose::PathTracer,
        layout: layout.dimensions(),
        splats: false,
        evaluate: &|samples, n, paths| {
            (run.world).evaluate_unidirectional::<L>(&layout, samples, n, paths);
        },
        collect: &|_, _| {},
    };
    by_samples::<L>(run, &method, samples, start, from)
}

fn by_samples<L: Lanes>(
    run: &Run,
    method: &sampled::Method,
    samples: u64,
    start: Instant,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let settings = Settings {
        samples_per_pixel: samples,
        ..run.settings.clone()
    };
    let run = Run {
        settings: &settings,
        ..*run
    };
    let bootstrap_seconds = start.elapsed().as_secs_f64();
    let mut render = sampled::render::<L>(&run, method, from)?.render;
    render.stats.bootstrap_seconds = bootstrap_seconds;
    Ok(render)
}
