//! Paths from the camera alone, where paths from lights are not worth their rays.
//!
//! Where lights are large, or the sky is one, a path tracer leaves less error than bidirectional
//! samples that trace as many rays. It has a pilot of its own, in the same pixels. It is chosen
//! only if it is clearly better in both halves of the pilot, if both have found the light often
//! enough to know it, and if there is none that it could have missed: none that it finds by chance
//! alone ([`crate::integrate::chance`]), and no part of the picture in which bidirectional samples
//! have found more.

use super::evidence::{Contribution, gather};
use super::model::{self, Choice, Costs};
use super::pilot::{BATCH, Pilot, place};
use crate::integrate::Run;
use crate::integrate::chance::hidden;
use crate::scene::IntegratorKind;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::Paths;
use crate::transport::evaluate::UnidirectionalLayout;
use crate::transport::samples::Samples;
use rayon::prelude::*;

/// It is chosen if its error is smaller than this part of the other.
const WORTH: f64 = 0.8;
/// Fewest samples that tell.
const ENOUGH: u32 = 4096;
/// Fewest contributions of equal weight, of either kind. Who has found fewer hardly knows how much
/// light there is, and not at all how much it lacks.
const KNOWN: f64 = 256.0;
/// Cells along each side of the picture that are compared.
const CELLS: usize = 8;
/// Part of all light that may be missing from a cell, if it is also [`SURE`] standard errors.
const MISSING: f64 = 0.003;
const SURE: f64 = 4.0;

/// What a path tracer would leave, if it is to be chosen, and the rays of its pilot.
pub(super) fn choice<L: Lanes>(run: &Run, pilot: &Pilot) -> Option<(Choice, u64)> {
    let n = pilot.samples;
    if n < ENOUGH || !hidden(run.scene, run.world, IntegratorKind::Pt).is_empty() {
        return None;
    }
    let own = trace::<L>(run, n);
    let known = |of: &Pilot| effective(&of.contributions) >= KNOWN;
    if !known(pilot) || !known(&own) {
        return None;
    }
    if misses(run, &pilot.contributions, &own.contributions, n) {
        return None;
    }
    let half = n / 4 * 2;
    let judge = |of: &Pilot, part: std::ops::Range<u32>| {
        let samples = part.end - part.start;
        let inside = of.contributions.iter().filter(|c| part.contains(&c.sample));
        let contributions: Vec<Contribution> = inside
            .map(|c| Contribution {
                sample: c.sample - part.start,
                ..*c
            })
            .collect();
        let region = run.world.camera.region;
        let region = [region.x0, region.y0, region.width, region.height].map(f64::from);
        let depths = run.world.plan.depths.len();
        let seen = gather(region, samples, &contributions, &[], depths);
        let costs = Costs {
            sample: &|_| of.rays as f64 / f64::from(n),
            shared: false,
            chains: &|_| false,
        };
        model::alone(&seen, samples, &costs)
    };
    let better = [0..half, half..2 * half].into_iter().all(|part| {
        let [own, other] = [&own, pilot].map(|of| judge(of, part.clone()).error());
        own < WORTH * other
    });
    let choice = better.then(|| judge(&own, 0..n))?;
    Some((
        Choice {
            forward: true,
            ..choice
        },
        own.rays,
    ))
}

/// The path tracer's samples: what each brings of depth 0, and of all others.
fn trace<L: Lanes>(run: &Run, count: u32) -> Pilot {
    let plan = &run.world.plan;
    let all = UnidirectionalLayout::new(plan, run.settings.max_depth);
    let seen = UnidirectionalLayout::new(plan, 0);
    let batch = |batch: u32| {
        let n = BATCH as usize;
        let first = batch * BATCH;
        let stream = Stream::new(run.settings.seed, Purpose::Pilot);
        let mut samples = Samples::new(all.total(), n);
        samples.fill::<L>(&stream, n, |i| [first + i as u32, 1]);
        place(run, all.dimensions().raster, &mut samples, first);
        let mut paths = Paths::new(run.world);
        let mut values = |layout| {
            let before = paths.rays.traced;
            (run.world).evaluate_unidirectional::<L>(layout, &samples, n, &mut paths);
            let values: Vec<([f32; 2], f32)> = (paths.splats.camera.iter().take(n))
                .map(|o| (o.raster, o.rgb.iter().sum::<f32>() / 3.0))
                .collect();
            (values, paths.rays.traced - before)
        };
        let (directly, _) = values(&seen);
        let (whole, rays) = values(&all);
        let mut contributions = Vec::new();
        for (i, ((raster, whole), (_, direct))) in whole.into_iter().zip(directly).enumerate() {
            for (depth, value) in [(0, direct), (1, whole - direct)] {
                // What is left of a difference of two that are equal is none.
                if value > 1e-6 * whole && value.is_finite() {
                    contributions.push(Contribution {
                        sample: first + i as u32,
                        depth,
                        placed: true,
                        raster,
                        value,
                    });
                }
            }
        }
        Pilot {
            contributions,
            samples: BATCH,
            rays,
        }
    };
    let batches: Vec<Pilot> = (0..count / BATCH).into_par_iter().map(batch).collect();
    let mut pilot = Pilot::default();
    batches.into_iter().for_each(|batch| pilot.add(batch));
    pilot
}

/// How many contributions of equal weight would tell as much of what is not seen directly.
fn effective(contributions: &[Contribution]) -> f64 {
    let values = || (contributions.iter()).filter(|c| c.depth > 0);
    let sum: f64 = values().map(|c| f64::from(c.value)).sum();
    let squares: f64 = values().map(|c| f64::from(c.value).powi(2)).sum();
    sum * sum / squares.max(f64::MIN_POSITIVE)
}

/// Whether there is a part of the picture in which `others` have found more than `own`.
fn misses(run: &Run, others: &[Contribution], own: &[Contribution], samples: u32) -> bool {
    let region = run.world.camera.region;
    let cell = |raster: [f32; 2]| {
        let at = |axis: usize| {
            let low = [region.x0, region.y0][axis];
            let part = (raster[axis] - low) / [region.width, region.height][axis];
            ((part.max(0.0) * CELLS as f32) as usize).min(CELLS - 1)
        };
        at(1) * CELLS + at(0)
    };
    let n = f64::from(samples);
    let mut excess = [[0.0; 2]; CELLS * CELLS];
    let mut light = 0.0;
    for (sign, contributions) in [(1.0, others), (-1.0, own)] {
        // Of depth 0 both find the same.
        for c in contributions.iter().filter(|c| c.depth > 0) {
            let value = f64::from(c.value) / n;
            let [sum, squares] = &mut excess[cell(c.raster)];
            *sum += sign * value;
            *squares += value * value;
            light += if sign > 0.0 { value } else { 0.0 };
        }
    }
    (excess.iter()).any(|[sum, squares]| *sum > MISSING * light && *sum > SURE * squares.sqrt())
}
