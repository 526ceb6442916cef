//! Gradient noise and its sums (Perlin 2002, "Improving Noise"; pbrt-v3, section 10.6), with pbrt's
//! gradients, so that its patterns are found again where it puts them.
//!
//! pbrt leaves out octaves finer than the footprint of a camera ray. Without footprints all of them
//! are summed, as pbrt does behind a bounce.

use crate::scene::Octaves;

/// Perlin's permutation.
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69,
    142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219,
    203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175,
    74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230,
    220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1, 216, 80, 73, 209, 76,
    132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100, 109, 198, 173,
    186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82, 85, 212, 207, 206,
    59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119, 248, 152, 2, 44, 154, 163,
    70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110, 79, 113, 224, 232,
    178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179, 162,
    241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184, 84, 204,
    176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141,
    128, 195, 78, 66, 215, 61, 156, 180,
];

/// Noise of period 256 in each coordinate, in `[-1, 1]`, zero at integer points, with two
/// continuous derivatives. Of a point that is not finite it is 0.
pub fn noise(p: [f32; 3]) -> f32 {
    let mut cell = [0u8; 3];
    let mut d = [0.0; 3];
    for c in 0..3 {
        if !p[c].is_finite() {
            return 0.0;
        }
        let floor = p[c].floor();
        d[c] = p[c] - floor;
        // Beyond what an integer holds all points are integers.
        cell[c] = floor as i64 as u8;
    }
    // Along one edge of the cell, then across.
    let [wx, wy, wz] = d.map(fade);
    let along_x = |y: u8, z: u8| {
        let corner = |x: u8| gradient(cell, [x, y, z], d);
        lerp(wx, corner(0), corner(1))
    };
    let along_y = |z: u8| lerp(wy, along_x(0, z), along_x(1, z));
    lerp(wz, along_y(0), along_y(1))
}

/// Perlin's quintic.
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

/// The product of a corner's gradient, a diagonal of a face of a cube, and the way from the corner.
fn gradient(cell: [u8; 3], corner: [u8; 3], d: [f32; 3]) -> f32 {
    // Tables and coordinates have the same period, which is that of the type.
    let hash = (0..3).fold(0u8, |hash, c| {
        let x = cell[c].wrapping_add(corner[c]);
        PERMUTATION[usize::from(hash.wrapping_add(x))]
    });
    let [x, y, z] = [0, 1, 2].map(|c| d[c] - f32::from(corner[c]));
    let h = hash & 15;
    let last = h == 12 || h == 13;
    let u = if h < 8 || last { x } else { y };
    let v = if h < 4 || last { y } else { z };
    let signed = |x: f32, negative: bool| if negative { -x } else { x };
    signed(u, h & 1 != 0) + signed(v, h & 2 != 0)
}

/// The ratio of the frequencies of two octaves: not quite 2, lest their zeros coincide.
const LACUNARITY: f32 = 1.99;

/// What an octave of turbulence is on average, to pbrt.
const MEAN_OF_ABSOLUTE_NOISE: f32 = 0.2;

/// Fractional Brownian motion.
pub fn fbm(p: [f32; 3], octaves: Octaves) -> f32 {
    sum(p, octaves, |noise| noise).0
}

/// The sum of the absolute values of octaves. pbrt adds the mean of one octave more, the first that
/// it leaves out.
pub fn turbulence(p: [f32; 3], octaves: Octaves) -> f32 {
    let (sum, amplitude) = sum(p, octaves, f32::abs);
    sum + MEAN_OF_ABSOLUTE_NOISE * amplitude
}

/// The sum of octaves of `f(noise)`, and the amplitude of the octave after them.
fn sum(p: [f32; 3], octaves: Octaves, f: impl Fn(f32) -> f32) -> (f32, f32) {
    let (mut sum, mut frequency, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..octaves.count {
        sum += amplitude * f(noise(p.map(|x| x * frequency)));
        frequency *= LACUNARITY;
        amplitude *= octaves.roughness;
    }
    (sum, amplitude)
}
