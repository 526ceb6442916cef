//! Indices of refraction that depend on the wavelength.

use super::tables::{CIE_1931, CIE_FIRST};
use super::{Sample, interpolate};

/// Index of refraction over the visible range, 360 to 830 nm: a value a nanometre, linear between them, constant beyond both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexCurve(Box<[f32]>);

impl IndexCurve {
    /// Of a function of the wavelength in nanometres.
    pub fn of(index: impl Fn(f64) -> f64) -> Self {
        let at = (0..CIE_1931.len()).map(|i| index((CIE_FIRST + i) as f64) as f32);
        Self(at.collect())
    }

    /// Of pairs of wavelength (nm) and index, in any order, linear between them and constant beyond both ends, as pbrt-v4 has them
    /// (`PiecewiseLinearSpectrum`); one of them at least.
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

/// pbrt-v4's glasses: the name after `glass-`, and the coefficients `B1 C1 B2 C2 B3 C3` (C in square micrometres) of Sellmeier's formula, from
/// Schott's data sheets of N-BK7, N-BAF10, N-FK51A, N-LASF9, N-SF5, N-SF10 and N-SF11.
const SELLMEIER: [(&str, [f64; 6]); 7] = [
    (
        "BK7",
        [
            1.03961212,
            0.00600069867,
            0.231792344,
            0.0200179144,
            1.01046945,
            103.560653,
        ],
    ),
    (
        "BAF10",
        [
            1.5851495,
            0.00926681282,
            0.143559385,
            0.0424489805,
            1.08521269,
            105.613573,
        ],
    ),
    (
        "FK51A",
        [
            0.971247817,
            0.00472301995,
            0.216901417,
            0.0153575612,
            0.904651666,
            168.68133,
        ],
    ),
    (
        "LASF9",
        [
            2.00029547,
            0.0121426017,
            0.298926886,
            0.0538736236,
            1.80691843,
            156.530829,
        ],
    ),
    (
        "SF5",
        [
            1.52481889,
            0.011254756,
            0.187085527,
            0.0588995392,
            1.42729015,
            129.141675,
        ],
    ),
    (
        "SF10",
        [
            1.62153902,
            0.0122241457,
            0.256287842,
            0.0595736775,
            1.64447552,
            147.468793,
        ],
    ),
    (
        "SF11",
        [
            1.73759695,
            0.013188707,
            0.313747346,
            0.0623068142,
            1.89878101,
            155.23629,
        ],
    ),
];

/// The index of a glass that pbrt-v4 knows as `glass-` and `name`, over the wavelength in nanometres. pbrt-v4 calls SF5, SF10, SF11 by F5,
/// F10, F11.
pub fn sellmeier(name: &str) -> Option<impl Fn(f64) -> f64> {
    let name = match name {
        "F5" => "SF5",
        "F10" => "SF10",
        "F11" => "SF11",
        other => other,
    };
    let &(_, [b1, c1, b2, c2, b3, c3]) = SELLMEIER.iter().find(|(known, _)| *known == name)?;
    Some(move |nm: f64| {
        let l2 = (nm * 1e-3).powi(2);
        let term = |b: f64, c: f64| b * l2 / (l2 - c);
        (1.0 + term(b1, c1) + term(b2, c2) + term(b3, c3)).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Data sheets also give the index at the helium d line and Abbe's number, which no formula has to reproduce; pbrt-v4's tables have 530 nm.
    #[test]
    fn glasses_are_those_of_the_catalogue() {
        for (name, nd, abbe, green) in [
            ("BK7", 1.51680, 64.17, 1.5196),
            ("BAF10", 1.67003, 47.11, 1.6750),
            ("FK51A", 1.48656, 84.47, 1.4886),
            ("LASF9", 1.85025, 32.17, 1.8594),
            ("F5", 1.67271, 32.25, 1.6799),
            ("SF10", 1.72828, 28.53, 1.7370),
            ("F11", 1.78472, 25.68, 1.7953),
        ] {
            let n = sellmeier(name).unwrap();
            assert!((n(587.5618) - nd).abs() < 6e-5, "{name}: {}", n(587.5618));
            let v = (n(587.5618) - 1.0) / (n(486.1327) - n(656.2725));
            assert!((v / abbe - 1.0).abs() < 4e-3, "{name}: {v}");
            assert!((n(530.0) - green).abs() < 1e-4, "{name}: {}", n(530.0));
        }
        assert!(sellmeier("SF12").is_none());
    }

    #[test]
    fn curves_interpolate() {
        let curve = IndexCurve::of_samples(&[(700.0, 1.51), (400.0, 1.53)]);
        for (nm, n) in [
            (0.0, 1.53),
            (360.0, 1.53),
            (400.0, 1.53),
            (475.5, 1.52496667),
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
