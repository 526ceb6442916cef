//! A film as most renderers have it: floating-point sums of filtered splats, which lose what is
//! small beside them.

use phalanx::film::FilterTable;
use std::ops::AddAssign;

pub struct Plain<W> {
    filter: FilterTable,
    /// Three a pixel.
    pub sums: Vec<W>,
}

/// What a sum is held in.
pub trait Word: Copy + Default + AddAssign {
    fn rounded(value: f64) -> Self;
}

impl Word for f32 {
    #[inline(always)]
    fn rounded(value: f64) -> Self {
        value as f32
    }
}

impl Word for f64 {
    #[inline(always)]
    fn rounded(value: f64) -> Self {
        value
    }
}

impl<W: Word> Plain<W> {
    pub fn new(filter: FilterTable) -> Self {
        Self {
            sums: vec![W::default(); 3 * filter.pixels()],
            filter,
        }
    }

    pub fn add(&mut self, splats: &[([f32; 3], [f32; 2])], weight: f64) {
        for &(colour, raster) in splats {
            let colour = colour.map(f64::from);
            if self.filter.is_single() {
                if self.filter.contains(raster) {
                    let first = self.filter.nearest(raster);
                    run(&mut self.sums, first, &[1.0], colour, weight);
                }
            } else {
                let sums = &mut self.sums;
                self.filter.rows(raster, |first, weights, row| {
                    run(sums, first, weights, colour, row * weight);
                });
            }
        }
    }
}

#[inline(always)]
fn run<W: Word>(sums: &mut [W], first: usize, weights: &[f32], colour: [f64; 3], scale: f64) {
    let pixels = sums[3 * first..][..3 * weights.len()].chunks_exact_mut(3);
    for (sums, weight) in pixels.zip(weights) {
        for (sum, c) in sums.iter_mut().zip(colour) {
            *sum += W::rounded(c * (f64::from(*weight) * scale));
        }
    }
}
