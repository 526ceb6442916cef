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

use super::schedule::{Allotment, LAYERS, March, allot, density};
use super::{Phase, Render, Run, Settings, Stats, per_second};
use crate::chain::batch::{Batch, Counts};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::film::{FilterTable, SplatFilm};
use crate::simd::Lanes;
use crate::transport::World;
use std::time::Instant;

/// Layers of the film for so many depths.
pub(super) fn layers(depths: usize) -> usize {
    depths.clamp(1, LAYERS)
}

pub(super) fn render<L: Lanes>(run: &Run) -> Render {
    let settings = run.settings;
    let mut counts = Counts::default();
    let boot_start = Instant::now();
    let bootstraps = bootstrap::<L>(run);
    for b in &bootstraps {
        counts.rejected += b.rejected;
        counts.rays += b.rays;
    }
    let bootstrap_seconds = boot_start.elapsed().as_secs_f64();
    let short = bootstraps.iter().any(Bootstrap::is_short);

    let (width, height) = run.size();
    let area = run.world.camera.region.area();
    let wanted = (settings.mutations_per_pixel as f64 * area).ceil();
    let allotments = allot(run, &bootstraps, wanted);
    let layers = layers(run.world.plan.depths.len());
    let filter = FilterTable::new(&run.scene.film.filter, run.scene.film.crop);
    let most = (allotments.iter())
        .map(|a| f64::from(a.iterations) * a.chains as f64)
        .sum();
    let film = SplatFilm::new(filter, layers, most);

    let render_start = Instant::now();
    let mut march = March::new::<L>(run, &allotments, &bootstraps);
    drop(bootstraps);
    let stopped = march.march::<L>(&film);
    let mut batches = march.finish();
    let mut mutations = 0;
    for (a, batch) in &mut batches {
        batch.flush(&film, a.layer, a.share);
        counts.merge(&batch.counts);
        mutations += u64::from(batch.iterations()) * batch.len() as u64;
    }

    let estimates = estimate(run, &batches);
    let scales: Vec<f64> = (0..layers)
        .map(|layer| layer_scale(&batches, &estimates, layer) * area)
        .collect();
    let pixels = film.resolve(&scales);
    let render_seconds = render_start.elapsed().as_secs_f64();
    let (acceptance_large, acceptance_small) = counts.acceptance();
    let mut warnings = Vec::new();
    if short {
        warnings.push("stopped during the bootstrap: light is missing from the picture".into());
    } else if batches.is_empty() {
        warnings.push(dark_reason(run));
    }
    Render {
        stats: Stats {
            integrator: "mmlt".into(),
            mutations,
            mutations_per_second: per_second(mutations, render_seconds),
            rays: counts.rays,
            bootstrap_seconds,
            render_seconds,
            acceptance_large,
            acceptance_small,
            b: estimates.iter().map(Estimate::mean).sum(),
            b_stderr: estimates.iter().map(Estimate::error2).sum::<f64>().sqrt(),
            rejected_nonfinite: counts.rejected,
            ..Stats::default()
        },
        pixels,
        width,
        height,
        warnings,
        stopped_early: stopped || short,
    }
}

fn bootstrap<L: Lanes>(run: &Run) -> Vec<Bootstrap> {
    let per_depth = run.settings.bootstrap;
    let total = per_depth * run.world.plan.depths.len() as u64;
    // A first estimate of every depth is needed before any chain can start: time alone does not end the bootstrap, the user does.
    let cancelled = || run.observer.stop();
    (bootstraps::<L>(run.world, run.settings, &cancelled).enumerate())
        .map(|(i, bootstrap)| {
            let done = (i as u64 + 1) * per_depth;
            run.observer.progress(Phase::Bootstrap, done, total);
            bootstrap
        })
        .collect()
}

/// The bootstrap of each depth in turn, empty where no strategy can carry light.
pub(super) fn bootstraps<'a, L: Lanes>(
    world: &'a World,
    settings: &'a Settings,
    cancelled: &'a (dyn Fn() -> bool + Sync),
) -> impl Iterator<Item = Bootstrap> + 'a {
    world.plan.depths.iter().map(|depth| {
        let count = if depth.strategies.is_empty() {
            0
        } else {
            settings.bootstrap
        };
        Bootstrap::run::<L>(world, depth, settings.seed, count, cancelled)
    })
}

/// All independent samples of each depth: the bootstrap's and the large steps'.
fn estimate(run: &Run, batches: &[(&Allotment, Batch)]) -> Vec<Estimate> {
    let mut estimates = vec![Estimate::default(); run.world.plan.depths.len()];
    for (a, _) in batches {
        estimates[a.depth] = a.bootstrap;
    }
    for (a, batch) in batches {
        for chain in batch.large_moments() {
            estimates[a.depth].later.merge(&chain);
        }
    }
    estimates
}

/// Factor of a layer: its depths' integral over their weighted mutations.
fn layer_scale(batches: &[(&Allotment, Batch)], estimates: &[Estimate], layer: usize) -> f64 {
    let members = || batches.iter().filter(|(a, _)| a.layer == layer);
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
