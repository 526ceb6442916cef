//! Surfaces so large that `f32` cannot tell how far small things are from them.
//!
//! The rounding of a distance to a plane grows with the triangle that spans it, not with the
//! distance: a ground of half side 1e6 swallows two units around it. The few surfaces that are
//! thousands of times larger than what else there is are therefore kept in `f64` as
//! well. The tracer tests them in `f64` (`trace/large.rs`), and points on them are found in `f64`
//! (`geometry/large.rs`): what is left of the error is the rounding of the point itself, which is
//! as small as its neighbourhood. Scenes without such surfaces have an empty table and pay nothing.

use super::NONE;
use glam::{DAffine3, DVec3};

/// A triangle that is tested in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargeTriangle {
    /// Index into [`Scene::triangles`](super::Scene::triangles).
    pub triangle: u32,
    /// Corners, internal space.
    pub p: [DVec3; 3],
    /// Not large itself but a neighbour of large ones, so that what they share is decided alike on
    /// both sides. What it shares with ordinary triangles is decided as theirs.
    pub seam: bool,
    /// Distance from its plane, internal space, within which lies what the file has in one plane
    /// with it: a triangle beside it, and points of this one.
    pub off: f64,
}

impl LargeTriangle {
    /// Roundings between a corner as the file has it and a point of the plane, relative to the
    /// largest coordinate on the way: the transform of the corners and the shift to the origin of
    /// internal space, the normal, and the projection of a point; those of this triangle and of the
    /// one beside it.
    pub const OFF: f64 = 64.0 * f64::EPSILON;

    /// Unit normal of the plane, and twice the area. The products' differences are right to the
    /// last digits: of a long sliver, whose sides are all but parallel, plain ones would turn the
    /// plane away from its neighbours'.
    pub fn plane(&self) -> (DVec3, f64) {
        let [a, b, c] = self.p;
        let (e1, e2) = (b - a, c - a);
        let minor = |i: usize, j: usize| {
            let product = e1[j] * e2[i];
            let lost = (-e1[j]).mul_add(e2[i], product);
            e1[i].mul_add(e2[j], -product) + lost
        };
        let n = DVec3::new(minor(1, 2), minor(2, 0), minor(0, 1));
        (n.normalize_or_zero(), n.length())
    }
}

/// A sphere or ellipsoid that is tested in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargeSphere {
    /// Index into [`Scene::spheres`](super::Scene::spheres).
    pub sphere: u32,
    /// Unit sphere to internal space, and back.
    pub to_world: DAffine3,
    /// Internal space to the unit sphere.
    pub to_unit: DAffine3,
}

/// The large surfaces of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Large {
    /// In the order of [`Scene::triangles`](super::Scene::triangles).
    pub triangles: Vec<LargeTriangle>,
    /// In the order of [`Scene::spheres`](super::Scene::spheres).
    pub spheres: Vec<LargeSphere>,
}

impl Large {
    /// True of most scenes.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.spheres.is_empty()
    }

    /// Triangles and spheres.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// For every primitive of a scene with so many triangles and spheres, triangles first: its
    /// place in this table, triangles first, or [`NONE`]. Empty if the table is.
    pub fn places(&self, triangles: usize, spheres: usize) -> Vec<u32> {
        if self.is_empty() {
            return Vec::new();
        }
        let mut places = vec![NONE; triangles + spheres];
        let of_triangles = self.triangles.iter().map(|t| t.triangle as usize);
        let of_spheres = self.spheres.iter().map(|s| triangles + s.sphere as usize);
        for (place, primitive) in of_triangles.chain(of_spheres).enumerate() {
            places[primitive] = place as u32;
        }
        places
    }
}
