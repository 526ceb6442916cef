//! HDR-FLIP (Andersson, Nilsson, Shirley and Akenine-Möller 2021): the greatest LDR-FLIP error over
//! a range of exposures, of pictures as ACES shows them.

use super::ldr;

/// Exposures in stops, evenly from `start` to `stop`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The first, in stops.
    pub start: f32,
    /// The last, in stops; at least `start`.
    pub stop: f32,
    /// At least 2.
    pub count: usize,
}

/// `(k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5)`: ACES's filmic curve as Narkowicz fitted it
/// (2015), without his pre-exposure of 0.6.
const ACES: [f32; 6] = [
    0.6 * 0.6 * 2.51,
    0.6 * 0.03,
    0.0,
    0.6 * 0.6 * 2.43,
    0.6 * 0.59,
    0.14,
];

/// The curve is past 1 long before; squares of more would overflow.
const BRIGHTEST: f32 = 1e6;

/// Brightness on the display that the brightest pixel and the median are exposed to.
const TARGET: f32 = 0.85;

impl Exposures {
    /// The paper's range for a reference: its brightest luminance is shown at 0.85 at the first
    /// exposure, its median luminance at the last (of an even number of pixels the greater of
    /// the two in the middle, as in the authors' program); about a stop apart, at least two. Where
    /// the median is black, it is that of the pixels that are not. No light at all: 0 stops.
    pub fn of(reference: &[[f32; 3]]) -> Self {
        let mut luminances: Vec<f32> = reference
            .iter()
            .map(|p| p.map(|v| v.max(0.0)))
            .map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b)
            .collect();
        luminances.sort_unstable_by(f32::total_cmp);
        let brightest = luminances.last().copied().unwrap_or(0.0);
        if brightest <= 0.0 {
            return Self {
                start: 0.0,
                stop: 0.0,
                count: 2,
            };
        }
        let lit = luminances.partition_point(|l| *l <= 0.0);
        let median = match luminances[luminances.len() / 2] {
            m if m > 0.0 => m,
            _ => luminances[(lit + luminances.len()) / 2],
        };
        let shown = shown_at_target();
        let start = (shown / brightest).log2();
        let stop = (shown / median).log2().max(start);
        Self {
            start,
            stop,
            count: (stop - start).ceil().max(2.0) as usize,
        }
    }

    fn stops(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / (self.count - 1) as f32;
        (0..self.count).map(move |i| self.start + i as f32 * step)
    }
}

/// What ACES shows at [`TARGET`]: the greater root of a quadratic.
fn shown_at_target() -> f32 {
    let [a, b, c] = [0, 1, 2].map(|i| ACES[i] - TARGET * ACES[i + 3]);
    let half = -0.5 * b / a;
    half + (half * half - c / a).sqrt()
}

fn tone_map(x: f32) -> f32 {
    let x = x.clamp(0.0, BRIGHTEST);
    let shown =
        (ACES[0] * x * x + ACES[1] * x + ACES[2]) / (ACES[3] * x * x + ACES[4] * x + ACES[5]);
    shown.clamp(0.0, 1.0)
}

/// HDR-FLIP of each pixel, 0 to 1, of linear pictures (what is negative counts as black), and the
/// exposures it was looked for at.
pub fn hdr(
    picture: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: usize,
    ppd: f32,
) -> (Vec<f32>, Exposures) {
    let exposures = Exposures::of(reference);
    let mut greatest = vec![0.0f32; picture.len()];
    for stop in exposures.stops() {
        let factor = stop.exp2();
        let shown = |pixels: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let pixels = pixels.iter();
            pixels.map(|p| p.map(|v| tone_map(v * factor))).collect()
        };
        let errors = ldr(&shown(picture), &shown(reference), width, ppd);
        greatest
            .iter_mut()
            .zip(errors)
            .for_each(|(most, error)| *most = most.max(error));
    }
    (greatest, exposures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_run_from_the_brightest_to_the_median() {
        let grey = |values: &[f32]| -> Exposures {
            let pixels: Vec<[f32; 3]> = values.iter().map(|v| [*v; 3]).collect();
            Exposures::of(&pixels)
        };
        assert!((tone_map(shown_at_target()) - TARGET).abs() < 1e-5);
        let range = grey(&[0.5, 1.0, 1.0, 16.0]);
        assert!((range.stop - range.start - 4.0).abs() < 1e-5);
        assert_eq!(grey(&[1.0; 6]).count, 2);
        assert_eq!(grey(&[0.0, 0.0, 0.0, 1.0]), grey(&[1.0]));
        for nothing in [&[][..], &[0.0], &[0.0, 0.0]] {
            assert_eq!(grey(nothing).stops().collect::<Vec<_>>(), [0.0, 0.0]);
        }
    }

    #[test]
    fn extremes_stay_in_range() {
        let picture = [[f32::MAX; 3], [-1.0; 3], [1e-38; 3], [0.0; 3]];
        let reference = [[1e-38; 3], [1.0; 3], [f32::MAX; 3], [0.0; 3]];
        let (errors, exposures) = hdr(&picture, &reference, 2, 67.0);
        assert!(exposures.count < 300, "{exposures:?}");
        assert!(errors.iter().all(|e| (0.0..=1.0).contains(e)), "{errors:?}");
    }
}
