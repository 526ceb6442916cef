//! Indices of refraction that depend on the wavelength.

use super::curve::{Sample, interpolate};
use super::observer::{CIE_1931, CIE_FIRST};

/// Index of refraction over the visible range, 360 to 830 nm: a value a nanometre, linear between
/// them, constant beyond both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexCurve(Box<[f32]>);

impl IndexCurve {
    /// Of a function of the wavelength in nanometres.
    pub fn of(index: impl Fn(f64) -> f64) -> Self {
        let at = (0..CIE_1931.len()).map(|i| index((CIE_FIRST + i) as f64) as f32);
        Self(at.collect())
    }

    /// Of pairs of wavelength (nm) and index, in any order, linear between them and constant beyond
    /// both ends, as pbrt-v4 has them (`PiecewiseLinearSpectrum`); one of them at least.
    pub fn of_samples(samples: &[Sample]) -> Self {
        let mut sorted = samples.to_vec();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self::of(|nm| interpolate(&sorted, nm))
    }

    /// The index at a wavelength in nanometres.
    #[inline]
    pub fn at(&self, nm: f32) -> f32 {
        let last = self.0.len() - 1;
        let x = (nm - CIE_FIRST as f32).clamp(0.0, last as f32);
        let i = (x as usize).min(last - 1);
        let (a, b) = (self.0[i], self.0[i + 1]);
        (x - i as f32).mul_add(b - a, a)
    }

    /// The same index at every wavelength.
    pub fn is_constant(&self) -> bool {
        self.0.iter().all(|n| *n == self.0[0])
    }

    /// Least and greatest index.
    pub fn range(&self) -> [f32; 2] {
        let fold = |f: fn(f32, f32) -> f32| self.0.iter().copied().reduce(f).unwrap_or(1.0);
        [fold(f32::min), fold(f32::max)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_interpolate() {
        let curve = IndexCurve::of_samples(&[(700.0, 1.51), (400.0, 1.53)]);
        for (nm, n) in [
            (0.0, 1.53),
            (360.0, 1.53),
            (400.0, 1.53),
            (475.5, 1.524_966_7),
            (700.0, 1.51),
            (830.0, 1.51),
            (1e9, 1.51),
        ] {
            assert!((curve.at(nm) - n).abs() < 3e-7, "{nm}: {}", curve.at(nm));
        }
        assert!(!curve.is_constant());
        assert_eq!(curve.range(), [1.51, 1.53]);
        assert!(IndexCurve::of_samples(&[(400.0, 1.5), (700.0, 1.5)]).is_constant());
    }
}
