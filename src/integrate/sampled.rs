//! Integrators of independent samples, a fixed number per pixel: what they share is everything but
//! what a sample is.

mod chances;
mod look;
pub(super) mod part;
mod saved;
mod seen;

use super::chance::ChanceStats;
use super::error::{Groups, Looks, Tiles, relmse};
use super::grid::Grid;
use super::{EndedBy, Phase, Render, Run, Stats, black_reason, per_second};
use crate::chain::discoveries::Discoveries;
use crate::checkpoint::{Malformed, Reader};
use crate::film::{Done, FilterTable, GROUPS, SEQUENCES, Sample, SplattingFilm};
use crate::plan::{Layout, Pair};
use crate::scene::Clamp;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::paths::Splats;
use crate::transport::samples::Samples;
use crate::transport::{Paths, Splat};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Paths evaluated at a time unless the settings say otherwise.
pub(super) const BATCH: usize = 1024;
/// Samples of the first round.
const FIRST: u64 = 1 << 16;

/// What a sample is.
pub(super) struct Method<'a> {
    pub name: &'static str,
    pub purpose: Purpose,
    /// Where its primary samples are; the first two are its raster position.
    pub layout: &'a Layout,
    /// It also splats light elsewhere: [`Paths::splats`].
    pub splats: bool,
    /// Evaluates the first so many columns.
    pub evaluate: &'a (dyn Fn(&Samples, usize, &mut Paths) + Sync),
    /// Called with evaluated paths, and the number of the first of them: an integrator takes from
    /// them what it wants besides their splats.
    pub collect: &'a (dyn Fn(&Paths, Numbers) + Sync),
}

/// Which samples a batch holds.
#[derive(Clone, Copy)]
pub(super) struct Numbers {
    begin: u64,
    per_pass: u64,
    /// See [`Grid::cover`].
    cover: f32,
}

impl Numbers {
    /// Light that path `i` brings to its own place.
    pub fn placed(self, i: usize, raster: [f32; 2], colour: [f32; 3]) -> Sample {
        Sample {
            raster,
            colour,
            pass: (self.begin + i as u64) / self.per_pass,
        }
    }

    /// Light that it splats, normalised to a pass.
    pub fn splat(self, i: usize, raster: [f32; 2], colour: [f32; 3]) -> Sample {
        self.placed(i, raster, colour.map(|v| v * self.cover))
    }
}

/// A render, its film, and how far it came.
pub(super) struct Sampled {
    pub render: Render,
    pub film: SplattingFilm,
    pub done: Done,
}

/// How much has been done.
pub(super) struct Counts {
    pub samples: u64,
    pub rays: u64,
    pub rejected: u64,
}

/// Samples on their way to a picture.
pub(super) struct Sampling<'a> {
    run: &'a Run<'a>,
    method: &'a Method<'a>,
    fill: fn(&Grid, &Stream, &[Pair], &mut Samples, u64, usize),
    stream: Stream,
    pairs: Vec<Pair>,
    grid: Grid,
    sums: SplattingFilm,
    /// Those to make, by their numbers in all passes.
    range: Range<u64>,
    /// All before this one are made.
    done: u64,
    rays: u64,
    rejected: u64,
    /// Of what only chance finds.
    found: Mutex<Discoveries>,
    /// Seconds that an earlier process has taken for them, and when this one began.
    before: f64,
    since: Instant,
    /// Those that no thread uses: they are large, and made once.
    workspaces: Mutex<Vec<(Box<Paths>, Samples)>>,
}

pub(super) fn render<L: Lanes>(
    run: &Run,
    method: &Method,
    from: &mut [Reader],
) -> Result<Sampled, Malformed> {
    let mut sampling = Sampling::new::<L>(run, method, run.settings.samples_per_pixel);
    if !from.is_empty() {
        sampling.load(from)?;
        from.iter().try_for_each(Reader::end)?;
    }
    run.lead(|to| sampling.save_start(to));
    let Range { start, end } = sampling.range.clone();
    let batch = run.settings.batch.unwrap_or(BATCH) as u64;
    let mut step = FIRST;
    let mut looks = Looks::new();
    let mut ended_by = None;
    while sampling.done < end && ended_by.is_none() {
        let begin = Instant::now();
        let done = (run.team()).agree(sampling.done.saturating_add(step).min(end));
        sampling.advance(done);
        (run.observer).progress(Phase::Render, done - start, end - start);
        if done < end {
            ended_by = run.ended(true);
            if ended_by.is_none() {
                ended_by = sampling.look(&mut looks)?;
            }
        }
        step = ((step as f64 * run.pace(begin.elapsed())) as u64).max(batch);
    }
    sampling.gather()?;
    if run.team().leads() {
        if run.is_kept(true) {
            run.keep(true, |to| sampling.save(to));
        }
        run.show(run.observer.wants_picture(true), |judged| {
            sampling.see(judged)
        });
    }
    Ok(sampling.finish(ended_by.unwrap_or(EndedBy::Effort)))
}

impl<'a> Sampling<'a> {
    /// No sample yet, of so many per pixel.
    pub fn new<L: Lanes>(run: &'a Run, method: &'a Method, spp: u64) -> Self {
        let film = run.film;
        let filter = FilterTable::new(&film.filter, film.crop);
        let grid = Grid::new(run, &filter);
        let range = run.share(spp.saturating_mul(grid.cells()), 1);
        Self {
            run,
            method,
            fill: Grid::fill::<L>,
            stream: Stream::new(run.settings.seed, method.purpose),
            pairs: method.layout.pairs(),
            sums: SplattingFilm::new(filter, run.settings.estimate_error, method.splats),
            done: range.start,
            range,
            grid,
            rays: 0,
            rejected: 0,
            found: Mutex::default(),
            before: 0.0,
            since: Instant::now(),
            workspaces: Mutex::default(),
        }
    }

    /// An empty film like its own.
    fn film(&self) -> SplattingFilm {
        let filter = self.sums.filter().clone();
        SplattingFilm::new(filter, self.run.settings.estimate_error, self.method.splats)
    }

    /// Makes samples until there are so many, together with the other processes of a team.
    pub fn advance(&mut self, until: u64) {
        let (run, method, film) = (self.run, self.method, self.run.film);
        let batch = run.settings.batch.unwrap_or(BATCH) as u64;
        let (done, per_pass) = (self.done, self.grid.cells());
        let cover = self.grid.cover() as f32;
        // What chains may bring as well is not cut down: they never are.
        let clamps = !run.settings.integrator.mutates();
        // Chunks are dealt out in turn: some parts of the picture take longer than others.
        let (rank, size) = (run.team().rank() as u64, run.team().size() as u64);
        let chunks = until.saturating_sub(done).div_ceil(batch);
        let own = chunks.saturating_sub(rank).div_ceil(size);
        let counts = (0..own)
            .into_par_iter()
            .map(|turn| {
                let chunk = rank + turn * size;
                let spare = lock(&self.workspaces).pop();
                let (mut paths, mut samples) = spare.unwrap_or_else(|| {
                    let samples = Samples::new(method.layout.total, batch as usize);
                    (Box::new(Paths::new(run.world)), samples)
                });
                let begin = done + chunk * batch;
                let n = (until - begin).min(batch) as usize;
                let before = paths.rays.traced;
                (self.fill)(
                    &self.grid,
                    &self.stream,
                    &self.pairs,
                    &mut samples,
                    begin,
                    n,
                );
                (method.evaluate)(&samples, n, &mut paths);
                if let Some(clamp) = film.clamp.filter(|_| clamps) {
                    clamp_all(clamp, &mut paths);
                }
                let numbers = Numbers {
                    begin,
                    per_pass,
                    cover,
                };
                let bad = add(&self.sums, method, &paths, numbers);
                self.discover(&paths.splats.camera);
                (method.collect)(&paths, numbers);
                let rays = paths.rays.traced - before;
                lock(&self.workspaces).push((paths, samples));
                (rays, bad)
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        self.rays += counts.0;
        self.rejected += counts.1;
        self.done = self.done.max(until);
    }

    /// Makes this part of all samples, if it is more than has been made.
    pub fn advance_to(&mut self, part: f64) {
        let until = if part < 1.0 {
            let count = self.range.end - self.range.start;
            self.range.start + (count as f64 * part) as u64
        } else {
            self.range.end
        };
        self.advance(until);
    }

    /// Samples made, rays traced, and how many contributions were not finite or negative.
    pub fn counts(&self) -> Counts {
        Counts {
            samples: self.done - self.range.start,
            rays: self.rays,
            rejected: self.rejected,
        }
    }

    /// There are passes to compare with each other.
    pub fn is_judged(&self) -> bool {
        self.run.settings.estimate_error && self.made().placed.whole >= 2
    }

    /// The picture so far.
    pub fn picture(&self) -> Vec<[f32; 3]> {
        self.sums.resolve(&self.made())
    }

    /// Pixels of the picture as written, and a standard error of each of their values whose square
    /// is right in the mean.
    ///
    /// # Panics
    /// If errors are not estimated.
    pub fn with_error(&self, pixels: Range<usize>, scale: f32) -> [Vec<[f32; 3]>; 2] {
        let (mut picture, mut deviation) = self.sums.resolve_with_error(pixels, &self.made());
        for values in [&mut picture, &mut deviation] {
            let values = values.as_flattened_mut().iter_mut();
            values.for_each(|v| *v *= scale);
        }
        [picture, deviation]
    }

    /// Light in each tile, by group of passes.
    pub fn tile_sums(&self) -> Vec<[f64; GROUPS]> {
        self.sums.tile_sums(&self.made())
    }

    /// Tile sums as a layer of the picture's tiles.
    pub fn layer<'b>(&self, sums: &'b [[f64; GROUPS]]) -> Groups<'b> {
        layer(sums, self.made().placed.whole)
    }

    /// Standard error of the mean radiance.
    pub fn mean_error(&self, sums: &[[f64; GROUPS]]) -> f64 {
        let pixels = self.sums.filter().pixels().max(1) as f64;
        whole_error(sums, self.made().placed.whole) / pixels
    }

    /// What has been done.
    fn made(&self) -> Done {
        self.grid.done(self.done, self.sums.filter())
    }

    /// The picture, and what is known of it.
    pub fn finish(self, ended_by: EndedBy) -> Sampled {
        let Self {
            run, method, sums, ..
        } = &self;
        let settings = run.settings;
        let (width, height) = run.size();
        let [offset, full] = run.window();
        let made = self.made();
        let whole = made.placed.whole;
        let pixels = sums.resolve(&made);
        let black = pixels.iter().all(|p| *p == [0.0; 3]);
        // One pass is compared with nothing, and black is not known to be right.
        let judged = settings.estimate_error && whole >= 2 && !black;
        let deviation = (judged && settings.error_layers)
            .then(|| sums.resolve_with_error(0..pixels.len(), &made).1);
        let relmse = judged.then(|| self.relmse());
        let mean: f64 = pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        let groups = sums.tile_sums(&made);
        let tiles =
            (settings.estimate_error).then(|| Tiles::of(sums.tiling(), &[layer(&groups, whole)]));
        let b = mean / (3.0 * pixels.len().max(1) as f64);
        let chance = self.chances(b);
        let mut warnings = self.warnings(&made, black);
        warnings.extend(chance.iter().filter_map(ChanceStats::warning));
        let render_seconds = self.before + self.since.elapsed().as_secs_f64();
        let render = Render {
            stats: Stats {
                integrator: method.name.into(),
                samples: self.counts().samples,
                samples_per_second: per_second(self.counts().samples, render_seconds),
                rays: self.rays,
                render_seconds,
                b,
                chance,
                b_stderr: whole_error(&groups, whole) / pixels.len().max(1) as f64,
                tiles,
                relmse,
                rejected_nonfinite: self.rejected,
                ..Stats::default()
            },
            pixels,
            width,
            height,
            offset,
            full,
            warnings,
            deviation,
            strategies: Vec::new(),
            ended_by,
        };
        Sampled {
            render,
            film: self.sums,
            done: made,
        }
    }

    /// Estimated relMSE of the picture so far.
    fn relmse(&self) -> f64 {
        let (width, height) = self.run.size();
        let width = width as usize;
        let scale = self.run.film.scale;
        relmse(width, height as usize, |rows| {
            let pixels = rows.start * width..rows.end * width;
            let [picture, deviation] = self.with_error(pixels, scale);
            (picture, deviation)
        })
    }

    /// What is worth a warning.
    pub fn warned(&self) -> Vec<String> {
        self.warnings(&self.made(), false)
    }

    fn warnings(&self, made: &Done, black: bool) -> Vec<String> {
        let (run, done) = (self.run, self.done);
        let mut warnings = Vec::new();
        if made.placed.whole == 0 && self.range.end > 0 {
            warnings.push(format!(
                "stopped in the first pass over the picture: {:.1} % of it is rendered",
                100.0 * done as f64 / self.grid.cells() as f64
            ));
        }
        if self.sums.full() > 0 {
            warnings.push(format!(
                "{} sums of the film were full and stayed as they were: the brightest pixels are too dark",
                self.sums.full()
            ));
        }
        if black && done > 0 {
            warnings.push(black_reason(run, &format!("none of the {done} samples")));
        }
        warnings
    }
}

/// Sums of the groups of passes as a layer of the picture's tiles.
fn layer(groups: &[[f64; GROUPS]], whole: u64) -> Groups<'_> {
    Groups {
        sums: groups,
        thrown: SplattingFilm::thrown(whole.max(1)),
        scale: 1.0 / whole.max(1) as f64,
        relative_variance: 0.0,
    }
}

/// A thread that panicked while it held the lock has left what is shared whole.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Cuts what a batch brings down to what the scene allows.
fn clamp_all(clamp: Clamp, paths: &mut Paths) {
    let Splats { camera, light, .. } = &mut paths.splats;
    for splat in camera.iter_mut().chain(light.iter_mut().flatten()) {
        splat.rgb = clamp.of(splat.rgb);
    }
}

/// Adds a batch to the film; how many of its contributions were rejected.
fn add(sums: &SplattingFilm, method: &Method, paths: &Paths, numbers: Numbers) -> u64 {
    sums.add(
        (paths.splats.camera.iter().enumerate()).map(|(i, o)| numbers.placed(i, o.raster, o.rgb)),
    );
    let rejected = |splats: &[Splat]| splats.iter().map(|o| u64::from(o.rejected)).sum();
    let mut bad: u64 = rejected(&paths.splats.camera);
    if method.splats {
        for splats in &paths.splats.light {
            let lit = (splats.iter().enumerate()).filter(|(_, o)| o.rgb != [0.0; 3]);
            sums.splat(lit.map(|(i, o)| numbers.splat(i, o.raster, o.rgb)));
            bad += rejected(splats);
        }
    }
    bad
}

/// Standard error of the sum over the whole picture; 0 if there are not two passes.
fn whole_error(groups: &[[f64; GROUPS]], passes: u64) -> f64 {
    let count = passes.min(SEQUENCES as u64) as f64;
    if count < 2.0 {
        return 0.0;
    }
    let mut sums = [0.0; GROUPS];
    for tile in groups {
        sums.iter_mut().zip(tile).for_each(|(sum, v)| *sum += v);
    }
    let mean = sums.iter().sum::<f64>() / passes as f64;
    let spread: f64 = (sums.iter().zip(SplattingFilm::thrown(passes)))
        .map(|(sum, n)| (sum - mean * n).powi(2))
        .sum();
    (spread * count / (count - 1.0)).sqrt() / passes as f64
}
