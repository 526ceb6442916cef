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
use super::schedule::{ChainBudget, March, Start, chain_budgets, density};
use super::tuning::{self, Tuned};
use super::{EndedBy, Phase, ROUND, Render, Run, Stats, black_reason, mixing_check, per_second};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::chain::counts::Counts;
use crate::film::{FilterTable, Half, SplatFilm, Tiling};
use crate::simd::Lanes;
use std::time::{Duration, Instant};

pub(super) fn render<L: Lanes>(run: &Run, method: &Method) -> Render {
    let settings = run.settings;
    let mut counts = Counts::default();
    let boot_start = Instant::now();
    let bootstraps = bootstrap::<L>(run, method);
    for b in &bootstraps.samplers {
        counts.rejected += b.rejected;
        counts.rays += b.rays;
    }
    let (short, void) = (bootstraps.ended_by, bootstraps.is_void());
    let part = bootstraps.part(settings.bootstrap);
    let bootstraps = if void {
        Vec::new()
    } else {
        bootstraps.samplers
    };

    let (width, height) = run.size();
    let area = run.world.camera.region.area();
    let wanted = (settings.mutations_per_pixel as f64 * area).ceil();
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
    let ended_by = march.march::<L>(&film, least, |chains| {
        let chains: Chains = chains.iter().map(|(a, _, b)| (*a, &**b)).collect();
        good_enough(run, &film, &chains, &mut looks)
    });
    let mut batches = march.finish();
    let mut mutations = 0;
    for (_, to, batch) in &mut batches {
        batch.flush(&film, *to);
        counts.merge(&batch.counts);
        mutations += u64::from(batch.iterations()) * batch.len() as u64;
    }

    let chains: Chains = batches.iter().map(|(a, _, batch)| (*a, batch)).collect();
    let light = Light::of(run, film.layers(), &chains);
    let pixels = film.resolve(&light.scales);
    let deviation = (settings.estimate_error && settings.error_layers).then(|| {
        let scales = light.of_film(&light.scales);
        film.resolve_with_error(0..pixels.len(), &scales).1
    });
    let relmse = (settings.estimate_error && mutations > 0).then(|| relmse_of(run, &film, &light));
    drop(film);
    let render_seconds = render_start.elapsed().as_secs_f64();
    let (acceptance_large, acceptance_small) = counts.acceptance();
    let mut warnings = Vec::new();
    if let Some(by) = short {
        let by = match by {
            EndedBy::Time => "--time ended",
            _ => "stopped",
        };
        warnings.push(format!(
            "{by} the bootstrap after {:.2} % of its paths: the brightness of the picture is less certain than usual",
            100.0 * part
        ));
    } else if batches.is_empty() {
        warnings.push(dark_reason(run, method));
    }
    if tuned.part < 1.0 && !batches.is_empty() {
        warnings.push(format!(
            "stopped after {:.0} % of the mutations that tune others: sigma and the probability of large steps are less certain than usual",
            100.0 * tuned.part
        ));
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
    if settings.estimate_error {
        mixing_check::judge(run, &tiling, &chains, &light, &mut stats, &mut warnings);
    }
    Render {
        stats,
        pixels,
        width,
        height,
        warnings,
        deviation,
        strategies: Vec::new(),
        ended_by: short.unwrap_or(ended_by),
    }
}

/// Estimated relMSE of the picture so far, as it will be written.
fn relmse_of(run: &Run, film: &SplatFilm, light: &Light) -> f64 {
    let (width, height) = run.size();
    let width = width as usize;
    let scale = f64::from(run.scene.film.scale);
    let radiance: Vec<f64> = light.scales.iter().map(|s| s * scale).collect();
    relmse(width, height as usize, |rows| {
        let pixels = rows.start * width..rows.end * width;
        film.resolve_with_error(pixels, &light.of_film(&radiance))
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
fn good_enough(run: &Run, film: &SplatFilm, chains: &Chains, looks: &mut Looks) -> bool {
    if !run.settings.estimate_error {
        return false;
    }
    let seen = looks.look(|| {
        let light = Light::of(run, film.layers(), chains);
        let error = relmse_of(run, film, &light).sqrt();
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
fn ready(run: &Run) -> Option<EndedBy> {
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
    if run.settings.bootstrap >= 100_000 || run.world.lights.is_empty() {
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
