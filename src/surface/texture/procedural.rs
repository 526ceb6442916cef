//! Values computed from coordinates (pbrt-v3, sections 10.5 and 10.6).

use super::noise::{fbm, noise};
use crate::scene::{MarbleSpline, Octaves, Rgb};
use crate::simd::math;

/// Whether the floors of the coordinates have an even sum.
pub fn is_even<const N: usize>(p: [f32; N]) -> bool {
    let sum = p
        .iter()
        .fold(0i64, |sum, x| sum.wrapping_add(x.floor() as i64));
    sum & 1 == 0
}

const DOT_RADIUS: f32 = 0.35;

/// Whether there is a dot at `(s, t)`. Cells are centred on integers; those whose noise is positive
/// have one, shifted by noise as far as their sides.
pub fn on_dot(s: f32, t: f32) -> bool {
    let (cell_s, cell_t) = ((s + 0.5).floor(), (t + 0.5).floor());
    // pbrt's default of the coordinates that are not given.
    let noise = |ds: f32, dt: f32| noise([cell_s + ds, cell_t + dt, 0.5]);
    if noise(0.5, 0.5) <= 0.0 {
        return false;
    }
    let most = 0.5 - DOT_RADIUS;
    let ds = s - (cell_s + most * noise(1.5, 2.8));
    let dt = t - (cell_t + most * noise(4.5, 9.8));
    ds * ds + dt * dt < DOT_RADIUS * DOT_RADIUS
}

/// Bilinear in `(s, t)` of the values at `(0, 0)`, `(0, 1)`, `(1, 0)` and `(1, 1)`.
pub fn bilerp([v00, v01, v10, v11]: [&Rgb; 4], s: f32, t: f32) -> Rgb {
    std::array::from_fn(|c| {
        (1.0 - s) * (1.0 - t) * v00[c]
            + (1.0 - s) * t * v01[c]
            + s * (1.0 - t) * v10[c]
            + s * t * v11[c]
    })
}

/// Height of waves under wind of varying strength.
pub fn windy(p: [f32; 3]) -> f32 {
    let octaves = |count| Octaves {
        count,
        roughness: 0.5,
    };
    let wind = fbm(p.map(|x| 0.1 * x), octaves(3));
    wind.abs() * fbm(p, octaves(6))
}

/// Control points of the Bézier segments, each of four in a row.
const MARBLE: [Rgb; 9] = [
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

const MARBLE_SEGMENTS: f32 = (MARBLE.len() - 3) as f32;

/// Colour of marble at a point in texture space, scaled.
pub fn marble(p: [f32; 3], octaves: Octaves, variation: f32, spline: MarbleSpline) -> Rgb {
    let phase = (p[1] + variation * fbm(p, octaves)) * (0.5 * std::f32::consts::FRAC_1_PI);
    if !phase.is_finite() {
        return [0.0; 3];
    }
    let (sin, _) = math::sin_cos_turns::<f32>(phase - phase.floor());
    let t = (0.5 + 0.5 * sin).clamp(0.0, 1.0) * MARBLE_SEGMENTS;
    let last = match spline {
        MarbleSpline::V3 => 1.0,
        MarbleSpline::V4 => MARBLE_SEGMENTS - 1.0,
    };
    let first = t.floor().min(last);
    let t = t - first;
    let c = &MARBLE[first as usize..];
    // De Casteljau's algorithm; pbrt makes the colours differ more by a factor.
    std::array::from_fn(|i| {
        let between = |a: f32, b: f32| (1.0 - t) * a + t * b;
        let [a, b, d] = [0, 1, 2].map(|k| between(c[k][i], c[k + 1][i]));
        1.5 * between(between(a, b), between(b, d))
    })
}
