//! Primary samples to directions and points, in `f64`: the definitions of the renderer's maps.

use super::vector::{V, add, scale};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// Square to unit disk, concentric (Shirley and Chiu 1997).
pub fn disk(u: f64, v: f64) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (r, phi) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else if b == 0.0 {
        (0.0, 0.0)
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    (r * phi.cos(), r * phi.sin())
}

/// Cosine-distributed around `+z` (Malley's method).
pub fn hemisphere(u: f64, v: f64) -> V {
    let (x, y) = disk(u, v);
    // On the concentric map the squared radius is known exactly.
    let r = (2.0 * u - 1.0).abs().max((2.0 * v - 1.0).abs());
    [x, y, ((1.0 - r) * (1.0 + r)).max(0.0).sqrt()]
}

/// Uniform on the unit sphere.
pub fn sphere(u: f64, v: f64) -> V {
    let z = 1.0 - 2.0 * u;
    // 1 - z^2 = 4 u (1 - u)
    let r = (4.0 * u * (1.0 - u)).max(0.0).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    [r * cos, r * sin, z]
}

/// Axes around unit `n` as the renderer has them, which say where a sampled azimuth starts (Duff et
/// al. 2017).
pub fn frame(n: V) -> [V; 3] {
    let sign = 1f64.copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    [
        [1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]],
        [b, sign + n[1] * n[1] * a, -n[1]],
        n,
    ]
}

/// From the axes around `n`.
pub fn around(n: V, local: V) -> V {
    let [s, t, n] = frame(n);
    from_axes([s, t, n], local)
}

/// The vector of these coordinates.
pub fn from_axes([s, t, n]: [V; 3], local: V) -> V {
    add(
        scale(s, local[0]),
        add(scale(t, local[1]), scale(n, local[2])),
    )
}
