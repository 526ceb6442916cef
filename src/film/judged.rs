//! What a film knows of its own error.

use super::format::Format;
use super::sums::SplatFilm;
use rayon::prelude::*;

/// How the half of all chains is summed for a layer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Half {
    /// About what the layer's sums will be multiplied by in the picture, in any unit.
    pub scale: f64,
    /// Part of the layer's chains that the half has.
    pub part: f64,
}

impl Half {
    /// With `f` the part of the half, `A` its sum and `T` that of all, `A / sqrt(f (1 - f)) - T sqrt(f / (1 - f))` has mean 0 and the variance
    /// of `T`, if chains are alike. These are the factors of `A` (halved, so that it is about 1) and of `T`.
    pub(super) fn factors(&self) -> [f64; 2] {
        let (f, g) = (self.part, 1.0 - self.part);
        if f > 0.0 && g > 0.0 {
            [0.5 / (f * g).sqrt(), (f / g).sqrt()]
        } else {
            [0.0, 0.0]
        }
    }
}

impl SplatFilm {
    /// The picture, and the squared standard error of each of its values: from the difference of two pictures by the two halves of all
    /// chains ([`Half`]), and from the `relative_variance` of each layer's scale. `light` is what all splats of each layer weigh.
    ///
    /// # Panics
    /// If the film is not judged.
    pub fn resolve_with_error(
        &self,
        scales: &[f64],
        relative_variance: &[f64],
        light: &[f64],
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        assert!(!self.half.is_empty());
        let unit = 1.0 / (1u64 << self.fraction_bits) as f64;
        let format = Format::now();
        let level = self.level(scales, light);
        let planned: Vec<f64> = (self.half.iter())
            .map(|h| level * h.scale * h.factors()[1])
            .collect();
        let mut picture = vec![[0.0; 3]; self.filter.pixels()];
        let mut variance = picture.clone();
        (picture.par_chunks_mut(self.stripe))
            .zip(variance.par_chunks_mut(self.stripe))
            .enumerate()
            .for_each(|(stripe, (picture, variance))| {
                let mut room = vec![0.0; 3 * self.stripe];
                // By the scales that were known when the half was summed.
                let difference = self.sum(stripe, &planned, &mut room);
                let half = self.lock(self.layers, stripe);
                for (d, a) in difference.iter_mut().zip(half.entries()) {
                    *d -= 2.0 * level * unit * format.value(*a);
                }
                drop(half);
                let mut squares: Vec<f64> = difference.iter().map(|d| d * d).collect();
                for layer in 0..self.layers {
                    if relative_variance[layer] > 0.0 {
                        let factor = unit * scales[layer] * relative_variance[layer].sqrt();
                        let pixels = self.lock(layer, stripe);
                        for (square, sum) in squares.iter_mut().zip(pixels.entries()) {
                            *square += (format.value(*sum) * factor).powi(2);
                        }
                    }
                }
                let store = |to: &mut [[f32; 3]], from: &[f64]| {
                    let pairs = to.as_flattened_mut().iter_mut().zip(from);
                    pairs.for_each(|(to, from)| *to = *from as f32);
                };
                store(variance, &squares);
                store(picture, self.sum(stripe, scales, &mut room));
            });
        (picture, variance)
    }

    /// What brings the half, which was summed with scales known before, to the level of the picture. `light` holds the layers' sums of weights.
    fn level(&self, scales: &[f64], light: &[f64]) -> f64 {
        let total = |scale: &dyn Fn(usize) -> f64| -> f64 {
            (light.iter().enumerate())
                .map(|(layer, light)| light * scale(layer))
                .sum()
        };
        let then = total(&|layer| self.half[layer].scale);
        if then > 0.0 {
            total(&|layer| scales[layer]) / then
        } else {
            0.0
        }
    }
}
