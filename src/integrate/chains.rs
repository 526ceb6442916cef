//! What all Metropolis integrators share: bootstrap, chains in lockstep, and their splats made a
//! picture.
//!
//! A [`Method`] is a list of samplers. Every sampler has its own integral, its own chains, and (up
//! to [`LAYERS`]) its own layer of the film. Mutations are shared out to samplers in proportion to
//! the bootstrap's integrals ([`super::schedule`]); [`super::normalisation`] makes sums of splats
//! radiance.

use super::bootstraps::{Bootstraps, bootstraps};
use super::error::{Looks, relmse};
use super::method::Method;
use super::normalisation::{Chains, Light};
use super::sampled::Sampling;
use super::schedule::{ChainBudget, March, Start, chain_budgets, density};
use super::tuning::{self, Tuned};
use super::{EndedBy, Phase, ROUND, Render, Run, Stats, black_reason, mixing_check, per_second};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::chain::counts::Counts;
use crate::film::{FilterTable, Half, SplatFilm, Tiling};
use crate::simd::Lanes;
use std::cell::RefCell;
use std::time::{Duration, Instant};

/// The bootstrap of a method, and what has become of it.
pub(super) struct Ready {
    /// None if nothing is known of the whole picture.
    pub bootstraps: Vec<Bootstrap>,
    pub counts: Counts,
    /// What has cut it short, and after which part of its paths.
    pub short: Option<EndedBy>,
    pub part: f64,
    pub start: Instant,
}

pub(super) fn render<L: Lanes>(run: &Run, method: &Method) -> Render {
    let start = Instant::now();
    let ready = Ready::new(run, bootstrap::<L>(run, method), start);
    let wanted = mutations(run, run.settings.mutations_per_pixel);
    together::<L>(run, method, ready, wanted, None)
}

/// Mutations that come to so many per pixel.
pub(super) fn mutations(run: &Run, per_pixel: u64) -> f64 {
    (per_pixel as f64 * run.world.camera.region.area()).ceil()
}

impl Ready {
    pub fn new(run: &Run, bootstraps: Bootstraps, start: Instant) -> Self {
        let mut counts = Counts::default();
        for b in &bootstraps.samplers {
            counts.rejected += b.rejected;
            counts.rays += b.rays;
        }
        let part = bootstraps.part(run.settings.bootstrap);
        let short = bootstraps.ended_by;
        let void = bootstraps.is_void();
        Self {
            bootstraps: if void {
                Vec::new()
            } else {
                bootstraps.samplers
            },
            counts,
            short,
            part,
            start,
        }
    }
}

/// Marches chains for `wanted` mutations, with samples `beside` them for the rest of the light.
pub(super) fn together<L: Lanes>(
    run: &Run,
    method: &Method,
    ready: Ready,
    wanted: f64,
    beside: Option<&mut Sampling>,
) -> Render {
    let settings = run.settings;
    let Ready {
        bootstraps,
        mut counts,
        short,
        part,
        start: boot_start,
    } = ready;
    let (width, height) = run.size();
    let [offset, full] = run.window();
    let mut budgets = chain_budgets(run, method, &bootstraps, wanted);
    let tuned = tune::<L>(run, method, &mut budgets, &bootstraps, short);
    counts.rays += tuned.rays;
    let bootstrap_seconds = boot_start.elapsed().as_secs_f64();
    let starts: Vec<Start> = (budgets.iter())
        .map(|a| Start::new(run, a, &bootstraps))
        .collect();
    drop(bootstraps);
    let film = film(run, method, &budgets, &starts);

    let render_start = Instant::now();
    let tiling = Tiling::new(run.scene.film.crop);
    let mut march = March::new::<L>(run, &budgets, &starts, &tiling);
    let mut looks = Looks::new();
    // What a stop has kept of the bootstrap is worth a first round.
    let least = short.or(tuned.ended_by).map_or(Duration::ZERO, |_| ROUND);
    let samples = RefCell::new(beside);
    let advance = |part| {
        if let Some(samples) = &mut *samples.borrow_mut() {
            samples.advance_to(part);
        }
    };
    let ended_by = march.march::<L>(&film, least, advance, |chains| {
        let chains: Chains = chains.iter().map(|(a, _, b)| (*a, &**b)).collect();
        let samples = samples.borrow();
        run.show(|| {
            let light = Light::of(run, film.layers(), &chains);
            picture(&film, &light, samples.as_deref()).0
        });
        good_enough(run, &film, &chains, samples.as_deref(), &mut looks)
    });
    if ended_by == EndedBy::Effort {
        // Chains advance the samples as they go, but there may be none.
        advance(1.0);
    }
    let beside = samples.into_inner().map(|samples| &*samples);
    let mut batches = march.finish();
    let mut mutations = 0;
    for (_, to, batch) in &mut batches {
        batch.flush(&film, *to);
        counts.merge(&batch.counts);
        mutations += u64::from(batch.iterations()) * batch.len() as u64;
    }

    let chains: Chains = batches.iter().map(|(a, _, batch)| (*a, batch)).collect();
    let mut light = Light::of(run, film.layers(), &chains);
    let (pixels, beside_mean) = picture(&film, &light, beside);
    light.beside = beside_mean;
    let judged = settings.estimate_error && beside.is_none_or(Sampling::is_judged);
    let deviation =
        (judged && settings.error_layers).then(|| deviation(&film, &light, beside, pixels.len()));
    let made = mutations > 0 || beside.is_some();
    let relmse = (judged && made).then(|| relmse_of(run, &film, &light, beside));
    drop(film);
    let render_seconds = render_start.elapsed().as_secs_f64();
    let (acceptance_large, acceptance_small) = counts.acceptance();
    let mut warnings: Vec<String> = short.map(|by| cut_short(by, part)).into_iter().collect();
    if short.is_none() && batches.is_empty() && light.beside <= 0.0 {
        warnings.push(dark_reason(run, method));
    }
    if tuned.part < 1.0 && !batches.is_empty() {
        warnings.push(badly_tuned(tuned.part));
    }
    // Not by `sum`, by which nothing comes to -0.
    let sum = |of: fn(&Estimate) -> f64| light.estimates.iter().fold(0.0, |sum, e| sum + of(e));
    let mut stats = Stats {
        integrator: method.name.into(),
        mutations,
        mutations_per_second: per_second(mutations, render_seconds),
        rays: counts.rays,
        bootstrap_seconds,
        render_seconds,
        acceptance_large,
        acceptance_small,
        b: sum(Estimate::mean),
        b_stderr: sum(Estimate::error2).sqrt(),
        rejected_nonfinite: counts.rejected,
        relmse,
        ..Stats::default()
    };
    let sums = beside.map(|b| (b, b.tile_sums()));
    if let Some((beside, sums)) = &sums {
        add_samples(&mut stats, beside);
        stats.b += light.beside;
        stats.b_stderr = stats.b_stderr.hypot(beside.mean_error(sums));
        warnings.extend(beside.warned());
    }
    if settings.estimate_error {
        let layer = sums.as_ref().map(|(beside, sums)| beside.layer(sums));
        let of = (&chains, &light);
        mixing_check::judge(run, &tiling, of, layer, &mut stats, &mut warnings);
    }
    Render {
        stats,
        pixels,
        width,
        height,
        offset,
        full,
        warnings,
        deviation,
        strategies: Vec::new(),
        ended_by: short.unwrap_or(ended_by),
    }
}

fn cut_short(by: EndedBy, part: f64) -> String {
    let by = match by {
        EndedBy::Time => "--time ended",
        _ => "stopped",
    };
    format!(
        "{by} the bootstrap after {:.2} % of its paths: the brightness of the picture is less certain than usual",
        100.0 * part
    )
}

fn badly_tuned(part: f64) -> String {
    format!(
        "stopped after {:.0} % of the mutations that tune others: sigma and the probability of large steps are less certain than usual",
        100.0 * part
    )
}

/// What samples beside chains have taken.
fn add_samples(stats: &mut Stats, beside: &Sampling) {
    let made = beside.counts();
    stats.samples = made.samples;
    stats.samples_per_second = per_second(made.samples, stats.render_seconds);
    stats.rays += made.rays;
    stats.rejected_nonfinite += made.rejected;
}

/// Standard errors of all pixels.
fn deviation(
    film: &SplatFilm,
    light: &Light,
    beside: Option<&Sampling>,
    pixels: usize,
) -> Vec<[f32; 3]> {
    let scales = light.of_film(&light.scales);
    let mut deviation = film.resolve_with_error(0..pixels, &scales).1;
    if let Some(beside) = beside {
        let [_, more] = beside.with_error(0..pixels, 1.0);
        add_error(&mut deviation, &more);
    }
    deviation
}

/// The picture of chains and of the samples beside them, and the mean of what samples bring.
fn picture(film: &SplatFilm, light: &Light, beside: Option<&Sampling>) -> (Vec<[f32; 3]>, f64) {
    let mut pixels = film.resolve(&light.scales);
    let Some(beside) = beside else {
        return (pixels, 0.0);
    };
    let more = beside.picture();
    add_picture(&mut pixels, &more);
    (pixels, mean(&more))
}

/// Adds a picture to another.
fn add_picture(to: &mut [[f32; 3]], more: &[[f32; 3]]) {
    let values = to.as_flattened_mut().iter_mut();
    values.zip(more.as_flattened()).for_each(|(to, v)| *to += v);
}

/// Mean of all channels.
fn mean(picture: &[[f32; 3]]) -> f64 {
    let sum: f64 = picture.as_flattened().iter().map(|v| f64::from(*v)).sum();
    sum / (3 * picture.len()).max(1) as f64
}

/// Standard errors of a sum of two that are independent.
fn add_error(to: &mut [[f32; 3]], more: &[[f32; 3]]) {
    for (to, more) in to.as_flattened_mut().iter_mut().zip(more.as_flattened()) {
        *to = (*to * *to + *more * *more).sqrt();
    }
}

/// Estimated relMSE of the picture so far, as it will be written.
fn relmse_of(run: &Run, film: &SplatFilm, light: &Light, beside: Option<&Sampling>) -> f64 {
    let (width, height) = run.size();
    let width = width as usize;
    let scale = f64::from(run.scene.film.scale);
    let radiance: Vec<f64> = light.scales.iter().map(|s| s * scale).collect();
    relmse(width, height as usize, |rows| {
        let pixels = rows.start * width..rows.end * width;
        let scales = light.of_film(&radiance);
        let (mut picture, mut deviation) = film.resolve_with_error(pixels.clone(), &scales);
        if let Some(beside) = beside {
            let [more, error] = beside.with_error(pixels, run.scene.film.scale);
            add_picture(&mut picture, &more);
            add_error(&mut deviation, &error);
        }
        (picture, deviation)
    })
}

fn film(run: &Run, method: &Method, budgets: &[ChainBudget], starts: &[Start]) -> SplatFilm {
    let layers = Method::layers(method.samplers.len(), method.combined);
    let filter = FilterTable::new(&run.scene.film.filter, run.scene.film.crop);
    let most = (budgets.iter())
        .map(|a| f64::from(a.iterations) * a.chains as f64)
        .sum();
    if !run.settings.estimate_error {
        return SplatFilm::new(filter, layers, most);
    }
    // The scales that the layers would have at the end if the bootstrap knew all about the light.
    let half = |layer: usize| {
        let members = budgets.iter().zip(starts);
        // Large steps are as many as their probability says, and weigh as much.
        let members = members.filter(|(a, _)| a.layer == layer || a.independent == Some(layer));
        members.fold(Half::default(), |half, (a, start)| Half {
            scale: (half.scale).max(density(a) / f64::from(a.iterations.max(1))),
            part: start.half(),
        })
    };
    SplatFilm::judged(filter, most, (0..layers).map(half).collect())
}

/// Looks at the error now and then, tells the observer, and says whether the target is reached.
fn good_enough(
    run: &Run,
    film: &SplatFilm,
    chains: &Chains,
    beside: Option<&Sampling>,
    looks: &mut Looks,
) -> bool {
    if !run.settings.estimate_error || !beside.is_none_or(Sampling::is_judged) {
        return false;
    }
    let seen = looks.look(|| {
        let mut light = Light::of(run, film.layers(), chains);
        if let Some(beside) = beside {
            light.beside = mean(&beside.picture());
        }
        let error = relmse_of(run, film, &light, beside).sqrt();
        run.observer.error(error);
        let reached = run
            .settings
            .target_error
            .is_some_and(|target| error <= target);
        reached
            && mixing_check::depths(chains, &light)
                .iter()
                .all(|d| d.mixed())
    });
    seen == Some(true)
}

/// Whether to go on to the chains that count: they need half of the time.
pub(super) fn ready(run: &Run) -> Option<EndedBy> {
    let limit = run.settings.time.map(|limit| limit / 2);
    let late = limit.is_some_and(|limit| run.start.elapsed() >= limit);
    if run.observer.stop() {
        Some(EndedBy::Observer)
    } else {
        late.then_some(EndedBy::Time)
    }
}

fn bootstrap<L: Lanes>(run: &Run, method: &Method) -> Bootstraps {
    let later = tuning::mutations(run, method.samplers.len());
    let progress = |done, total| (run.observer).progress(Phase::Bootstrap, done, total + later);
    bootstraps::<L>(
        run.world,
        &method.samplers,
        run.settings,
        &|| ready(run),
        progress,
    )
}

/// Tunes the chains, unless the bootstrap has been cut short by `short`.
fn tune<L: Lanes>(
    run: &Run,
    method: &Method,
    budgets: &mut [ChainBudget],
    bootstraps: &[Bootstrap],
    short: Option<EndedBy>,
) -> Tuned {
    let samplers = method.samplers.len();
    let before = run.settings.bootstrap * samplers as u64;
    let own = tuning::mutations(run, samplers);
    let progress = |part: f64| {
        let done = before + (own as f64 * part) as u64;
        (run.observer).progress(Phase::Bootstrap, done, before + own);
    };
    let ended = || short.or_else(|| ready(run));
    tuning::tune::<L>(run, budgets, bootstraps, &ended, progress)
}

fn dark_reason(run: &Run, method: &Method) -> String {
    if run.settings.bootstrap >= 100_000 || run.world.is_unlit() {
        return black_reason(run, "no bootstrap path");
    }
    let per_depth = if method.samplers.len() > 1 {
        " per depth"
    } else {
        ""
    };
    let paths = format!(
        "none of the {} bootstrap paths{per_depth}",
        run.settings.bootstrap
    );
    black_reason(run, &paths) + "; more bootstrap samples may find some"
}
