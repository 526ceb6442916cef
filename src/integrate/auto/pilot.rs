//! The pilot's samples: two in each of some pixels, contribution by contribution.

use super::evidence::Contribution;
use crate::chain::mutate::ONE_MINUS_EPSILON;
use crate::integrate::{EndedBy, Run};
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::Paths;
use crate::transport::bidirectional::BidirectionalLayout;
use crate::transport::samples::Samples;
use rayon::prelude::*;

/// Samples that are evaluated at a time.
pub(super) const BATCH: u32 = 1024;
/// Batches between two questions whether to stop.
const ROUND: u32 = 8;

/// What the samples have brought.
#[derive(Default)]
pub(super) struct Pilot {
    pub contributions: Vec<Contribution>,
    /// An even number.
    pub samples: u32,
    pub rays: u64,
}

impl Pilot {
    /// Makes about `count` samples, fewer if `ended` says so. `layout` evaluates parts.
    pub fn run<L: Lanes>(
        run: &Run,
        layout: &BidirectionalLayout,
        count: u32,
        ended: &dyn Fn() -> Option<EndedBy>,
    ) -> Self {
        let mut pilot = Self::default();
        let batches = count.div_ceil(BATCH).max(1);
        for first in (0..batches).step_by(ROUND as usize) {
            let some: Vec<Self> = (first..batches.min(first + ROUND))
                .into_par_iter()
                .map(|batch| Self::batch::<L>(run, layout, batch))
                .collect();
            some.into_iter().for_each(|batch| pilot.add(batch));
            if ended().is_some() {
                break;
            }
        }
        pilot
    }

    pub fn add(&mut self, batch: Self) {
        self.contributions.extend(batch.contributions);
        self.samples += batch.samples;
        self.rays += batch.rays;
    }

    fn batch<L: Lanes>(run: &Run, layout: &BidirectionalLayout, batch: u32) -> Self {
        let n = BATCH as usize;
        let first = batch * BATCH;
        let stream = Stream::new(run.settings.seed, Purpose::Pilot);
        let mut samples = Samples::new(layout.total(), n);
        samples.fill::<L>(&stream, n, |i| [first + i as u32, 0]);
        place(run, layout.at.raster, &mut samples, first);
        let mut paths = Paths::new(run.world);
        (run.world).evaluate_bidirectional::<L>(layout, &samples, n, &mut paths);
        let mut contributions = Vec::new();
        for (strategy, parts) in layout.strategies().iter().zip(&paths.splats.parts) {
            let places = match strategy.t {
                1 => &paths.splats.light[strategy.s as usize - 2],
                _ => &paths.splats.camera,
            };
            for (i, (part, at)) in parts.iter().zip(places).enumerate() {
                let [r, g, b] = part.weighted;
                let value = (r + g + b) * (1.0 / 3.0);
                if value > 0.0 && value.is_finite() {
                    contributions.push(Contribution {
                        sample: first + i as u32,
                        depth: strategy.depth(),
                        placed: strategy.t > 1,
                        raster: at.raster,
                        value,
                    });
                }
            }
        }
        Self {
            contributions,
            samples: BATCH,
            rays: paths.rays.traced,
        }
    }
}

/// Steps of an additive recurrence over the picture (as in `chain::primary`).
const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// Two samples that follow each other go to one pixel; `raster` is the first of two rows that say
/// where.
pub(super) fn place(run: &Run, raster: usize, samples: &mut Samples, first: u32) {
    let region = run.world.camera.region;
    for axis in 0..2 {
        let low = f64::from([region.x0, region.y0][axis]);
        let size = f64::from([region.width, region.height][axis]);
        let row = samples.row_mut(raster + axis);
        for (i, u) in row.iter_mut().take(BATCH as usize).enumerate() {
            let pair = f64::from((first + i as u32) / 2);
            let at = low + (0.5 + pair * STEPS[axis]).fract() * size;
            let pixel = [at.floor().max(low), (at.floor() + 1.0).min(low + size)];
            let at = pixel[0] + f64::from(*u) * (pixel[1] - pixel[0]);
            *u = (((at - low) / size) as f32).clamp(0.0, ONE_MINUS_EPSILON);
        }
    }
}
