//! Instances: a tree over the boxes of objects in their places, and a tree of each object's own.
//!
//! What is in its place has been traced before, by kernels that know no instances; here every ray
//! goes on by itself, from instance to instance. At each it is brought into the object's space in
//! `f64`, to where it enters the object's bounds, and rounded there: what it loses is relative to
//! the object, however far away and however small that is. The direction is scaled by a power of
//! two alone, so distances stay those of the ray, and the object's tree is followed as any other
//! (`single.rs`).
//!
//! A hit depends on the ray, the instance and the primitive alone: how much nearer than others it
//! must be is asked with a margin, and only the distance as the caller sees it decides, then the
//! instance, then the primitive. What is in its place comes after all instances.
//!
//! Triangles of instances reach a little over their edges ([`Overlapping`]): what shares an edge in
//! two spaces has no gap there.

use std::cell::RefCell;

use glam::{DAffine3, DVec3};

use super::best::Best;
use super::build::{self, Part};
use super::bvh8::{self, Node8};
use super::eight::{Broadcast, enter};
use super::flatten::Tree;
use super::node::{Bounds, Child, union};
use super::ray::{self, Extent};
use super::records::{Hit, Ray};
use super::single::{self, Cursor, STACK, Stack, Stored, alone};
use super::sphere::LeafSphere;
use super::store::Triangles;
use super::trees::Trees;
use super::triangle::Overlapping;
use super::wide;
use crate::memory::Table;
use crate::scene::{NONE, Scene};
use crate::simd::Vec3 as Lane3;

/// Relative rounding of what a distance goes through between two spaces, with room to spare.
const SLACK: f32 = 1.0 / 2_097_152.0;
/// An object's bounds are grown by so many of its pads: more than what its tree grows boxes by.
const PADS: f32 = 4.0;

/// The tree of an object.
struct ObjectTree {
    wide: Table<Node8>,
    triangles: Triangles,
    spheres: Vec<LeafSphere>,
    extent: Extent,
    /// Where rays can meet something.
    bounds: [DVec3; 2],
}

/// An instance in leaf order.
struct Placed {
    /// Internal space to the object's.
    to_object: DAffine3,
    /// Index of its tree.
    object: u32,
    /// Index into the scene's list.
    instance: u32,
}

/// All instances of a scene.
pub struct Instances {
    objects: Vec<ObjectTree>,
    placed: Vec<Placed>,
    nodes: Table<Node8>,
}

/// What the trees of instances are made of, before the tree over them.
pub struct Objects {
    trees: Vec<ObjectTree>,
    /// Boxes of instances that rays can meet, and those instances.
    boxes: Vec<Bounds>,
    instances: Vec<u32>,
}

/// Sizes for the tracer's statistics.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sizes {
    pub nodes: usize,
    pub blocks: usize,
    pub bytes: usize,
    /// As often as they are seen.
    pub triangles: usize,
    pub spheres: usize,
}

/// A ray in the space of an object.
struct Inside {
    ray: ray::Ray<f32>,
    /// Distances: those of the caller are `(t + shift) * scale`.
    scale: f64,
    shift: f64,
}

impl ObjectTree {
    fn build(scene: &Scene, index: usize, sizes: &mut Sizes) -> Self {
        let object = &scene.instances.objects[index];
        let part = Part {
            scene,
            triangles: object.triangles.clone(),
            spheres: object.spheres.clone(),
            large: false,
            beside: None,
        };
        let (mut tree, wide) = wide::tree_over(&part);
        let triangles = wide.group(&mut tree, |index, vertex| {
            let vertex = scene.triangles[index as usize].v[vertex];
            scene.vertices[vertex as usize].p
        });
        sizes.nodes += wide.nodes.len();
        sizes.blocks += wide.groups;
        sizes.bytes += size_of_val(&wide.nodes[..]) + triangles.bytes();
        sizes.bytes += size_of_val(&tree.spheres[..]);
        let Tree {
            spheres, extent, ..
        } = tree;
        let pad = PADS * extent.pad;
        let corner = |side: usize, pad: f32| {
            DVec3::from(extent.bounds.map(|b| f64::from(b[side]) + f64::from(pad)))
        };
        let bounds = if triangles.len() + spheres.len() > 0 {
            [corner(0, -pad), corner(1, pad)]
        } else {
            [DVec3::INFINITY, DVec3::NEG_INFINITY]
        };
        Self {
            wide: Table::new(wide.nodes),
            triangles,
            spheres,
            extent,
            bounds,
        }
    }

    fn is_empty(&self) -> bool {
        self.bounds[0].x > self.bounds[1].x
    }

    fn trees(&self) -> Trees<'_> {
        Trees {
            nodes: &[],
            wide: self.wide.entries(),
            triangles: self.triangles.view(),
            spheres: &self.spheres,
            large: &[],
            in_turns: false,
        }
    }
}

impl Objects {
    /// None in most scenes.
    pub fn build(scene: &Scene, sizes: &mut Sizes) -> Option<Self> {
        if scene.instances.is_empty() {
            return None;
        }
        let count = scene.instances.objects.len();
        let trees: Vec<_> = (0..count)
            .map(|index| ObjectTree::build(scene, index, sizes))
            .collect();
        let count = scene.instances.placed.len();
        let (mut boxes, mut instances) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (i, instance) in scene.instances.placed.iter().enumerate() {
            let tree = &trees[instance.object as usize];
            if tree.is_empty() {
                continue;
            }
            let outwards = |b: [DVec3; 2]| [b[0].as_vec3(), b[1].as_vec3()];
            let [low, high] = instance.around(outwards(tree.bounds));
            let bounds: Bounds =
                std::array::from_fn(|k| [(low[k] as f32).next_down(), (high[k] as f32).next_up()]);
            if bounds.iter().flatten().all(|x| x.is_finite()) {
                boxes.push(bounds);
                instances.push(i as u32);
                sizes.triangles += tree.triangles.len();
                sizes.spheres += tree.spheres.len();
            }
        }
        Some(Self {
            trees,
            boxes,
            instances,
        })
    }

    /// The box around all instances.
    pub fn bounds(&self) -> Option<Bounds> {
        self.boxes.iter().copied().reduce(union)
    }

    /// The tree over them; `extent` is that of the whole scene.
    pub fn assemble(self, scene: &Scene, extent: &Extent, sizes: &mut Sizes) -> Instances {
        let mut tree = build::over_boxes(scene, &self.boxes, extent);
        let mut wide = bvh8::collapse(&tree, 1);
        if wide.depth > single::MAX_DEPTH {
            tree = build::halves_of_boxes(scene, &self.boxes, extent);
            wide = bvh8::collapse(&tree, 1);
        }
        drop(self.boxes);
        let place = |&position: &u32| {
            let instance = self.instances[position as usize];
            let of = &scene.instances.placed[instance as usize];
            Placed {
                to_object: of.to_world.inverse(),
                object: of.object,
                instance,
            }
        };
        let placed: Vec<Placed> = tree.triangles.iter().map(place).collect();
        sizes.nodes += wide.nodes.len();
        sizes.bytes += size_of_val(&wide.nodes[..]) + size_of_val(&placed[..]);
        Instances {
            objects: self.trees,
            placed,
            nodes: Table::new(wide.nodes),
        }
    }
}

/// What a ray has found as its caller sees it, and what bounds the search for more.
struct Search<'a> {
    /// In the scene's canonical form.
    ray: &'a ray::Ray<f32>,
    /// The caller's end.
    t_max: f32,
    hit: &'a mut Hit,
    /// No hit further than this is better, in the canonical form.
    limit: f32,
}

impl Search<'_> {
    /// The distance of the canonical form beyond which hits are further than the best.
    fn bound(&mut self) {
        if self.hit.is_none() {
            return;
        }
        let t = self.hit.t / self.ray.t_scale;
        let margin = t.abs().max(self.ray.t_shift) * SLACK;
        self.limit = self.limit.min(t - self.ray.t_shift + margin);
    }

    fn record(&mut self, t: f32, instance: u32, found: &Best<f32>) {
        let end = f32::from_bits(self.t_max.to_bits() - 1);
        let t = self.ray.external_t(t).min(end);
        let best = &mut *self.hit;
        let is_better = best.is_none() || (t, instance) < (best.t, best.instance);
        if is_better && t > 0.0 {
            *best = Hit {
                t,
                b: [found.b1, found.b2],
                primitive: found.prim,
                instance,
                ..Hit::default()
            };
            self.bound();
        }
    }
}

impl Placed {
    /// The ray in the object's space, up to `t_max`, unless it passes by the object.
    #[inline(always)]
    fn enter(&self, ray: &ray::Ray<f32>, t_max: f32, object: &ObjectTree) -> Option<Inside> {
        let wide = |v: Lane3<f32>| DVec3::new(v.x.into(), v.y.into(), v.z.into());
        let o = self.to_object.transform_point3(wide(ray.o));
        let d = self.to_object.transform_vector3(wide(ray.d));
        let largest = d.abs().max_element();
        if !(largest >= f64::MIN_POSITIVE && largest.is_finite()) {
            return None;
        }
        // A power of two, so that the largest component is in [1, 2).
        let scale = f64::from_bits((2046 << 52) - (largest.to_bits() & 0x7ff0_0000_0000_0000));
        let d = d * scale;
        let mut near = 0f64;
        let mut far = f64::from(t_max) / scale;
        for k in 0..3 {
            let along = if d[k].abs() < 1e-30 {
                1e-30f64.copysign(d[k])
            } else {
                d[k]
            };
            let inverse = along.recip();
            let t0 = (object.bounds[0][k] - o[k]) * inverse;
            let t1 = (object.bounds[1][k] - o[k]) * inverse;
            near = near.max(t0.min(t1));
            far = far.min(t0.max(t1));
        }
        if near > far {
            return None;
        }
        let radius = f64::from(object.extent.radius);
        let mut shift = 0.0;
        if o.abs().max_element() > 2.0 * radius {
            shift = (near - 0.5 * radius).max(0.0);
        }
        let narrow = |v: DVec3| Lane3::splat(v.as_vec3().to_array());
        let t_max = (f64::from(t_max) / scale - shift) as f32;
        let ray = ray::Ray::new(
            narrow(o + d * shift),
            narrow(d),
            t_max,
            true,
            &object.extent,
        );
        Some(Inside { ray, scale, shift })
    }
}

impl Inside {
    /// A distance of the object's ray as one of the scene's.
    fn outside(&self, t: f32) -> f32 {
        ((f64::from(self.ray.external_t(t)) + self.shift) * self.scale) as f32
    }

    /// Where to look for hits no further than `limit`.
    fn start(&self, limit: f32) -> Best<f32> {
        let mut best = Best::<f32>::new(&self.ray);
        if self.ray.t_shift == 0.0 {
            let limit = f64::from(limit) / self.scale * (1.0 + f64::from(SLACK)) - self.shift;
            let limit = (limit / f64::from(self.ray.t_scale)) as f32;
            best.t = best.t.min(limit.next_up());
        }
        best
    }
}

thread_local! {
    /// For the tree of instances, and for those of objects.
    static STACKS: RefCell<[Stack; 2]> = const { RefCell::new([[0; STACK]; 2]) };
}

impl Instances {
    /// Rays of `list` that meet an instance before what they have hit so far.
    #[inline(never)]
    pub fn closest<const VAST: bool>(
        &self,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
        extent: &Extent,
    ) {
        STACKS.with_borrow_mut(|[stack, inner]| {
            for &i in list {
                let ray = ray::Ray::<f32>::load(rays, &[i], extent);
                let mut search = Search {
                    ray: &ray,
                    t_max: rays[i as usize].t_max,
                    hit: &mut hits[i as usize],
                    limit: ray.t_max,
                };
                search.bound();
                self.visit::<VAST, false>(&ray, stack, &mut search, |placed, search| {
                    let object = &self.objects[placed.object as usize];
                    let Some(inside) = placed.enter(&ray, ray.t_max, object) else {
                        return false;
                    };
                    let start = inside.start(search.limit);
                    let best =
                        alone::<Overlapping, false>(&object.trees(), &inside.ray, start, inner);
                    if best.prim != NONE {
                        search.record(inside.outside(best.t), placed.instance, &best);
                    }
                    false
                });
            }
        });
    }

    /// Rays of `list` that are not blocked yet and meet an instance.
    #[inline(never)]
    pub fn occluded<const VAST: bool>(
        &self,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
        extent: &Extent,
    ) {
        STACKS.with_borrow_mut(|[stack, inner]| {
            for &i in list {
                if blocked[i as usize] != 0 {
                    continue;
                }
                let ray = ray::Ray::<f32>::load(rays, &[i], extent);
                let mut search = Search {
                    ray: &ray,
                    t_max: rays[i as usize].t_max,
                    hit: &mut Hit::default(),
                    limit: ray.t_max,
                };
                let found = self.visit::<VAST, true>(&ray, stack, &mut search, |placed, _| {
                    let object = &self.objects[placed.object as usize];
                    let Some(inside) = placed.enter(&ray, ray.t_max, object) else {
                        return false;
                    };
                    let start = Best::<f32>::new(&inside.ray);
                    if start.t < 0.0 {
                        return false;
                    }
                    alone::<Overlapping, true>(&object.trees(), &inside.ray, start, inner).t < 0.0
                });
                blocked[i as usize] = u32::from(found);
            }
        });
    }

    /// [`Self::closest`] of one ray, by all instances in the order of the scene's list or the other
    /// way round, without bounds.
    #[cfg(test)]
    pub fn closest_of_all(&self, record: &Ray, hit: &mut Hit, extent: &Extent, back: bool) {
        let ray = ray::Ray::<f32>::load(std::slice::from_ref(record), &[0], extent);
        let mut all: Vec<&Placed> = self.placed.iter().collect();
        all.sort_by_key(|placed| placed.instance);
        if back {
            all.reverse();
        }
        let mut stack = [0; STACK];
        for placed in all.into_iter().filter(|_| ray.live()) {
            let object = &self.objects[placed.object as usize];
            if let Some(inside) = placed.enter(&ray, ray.t_max, object) {
                let start = inside.start(ray.t_max);
                let found =
                    alone::<Overlapping, false>(&object.trees(), &inside.ray, start, &mut stack);
                if found.prim != NONE {
                    let mut search = Search {
                        ray: &ray,
                        t_max: record.t_max,
                        hit,
                        limit: ray.t_max,
                    };
                    search.record(inside.outside(found.t), placed.instance, &found);
                }
            }
        }
    }

    /// Calls `each` with the instances whose boxes a ray meets no further than the search's limit,
    /// until it says that this is enough; then true.
    #[inline(always)]
    fn visit<const VAST: bool, const ANY: bool>(
        &self,
        ray: &ray::Ray<f32>,
        stack: &mut Stack,
        search: &mut Search,
        mut each: impl FnMut(&Placed, &mut Search) -> bool,
    ) -> bool {
        if !ray.live() {
            return false;
        }
        let wide: Broadcast = Stored::new(ray).splat::<VAST>(0);
        let nodes = self.nodes.entries();
        let mut cursor = Cursor {
            current: Child::inner(0),
            top: 0,
            best: Best::NOTHING,
        };
        loop {
            if !cursor.current.is_leaf() {
                let node = &nodes[cursor.current.index()];
                let (near, meets) = enter::<VAST>(&wide, node, search.limit);
                if meets != 0 {
                    if ANY {
                        cursor.enter_any(node, meets, stack);
                    } else {
                        cursor.enter_nearest(node, near, meets, stack);
                    }
                    continue;
                }
            } else {
                for placed in &self.placed[cursor.current.range()] {
                    if each(placed, search) {
                        return true;
                    }
                }
            }
            loop {
                if cursor.top == 0 {
                    return false;
                }
                cursor.top -= 1;
                let entry = stack[cursor.top & (STACK - 1)];
                if ANY || f32::from_bits((entry >> 32) as u32) <= search.limit {
                    cursor.current = Child(entry as u32);
                    break;
                }
            }
        }
    }
}
