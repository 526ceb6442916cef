//! The error of a picture, and of most of it.
//!
//! The mean squared error of a short render hangs on a few spots, and of how many there are to come
//! it tells little: samples and chains would be judged by the luck of a moment. What they leave in
//! all other pixels is known well, and tells much: where chains stick they leave all of their
//! region uneven, and where samples find light rarely most pixels lack it. But spots are error as
//! well, and where samples leave many of them that is most of it. So both count alike: errors are
//! judged by their geometric mean.

/// Part of all pixels, the worst, that does not count.
const WORST: f64 = 0.005;
/// Where the picture is dimmer than this part of its mean, errors count as if it were not.
/// Relative: what is chosen does not depend on how bright the lights are.
const DARK: f64 = 0.3;
/// Pixels along each side of the blocks whose mean stands for the picture: its own noise would make
/// bright pixels look accurate.
const BLOCK: usize = 8;

/// Mean squared error over the square of the picture: the geometric mean of that of all pixels and
/// that of all but the worst. `deviation` are standard errors whose squares are right in the mean;
/// rows have `width` pixels.
pub(super) fn error_of(pixels: &[[f32; 3]], deviation: &[[f32; 3]], width: usize) -> f64 {
    let columns = width.div_ceil(BLOCK).max(1);
    let block = |i: usize| i / width / BLOCK * columns + i % width / BLOCK;
    let mean_of = |v: &[f32; 3]| v.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
    let rows = pixels.len().div_ceil(width.max(1) * BLOCK);
    let mut blocks = vec![(0.0, 0.0); columns * rows];
    for (i, pixel) in pixels.iter().enumerate() {
        let (sum, count) = &mut blocks[block(i)];
        *sum += mean_of(pixel);
        *count += 1.0;
    }
    let all: f64 = blocks.iter().map(|(sum, _)| sum).sum();
    let dark = (DARK * all / pixels.len().max(1) as f64).powi(2);
    let error = |(i, d): (usize, &[f32; 3])| {
        let (sum, count) = blocks[block(i)];
        let square = d.map(|d| f64::from(d).powi(2)).iter().sum::<f64>() / 3.0;
        square / ((sum / count).powi(2) + dark).max(f64::MIN_POSITIVE)
    };
    let mut errors: Vec<f64> = deviation.iter().enumerate().map(error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let most = ((1.0 - WORST) * errors.len() as f64).ceil() as usize;
    (mean(&errors) * mean(&errors[..most])).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_count_half_and_brightness_does_not() {
        let picture = |level: f32, spot: f32| {
            let pixels = vec![[level; 3]; 40 * 30];
            let mut deviation = vec![[0.1 * level; 3]; 40 * 30];
            deviation[77] = [spot * level; 3];
            error_of(&pixels, &deviation, 40)
        };
        // A tenth of the picture, which counts as if it were brighter by what is dark.
        let even = 0.01 / (1.0 + DARK * DARK);
        for level in [1e-6, 1.0, 1e6] {
            assert!((picture(level, 0.1) / even - 1.0).abs() < 1e-5);
            // A spot that is half of all error.
            let spotted = picture(level, 0.1 * 1201f32.sqrt());
            assert!((spotted / even - 2f64.sqrt()).abs() < 1e-3, "{spotted}");
        }
        assert_eq!(error_of(&[], &[], 0), 0.0);
        assert_eq!(error_of(&[[0.0; 3]; 4], &[[0.0; 3]; 4], 2), 0.0);
    }
}
