//! How fast this machine renders a scene, and where the time goes: what eight lanes buy over one,
//! what threads buy, what each stage of a step takes, and how full the lanes are.
//!
//! What is measured is the step that renders are made of: batches of chains of every sampler
//! (`work`), visited in proportion to the light each sampler carries. Whatever is compared takes
//! turns in short rounds, so that a machine whose speed drifts is equally fast for both sides;
//! figures are medians over the rounds. The stage clock runs only where stages are measured.

mod bench;
mod judged;
mod lanes;
mod machine;
mod report;
mod threads;
mod work;

use self::bench::{Bench, ROUNDS};
pub use self::machine::Machine;
pub use self::report::{
    BootstrapFigures, LaneFigures, Rates, SceneFigures, Spread, StageFigures, ThreadFigures,
    ThroughputReport,
};
pub use self::threads::thread_counts;

use super::bootstraps::bootstraps;
use super::method::Method;
use super::schedule::{LARGEST_BATCH, chosen};
use super::{RenderError, Settings, check, check_paths, mmlt, per_second, pool, pssmlt};
use crate::chain::bootstrap::Bootstrap;
use crate::chain::counts::MAX_CHAINS_PER_DEPTH;
use crate::film::{FilterTable, Half, SplatFilm};
use crate::scene::{IntegratorKind, Scene};
use crate::simd::f32x8;
use crate::transport::World;
use std::time::{Duration, Instant};

/// Bound of the weight that measurements splat, more than an hour of any machine: the picture is
/// thrown away.
const MOST_WEIGHT: f64 = 1e15;

/// All layers alike.
const HALF: Half = Half {
    scale: 1.0,
    part: 0.5,
};

/// Why there is nothing to measure.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A render could not start either.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Nothing in the scene carries light to the camera; why.
    #[error("{0}")]
    Dark(String),
}

/// Measures a scene. Of the settings, those of Metropolis integrators count; `settings.threads` is
/// the most threads, 0 for one per core; `settings.batch` the chains of a batch. `time` goes to
/// each side of each comparison.
///
/// # Errors
/// Settings out of range or of an integrator that mutates nothing, thread pools that cannot be had,
/// and scenes without light.
pub fn measure(
    scene: &Scene,
    settings: &Settings,
    time: Duration,
) -> Result<ThroughputReport, MeasureError> {
    check(settings)?;
    let pool = pool(settings.threads)?;
    let chains = settings.batch.unwrap_or(LARGEST_BATCH);
    let threads = pool.current_num_threads();
    if chains * threads > MAX_CHAINS_PER_DEPTH {
        let message = format!(
            "{threads} batches of {chains} chains, one a thread, are more than {MAX_CHAINS_PER_DEPTH} chains"
        );
        return Err(RenderError::Settings(message).into());
    }
    let world = World::with_forced(scene, settings.max_depth, &settings.forced);
    check_paths(&world, settings.integrator)?;
    let method = method(&world, settings)?;
    let (bootstraps, bootstrap) = pool.install(|| run_bootstrap(&world, &method, settings));
    if bootstraps.iter().all(|b| b.estimate.mean() <= 0.0) {
        return Err(dark(&world, settings));
    }
    let samplers = (method.samplers.iter().zip(&bootstraps))
        .map(|(sampler, bootstrap)| chosen(settings, sampler, bootstrap))
        .collect();
    let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
    let layers = Method::layers(method.samplers.len(), method.combined);
    let bench = Bench {
        world: &world,
        film: SplatFilm::new(filter.clone(), layers, MOST_WEIGHT),
        judged: SplatFilm::judged(filter, MOST_WEIGHT, vec![HALF; layers]),
        crop: scene.film.crop,
        proposals: settings.proposal_distribution(),
        bootstraps,
        samplers,
        independent: method.independent(),
        seed: settings.seed,
        chains,
        time,
    };
    let (lanes, stages, groups) = lanes::compare(&bench);
    let error_estimate = judged::compare(&bench);
    Ok(ThroughputReport {
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::this(),
        integrator: method.name,
        seed: settings.seed,
        max_depth: settings.max_depth,
        chains_per_batch: chains,
        seconds_per_measurement: time.as_secs_f64(),
        rounds: ROUNDS,
        scene: SceneFigures::of(scene, &world),
        bootstrap,
        lanes,
        stages,
        groups,
        error_estimate,
        threads: threads::compare(&bench, &pool),
    })
}

fn method(world: &World, settings: &Settings) -> Result<Method, RenderError> {
    match settings.integrator {
        IntegratorKind::Auto | IntegratorKind::Mmlt => Ok(mmlt::method(&world.plan)),
        IntegratorKind::Pssmlt(sampler) => Ok(pssmlt::method(world, settings.max_depth, sampler)),
        other => Err(RenderError::Settings(format!(
            "{} mutates nothing: mutations of mmlt or pssmlt can be measured",
            other.name()
        ))),
    }
}

/// The bootstrap of every sampler, on the threads of this pool.
fn run_bootstrap(
    world: &World,
    method: &Method,
    settings: &Settings,
) -> (Vec<Bootstrap>, BootstrapFigures) {
    let start = Instant::now();
    let all = bootstraps::<f32x8>(world, &method.samplers, settings, &|| None, |_, _| {}).samplers;
    let paths = all.iter().map(|b| b.estimate.bootstrap.count).sum();
    let rays = all.iter().map(|b| b.rays).sum();
    let seconds = start.elapsed().as_secs_f64();
    let figures = BootstrapFigures {
        threads: rayon::current_num_threads(),
        paths,
        rays,
        seconds,
        paths_per_second: per_second(paths, seconds),
        rays_per_second: per_second(rays, seconds),
    };
    (all, figures)
}

fn dark(world: &World, settings: &Settings) -> MeasureError {
    MeasureError::Dark(if world.is_unlit() {
        "the scene has no lights: there is nothing to measure".into()
    } else {
        format!(
            "none of the {} bootstrap paths per depth carries light to the camera: there is nothing to measure; more \
             bootstrap samples may find some",
            settings.bootstrap
        )
    })
}
