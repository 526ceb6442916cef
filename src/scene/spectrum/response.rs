//! What light of one wavelength is worth in red, green and blue.

use super::curve::interpolate;
use super::observer::{CIE_1931, CIE_FIRST, ILLUMINANT_D65};
use super::rgb::xyz_to_rgb;

/// First and last wavelength of [`responses`], in nanometres; they are a nanometre apart.
pub const FIRST: usize = CIE_FIRST;
/// See [`FIRST`].
pub const LAST: usize = CIE_FIRST + CIE_1931.len() - 1;

/// Linear sRGB of a nanometre of white light (D65), at each wavelength from [`FIRST`] to [`LAST`];
/// the sum is white, `(1, 1, 1)`. Channels are negative where a wavelength is beyond the gamut, and
/// every wavelength is.
pub fn spectral_white() -> Vec<[f64; 3]> {
    let light = |i: usize| interpolate(&ILLUMINANT_D65, (FIRST + i) as f64);
    let raw: Vec<[f64; 3]> = (CIE_1931.iter().enumerate())
        .map(|(i, cie)| xyz_to_rgb(cie.map(|c| f64::from(c) * light(i))))
        .collect();
    scaled_to_one(raw)
}

/// The same without its negative lobes: `w_c(nm) >= 0` per nanometre, each channel of integral 1
/// (by trapezoids).
pub fn responses() -> Vec<[f64; 3]> {
    let lobes = spectral_white().into_iter();
    scaled_to_one(lobes.map(|rgb| rgb.map(|v| v.max(0.0))).collect())
}

/// Channels divided by their integrals by trapezoids.
fn scaled_to_one(mut curve: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    for c in 0..3 {
        let sum: f64 = curve.windows(2).map(|w| 0.5 * (w[0][c] + w[1][c])).sum();
        for rgb in &mut curve {
            rgb[c] /= sum;
        }
    }
    curve
}
