//! Filters of FLIP: what eyes resolve at a distance, and the edges and points they look for. All
//! are separable, four at a time.

use std::f32::consts::PI;

use rayon::prelude::*;

/// Weights of four filters, which act on the four components of pixels, over `2 * radius + 1`
/// pixels.
pub type Taps = Vec<[f32; 4]>;

/// Contrast sensitivity (Andersson et al. 2020, table 1), as Gaussians `a sqrt(pi / b) exp(-pi^2
/// x^2 / b)`, `x` in degrees: `(a, b)` of lightness, red and green, and two whose sum is blue and
/// yellow.
const SENSITIVITY: [(f32, f32); 4] = [(1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025)];

/// Width of the edges and points looked for, in degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// Gaussians for Y, Cx, and the two that make up Cz, each a side of the separable filter: the sum
/// of the squares of the last two's sums is 1.
pub fn contrast(ppd: f32) -> Taps {
    let widest = SENSITIVITY.iter().map(|s| s.1).fold(0.0, f32::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
    let gaussian =
        |x: f32, (a, b): (f32, f32)| (a * (PI / b).sqrt()).sqrt() * (-PI * PI * x * x / b).exp();
    let taps: Taps = (-radius..=radius)
        .map(|i| SENSITIVITY.map(|s| gaussian(i as f32 / ppd, s)))
        .collect();
    let sums = total(&taps, |w| w);
    let yellow = sums[2].hypot(sums[3]);
    scaled(taps, [sums[0], sums[1], yellow, yellow])
}

/// A Gaussian and its first and second derivatives, as `(across, down)` filters for (d/dx, d2/dx2,
/// d/dy, d2/dy2). Positive weights sum to 1; negative ones, too, or to 0.
pub fn features(ppd: f32) -> (Taps, Taps) {
    let deviation = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * deviation).ceil() as i32;
    let weights = (-radius..=radius).map(|i| {
        let x = i as f32;
        let g = (-x * x / (2.0 * deviation * deviation)).exp();
        let second = (x * x / (deviation * deviation) - 1.0) * g;
        [g, -x * g, second, 0.0]
    });
    let taps: Taps = weights.collect();
    let positive = total(&taps, |w| w.max(0.0));
    let negative = total(&taps, |w| (-w).max(0.0));
    let normalised = taps.iter().map(|weights| {
        [0, 1, 2].map(|i| {
            let sum = if weights[i] > 0.0 { positive } else { negative };
            // A Gaussian has no negative weights.
            weights[i] / sum[i].max(f32::MIN_POSITIVE)
        })
    });
    normalised
        .map(|[g, d, dd]| ([d, dd, g, g], [g, g, d, dd]))
        .unzip()
}

fn total(taps: &Taps, part: impl Fn(f32) -> f32) -> [f32; 4] {
    let mut sums = [0.0; 4];
    for weights in taps {
        (0..4).for_each(|i| sums[i] += part(weights[i]));
    }
    sums
}

fn scaled(mut taps: Taps, by: [f32; 4]) -> Taps {
    for weights in &mut taps {
        (0..4).for_each(|i| weights[i] /= by[i]);
    }
    taps
}

/// Filters rows with `across`, then columns with `down`, component by component; pixels at the
/// border go on beyond it.
pub fn separable(
    image: &[[f32; 4]],
    width: usize,
    across: &[[f32; 4]],
    down: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let mut rows = vec![[0.0; 4]; image.len()];
    let radius = across.len() / 2;
    rows.par_chunks_mut(width)
        .zip(image.par_chunks(width))
        .for_each(|(out, source)| {
            for (x, sum) in out.iter_mut().enumerate() {
                for (i, weights) in across.iter().enumerate() {
                    let from = (x + i).saturating_sub(radius).min(width - 1);
                    add(sum, weights, &source[from]);
                }
            }
        });
    let mut columns = vec![[0.0; 4]; image.len()];
    let (radius, height) = (down.len() / 2, image.len() / width);
    columns
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, out)| {
            for (i, weights) in down.iter().enumerate() {
                let from = (y + i).saturating_sub(radius).min(height - 1);
                let source = &rows[from * width..][..width];
                out.iter_mut()
                    .zip(source)
                    .for_each(|(sum, value)| add(sum, weights, value));
            }
        });
    columns
}

fn add(sum: &mut [f32; 4], weights: &[f32; 4], value: &[f32; 4]) {
    (0..4).for_each(|i| sum[i] += weights[i] * value[i]);
}

#[cfg(test)]
mod tests {
    use super::*;

    const PPD: f32 = super::super::PPD;

    #[test]
    fn constants_stay_and_have_no_features() {
        let image = [[2.0; 4]; 35];
        let contrast = contrast(PPD);
        for v in separable(&image, 7, &contrast, &contrast) {
            assert!((v[0] - 2.0).abs() < 1e-5 && (v[1] - 2.0).abs() < 1e-5);
            assert!((v[2] + v[3] - 2.0).abs() < 1e-5);
        }
        let (across, down) = features(PPD);
        for v in separable(&image, 7, &across, &down) {
            assert!(v.iter().all(|d| d.abs() < 1e-5), "{v:?}");
        }
    }

    #[test]
    fn a_step_has_its_height_as_its_steepest_slope() {
        let row: Vec<[f32; 4]> = (0..61)
            .map(|x| [if x < 30 { 0.0 } else { 1.0 }; 4])
            .collect();
        let (across, down) = features(PPD);
        let found = separable(&row, 61, &across, &down);
        let steepest = found.iter().map(|v| v[0].abs()).fold(0.0, f32::max);
        assert!((steepest - 1.0).abs() < 1e-5, "{steepest}");
        assert!(found.iter().all(|v| v[2].abs() < 1e-5 && v[3].abs() < 1e-5));
    }
}
