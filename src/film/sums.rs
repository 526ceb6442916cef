//! Exact accumulation. Integer addition is associative: the same samples give the same bits in any order, on any number of threads.

use super::FilterTable;
use crate::memory::Table;
use crate::simd::Row;
use crate::simd::prefetch::prefetch;
use std::sync::{Mutex, MutexGuard};

/// Film for splats of bounded size: layers of 64-bit fixed-point pixels.
///
/// A splat is a colour normalised by its own mean channel (so at most [`Self::MAX_COLOUR`] a channel) times a weight of at most 1. The binary
/// point is chosen from the number of splats a run can make, so that no sum can overflow, and is as far left as that allows.
///
/// Threads collect splats in a [`SplatLog`] each and hand it in when it is full: no pixel is shared while chains march.
pub struct SplatFilm {
    filter: FilterTable,
    /// `[layer][stripe]`, each `[pixel][channel]`.
    stripes: Vec<Mutex<Table<i64>>>,
    /// Pixels of a stripe, a power of two.
    stripe: usize,
    fraction_bits: i32,
    /// Of a colour times the filter.
    largest: f64,
}

/// Most stripes a splat log tells apart; further ones are mixed.
const STRIPES: usize = 64;

/// Pixels of a stripe: some stripes a layer, so that threads that hand in logs at the same time rarely meet, but each of a huge page.
fn stripe(pixels: usize) -> usize {
    pixels
        .div_ceil(8)
        .next_power_of_two()
        .clamp(65_536.min(pixels.next_power_of_two()), 65_536)
}

/// Pixels are fetched this many splats ahead: films are larger than caches.
const AHEAD: usize = 40;

impl SplatFilm {
    /// Colours are divided by the mean of their channels.
    pub const MAX_COLOUR: f64 = 3.0;

    /// `max_weight` bounds the sum of the weights of all splats to one layer.
    pub fn new(filter: FilterTable, layers: usize, max_weight: f64) -> Self {
        let largest = Self::MAX_COLOUR * filter.peak().max(1.0);
        let bound = max_weight.max(1.0) * largest;
        // One more bit for the rounding of each splat.
        let fraction_bits = (61 - bound.log2().ceil() as i32).clamp(0, 48);
        let pixels = filter.pixels();
        let stripe = stripe(pixels);
        let sizes = (0..pixels)
            .step_by(stripe)
            .map(|first| stripe.min(pixels - first));
        let layer: Vec<usize> = sizes.collect();
        let all = (0..layers).flat_map(|_| &layer);
        Self {
            filter,
            stripes: all
                .map(|size| Mutex::new(Table::zeroed(3 * size)))
                .collect(),
            stripe,
            fraction_bits,
            largest,
        }
    }

    fn lock(&self, layer: usize, stripe: usize) -> MutexGuard<'_, Table<i64>> {
        let per_layer = self.filter.pixels().div_ceil(self.stripe);
        // A thread that panicked while adding integers has left them whole.
        self.stripes[layer * per_layer + stripe]
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Adds all splats of a log to a layer, their weights scaled by `scale` (each product is at most 1), and empties it.
    pub fn add(&self, layer: usize, log: &mut SplatLog, scale: f64) {
        if log.len == 0 {
            return;
        }
        let shift = self.stripe.trailing_zeros();
        log.sort(|raster| self.filter.nearest(raster), shift);
        let scale = scale * (1u64 << self.fraction_bits) as f64;
        let first = log.order[0].1 >> shift;
        let mut held = Held {
            film: self,
            layer,
            shift,
            stripe: first,
            pixels: self.lock(layer, first as usize),
        };
        let single = self.filter.is_single();
        for i in 0..log.len {
            if let Some(&(splat, nearest)) = log.order[..log.len].get(i + AHEAD) {
                if single {
                    held.prefetch(nearest as usize);
                } else {
                    let Row([_, _, _, x, y, ..]) = log.splats[splat as usize];
                    (self.filter).announce([x, y], |pixel| held.prefetch(pixel));
                }
            }
            let (splat, nearest) = log.order[i];
            let Row([r, g, b, x, y, _, low, high]) = log.splats[splat as usize];
            let weight = u64::from(low.to_bits()) | u64::from(high.to_bits()) << 32;
            let scale = weight as f64 * scale;
            if single {
                if self.filter.contains([x, y]) {
                    held.add(nearest as usize, &[1.0], [r, g, b], scale);
                }
            } else {
                self.filter.rows([x, y], |first, weights, row| {
                    held.add_across(first, weights, [r, g, b], row * scale);
                });
            }
        }
        drop(held);
        log.len = 0;
    }

    /// The picture: each layer times its scale, summed in order.
    pub fn resolve(&self, scales: &[f64]) -> Vec<[f32; 3]> {
        let unit = 1.0 / (1u64 << self.fraction_bits) as f64;
        let mut sums = vec![[0.0; 3]; self.filter.pixels()];
        for (layer, scale) in scales.iter().enumerate() {
            for (stripe, to) in sums.chunks_mut(self.stripe).enumerate() {
                let pixels = self.lock(layer, stripe);
                for (to, sum) in to.as_flattened_mut().iter_mut().zip(pixels.entries()) {
                    *to += *sum as f64 * unit * scale;
                }
            }
        }
        sums.into_iter()
            .map(|sum: [f64; 3]| sum.map(|v| v as f32))
            .collect()
    }
}

/// The stripe that splats go to.
struct Held<'a> {
    film: &'a SplatFilm,
    layer: usize,
    /// Pixels of a stripe, as a power of two.
    shift: u32,
    stripe: u32,
    pixels: MutexGuard<'a, Table<i64>>,
}

impl Held<'_> {
    /// Where a pixel is in its stripe.
    #[inline(always)]
    fn place(&self, pixel: usize) -> usize {
        (pixel & ((1 << self.shift) - 1)) * 3
    }

    #[inline(always)]
    fn prefetch(&self, pixel: usize) {
        // If it belongs to another stripe this fetches in vain. A pixel can lie across two cache lines.
        let (pixels, at) = (self.pixels.entries(), self.place(pixel));
        prefetch::<8, _>(pixels, at);
        prefetch::<8, _>(pixels, at + 2);
    }

    /// Adds to a run of pixels, all of one stripe.
    #[inline(always)]
    fn add(&mut self, first: usize, weights: &[f32], colour: [f32; 3], scale: f64) {
        let stripe = (first >> self.shift) as u32;
        if stripe != self.stripe {
            // The next stripe, or a filter that reaches over a border.
            self.stripe = stripe;
            self.pixels = self.film.lock(self.layer, stripe as usize);
        }
        let at = self.place(first);
        let [r, g, b] = colour.map(f64::from);
        let sums = &mut self.pixels.entries_mut()[at..at + 3 * weights.len()];
        let add = |round: fn(f64) -> i64, sums: &mut [i64]| {
            for (sum, weight) in sums.chunks_exact_mut(3).zip(weights) {
                let scale = f64::from(*weight) * scale;
                sum[0] += round(r * scale);
                sum[1] += round(g * scale);
                sum[2] += round(b * scale);
            }
        };
        if scale * self.film.largest < SMALL {
            add(round_small, sums);
        } else {
            add(|x| x.round_ties_even() as i64, sums);
        }
    }

    /// The same for pixels of one stripe or two.
    #[inline(always)]
    fn add_across(&mut self, first: usize, weights: &[f32], colour: [f32; 3], scale: f64) {
        let end = ((first >> self.shift) + 1) << self.shift;
        let (here, there) = weights.split_at(weights.len().min(end - first));
        self.add(first, here, colour, scale);
        if !there.is_empty() {
            self.add(end, there, colour, scale);
        }
    }
}

/// Numbers below this have room for their last digit beside [`MAGIC`].
const SMALL: f64 = (1u64 << 51) as f64;
/// A number whose last digit is 1.
const MAGIC: f64 = (3u64 << 51) as f64;

/// To the nearest integer, ties to even, for numbers of absolute value below [`SMALL`]: a cast would look for what does not fit.
#[inline(always)]
fn round_small(x: f64) -> i64 {
    (x + MAGIC).to_bits() as i64 - MAGIC.to_bits() as i64
}

/// Splats on their way to the film.
#[derive(Default)]
pub struct SplatLog {
    /// `[colour over its own mean channel (3), raster position in pixels (2), 0, weight (u64, two words)]`
    splats: Vec<Row>,
    /// Splat and pixel, sorted by stripe; and room to sort.
    order: Vec<(u32, u32)>,
    unsorted: Vec<(u32, u32)>,
    len: usize,
}

impl SplatLog {
    /// Makes room for `capacity` splats in all.
    pub fn reserve(&mut self, capacity: usize) {
        if self.order.len() < capacity {
            // One more: a splat without weight is written and not counted.
            self.splats.resize(capacity + 1, Row::default());
            self.order.resize(capacity, (0, 0));
            self.unsorted.resize(capacity, (0, 0));
        }
    }

    /// Splats there is room for.
    pub fn room(&self) -> usize {
        self.order.len() - self.len
    }

    /// Adds a splat, `[colour (3), raster (2), ..]`, unless its weight is 0.
    ///
    /// # Panics
    /// Without room.
    #[inline(always)]
    pub fn push(&mut self, splat: &Row, weight: u64) {
        let Row([r, g, b, x, y, ..]) = *splat;
        let [low, high] = [weight, weight >> 32].map(|w| f32::from_bits(w as u32));
        self.splats[self.len] = Row([r, g, b, x, y, 0.0, low, high]);
        self.len += usize::from(weight > 0);
    }

    /// By pixel, the lowest `shift` bits aside: one counting sort.
    fn sort(&mut self, pixel: impl Fn([f32; 2]) -> usize, shift: u32) {
        let n = self.len;
        let mut start = [0u32; STRIPES];
        for (i, Row([_, _, _, x, y, ..])) in self.splats[..n].iter().enumerate() {
            let pixel = pixel([*x, *y]) as u32;
            self.unsorted[i] = (i as u32, pixel);
            start[(pixel >> shift) as usize % STRIPES] += 1;
        }
        let mut next = 0;
        for slot in &mut start {
            next += std::mem::replace(slot, next);
        }
        for &(i, pixel) in &self.unsorted[..n] {
            let at = &mut start[(pixel >> shift) as usize % STRIPES];
            self.order[*at as usize] = (i, pixel);
            *at += 1;
        }
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

    /// `n` equal splats.
    fn add(film: &SplatFilm, n: u64, raster: [f32; 2], [r, g, b]: [f32; 3], weight: u64) {
        let mut log = SplatLog::default();
        log.reserve(1000);
        for _ in 0..n {
            if log.room() == 0 {
                film.add(0, &mut log, 1.0 / 4.0);
            }
            log.push(&Row([r, g, b, raster[0], raster[1], 0.0, 0.0, 0.0]), weight);
        }
        film.add(0, &mut log, 1.0 / 4.0);
    }

    #[test]
    fn equal_splats_sum_exactly() {
        // A f32 sum would stop at 2^24.
        let n = 20_000_000u64;
        let film = SplatFilm::new(one_pixel(), 1, n as f64);
        add(&film, n, [0.5, 0.5], [1.0, 0.5, 3.0], 4);
        let n = n as f32;
        assert_eq!(film.resolve(&[1.0]), vec![[n, 0.5 * n, 3.0 * n]]);
    }

    #[test]
    fn the_largest_possible_sum_fits() {
        for exponent in [0, 20, 40, 55] {
            let weight = 1u64 << exponent;
            let film = SplatFilm::new(one_pixel(), 1, weight as f64);
            add(&film, 1, [0.5, 0.5], [3.0; 3], 4 * weight);
            assert_eq!(film.resolve(&[1.0])[0][0], 3.0 * weight as f32);
        }
    }

    #[test]
    fn rounding_is_to_nearest_even() {
        for x in [
            0.0,
            0.5,
            1.5,
            -0.5,
            -2.5,
            1e15,
            -1e15,
            2.25e15 - 0.5,
            7.3,
            -7.7,
        ] {
            assert_eq!(round_small(x), x.round_ties_even() as i64, "{x}");
        }
    }

    #[test]
    fn filters_reach_over_stripes() {
        let filter = Filter {
            radius: Vec2::splat(2.0),
            kind: FilterKind::Triangle,
        };
        // Stripes of 16 pixels, which end within a row.
        let table = FilterTable::new(&filter, [0, 40, 0, 25]);
        let film = SplatFilm::new(table.clone(), 1, 1e6);
        let mut log = SplatLog::default();
        log.reserve(64);
        let mut expected = vec![0.0; 40 * 25];
        for i in 0..500u32 {
            let raster = [(i * 37 % 400) as f32 / 10.0, (i * 91 % 250) as f32 / 10.0];
            table.splat(raster, |pixel, w| expected[pixel] += w);
            if log.room() == 0 {
                film.add(0, &mut log, 1.0);
            }
            log.push(
                &Row([1.0, 2.0, 0.0, raster[0], raster[1], 0.0, 0.0, 0.0]),
                1,
            );
        }
        film.add(0, &mut log, 1.0);
        for (got, want) in film.resolve(&[1.0]).iter().zip(&expected) {
            assert!(
                (f64::from(got[0]) - want).abs() < 1e-6 * (1.0 + want),
                "{got:?} {want}"
            );
            assert_eq!(got[1], 2.0 * got[0]);
        }
    }
}
