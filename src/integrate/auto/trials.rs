//! Short renders of one scene by different choices, judged by the error that each estimates of
//! most of its pixels ([`bulk`]): it has seen what no model foresees, how unevenly chains start and
//! where they stick.
//! A small budget does not reach for samples enough in each pixel. Then the trials' pictures have
//! fewer pixels: what independent samples leave, and what chains leave where they have been at all,
//! falls alike with the size of pixels.
//! Their random numbers are others than those of the render: what is chosen does not depend on
//! what will be in the picture.

use super::bulk::bulk;
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
/// Samples per pixel, in rays, that tell their error.
const SAMPLES: f64 = 3.0;
/// Fewest pixels along the shorter side of a trial's picture, if the render has as many.
const SIDE: f64 = 32.0;
/// Fewest mutations of the whole picture that tell theirs.
const FEWEST: f64 = 20_000.0;
/// Most chains of a trial.
const CHAINS: u64 = 2048;
/// Bootstrap paths of a trial over its mutations. A render has fewer. A trial that had so few
/// would be judged by its uncertain brightness.
const BOOTSTRAP: f64 = 1.0;
/// What else is better than samples by less is not worth the chains' start.
const WORTH: f64 = 0.95;
/// The same of both together: a moment is too short to see all spots of chains that make few
/// mutations.
const WORTH_BOTH: f64 = 0.25;
/// Mixed into the seed.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// What the short renders have shown.
pub(super) struct Tried {
    /// Which choice.
    pub best: usize,
    /// Squared error of most pixels, of the first over that of the best.
    pub gain: f64,
    /// Squared relative error of the best after a thousand rays a pixel.
    pub expected: f64,
    /// Traced in all.
    pub rays: u64,
}

/// Tries the choices: samples alone, chains alone, and, where the budget is large, both. `None` if
/// it is too small for that, or a stop came in between.
pub(super) fn best<L: Lanes>(run: &Run, choices: [&Choice; 3], budget: Budget) -> Option<Tried> {
    let wanted = budget.affordable.min(run.settings.mutations_per_pixel as f64);
    let [of_sample, _] = choices[0].rays;
    let least = SAMPLES * of_sample / budget.usual;
    let film = coarser(run.film, least / (PART * wanted));
    let camera = Camera::new(&run.scene.camera, &film);
    let world = run.world.seen_by(camera);
    // Pixels of the trial's picture, and mutations in each that the whole render would make.
    let area = world.camera.region.area();
    let wanted = wanted * mutations(run, 1) / area;
    let least = least.max(FEWEST / area);
    let each = (PART * wanted).min(ENOUGH).max(least);
    if each > MOST * wanted {
        return None;
    }
    let tried = if each > 1.5 * PART * wanted { 2 } else { 3 };
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
    let mut whole = errors;
    let mut traced = [0; 3];
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
        let render = march::<L>(
            &run,
            choice,
            own,
            Vec::new(),
            start,
            &mut [],
        );
        let render = render.ok()?;
        traced[i] = render.stats.rays;
        if quiet.stop() {
            return None;
        }
        let deviation = render.deviation.unwrap_or_default();
        let known = |e: &f64| *e > 0.0 && e.is_finite();
        let error = bulk(&render.pixels, &deviation, render.width as usize);
        errors[i] = Some(error).filter(known).unwrap_or(f64::INFINITY);
        whole[i] = (render.stats.relmse.filter(known)).unwrap_or(f64::INFINITY);
    }
    let [alone, ..] = errors;
    if !alone.is_finite() {
        return None;
    }
    let mut best = 0;
    for (i, worth) in [(1, WORTH), (2, WORTH_BOTH)] {
        if errors[i] < worth * errors[best] {
            best = i;
        }
    }
    let per_pixel = traced[best] as f64 / area;
    Some(Tried {
        best,
        gain: alone / errors[best],
        expected: whole[best] * per_pixel / 1000.0,
        rays: traced.iter().sum(),
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
