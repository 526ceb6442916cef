//! Multiplexed Metropolis light transport (Hachisuka, Kaplanyan and Dachsbacher 2014), in lockstep.
//!
//! Every depth `k` has its own integral `b_k`, its own chains, and (up to [`LAYERS`]) its own layer of the film. Mutations are allotted to
//! depths in proportion to the bootstrap's `b_k` ([`super::schedule`]). The picture is
//!
//! ```text
//! sum over k of  b_k * A / N_k * sum of splats of depth k
//! ```
//!
//! with `A` the sampled raster area in pixels and `N_k` the mutations made at depth `k`, whatever their number: rounding and early stops cost no
//! energy. `b_k` is the mean target of all uniform samples there are: the bootstrap's, and every large step's ([`Estimate`]; pbrt-v3,
//! section 16.4.3, uses the first alone).

use super::bootstraps::{Bootstraps, bootstraps};
use super::error::{Looks, relmse};
use super::schedule::{Allotment, LAYERS, March, Start, allot, density, layer_of};
use super::tuning::{self, Tuned};
use super::{EndedBy, Phase, ROUND, Render, Run, Stats, mixed, per_second};
use crate::chain::batch::{Batch, Counts};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::film::{FilterTable, Half, Scales, SplatFilm, Tiling};
use crate::simd::Lanes;
use std::time::{Duration, Instant};

/// Layers of the film for so many depths.
pub(super) fn layers(depths: usize) -> usize {
    depths.clamp(1, LAYERS)
}

pub(super) fn render<L: Lanes>(run: &Run) -> Render {
    let settings = run.settings;
    let mut counts = Counts::default();
    let boot_start = Instant::now();
    let bootstraps = bootstrap::<L>(run);
    for b in &bootstraps.depths {
        counts.rejected += b.rejected;
        counts.rays += b.rays;
    }
    let (short, void) = (bootstraps.ended_by, bootstraps.is_void());
    let part = bootstraps.part(settings.bootstrap);
    let bootstraps = if void { Vec::new() } else { bootstraps.depths };

    let (width, height) = run.size();
    let area = run.world.camera.region.area();
    let wanted = (settings.mutations_per_pixel as f64 * area).ceil();
    let mut allotments = allot(run, &bootstraps, wanted);
    let tuned = tune::<L>(run, &mut allotments, &bootstraps, short);
    counts.rays += tuned.rays;
    let bootstrap_seconds = boot_start.elapsed().as_secs_f64();
    let starts: Vec<Start> = (allotments.iter())
        .map(|a| Start::new(run, a, &bootstraps))
        .collect();
    drop(bootstraps);
    let film = film(run, &allotments, &starts);

    let render_start = Instant::now();
    let tiling = Tiling::new(run.scene.film.crop);
    let mut march = March::new::<L>(run, &allotments, &starts, &tiling);
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
    let variance = (settings.estimate_error && settings.error_layers).then(|| {
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
        warnings.push(dark_reason(run));
    }
    if tuned.part < 1.0 && !batches.is_empty() {
        warnings.push(format!(
            "stopped after {:.0} % of the mutations that tune others: sigma and the probability of large steps are less certain than usual",
            100.0 * tuned.part
        ));
    }
    let mut stats = Stats {
        integrator: "mmlt".into(),
        mutations,
        mutations_per_second: per_second(mutations, render_seconds),
        rays: counts.rays,
        bootstrap_seconds,
        render_seconds,
        acceptance_large,
        acceptance_small,
        b: light.estimates.iter().map(Estimate::mean).sum(),
        b_stderr: (light.estimates.iter().map(Estimate::error2).sum::<f64>()).sqrt(),
        rejected_nonfinite: counts.rejected,
        relmse,
        ..Stats::default()
    };
    if settings.estimate_error {
        mixed::judge(run, &tiling, &chains, &light, &mut stats, &mut warnings);
    }
    Render {
        stats,
        pixels,
        width,
        height,
        warnings,
        variance,
        strategies: Vec::new(),
        ended_by: short.unwrap_or(ended_by),
    }
}

/// Batches of chains that have made the same number of iterations as others of their layer.
pub(super) type Chains<'a> = Vec<(&'a Allotment, &'a Batch)>;

/// How much light there is, and how it gets from the film into the picture.
pub(super) struct Light {
    /// By depth: the integrals `b_k`.
    pub estimates: Vec<Estimate>,
    /// By layer of the film: what turns its sums into radiance, and the squared relative standard error of that.
    pub scales: Vec<f64>,
    pub relative_variance: Vec<f64>,
    /// What all splats of each layer weigh; 0 if errors are not estimated.
    weights: Vec<f64>,
}

impl Light {
    pub fn of(run: &Run, layers: usize, chains: &Chains) -> Self {
        let estimates = estimate(run, chains);
        let area = run.world.camera.region.area();
        let scale = |layer| layer_scale(chains, &estimates, layer) * area;
        let relative = |layer: usize| {
            let depths = estimates.iter().enumerate();
            let of_layer = depths.filter(|(depth, _)| layer_of(*depth) == layer);
            let (b, error2) = of_layer.fold((0.0, 0.0), |(b, error2), (_, e)| {
                (b + e.mean(), error2 + e.error2())
            });
            if b > 0.0 { error2 / (b * b) } else { 0.0 }
        };
        Self {
            scales: (0..layers).map(scale).collect(),
            relative_variance: (0..layers).map(relative).collect(),
            weights: mixed::weights(chains, layers),
            estimates,
        }
    }

    /// As the film takes it, with `radiance` in place of the scales.
    fn of_film<'a>(&'a self, radiance: &'a [f64]) -> Scales<'a> {
        Scales {
            radiance,
            relative_variance: &self.relative_variance,
            light: &self.weights,
        }
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

fn film(run: &Run, allotments: &[Allotment], starts: &[Start]) -> SplatFilm {
    let layers = layers(run.world.plan.depths.len());
    let filter = FilterTable::new(&run.scene.film.filter, run.scene.film.crop);
    let most = (allotments.iter())
        .map(|a| f64::from(a.iterations) * a.chains as f64)
        .sum();
    if !run.settings.estimate_error {
        return SplatFilm::new(filter, layers, most);
    }
    // The scales that the layers would have at the end if the bootstrap knew all about the light.
    let half = |layer: usize| {
        let members = allotments.iter().zip(starts);
        let members = members.filter(|(a, _)| a.layer == layer);
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
        reached && mixed::depths(run, chains, &light).iter().all(|d| d.mixed())
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

fn bootstrap<L: Lanes>(run: &Run) -> Bootstraps {
    let later = tuning::mutations(run);
    let progress = |done, total| (run.observer).progress(Phase::Bootstrap, done, total + later);
    bootstraps::<L>(run.world, run.settings, &|| ready(run), progress)
}

/// Tunes the chains, unless the bootstrap has been cut short by `short`.
fn tune<L: Lanes>(
    run: &Run,
    allotments: &mut [Allotment],
    bootstraps: &[Bootstrap],
    short: Option<EndedBy>,
) -> Tuned {
    let before = run.settings.bootstrap * run.world.plan.depths.len() as u64;
    let total = before + tuning::mutations(run);
    let progress = |done| (run.observer).progress(Phase::Bootstrap, before + done, total);
    tuning::tune::<L>(
        run,
        allotments,
        bootstraps,
        &|| short.or_else(|| ready(run)),
        progress,
    )
}

/// All independent samples of each depth: the bootstrap's and the large steps'.
fn estimate(run: &Run, chains: &Chains) -> Vec<Estimate> {
    let mut estimates = vec![Estimate::default(); run.world.plan.depths.len()];
    for (a, _) in chains {
        estimates[a.depth] = a.bootstrap;
    }
    for (a, batch) in chains {
        for chain in batch.large_moments() {
            estimates[a.depth].later.merge(&chain);
        }
    }
    estimates
}

/// Factor of a layer: its depths' integral over their weighted mutations.
fn layer_scale(chains: &Chains, estimates: &[Estimate], layer: usize) -> f64 {
    let members = || chains.iter().filter(|(a, _)| a.layer == layer);
    // Chains of a layer have all made the same number of iterations.
    let done = members().next().map_or(0, |(_, batch)| batch.iterations());
    let densest = members().map(|(a, _)| density(a)).fold(0.0, f64::max);
    // A depth has several batches, in a row.
    let (mut boot, mut refined, mut last) = (0.0, 0.0, None);
    for (a, _) in members() {
        if last != Some(a.depth) {
            boot += a.bootstrap.mean();
            refined += estimates[a.depth].mean();
            last = Some(a.depth);
        }
    }
    if boot > 0.0 && done > 0 {
        densest / f64::from(done) * refined / boot
    } else {
        0.0
    }
}

fn dark_reason(run: &Run) -> String {
    if run.world.lights.is_empty() {
        "the scene has no lights: the picture is black".into()
    } else if run.settings.bootstrap < 100_000 {
        format!(
            "none of the {} bootstrap paths per depth carries light to the camera: the picture is black; more bootstrap samples may find some",
            run.settings.bootstrap
        )
    } else {
        "no bootstrap path carries light to the camera: the picture is black".into()
    }
}
