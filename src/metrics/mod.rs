//! How far two pictures are apart.
//!
//! Pictures are linear sRGB, `[f32; 3]` a pixel, row by row from the top; both of the same size.

/// Keeps relative errors of dark pixels finite, as usual since Rousselle, Knaus and Zwicker 2011: a channel below 0.1 is judged by absolute
/// error.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// Relative mean squared error: mean over pixels and channels of `(picture - reference)^2 / (reference^2 + eps)`, with `eps` =
/// [`RELATIVE_EPSILON`]; not symmetric. 0 for no pixels.
///
/// # Panics
/// If the numbers of pixels differ.
pub fn relmse(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(picture, reference, |p, r| {
        (p - r).powi(2) / (r * r + RELATIVE_EPSILON)
    })
}

/// Mean over pixels and channels of `error(picture, reference)`.
fn mean(picture: &[[f32; 3]], reference: &[[f32; 3]], error: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(picture.len(), reference.len());
    let pairs = picture.as_flattened().iter().zip(reference.as_flattened());
    let sum: f64 = pairs
        .map(|(p, r)| error(f64::from(*p), f64::from(*r)))
        .sum();
    sum / (3 * picture.len()).max(1) as f64
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
}
