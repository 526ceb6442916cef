//! Splats on their way to the film.

use crate::simd::Row;

/// Most stripes a log tells apart; further ones are mixed.
const STRIPES: usize = 64;

/// Splats on their way to the film.
#[derive(Default)]
pub struct SplatLog {
    /// `[colour over its own mean channel (3), raster position in pixels (2), 0, weight (u64, two words)]`
    pub(super) splats: Vec<Row>,
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
    pub(super) fn sort(&mut self, pixel: impl Fn([f32; 2]) -> usize, shift: u32) {
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
