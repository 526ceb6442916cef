//! Colour spaces of FLIP: linear sRGB to YCxCz, where eyes' contrast sensitivity is known, and to
//! L*a*b*, where differences are judged.

/// XYZ of linear sRGB, by rows, to the precision of the primaries' chromaticities (D65).
const XYZ: [[f32; 3]; 3] = [
    [
        (10_135_552.0 / 24_577_794.0) as f32,
        (8_788_810.0 / 24_577_794.0) as f32,
        (4_435_075.0 / 24_577_794.0) as f32,
    ],
    [
        (2_613_072.0 / 12_288_897.0) as f32,
        (8_788_810.0 / 12_288_897.0) as f32,
        (887_015.0 / 12_288_897.0) as f32,
    ],
    [
        (1_425_312.0 / 73_733_382.0) as f32,
        (8_788_810.0 / 73_733_382.0) as f32,
        (70_074_185.0 / 73_733_382.0) as f32,
    ],
];

/// The inverse of [`XYZ`].
const LINEAR: [[f32; 3]; 3] = [
    [3.241_003_3, -1.537_398_9, -0.498_615_86],
    [-0.969_224_33, 1.875_930_1, 0.041_554_224],
    [0.055_639_423, -0.204_011_2, 1.057_148_9],
];

/// XYZ of white, which is the sum of each row of [`XYZ`].
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

fn transform(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// XYZ in units of white.
fn relative_xyz(linear: [f32; 3]) -> [f32; 3] {
    let xyz = transform(&XYZ, linear);
    [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]]
}

/// L*a*b*'s form of three responses: lightness, red against green, yellow against blue.
fn opponent([x, y, z]: [f32; 3]) -> [f32; 3] {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Linear sRGB to YCxCz: L*a*b* without its cube root (Flohr et al. 1993), so that filters may be
/// applied.
pub fn ycxcz(linear: [f32; 3]) -> [f32; 3] {
    opponent(relative_xyz(linear))
}

/// The inverse of [`ycxcz`].
pub fn linear([luma, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (luma + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    transform(&LINEAR, [x * WHITE[0], y * WHITE[1], z * WHITE[2]])
}

/// Linear sRGB to L*a*b* (CIE 1976) whose a* and b* are damped in the dark, where eyes see less
/// colour (Hunt 1952): times `L* / 100`.
pub fn hunt_lab(linear: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [lightness, a, b] = opponent(relative_xyz(linear).map(|v| {
        if v > DELTA.powi(3) {
            v.cbrt()
        } else {
            v / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    }));
    [lightness, 0.01 * lightness * a, 0.01 * lightness * b]
}

/// HyAB distance (Abasi, Tehran and Fairchild 2020), for large differences: `|dL| + sqrt(da^2 +
/// db^2)`.
pub fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white_and_inverses_are_inverse() {
        let lab = hunt_lab([1.0; 3]);
        assert!((lab[0] - 100.0).abs() < 1e-4 && lab[1].abs() + lab[2].abs() < 1e-3);
        assert!(hunt_lab([0.0; 3]).iter().all(|v| v.abs() < 1e-5));
        let colour = [0.2, 0.7, 0.05];
        let back = linear(ycxcz(colour));
        assert!(
            back.iter().zip(colour).all(|(p, q)| (p - q).abs() < 1e-5),
            "{back:?}"
        );
        assert_eq!(hyab([1.0, 3.0, 0.0], [3.0, 0.0, 4.0]), 7.0);
    }
}
