//! Multiplexed Metropolis light transport (Hachisuka, Kaplanyan and Dachsbacher 2014), in lockstep.
//!
//! Every depth `k` has its own integral `b_k`, its own chains, and (up to [`LAYERS`]) its own layer of the film. Chains are allotted to depths
//! in proportion to the bootstrap's `b_k`, rounded up to full lanes, and every chain makes the same number of mutations. The picture is
//!
//! ```text
//! sum over k of  b_k * A / N_k * sum of splats of depth k
//! ```
//!
//! with `A` the sampled raster area in pixels and `N_k` the mutations made at depth `k`, whatever their number: rounding and early stops cost no
//! energy. `b_k` is the mean target of all uniform samples there are: the bootstrap's, and every large step's ([`Estimate`]; pbrt-v3,
//! section 16.4.3, uses the first alone).

use super::{Phase, Render, Run, Stats, per_second};
use crate::chain::batch::{Batch, Counts, MAX_CHAINS_PER_DEPTH};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::chain::mutate::Kernel;
use crate::film::{FilterTable, SplatFilm};
use crate::simd::Lanes;
use crate::transport::Paths;
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Depths with a film layer of their own; deeper ones share the last.
const LAYERS: usize = 16;

/// Layers of the film for so many depths.
pub(super) fn layers(depths: usize) -> usize {
    depths.clamp(1, LAYERS)
}

/// How the chains of a depth reach the film.
struct Allotment {
    /// Index into the plan's depths.
    depth: usize,
    chains: usize,
    layer: usize,
    /// Weight of this depth's splats within its layer, at most 1.
    share: f64,
    bootstrap: Estimate,
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
    let allotments = allot(run, &bootstraps);
    let chains: usize = allotments.iter().map(|a| a.chains).sum();

    let (width, height) = run.size();
    let area = run.world.camera.region.area();
    let wanted = (settings.mutations_per_pixel as f64 * area).ceil();
    let iterations = if chains == 0 {
        0
    } else {
        (wanted / chains as f64).ceil() as u64
    };
    let iterations = iterations.min(u64::from(u32::MAX)) as u32;

    let layers = layers(run.world.plan.depths.len());
    let filter = FilterTable::new(&run.scene.film.filter, run.scene.film.crop);
    let film = SplatFilm::new(filter, layers, f64::from(iterations) * chains as f64);

    let render_start = Instant::now();
    let kernel = Kernel::new(
        settings.seed,
        settings.large_step_probability,
        settings.sigma,
    );
    let mut batches = start::<L>(run, &allotments, &bootstraps);
    drop(bootstraps);
    let (done, stopped) = march::<L>(run, &kernel, &mut batches, &allotments, &film, iterations);
    for batch in &mut batches {
        let a = allotment_of(&allotments, batch);
        batch.flush(&film, a.layer, a.share);
        counts.merge(&batch.counts);
    }

    let estimates = estimate(run, &allotments, &batches);
    let scales: Vec<f64> = (0..layers)
        .map(|layer| layer_scale(&allotments, &estimates, layer, done) * area)
        .collect();
    let pixels = film.resolve(&scales);
    let render_seconds = render_start.elapsed().as_secs_f64();
    let mutations = u64::from(done) * chains as u64;
    let (acceptance_large, acceptance_small) = counts.acceptance();
    let mut warnings = Vec::new();
    if short {
        warnings.push("stopped during the bootstrap: light is missing from the picture".into());
    } else if chains == 0 {
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
    let depths = &run.world.plan.depths;
    let total = per_depth * depths.len() as u64;
    // A first estimate of every depth is needed before any chain can start: time alone does not end the bootstrap, the user does.
    let cancelled = || run.observer.stop();
    let mut all = Vec::with_capacity(depths.len());
    for (i, depth) in depths.iter().enumerate() {
        let count = if depth.strategies.is_empty() {
            0
        } else {
            per_depth
        };
        all.push(Bootstrap::run::<L>(
            run.world,
            depth,
            run.settings.seed,
            count,
            &cancelled,
        ));
        run.observer
            .progress(Phase::Bootstrap, (i as u64 + 1) * per_depth, total);
    }
    all
}

/// Chains per depth in proportion to `b_k`, at least eight wherever any light was found.
fn allot(run: &Run, bootstraps: &[Bootstrap]) -> Vec<Allotment> {
    let b: f64 = bootstraps.iter().map(|b| b.estimate.mean()).sum();
    let mut list: Vec<Allotment> = (bootstraps.iter().enumerate())
        .filter(|(_, boot)| boot.estimate.mean() > 0.0)
        .map(|(depth, boot)| {
            let wish = run.settings.chains as f64 * boot.estimate.mean() / b;
            let chains = (wish.ceil() as usize).next_multiple_of(8);
            Allotment {
                depth,
                chains: chains.min(MAX_CHAINS_PER_DEPTH),
                layer: depth.min(LAYERS - 1),
                share: 1.0,
                bootstrap: boot.estimate,
            }
        })
        .collect();
    // Depths that share a layer keep the proportions the bootstrap gave them.
    let density = |a: &Allotment| a.bootstrap.mean() / a.chains as f64;
    for layer in 0..LAYERS {
        let most = (list.iter().filter(|a| a.layer == layer))
            .map(density)
            .fold(0.0, f64::max);
        for a in list.iter_mut().filter(|a| a.layer == layer) {
            a.share = density(a) / most;
        }
    }
    list
}

fn allotment_of<'a>(allotments: &'a [Allotment], batch: &Batch) -> &'a Allotment {
    allotments
        .iter()
        .find(|a| a.depth == batch.depth)
        .expect("batches are made from allotments")
}

/// Chains per batch unless the settings say otherwise: the working set of a batch should fit the second-level cache, and every thread
/// should find work.
fn batch_size(run: &Run, chains: usize) -> usize {
    let threads = rayon::current_num_threads();
    let spread = (chains / (4 * threads)).next_multiple_of(8);
    run.settings
        .batch
        .unwrap_or(spread.clamp(64, 512))
        .next_multiple_of(8)
}

fn start<L: Lanes>(run: &Run, allotments: &[Allotment], bootstraps: &[Bootstrap]) -> Vec<Batch> {
    let seed = run.settings.seed;
    let size = batch_size(run, allotments.iter().map(|a| a.chains).sum());
    let mut parts = Vec::new();
    for a in allotments {
        let seeds = bootstraps[a.depth].seeds(seed, a.depth as u32, a.chains);
        let pieces = seeds.chunks(size).map(<[u64]>::to_vec).enumerate();
        parts.extend(pieces.map(|(i, piece)| (a.depth, i * size, piece)));
    }
    parts
        .into_par_iter()
        .map_init(
            || Paths::new(run.world),
            |paths, (depth, first, seeds)| {
                Batch::new::<L>(run.world, depth, first, &seeds, seed, paths)
            },
        )
        .collect()
}

/// Marches all batches the same number of iterations, in rounds; returns how many were made, and whether that is fewer than asked.
fn march<L: Lanes>(
    run: &Run,
    kernel: &Kernel,
    batches: &mut [Batch],
    allotments: &[Allotment],
    film: &SplatFilm,
    iterations: u32,
) -> (u32, bool) {
    let chains: u64 = batches.iter().map(|b| b.len() as u64).sum();
    let (mut done, mut round) = (0, 4u32);
    while done < iterations {
        let steps = round.min(iterations - done);
        let begin = Instant::now();
        batches.par_iter_mut().for_each_init(
            || Paths::new(run.world),
            |paths, batch| {
                let a = allotment_of(allotments, batch);
                batch.march::<L>(run.world, kernel, steps, paths, film, a.layer, a.share);
            },
        );
        done += steps;
        run.observer.progress(
            Phase::Render,
            u64::from(done) * chains,
            u64::from(iterations) * chains,
        );
        if done < iterations && run.ended() {
            return (done, true);
        }
        // Rounds of about a tenth of a second: progress and stops are prompt, the barrier costs nothing.
        if begin.elapsed() < Duration::from_millis(100) {
            round = round.saturating_mul(2);
        }
    }
    (done, false)
}

/// All independent samples of each depth: the bootstrap's and the large steps'.
fn estimate(run: &Run, allotments: &[Allotment], batches: &[Batch]) -> Vec<Estimate> {
    let mut estimates = vec![Estimate::default(); run.world.plan.depths.len()];
    for a in allotments {
        estimates[a.depth] = a.bootstrap;
    }
    for batch in batches {
        for chain in &batch.large_moments {
            estimates[batch.depth].later.merge(chain);
        }
    }
    estimates
}

/// Factor of a layer: its depths' integral over their weighted mutations, `done` per chain.
fn layer_scale(allotments: &[Allotment], estimates: &[Estimate], layer: usize, done: u32) -> f64 {
    let members = || allotments.iter().filter(|a| a.layer == layer);
    let boot: f64 = members().map(|a| a.bootstrap.mean()).sum();
    let refined: f64 = members().map(|a| estimates[a.depth].mean()).sum();
    let densest = members()
        .map(|a| a.bootstrap.mean() / a.chains as f64)
        .fold(0.0, f64::max);
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
