//! Origins off surfaces: how far a computed hit point can be from the true surface, and how to
//! leave it (pbrt-v4, section 6.8, "Managing rounding error").

use crate::simd::{Lanes, Vec3};

/// Rounding of `n` operations, relative: `n u / (1 - n u)` with `u = 2^-24`.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f64 / 16_777_216.0;
    (nu / (1.0 - nu)) as f32
}

/// A point on a triangle, `(1 - b1 - b2) p0 + b1 p1 + b2 p2`, and a bound on its distance from the
/// plane per axis.
#[inline(always)]
pub fn triangle_point<L: Lanes>(p: [Vec3<L>; 3], b1: L, b2: L) -> (Vec3<L>, Vec3<L>) {
    let b0 = L::one() - b1 - b2;
    let point = p[0].mul_add(b0, p[1].mul_add(b1, p[2] * b2));
    let size = abs(p[0]).mul_add(b0, abs(p[1]).mul_add(b1, abs(p[2]) * b2));
    (point, size * L::splat(gamma(7)))
}

/// `point` moved along the normal `n` (of any length but 0), to the side `towards` points to, until
/// it is off the surface wherever within `error` the true surface is.
#[inline(always)]
pub fn leave_surface<L: Lanes>(
    point: Vec3<L>,
    error: Vec3<L>,
    n: Vec3<L>,
    towards: Vec3<L>,
) -> Vec3<L> {
    leave(point, error_distance(n, error), n, towards)
}

/// A bound per axis as a distance along the normal `n`, in units of its length.
#[inline(always)]
pub fn error_distance<L: Lanes>(n: Vec3<L>, error: Vec3<L>) -> L {
    abs(n).dot(error) / n.length2()
}

/// [`leave_surface`] for a known [`error_distance`].
#[inline(always)]
pub fn leave<L: Lanes>(point: Vec3<L>, distance: L, n: Vec3<L>, towards: Vec3<L>) -> Vec3<L> {
    let offset = n * distance.copysign(n.dot(towards));
    // Rounding of the sum goes outwards.
    let away = |p: L, o: L| {
        let sum = p + o;
        sum + (sum.abs() * L::splat(f32::EPSILON)).copysign(o)
    };
    Vec3::new(
        away(point.x, offset.x),
        away(point.y, offset.y),
        away(point.z, offset.z),
    )
}

#[inline(always)]
fn abs<L: Lanes>(v: Vec3<L>) -> Vec3<L> {
    Vec3::new(v.x.abs(), v.y.abs(), v.z.abs())
}
