//! FLIP: how visible the differences are to someone who flips between two pictures on a display, 0
//! (not at all) to 1.
//!
//! LDR-FLIP (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: a
//! difference evaluator for alternating images", HPG 2020) of pixels on a display in linear sRGB, 0
//! to 1:
//!
//! 1. Blur both pictures as eyes do at this distance, by contrast sensitivity in YCxCz; clamp to
//!    the display's range.
//! 2. `dE_c`: HyAB distance in L*a*b* with Hunt's adjustment, to the power of 0.7; as a part of the
//!    greatest, green against blue (`cmax`), it is stretched: 0 to 0.4 `cmax` becomes 0 to 0.95,
//!    the rest 0.95 to 1.
//! 3. `dE_f`: the greater of the differences of edge strength and of point strength (gradients and
//!    second derivatives of Y), divided by the square root of 2, to the power of 0.5.
//! 4. `dE = dE_c^(1 - dE_f)`.
//!
//! [`hdr()`] is HDR-FLIP. Both agree with the authors' program.

mod color;
mod filter;
mod hdr;

pub use self::hdr::{Exposures, hdr};

use rayon::prelude::*;

/// Pixels per degree of visual angle at 0.7 m from a display that is 0.7 m and 3840 pixels wide.
pub const PPD: f32 = 67.020_645;

/// Fewer pixels per degree, and the filters fall between pixels; more, and they are wider than
/// displays.
pub const PPD_RANGE: [f32; 2] = [10.0, 1000.0];

const COLOR_EXPONENT: f32 = 0.7;
/// Colour differences up to the first part of the greatest are stretched to the second; the rest
/// shares what remains.
const STRETCHED: (f32, f32) = (0.4, 0.95);
const FEATURE_EXPONENT: f32 = 0.5;

/// Rows filtered at a time: filtered pixels take several times the memory of the picture.
const BAND: usize = 256;

/// LDR-FLIP of each pixel, 0 to 1; pictures are linear sRGB in rows of `width`, clamped to 0 to 1.
/// Symmetric. `ppd`: pixels per degree, within [`PPD_RANGE`].
///
/// # Panics
/// If the numbers of pixels differ.
pub fn ldr(picture: &[[f32; 3]], reference: &[[f32; 3]], width: usize, ppd: f32) -> Vec<f32> {
    assert_eq!(picture.len(), reference.len());
    if picture.is_empty() {
        return Vec::new();
    }
    let filters = Filters::new(ppd.clamp(PPD_RANGE[0], PPD_RANGE[1]));
    let height = picture.len() / width;
    let mut errors = Vec::with_capacity(picture.len());
    for start in (0..height).step_by(BAND) {
        let end = (start + BAND).min(height);
        // With all the rows that filters reach.
        let (top, bottom) = (
            start.saturating_sub(filters.radius()),
            (end + filters.radius()).min(height),
        );
        let rows = top * width..bottom * width;
        let band = ldr_band(&picture[rows.clone()], &reference[rows], width, &filters);
        errors.extend_from_slice(&band[(start - top) * width..(end - top) * width]);
    }
    errors
}

struct Filters {
    contrast: filter::Taps,
    across: filter::Taps,
    down: filter::Taps,
}

impl Filters {
    fn new(ppd: f32) -> Self {
        let (across, down) = filter::features(ppd);
        Self {
            contrast: filter::contrast(ppd),
            across,
            down,
        }
    }

    fn radius(&self) -> usize {
        self.contrast.len().max(self.down.len()) / 2
    }
}

fn ldr_band(
    picture: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: usize,
    filters: &Filters,
) -> Vec<f32> {
    let Filters {
        contrast,
        across,
        down,
    } = filters;
    let seen = |pixels: &[[f32; 3]]| {
        let opponent: Vec<[f32; 3]> = pixels
            .par_iter()
            .map(|p| color::ycxcz(p.map(|v| v.clamp(0.0, 1.0))))
            .collect();
        // Two filters make up that of Cz.
        let channels: Vec<[f32; 4]> = opponent.iter().map(|[y, x, z]| [*y, *x, *z, *z]).collect();
        let luma: Vec<[f32; 4]> = opponent
            .iter()
            .map(|p| [(p[0] + 16.0) / 116.0; 4])
            .collect();
        (
            filter::separable(&channels, width, contrast, contrast),
            filter::separable(&luma, width, across, down),
        )
    };
    let ((p_colors, p_features), (r_colors, r_features)) = (seen(picture), seen(reference));
    let difference = ColorDifference::new();
    let colors = p_colors.par_iter().zip(&r_colors);
    let features = p_features.par_iter().zip(&r_features);
    colors
        .zip(features)
        .map(|((pc, rc), (pf, rf))| difference.of(pc, rc).powf(1.0 - feature_difference(pf, rf)))
        .collect()
}

/// Colour differences, `dE_c`.
struct ColorDifference {
    greatest: f32,
}

impl ColorDifference {
    fn new() -> Self {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(color::hunt_lab);
        Self {
            greatest: color::hyab(green, blue).powf(COLOR_EXPONENT),
        }
    }

    /// Of filtered pixels (Y, Cx, two parts of Cz); 0 to 1.
    fn of(&self, p: &[f32; 4], q: &[f32; 4]) -> f32 {
        let [p, q] = [p, q].map(|[y, x, z1, z2]| {
            color::hunt_lab(color::linear([*y, *x, z1 + z2]).map(|v| v.clamp(0.0, 1.0)))
        });
        let part = color::hyab(p, q).powf(COLOR_EXPONENT) / self.greatest;
        let (knee, height) = STRETCHED;
        if part < knee {
            height * part / knee
        } else {
            (height + (1.0 - height) * (part - knee) / (1.0 - knee)).min(1.0)
        }
    }
}

/// `dE_f` of derivatives (d/dx, d2/dx2, d/dy, d2/dy2); 0 to 1.
fn feature_difference(p: &[f32; 4], q: &[f32; 4]) -> f32 {
    let [edges, points] = [0, 1].map(|i| (p[i].hypot(p[i + 2]) - q[i].hypot(q[i + 2])).abs());
    (edges.max(points) / std::f32::consts::SQRT_2)
        .powf(FEATURE_EXPONENT)
        .min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_pictures_differ_in_colour_alone() {
        let flip = |p: [f32; 3], q: [f32; 3]| ldr(&[p; 12], &[q; 12], 4, PPD)[5];
        assert_eq!(flip([0.3; 3], [0.3; 3]), 0.0);
        assert!((flip([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-3);
        // Black against white is 100 of L*.
        let expected = (100.0 / ColorDifference::new().greatest.powf(1.0 / 0.7)).powf(0.7);
        let expected = 0.95 + 0.05 * (expected - 0.4) / 0.6;
        assert!((flip([0.0; 3], [1.0; 3]) - expected).abs() < 1e-3);
        assert_eq!(flip([0.0; 3], [1.0; 3]), flip([1.0; 3], [0.0; 3]));
        assert!(ldr(&[], &[], 0, PPD).is_empty());
    }

    #[test]
    fn bands_leave_no_seams() {
        let picture = |phase: f32| -> Vec<[f32; 3]> {
            let pixels = 0..3 * (2 * BAND + 9);
            pixels
                .map(|i| [0.1, 0.4, 1.5].map(|c| (c * i as f32 + phase).sin().abs()))
                .collect()
        };
        let (p, r) = (picture(0.0), picture(0.3));
        assert_eq!(ldr(&p, &r, 3, PPD), ldr_band(&p, &r, 3, &Filters::new(PPD)));
    }
}
