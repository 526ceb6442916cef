//! Exact accumulation. Integer addition is associative: the same samples give the same bits in any
//! order, on any number of threads.

use super::FilterTable;
use super::half::Half;
use super::locked_stripe::{HalfLayer, LockedStripe};
use super::log::{Logged, SplatLog};
use super::stripes::{self, Stripes};
use crate::checkpoint::{Malformed, Reader, Writer};
use std::ops::Range;

/// Film for splats of bounded size: layers of 64-bit fixed-point pixels.
///
/// A splat is a colour normalised by its own mean channel (so at most [`Self::MAX_COLOUR`] a
/// channel) times a weight of at most 1. The binary point is chosen from the number of splats a run
/// can make, so that no sum can overflow, and is as far left as that allows.
///
/// Threads collect splats in a [`SplatLog`] each and hand it in when it is full: no pixel is shared
/// while chains march.
///
/// A film can also know its own error ([`Self::judged`]): the splats of one half of all chains are
/// summed once more, in one layer of their own.
pub struct SplatFilm {
    pub(super) filter: FilterTable,
    pub(super) layers: usize,
    /// The half is one more layer.
    stripes: Stripes,
    pub(super) fraction_bits: i32,
    /// Of a colour times the filter.
    largest: f64,
    /// By layer; scales at most 1. Empty: the film is not judged.
    pub(super) half: Vec<Half>,
}

/// Where the splats of a log go.
#[derive(Clone, Copy, Debug)]
pub struct Destination {
    /// Below [`SplatFilm::layers`].
    pub layer: usize,
    /// Splats' weights are scaled by this; each product is at most 1 per mutation.
    pub scale: f64,
    /// They belong to the half of all chains that is summed once more.
    pub half: bool,
}

/// Pixels are fetched this many splats ahead: films are larger than caches.
const AHEAD: usize = 40;
/// Most binary digits of sums after the point.
const MOST_BITS: i32 = 48;

impl SplatFilm {
    /// Colours are divided by the mean of their channels.
    pub const MAX_COLOUR: f64 = 3.0;

    /// `max_weight` bounds the sum of the weights of all splats to one layer.
    pub fn new(filter: FilterTable, layers: usize, max_weight: f64) -> Self {
        Self::with(filter, layers, max_weight, Vec::new())
    }

    /// A film that knows its own error, of as many layers.
    pub fn judged(filter: FilterTable, max_weight: f64, mut half: Vec<Half>) -> Self {
        // The sum of the half must fit where that of a layer fits.
        let share = |h: &Half| h.scale * h.factors()[0].max(1.0);
        let largest = half.iter().map(share).fold(f64::MIN_POSITIVE, f64::max);
        half.iter_mut().for_each(|h| h.scale /= largest);
        Self::with(filter, half.len(), max_weight, half)
    }

    fn with(filter: FilterTable, layers: usize, max_weight: f64, half: Vec<Half>) -> Self {
        let bound = max_weight.max(1.0) * Self::largest(&filter);
        // One more bit for the rounding of each splat.
        let fraction_bits = (61 - bound.log2().ceil() as i32).clamp(0, MOST_BITS);
        Self::of_bits(filter, layers, fraction_bits, half)
    }

    fn of_bits(filter: FilterTable, layers: usize, fraction_bits: i32, half: Vec<Half>) -> Self {
        let all = layers + usize::from(!half.is_empty());
        Self {
            stripes: Stripes::new(filter.pixels(), all),
            largest: Self::largest(&filter),
            filter,
            layers,
            fraction_bits,
            half,
        }
    }

    /// Of a colour times the filter.
    fn largest(filter: &FilterTable) -> f64 {
        Self::MAX_COLOUR * filter.peak().max(1.0)
    }

    /// Writes all that it holds.
    pub fn save(&self, to: &mut Writer) {
        self.save_plan(to);
        self.stripes.save(to);
    }

    /// Writes how it was planned, without any sums.
    pub fn save_plan(&self, to: &mut Writer) {
        let Self {
            filter: _,
            layers: _,
            stripes: _,
            fraction_bits,
            largest: _,
            half,
        } = self;
        to.value(*fraction_bits);
        to.table(half);
    }

    /// Reads a film of so many layers; `judged` says that it knows its own error.
    ///
    /// # Errors
    /// It is another.
    pub fn load(
        filter: FilterTable,
        layers: usize,
        judged: bool,
        from: &mut Reader,
    ) -> Result<Self, Malformed> {
        let mut film = Self::load_plan(filter, layers, judged, from)?;
        film.stripes.load(from)?;
        Ok(film)
    }

    /// An empty film as it was planned.
    ///
    /// # Errors
    /// It is another.
    pub fn load_plan(
        filter: FilterTable,
        layers: usize,
        judged: bool,
        from: &mut Reader,
    ) -> Result<Self, Malformed> {
        let bits = from.value()?;
        Malformed::unless((0..=MOST_BITS).contains(&bits), "no film is that precise")?;
        let half = from.vector(if judged { layers } else { 0 })?;
        Ok(Self::of_bits(filter, layers, bits, half))
    }

    /// Gives all sums away, in packed pieces, and begins anew from zero.
    pub fn hand_over(&self) -> Vec<Vec<u8>> {
        self.stripes.hand_over()
    }

    /// Adds what a film of the same plan has handed over.
    ///
    /// # Errors
    /// It was planned otherwise.
    pub fn take(&self, pieces: Vec<Vec<u8>>) -> Result<(), Malformed> {
        self.stripes.take(pieces)
    }

    /// Memory of a film of so many pixels and layers, in bytes.
    pub fn bytes(pixels: u64, layers: u64) -> u64 {
        stripes::bytes(pixels, layers)
    }

    /// Pictures that are summed apart: one for each path sampler up to `LAYERS` of
    /// `integrate/method.rs`, of which further ones share the last, and one for large steps that
    /// are splatted as independent samples. The half that is summed once more does not count.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Adds all splats of a log, and empties it.
    pub fn add(&self, to: Destination, log: &mut SplatLog) {
        if log.len == 0 {
            return;
        }
        let shift = self.stripes.pixels().trailing_zeros();
        log.sort(|raster| self.filter.nearest(raster), shift);
        let scale = to.scale * (1u64 << self.fraction_bits) as f64;
        let half = self.half.get(to.layer).filter(|_| to.half);
        let half = half.map(|h| HalfLayer {
            layer: self.layers,
            weight: h.scale * h.factors()[0],
        });
        let mut held = LockedStripe::new(&self.stripes, to.layer, half, self.largest);
        held.enter(log.order[0].1 >> shift);
        let single = self.filter.is_single();
        for i in 0..log.len {
            if let Some(&(splat, nearest)) = log.order[..log.len].get(i + AHEAD) {
                if single {
                    held.prefetch(nearest as usize);
                } else {
                    let raster = log.splats[splat as usize].raster;
                    (self.filter).prefetch(raster, |pixel| held.prefetch(pixel));
                }
            }
            let (splat, nearest) = log.order[i];
            let Logged {
                colour,
                raster,
                weight: [low, high],
                ..
            } = log.splats[splat as usize];
            let weight = u64::from(low) | u64::from(high) << 32;
            let scale = weight as f64 * scale;
            if single {
                if self.filter.contains(raster) {
                    held.add(nearest as usize, &[1.0], colour, scale);
                }
            } else {
                self.filter.rows(raster, |first, weights, row| {
                    held.add_across(first, weights, colour, row * scale);
                });
            }
        }
        drop(held);
        log.len = 0;
    }

    /// Adds all that a film of the same plan holds.
    ///
    /// # Errors
    /// It was planned otherwise.
    pub fn absorb(&mut self, mut other: Self) -> Result<(), Malformed> {
        let same = self.fraction_bits == other.fraction_bits && self.half == other.half;
        Malformed::unless(same, "films were planned for other renders")?;
        self.stripes.absorb(&mut other.stripes);
        Ok(())
    }

    /// The largest of its sums, without its sign.
    pub fn fullest(&self) -> f64 {
        self.stripes.largest()
    }

    /// Mutations that there surely is room for, wherever they splat, in a film like this one whose
    /// fullest sum is such: to be asked where there are more than it was made for.
    pub fn room(&self, fullest: f64) -> f64 {
        let largest = f64::from(1 << 30) * f64::from(1 << 30) - fullest;
        // And what rounding adds to each of the splats of a mutation.
        let each = 1.01 * self.largest * (1u64 << self.fraction_bits) as f64 + 64.0;
        (largest / each).max(0.0)
    }

    /// The picture: each layer times its scale, summed in order.
    pub fn resolve(&self, scales: &[f64]) -> Vec<[f32; 3]> {
        let n = self.filter.pixels();
        let mut picture = Vec::with_capacity(n);
        let stripe = self.stripes.pixels();
        let mut room = vec![0.0; 3 * stripe];
        for first in (0..n).step_by(stripe) {
            let pixels = first..n.min(first + stripe);
            let sums = &mut room[..3 * pixels.len()];
            self.sum(pixels, scales, sums);
            let (sums, _) = sums.as_chunks::<3>();
            picture.extend(sums.iter().map(|sum| sum.map(|v| v as f32)));
        }
        picture
    }

    /// Sums of pixels into `sums`, three a pixel: each layer times its scale.
    pub(super) fn sum(&self, pixels: Range<usize>, scales: &[f64], sums: &mut [f64]) {
        sums.fill(0.0);
        let unit = 1.0 / (1u64 << self.fraction_bits) as f64;
        for (layer, scale) in scales[..self.layers].iter().enumerate() {
            self.each(layer, pixels.clone(), sums, |to, sum| {
                *to += sum as f64 * unit * scale;
            });
        }
    }

    /// Calls `visit` with each of `values`, three a pixel, and what the layer holds of it.
    pub(super) fn each(
        &self,
        layer: usize,
        pixels: Range<usize>,
        values: &mut [f64],
        visit: impl Fn(&mut f64, i64),
    ) {
        let size = self.stripes.pixels();
        let mut next = pixels.start;
        let mut values = values.chunks_exact_mut(3);
        while next < pixels.end {
            let stripe = next / size;
            let end = pixels.end.min((stripe + 1) * size);
            let held = self.stripes.lock(layer, stripe);
            let from = 3 * (next - stripe * size);
            let sums = held.entries()[from..from + 3 * (end - next)].chunks_exact(3);
            for (sums, values) in sums.zip(&mut values) {
                for (value, sum) in values.iter_mut().zip(sums) {
                    visit(value, *sum);
                }
            }
            next = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, FilterKind};
    use glam::Vec2;
    use proptest::prelude::*;

    fn one_pixel() -> FilterTable {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        FilterTable::new(&filter, [0, 1, 0, 1])
    }

    fn whole() -> Destination {
        Destination {
            layer: 0,
            scale: 1.0,
            half: false,
        }
    }

    /// `n` equal splats.
    fn add(film: &SplatFilm, n: u64, raster: [f32; 2], colour: [f32; 3], weight: u64) {
        let to = Destination {
            scale: 1.0 / 4.0,
            ..whole()
        };
        let mut log = SplatLog::default();
        log.reserve(1000);
        for _ in 0..n {
            if log.room() == 0 {
                film.add(to, &mut log);
            }
            log.push(colour, raster, weight);
        }
        film.add(to, &mut log);
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
                film.add(whole(), &mut log);
            }
            log.push([1.0, 2.0, 0.0], raster, 1);
        }
        film.add(whole(), &mut log);
        for (got, want) in film.resolve(&[1.0]).iter().zip(&expected) {
            assert!(
                (f64::from(got[0]) - want).abs() < 1e-6 * (1.0 + want),
                "{got:?} {want}"
            );
            assert_eq!(got[1], 2.0 * got[0]);
        }
    }

    proptest! {
        #![proptest_config(crate::property::cases(200))]

        /// The same splats in another order, handed in by logs of another size, are the same bits.
        #[test]
        fn order_does_not_matter(
            (splats, shuffled) in prop::collection::vec(
                (prop::array::uniform3(0f32..3.0), -3f32..15.0, -3f32..12.0, 1..1u64 << 40), 1..200,
            ).prop_flat_map(|s| (Just(s.clone()), Just(s).prop_shuffle())),
            radius in 0.5f32..3.0,
            kind in prop::sample::select(vec![
                FilterKind::Box, FilterKind::Triangle, FilterKind::Gaussian { alpha: 2.0 },
                FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
            ]),
            rooms in (1..70usize, 1..70usize),
        ) {
            let filter = Filter { radius: Vec2::splat(radius), kind };
            let picture = |splats: &[([f32; 3], f32, f32, u64)], room: usize| {
                let film = SplatFilm::new(FilterTable::new(&filter, [0, 12, 0, 9]), 1, 200.0);
                let to = Destination { scale: 1.0 / (1u64 << 40) as f64, ..whole() };
                for some in splats.chunks(room) {
                    let mut log = SplatLog::default();
                    log.reserve(room);
                    for &([r, g, b], x, y, weight) in some {
                        log.push([r, g, b], [x, y], weight);
                    }
                    film.add(to, &mut log);
                }
                film.resolve(&[1.0])
            };
            let (a, b) = (picture(&splats, rooms.0), picture(&shuffled, rooms.1));
            let bits = |p: &[[f32; 3]]| p.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&a), bits(&b));
        }
    }
}
