//! `N` rays together down the binary tree; at one lane, the plain single-ray traversal.
//!
//! Both children of a node are tested for all rays at once. The child that more rays meet first is
//! entered, the other waits on a stack with its entry distances, so that it is dropped if all its
//! rays have found something nearer meanwhile.

use super::best::Best;
use super::node::{Bounds, Child, Link, MAX_DEPTH, Node};
use super::ray::{Agreement, Ray};
use super::single::{self, Stored, Walks};
use super::store::{Ordered, permuted};
use super::trees::Trees;
use super::triangle::TriangleTest;
use crate::simd::{Lanes, Mask, UintLanes};

/// Subtrees to be visited, with the distances at which each ray enters them.
pub struct Stack<L>([(Link, L); MAX_DEPTH]);

impl<L: Lanes> Stack<L> {
    pub fn new() -> Self {
        Self([(Link::EMPTY, L::zero()); MAX_DEPTH])
    }
}

/// Follows one packet. With `ANY`, lanes that hit something end with a negative `best.t`; triangles
/// are tested by `T`.
///
/// Where no more than `few` rays meet a subtree, each follows it alone through the wide tree (as in
/// Embree's hybrid traversal, Wald et al. 2014).
#[inline(always)]
pub fn traverse<L: Lanes, T: TriangleTest, const ANY: bool, const VAST: bool>(
    trees: &Trees,
    ray: &Ray<L>,
    best: &mut Best<L>,
    stack: &mut Stack<L>,
    walks: &mut Walks,
    few: u32,
) {
    match ray.agreement() {
        Some(agreement) => {
            descend::<L, T, ANY, VAST, true>(trees, ray, &agreement, best, stack, walks, few);
        }
        None => {
            let any = Agreement {
                negative: [0; 3],
                order: [0, 1, 2],
            };
            descend::<L, T, ANY, VAST, false>(trees, ray, &any, best, stack, walks, few);
        }
    }
}

#[inline(always)]
fn descend<L: Lanes, T: TriangleTest, const ANY: bool, const VAST: bool, const AGREE: bool>(
    trees: &Trees,
    ray: &Ray<L>,
    agreement: &Agreement,
    best: &mut Best<L>,
    stack: &mut Stack<L>,
    walks: &mut Walks,
    few: u32,
) {
    let Stack(stack) = stack;
    // Rays that miss a box never enter it.
    let nowhere = L::splat(f32::INFINITY);
    let growth = ray.growth::<VAST>();
    let mut top = 0;
    let mut current = Link::to(Child::inner(0));
    let mut bits = ray.live().bits();
    let mut stored = None;
    loop {
        if L::N > 1
            && bits.count_ones() <= few
            && !current.child.is_leaf()
            && let Some(wide) = current.wide()
        {
            let stored = stored.get_or_insert_with(|| Stored::new(ray));
            *best = if trees.in_turns {
                single::leave::<L, T, ANY, VAST, true>(trees, ray, stored, bits, wide, *best, walks)
            } else {
                single::leave::<L, T, ANY, VAST, false>(
                    trees, ray, stored, bits, wide, *best, walks,
                )
            };
        } else if !current.child.is_leaf() {
            let node: &Node = &trees.nodes[current.child.index()];
            let (near0, meets0) =
                enter::<L, VAST, AGREE>(ray, &growth, agreement, &node.bounds[0], best.t);
            let (near1, meets1) =
                enter::<L, VAST, AGREE>(ray, &growth, agreement, &node.bounds[1], best.t);
            let (bits0, bits1) = (meets0.bits(), meets1.bits());
            match (bits0 != 0, bits1 != 0) {
                (true, true) => {
                    // Rays that meet only one child have no say.
                    let both = bits0 & bits1;
                    let second = near1.lt(near0).bits() & both;
                    if 2 * second.count_ones() > both.count_ones() {
                        let near = L::select(meets0, near0, nowhere);
                        stack[top & (MAX_DEPTH - 1)] = (node.link[0], near);
                        current = node.link[1];
                        bits = bits1;
                    } else {
                        let near = L::select(meets1, near1, nowhere);
                        stack[top & (MAX_DEPTH - 1)] = (node.link[1], near);
                        current = node.link[0];
                        bits = bits0;
                    }
                    top += 1;
                    continue;
                }
                (true, false) => {
                    current = node.link[0];
                    bits = bits0;
                    continue;
                }
                (false, true) => {
                    current = node.link[1];
                    bits = bits1;
                    continue;
                }
                (false, false) => {}
            }
        } else if current.child.is_sphere_leaf() {
            for sphere in &trees.spheres[current.child.range()] {
                if VAST && let Some(large) = sphere.as_large() {
                    let large = &trees.large[large];
                    let (found, b) = large.hit::<L, ANY>(ray, best.t);
                    record::<L, ANY>(best, found.mask, found.t, large.primitive(), || b);
                    continue;
                }
                let found = sphere.hit::<L, ANY, VAST>(ray, best.t);
                let zero = L::zero();
                record::<L, ANY>(best, found.mask, found.t, sphere.index(), || [zero, zero]);
            }
        } else {
            let range = current.child.range();
            let part = current.part();
            let (place, size) = (part.place as usize, part.size as usize);
            let group = trees.triangles.group(range.start - place, size);
            let group = group.ordered(agreement.order);
            for (i, position) in range.enumerate() {
                let index = || trees.triangles.index(position);
                test_triangle::<L, T, ANY, VAST, AGREE>(ray, &group, place + i, best, index);
            }
        }
        if ANY && !best.t.ge(L::zero()).any() {
            return;
        }
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let (link, near) = stack[top & (MAX_DEPTH - 1)];
            bits = near.le(best.t).bits();
            if bits != 0 {
                current = link;
                break;
            }
        }
    }
}

/// Where rays enter a box, and which do so no later than their best hit.
#[inline(always)]
fn enter<L: Lanes, const VAST: bool, const AGREE: bool>(
    ray: &Ray<L>,
    growth: &[L; 3],
    agreement: &Agreement,
    bounds: &Bounds,
    t_max: L,
) -> (L, L::Mask) {
    let plane =
        |k: usize, side: usize| L::splat(bounds[k][side & 1]).mul_add(ray.rd[k], -ray.ord[k]);
    let (mut near, mut far) = (L::zero(), t_max);
    for k in 0..3 {
        let side = agreement.negative[k];
        let (t0, t1) = (plane(k, side), plane(k, 1 - side));
        if VAST {
            let grown = growth[k];
            near = near.max(t0.min(t1) - grown);
            far = far.min(t0.max(t1) + grown);
        } else if AGREE {
            near = near.max(t0);
            far = far.min(t1);
        } else {
            near = near.max(t0.min(t1));
            far = far.min(t0.max(t1));
        }
    }
    (near, near.le(far))
}

#[inline(always)]
fn test_triangle<
    L: Lanes,
    T: TriangleTest,
    const ANY: bool,
    const VAST: bool,
    const AGREE: bool,
>(
    ray: &Ray<L>,
    group: &Ordered,
    place: usize,
    best: &mut Best<L>,
    index: impl FnOnce() -> u32,
) {
    let p = group.one(place);
    let p = if AGREE { p } else { permuted(p, ray) };
    let (mask, known) = T::covers(&ray.own, &p);
    if mask.any() {
        let pad = ray.own_pad::<VAST>();
        let found = T::hit::<L, ANY, VAST>(&ray.own, &p, mask, known, best.t, pad);
        record::<L, ANY>(best, found.mask, found.t, index(), || {
            T::barycentrics(known)
        });
    }
}

#[inline(always)]
fn record<L: Lanes, const ANY: bool>(
    best: &mut Best<L>,
    mask: L::Mask,
    t: L,
    index: u32,
    barycentrics: impl FnOnce() -> [L; 2],
) {
    if ANY {
        best.t = L::select(mask, L::splat(-1.0), best.t);
        return;
    }
    let prim = L::Uint::splat(index);
    let better = best.improves(mask, t, prim);
    if better.any() {
        best.update(better, t, barycentrics(), prim);
    }
}
