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
//! 7. `error`, `mixing_check.rs` and `chance.rs`: how far off the picture is, whether chains have
//!    seen all light, and what of it may be missing that only chance finds.
//! 8. `scale.rs`: from radiance to the film's units, as the last step of every [`render`].
//!
//! A render by independent samples (`sampled.rs`: `pt`, `lt`, `bdpt`) goes over the picture pass by
//! pass (`grid.rs`) instead of 1 to 6.
//!
//! Several processes make a render together (`team.rs`): the first does 1 to 4, and all march.
//! Between rounds, where somebody wants to see the whole, what each has made comes to the first
//! (`handed_over.rs`).

mod auto;
mod bdpt;
mod bootstraps;
mod chains;
mod chance;
mod depth_stats;
mod error;
mod failure;
mod grid;
mod handed_over;
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
mod saved;
mod scale;
mod schedule;
mod settings;
mod shard;
mod shares;
mod show;
mod so_far;
mod speckles;
mod state;
mod team;
mod tuning;

pub use self::chance::{ChanceStats, Hidden, hidden};
pub use self::depth_stats::{CrossCheck, DepthStats, MIXED};
pub use self::error::{Tiles, standard_errors};
pub use self::failure::RenderError;
pub use self::needs::{Need, Needs};
pub use self::rerun::{Visit, Whose, rerun};
pub use self::result::{Render, Stats, StrategyPictures};
pub use self::run::{EndedBy, Observer, Phase, Silent, peak_rss_bytes};
pub use self::saved::Checkpoint;
pub use self::settings::{Settings, StrategyChoice, Width, check, worker_threads};
pub use self::shard::Shard;
pub use self::shares::{Share, Shares};
pub use self::so_far::{SoFar, Wanted};
pub use self::speckles::{Speckle, Speckles};
pub use self::state::{Gathered, Made, State};
pub use self::team::{Alone, Team};

use self::run::{DARK, ROUND, Run, black_reason, per_second};
use self::scale::bring_to_scale;
use self::show::scale_deviation;
use self::team::Crew;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

use crate::checkpoint::{Malformed, Packed, Reader};
use crate::scene::{IntegratorKind, PathSamplerKind, Scene};
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
    go(scene, settings, &[], observer, &Alone)
}

/// Goes on with a render: to the same bits as if it had never been stopped, if the settings are
/// those that it was begun with. Threads, lanes and what ends it may be others. Samples go on to
/// any number of them. Chains, too; where that is more than at first, their film keeps the
/// precision that it was made with, which is higher than that of a film for so many, and the
/// tuning is that of the shorter render.
///
/// # Errors
/// Those of [`render`], and a state of another scene, picture, integrator or seed.
pub fn resume(
    scene: &Scene,
    settings: &Settings,
    state: &State,
    observer: &dyn Observer,
) -> Result<Render, RenderError> {
    go(scene, settings, &[state], observer, &Alone)
}

/// Renders a scene, or goes on from a state, together with other processes that call this for the
/// same scene with the same settings. The first one leads ([`Team`]); its observer and its state
/// count, and of the others whether they stop. The picture, which the first one has, is to the bit
/// that of one process.
///
/// # Errors
/// Those of [`resume`], and pictures of strategies, which are not added up. Where others would wait
/// for a process that cannot go on it calls [`Team::fail`] first.
pub fn together(
    scene: &Scene,
    settings: &Settings,
    state: Option<&State>,
    observer: &dyn Observer,
    team: &dyn Team,
) -> Result<Option<Render>, RenderError> {
    let render = go(scene, settings, state.as_slice(), observer, team)?;
    Ok(team.leads().then_some(render))
}

/// Adds up all shards of a render, in their order; each must have come to its end. The render is
/// that of one machine, to the bit, and can be gone on with. `settings` are those of any of them.
///
/// # Errors
/// Those of [`render`], and shards that are not all that there are of one render.
pub fn merge(
    scene: &Scene,
    settings: &Settings,
    shards: &[&State],
    observer: &dyn Observer,
) -> Result<Render, RenderError> {
    let settings = Settings {
        shard: None,
        ..settings.clone()
    };
    if shards.len() < 2 {
        let few = Malformed::new("one shard is not all that there are");
        return Err(few.into());
    }
    go(scene, &settings, shards, observer, &Alone)
}

fn go(
    scene: &Scene,
    settings: &Settings,
    states: &[&State],
    observer: &dyn Observer,
    team: &dyn Team,
) -> Result<Render, RenderError> {
    let crew = Crew::new(team);
    let begin: &Integrate = &|run, from| match settings.lanes {
        Width::Eight => integrate::<f32x8>(run, from),
        Width::One => integrate::<f32>(run, from),
    };
    let done = render_by(scene, settings, states, observer, &crew, begin);
    let Err(error) = &done else {
        return done;
    };
    if team.is_alone() {
        return done;
    }
    if !crew.told.load(Relaxed) {
        // The others wait to be told where to begin. Of all that fail alike the first one says so.
        let told = team.tell(Vec::new());
        if team.leads() {
            return done;
        }
        if told.is_empty() {
            return Ok(Render::nothing());
        }
    }
    team.fail(&error.to_string());
    done
}

/// Paths traced eight at a time, whatever the settings say. Unit tests that call this instead of
/// [`render`] do without kernels of the others, which take minutes to compile.
///
/// # Errors
/// Those of [`render`].
#[cfg(test)]
pub(crate) fn trace_paths(scene: &Scene, settings: &Settings) -> Result<Render, RenderError> {
    let (alone, begin) = (&team::ALONE, &pt::render::<f32x8>);
    render_by(scene, settings, &[], &Silent, alone, begin)
}

/// An integrator: begins a render, or goes on from its states.
type Integrate<'a> = dyn Fn(&Run, &mut [Reader]) -> Result<Render, Malformed> + Sync + 'a;

/// All of a render but its integrator.
fn render_by(
    scene: &Scene,
    settings: &Settings,
    states: &[&State],
    observer: &dyn Observer,
    crew: &Crew,
    integrate: &Integrate,
) -> Result<Render, RenderError> {
    let start = Instant::now();
    check(settings)?;
    let team = crew.team;
    if settings.strategies && settings.integrator == IntegratorKind::Bdpt && !team.is_alone() {
        return Err(RenderError::Settings(
            "pictures of strategies are made by one process alone".into(),
        ));
    }
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
    check_paths(&world, settings.integrator)?;
    observer.progress(Phase::Build, primitives, primitives);
    let hidden = match settings.estimate_error {
        true => chance::hidden(scene, &world, settings.integrator),
        false => Vec::new(),
    };
    (hidden.iter().filter_map(Hidden::warning)).for_each(|text| observer.warning(&text));
    let spent = states.iter().map(|state| state.made.seconds).sum();
    let run = Run {
        start,
        spent: Duration::from_secs_f64(spent),
        crew,
        hidden: &hidden,
        ..Run::begin(scene, &world, settings, observer)
    };
    let mut packed: Vec<&Packed> = states.iter().map(|state| &state.packed).collect();
    let told;
    if !team.leads() {
        told = Packed::from_bytes(team.tell(Vec::new()));
        crew.told.store(true, Relaxed);
        if told.is_empty() {
            return Ok(Render::nothing());
        }
        packed = vec![&told];
    }
    let mut from: Vec<Reader> = packed.into_iter().map(Reader::new).collect();
    let of = from.len() as u32;
    for (index, from) in (0..).zip(&mut from) {
        let shard = (of > 1).then_some(Shard { index, of });
        run.check_whose(shard.or(settings.shard), from)?;
    }
    let mut render = pool.install(|| integrate(&run, &mut from))?;
    if !team.leads() {
        return Ok(render);
    }
    let scale = scene.film.scale;
    let parts = (render.strategies.iter_mut()).flat_map(|s| [&mut s.weighted, &mut s.unweighted]);
    let colour = scene.film.colour.as_ref();
    let beyond = bring_to_scale(&mut render.pixels, scale, colour);
    parts.for_each(|pixels| _ = bring_to_scale(pixels, scale, colour));
    if let Some(deviation) = &mut render.deviation {
        scale_deviation(&scene.film, deviation);
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
    stats.total_seconds = run.elapsed().as_secs_f64();
    stats.rays_per_second = per_second(stats.rays, stats.render_seconds + stats.bootstrap_seconds);
    stats.peak_rss_bytes = peak_rss_bytes();
    stats.gathered = (!team.is_alone()).then(|| crew.gathered());
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

/// Whether an integrator can make the paths of a scene.
fn check_paths(world: &World, integrator: IntegratorKind) -> Result<(), RenderError> {
    let traces = matches!(
        integrator,
        IntegratorKind::Pt | IntegratorKind::Pssmlt(PathSamplerKind::Pt)
    );
    if traces || !world.plan.subsurface {
        return Ok(());
    }
    let message = "no light subpath can be joined to what is below a surface (subsurface); use pt, or pssmlt over pt";
    Err(RenderError::Settings(message.into()))
}

/// What a pilot of [`IntegratorKind::Auto`] with these settings decides, as a render with them
/// does. `world` must be of `scene` and for `settings.max_depth`.
///
/// # Errors
/// Settings out of range, and thread pools that cannot be had.
pub fn shares(scene: &Scene, world: &World, settings: &Settings) -> Result<Shares, RenderError> {
    check(settings)?;
    check_paths(world, settings.integrator)?;
    let run = Run::begin(scene, world, settings, &Silent);
    Ok(pool(settings.threads)?.install(|| auto::shares::<f32x8>(&run)))
}

/// Every integrator, by name.
fn integrate<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    match run.settings.integrator {
        IntegratorKind::Auto => auto::render::<L>(run, from),
        IntegratorKind::Mmlt => mmlt::render::<L>(run, from),
        IntegratorKind::Pssmlt(sampler) => pssmlt::render::<L>(run, sampler, from),
        IntegratorKind::Pt => pt::render::<L>(run, from),
        IntegratorKind::Lt => lt::render::<L>(run, from),
        IntegratorKind::Bdpt => bdpt::render::<L>(run, from),
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, RenderError> {
    let threads = worker_threads(threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RenderError::Threads { threads, source })
}
