//! What the surfaces of a scene can do to light at all: facts that rule strategies out.
//!
//! Two of them. A black surface ends every path that meets it. And points of one plane do not see
//! each other but along the plane, where cosines are zero: light that leaves it does not come back
//! to it.

use crate::scene::Scene;
use crate::surface::MaterialTable;

/// Facts about a set of surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Surfaces {
    /// There are some, and not all are black.
    pub scatter: bool,
    /// Points of those that are not black can see each other: they do not all lie in one plane.
    /// Only planes across an axis of the scene are recognised, of which that is certain to the
    /// last bit.
    pub face: bool,
}

impl Surfaces {
    /// Of the surfaces whose material `belongs`; of mixtures, those of which some component belongs
    /// that is not black.
    pub fn of(scene: &Scene, materials: &MaterialTable, belongs: impl Fn(usize) -> bool) -> Self {
        let bright: Vec<bool> = (0..scene.materials.len())
            .map(|i| {
                let parts = materials.components(i);
                parts
                    .iter()
                    .any(|i| belongs(*i) && !scene.materials[*i].kind.is_black())
            })
            .collect();
        let scatters: Vec<bool> = (scene.shapes.iter())
            .map(|shape| bright[shape.material as usize])
            .collect();
        let spheres = (scene.spheres.iter()).any(|s| scatters[s.shape as usize]);
        let mut corners = (scene.triangles.iter())
            .filter(|t| scatters[t.shape as usize])
            .flat_map(|t| t.v.map(|v| scene.vertices[v as usize].p));
        let Some(first) = corners.next() else {
            return Self {
                scatter: spheres,
                face: spheres,
            };
        };
        let mut in_plane = [true; 3];
        for p in corners {
            for axis in 0..3 {
                in_plane[axis] &= p[axis] == first[axis];
            }
            if in_plane == [false; 3] {
                break;
            }
        }
        Self {
            scatter: true,
            face: spheres || in_plane == [false; 3] || !scene.instances.is_empty(),
        }
    }
}
