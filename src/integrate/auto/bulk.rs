//! The error of most of a picture.
//!
//! The mean squared error of a short render hangs on a few spots, and of how many there are to come
//! it tells little: samples and chains would be judged by the luck of a moment. What they leave in
//! all other pixels is known well, and tells as much: where chains stick they leave all of their
//! region uneven, and where samples find light rarely most pixels lack it.

/// Part of all pixels, the worst, that does not count.
const WORST: f64 = 0.005;
/// Where the picture is dimmer than this part of its mean, errors count as if it were not.
/// Relative: what is chosen does not depend on how bright the lights are.
const DARK: f64 = 0.3;
/// Pixels along each side of the blocks whose mean stands for the picture: its own noise would make
/// bright pixels look accurate.
const BLOCK: usize = 8;

/// Mean squared error over the square of the picture, of all pixels but the worst. `deviation` are
/// standard errors whose squares are right in the mean; rows have `width` pixels.
pub(super) fn bulk(pixels: &[[f32; 3]], deviation: &[[f32; 3]], width: usize) -> f64 {
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
    errors.truncate(((1.0 - WORST) * errors.len() as f64).ceil() as usize);
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_do_not_count_and_brightness_does_not() {
        let picture = |level: f32| {
            let pixels = vec![[level; 3]; 40 * 30];
            let mut deviation = vec![[0.1 * level; 3]; 40 * 30];
            deviation[77] = [1000.0 * level; 3];
            bulk(&pixels, &deviation, 40)
        };
        // A tenth of the picture, which counts as if it were brighter by what is dark.
        let expected = 0.01 / (1.0 + DARK * DARK);
        for level in [1e-6, 1.0, 1e6] {
            assert!((picture(level) / expected - 1.0).abs() < 1e-5);
        }
        assert_eq!(bulk(&[], &[], 0), 0.0);
        assert_eq!(bulk(&[[0.0; 3]; 4], &[[0.0; 3]; 4], 2), 0.0);
    }
}
