//! How far two pictures are apart.
//!
//! Pictures are linear sRGB, `[f32; 3]` a pixel, row by row from the top; both of the same size.
//! With `p` the picture and `r` the reference, means are over pixels and channels:
//!
//! | metric | formula | from |
//! |---|---|---|
//! | MSE | mean of `(p - r)^2` | |
//! | RMSE | square root of MSE | |
//! | relMSE | mean of `(p - r)^2 / (r^2 + 0.01)` | Rousselle, Knaus and Zwicker 2011 |
//! | SMAPE | mean of `\|p - r\| / (\|p\| + \|r\| + 0.01)`, 0 to 1 | Vogels et al. 2018 |
//! | PSNR | `-10 log10 MSE`, in dB, of sRGB values clamped to 0 to 1; infinite if equal | |
//! | FLIP | mean of [`flip::ldr`] or [`flip::hdr()`], 0 to 1 | Andersson et al. 2020, 2021 |
//!
//! [`Comparison`] has all of them, of the whole picture and of tiles.

mod comparison;
pub mod flip;

pub use self::comparison::{Comparison, Figures, Flip, Map, NotFinite, Tile};

use crate::formats::srgb;

/// Keeps relative errors of dark pixels finite, as usual since Rousselle, Knaus and Zwicker 2011: a
/// channel below 0.1 is judged by absolute error.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// Mean squared error. 0 for no pixels.
///
/// # Panics
/// If the numbers of pixels differ.
pub fn mse(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(picture, reference, squared)
}

/// Relative mean squared error: mean over pixels and channels of `(picture - reference)^2 /
/// (reference^2 + eps)`, with `eps` = [`RELATIVE_EPSILON`]; not symmetric. 0 for no pixels.
///
/// # Panics
/// If the numbers of pixels differ.
pub fn relmse(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(picture, reference, relative_squared)
}

/// Symmetric mean absolute percentage error: mean over pixels and channels of `|p - r| / (|p| + |r|
/// + eps)`, with `eps` = [`RELATIVE_EPSILON`] (Vogels et al. 2018); 0 to 1. 0 for no pixels.
///
/// # Panics
/// If the numbers of pixels differ.
pub fn smape(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(picture, reference, symmetric_absolute)
}

/// Peak signal-to-noise ratio in dB, of what a display shows: `-10 log10` of the mean squared error
/// of sRGB values clamped to 0 to 1. Infinite where that error is 0.
///
/// # Panics
/// If the numbers of pixels differ.
pub fn psnr(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    decibels(mean(picture, reference, displayed_squared))
}

fn squared(p: f64, r: f64) -> f64 {
    (p - r).powi(2)
}

fn relative_squared(p: f64, r: f64) -> f64 {
    (p - r).powi(2) / (r * r + RELATIVE_EPSILON)
}

fn symmetric_absolute(p: f64, r: f64) -> f64 {
    (p - r).abs() / (p.abs() + r.abs() + RELATIVE_EPSILON)
}

fn displayed_squared(p: f64, r: f64) -> f64 {
    let shown = |v: f64| f64::from(srgb::encode(v.clamp(0.0, 1.0) as f32));
    squared(shown(p), shown(r))
}

/// `-10 log10` of a mean squared error; a peak is 1.
fn decibels(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

/// Mean over pixels and channels of `error(picture, reference)`.
fn mean(picture: &[[f32; 3]], reference: &[[f32; 3]], error: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(picture.len(), reference.len());
    let pairs = picture.iter().zip(reference);
    let sum: f64 = pairs.map(|(p, r)| of_pixel(p, r, &error)).sum();
    sum / picture.len().max(1) as f64
}

/// Mean over channels of `error(picture, reference)`.
fn of_pixel(p: &[f32; 3], r: &[f32; 3], error: impl Fn(f64, f64) -> f64) -> f64 {
    let channels = p.iter().zip(r);
    let sum: f64 = channels
        .map(|(p, r)| error(f64::from(*p), f64::from(*r)))
        .sum();
    sum / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_errors_are_relative_to_the_reference() {
        let picture = [[1.1, 0.0, 2.0]];
        let reference = [[1.0, 0.0, 1.0]];
        let expected = (0.01 / 1.01 + 0.0 + 1.0 / 1.01) / 3.0;
        assert!((relmse(&picture, &reference) - expected).abs() < 1e-7);
        assert_eq!(relmse(&[], &[]), 0.0);
    }

    #[test]
    fn closed_forms() {
        let near = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-6, "{value}");
        let picture = [[0.0, 1.0, 3.0], [0.0; 3]];
        let reference = [[1.0, 1.0, 1.0], [0.0; 3]];
        near(mse(&picture, &reference), 5.0 / 6.0);
        near(smape(&picture, &reference), (1.0 / 1.01 + 2.0 / 4.01) / 6.0);
        // The display shows nothing above 1.
        near(psnr(&picture, &reference), 10.0 * 6f64.log10());
        assert_eq!(psnr(&picture, &picture), f64::INFINITY);
        assert_eq!((mse(&[], &[]), smape(&[], &[])), (0.0, 0.0));
    }
}
