//! Exact accumulation. Integer addition is associative: the same samples give the same bits in any order, on any number of threads.

use super::FilterTable;
use crate::simd::prefetch::prefetch;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, Ordering};

/// A weighted contribution.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Splat {
    /// Over its own mean channel.
    pub colour: [f32; 3],
    /// In pixels.
    pub raster: [f32; 2],
    pub weight: u64,
}

/// The pixel of this many splats ahead is fetched: films are larger than caches, and splats fall anywhere.
const AHEAD: usize = 8;

/// Film for splats of bounded size: layers of 64-bit fixed-point pixels.
///
/// A splat is a colour normalised by its own mean channel (so at most [`Self::MAX_COLOUR`] a channel) times a weight of at most 1. The binary
/// point is chosen from the number of splats a run can make, so that no sum can overflow, and is as far left as that allows.
pub struct SplatFilm {
    filter: FilterTable,
    /// `[layer][pixel][channel]`
    sums: Vec<AtomicI64>,
    fraction_bits: i32,
}

impl SplatFilm {
    /// Colours are divided by the mean of their channels.
    pub const MAX_COLOUR: f64 = 3.0;

    /// `max_weight` bounds the sum of the weights of all splats to one layer.
    pub fn new(filter: FilterTable, layers: usize, max_weight: f64) -> Self {
        let bound = max_weight.max(1.0) * Self::MAX_COLOUR * filter.peak().max(1.0);
        // One more bit for the rounding of each splat.
        let fraction_bits = (61 - bound.log2().ceil() as i32).clamp(0, 48);
        let n = layers * filter.pixels() * 3;
        Self {
            filter,
            sums: (0..n).map(|_| AtomicI64::new(0)).collect(),
            fraction_bits,
        }
    }

    /// Adds `weight * colour` at `raster`.
    #[inline]
    pub fn add(&self, layer: usize, raster: [f32; 2], colour: [f32; 3], weight: f64) {
        let pixels = self.filter.pixels();
        let scale = weight * (1u64 << self.fraction_bits) as f64;
        self.filter.splat(raster, |pixel, w| {
            let at = (layer * pixels + pixel) * 3;
            for (c, sum) in self.sums[at..at + 3].iter().enumerate() {
                let value = (f64::from(colour[c]) * w * scale).round_ties_even() as i64;
                // Relaxed: only the sum matters, and it is read after the threads have joined.
                sum.fetch_add(value, Ordering::Relaxed);
            }
        });
    }

    /// Adds splats, each scaled by `scale` (the weight of a splat times `scale` is at most 1).
    pub fn add_all(&self, layer: usize, splats: &[Splat], scale: f64) {
        for (i, splat) in splats.iter().enumerate() {
            if let Some(next) = splats.get(i + AHEAD) {
                let pixel = self.filter.nearest(next.raster);
                let at = (layer * self.filter.pixels() + pixel) * 3;
                prefetch(&self.sums, at);
            }
            self.add(
                layer,
                splat.raster,
                splat.colour,
                splat.weight as f64 * scale,
            );
        }
    }

    /// The picture: each layer times its scale, summed in order.
    pub fn resolve(&self, scales: &[f64]) -> Vec<[f32; 3]> {
        let pixels = self.filter.pixels();
        let unit = 1.0 / (1u64 << self.fraction_bits) as f64;
        (0..pixels)
            .map(|pixel| {
                std::array::from_fn(|c| {
                    let sum: f64 = (scales.iter().enumerate())
                        .map(|(layer, scale)| {
                            let at = (layer * pixels + pixel) * 3 + c;
                            self.sums[at].load(Ordering::Relaxed) as f64 * unit * scale
                        })
                        .sum();
                    sum as f32
                })
            })
            .collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.sums[..])
    }
}

/// Film for radiance samples of any finite size: 128-bit fixed point with 60 fractional bits.
pub struct SampleFilm {
    filter: FilterTable,
    /// Blocks of pixels, each `[pixel][channel]`.
    blocks: Vec<Mutex<Vec<i128>>>,
}

/// Pixels of a block.
const BLOCK: usize = 1024;

impl SampleFilm {
    const UNIT: f64 = (1u64 << 60) as f64;

    pub fn new(filter: FilterTable) -> Self {
        let n = filter.pixels();
        let blocks = (0..n.div_ceil(BLOCK))
            .map(|b| Mutex::new(vec![0; 3 * BLOCK.min(n - b * BLOCK)]))
            .collect();
        Self { filter, blocks }
    }

    /// Adds `weight * colour` at `raster`.
    pub fn add(&self, raster: [f32; 2], colour: [f32; 3], weight: f64) {
        self.filter.splat(raster, |pixel, w| {
            // A thread that panicked while adding integers has left them whole.
            let mut block = self.blocks[pixel / BLOCK]
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner());
            let at = pixel % BLOCK * 3;
            for c in 0..3 {
                // `as` saturates: 2^67 times the largest picture value there is.
                block[at + c] += (f64::from(colour[c]) * w * weight * Self::UNIT) as i128;
            }
        });
    }

    /// The sums times `scale`.
    pub fn resolve(&self, scale: f64) -> Vec<[f32; 3]> {
        let factor = scale / Self::UNIT;
        let mut pixels = Vec::with_capacity(self.filter.pixels());
        for block in &self.blocks {
            let block = block
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner());
            for p in block.chunks_exact(3) {
                pixels.push(std::array::from_fn(|c| (p[c] as f64 * factor) as f32));
            }
        }
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, FilterKind};
    use glam::Vec2;

    fn one_pixel() -> FilterTable {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        FilterTable::new(&filter, [0, 1, 0, 1])
    }

    #[test]
    fn equal_splats_sum_exactly() {
        // A f32 sum would stop at 2^24.
        let n = 20_000_000u64;
        let film = SplatFilm::new(one_pixel(), 1, n as f64);
        for _ in 0..n {
            film.add(0, [0.5, 0.5], [1.0, 0.5, 3.0], 1.0);
        }
        let n = n as f32;
        assert_eq!(film.resolve(&[1.0]), vec![[n, 0.5 * n, 3.0 * n]]);
    }

    #[test]
    fn the_largest_possible_sum_fits() {
        for exponent in [0, 20, 40, 55] {
            let weight = 2f64.powi(exponent);
            let film = SplatFilm::new(one_pixel(), 1, weight);
            film.add(0, [0.5, 0.5], [3.0; 3], weight);
            assert_eq!(film.resolve(&[1.0])[0][0], 3.0 * weight as f32);
        }
    }
}
