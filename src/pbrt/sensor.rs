//! What a v4 film makes of the colours it meets: white balance, and the colour space of the
//! picture.
//!
//! pbrt-v4's default sensor sees CIE XYZ, so balance and space are one matrix from linear sRGB,
//! exactly. Its cameras by name have measured responses to spectra, which an RGB render has not;
//! pbrt fits each to XYZ over the patches of a colour chart under the light that `whitebalance`
//! names, 6500 K unless the file says so. White and greys then come out as from the default sensor
//! balanced for that light, other colours nearly, and that is what stands in for them here.

use glam::{DMat3, DVec3};

use super::color_space::ColorSpace;
use super::spectrum;

/// pbrt-v4's cameras.
const CAMERAS: [&str; 17] = [
    "canon_eos_100d",
    "canon_eos_1dx_mkii",
    "canon_eos_200d",
    "canon_eos_200d_mkii",
    "canon_eos_5d",
    "canon_eos_5d_mkii",
    "canon_eos_5d_mkiii",
    "canon_eos_5d_mkiv",
    "canon_eos_5ds",
    "canon_eos_m",
    "hasselblad_l1d_20c",
    "nikon_d810",
    "nikon_d850",
    "sony_ilce_6400",
    "sony_ilce_7m3",
    "sony_ilce_7rm3",
    "sony_ilce_9",
];

/// Temperature that a camera is balanced for by default, in kelvin.
pub const CAMERA_BALANCE: f64 = 6500.0;

/// The sensor that sees CIE XYZ.
pub const CIE: &str = "cie1931";

pub fn is_camera(name: &str) -> bool {
    CAMERAS.contains(&name)
}

/// From linear sRGB to what is written, for a film in this colour space that is balanced for this
/// temperature; `None` if nothing changes.
pub fn matrix(space: ColorSpace, balance: Option<f64>) -> Option<[[f32; 3]; 3]> {
    if space == ColorSpace::Srgb && balance.is_none() {
        return None;
    }
    let mut xyz = ColorSpace::Srgb.to_xyz();
    if let Some(kelvin) = balance {
        let [x, y] = spectrum::daylight(kelvin);
        let source = DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        xyz = balanced(source, space.white()) * xyz;
    }
    let m = (space.to_xyz().inverse() * xyz).transpose();
    let rows = [m.x_axis, m.y_axis, m.z_axis];
    Some(rows.map(|r| r.as_vec3().to_array()))
}

/// The transform of von Kries from one white to another, over Bradford's responses (the matrix as
/// in pbrt-v4).
fn balanced(from: DVec3, to: DVec3) -> DMat3 {
    let lms = DMat3::from_cols_array(&[
        0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
    ]);
    let gain = (lms * to) / (lms * from);
    lms.inverse() * DMat3::from_diagonal(gain) * lms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_film_is_balanced_for_is_white() {
        for space in [
            ColorSpace::Srgb,
            ColorSpace::DciP3,
            ColorSpace::Rec2020,
            ColorSpace::Aces2065,
        ] {
            for kelvin in [2800.0, 5000.0, 6500.0, 10000.0] {
                let m = matrix(space, Some(kelvin)).expect("a matrix");
                let [x, y] = spectrum::daylight(kelvin);
                let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
                let rgb = (ColorSpace::Srgb.to_xyz().inverse() * xyz).as_vec3();
                for row in m {
                    let out = row[0] * rgb.x + row[1] * rgb.y + row[2] * rgb.z;
                    assert!((out - 1.0).abs() < 1e-5, "{space:?} {kelvin}: {out}");
                }
            }
        }
    }

    #[test]
    fn the_default_film_changes_nothing() {
        assert_eq!(matrix(ColorSpace::Srgb, None), None);
        // D65 is about 6504 K: balancing for 6500 K moves nothing by more than a hundredth.
        let m = matrix(ColorSpace::Srgb, Some(6500.0)).expect("a matrix");
        for (i, row) in m.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                let one = if i == j { 1.0 } else { 0.0 };
                assert!((v - one).abs() < 0.01, "{m:?}");
            }
        }
    }
}
