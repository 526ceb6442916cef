//! One ray at a time down the wide tree: eight boxes or eight triangles per step. For rays that have nothing in common.

use super::Tracer;
use super::bvh8::{Block, Node8};
use super::node::Child;
use super::packet::{Best, MAX_DEPTH};
use super::ray::{Ray, Sheared};
use super::triangle::{barycentrics, covers, hit};
use crate::simd::{Lanes, Mask, UintLanes, f32x8};

/// Entries of the stack; a power of two, so that it needs no bounds checks. A node leaves at most seven behind.
const STACK: usize = 1024;
/// A wide tree is no deeper than the binary one.
const _: () = assert!(7 * MAX_DEPTH < STACK);

/// Children to be visited: bits of the distance at which the ray enters, then the child. Distances are not negative, so entries
/// order as integers.
pub struct Stack([u64; STACK]);

impl Stack {
    pub fn new() -> Self {
        Self([0; STACK])
    }
}

/// The ray of one lane, in every lane.
struct Splat {
    rd: [f32x8; 3],
    ord: [f32x8; 3],
    own: Sheared<f32x8>,
    pad: f32x8,
    /// 1 where the direction is negative.
    negative: [usize; 3],
    /// Axes of the scene in the ray's own order.
    order: [usize; 3],
}

impl Splat {
    #[inline(always)]
    fn new(ray: &Ray<f32>) -> Self {
        let all = |v: [f32; 3]| [f32x8::splat(v[0]), f32x8::splat(v[1]), f32x8::splat(v[2])];
        Self {
            rd: all(ray.rd),
            ord: all(ray.ord),
            own: Sheared {
                o: all(ray.own.o),
                d: all(ray.own.d),
                rd: all(ray.own.rd),
                ord: all(ray.own.ord),
                shear: [
                    f32x8::splat(ray.own.shear[0]),
                    f32x8::splat(ray.own.shear[1]),
                ],
            },
            pad: f32x8::splat(ray.pad),
            negative: [
                usize::from(ray.rd[0] < 0.0),
                usize::from(ray.rd[1] < 0.0),
                usize::from(ray.rd[2] < 0.0),
            ],
            order: match (ray.swap_x, ray.swap_y) {
                (true, _) => [2, 1, 0],
                (_, true) => [0, 2, 1],
                _ => [0, 1, 2],
            },
        }
    }
}

/// Follows the rays of a packet one after the other; `best` may hold hits found before. With `ANY`, lanes that hit something
/// end with a negative `best.t`.
#[inline(always)]
pub fn traverse<L: Lanes, const ANY: bool>(
    tracer: &Tracer,
    rays: &Ray<L>,
    best: &mut Best<L>,
    stack: &mut Stack,
) {
    let mut live = best.t.ge(L::zero()).bits();
    let mut found = [Best::<f32>::NOTHING; 8];
    for (lane, found) in found.iter_mut().enumerate().take(L::N) {
        *found = best.lane(lane);
    }
    while live != 0 {
        let lane = live.trailing_zeros() as usize & 7;
        live &= live - 1;
        descend::<ANY>(tracer, &rays.lane(lane), &mut found[lane], stack);
    }
    *best = Best {
        t: L::from_fn(|lane| found[lane & 7].t),
        b1: L::from_fn(|lane| found[lane & 7].b1),
        b2: L::from_fn(|lane| found[lane & 7].b2),
        prim: L::Uint::from_fn(|lane| found[lane & 7].prim),
    };
}

fn descend<const ANY: bool>(
    tracer: &Tracer,
    rays: &Ray<f32>,
    best: &mut Best<f32>,
    stack: &mut Stack,
) {
    let ray = Splat::new(rays);
    let Stack(stack) = stack;
    let mut top = 0;
    let mut current = Child::inner(0);
    loop {
        if !current.is_leaf() {
            let node: &Node8 = &tracer.wide.nodes[current.index()];
            let (near, meets) = enter(&ray, node, best.t);
            let mut meets = meets;
            if meets != 0 {
                let entry = |slot: usize| {
                    (near[slot & 7].to_bits() as u64) << 32 | node.child[slot & 7].0 as u64
                };
                let mut nearest = entry(meets.trailing_zeros() as usize);
                meets &= meets - 1;
                // The nearest is entered, the others wait, farthest first.
                let bottom = top;
                while meets != 0 {
                    let next = entry(meets.trailing_zeros() as usize);
                    meets &= meets - 1;
                    let mut farther = nearest.max(next);
                    nearest = nearest.min(next);
                    let mut at = top;
                    while at > bottom && stack[(at - 1) & (STACK - 1)] < farther {
                        stack[at & (STACK - 1)] = stack[(at - 1) & (STACK - 1)];
                        at -= 1;
                    }
                    std::mem::swap(&mut farther, &mut stack[at & (STACK - 1)]);
                    top += 1;
                }
                current = Child(nearest as u32);
                continue;
            }
        } else if current.is_sphere_leaf() {
            for sphere in &tracer.spheres[current.range()] {
                let found = sphere.hit::<f32, ANY>(rays, best.t);
                if found.mask {
                    record::<ANY>(best, found.t, sphere.index(), || [0.0; 2]);
                }
            }
        } else {
            for block in &tracer.wide.blocks[current.range()] {
                test_block::<ANY>(&ray, block, best);
            }
        }
        if ANY && best.t < 0.0 {
            return;
        }
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let entry = stack[top & (STACK - 1)];
            if f32::from_bits((entry >> 32) as u32) <= best.t {
                current = Child(entry as u32);
                break;
            }
        }
    }
}

/// Where the ray enters each child, and bits of those it enters no later than its best hit.
#[inline(always)]
fn enter(ray: &Splat, node: &Node8, t_max: f32) -> ([f32; 8], u32) {
    let (mut near, mut far) = (f32x8::ZERO, f32x8::splat(t_max));
    for k in 0..3 {
        let side = ray.negative[k] & 1;
        let plane =
            |side: usize| Lanes::mul_add(f32x8::new(node.bounds[k][side]), ray.rd[k], -ray.ord[k]);
        near = Lanes::max(near, plane(side));
        far = Lanes::min(far, plane(1 - side));
    }
    (near.to_array(), Mask::bits(Lanes::le(near, far)))
}

#[inline(always)]
fn test_block<const ANY: bool>(ray: &Splat, block: &Block, best: &mut Best<f32>) {
    let [x, y, z] = ray.order;
    let own = |p: &[[f32; 8]; 4]| {
        [
            f32x8::new(p[x & 3]),
            f32x8::new(p[y & 3]),
            f32x8::new(p[z & 3]),
        ]
    };
    let p = [own(&block.p[0]), own(&block.p[1]), own(&block.p[2])];
    let (mask, weights) = covers(&ray.own, &p);
    if !mask.any() {
        return;
    }
    let found = hit::<f32x8, ANY>(&ray.own, &p, mask, f32x8::splat(best.t), ray.pad);
    let mut mask = Mask::bits(found.mask);
    if mask == 0 {
        return;
    }
    if ANY {
        best.t = -1.0;
        return;
    }
    let t = found.t.to_array();
    let b = barycentrics(weights).map(|b| b.to_array());
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize & 7;
        mask &= mask - 1;
        record::<ANY>(best, t[lane], block.index(lane), || {
            [b[0][lane], b[1][lane]]
        });
    }
}

#[inline(always)]
fn record<const ANY: bool>(
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
