//! Objects that are kept once, and the places where they are seen.
//!
//! The primitives of objects are the last in the scene's tables: first the triangles and spheres
//! that are in their place, then those of one object after the other, each in a space of its own.
//! An object's space is chosen like internal space: its centre is the origin, and all lies within a
//! radius in `[0.5, 1]`. No primitive of an object emits light.

use std::ops::Range;

use glam::{DAffine3, DVec3, Vec3};

/// Primitives that are kept once.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its entries of [`Scene::triangles`](super::Scene::triangles).
    pub triangles: Range<u32>,
    /// Its entries of [`Scene::spheres`](super::Scene::spheres).
    pub spheres: Range<u32>,
    /// Bounds, `[min, max]`, in its space.
    pub bounds: [Vec3; 2],
}

/// An object in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// From the object's space to internal space. It has an inverse.
    pub to_world: DAffine3,
    /// Index into [`Instances::objects`].
    pub object: u32,
}

/// Everything in a scene that is kept once and seen in several places. Empty in most scenes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    /// In the order of their primitives.
    pub objects: Vec<Object>,
    /// A hit names its instance by the place in this list.
    pub placed: Vec<Instance>,
}

impl Object {
    /// Triangles and spheres.
    pub fn primitives(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }
}

impl Instance {
    /// A box, `[min, max]` in internal space, around what is within `bounds` in the object's space.
    pub fn around(&self, bounds: [Vec3; 2]) -> [DVec3; 2] {
        let [low, high] = bounds.map(Vec3::as_dvec3);
        let middle = self.to_world.transform_point3((low + high) / 2.0);
        let half = (high - low) / 2.0;
        let m = self.to_world.matrix3;
        let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        [middle - reach, middle + reach]
    }
}

impl Instances {
    /// True of most scenes.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Triangles and spheres that can be seen by instances, each as often as it is.
    pub fn primitives(&self) -> [u64; 2] {
        let of = |i: &Instance| &self.objects[i.object as usize];
        (self.placed.iter().map(of)).fold([0; 2], |[triangles, spheres], object| {
            [
                triangles + object.triangles.len() as u64,
                spheres + object.spheres.len() as u64,
            ]
        })
    }

    /// Memory of its tables, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.objects[..]) + size_of_val(&self.placed[..])
    }
}
