//! A tree as it is put together: nodes that hold the boxes of both children, and leaves of either
//! triangles or spheres.

use super::large::LargeSurface;
use super::node::{Bounds, Child, Link, NOWHERE, Node, union};
use super::ray::Extent;
use super::sphere::LeafSphere;
use crate::scene::Scene;

/// Most primitives per leaf.
pub const LEAF_SIZE: u32 = 4;

/// What a build yields.
pub struct Tree {
    pub nodes: Vec<Node>,
    /// Triangles in leaf order; those of a subtree are neighbours.
    pub triangles: Vec<u32>,
    pub spheres: Vec<LeafSphere>,
    /// What leaves of spheres refer to beside spheres.
    pub large: Vec<LargeSurface>,
    pub extent: Extent,
    pub depth: usize,
}

/// A primitive to be sorted into the tree.
#[derive(Clone, Copy)]
pub enum Primitive {
    Triangle(u32),
    Sphere(u32),
    /// Index into [`Tree::large`].
    Large(u32),
}

/// A tree that is being put together.
pub struct Flattening<'a> {
    scene: &'a Scene,
    pub primitives: &'a [Primitive],
    pub boxes: &'a [Bounds],
    pub tree: Tree,
}

/// A node waiting to be filled, and what belongs there.
pub struct Pending<T> {
    pub node: usize,
    pub depth: usize,
    pub content: T,
}

impl<'a> Flattening<'a> {
    pub fn new(
        scene: &'a Scene,
        primitives: &'a [Primitive],
        boxes: &'a [Bounds],
        large: Vec<LargeSurface>,
        beside: Option<Bounds>,
    ) -> Self {
        let bounds = boxes.iter().copied().chain(beside).reduce(union);
        let bounds = bounds.unwrap_or([[0.0; 2]; 3]);
        Self {
            scene,
            primitives,
            boxes,
            tree: Tree {
                nodes: vec![EMPTY_NODE],
                triangles: Vec::with_capacity(primitives.len()),
                spheres: Vec::new(),
                extent: Extent::new(bounds, !large.is_empty()),
                large,
                depth: 1,
            },
        }
    }

    pub fn push_node(&mut self) -> usize {
        self.tree.nodes.push(EMPTY_NODE);
        self.tree.nodes.len() - 1
    }

    /// Stores the members of a leaf. Triangles and others that share one are parted by a node.
    pub fn leaf(&mut self, members: &[u32]) -> Child {
        if self.scene.spheres.is_empty() && self.tree.large.is_empty() {
            return self.homogeneous_leaf(members);
        }
        let is_sphere = |i: &u32| !matches!(self.primitives[*i as usize], Primitive::Triangle(_));
        let (spheres, triangles): (Vec<u32>, Vec<u32>) = members.iter().partition(|i| is_sphere(i));
        match (triangles.is_empty(), spheres.is_empty()) {
            (_, true) => self.homogeneous_leaf(&triangles),
            (true, false) => self.homogeneous_leaf(&spheres),
            (false, false) => {
                let node = Node {
                    bounds: [self.padded(&triangles), self.padded(&spheres)],
                    link: [
                        Link::to(self.homogeneous_leaf(&triangles)),
                        Link::to(self.homogeneous_leaf(&spheres)),
                    ],
                };
                self.tree.nodes.push(node);
                Child::inner(self.tree.nodes.len() - 1)
            }
        }
    }

    fn homogeneous_leaf(&mut self, members: &[u32]) -> Child {
        let first = [self.tree.triangles.len(), self.tree.spheres.len()];
        let mut spheres = false;
        for &i in members {
            match self.primitives[i as usize] {
                Primitive::Triangle(index) => self.tree.triangles.push(index),
                Primitive::Sphere(index) => {
                    spheres = true;
                    let prim = self.scene.triangles.len() as u32 + index;
                    let sphere = &self.scene.spheres[index as usize];
                    self.tree.spheres.push(LeafSphere::new(sphere, prim));
                }
                Primitive::Large(index) => {
                    spheres = true;
                    self.tree.spheres.push(LeafSphere::large(index));
                }
            }
        }
        Child::leaf(spheres, first[spheres as usize], members.len())
    }

    pub fn padded(&self, members: &[u32]) -> Bounds {
        members
            .iter()
            .map(|&i| self.boxes[i as usize])
            .reduce(union)
            .map_or(NOWHERE, |b| self.tree.extent.grown(b))
    }
}

const EMPTY_NODE: Node = Node {
    bounds: [NOWHERE; 2],
    link: [Link::EMPTY; 2],
};
