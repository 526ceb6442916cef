//! The triangle test of most renderers (Möller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection"): what the watertight
//! one is measured against ([`crate::switches`]). Triangles that share an edge decide on it by different roundings, so that rays can
//! slip through; fixed distances keep rays from meeting the surface they leave or end on.

use super::ray::Sheared;
use super::triangle::Hit;
use crate::simd::{Lanes, Mask};

/// Part of a shadow ray that is left out at its far end.
const SHADOW: f32 = 1e-4;

/// Hits in `(least, t_max]`, and the barycentric coordinates of vertices 1 and 2.
#[inline(always)]
pub fn meet<L: Lanes, const ANY: bool>(
    ray: &Sheared<L>,
    p: &[[L; 3]; 3],
    t_max: L,
    least: L,
) -> (Hit<L>, [L; 2]) {
    let sub = |a: [L; 3], b: [L; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: [L; 3], b: [L; 3]| a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]));
    let cross = |a: [L; 3], b: [L; 3]| {
        let minor = |i: usize, j: usize| a[i].mul_add(b[j], -(a[j] * b[i]));
        [minor(1, 2), minor(2, 0), minor(0, 1)]
    };
    let (e1, e2) = (sub(p[1], p[0]), sub(p[2], p[0]));
    let across = cross(ray.d, e2);
    let inverse = L::one() / dot(e1, across);
    let from = sub(ray.o, p[0]);
    let b1 = dot(from, across) * inverse;
    let around = cross(from, e1);
    let b2 = dot(ray.d, around) * inverse;
    let t = dot(e2, around) * inverse;
    let end = if ANY {
        t_max * L::splat(1.0 - SHADOW)
    } else {
        t_max
    };
    // Comparisons with NaN, where the ray is in the plane, are false.
    let mask = (L::zero().le(b1).and(L::zero().le(b2)))
        .and((b1 + b2).le(L::one()))
        .and(t.gt(least))
        .and(t.le(end));
    // The sum may round to 1 from above.
    (Hit { mask, t }, [b1, b2.min(L::one() - b1)])
}
