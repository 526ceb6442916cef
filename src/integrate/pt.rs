//! Path tracing: the reference for everything else. Same kernels, independent samples, a fixed number per pixel.

use super::error::{Groups, Looks, Tiles, relmse};
use super::{EndedBy, Phase, Render, Run, Stats, per_second};
use crate::film::{FilterTable, GROUPS, Passes, Sample, SampleFilm};
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::Paths;
use crate::transport::evaluate::UnidirectionalLayout;
use crate::transport::samples::Samples;
use rayon::prelude::*;
use std::time::Instant;

/// Paths evaluated at a time unless the settings say otherwise.
const BATCH: usize = 1024;
/// Samples of the first round.
const FIRST: u64 = 1 << 16;

pub(super) fn render<L: Lanes>(run: &Run) -> Render {
    let settings = run.settings;
    let film = &run.scene.film;
    let start = Instant::now();
    let layout = UnidirectionalLayout::new(&run.world.plan, settings.max_depth);
    let stream = Stream::new(settings.seed, Purpose::PathTracer);
    let grid = Grid::new(run);
    let filter = FilterTable::new(&film.filter, film.crop);
    let sums = if settings.estimate_error {
        SampleFilm::judged(filter)
    } else {
        SampleFilm::new(filter)
    };
    let batch = settings.batch.unwrap_or(BATCH) as u64;
    let spp = settings.samples_per_pixel;
    let per_pass = grid.cells();
    let total = spp.saturating_mul(per_pass);
    let (mut rays, mut rejected) = (0, 0);
    let (mut done, mut step) = (0, FIRST);
    let mut looks = Looks::new();
    let mut ended_by = None;
    while done < total && ended_by.is_none() {
        let begin = Instant::now();
        let until = done.saturating_add(step).min(total);
        let counts = (0..(until - done).div_ceil(batch))
            .into_par_iter()
            .map_init(
                || {
                    let samples = Samples::new(layout.total(), batch as usize);
                    (Paths::new(run.world), samples)
                },
                |(paths, samples), chunk| {
                    let begin = done + chunk * batch;
                    let n = (until - begin).min(batch) as usize;
                    let before = paths.rays;
                    fill::<L>(&stream, &grid, samples, begin, n);
                    run.world
                        .evaluate_unidirectional::<L>(&layout, samples, n, paths);
                    sums.add(paths.outcome.iter().enumerate().map(|(i, o)| Sample {
                        raster: o.raster,
                        colour: o.rgb,
                        pass: (begin + i as u64) / per_pass,
                    }));
                    let bad = paths.outcome.iter().map(|o| u64::from(o.rejected)).sum();
                    (paths.rays - before, bad)
                },
            )
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        rays += counts.0;
        rejected += counts.1;
        done = until;
        run.observer.progress(Phase::Render, done, total);
        if done < total {
            let reached = good_enough(run, &sums, &grid, done, &mut looks);
            ended_by = run.ended().or(reached.then_some(EndedBy::Target));
        }
        step = ((step as f64 * run.pace(begin.elapsed())) as u64).max(batch);
    }
    let (width, height) = run.size();
    let passes = grid.passes(done, sums.filter());
    let pixels = sums.resolve(&passes);
    // One pass is compared with nothing.
    let judged = settings.estimate_error && passes.whole >= 2;
    let variance = (judged && settings.error_layers)
        .then(|| sums.resolve_with_error(0..pixels.len(), &passes).1);
    let relmse = judged.then(|| relmse_of(run, &sums, &passes));
    let mean: f64 = pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let groups = tile_sums(&sums, &passes, width as usize);
    let tiles = settings.estimate_error.then(|| {
        let layer = Groups {
            sums: &groups,
            thrown: thrown(passes.whole.max(1)),
            scale: 1.0 / passes.whole.max(1) as f64,
            relative_variance: 0.0,
        };
        Tiles::of(sums.tiling(), &[layer])
    });
    let mut warnings = Vec::new();
    if passes.whole == 0 && spp > 0 {
        warnings.push(format!(
            "stopped in the first pass over the picture: {:.1} % of it is rendered",
            100.0 * done as f64 / per_pass as f64
        ));
    }
    let render_seconds = start.elapsed().as_secs_f64();
    Render {
        stats: Stats {
            integrator: "pt".into(),
            samples: done,
            samples_per_second: per_second(done, render_seconds),
            rays,
            render_seconds,
            b: mean / (3.0 * pixels.len().max(1) as f64),
            b_stderr: whole(&groups, passes.whole) / pixels.len().max(1) as f64,
            tiles,
            relmse,
            rejected_nonfinite: rejected,
            ..Stats::default()
        },
        pixels,
        width,
        height,
        warnings,
        variance,
        ended_by: ended_by.unwrap_or(EndedBy::Effort),
    }
}

/// What has fallen into each tile by group, as if no pass had been broken off: a part of a pass makes its group's sum more certain, not
/// larger.
fn tile_sums(sums: &SampleFilm, passes: &Passes, width: usize) -> Vec<[f64; GROUPS]> {
    let mut tiles = sums.tile_sums();
    let group = passes.whole as usize % GROUPS;
    let regular = thrown(passes.whole.max(1))[group];
    let tiling = sums.tiling();
    let [left, _, top, _] = tiling.bounds(0);
    for (tile, sums) in tiles.iter_mut().enumerate() {
        let [x0, x1, y0, y1] = tiling.bounds(tile);
        let rows = y0 - top..y1 - top;
        let part: f64 = rows
            .flat_map(|y| (x0 - left..x1 - left).map(move |x| y as usize * width + x as usize))
            .map(|pixel| passes.part(pixel))
            .sum();
        let part = part / f64::from(tiling.pixels(tile));
        let made = if passes.whole == 0 {
            part
        } else {
            regular + part
        };
        sums[group] *= if made > 0.0 { regular / made } else { 0.0 };
    }
    tiles
}

/// Passes in each group.
fn thrown(passes: u64) -> [f64; GROUPS] {
    std::array::from_fn(|g| (passes.saturating_sub(g as u64)).div_ceil(GROUPS as u64) as f64)
}

/// Standard error of the sum over the whole picture; 0 if there are not two passes.
fn whole(groups: &[[f64; GROUPS]], passes: u64) -> f64 {
    let count = passes.min(GROUPS as u64) as f64;
    if count < 2.0 {
        return 0.0;
    }
    let mut sums = [0.0; GROUPS];
    for tile in groups {
        sums.iter_mut().zip(tile).for_each(|(sum, v)| *sum += v);
    }
    let mean = sums.iter().sum::<f64>() / passes as f64;
    let spread: f64 = (sums.iter().zip(thrown(passes)))
        .map(|(sum, n)| (sum - mean * n).powi(2))
        .sum();
    (spread * count / (count - 1.0)).sqrt() / passes as f64
}

/// Looks at the error now and then, tells the observer, and says whether the target is reached.
fn good_enough(run: &Run, sums: &SampleFilm, grid: &Grid, done: u64, looks: &mut Looks) -> bool {
    if !run.settings.estimate_error || done < 2 * grid.cells() {
        return false;
    }
    let seen = looks.look(|| {
        let error = relmse_of(run, sums, &grid.passes(done, sums.filter())).sqrt();
        run.observer.error(error);
        run.settings
            .target_error
            .is_some_and(|target| error <= target)
    });
    seen == Some(true)
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

    /// What `done` samples come to.
    fn passes(&self, done: u64, filter: &FilterTable) -> Passes {
        let (whole, rest) = (done / self.cells(), done % self.cells());
        if rest == 0 {
            return Passes::whole(whole);
        }
        let (row, column) = (rest / self.columns, rest % self.columns);
        let border = [self.x0 + column as f64, self.y0 + row as f64];
        Passes::with_part(whole, filter, border)
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
        let (low, size) = ([grid.x0, grid.y0][axis], grid.size[axis]);
        // A number next to the border must not be rounded into the next cell.
        let edge = (size * f64::from(f32::EPSILON)).min(0.25);
        for (i, u) in samples.row_mut(axis)[..n].iter_mut().enumerate() {
            let cell = (begin + i as u64) % grid.cells();
            let cell = [cell % grid.columns, cell / grid.columns][axis] as f64;
            let inside = f64::from(*u).clamp(edge, 1.0 - edge);
            *u = ((low + cell + inside - grid.origin[axis]) / size) as f32;
        }
    }
}

/// Estimated relMSE of the picture so far.
fn relmse_of(run: &Run, sums: &SampleFilm, passes: &Passes) -> f64 {
    let (width, height) = run.size();
    let width = width as usize;
    let scale = run.scene.film.scale;
    relmse(width, height as usize, |rows| {
        let pixels = rows.start * width..rows.end * width;
        let (mut picture, mut variance) = sums.resolve_with_error(pixels, passes);
        let values = |pixels: &mut Vec<[f32; 3]>, factor: f32| {
            pixels
                .as_flattened_mut()
                .iter_mut()
                .for_each(|v| *v *= factor);
        };
        values(&mut picture, scale);
        values(&mut variance, scale * scale);
        (picture, variance)
    })
}
