//! Closest hits and visibility: a flat bounding volume hierarchy and the ways to follow rays
//! through it.
//!
//! 1. [`Tracer::build`] lets obvhs build a binary tree and copies it into nodes of one cache line;
//!    a wide tree, with up to eight children per node, is made of its nodes. Both share one store
//!    of triangles (`store.rs`).
//! 2. `N` rays go down the binary tree together as a packet; at one lane the same code is a plain
//!    single-ray traversal.
//! 3. Rays that have nothing in common go down the wide tree one by one, eight boxes or eight
//!    triangles at a time; in large scenes eight such rays take turns. A packet that comes apart on
//!    its way changes over to this.
//! 4. A hit depends on the ray and the primitive alone (see `triangle.rs`) and the best is the
//!    smallest (t, index), so every width, packet and order of traversal gives the same bits.
//! 5. Surfaces that are thousands of times larger than others are tested in `f64` (`large.rs`), and
//!    boxes are then grown by what is near them instead of the size of the scene; scenes without
//!    such surfaces have none of it in their loops.
//! 6. Where many primitives lie in one place, equal ones are left out and the tree is made from the
//!    top down (`crowd.rs`, `split.rs`).
//! 7. What the scene keeps once and shows in several places is traced after all else
//!    (`instances.rs`): scenes without such objects never come there.
//! 8. No kernel knows materials: only `build.rs` looks at them, to leave out interfaces, which rays
//!    pass, unless media change there. [`offset`] moves origins off surfaces by what the tests'
//!    error bounds ask for.

mod best;
mod build;
mod bvh8;
mod crowd;
mod eight;
mod flatten;
mod instances;
mod large;
mod node;
pub mod offset;
mod packet;
mod ray;
mod records;
mod single;
mod sphere;
mod split;
mod store;
#[cfg(test)]
mod tests;
mod trees;
mod triangle;
mod wide;

use std::cell::RefCell;
use std::time::{Duration, Instant};

use crate::scene::Scene;
use crate::simd::Lanes;

use self::best::Best;
use self::build::Part;
use self::bvh8::{Bvh8, Node8};
use self::flatten::Tree;
use self::instances::{Instances, Objects, Sizes};
use self::large::LargeSurface;
use self::node::Node;
use self::ray::Extent;
pub use self::ray::Sheared;
pub use self::records::{Hit, HitLanes, Ray, RayLanes};
use self::sphere::LeafSphere;
use self::store::Triangles;
use self::trees::Trees;
pub use self::triangle::{Hit as TriangleHit, TriangleTest, Watertight};
use crate::memory::Table;

/// What the size of the trees says about the best traversal. Thresholds are from `benches/rays`, on
/// a machine with 1 MiB of second and 32 MiB of third level cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Size {
    /// Rays meet most of the few nodes whatever they do: packets always.
    Tiny,
    /// Most of the tree is in the second level cache: packets where rays are near each other, else
    /// single rays one by one.
    Small,
    /// Single rays wait for memory, so they are interleaved; packets only where rays stay together.
    Large,
}

impl Size {
    fn of(wide: &Bvh8, triangles: &Triangles) -> Self {
        match size_of_val(&wide.nodes[..]) + triangles.bytes() {
            0..0x4000 => Size::Tiny,
            0x4000..0x40_0000 => Size::Small,
            _ => Size::Large,
        }
    }
}

/// How a packet is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// Together until no more than so many rays meet a subtree.
    Together(u32),
    Apart,
}

/// With so few rays left, a packet that will not stay together is better off apart.
const FEW: u32 = 4;

/// All primitives of a scene that rays can meet, sorted for tracing. It owns its copies.
pub struct Tracer {
    nodes: Table<Node>,
    wide: Table<Node8>,
    triangles: Triangles,
    spheres: Vec<LeafSphere>,
    large: Vec<LargeSurface>,
    instances: Option<Instances>,
    extent: Extent,
    size: Size,
    stats: Stats,
}

/// What the caller knows of rays that are neighbours in a list. It changes the speed, never a
/// result; with one lane, nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// They go the same way from the same place, and stay together: always traced as packets.
    Coherent,
    /// They have nothing in common, as diffuse bounces: always traced one by one.
    Incoherent,
    /// The tracer decides, packet by packet, and by the size of the scene. The best choice unless
    /// measured otherwise.
    Unknown,
}

/// What a build made and took.
#[derive(Clone, Copy, Debug)]
pub struct Stats {
    /// Wall clock.
    pub build_time: Duration,
    /// Inner nodes of the binary tree.
    pub nodes: usize,
    /// Inner nodes of the wide tree.
    pub nodes8: usize,
    /// Groups of up to eight triangles, the leaves of the wide tree.
    pub blocks8: usize,
    /// Triangles that rays can meet, but for large ones; each as often as it has instances.
    pub triangles: usize,
    /// Spheres that rays can meet, likewise, and large surfaces of either kind.
    pub spheres: usize,
    /// Levels of the binary tree, leaves included.
    pub depth: usize,
    /// Memory of nodes and primitives.
    pub bytes: usize,
}

impl Tracer {
    /// Primitives of interface materials where no media change, and those that are not finite or
    /// have no area, are left out.
    ///
    /// # Panics
    /// With more than 2^26 triangles or spheres.
    pub fn build(scene: &Scene) -> Tracer {
        let start = Instant::now();
        let limit = node::Child::MAX_PRIMITIVES;
        assert!(
            scene.triangles.len().max(scene.spheres.len()) <= limit
                && scene.instances.placed.len() <= limit,
            "a scene can have at most {limit} triangles, and as many spheres and instances"
        );
        let mut sizes = Sizes::default();
        let objects = Objects::build(scene, &mut sizes);
        let beside = objects.as_ref().and_then(Objects::bounds);
        let (tree, wide) = wide::tree_over(&Part::own(scene, beside));
        let extent = tree.extent;
        let mut tracer = Self::assemble(scene, tree, wide, start);
        if let Some(objects) = objects {
            tracer.instances = Some(objects.assemble(scene, &extent, &mut sizes));
            let stats = &mut tracer.stats;
            stats.nodes8 += sizes.nodes;
            stats.blocks8 += sizes.blocks;
            stats.triangles += sizes.triangles;
            stats.spheres += sizes.spheres;
            stats.bytes += sizes.bytes;
            stats.build_time = start.elapsed();
        }
        tracer
    }

    fn assemble(scene: &Scene, mut tree: Tree, wide: Bvh8, start: Instant) -> Tracer {
        let triangles = wide.group(&mut tree, |index, vertex| {
            let vertex = scene.triangles[index as usize].v[vertex];
            scene.vertices[vertex as usize].p
        });
        let stats = Stats {
            nodes: tree.nodes.len(),
            nodes8: wide.nodes.len(),
            blocks8: wide.groups,
            triangles: triangles.len(),
            spheres: tree.spheres.len(),
            depth: tree.depth,
            bytes: size_of_val(&tree.nodes[..])
                + size_of_val(&tree.spheres[..])
                + size_of_val(&tree.large[..])
                + size_of_val(&wide.nodes[..])
                + triangles.bytes(),
            build_time: start.elapsed(),
        };
        Tracer {
            nodes: Table::new(tree.nodes),
            size: Size::of(&wide, &triangles),
            wide: Table::new(wide.nodes),
            triangles,
            spheres: tree.spheres,
            large: tree.large,
            instances: None,
            extent: tree.extent,
            stats,
        }
    }

    /// What the build of this tracer made and took.
    pub fn stats(&self) -> Stats {
        self.stats
    }

    /// The closest hit of each ray `i` in `list` goes to `hits[i]`.
    ///
    /// Each `L::N` consecutive entries of `list` make a packet: neighbours in the list should be
    /// neighbours in space. A ray that is not finite, or has no direction, or a `t_max` not
    /// above 0, hits nothing.
    pub fn closest<L: Lanes>(&self, rays: &[Ray], list: &[u32], hits: &mut [Hit]) {
        self.closest_with::<L>(Coherence::Unknown, rays, list, hits);
    }

    /// [`Tracer::closest`] for rays of known coherence.
    pub fn closest_with<L: Lanes>(
        &self,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
    ) {
        self.closest_by::<L, Watertight>(coherence, rays, list, hits);
    }

    /// [`Tracer::closest_with`] by another test of triangles, but for those of instances.
    pub fn closest_by<L: Lanes, T: TriangleTest>(
        &self,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
    ) {
        let store = |packet: &[u32], ray: &ray::Ray<L>, best: &Best<L>| {
            best.store(ray, rays, packet, hits);
        };
        if self.extent.vast {
            self.trace::<L, T, false, true>(coherence, rays, list, store);
        } else {
            self.trace::<L, T, false, false>(coherence, rays, list, store);
        }
        match &self.instances {
            None => {}
            Some(instances) if self.extent.vast => {
                instances.closest::<true>(rays, list, hits, &self.extent);
            }
            Some(instances) => instances.closest::<false>(rays, list, hits, &self.extent),
        }
    }

    /// Whether anything lies strictly between `origin` and `origin + t_max * direction`, both ends
    /// excluded by their rounding error: `blocked[i]` becomes 1 or 0 for each ray `i` in
    /// `list`. Rays are as for [`Tracer::closest`].
    pub fn occluded<L: Lanes>(&self, rays: &[Ray], list: &[u32], blocked: &mut [u32]) {
        self.occluded_with::<L>(Coherence::Unknown, rays, list, blocked);
    }

    /// [`Tracer::occluded`] for rays of known coherence.
    pub fn occluded_with<L: Lanes>(
        &self,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
    ) {
        self.occluded_by::<L, Watertight>(coherence, rays, list, blocked);
    }

    /// [`Tracer::occluded_with`] by another test of triangles, but for those of instances.
    pub fn occluded_by<L: Lanes, T: TriangleTest>(
        &self,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
    ) {
        let store = |packet: &[u32], ray: &ray::Ray<L>, best: &Best<L>| {
            let hit = best.blocked(ray);
            for (lane, &i) in packet.iter().enumerate() {
                blocked[i as usize] = hit >> lane & 1;
            }
        };
        if self.extent.vast {
            self.trace::<L, T, true, true>(coherence, rays, list, store);
        } else {
            self.trace::<L, T, true, false>(coherence, rays, list, store);
        }
        match &self.instances {
            None => {}
            Some(instances) if self.extent.vast => {
                instances.occluded::<true>(rays, list, blocked, &self.extent);
            }
            Some(instances) => instances.occluded::<false>(rays, list, blocked, &self.extent),
        }
    }

    #[inline(always)]
    fn trace<L: Lanes, T: TriangleTest, const ANY: bool, const VAST: bool>(
        &self,
        coherence: Coherence,
        rays: &[Ray],
        list: &[u32],
        mut store: impl FnMut(&[u32], &ray::Ray<L>, &Best<L>),
    ) {
        let trees = self.trees();
        let mut packets = packet::Stack::<L>::new();
        WALKS.with_borrow_mut(|walks| {
            for packet in list.chunks(L::N) {
                let ray = ray::Ray::<L>::load(rays, packet, &self.extent);
                let mut best = Best::new(&ray);
                match self.way(coherence, &ray) {
                    Way::Together(few) => packet::traverse::<L, T, ANY, VAST>(
                        &trees,
                        &ray,
                        &mut best,
                        &mut packets,
                        walks,
                        few,
                    ),
                    Way::Apart if trees.in_turns => {
                        single::traverse::<L, T, ANY, VAST, true>(&trees, &ray, &mut best, walks)
                    }
                    Way::Apart => {
                        single::traverse::<L, T, ANY, VAST, false>(&trees, &ray, &mut best, walks)
                    }
                }
                store(packet, &ray, &best);
            }
        });
    }

    fn trees(&self) -> Trees<'_> {
        Trees {
            nodes: self.nodes.entries(),
            wide: self.wide.entries(),
            triangles: self.triangles.view(),
            spheres: &self.spheres,
            large: &self.large,
            in_turns: self.size == Size::Large,
        }
    }

    #[inline(always)]
    fn way<L: Lanes>(&self, coherence: Coherence, ray: &ray::Ray<L>) -> Way {
        if L::N == 1 {
            return Way::Together(0);
        }
        match coherence {
            Coherence::Coherent => Way::Together(0),
            Coherence::Incoherent => Way::Apart,
            Coherence::Unknown if self.size == Size::Tiny => Way::Together(0),
            Coherence::Unknown if !ray.is_near(&self.extent) => Way::Apart,
            Coherence::Unknown if ray.is_narrow() => Way::Together(0),
            Coherence::Unknown if self.size == Size::Small => Way::Together(FEW),
            Coherence::Unknown => Way::Apart,
        }
    }
}

thread_local! {
    /// Eight stacks are too large to be made for every call.
    static WALKS: RefCell<single::Walks> = RefCell::new(single::Walks::new());
}
