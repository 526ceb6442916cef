//! Copies of objects in their places.

use std::ops::Range;

use glam::{DAffine3, DVec3};

use super::super::error::{SceneError, Site};
use super::super::instances::BEYOND;
use super::super::transform::{inverse, normal_matrix, swaps_handedness};
use super::normal_map::NormalMap;
use super::{Geometry, WorldShape, WorldSphere, WorldTriangle, WorldVertex, is_placeable};

/// All but the vertices.
#[derive(Debug)]
pub(in crate::pbrt) struct Primitives {
    triangles: Vec<WorldTriangle>,
    spheres: Vec<WorldSphere>,
    pub shapes: Vec<WorldShape>,
}

impl Geometry {
    /// Copies an object. A mirrored instance keeps its front, so the order of vertices turns round.
    pub fn add_instance(
        &mut self,
        site: &Site,
        object: &Geometry,
        by: &DAffine3,
    ) -> Result<(), SceneError> {
        let shapes = object.shapes.len();
        self.room_for(site, object.primitives(), object.vertices.len(), shapes)?;
        let normals = NormalMap::of(normal_matrix(by), &[]);
        let mirrored = swaps_handedness(by);
        let base = self.vertices.len() as u32;
        let first_triangle = self.triangles.len() as u32;
        let first_sphere = self.spheres.len() as u32;
        if !object.tangents.is_empty() {
            self.room_for_tangents(site, object.vertices.len())?;
        }
        for (i, v) in object.vertices.iter().enumerate() {
            let p = by.transform_point3(v.p);
            if !is_placeable(p) {
                return Err(site.error(BEYOND));
            }
            self.vertices.push(WorldVertex {
                p,
                n: normals.apply(v.n.as_dvec3()),
                uv: v.uv,
            });
            self.set_tangent(base as usize + i, by.transform_vector3(object.tangent(i)));
        }
        self.triangles.extend(object.triangles.iter().map(|t| {
            let [a, b, c] = t.v.map(|i| base + i);
            WorldTriangle {
                v: if mirrored { [a, c, b] } else { [a, b, c] },
            }
        }));
        for sphere in &object.spheres {
            let to_world = *by * sphere.to_world;
            if inverse(&to_world).is_none() {
                return Err(site
                    .error("the current transform leaves a sphere of the object without volume"));
            }
            self.spheres.push(WorldSphere {
                to_world,
                ..*sphere
            });
        }
        self.shapes.extend(object.shapes.iter().map(|s| WorldShape {
            first: s.first
                + if s.spheres {
                    first_sphere
                } else {
                    first_triangle
                },
            ..s.clone()
        }));
        Ok(())
    }

    /// Leaves nothing but vertices.
    pub fn take_primitives(&mut self) -> Primitives {
        Primitives {
            triangles: std::mem::take(&mut self.triangles),
            spheres: std::mem::take(&mut self.spheres),
            shapes: std::mem::take(&mut self.shapes),
        }
    }

    /// Appends some of the shapes that were taken.
    pub fn put_back(&mut self, taken: &Primitives, shapes: Range<usize>) {
        for shape in &taken.shapes[shapes] {
            let range = shape.first as usize..(shape.first + shape.count) as usize;
            let first = if shape.spheres {
                self.spheres.extend_from_slice(&taken.spheres[range]);
                self.spheres.len()
            } else {
                self.triangles.extend_from_slice(&taken.triangles[range]);
                self.triangles.len()
            };
            let first = first as u32 - shape.count;
            self.shapes.push(WorldShape {
                first,
                ..shape.clone()
            });
        }
    }

    /// The box around all primitives, `[min, max]`.
    pub fn bounds(&self) -> [DVec3; 2] {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in (self.triangles.iter().flat_map(|t| t.v)).map(|v| self.vertices[v as usize].p) {
            (low, high) = (low.min(p), high.max(p));
        }
        for sphere in &self.spheres {
            let centre = sphere.to_world.translation;
            let m = sphere.to_world.matrix3.transpose();
            let half = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
            (low, high) = (low.min(centre - half), high.max(centre + half));
        }
        [low, high]
    }
}
