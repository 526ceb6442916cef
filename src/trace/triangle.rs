//! The triangle test: watertight, double sided, the same operations at every width and in every
//! traversal.
//!
//! Watertight by construction (Woop et al. 2013): vertices relative to the origin are projected
//! along the ray, each by itself, so that triangles sharing a vertex share its projection. In the
//! plane, the sign of an edge function `a * b - c * d` is right or zero, because rounding is
//! monotone; the products must not be fused. Zero counts as inside. Whatever the projected mesh
//! covers is therefore hit.
//!
//! A triangle is hit only where the ray passes through its own box, grown by
//! [`Extent::pad`](super::ray::Extent::pad) (in vast scenes by less), and `t` is clamped to that
//! passage. Slab tests are monotone in the box, so a ray that passes a triangle's box passes
//! the boxes of all nodes above it, at a smaller or equal distance: no order of traversal, and no
//! culling by the best hit so far, can change a result.

use super::ray::{PAD, Sheared, slab};
use crate::simd::{Lanes, Mask};

/// A bound on the rounding of `dot(p0 - o, n)`, in units of `|p0 - o| |e1| |e2|` (largest
/// components): 39 roundings of 2^-24 in the worst case, counted over [`hit`].
const PLANE_ERROR: f32 = 40.0 / 16_777_216.0;

/// Whether the triangle is a point or a line to [`hit`], which then never meets it.
pub fn is_degenerate(p: [[f32; 3]; 3]) -> bool {
    let e = |i: usize| [0, 1, 2].map(|k| p[i][k] - p[0][k]);
    let (e1, e2) = (e(1), e(2));
    [(1, 2), (2, 0), (0, 1)]
        .iter()
        .all(|&(i, j)| e1[i] * e2[j] - e1[j] * e2[i] == 0.0)
}

/// A hit of some lanes.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L: Lanes> {
    /// Lanes that hit.
    pub mask: L::Mask,
    /// Distances in units of the length of `d`; only of lanes that hit.
    pub t: L,
}

/// How a ray and a triangle are tested, in three steps so that most triangles cost only the first.
/// All traversals have it as a parameter; [`Watertight`] is what pictures are made with, and
/// `benches/robust` measures what it costs over another.
pub trait TriangleTest {
    /// Lanes whose ray, a line without end, may pass through the triangle, and what the next steps
    /// need to know.
    fn covers<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> (L::Mask, [L; 3]);

    /// [`Self::covers`] of what may have neighbours in other spaces; `pad` is as for [`Self::hit`].
    #[inline(always)]
    fn covers_within<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3], _: L) -> (L::Mask, [L; 3]) {
        Self::covers(ray, p)
    }

    /// Hits in `(0, t_max]`, of the lanes in `mask`; with `ANY` before `t_max`. `known` is from the
    /// first step, `pad` what the boxes of triangles are grown by.
    fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
        ray: &Sheared<L>,
        p: &[[L; 3]; 3],
        mask: L::Mask,
        known: [L; 3],
        t_max: L,
        pad: L,
    ) -> Hit<L>;

    /// Barycentric coordinates of vertices 1 and 2, from what the first step knew: in `[0, 1]`,
    /// with a sum of at most 1.
    fn barycentrics<L: Lanes>(known: [L; 3]) -> [L; 2];
}

/// The test described above.
pub struct Watertight;

impl TriangleTest for Watertight {
    #[inline(always)]
    fn covers<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> (L::Mask, [L; 3]) {
        covers(ray, p)
    }

    #[inline(always)]
    fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
        ray: &Sheared<L>,
        p: &[[L; 3]; 3],
        mask: L::Mask,
        _: [L; 3],
        t_max: L,
        pad: L,
    ) -> Hit<L> {
        hit::<L, ANY, VAST>(ray, p, mask, t_max, pad)
    }

    #[inline(always)]
    fn barycentrics<L: Lanes>(weights: [L; 3]) -> [L; 2] {
        barycentrics(weights)
    }
}

/// The test of triangles of instances: as [`Watertight`], but triangles reach a little over their
/// edges. What shares an edge with another instance has it in another space, with other roundings;
/// no ray finds the way between them.
pub struct Overlapping;

/// How far triangles reach over their edges, in units of what their boxes are grown by: 8 roundings
/// of the object's size, of which vertices and rays lose one each and the projection some 5.
const OVERLAP: f32 = 1.0 / 8.0;

impl TriangleTest for Overlapping {
    #[inline(always)]
    fn covers<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> (L::Mask, [L; 3]) {
        covers(ray, p)
    }

    #[inline(always)]
    fn covers_within<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3], pad: L) -> (L::Mask, [L; 3]) {
        let [p0, p1, p2] = projected(ray, p);
        let weights = weights([p0, p1, p2]);
        let reach = pad * L::splat(OVERLAP);
        // A weight is twice an area over an edge, which this is not shorter than.
        let along = |a: [L; 2], b: [L; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
        let [u, v, w] = weights;
        let [u_reach, v_reach, w_reach] =
            [along(p1, p2), along(p2, p0), along(p0, p1)].map(|edge| edge * reach);
        let zero = L::zero();
        let inside = zero.le((u + u_reach).min(v + v_reach).min(w + w_reach));
        let turned = (u - u_reach).max(v - v_reach).max(w - w_reach).le(zero);
        (inside.or(turned), weights)
    }

    #[inline(always)]
    fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
        ray: &Sheared<L>,
        p: &[[L; 3]; 3],
        mask: L::Mask,
        _: [L; 3],
        t_max: L,
        pad: L,
    ) -> Hit<L> {
        hit::<L, ANY, VAST>(ray, p, mask, t_max, pad)
    }

    #[inline(always)]
    fn barycentrics<L: Lanes>(weights: [L; 3]) -> [L; 2] {
        barycentrics(weights)
    }
}

/// Vertices relative to the origin, projected along the ray.
#[inline(always)]
fn projected<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> [[L; 2]; 3] {
    let project = |p: &[L; 3]| {
        let z = p[2] - ray.o[2];
        [
            z.mul_add(ray.shear[0], p[0] - ray.o[0]),
            z.mul_add(ray.shear[1], p[1] - ray.o[1]),
        ]
    };
    [project(&p[0]), project(&p[1]), project(&p[2])]
}

/// Edge functions of projected vertices at the ray.
#[inline(always)]
fn weights<L: Lanes>([[x0, y0], [x1, y1], [x2, y2]]: [[L; 2]; 3]) -> [L; 3] {
    [x2 * y1 - y2 * x1, x0 * y2 - y0 * x2, x1 * y0 - y1 * x0]
}

/// Lanes whose ray, a line without end, passes through the triangle, and the weights of the
/// vertices up to a common factor.
#[inline(always)]
pub fn covers<L: Lanes>(ray: &Sheared<L>, p: &[[L; 3]; 3]) -> (L::Mask, [L; 3]) {
    let weights = weights(projected(ray, p));
    let [u, v, w] = weights;
    let zero = L::zero();
    let mask = zero.le(u.min(v).min(w)).or(u.max(v).max(w).le(zero));
    (mask, weights)
}

/// Where the line meets the plane of the triangle: hits in `(0, t_max]`, of the lanes in `mask`.
///
/// `t` must exceed the rounding of the distance of the origin to the plane, so that a ray leaving a
/// surface does not meet it again. With `ANY`, it must fall short of `t_max` by the rounding at the
/// far end as well. `pad` is [`Ray::own_pad`](super::ray::Ray::own_pad).
#[inline(always)]
pub fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
    ray: &Sheared<L>,
    p: &[[L; 3]; 3],
    mask: L::Mask,
    t_max: L,
    pad: L,
) -> Hit<L> {
    let sub = |a: [L; 3], b: [L; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: [L; 3], b: [L; 3]| a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]));
    let largest = |a: [L; 3]| a[0].abs().max(a[1].abs()).max(a[2].abs());
    let (e1, e2, v) = (sub(p[1], p[0]), sub(p[2], p[0]), sub(p[0], ray.o));
    // Not fused: the normal of a triangle with two equal vertices must be exactly zero.
    let minor = |i: usize, j: usize| e1[i] * e2[j] - e1[j] * e2[i];
    let n = [minor(1, 2), minor(2, 0), minor(0, 1)];
    let slope = dot(ray.d, n);
    // Distances to the plane, times |n|, positive in front of the origin.
    let distance = dot(v, n) * L::one().copysign(slope);
    let slope = slope.abs();
    let scale = L::splat(PLANE_ERROR) * largest(e1) * largest(e2);
    let error = scale * largest(v);

    let pad = if VAST {
        let edge = largest(e1).max(largest(e2));
        (largest(v) + edge).mul_add(L::splat(PAD), pad)
    } else {
        pad
    };
    let low = |k: usize| p[0][k].min(p[1][k]).min(p[2][k]) - pad;
    let high = |k: usize| p[0][k].max(p[1][k]).max(p[2][k]) + pad;
    let (near, far) = slab(ray, [low(0), low(1), low(2)], [high(0), high(1), high(2)]);
    let mask = mask
        .and(distance.gt(error))
        .and(slope.gt(L::zero()))
        .and(near.le(far));
    if ANY {
        let end = error + scale * t_max;
        let short = (t_max * slope - distance).gt(end + end);
        return Hit {
            mask: mask.and(short).and(near.le(t_max)),
            t: near,
        };
    }
    let t = (distance / slope).min(far).max(near);
    Hit {
        mask: mask.and(t.gt(L::zero())).and(t.le(t_max)),
        t,
    }
}

/// Barycentric coordinates of vertices 1 and 2 from [`covers`]' weights: in `[0, 1]`, with a sum of
/// at most 1.
#[inline(always)]
pub fn barycentrics<L: Lanes>(weights: [L; 3]) -> [L; 2] {
    let [u, v, w] = weights;
    let sum = u + v + w;
    // NaN (all weights 0: the triangle is seen from its edge) becomes 0.
    let b1 = (v / sum).max(L::zero()).min(L::one());
    let b2 = (w / sum).max(L::zero()).min(L::one() - b1);
    [b1, b2]
}
