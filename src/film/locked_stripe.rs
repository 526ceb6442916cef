//! Where splats are added: a stripe of a layer, locked.

use super::stripes::Stripes;
use crate::memory::Table;
use crate::simd::prefetch::prefetch;
use std::sync::MutexGuard;

/// Where splats of the half go as well.
#[derive(Clone, Copy)]
pub(super) struct HalfLayer {
    pub layer: usize,
    /// What their weights are multiplied by there.
    pub weight: f64,
}

/// The stripe that splats go to.
pub(super) struct LockedStripe<'a> {
    stripes: &'a Stripes,
    layer: usize,
    /// If the splats belong to the half.
    half: Option<HalfLayer>,
    /// Of a colour times the filter.
    largest: f64,
    /// Pixels of a stripe, as a power of two.
    shift: u32,
    stripe: u32,
    pixels: Option<MutexGuard<'a, Table<i64>>>,
    pixels_of_half: Option<MutexGuard<'a, Table<i64>>>,
}

impl<'a> LockedStripe<'a> {
    /// Holds nothing yet. No channel of a colour times the filter is above `largest`.
    pub fn new(stripes: &'a Stripes, layer: usize, half: Option<HalfLayer>, largest: f64) -> Self {
        Self {
            stripes,
            layer,
            half,
            largest,
            shift: stripes.pixels().trailing_zeros(),
            stripe: u32::MAX,
            pixels: None,
            pixels_of_half: None,
        }
    }

    /// Moves to a stripe: the next one, or back after a filter that reached over a border.
    #[inline(always)]
    pub fn enter(&mut self, stripe: u32) {
        if stripe != self.stripe {
            self.move_to(stripe);
        }
    }

    #[inline(never)]
    fn move_to(&mut self, stripe: u32) {
        // What is held is given back first, and a layer is locked before the half: nobody waits in
        // a circle.
        self.pixels = None;
        self.pixels_of_half = None;
        self.stripe = stripe;
        let lock = |layer| self.stripes.lock(layer, stripe as usize);
        self.pixels = Some(lock(self.layer));
        self.pixels_of_half = self.half.map(|half| lock(half.layer));
    }

    #[inline(always)]
    fn entries(&mut self) -> &mut [i64] {
        self.pixels
            .as_mut()
            .map_or(&mut [], |pixels| pixels.entries_mut())
    }

    /// Where a pixel is in its stripe.
    #[inline(always)]
    fn place(&self, pixel: usize) -> usize {
        (pixel & ((1 << self.shift) - 1)) * 3
    }

    #[inline(always)]
    pub fn prefetch(&self, pixel: usize) {
        // A pixel of another stripe is not the one that is fetched here, which only costs time. A
        // pixel can lie across two cache lines.
        let at = self.place(pixel);
        for pixels in [&self.pixels, &self.pixels_of_half].into_iter().flatten() {
            prefetch::<8, _>(pixels.entries(), at);
            prefetch::<8, _>(pixels.entries(), at + 2);
        }
    }

    /// Adds to a run of pixels, all of one stripe.
    #[inline(always)]
    pub fn add(&mut self, first: usize, weights: &[f32], colour: [f32; 3], scale: f64) {
        self.enter((first >> self.shift) as u32);
        let range = self.place(first)..self.place(first) + 3 * weights.len();
        let largest = self.largest;
        add_run(
            &mut self.entries()[range.clone()],
            weights,
            colour,
            scale,
            largest,
        );
        if let (Some(half), Some(pixels)) = (self.half, &mut self.pixels_of_half) {
            let sums = &mut pixels.entries_mut()[range];
            add_run(sums, weights, colour, scale * half.weight, largest);
        }
    }

    /// The same for pixels of one stripe or two.
    #[inline(always)]
    pub fn add_across(&mut self, first: usize, weights: &[f32], colour: [f32; 3], scale: f64) {
        let end = ((first >> self.shift) + 1) << self.shift;
        let (here, there) = weights.split_at(weights.len().min(end - first));
        self.add(first, here, colour, scale);
        if !there.is_empty() {
            self.add(end, there, colour, scale);
        }
    }
}

/// Adds `weights * scale * colour` to as many pixels, each product at most `largest * scale`.
#[inline(always)]
fn add_run(sums: &mut [i64], weights: &[f32], colour: [f32; 3], scale: f64, largest: f64) {
    let [r, g, b] = colour.map(f64::from);
    let add = |round: fn(f64) -> i64, sums: &mut [i64]| {
        for (sum, weight) in sums.chunks_exact_mut(3).zip(weights) {
            let scale = f64::from(*weight) * scale;
            sum[0] += round(r * scale);
            sum[1] += round(g * scale);
            sum[2] += round(b * scale);
        }
    };
    if scale * largest < SMALL {
        add(round_small, sums);
    } else {
        add(round, sums);
    }
}

#[inline(always)]
fn round(x: f64) -> i64 {
    x.round_ties_even() as i64
}

/// Numbers below this have room for their last digit beside [`MAGIC`].
const SMALL: f64 = (1u64 << 51) as f64;
/// A number whose last digit is 1.
const MAGIC: f64 = (3u64 << 51) as f64;

/// To the nearest integer, ties to even, for numbers of absolute value below [`SMALL`]: a cast
/// would look for what does not fit.
#[inline(always)]
fn round_small(x: f64) -> i64 {
    (x + MAGIC).to_bits() as i64 - MAGIC.to_bits() as i64
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
