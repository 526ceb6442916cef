//! Spaces of colour of pbrt-v4, and their way to linear sRGB.

use glam::{DMat3, DVec3};

use super::spectrum::{self};
use crate::scene::Rgb;

/// v4's `ColorSpace`, the space of `rgb` values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ColorSpace {
    #[default]
    Srgb,
    DciP3,
    Rec2020,
    Aces2065,
}

/// Rows times column: linear colour to linear sRGB.
type Matrix = [[f64; 3]; 3];

/// CIE XYZ to linear sRGB (IEC 61966-2-1), as pbrt has it.
const XYZ_TO_SRGB: Matrix = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

/// P3 primaries with a D65 white, as pbrt-v4's `dci-p3`.
const P3_TO_SRGB: Matrix = [
    [1.224940, -0.224940, 0.0],
    [-0.042057, 1.042057, 0.0],
    [-0.019638, -0.078636, 1.098274],
];

/// ITU-R BT.2020 to BT.709 (ITU-R BT.2407).
const REC2020_TO_SRGB: Matrix = [
    [1.660491, -0.587641, -0.072850],
    [-0.124550, 1.132900, -0.008349],
    [-0.018151, -0.100579, 1.118730],
];

/// ACES AP0 to sRGB with Bradford adaptation from the ACES white to D65: what is white stays white.
const ACES_TO_SRGB: Matrix = [
    [2.521686, -1.134131, -0.387555],
    [-0.276480, 1.372719, -0.096239],
    [-0.015378, -0.152975, 1.168353],
];

impl ColorSpace {
    pub fn parse(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "srgb" => Self::Srgb,
            "dci-p3" => Self::DciP3,
            "rec2020" => Self::Rec2020,
            "aces2065-1" => Self::Aces2065,
            _ => return None,
        })
    }

    /// A reflectance of this space in linear sRGB: what is white stays white.
    pub fn to_srgb(self, c: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Srgb => c,
            Self::DciP3 => apply(&P3_TO_SRGB, c),
            Self::Rec2020 => apply(&REC2020_TO_SRGB, c),
            Self::Aces2065 => apply(&ACES_TO_SRGB, c),
        }
    }

    /// Chromaticities `x y` of red, green and blue, as pbrt-v4 has them.
    const fn primaries(self) -> [[f64; 2]; 3] {
        match self {
            Self::Srgb => [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]],
            Self::DciP3 => [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]],
            Self::Rec2020 => [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]],
            Self::Aces2065 => [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]],
        }
    }

    /// CIE XYZ of its white, `Y` 1.
    pub fn white(self) -> DVec3 {
        match self {
            Self::Aces2065 => DVec3::from(spectrum::white_of_d60()),
            _ => matrix(&XYZ_TO_SRGB).inverse() * DVec3::ONE,
        }
    }

    /// Linear colour to CIE XYZ.
    pub fn to_xyz(self) -> DMat3 {
        if self == Self::Srgb {
            // What all spectra were reduced with, to the digit.
            return matrix(&XYZ_TO_SRGB).inverse();
        }
        let [r, g, b] = (self.primaries()).map(|[x, y]| DVec3::new(x, y, 1.0 - x - y) / y);
        let primaries = DMat3::from_cols(r, g, b);
        primaries * DMat3::from_diagonal(primaries.inverse() * self.white())
    }

    /// What a light of this colour sends, in linear sRGB: the colour times the space's own white,
    /// which need not be that of sRGB.
    pub fn emission_to_srgb(self, c: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Aces2065 => (matrix(&XYZ_TO_SRGB) * self.to_xyz() * DVec3::from(c)).to_array(),
            _ => self.to_srgb(c),
        }
    }

    /// What a light of this space sends that has no colour of its own.
    pub fn illuminant(self) -> Rgb {
        narrow(self.emission_to_srgb([1.0; 3]).map(|c| c.max(0.0)))
    }

    /// Of red, green, blue and white: `x y` each, as EXR files tell them.
    pub fn chromaticities(self) -> [f32; 8] {
        let white = self.white();
        let sum = white.element_sum();
        let [r, g, b] = self.primaries();
        let white = [white.x / sum, white.y / sum];
        let all = [r, g, b, white];
        std::array::from_fn(|i| all[i / 2][i % 2] as f32)
    }
}

fn matrix(rows: &Matrix) -> DMat3 {
    DMat3::from_cols_array_2d(rows).transpose()
}

fn apply(m: &Matrix, c: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2])
}

pub(super) fn narrow(c: [f64; 3]) -> Rgb {
    c.map(|c| c as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white() {
        for space in [ColorSpace::DciP3, ColorSpace::Rec2020, ColorSpace::Aces2065] {
            for c in space.to_srgb([1.0; 3]) {
                assert!((c - 1.0).abs() < 2e-5, "{space:?}: {c}");
            }
        }
    }

    #[test]
    fn xyz_of_d65_is_white() {
        for c in apply(&XYZ_TO_SRGB, [0.950456, 1.0, 1.088754]) {
            assert!((c - 1.0).abs() < 1e-4, "{c}");
        }
    }
}
