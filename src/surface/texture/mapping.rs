//! From a place to `(s, t)`, or to a point in texture space (pbrt-v3, section 10.2).

use std::f32::consts::FRAC_1_PI;

use super::place::Place;
use crate::scene::{Mapping, ToTexture};
use crate::simd::math;

/// `(s, t)` of a place.
pub fn map(mapping: &Mapping, place: &Place) -> (f32, f32) {
    match mapping {
        Mapping::Uv(m) => {
            let [u, v] = place.uv;
            (m.su * u + m.du, m.sv * v + m.dv)
        }
        Mapping::Spherical(to_texture) => {
            let [x, y, z] = direction(transform(to_texture, place.p));
            let theta = math::atan2::<f32>((x * x + y * y).sqrt(), z);
            let turns = azimuth(x, y);
            let t = if turns < 0.0 { turns + 1.0 } else { turns };
            (theta * FRAC_1_PI, t)
        }
        Mapping::Cylindrical { to_texture, unit } => {
            let p = transform(to_texture, place.p);
            let [x, y, z] = direction(p);
            let length = (x * x + y * y + z * z).sqrt();
            let t = match (*unit, length > 0.0) {
                (false, _) => p[2],
                (true, true) => z / length,
                (true, false) => 0.0,
            };
            (0.5 + azimuth(x, y), t)
        }
        Mapping::Planar(to_texture) => {
            let [s, t, _] = transform(to_texture, place.p);
            (s, t)
        }
    }
}

/// A point in texture space.
pub fn transform(to_texture: &ToTexture, [x, y, z]: [f32; 3]) -> [f32; 3] {
    // A loop and not `array::map`, which is not reliably inlined.
    let mut p = [0.0; 3];
    for (p, m) in p.iter_mut().zip(to_texture) {
        *p = z.mul_add(m[2], y.mul_add(m[1], x.mul_add(m[0], m[3])));
    }
    p
}

/// In turns, `(-1/2, 1/2]`.
fn azimuth(x: f32, y: f32) -> f32 {
    math::atan2::<f32>(y, x) * (0.5 * FRAC_1_PI)
}

/// The direction to a point, at a length whose square is neither zero nor infinite; zero for the
/// origin.
fn direction(p: [f32; 3]) -> [f32; 3] {
    let largest = p.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    if largest > 0.0 {
        p.map(|x| x / largest)
    } else {
        p
    }
}
