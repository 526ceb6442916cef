//! Path tracing: the reference for everything else. Same kernels, independent samples, a fixed number per pixel.

use super::{Phase, Render, Run, Stats, per_second};
use crate::film::{FilterTable, SampleFilm};
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::Paths;
use crate::transport::evaluate::UnidirectionalLayout;
use crate::transport::samples::Samples;
use rayon::prelude::*;
use std::time::Instant;

/// Paths evaluated at a time unless the settings say otherwise.
const BATCH: usize = 1024;

pub(super) fn render<L: Lanes>(run: &Run) -> Render {
    let settings = run.settings;
    let film = &run.scene.film;
    let start = Instant::now();
    let layout = UnidirectionalLayout {
        max_depth: settings.max_depth,
    };
    let stream = Stream::new(settings.seed, Purpose::PathTracer);
    let grid = Grid::new(run);
    let sums = SampleFilm::new(FilterTable::new(&film.filter, film.crop));
    let batch = settings.batch.unwrap_or(BATCH);
    let spp = settings.samples_per_pixel;
    let per_pass = grid.cells();
    let (mut rays, mut rejected) = (0, 0);
    // A pass is one sample of every cell; several go together while that keeps a stop prompt.
    let passes_at_once = (2_000_000 / per_pass.max(1)).clamp(1, spp.max(1));
    let mut done = 0;
    let mut stopped = false;
    while done < spp && !stopped {
        let passes = passes_at_once.min(spp - done);
        let total = passes * per_pass;
        let first = done * per_pass;
        let counts = (0..total.div_ceil(batch as u64))
            .into_par_iter()
            .map_init(
                || (Paths::new(run.world), Samples::new(layout.total(), batch)),
                |(paths, samples), chunk| {
                    let begin = first + chunk * batch as u64;
                    let n = (first + total - begin).min(batch as u64) as usize;
                    let before = paths.rays;
                    fill::<L>(&stream, &grid, samples, begin, n);
                    run.world
                        .evaluate_unidirectional::<L>(&layout, samples, n, paths);
                    let mut bad = 0;
                    for o in &paths.outcome {
                        sums.add(o.raster, o.rgb, 1.0);
                        bad += u64::from(o.rejected);
                    }
                    (paths.rays - before, bad)
                },
            )
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        rays += counts.0;
        rejected += counts.1;
        done += passes;
        run.observer
            .progress(Phase::Render, done * per_pass, spp * per_pass);
        stopped = done < spp && run.ended();
    }
    let (width, height) = run.size();
    let pixels = sums.resolve(if done > 0 { 1.0 / done as f64 } else { 0.0 });
    let mean: f64 = pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let render_seconds = start.elapsed().as_secs_f64();
    let samples = done * per_pass;
    Render {
        stats: Stats {
            integrator: "pt".into(),
            samples,
            samples_per_second: per_second(samples, render_seconds),
            rays,
            render_seconds,
            b: mean / (3.0 * pixels.len().max(1) as f64),
            rejected_nonfinite: rejected,
            ..Stats::default()
        },
        pixels,
        width,
        height,
        warnings: Vec::new(),
        stopped_early: stopped,
    }
}

/// The pixel cells that cover the sampled region.
struct Grid {
    x0: f64,
    y0: f64,
    columns: u64,
    rows: u64,
    /// Of the region.
    origin: [f64; 2],
    size: [f64; 2],
}

impl Grid {
    fn new(run: &Run) -> Self {
        let region = run.world.camera.region;
        let origin = [f64::from(region.x0), f64::from(region.y0)];
        let size = [f64::from(region.width), f64::from(region.height)];
        let low = origin.map(f64::floor);
        let count = |axis: usize| ((origin[axis] + size[axis]).ceil() - low[axis]) as u64;
        Self {
            x0: low[0],
            y0: low[1],
            columns: count(0),
            rows: count(1),
            origin,
            size,
        }
    }

    fn cells(&self) -> u64 {
        self.columns * self.rows
    }
}

/// Primary samples of paths `begin..begin + n`; path `i` lies in cell `i` modulo the number of cells, and within it uniformly.
fn fill<L: Lanes>(stream: &Stream, grid: &Grid, samples: &mut Samples, begin: u64, n: usize) {
    samples.fill::<L>(stream, n, |i| {
        let path = begin + i as u64;
        [path as u32, (path >> 32) as u32]
    });
    // The first two numbers place the sample in its cell, as a position in the region.
    for axis in 0..2 {
        let low = [grid.x0, grid.y0][axis];
        for (i, u) in samples.row_mut(axis)[..n].iter_mut().enumerate() {
            let cell = (begin + i as u64) % grid.cells();
            let cell = [cell % grid.columns, cell / grid.columns][axis] as f64;
            *u = ((low + cell + f64::from(*u) - grid.origin[axis]) / grid.size[axis]) as f32;
        }
    }
}
