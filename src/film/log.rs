//! Splats on their way to the film.

use crate::simd::record::record;

/// Most stripes a log tells apart; further ones are mixed.
const STRIPES: usize = 64;

record! {
    /// A splat in a log. It is written by whoever has it logged, and read by the film.
    pub(super) struct Logged / LoggedLanes {
        /// Linear sRGB over the mean of the channels.
        colour: [f32; 3],
        /// Raster position, in pixels.
        raster: [f32; 2],
        /// Weight, an integer: its low and its high half.
        weight: [u32; 2],
    } free 1
}

/// Splats on their way to the film.
#[derive(Default)]
pub struct SplatLog {
    pub(super) splats: Vec<Logged>,
    /// Splat and pixel, sorted by stripe; and room to sort.
    pub(super) order: Vec<(u32, u32)>,
    unsorted: Vec<(u32, u32)>,
    pub(super) len: usize,
}

impl SplatLog {
    /// Makes room for `capacity` splats in all.
    pub fn reserve(&mut self, capacity: usize) {
        if self.order.len() < capacity {
            // One more: a splat without weight is written and not counted.
            self.splats.resize(capacity + 1, Logged::default());
            self.order.resize(capacity, (0, 0));
            self.unsorted.resize(capacity, (0, 0));
        }
    }

    /// Splats there is room for.
    pub fn room(&self) -> usize {
        self.order.len() - self.len
    }

    /// Adds a splat unless its weight is 0.
    ///
    /// # Panics
    /// Without room.
    #[inline(always)]
    pub fn push(&mut self, colour: [f32; 3], raster: [f32; 2], weight: u64) {
        self.splats[self.len] = Logged {
            colour,
            raster,
            weight: [weight as u32, (weight >> 32) as u32],
            ..Logged::default()
        };
        self.len += usize::from(weight > 0);
    }

    /// By stripe, which is a pixel's number without its lowest `shift` bits: one counting sort.
    pub(super) fn sort(&mut self, pixel: impl Fn([f32; 2]) -> usize, shift: u32) {
        let n = self.len;
        let mut start = [0u32; STRIPES];
        for (i, splat) in self.splats[..n].iter().enumerate() {
            let pixel = pixel(splat.raster) as u32;
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
