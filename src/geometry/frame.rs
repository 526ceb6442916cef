//! Frames that BSDFs are evaluated in.

use crate::simd::{Frame, Lanes, Vec3};

/// A shading frame around `ns` whose first axis follows `tangent` where that is not zero.
#[inline(always)]
pub fn shading_frame<L: Lanes>(ns: Vec3<L>, tangent: Vec3<L>) -> Frame<L> {
    let plain = Frame::new(ns);
    let tiny = L::splat(f32::MIN_POSITIVE);
    let t = tangent * (L::one() / tangent.max_abs().max(tiny));
    let s = t - ns * ns.dot(t);
    let length2 = s.length2();
    let usable = length2.gt(L::splat(1e-10));
    let s = s * (L::one() / length2.sqrt());
    Frame {
        s: Vec3::select(usable, s, plain.s),
        t: Vec3::select(usable, ns.cross(s), plain.t),
        n: ns,
    }
}
