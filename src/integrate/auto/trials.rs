//! Short renders of one scene by different choices, judged by the error that each estimates
//! ([`error_of`]), times the rays that it took: it has seen what no model foresees, how unevenly
//! chains start and where they stick. What the model foresees counts as much, by a geometric mean:
//! it knows of light that a moment's samples miss.
//! A small budget does not reach for samples enough in each pixel. Then the trials' pictures have
//! fewer pixels: what independent samples leave, and what chains leave where they have been at all,
//! falls alike with the size of pixels.
//! Their random numbers are others than those of the render: what is chosen does not depend on
//! what will be in the picture.

use super::bulk::error_of;
use super::march::{Budget, march};
use super::model::Choice;
use crate::camera::Camera;
use crate::integrate::chains::mutations;
use crate::integrate::team::ALONE;
use crate::integrate::{Observer, Run, Settings};
use crate::scene::Film;
use crate::simd::Lanes;
use std::time::Instant;

/// Part of the budget that a trial takes.
const PART: f64 = 0.03;
/// The largest part that it may take where [`PART`] tells no error.
const MOST: f64 = 0.08;
/// Part of the time after which a trial ends, however far it is.
const LATE: f64 = 0.1;
/// Most mutations per pixel of a trial.
const ENOUGH: f64 = 64.0;
/// Samples per pixel of a trial: fewest that tell their error, and most that are worth it. Between
/// them a trial has as many as the render: samples that share out each pixel are the better the
/// more there are.
const SAMPLES: [f64; 2] = [3.0, 16.0];
/// Fewest pixels along the shorter side of a trial's picture, if the render has as many.
const SIDE: f64 = 32.0;
/// Fewest mutations of the whole picture that tell theirs.
const FEWEST: f64 = 20_000.0;
/// Most chains of a trial.
const CHAINS: u64 = 2048;
/// Bootstrap paths of a trial over its mutations. A render has fewer. A trial that had so few
/// would be judged by its uncertain brightness.
const BOOTSTRAP: f64 = 1.0;
/// Both together are not worth it if they are better by less: their chains make few mutations, and
/// a moment is too short to see all of their spots.
const WORTH_BOTH: f64 = 0.5;
/// Rays of a bootstrap path over its vertices: many end early.
const LIVE: f64 = 0.7;
/// Mixed into the seed.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// What the short renders have shown.
pub(super) struct Tried {
    /// Which choice.
    pub best: usize,
    /// Squared error for the same rays, of the first over that of the best.
    pub gain: f64,
    /// Squared relative error of the best after a thousand rays a pixel.
    pub expected: f64,
    /// Traced in all.
    pub rays: u64,
}

/// Tries the choices: samples alone, chains alone, and, where the budget is large, both. `None` if
/// it is too small for that, or a stop came in between.
pub(super) fn best<L: Lanes>(run: &Run, choices: [&Choice; 3], budget: Budget) -> Option<Tried> {
    let wanted = budget
        .affordable
        .min(run.settings.mutations_per_pixel as f64);
    let [of_sample, _] = choices[0].rays;
    let [fewest, most] = SAMPLES;
    let of_render = wanted * budget.usual / of_sample;
    let least = of_render.clamp(fewest, most) * of_sample / budget.usual;
    let film = coarser(run.film, least / (PART * wanted));
    let world = run.world.seen_by(Camera::new(&run.scene.camera, &film));
    // Pixels of the trial's picture, and mutations in each that the whole render would make.
    let area = world.camera.region.area();
    let wanted = wanted * mutations(run, 1) / area;
    let least = least.max(FEWEST / area);
    let each = (PART * wanted).min(ENOUGH).max(least);
    if each > MOST * wanted {
        return None;
    }
    let tried = if each > 1.5 * PART * wanted { 2 } else { 3 };
    // Bootstrap paths of the whole render, in parts of its rays.
    let starts = |choice: &Choice| {
        let with_chains = (1..).zip(&choice.kept).filter(|(_, kept)| kept.is_finite());
        let vertices: u32 = with_chains.map(|(vertices, _)| vertices).sum();
        let rays = LIVE * f64::from(vertices) * run.settings.bootstrap as f64;
        rays / (wanted * area * budget.usual)
    };
    let each = each.ceil() as u64;
    let depths = run.world.plan.depths.len().max(1);
    let paths = (BOOTSTRAP * each as f64 * area / depths as f64) as u64;
    let settings = Settings {
        seed: run.settings.seed ^ SEED,
        mutations_per_pixel: each,
        bootstrap: run.settings.bootstrap.min(paths.max(1024)),
        chains: (run.settings.chains).min(CHAINS),
        // Should the pilot have been faster than the trial is.
        time: run.settings.time.map(|limit| limit.mul_f64(LATE)),
        target_error: None,
        estimate_error: true,
        error_layers: true,
        // All shards come to the same.
        shard: None,
        ..run.settings.clone()
    };
    let quiet = Quiet(run.observer);
    let own = Budget {
        usual: budget.usual,
        spent: 0,
        affordable: f64::INFINITY,
    };
    let mut errors = [f64::INFINITY; 3];
    let mut expected = errors;
    let mut traced = 0;
    for (i, choice) in choices.into_iter().enumerate().take(tried) {
        let start = Instant::now();
        let run = Run {
            world: &world,
            film: &film,
            settings: &settings,
            observer: &quiet,
            start,
            // The others wait for what this one decides.
            crew: &ALONE,
            ..*run
        };
        let render = march::<L>(&run, choice, own, Vec::new(), start, &mut []);
        let render = render.ok()?;
        traced += render.stats.rays;
        if quiet.stop() {
            return None;
        }
        let deviation = render.deviation.unwrap_or_default();
        let known = |e: &f64| *e > 0.0 && e.is_finite();
        let error = error_of(&render.pixels, &deviation, render.width as usize);
        // Without the bootstrap, of which a trial has much more than a render.
        let [of_sample, of_mutation] = choice.rays;
        let made =
            render.stats.samples as f64 * of_sample + render.stats.mutations as f64 * of_mutation;
        let cost = made / area * (1.0 + starts(choice));
        let seen = error * cost;
        let judged = (seen * choice.error()).sqrt();
        errors[i] = Some(judged).filter(known).unwrap_or(f64::INFINITY);
        expected[i] = render.stats.relmse.filter(known).unwrap_or(f64::INFINITY) * cost / 1000.0;
    }
    let [alone, chains, both] = errors;
    if !alone.is_finite() {
        return None;
    }
    let mut best = usize::from(chains < alone);
    if both < WORTH_BOTH * errors[best] {
        best = 2;
    }
    Some(Tried {
        best,
        gain: alone / errors[best],
        expected: expected[best],
        rays: traced,
    })
}

/// The film with pixels that are so many times as large, as far as there are enough.
fn coarser(film: &Film, times: f64) -> Film {
    let [x0, x1, y0, y1] = film.crop.map(f64::from);
    let most = ((x1 - x0).min(y1 - y0) / SIDE).max(1.0);
    let by = times.sqrt().clamp(1.0, most);
    let side = |pixels: u32| (f64::from(pixels) / by).ceil() as u32;
    film.of_size(side(film.width), side(film.height))
}

/// Hears of no progress, and stops when the render does.
struct Quiet<'a>(&'a dyn Observer);

impl Observer for Quiet<'_> {
    fn stop(&self) -> bool {
        self.0.stop()
    }
}
