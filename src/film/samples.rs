//! Exact sums of radiance samples, as a path tracer makes them.

mod saved;

use super::sum::Sums;
use super::tile_sums::TileSums;
use super::{FilterTable, GROUPS, Passes, Tiling};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard};

/// Film for radiance samples of any size that `f32` has (`film::sum`).
///
/// A film whose samples were placed, in each cell as many, divides what a pixel's filter has seen
/// by what it has weighed, so that a picture of one value is flat, however few samples there are.
/// That is a ratio of two sums, as pbrt-v3 has it: right in the limit of many samples, and
/// off by less than its noise before. Where a filter has negative lobes the weights of a few
/// samples can cancel each other, and
///
/// ```text
/// radiance = (A - S m) / n + m
/// ```
///
/// with `A` and `S` the sums of weighted samples and of weights, `n` the passes and `m` the plain
/// mean of the samples that lie in the pixel: as flat, and the same in the limit (a regression
/// estimator; Cochran 1977, chapter 7). What was splatted, wherever it fell, is divided by the
/// number of passes alone.
///
/// A film that knows its own error ([`Self::judged`]) sums even and odd passes over the picture
/// apart, and the samples of [`GROUPS`] groups of passes tile by tile.
pub struct SampleFilm {
    filter: FilterTable,
    weighing: Weighing,
    /// Sums of a pixel: three channels, and its weights.
    entries: usize,
    /// `[half][block]`, each `[pixel][entry]`.
    halves: Vec<Vec<Mutex<Sums>>>,
    /// `[block]`, each `[pixel][channel]`: samples that lie in the pixel, as they are. Empty where
    /// no weight is negative.
    inside: Vec<Mutex<Sums>>,
    /// Of nothing if the film is not judged.
    tiles: TileSums,
    /// Some sample was not black.
    lit: AtomicBool,
    /// Sums that were full.
    full: AtomicU64,
}

/// How sums become radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Weighing {
    /// By the number of passes.
    Passes,
    /// By the weights of the samples.
    Weights,
    /// By both: some weights are negative.
    Signed,
}

impl Weighing {
    /// Of placed samples.
    fn of(filter: &FilterTable) -> Self {
        match (filter.is_single(), filter.is_signed()) {
            (true, _) => Self::Passes,
            (false, false) => Self::Weights,
            (false, true) => Self::Signed,
        }
    }
}

/// Pixels of a block.
const BLOCK: usize = 1024;
/// Pixels that are resolved at a time.
const BAND: usize = 4096;

/// A radiance sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// In pixels.
    pub raster: [f32; 2],
    /// Radiance, linear sRGB.
    pub colour: [f32; 3],
    /// Number of the pass over the picture that it belongs to: passes are independent and alike.
    pub pass: u64,
}

/// A pixel's radiance, and a number for each channel whose square is its squared standard error:
/// infinite if there is but one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Estimate {
    pub radiance: [f64; 3],
    pub deviation: [f64; 3],
}

impl Estimate {
    /// As pictures and layers hold them.
    pub fn narrow(&self) -> ([f32; 3], [f32; 3]) {
        let radiance = self.radiance.map(|v| v as f32);
        (radiance, self.deviation.map(|v| v.abs() as f32))
    }
}

impl SampleFilm {
    /// Of samples that are placed in the cells of the raster.
    pub fn new(filter: FilterTable) -> Self {
        Self::placed(filter, false)
    }

    /// A film that knows its own error.
    pub fn judged(filter: FilterTable) -> Self {
        Self::placed(filter, true)
    }

    pub(super) fn placed(filter: FilterTable, judged: bool) -> Self {
        let weighing = Weighing::of(&filter);
        let entries = match weighing {
            Weighing::Passes => 3,
            Weighing::Weights | Weighing::Signed => 4,
        };
        Self::with(filter, judged, weighing, entries)
    }

    /// Of samples that fall where they like.
    pub(super) fn splatted(filter: FilterTable, judged: bool) -> Self {
        Self::with(filter, judged, Weighing::Passes, 3)
    }

    /// Of a part of the light that the samples of another film bring, which has their weights
    /// ([`Self::resolve_part`]).
    pub fn part(filter: FilterTable) -> Self {
        let weighing = Weighing::of(&filter);
        Self::with(filter, false, weighing, 3)
    }

    /// The same of samples that fall where they like.
    pub fn splatted_part(filter: FilterTable) -> Self {
        Self::splatted(filter, false)
    }

    /// Bytes of a pixel of placed samples, or of others.
    pub fn bytes(filter: &FilterTable, placed: bool, judged: bool) -> u64 {
        let [entries, inside] = match Weighing::of(filter) {
            Weighing::Weights if placed => [4, 0],
            Weighing::Signed if placed => [4, 3],
            _ => [3, 0],
        };
        (entries * (1 + u64::from(judged)) + inside) * Sums::BYTES
    }

    fn with(filter: FilterTable, judged: bool, weighing: Weighing, entries: usize) -> Self {
        let n = filter.pixels();
        let blocks = |entries: usize| {
            (0..n.div_ceil(BLOCK))
                .map(|b| Mutex::new(Sums::new(BLOCK.min(n - b * BLOCK), entries)))
                .collect()
        };
        let tiling = Tiling::new(filter.crop());
        Self {
            halves: (0..1 + usize::from(judged))
                .map(|_| blocks(entries))
                .collect(),
            inside: match weighing {
                Weighing::Signed => blocks(3),
                _ => Vec::new(),
            },
            tiles: TileSums::new(tiling, judged, weighing != Weighing::Passes),
            filter,
            weighing,
            entries,
            lit: AtomicBool::new(false),
            full: AtomicU64::new(0),
        }
    }

    /// Its tiles.
    pub fn tiling(&self) -> &Tiling {
        self.tiles.tiling()
    }

    /// No sample has had any light.
    pub fn is_black(&self) -> bool {
        !self.lit.load(Relaxed)
    }

    /// How often a sum was full and stayed as it was.
    pub fn full(&self) -> u64 {
        self.full.load(Relaxed)
    }

    /// Adds samples; fastest if neighbours follow each other.
    pub fn add(&self, samples: impl Iterator<Item = Sample>) {
        match self.entries {
            3 => self.add_entries(samples, |[r, g, b], _| [r, g, b]),
            _ => self.add_entries(samples, |[r, g, b], w| [r, g, b, w]),
        }
    }

    /// The same; `entries` makes what a pixel sums of a weighted colour and its weight.
    #[inline(always)]
    fn add_entries<const N: usize>(
        &self,
        samples: impl Iterator<Item = Sample>,
        entries: impl Fn([f64; 3], f64) -> [f64; N],
    ) {
        let mut tiles = self.tiles.pending();
        let (mut lit, mut full) = (false, 0);
        let mut held = Held::default();
        // Placed samples lie only where the filter of their cell's pixel is: there are more of
        // them.
        let dense = match self.weighing {
            Weighing::Passes => 1.0,
            Weighing::Weights | Weighing::Signed => self.filter.cell(0) * self.filter.cell(1),
        };
        for Sample {
            raster,
            colour,
            pass,
        } in samples
        {
            lit |= colour != [0.0; 3];
            let half = pass as usize % self.halves.len();
            let colour = colour.map(f64::from);
            self.filter.rows(raster, |first, weights, row| {
                for (i, w) in weights.iter().enumerate() {
                    let w = f64::from(*w) * row * dense;
                    let block = held.of(&self.halves[half], (first + i) / BLOCK);
                    full += block.add((first + i) % BLOCK, entries(colour.map(|v| v * w), w));
                }
            });
            if !self.inside.is_empty() && self.filter.contains(raster) {
                let pixel = self.filter.nearest(raster);
                full += lock(&self.inside[pixel / BLOCK]).add(pixel % BLOCK, colour);
            }
            let [r, g, b] = colour;
            tiles.add(&self.filter, raster, (r + g + b) / 3.0, pass, dense);
        }
        full += tiles.end();
        if lit && self.is_black() {
            self.lit.store(true, Relaxed);
        }
        if full > 0 {
            self.full.fetch_add(full, Relaxed);
        }
    }

    /// The filter.
    pub fn filter(&self) -> &FilterTable {
        &self.filter
    }

    /// The picture after so many passes; black where there has been none.
    pub fn resolve(&self, passes: &Passes) -> Vec<[f32; 3]> {
        self.resolve_part(self, passes)
    }

    /// The same of a film of a part of the light, with the weights of the film of all of it: parts
    /// add up to the whole.
    pub fn resolve_part(&self, whole: &SampleFilm, passes: &Passes) -> Vec<[f32; 3]> {
        let n = self.filter.pixels();
        let mut picture = Vec::with_capacity(n);
        for first in (0..n).step_by(BAND) {
            let band = self.estimates(whole, first..n.min(first + BAND), passes);
            picture.extend(band.iter().map(|e| e.narrow().0));
        }
        picture
    }

    /// Pixels of the picture, and a standard error of each of their values from the difference of
    /// the halves alone; infinite if there is but one. Its square is right in the mean.
    ///
    /// # Panics
    /// If the film is not judged.
    pub fn resolve_with_error(
        &self,
        pixels: Range<usize>,
        passes: &Passes,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        assert_eq!(self.halves.len(), 2);
        let estimates = self.estimates(self, pixels, passes);
        estimates.iter().map(Estimate::narrow).unzip()
    }

    /// What is known of pixels, with the weights of `whole`.
    pub(super) fn estimates(
        &self,
        whole: &SampleFilm,
        pixels: Range<usize>,
        passes: &Passes,
    ) -> Vec<Estimate> {
        match whole.weighing {
            Weighing::Passes => (self.held(pixels.clone()).into_iter().zip(pixels))
                .map(|(held, pixel)| held.by_passes(Turns::of(passes, pixel)))
                .collect(),
            Weighing::Weights => {
                let weights = whole.held(pixels.clone()).into_iter();
                (self
                    .held(pixels.clone())
                    .into_iter()
                    .zip(weights)
                    .zip(pixels))
                .map(|((held, w), pixel)| held.by_weights(w.weight(), Turns::of(passes, pixel)))
                .collect()
            }
            Weighing::Signed => self.signed(whole, pixels, passes),
        }
    }

    fn signed(&self, whole: &SampleFilm, pixels: Range<usize>, passes: &Passes) -> Vec<Estimate> {
        let weights = whole.held(pixels.clone()).into_iter();
        let held = self.held(pixels.clone()).into_iter().zip(weights);
        let means = self.means(pixels.clone(), passes).into_iter();
        (held.zip(means).zip(pixels))
            .map(|(((held, w), mean), pixel)| {
                let mut estimate = held.signed(w.weight(), mean, Turns::of(passes, pixel));
                if passes.inside(pixel) <= 0.0 {
                    // It waits for its own sample.
                    estimate.radiance = [0.0; 3];
                }
                estimate
            })
            .collect()
    }

    /// Plain means of the samples in each pixel.
    fn means(&self, pixels: Range<usize>, passes: &Passes) -> Vec<[f64; 3]> {
        let mean = |pixel: usize| {
            let block = lock(&self.inside[pixel / BLOCK]);
            let over = over(passes.inside(pixel));
            std::array::from_fn(|c| block.get(pixel % BLOCK, c).value() * over)
        };
        pixels.map(mean).collect()
    }

    /// What pixels hold.
    fn held(&self, pixels: Range<usize>) -> Vec<PixelHalves> {
        let mut held = vec![PixelHalves::default(); pixels.len()];
        let mut next = pixels.start;
        while next < pixels.end {
            let block = next / BLOCK;
            let end = pixels.end.min((block + 1) * BLOCK);
            for (half, blocks) in self.halves.iter().enumerate() {
                let sums = lock(&blocks[block]);
                for pixel in next..end {
                    let to = &mut held[pixel - pixels.start].0[half];
                    for (i, to) in to.iter_mut().take(self.entries).enumerate() {
                        *to = sums.get(pixel % BLOCK, i).value();
                    }
                }
            }
            next = end;
        }
        held
    }

    /// Sums of the mean channel over the pixels of each tile, by group: pass modulo [`GROUPS`].
    pub fn tile_sums(&self) -> Vec<[f64; GROUPS]> {
        self.tiles.light()
    }

    /// Sums of the weights that pixels are divided by, the same way; `None` if that is the number
    /// of passes.
    pub(super) fn tile_weights(&self) -> Option<Vec<[f64; GROUPS]>> {
        self.tiles.weights()
    }
}

/// Passes over a pixel, and those of each half.
#[derive(Clone, Copy)]
struct Turns {
    all: f64,
    halves: [f64; 2],
}

impl Turns {
    fn of(passes: &Passes, pixel: usize) -> Self {
        Self {
            all: passes.at(pixel),
            halves: passes.halves(pixel),
        }
    }

    /// What the difference of the means of two halves comes to in the mean of all; infinite if
    /// there is but one half.
    fn weigh(self, difference: impl FnOnce([f64; 2]) -> f64) -> f64 {
        let [even, odd] = self.halves;
        match odd > 0.0 {
            true => (even * odd).sqrt() * over(self.all) * difference([1.0 / even, 1.0 / odd]),
            false => f64::INFINITY,
        }
    }
}

/// What a pixel holds, by half: its channels, and its weights.
#[derive(Clone, Copy, Default)]
struct PixelHalves([[f64; 4]; 2]);

impl PixelHalves {
    fn weight(&self) -> [f64; 2] {
        self.0.map(|half| half[3])
    }

    /// An estimate of each channel and its deviation.
    fn channels(&self, estimate: impl Fn([f64; 2]) -> [f64; 2]) -> Estimate {
        let mut whole = Estimate::default();
        for c in 0..3 {
            let [radiance, deviation] = estimate([self.0[0][c], self.0[1][c]]);
            whole.radiance[c] = radiance;
            whole.deviation[c] = deviation;
        }
        whole
    }

    fn by_passes(&self, turns: Turns) -> Estimate {
        self.channels(|[a, b]| {
            let difference = turns.weigh(|[even, odd]| a * even - b * odd);
            [(a + b) * over(turns.all), difference]
        })
    }

    fn by_weights(&self, [v, w]: [f64; 2], turns: Turns) -> Estimate {
        let seen = turns.all > 0.0;
        self.channels(|[a, b]| {
            let mean = if seen { (a + b) * over(v + w) } else { 0.0 };
            // A ratio of sums, linearised (Cochran 1977, equation 2.39).
            let part = turns.weigh(|[even, odd]| (a - v * mean) * even - (b - w * mean) * odd);
            let deviation = part * turns.all * over(v + w);
            [mean, if part.is_finite() { deviation } else { part }]
        })
    }

    fn signed(&self, [v, w]: [f64; 2], mean: [f64; 3], turns: Turns) -> Estimate {
        let mut whole = Estimate::default();
        for (c, mean) in mean.into_iter().enumerate() {
            let [a, b] = [self.0[0][c] - v * mean, self.0[1][c] - w * mean];
            if turns.all > 0.0 {
                whole.radiance[c] = mean + (a + b) / turns.all;
            }
            whole.deviation[c] = turns.weigh(|[even, odd]| a * even - b * odd);
        }
        whole
    }
}

/// A block that is locked until another one is wanted: neighbours are mostly in the same.
#[derive(Default)]
struct Held<'a>(Option<(&'a Mutex<Sums>, MutexGuard<'a, Sums>)>);

impl<'a> Held<'a> {
    /// The block, locked. No other is locked at the same time: threads never wait for each other
    /// in a circle.
    #[inline(always)]
    fn of(&mut self, blocks: &'a [Mutex<Sums>], block: usize) -> &mut Sums {
        let wanted = &blocks[block];
        if !matches!(&self.0, Some((held, _)) if std::ptr::eq(*held, wanted)) {
            self.0 = None;
        }
        &mut self.0.get_or_insert_with(|| (wanted, lock(wanted))).1
    }
}

fn over(n: f64) -> f64 {
    if n > 0.0 { 1.0 / n } else { 0.0 }
}

/// A thread that panicked while adding integers has left them whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[cfg(test)]
mod tests;
