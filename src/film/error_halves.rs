//! What a film knows of its own error.

use super::sums::SplatFilm;
use std::ops::Range;

/// What is known of each layer when its sums become radiance.
#[derive(Clone, Copy, Debug)]
pub struct Scales<'a> {
    /// Factors of the sums.
    pub radiance: &'a [f64],
    /// Their squared relative standard errors.
    pub relative_variance: &'a [f64],
    /// What all splats weigh.
    pub light: &'a [f64],
}

impl SplatFilm {
    /// Pixels of the picture, and a standard error of each of their values: from the difference of
    /// two pictures by the two halves of all chains ([`Half`](super::Half)), and from the relative
    /// variance of each layer's scale. Its square is right in the mean.
    ///
    /// # Panics
    /// If the film is not judged.
    pub fn resolve_with_error(
        &self,
        pixels: Range<usize>,
        scales: &Scales,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        assert!(!self.half.is_empty());
        let unit = 1.0 / (1u64 << self.fraction_bits) as f64;
        let level = self.level(scales);
        let planned: Vec<f64> = (self.half.iter())
            .map(|h| level * h.scale * h.factors()[1])
            .collect();
        // By the scales that were known when the half was summed.
        let mut squares = vec![0.0; 3 * pixels.len()];
        self.sum(pixels.clone(), &planned, &mut squares);
        self.each(self.layers, pixels.clone(), &mut squares, |d, half| {
            *d -= 2.0 * level * unit * half as f64;
        });
        squares.iter_mut().for_each(|d| *d *= *d);
        for layer in 0..self.layers {
            let relative = scales.relative_variance[layer];
            if relative > 0.0 {
                let factor = unit * scales.radiance[layer] * relative.sqrt();
                self.each(layer, pixels.clone(), &mut squares, |square, sum| {
                    *square += (sum as f64 * factor).powi(2);
                });
            }
        }
        let narrow = |values: &[f64]| -> Vec<[f32; 3]> {
            let (values, _) = values.as_chunks::<3>();
            values.iter().map(|v| v.map(|v| v as f32)).collect()
        };
        squares.iter_mut().for_each(|d| *d = d.sqrt());
        let deviation = narrow(&squares);
        self.sum(pixels, scales.radiance, &mut squares);
        (narrow(&squares), deviation)
    }

    /// What brings the half, which was summed with scales known before, to the level of the
    /// picture.
    fn level(&self, scales: &Scales) -> f64 {
        let total = |scale: &dyn Fn(usize) -> f64| -> f64 {
            (scales.light.iter().enumerate())
                .map(|(layer, light)| light * scale(layer))
                .sum()
        };
        let then = total(&|layer| self.half[layer].scale);
        if then > 0.0 {
            total(&|layer| scales.radiance[layer]) / then
        } else {
            0.0
        }
    }
}
