//! CIE XYZ and linear sRGB.

/// XYZ to linear sRGB (Rec. 709 primaries, D65 white), rounded as in pbrt-v3.
const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

/// Linear sRGB of CIE XYZ.
pub fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_RGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// Relative luminance Y of a linear sRGB colour (inverse of the matrix above).
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2]
}
