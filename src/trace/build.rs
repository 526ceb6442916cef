//! From scene to tree: obvhs clusters the boxes (PLOC, Meister and Bittner 2017, then reinsertion,
//! 2018), and its tree is flattened into nodes that hold the boxes of both children. `split.rs`
//! makes trees that clustering takes too long for.

use std::ops::Range;
use std::time::Duration;

use bytemuck::{Pod, Zeroable};
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::crowd;
use super::flatten::{Flattening, LEAF_SIZE, Pending, Primitive, Tree};
use super::large::{LargeSurface, surfaces};
use super::node::{Bounds, Child, MAX_DEPTH};
use super::ray::Extent;
use super::sphere::bounds as sphere_bounds;
use super::split::Split;
use super::triangle::is_degenerate;
use crate::scene::{MaterialKind, NONE, Scene, Shape};

/// What a tree is built over.
#[derive(Clone)]
pub struct Part<'a> {
    pub scene: &'a Scene,
    /// Entries of the scene's tables.
    pub triangles: Range<u32>,
    pub spheres: Range<u32>,
    /// With large surfaces; objects have none.
    pub large: bool,
    /// Of what rays meet beside these.
    pub beside: Option<Bounds>,
}

impl<'a> Part<'a> {
    /// What is in its place.
    pub fn own(scene: &'a Scene, beside: Option<Bounds>) -> Self {
        Self {
            scene,
            triangles: scene.own_triangles(),
            spheres: scene.own_spheres(),
            large: true,
            beside,
        }
    }

    fn large(&self) -> Vec<LargeSurface> {
        if self.large {
            surfaces(self.scene)
        } else {
            Vec::new()
        }
    }
}

/// The best tree that can be built in reasonable time, if it is not too deep: obvhs', unless many
/// primitives lie in one place.
pub fn best(part: &Part) -> Option<Tree> {
    let (scene, large) = (part.scene, part.large());
    let (mut primitives, mut boxes) = collect(part, &large);
    let mut is_crowded = crowd::is_crowded(&boxes);
    if is_crowded {
        drop_equals(scene, &mut primitives, &mut boxes);
        is_crowded = crowd::is_crowded(&boxes);
    }
    let mut flat = Flattening::new(scene, &primitives, &boxes, large, part.beside);
    if is_crowded {
        flat.split(Split::Area);
        return Some(flat.tree);
    }
    let boxes: &[Boxed] = bytemuck::cast_slice(&boxes);
    let bvh = build_bvh2(
        boxes,
        quality(boxes.len(), !part.large),
        &mut Duration::default(),
    );
    flat.copy(&bvh).then_some(flat.tree)
}

/// Leaves out what lies where an earlier primitive lies.
fn drop_equals(scene: &Scene, primitives: &mut Vec<Primitive>, boxes: &mut Vec<Bounds>) {
    let mut equals = crowd::Equals::default();
    let kept: Vec<bool> = primitives
        .iter()
        .map(|p| match *p {
            Primitive::Triangle(index) => equals.is_first_triangle(scene, index),
            Primitive::Sphere(index) => equals.is_first_sphere(scene, index),
            Primitive::Large(_) => true,
        })
        .collect();
    let mut of_boxes = kept.iter();
    boxes.retain(|_| of_boxes.next() == Some(&true));
    let mut of_primitives = kept.iter();
    primitives.retain(|_| of_primitives.next() == Some(&true));
}

/// Bounds as obvhs asks for them.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
struct Boxed(Bounds);

impl Boundable for Boxed {
    fn aabb(&self) -> Aabb {
        let corner = |side: usize| Vec3A::new(self.0[0][side], self.0[1][side], self.0[2][side]);
        Aabb::new(corner(0), corner(1))
    }
}

/// A tree of bounded depth: halves at the median centre of the longest axis.
pub fn halve(part: &Part) -> Tree {
    let large = part.large();
    let (primitives, boxes) = collect(part, &large);
    let mut flat = Flattening::new(part.scene, &primitives, &boxes, large, part.beside);
    flat.split(Split::Half);
    flat.tree
}

/// A tree over boxes that stand for something else, with one in a leaf unless they are many in one
/// place: its triangles are their indices. `extent` is that of the scene.
pub fn over_boxes(scene: &Scene, boxes: &[Bounds], extent: &Extent) -> Tree {
    let split = if crowd::is_crowded(boxes) {
        Split::Area
    } else {
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..quality(boxes.len(), true)
        };
        let boxed: &[Boxed] = bytemuck::cast_slice(boxes);
        let bvh = build_bvh2(boxed, params, &mut Duration::default());
        let fill = |flat: &mut Flattening| flat.copy(&bvh);
        if let Some(tree) = tree_over(scene, boxes, extent, fill) {
            return tree;
        }
        Split::Half
    };
    let fill = |flat: &mut Flattening| {
        flat.split(split);
        true
    };
    tree_over(scene, boxes, extent, fill).expect("filled")
}

/// [`over_boxes`] of bounded depth.
pub fn halves_of_boxes(scene: &Scene, boxes: &[Bounds], extent: &Extent) -> Tree {
    let fill = |flat: &mut Flattening| {
        flat.split(Split::Half);
        true
    };
    tree_over(scene, boxes, extent, fill).expect("filled")
}

fn tree_over(
    scene: &Scene,
    boxes: &[Bounds],
    extent: &Extent,
    fill: impl FnOnce(&mut Flattening) -> bool,
) -> Option<Tree> {
    let primitives: Vec<Primitive> = (0..boxes.len() as u32).map(Primitive::Triangle).collect();
    let mut flat = Flattening::new(scene, &primitives, boxes, Vec::new(), None);
    flat.tree.extent = *extent;
    fill(&mut flat).then_some(flat.tree)
}

/// All primitives a ray can meet, and their boxes. Primitives that are not finite or have no area
/// are left out.
fn collect(part: &Part, large: &[LargeSurface]) -> (Vec<Primitive>, Vec<Bounds>) {
    let scene = part.scene;
    let places = if part.large {
        (scene.large).places(scene.triangles.len(), scene.spheres.len())
    } else {
        Vec::new()
    };
    let place = |i: usize| places.get(i).copied().unwrap_or(NONE);
    let visible = |shape: u32| {
        let Shape {
            material, boundary, ..
        } = scene.shapes[shape as usize];
        material == NONE
            || boundary != NONE
            || !matches!(
                scene.materials[material as usize].kind,
                MaterialKind::Interface
            )
    };
    let finite = |b: &Bounds| b.iter().flatten().all(|x| x.is_finite());
    let range = |r: &Range<u32>| r.start as usize..r.end as usize;
    let (of_triangles, of_spheres) = (range(&part.triangles), range(&part.spheres));
    let listed = of_triangles
        .clone()
        .zip(&scene.triangles[of_triangles.clone()]);
    let triangles = listed.filter_map(|(i, t)| {
        let p = t.v.map(|v| scene.vertices[v as usize].p);
        let range = |k: usize| {
            p.iter().fold([f32::INFINITY, -f32::INFINITY], |b, p| {
                // NaN must not vanish in min and max.
                let x = if p[k].is_nan() { f32::INFINITY } else { p[k] };
                [b[0].min(x), b[1].max(x)]
            })
        };
        let bounds = [range(0), range(1), range(2)];
        if place(i) != NONE {
            let bounds = large[place(i) as usize].bounds();
            let usable = visible(t.shape) && finite(&bounds);
            return usable.then_some((Primitive::Large(place(i)), bounds));
        }
        let usable = finite(&bounds) && !is_degenerate(p);
        (visible(t.shape) && usable).then_some((Primitive::Triangle(i as u32), bounds))
    });
    let listed = of_spheres.clone().zip(&scene.spheres[of_spheres.clone()]);
    let spheres = listed.filter_map(|(i, s)| {
        let bounds = sphere_bounds(s);
        let usable = finite(&bounds) && s.to_unit.iter().flatten().all(|x| x.is_finite());
        let primitive = match place(scene.triangles.len() + i) {
            NONE => Primitive::Sphere(i as u32),
            place => Primitive::Large(place),
        };
        (visible(s.shape) && usable).then_some((primitive, bounds))
    });
    // Filtered iterators cannot tell their length, and growing tables of this size takes as long as
    // filling them.
    let count = of_triangles.len() + of_spheres.len();
    let (mut primitives, mut boxes) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for (primitive, bounds) in triangles.chain(spheres) {
        primitives.push(primitive);
        boxes.push(bounds);
    }
    (primitives, boxes)
}

/// How much work to put into the tree. With `less`, what is built is not the one tree over
/// everything; from some size on the better tree is not worth the wait there.
fn quality(primitives: usize, less: bool) -> BvhBuildParams {
    let params = match primitives {
        8192..100_000 if less => BvhBuildParams::medium_build(),
        0..100_000 => BvhBuildParams {
            pre_split: false,
            ..BvhBuildParams::slow_build()
        },
        100_000..1_000_000 => BvhBuildParams::medium_build(),
        // Reinsertion of half as many nodes is a fifth of the time, and no ray is slower.
        _ => BvhBuildParams {
            reinsertion_batch_ratio: 0.02,
            ..BvhBuildParams::medium_build()
        },
    };
    BvhBuildParams {
        max_prims_per_leaf: LEAF_SIZE,
        // Fewer triangles a leaf make packets a sixth faster where the nodes are in the first
        // cache, and cost memory.
        collapse_traversal_cost: if primitives < 1000 { 1.5 } else { 3.0 },
        ..params
    }
}

impl Flattening<'_> {
    /// Copies the tree of obvhs; false if it is too deep to be traversed.
    fn copy(&mut self, bvh: &Bvh2) -> bool {
        let Some(root) = bvh.nodes.first() else {
            return true;
        };
        if root.is_leaf() {
            let range = root.first_index as usize..(root.first_index + root.prim_count) as usize;
            self.tree.nodes[0].link[0].child = self.leaf(&bvh.primitive_indices[range.clone()]);
            self.tree.nodes[0].bounds[0] = self.padded(&bvh.primitive_indices[range]);
            self.tree.depth = 2;
            return true;
        }
        self.tree.nodes.reserve(bvh.nodes.len() / 2);
        let mut pending = vec![Pending {
            node: 0,
            depth: 1,
            content: root.first_index as usize,
        }];
        while let Some(Pending {
            node,
            depth,
            content,
        }) = pending.pop()
        {
            if depth + 3 > MAX_DEPTH {
                return false;
            }
            self.tree.depth = self.tree.depth.max(depth + 2);
            for side in 0..2 {
                let from = &bvh.nodes[content + side];
                let b = from.aabb();
                let bounds: Bounds = std::array::from_fn(|k| [b.min[k], b.max[k]]);
                self.tree.nodes[node].bounds[side] = self.tree.extent.grown(bounds);
                self.tree.nodes[node].link[side].child = if from.is_leaf() {
                    let first = from.first_index as usize;
                    let range = first..first + from.prim_count as usize;
                    self.leaf(&bvh.primitive_indices[range])
                } else {
                    let index = self.push_node();
                    pending.push(Pending {
                        node: index,
                        depth: depth + 1,
                        content: from.first_index as usize,
                    });
                    Child::inner(index)
                };
            }
        }
        true
    }
}
