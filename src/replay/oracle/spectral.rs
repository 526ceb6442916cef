//! The colour of a path's wavelength once more, in `f64` and by bisection.

use super::vector::V;
use crate::scene::spectrum::{FIRST, LAST, spectral_white};
use std::sync::OnceLock;

/// The positive lobes of the linear sRGB of white light's nanometres, at the wavelengths from
/// [`FIRST`] to [`LAST`], and their integrals.
fn lobes() -> &'static (Vec<V>, V) {
    static LOBES: OnceLock<(Vec<V>, V)> = OnceLock::new();
    LOBES.get_or_init(|| {
        let lobes: Vec<V> = (spectral_white().into_iter())
            .map(|rgb| rgb.map(|v| v.max(0.0)))
            .collect();
        let mut sum = [0.0; 3];
        for (i, lobe) in lobes.iter().enumerate() {
            let end = i == 0 || i + 1 == lobes.len();
            for c in 0..3 {
                sum[c] += if end { 0.5 } else { 1.0 } * lobe[c];
            }
        }
        (lobes, sum)
    })
}

/// What the channels have at a wavelength, per nanometre; each has 1 in all.
fn response(nm: f64) -> V {
    let (lobes, sum) = lobes();
    let x = nm - FIRST as f64;
    let i = (x as usize).min(lobes.len() - 2);
    let x = x - i as f64;
    std::array::from_fn(|c| ((1.0 - x) * lobes[i][c] + x * lobes[i + 1][c]) / sum[c])
}

/// The wavelength in nanometres below which a part `u` of the mean of the channels lies.
pub fn wavelength(u: f64) -> f64 {
    let mean = |nm: f64| response(nm).iter().sum::<f64>() / 3.0;
    let mut rest = u;
    for nm in FIRST..LAST {
        let start = nm as f64;
        // Simpson's rule, exact of a straight line.
        let part = |x: f64| {
            x / 6.0 * (mean(start) + 4.0 * mean(start + 0.5 * x) + mean(start + x * (1.0 - 1e-15)))
        };
        let whole = part(1.0);
        if rest >= whole {
            rest -= whole;
            continue;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let mid = 0.5 * (low + high);
            if part(mid) < rest {
                low = mid;
            } else {
                high = mid;
            }
        }
        return start + low;
    }
    LAST as f64
}

/// The colour of the wavelength that a primary sample stands for; its channels sum to 3.
pub fn colour(u: f64) -> V {
    let w = response(wavelength(u));
    let sum: f64 = w.iter().sum();
    w.map(|w| 3.0 * w / sum)
}
