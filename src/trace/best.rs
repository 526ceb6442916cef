//! The best hit of a ray on its way.

use super::ray::Ray;
use super::records::{self, HitLanes, RayLanes};
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, UintLanes};

/// The best hit so far.
#[derive(Clone, Copy, Debug)]
pub struct Best<L: Lanes> {
    /// Hits must be no further. Negative for lanes that are done.
    pub t: L,
    pub b1: L,
    pub b2: L,
    pub prim: L::Uint,
}

impl Best<f32> {
    /// A ray that is done.
    pub const NOTHING: Self = Self {
        t: -1.0,
        b1: 0.0,
        b2: 0.0,
        prim: NONE,
    };
}

impl<L: Lanes> Best<L> {
    /// No hit; hits must be nearer than the end of the ray.
    #[inline(always)]
    pub fn new(ray: &Ray<L>) -> Self {
        // "Below t_max" is "at most its predecessor"; then ties can go to the smaller index without
        // exception.
        let before = L::from_bits(ray.t_max.to_bits().sub(L::Uint::splat(1)));
        Self {
            t: L::select(ray.live(), before, ray.t_max),
            b1: L::zero(),
            b2: L::zero(),
            prim: L::Uint::splat(NONE),
        }
    }

    /// Lanes of `mask`, whose `t` is not above the best, for which (t, prim) is a better hit.
    #[inline(always)]
    pub fn improves(&self, mask: L::Mask, t: L, prim: L::Uint) -> L::Mask {
        mask.and(t.lt(self.t).or(L::uint_lt(prim, self.prim)))
    }

    #[inline(always)]
    pub fn update(&mut self, mask: L::Mask, t: L, b: [L; 2], prim: L::Uint) {
        self.t = L::select(mask, t, self.t);
        self.b1 = L::select(mask, b[0], self.b1);
        self.b2 = L::select(mask, b[1], self.b2);
        self.prim = L::uint_select(mask, prim, self.prim);
    }

    /// Bits of the lanes that ended with a negative `t`: something was in their way.
    #[inline(always)]
    pub fn blocked(&self, ray: &Ray<L>) -> u32 {
        ray.live().and(self.t.lt(L::zero())).bits()
    }

    /// As the caller's records.
    #[inline(always)]
    pub fn store(
        self,
        ray: &Ray<L>,
        rays: &[records::Ray],
        list: &[u32],
        hits: &mut [records::Hit],
    ) {
        let mut t = ray.external_t(self.t);
        if ray.t_shift.gt(L::zero()).any() {
            // The shift rounds; the result must stay below the caller's end.
            let end = RayLanes::<L>::load(rays, list).t_max;
            t = t.min(L::from_bits(end.to_bits().sub(L::Uint::splat(1))));
        }
        let missed = L::uint_eq(self.prim, L::Uint::splat(NONE));
        HitLanes {
            t: L::select(missed, L::zero(), t),
            b: [self.b1, self.b2],
            primitive: self.prim,
            instance: L::Uint::splat(NONE),
        }
        .store(hits, list);
    }
}
