//! From roughness to the alphas of Trowbridge and Reitz.

use crate::scene::{Param, Remap, Roughness, SMOOTH_ALPHA};

/// Alphas, if they are the same everywhere.
pub fn constant_alphas(roughness: &Roughness) -> Option<[f32; 2]> {
    match (roughness.u, roughness.v) {
        (Param::Constant([u, ..]), Param::Constant([v, ..])) => {
            Some([u, v].map(|x| raw_alpha(x, roughness.remap).min(1e3)))
        }
        _ => None,
    }
}

/// An alpha, kept in what `f32` evaluates well.
pub fn resolved(alpha: f32) -> f32 {
    alpha.clamp(SMOOTH_ALPHA, 1e3)
}

/// The alpha of a roughness, whatever it is.
pub fn raw_alpha(roughness: f32, remap: Remap) -> f32 {
    match remap {
        Remap::None => roughness,
        Remap::V3 => {
            let x = roughness.max(1e-3).ln();
            1.62142
                + 0.819955 * x
                + 0.1734 * x * x
                + 0.0171201 * x.powi(3)
                + 0.000640711 * x.powi(4)
        }
        Remap::V4 => roughness.max(0.0).sqrt(),
    }
}

/// Trowbridge-Reitz alpha of a roughness, kept in what `f32` evaluates well.
pub fn alpha(roughness: f32, remap: Remap) -> f32 {
    let a = raw_alpha(roughness, remap);
    if a.is_nan() { 1.0 } else { resolved(a) }
}
