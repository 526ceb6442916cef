//! The triangle test of most renderers (Möller and Trumbore 1997, "Fast, Minimum Storage
//! Ray/Triangle Intersection"). Triangles that share an edge decide on it by different roundings,
//! so that rays can slip through; fixed distances keep rays from meeting the surface they leave or
//! end on.

use phalanx::simd::{Lanes, Mask};
use phalanx::trace::{Sheared, TriangleHit, TriangleTest};

/// Part of a shadow ray that is left out at its far end.
const SHADOW: f32 = 1e-4;

pub struct Fast;

impl TriangleTest for Fast {
    /// Knows both barycentric coordinates and the distance.
    #[inline(always)]
    fn covers<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> (L::Mask, [L; 3]) {
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
        // Comparisons with NaN, where the ray is in the plane, are false.
        let mask = (L::zero().le(b1).and(L::zero().le(b2))).and((b1 + b2).le(L::one()));
        (mask, [b1, b2, t])
    }

    #[inline(always)]
    fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
        _: &Sheared<L>,
        _: &[[L; 3]; 3],
        mask: L::Mask,
        [_, _, t]: [L; 3],
        t_max: L,
        pad: L,
    ) -> TriangleHit<L> {
        let end = if ANY {
            t_max * L::splat(1.0 - SHADOW)
        } else {
            t_max
        };
        let mask = mask.and(t.gt(pad)).and(t.le(end));
        TriangleHit { mask, t }
    }

    #[inline(always)]
    fn barycentrics<L: Lanes>([b1, b2, _]: [L; 3]) -> [L; 2] {
        // The sum may round to 1 from above.
        [b1, b2.min(L::one() - b1)]
    }
}
