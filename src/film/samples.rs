//! Exact sums of radiance samples, as a path tracer makes them.

use super::FilterTable;
use std::sync::Mutex;

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
