//! One ray against eight boxes, or eight triangles, at once.

use std::ops::Range;

use super::best::Best;
use super::bvh8::Node8;
use super::ray::{PAD, PAD_OF_ORIGIN, Sheared};
use super::store::WIDTH;
use super::trees::Trees;
use super::triangle::TriangleTest;
use crate::simd::{Lanes, Mask, f32x8};

/// The ray of one lane, in every lane.
#[derive(Clone, Copy)]
pub(super) struct Broadcast {
    pub rd: [f32x8; 3],
    pub ord: [f32x8; 3],
    pub own: Sheared<f32x8>,
    /// [`Ray::own_pad`].
    pub pad: f32x8,
    /// 1 where the direction is negative.
    pub negative: [usize; 3],
    /// Axes of the scene in the ray's own order.
    pub order: [usize; 3],
}

/// Where the ray enters each child, and bits of those it enters no later than its best hit.
#[inline(always)]
pub(super) fn enter<const VAST: bool>(ray: &Broadcast, node: &Node8, t_max: f32) -> (f32x8, u32) {
    let (mut near, mut far) = (f32x8::ZERO, f32x8::splat(t_max));
    for k in 0..3 {
        let side = ray.negative[k] & 1;
        let plane =
            |side: usize| Lanes::mul_add(f32x8::new(node.bounds[k][side]), ray.rd[k], -ray.ord[k]);
        let grown = if VAST {
            ray.pad * f32x8::splat(PAD_OF_ORIGIN / PAD) * Lanes::abs(ray.rd[k])
        } else {
            f32x8::ZERO
        };
        let (t0, t1) = (plane(side), plane(1 - side));
        near = Lanes::max(near, if VAST { t0 - grown } else { t0 });
        far = Lanes::min(far, if VAST { t1 + grown } else { t1 });
    }
    (near, Mask::bits(Lanes::le(near, far)))
}

/// Tests the triangles of a group, up to eight.
#[inline(always)]
pub(super) fn test_group<T: TriangleTest, const ANY: bool, const VAST: bool>(
    trees: &Trees,
    ray: &Broadcast,
    range: Range<usize>,
    best: &mut Best<f32>,
) {
    let group = trees.triangles.group(range.start, range.len());
    let p = group.ordered(ray.order).all();
    let (mask, known) = T::covers_within(&ray.own, &p, ray.pad);
    let covered = Mask::bits(mask) & group.lanes();
    if covered == 0 {
        return;
    }
    let t_max = f32x8::splat(best.t);
    let found = T::hit::<f32x8, ANY, VAST>(&ray.own, &p, mask, known, t_max, ray.pad);
    let mask = Mask::bits(found.mask) & covered;
    record_all::<ANY>(trees, range, mask, found.t, || T::barycentrics(known), best);
}

/// Records the hits of a group.
#[inline(always)]
fn record_all<const ANY: bool>(
    trees: &Trees,
    range: Range<usize>,
    mut mask: u32,
    t: f32x8,
    barycentrics: impl FnOnce() -> [f32x8; 2],
    best: &mut Best<f32>,
) {
    if mask == 0 {
        return;
    }
    if ANY {
        best.t = -1.0;
        return;
    }
    let t = t.to_array();
    let b = barycentrics().map(|b| b.to_array());
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize & (WIDTH - 1);
        mask &= mask - 1;
        let prim = trees.triangles.index(range.start + lane);
        record::<ANY>(best, t[lane], prim, || [b[0][lane], b[1][lane]]);
    }
}

/// Records a hit if it is the best so far.
#[inline(always)]
pub(super) fn record<const ANY: bool>(
    best: &mut Best<f32>,
    t: f32,
    prim: u32,
    barycentrics: impl FnOnce() -> [f32; 2],
) {
    if ANY {
        best.t = -1.0;
    } else if t < best.t || (t == best.t && prim < best.prim) {
        let [b1, b2] = barycentrics();
        *best = Best { t, b1, b2, prim };
    }
}
