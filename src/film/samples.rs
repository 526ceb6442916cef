//! Exact sums of radiance samples, as a path tracer makes them.

use super::format::Format;
use super::{FilterTable, GROUPS, Passes, Tiling};
use std::ops::Range;
use std::sync::{Mutex, MutexGuard};

/// Film for radiance samples of any finite size: 128-bit fixed point with 60 fractional bits.
///
/// A sum that reaches 2^67 stays there. Where no filter weight is negative that, too, is the same in any order.
///
/// A film that knows its own error ([`Self::judged`]) sums even and odd passes over the picture apart, and the samples of [`GROUPS`] groups
/// of passes tile by tile.
pub struct SampleFilm {
    filter: FilterTable,
    tiling: Tiling,
    /// `[half][block]`, each `[pixel][channel]`.
    halves: Vec<Vec<Mutex<Vec<i128>>>>,
    /// `[row of tiles]`, each `[column][group]`: sums of the mean channel. Empty: the film is not judged.
    tiles: Vec<Mutex<Vec<[i128; GROUPS]>>>,
}

/// Pixels of a block.
const BLOCK: usize = 1024;

/// A radiance sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// In pixels.
    pub raster: [f32; 2],
    pub colour: [f32; 3],
    /// Number of the pass over the picture that it belongs to: passes are independent and alike.
    pub pass: u64,
}

impl SampleFilm {
    const UNIT: f64 = (1u64 << 60) as f64;

    pub fn new(filter: FilterTable) -> Self {
        Self::with(filter, false)
    }

    /// A film that knows its own error.
    pub fn judged(filter: FilterTable) -> Self {
        Self::with(filter, true)
    }

    fn with(filter: FilterTable, judged: bool) -> Self {
        let n = filter.pixels();
        let blocks = || {
            (0..n.div_ceil(BLOCK))
                .map(|b| Mutex::new(vec![0; 3 * BLOCK.min(n - b * BLOCK)]))
                .collect()
        };
        let tiling = Tiling::new(filter.crop());
        let row = || Mutex::new(vec![[0; GROUPS]; tiling.columns]);
        Self {
            halves: (0..1 + usize::from(judged)).map(|_| blocks()).collect(),
            tiles: (0..if judged { tiling.rows } else { 0 })
                .map(|_| row())
                .collect(),
            filter,
            tiling,
        }
    }

    /// Its tiles.
    pub fn tiling(&self) -> &Tiling {
        &self.tiling
    }

    /// Adds samples; fastest if neighbours follow each other.
    pub fn add(&self, samples: impl Iterator<Item = Sample>) {
        // What the samples in a row of one tile and group come to.
        let (mut at, mut sum) = ((0, 0, 0), 0);
        let format = Format::now();
        for Sample {
            raster,
            colour,
            pass,
        } in samples
        {
            let half = pass as usize % self.halves.len();
            self.filter.splat(raster, |pixel, w| {
                let mut block = lock(&self.halves[half][pixel / BLOCK]);
                let at = pixel % BLOCK * 3;
                let sums = &mut block[at..at + 3];
                for (sum, v) in sums.iter_mut().zip(colour) {
                    let v = f64::from(v) * w;
                    match format {
                        Format::Fixed => *sum = sum.saturating_add(fixed(v)),
                        _ => *sum = i128::from(format.add(*sum as u64, v)),
                    }
                }
            });
            let [r, g, b] = colour.map(f64::from);
            if self.tiles.is_empty() || (self.filter.is_single() && !self.filter.contains(raster)) {
                continue;
            }
            let [column, row] = self.tiling.at(raster);
            let here = (row, column, pass as usize % GROUPS);
            if here != at {
                self.add_to_tile(at, std::mem::take(&mut sum));
                at = here;
            }
            sum = sum.saturating_add(fixed((r + g + b) / 3.0));
        }
        self.add_to_tile(at, sum);
    }

    fn add_to_tile(&self, (row, column, group): (usize, usize, usize), sum: i128) {
        if sum != 0 {
            let held = &mut lock(&self.tiles[row])[column][group];
            *held = held.saturating_add(sum);
        }
    }

    /// The filter.
    pub fn filter(&self) -> &FilterTable {
        &self.filter
    }

    /// The picture after so many passes; black where there has been none.
    pub fn resolve(&self, passes: &Passes) -> Vec<[f32; 3]> {
        let format = Format::now();
        self.pixels(0..self.filter.pixels(), |pixel, sums| {
            (self::sum(format, sums) * over(passes.at(pixel)) / Self::UNIT) as f32
        })
    }

    /// The same of some pixels, unrounded.
    pub(super) fn radiance(&self, pixels: Range<usize>, passes: &Passes) -> Vec<[f64; 3]> {
        let format = Format::now();
        self.pixels(pixels, |pixel, sums| {
            self::sum(format, sums) * over(passes.at(pixel)) / Self::UNIT
        })
    }

    /// A number for each value of [`Self::radiance`] whose square is its squared standard error: the difference of the halves, scaled.
    ///
    /// # Panics
    /// If the film is not judged.
    pub(super) fn differences(&self, pixels: Range<usize>, passes: &Passes) -> Vec<[f64; 3]> {
        assert_eq!(self.halves.len(), 2);
        let format = Format::now();
        self.pixels(pixels, |pixel, sums| {
            let [even, odd] = passes.halves(pixel);
            let weight = (even * odd).sqrt() * over(passes.at(pixel));
            let half = |sum: i128, passes| unfixed(format, sum) * over(passes);
            if odd > 0.0 {
                weight * (half(sums[0], even) - half(sums[1], odd)) / Self::UNIT
            } else {
                f64::INFINITY
            }
        })
    }

    /// Pixels of the picture, and the squared standard error of each of their values, from the difference of the halves; infinite if there is
    /// but one.
    ///
    /// # Panics
    /// If the film is not judged.
    pub fn resolve_with_error(
        &self,
        pixels: Range<usize>,
        passes: &Passes,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        assert_eq!(self.halves.len(), 2);
        let format = Format::now();
        let variance = self.pixels(pixels.clone(), |pixel, sums| {
            let [even, odd] = passes.halves(pixel);
            // The variance of the mean of all, from that of the difference of both means.
            let weight = even * odd * over(passes.at(pixel)).powi(2);
            let half = |sum: i128, passes| unfixed(format, sum) * over(passes);
            let [a, b] = [half(sums[0], even), half(sums[1], odd)];
            let difference = (a - b) / Self::UNIT;
            if odd > 0.0 {
                (weight * difference * difference) as f32
            } else {
                f32::INFINITY
            }
        });
        let picture = self.pixels(pixels, |pixel, sums| {
            (self::sum(format, sums) * over(passes.at(pixel)) / Self::UNIT) as f32
        });
        (picture, variance)
    }

    /// Pixels of values made of each pixel's number and each sum by half.
    fn pixels<T>(&self, pixels: Range<usize>, value: impl Fn(usize, &[i128]) -> T) -> Vec<[T; 3]> {
        let mut made = Vec::with_capacity(pixels.len());
        let mut next = pixels.start;
        while next < pixels.end {
            let block = next / BLOCK;
            let end = pixels.end.min((block + 1) * BLOCK);
            let halves: Vec<_> = self.halves.iter().map(|half| lock(&half[block])).collect();
            for pixel in next..end {
                let at = pixel % BLOCK * 3;
                made.push(std::array::from_fn(|c| {
                    let mut sums = [0; 2];
                    for (sum, half) in sums.iter_mut().zip(&halves) {
                        *sum = half[at + c];
                    }
                    value(pixel, &sums[..halves.len()])
                }));
            }
            next = end;
        }
        made
    }

    /// Sums of the mean channel of all samples in each tile, by group: pass modulo [`GROUPS`].
    pub fn tile_sums(&self) -> Vec<[f64; GROUPS]> {
        let tiles = self.tiles.iter();
        let sums = tiles.flat_map(|row| {
            lock(row)
                .iter()
                .map(|sums| sums.map(|s| s as f64 / Self::UNIT))
                .collect::<Vec<_>>()
        });
        sums.collect()
    }
}

/// `as` saturates: 2^67 times the largest picture value there is.
fn fixed(value: f64) -> i128 {
    (value * SampleFilm::UNIT) as i128
}

/// What both halves hold, in units.
fn sum(format: Format, halves: &[i128]) -> f64 {
    match format {
        Format::Fixed => halves.iter().fold(0i128, |a, b| a.saturating_add(*b)) as f64,
        format => halves.iter().map(|s| unfixed(format, *s)).sum(),
    }
}

/// What an entry holds, in units.
#[inline(always)]
fn unfixed(format: Format, entry: i128) -> f64 {
    match format {
        Format::Fixed => entry as f64,
        // Radiance as it is.
        _ => format.value(entry as i64) * SampleFilm::UNIT,
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
mod tests {
    use super::*;
    use crate::scene::{Filter, FilterKind};
    use glam::Vec2;

    /// Samples as bright as `f32` can tell, of which the film holds none: their sum is the most it holds, and does not wrap.
    #[test]
    fn sums_beyond_the_film_stay_at_its_limit() {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        let film = SampleFilm::judged(FilterTable::new(&filter, [0, 1, 0, 1]));
        let sample = |pass| Sample {
            raster: [0.5; 2],
            colour: [f32::MAX, f32::MAX, 1.0],
            pass,
        };
        film.add((0..6).map(sample));
        let most = 2f32.powi(67);
        let [r, g, b] = film.resolve(&Passes::whole(6))[0];
        assert_eq!([r, g], [most / 6.0; 2]);
        assert!((b - 1.0).abs() < 1e-6);
        assert!(
            film.tile_sums()[0]
                .iter()
                .all(|s| (0.0..=1.01 * f64::from(most)).contains(s))
        );
    }
}
