//! The formulas of pbrt, one for one.

use glam::DVec3;
use phalanx::scene::MarbleSpline;
use std::f64::consts::{PI, TAU};

const PERM: [usize; 256] = [
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

fn grad(x: usize, y: usize, z: usize, dx: f64, dy: f64, dz: f64) -> f64 {
    let perm = |i: usize| PERM[i % 256];
    let h = perm(perm(perm(x) + y) + z) & 15;
    let u = if h < 8 || h == 12 || h == 13 { dx } else { dy };
    let v = if h < 4 || h == 12 || h == 13 { dy } else { dz };
    (if h & 1 != 0 { -u } else { u }) + (if h & 2 != 0 { -v } else { v })
}

pub fn noise(p: DVec3) -> f64 {
    let [ix, iy, iz] = p.floor().to_array().map(|x| (x as i64 & 255) as usize);
    let d = p - p.floor();
    let w = |i: usize, j: usize, k: usize| {
        let (x, y, z) = (d.x - i as f64, d.y - j as f64, d.z - k as f64);
        grad(ix + i, iy + j, iz + k, x, y, z)
    };
    let weight = |t: f64| 6.0 * t.powi(5) - 15.0 * t.powi(4) + 10.0 * t.powi(3);
    let lerp = |t: f64, a: f64, b: f64| (1.0 - t) * a + t * b;
    let x00 = lerp(weight(d.x), w(0, 0, 0), w(1, 0, 0));
    let x10 = lerp(weight(d.x), w(0, 1, 0), w(1, 1, 0));
    let x01 = lerp(weight(d.x), w(0, 0, 1), w(1, 0, 1));
    let x11 = lerp(weight(d.x), w(0, 1, 1), w(1, 1, 1));
    let y0 = lerp(weight(d.y), x00, x10);
    let y1 = lerp(weight(d.y), x01, x11);
    lerp(weight(d.z), y0, y1)
}

/// With a footprint of size 0.
pub fn fbm(p: DVec3, omega: f64, octaves: u32) -> f64 {
    let (mut sum, mut lambda, mut o) = (0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += o * noise(lambda * p);
        lambda *= 1.99;
        o *= omega;
    }
    sum
}

pub fn turbulence(p: DVec3, omega: f64, octaves: u32) -> f64 {
    let (mut sum, mut lambda, mut o) = (0.0, 1.0, 1.0);
    for _ in 0..octaves {
        sum += o * noise(lambda * p).abs();
        lambda *= 1.99;
        o *= omega;
    }
    sum + o * 0.2
}

pub fn windy(p: DVec3) -> f64 {
    fbm(0.1 * p, 0.5, 3).abs() * fbm(p, 0.5, 6)
}

/// The colour of marble where its sine is `2 t - 1`.
pub fn marble(t: f64, spline: MarbleSpline) -> [f64; 3] {
    let colors = [
        [0.58, 0.58, 0.6],
        [0.58, 0.58, 0.6],
        [0.58, 0.58, 0.6],
        [0.5, 0.5, 0.5],
        [0.6, 0.59, 0.58],
        [0.58, 0.58, 0.6],
        [0.58, 0.58, 0.6],
        [0.2, 0.2, 0.33],
        [0.58, 0.58, 0.6],
    ];
    let segments = 6.0;
    let first = match spline {
        MarbleSpline::V3 => ((t * segments).floor() as usize).min(1),
        MarbleSpline::V4 => ((t * segments).floor() as usize).min(5),
    };
    let t = t * segments - first as f64;
    // Bernstein's form; pbrt has de Casteljau's.
    std::array::from_fn(|c| {
        let k = |i: usize| colors[first + i][c];
        let s = 1.0 - t;
        1.5 * (s * s * s * k(0)
            + 3.0 * s * s * t * k(1)
            + 3.0 * s * t * t * k(2)
            + t * t * t * k(3))
    })
}

pub fn dots(s: f64, t: f64) -> bool {
    let noise = |x: f64, y: f64| noise(DVec3::new(x, y, 0.5));
    let (cell_s, cell_t) = ((s + 0.5).floor(), (t + 0.5).floor());
    if noise(cell_s + 0.5, cell_t + 0.5) > 0.0 {
        let (radius, max_shift) = (0.35, 0.15);
        let centre_s = cell_s + max_shift * noise(cell_s + 1.5, cell_t + 2.8);
        let centre_t = cell_t + max_shift * noise(cell_s + 4.5, cell_t + 9.8);
        return (s - centre_s).powi(2) + (t - centre_t).powi(2) < radius * radius;
    }
    false
}

pub fn spherical(p: DVec3) -> [f64; 2] {
    let v = p.normalize();
    let phi = v.y.atan2(v.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    [v.z.clamp(-1.0, 1.0).acos() / PI, phi / TAU]
}

pub fn cylindrical_v3(p: DVec3) -> [f64; 2] {
    let v = p.normalize();
    [(PI + v.y.atan2(v.x)) / TAU, v.z]
}

pub fn cylindrical_v4(p: DVec3) -> [f64; 2] {
    [(PI + p.y.atan2(p.x)) / TAU, p.z]
}
