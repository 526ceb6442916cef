//! One ray at a time down the wide tree: eight boxes or eight triangles per step. For rays that
//! have nothing in common.

use super::best::Best;
use super::bvh8::Node8;
use super::eight::{Broadcast, enter, record, test_group};
use super::node::Child;
use super::ray::{PAD, Ray, Sheared};
use super::trees::Trees;
use super::triangle::TriangleTest;
use crate::simd::prefetch::prefetch;
use crate::simd::{Lanes, Mask, f32x8};

/// Entries of the stack; a power of two, so that it needs no bounds checks. A node leaves at most
/// seven behind.
pub(super) const STACK: usize = 256;
/// Deepest wide tree that can be traversed, in levels of nodes.
pub const MAX_DEPTH: usize = STACK / 7;

/// Children to be visited: bits of the distance at which the ray enters, then the child. Distances
/// are not negative, so entries order as integers.
pub(super) type Stack = [u64; STACK];

/// Room for the rays of one packet on their way.
pub struct Walks([Walk; 8]);

impl Walks {
    pub fn new() -> Self {
        Self([const { Walk::new() }; 8])
    }
}

/// A ray on its way.
struct Walk {
    cursor: Cursor,
    ray: Broadcast,
    stack: Stack,
}

/// Where a ray is, and what it has found. Apart from the rest so that it stays in registers.
#[derive(Clone, Copy)]
pub(super) struct Cursor {
    pub current: Child,
    pub top: usize,
    pub best: Best<f32>,
}

/// A packet in memory, `[field][lane]`, from where a lane is loaded into all lanes by one
/// instruction.
pub struct Stored {
    o: [[f32; 8]; 3],
    d: [[f32; 8]; 3],
    rd: [[f32; 8]; 3],
    ord: [[f32; 8]; 3],
    shear: [[f32; 8]; 2],
    swap_x: u32,
    swap_y: u32,
    pad: f32,
}

impl Stored {
    #[inline(always)]
    pub fn new<L: Lanes>(ray: &Ray<L>) -> Self {
        let one = |x: L| {
            let mut lanes = [0.0; 8];
            x.store(&mut lanes);
            lanes
        };
        let all = |v: [L; 3]| [one(v[0]), one(v[1]), one(v[2])];
        Self {
            o: all([ray.o.x, ray.o.y, ray.o.z]),
            d: all([ray.d.x, ray.d.y, ray.d.z]),
            rd: all(ray.rd),
            ord: all(ray.ord),
            shear: [one(ray.own.shear[0]), one(ray.own.shear[1])],
            swap_x: ray.swap_x.bits(),
            swap_y: ray.swap_y.bits(),
            pad: ray.pad.lane(0),
        }
    }

    #[inline(always)]
    pub(super) fn splat<const VAST: bool>(&self, lane: usize) -> Broadcast {
        let lane = lane & 7;
        let order = match (self.swap_x >> lane & 1, self.swap_y >> lane & 1) {
            (1, _) => [2, 1, 0],
            (_, 1) => [0, 2, 1],
            _ => [0, 1, 2],
        };
        let one = |x: &[f32; 8]| f32x8::splat(x[lane]);
        let all = |v: &[[f32; 8]; 3]| [one(&v[0]), one(&v[1]), one(&v[2])];
        let own = |v: &[[f32; 8]; 3]| [one(&v[order[0]]), one(&v[order[1]]), one(&v[order[2]])];
        let origin = || {
            let [x, y, z] = all(&self.o).map(Lanes::abs);
            Lanes::max(Lanes::max(x, y), z) * f32x8::splat(PAD)
        };
        Broadcast {
            rd: all(&self.rd),
            ord: all(&self.ord),
            own: Sheared {
                o: own(&self.o),
                d: own(&self.d),
                rd: own(&self.rd),
                ord: own(&self.ord),
                shear: [one(&self.shear[0]), one(&self.shear[1])],
            },
            pad: if VAST {
                origin()
            } else {
                f32x8::splat(self.pad)
            },
            negative: [
                usize::from(self.rd[0][lane] < 0.0),
                usize::from(self.rd[1][lane] < 0.0),
                usize::from(self.rd[2][lane] < 0.0),
            ],
            order,
        }
    }
}

/// Follows the rays of a packet, each on its own; `best` may hold hits found before. With `ANY`,
/// lanes that hit something end with a negative `best.t`; triangles are tested by `T`.
///
/// With `INTERLEAVE` the rays take turns, one step each, so that the memory accesses of one overlap
/// with the work of the others: for trees that do not fit the caches.
#[inline(always)]
pub fn traverse<
    L: Lanes,
    T: TriangleTest,
    const ANY: bool,
    const VAST: bool,
    const INTERLEAVE: bool,
>(
    trees: &Trees,
    rays: &Ray<L>,
    best: &mut Best<L>,
    walks: &mut Walks,
) {
    let stored = Stored::new(rays);
    let live = best.t.ge(L::zero()).bits();
    follow::<L, T, ANY, VAST, INTERLEAVE>(trees, rays, &stored, live, Child::inner(0), best, walks);
}

/// Follows the rays of the lanes in `live` through the wide tree below `start`.
#[inline(always)]
fn follow<L: Lanes, T: TriangleTest, const ANY: bool, const VAST: bool, const INTERLEAVE: bool>(
    trees: &Trees,
    rays: &Ray<L>,
    stored: &Stored,
    live: u32,
    start: Child,
    best: &mut Best<L>,
    Walks(walks): &mut Walks,
) {
    let mut found = Found::new(best);
    let begin = |lane: usize, found: &Found| Cursor {
        current: start,
        top: 0,
        best: found.lane(lane),
    };
    if INTERLEAVE {
        for lane in bits(live) {
            walks[lane].cursor = begin(lane, &found);
            walks[lane].ray = stored.splat::<VAST>(lane);
        }
        let mut going = live;
        while going != 0 {
            for lane in bits(going) {
                let Walk { cursor, ray, stack } = &mut walks[lane];
                if cursor.step::<L, T, ANY, VAST>(trees, ray, stack, (rays, lane)) {
                    cursor.prefetch(trees);
                } else {
                    going &= !(1 << lane);
                    found.set(lane, &cursor.best);
                }
            }
        }
    } else {
        let stack = &mut walks[0].stack;
        for lane in bits(live) {
            let ray = stored.splat::<VAST>(lane);
            let mut cursor = begin(lane, &found);
            while cursor.step::<L, T, ANY, VAST>(trees, &ray, stack, (rays, lane)) {}
            found.set(lane, &cursor.best);
        }
    }
    *best = found.all();
}

/// [`follow`] for a packet that has come apart below a node. Not inlined, so that packets keep
/// their registers.
#[inline(never)]
pub fn leave<
    L: Lanes,
    T: TriangleTest,
    const ANY: bool,
    const VAST: bool,
    const INTERLEAVE: bool,
>(
    trees: &Trees,
    rays: &Ray<L>,
    stored: &Stored,
    live: u32,
    start: Child,
    mut best: Best<L>,
    walks: &mut Walks,
) -> Best<L> {
    follow::<L, T, ANY, VAST, INTERLEAVE>(trees, rays, stored, live, start, &mut best, walks);
    best
}

/// Follows one ray; `best` may hold what hits must not be beyond. As [`traverse`], to the bit.
#[inline(always)]
pub(super) fn alone<T: TriangleTest, const ANY: bool>(
    trees: &Trees,
    ray: &Ray<f32>,
    best: Best<f32>,
    stack: &mut Stack,
) -> Best<f32> {
    let wide = Stored::new(ray).splat::<false>(0);
    let mut cursor = Cursor {
        current: Child::inner(0),
        top: 0,
        best,
    };
    while cursor.step::<f32, T, ANY, false>(trees, &wide, stack, (ray, 0)) {}
    cursor.best
}

/// The best hits of a packet in memory, lane by lane.
struct Found {
    t: [f32; 8],
    b1: [f32; 8],
    b2: [f32; 8],
    prim: [f32; 8],
}

impl Found {
    #[inline(always)]
    fn new<L: Lanes>(best: &Best<L>) -> Self {
        let one = |x: L| {
            let mut lanes = [0.0; 8];
            x.store(&mut lanes);
            lanes
        };
        Self {
            t: one(best.t),
            b1: one(best.b1),
            b2: one(best.b2),
            prim: one(L::from_bits(best.prim)),
        }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Best<f32> {
        Best {
            t: self.t[lane],
            b1: self.b1[lane],
            b2: self.b2[lane],
            prim: self.prim[lane].to_bits(),
        }
    }
    #[inline(always)]
    fn set(&mut self, lane: usize, best: &Best<f32>) {
        self.t[lane] = best.t;
        self.b1[lane] = best.b1;
        self.b2[lane] = best.b2;
        self.prim[lane] = f32::from_bits(best.prim);
    }
    #[inline(always)]
    fn all<L: Lanes>(&self) -> Best<L> {
        Best {
            t: L::load(&self.t),
            b1: L::load(&self.b1),
            b2: L::load(&self.b2),
            prim: L::load(&self.prim).to_bits(),
        }
    }
}

/// The set bits of a mask of eight lanes.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize & 7;
        (mask != 0).then(|| {
            mask &= mask - 1;
            lane
        })
    })
}

impl Walk {
    const fn new() -> Self {
        const ZERO: [f32x8; 3] = [f32x8::ZERO; 3];
        Self {
            cursor: Cursor {
                current: Child::EMPTY,
                top: 0,
                best: Best::NOTHING,
            },
            ray: Broadcast {
                rd: ZERO,
                ord: ZERO,
                own: Sheared {
                    o: ZERO,
                    d: ZERO,
                    rd: ZERO,
                    ord: ZERO,
                    shear: [f32x8::ZERO; 2],
                },
                pad: f32x8::ZERO,
                negative: [0; 3],
                order: [0; 3],
            },
            stack: [0; STACK],
        }
    }
}

impl Cursor {
    /// Prefetches what the next step will read.
    #[inline(always)]
    fn prefetch(&self, trees: &Trees) {
        if !self.current.is_leaf() {
            prefetch::<256, _>(trees.wide, self.current.index());
        } else if !self.current.is_sphere_leaf() {
            trees.triangles.prefetch(self.current.range().start);
        }
    }

    /// Visits one node or leaf; false if that was the last.
    #[inline(always)]
    fn step<L: Lanes, T: TriangleTest, const ANY: bool, const VAST: bool>(
        &mut self,
        trees: &Trees,
        ray: &Broadcast,
        stack: &mut Stack,
        (rays, lane): (&Ray<L>, usize),
    ) -> bool {
        if !self.current.is_leaf() {
            let node: &Node8 = &trees.wide[self.current.index()];
            let (near, meets) = enter::<VAST>(ray, node, self.best.t);
            if meets != 0 {
                if ANY {
                    self.enter_any(node, meets, stack);
                } else {
                    self.enter_nearest(node, near, meets, stack);
                }
                return true;
            }
        } else if self.current.is_sphere_leaf() {
            let ray = rays.lane(lane);
            for sphere in &trees.spheres[self.current.range()] {
                if VAST && let Some(large) = sphere.as_large() {
                    let large = &trees.large[large];
                    let (found, [b1, b2]) = large.hit::<f32, ANY>(&ray, self.best.t);
                    if found.mask {
                        let prim = large.primitive();
                        record::<ANY>(&mut self.best, found.t, prim, || [b1, b2]);
                    }
                    continue;
                }
                let found = sphere.hit::<f32, ANY, VAST>(&ray, self.best.t);
                if found.mask {
                    record::<ANY>(&mut self.best, found.t, sphere.index(), || [0.0; 2]);
                }
            }
        } else {
            test_group::<T, ANY, VAST>(trees, ray, self.current.range(), &mut self.best);
        }
        if ANY && self.best.t < 0.0 {
            return false;
        }
        while self.top > 0 {
            self.top -= 1;
            let entry = stack[self.top & (STACK - 1)];
            if ANY || f32::from_bits((entry >> 32) as u32) <= self.best.t {
                self.current = Child(entry as u32);
                return true;
            }
        }
        false
    }

    /// Enters the nearest child; the others wait, farthest first. Mostly there are one or two.
    #[inline(always)]
    pub(super) fn enter_nearest(
        &mut self,
        node: &Node8,
        near: f32x8,
        mut meets: u32,
        stack: &mut Stack,
    ) {
        let slot = meets.trailing_zeros() as usize & 7;
        meets &= meets - 1;
        if meets == 0 {
            self.current = node.child[slot];
            return;
        }
        let near = near.to_array();
        let entry =
            |slot: usize| (near[slot & 7].to_bits() as u64) << 32 | node.child[slot & 7].0 as u64;
        let mut nearest = entry(slot);
        let next = entry(meets.trailing_zeros() as usize);
        meets &= meets - 1;
        let bottom = self.top;
        stack[bottom & (STACK - 1)] = nearest.max(next);
        self.top += 1;
        nearest = nearest.min(next);
        while meets != 0 {
            let next = entry(meets.trailing_zeros() as usize);
            meets &= meets - 1;
            let farther = nearest.max(next);
            nearest = nearest.min(next);
            let mut at = self.top;
            while at > bottom && stack[(at - 1) & (STACK - 1)] < farther {
                stack[at & (STACK - 1)] = stack[(at - 1) & (STACK - 1)];
                at -= 1;
            }
            stack[at & (STACK - 1)] = farther;
            self.top += 1;
        }
        self.current = Child(nearest as u32);
    }

    /// Enters the first child, which is the largest; the others wait in their order. What is
    /// nearest does not matter.
    #[inline(always)]
    pub(super) fn enter_any(&mut self, node: &Node8, mut meets: u32, stack: &mut Stack) {
        loop {
            let slot = meets.ilog2() as usize & 7;
            let child = node.child[slot];
            meets ^= 1 << slot;
            if meets == 0 {
                self.current = child;
                return;
            }
            stack[self.top & (STACK - 1)] = child.0 as u64;
            self.top += 1;
        }
    }
}
