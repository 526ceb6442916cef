//! Integrators: schedules over the parts below. [`render`] is the whole of Phalanx in one call;
//! [`measure`] says how fast it is.
//!
//! A render by chains (`chains.rs`: `mmlt`, `pssmlt`, and `auto`, which has samples beside them):
//!
//! 1. `method.rs`: the path samplers of the integrator, an integral each.
//! 2. `bootstraps.rs`: uniform paths of every sampler, round by round. They give the integrals and
//!    the first states of chains.
//! 3. `schedule.rs`: `chain_budgets` shares out chains and mutations in proportion to integrals.
//! 4. `tuning.rs`: chains of its own find each budget's small-step size and how often to make large
//!    steps.
//! 5. `schedule.rs`: `March` starts the batches and has threads march them in rounds. Between them
//!    it reports progress and asks whether to stop.
//! 6. `normalisation.rs`: what makes sums of splats radiance: an integral over the mutations made.
//!    The film resolves with these scales.
//! 7. `error` and `mixing_check.rs`: how far off the picture is, and whether chains have seen all
//!    light.
//! 8. `scale.rs`: from radiance to the film's units, as the last step of every [`render`].
//!
//! A render by independent samples (`sampled.rs`: `pt`, `lt`, `bdpt`) goes over the picture pass by
//! pass (`grid.rs`) instead of 1 to 6.

mod auto;
mod bdpt;
mod bootstraps;
mod chains;
mod depth_stats;
mod error;
mod failure;
mod grid;
mod lt;
pub mod measure;
mod method;
mod mixing_check;
mod mmlt;
mod needs;
mod normalisation;
mod pssmlt;
mod pt;
mod rerun;
mod result;
mod run;
mod sampled;
mod scale;
mod schedule;
mod settings;
mod shares;
mod tuning;

pub use self::depth_stats::{CrossCheck, DepthStats, MIXED};
pub use self::error::{Tiles, standard_errors};
pub use self::failure::RenderError;
pub use self::needs::{Need, Needs};
pub use self::rerun::{Visit, Whose, rerun};
pub use self::result::{Render, Stats, StrategyPictures};
pub use self::run::{EndedBy, Observer, Phase, Silent, peak_rss_bytes};
pub use self::settings::{Settings, StrategyChoice, Width, check, worker_threads};
pub use self::shares::{Share, Shares};

use self::run::{DARK, ROUND, Run, black_reason, per_second};
use self::scale::{bring_to_scale, mixed_deviation};
use std::time::Instant;

use crate::scene::{IntegratorKind, Scene};
use crate::simd::{Lanes, f32x8};
use crate::transport::World;

/// Renders a scene.
///
/// # Errors
/// Settings out of range, and thread pools that cannot be had.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Render, RenderError> {
    render_by(scene, settings, observer, &|run| match settings.lanes {
        Width::Eight => integrate::<f32x8>(run),
        Width::One => integrate::<f32>(run),
    })
}

/// Paths traced eight at a time, whatever the settings say. Unit tests that call this instead of
/// [`render`] do without kernels of the others, which take minutes to compile.
///
/// # Errors
/// Those of [`render`].
#[cfg(test)]
pub(crate) fn trace_paths(scene: &Scene, settings: &Settings) -> Result<Render, RenderError> {
    render_by(scene, settings, &Silent, &pt::render::<f32x8>)
}

/// All of a render but its integrator.
fn render_by(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
    integrate: &(dyn Fn(&Run) -> Render + Sync),
) -> Result<Render, RenderError> {
    let start = Instant::now();
    check(settings)?;
    let pool = pool(settings.threads)?;
    let primitives = (scene.triangles.len() + scene.spheres.len()).max(1) as u64;
    observer.progress(Phase::Build, 0, primitives);
    let world = World::with_forced(scene, settings.max_depth, &settings.forced);
    if settings.integrator == IntegratorKind::Lt && !world.camera.connects() {
        return Err(RenderError::Settings(
            "light tracing joins light to the camera, and nothing can be joined to a realistic camera; use pt, bdpt, pssmlt, mmlt or auto"
                .into(),
        ));
    }
    observer.progress(Phase::Build, primitives, primitives);
    let run = Run {
        scene,
        world: &world,
        settings,
        observer,
        start,
    };
    let mut render = pool.install(|| integrate(&run));
    let scale = scene.film.scale;
    let parts = (render.strategies.iter_mut()).flat_map(|s| [&mut s.weighted, &mut s.unweighted]);
    let colour = scene.film.colour.as_ref();
    let beyond = bring_to_scale(&mut render.pixels, scale, colour);
    parts.for_each(|pixels| _ = bring_to_scale(pixels, scale, colour));
    if let Some(deviation) = &mut render.deviation {
        _ = bring_to_scale(deviation, scale, None);
        if let Some(m) = colour {
            deviation
                .iter_mut()
                .for_each(|d| *d = mixed_deviation(m, *d));
        }
    }
    if beyond > 0 {
        render.warnings.push(format!(
            "{beyond} values of the picture are beyond what a 32-bit float holds and were set to the largest, {:.1e}",
            f32::MAX
        ));
    }
    render.stats.relative_error = render.stats.relmse.map(f64::sqrt);
    if let Some(tiles) = &mut render.stats.tiles {
        tiles.scale(f64::from(scale));
    }
    let stats = &mut render.stats;
    stats.seed = settings.seed;
    stats.lanes = settings.lanes.lanes();
    stats.threads = pool.current_num_threads();
    stats.max_depth = settings.max_depth;
    stats.width = render.width;
    stats.height = render.height;
    stats.build_seconds = world.tracer.stats().build_time.as_secs_f64();
    stats.total_seconds = start.elapsed().as_secs_f64();
    stats.rays_per_second = per_second(stats.rays, stats.render_seconds + stats.bootstrap_seconds);
    stats.peak_rss_bytes = peak_rss_bytes();
    let dark = settings.target_error.is_some() && stats.b * f64::from(scale) < DARK;
    if dark && stats.b > 0.0 {
        render.warnings.push(format!(
            "the picture is dark (mean radiance {:.2e}): channels below 0.1 are judged by absolute error, so its relative error means \
             little; the film's scale can brighten it",
            stats.b * f64::from(scale)
        ));
    }
    if stats.rejected_nonfinite > 0 {
        render.warnings.push(format!(
            "{} contributions were not finite or negative and were left out",
            stats.rejected_nonfinite
        ));
    }
    Ok(render)
}

/// What a pilot of [`IntegratorKind::Auto`] with these settings decides, as a render with them
/// does. `world` must be of `scene` and for `settings.max_depth`.
///
/// # Errors
/// Settings out of range, and thread pools that cannot be had.
pub fn shares(scene: &Scene, world: &World, settings: &Settings) -> Result<Shares, RenderError> {
    check(settings)?;
    let run = Run {
        scene,
        world,
        settings,
        observer: &Silent,
        start: Instant::now(),
    };
    Ok(pool(settings.threads)?.install(|| auto::shares::<f32x8>(&run)))
}

/// Every integrator, by name.
fn integrate<L: Lanes>(run: &Run) -> Render {
    match run.settings.integrator {
        IntegratorKind::Auto => auto::render::<L>(run),
        IntegratorKind::Mmlt => mmlt::render::<L>(run),
        IntegratorKind::Pssmlt(sampler) => pssmlt::render::<L>(run, sampler),
        IntegratorKind::Pt => pt::render::<L>(run),
        IntegratorKind::Lt => lt::render::<L>(run),
        IntegratorKind::Bdpt => bdpt::render::<L>(run),
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, RenderError> {
    let threads = worker_threads(threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RenderError::Threads { threads, source })
}
