//! Shapes that become triangle meshes at load: disks, surfaces of revolution, curves, height
//! fields, NURBS, bilinear patches, Loop subdivision surfaces.
//!
//! All in object space. The front of a triangle is where its vertices run counter-clockwise.
//!
//! # Adding a shape
//!
//! A shape that becomes triangles is a file here, its `mod` and `pub use`, and what reads it where
//! scene files are read: a function, its name, and for pbrt-v3 its name among those that are
//! tolerated (four files in all for the disk). Nothing behind the loader knows it. A shape that
//! rays meet as it is, as the sphere, is another matter: it takes a test in each of the tracer's
//! kernels, points and derivatives in `geometry`, area sampling in `light`, bounds at load and
//! formulas in `replay`, more than thirty files. The tracer's packets hold two kinds of primitives
//! and no calls through a table, which is what makes them fast.

mod bilinear;
mod curve;
mod disk;
mod grid;
mod quadric;
mod subdivision;

pub use bilinear::{append_patches, bilinear_mesh_within};
pub use curve::{Basis, CurvePiece, curve};
pub use disk::{disk, whole_disk};
pub use grid::{Knots, height_field, nurbs};
pub use quadric::Quadric;
pub use subdivision::loop_subdivide;

/// Takes memory, in bytes, or says that there is none.
pub type Room<'a> = &'a mut dyn FnMut(u64) -> Result<(), String>;

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Object space.
    pub positions: Vec<[f32; 3]>,
    /// One a vertex, of any length; zero where the mesh has none.
    pub normals: Option<Vec<[f32; 3]>>,
    /// One a vertex.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Indices of vertices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Things dropped or replaced, each a line without the name of the shape or file.
    pub warnings: Vec<String>,
}

/// More triangles than any shape has: a bound on what a level of subdivision or a list of patches
/// can ask for.
const MAX_TRIANGLES: u64 = 1 << 28;

impl MeshData {
    /// Drops triangles that no ray can hit (no area, vertices that are not finite) and neutralises
    /// normals and texture coordinates that are not finite, with one counted warning each.
    /// Indices must be in range.
    pub fn drop_degenerate(&mut self) {
        let finite = |p: &[f32; 3]| p.iter().all(|v| v.is_finite());
        let positions = &self.positions;
        let (mut unbounded, mut flat) = (0usize, 0usize);
        self.triangles.retain(|triangle| {
            let corners = triangle.map(|v| positions[v as usize]);
            if !corners.iter().all(finite) {
                unbounded += 1;
                return false;
            }
            let [a, b, c] = corners.map(|p| glam::DVec3::from(p.map(f64::from)));
            let area = (b - a).cross(c - a).length_squared() > 0.0;
            flat += usize::from(!area);
            area
        });
        let mut warn = |count: usize, what: &str| {
            if count > 0 {
                self.warnings.push(format!("{count} {what}"));
            }
        };
        warn(
            unbounded,
            "triangles with vertices that are not finite dropped",
        );
        warn(flat, "triangles without area dropped");
        if let Some(normals) = &mut self.normals {
            let bad = normals.iter_mut().filter(|n| !finite(n));
            warn(
                bad.map(|n| *n = [0.0; 3]).count(),
                "normals that are not finite ignored",
            );
        }
        if let Some(uvs) = &mut self.uvs {
            let bad = uvs
                .iter_mut()
                .filter(|uv| !uv.iter().all(|v| v.is_finite()));
            warn(
                bad.map(|uv| *uv = [0.0; 2]).count(),
                "texture coordinates that are not finite set to 0",
            );
        }
        // Vertices of dropped triangles stay in the list; where another vertex is, they cannot
        // widen a scene's bounds.
        let place = self
            .positions
            .iter()
            .copied()
            .find(finite)
            .unwrap_or_default();
        for p in self.positions.iter_mut().filter(|p| !finite(p)) {
            *p = place;
        }
    }
}

/// Normals in `f32`: all times one power of two, where their lengths would leave its range.
fn narrow_normals(normals: &[glam::DVec3]) -> Vec<[f32; 3]> {
    let longest = (normals.iter()).fold(0.0, |most: f64, n| most.max(n.abs().max_element()));
    let scale = match longest {
        1e-10..=1e10 | 0.0 => 1.0,
        _ => (-longest.log2().round()).clamp(-1000.0, 1000.0).exp2(),
    };
    (normals.iter())
        .map(|n| (*n * scale).as_vec3().to_array())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degenerate_triangles_are_counted() {
        let mut mesh = MeshData {
            positions: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1e-30, 0.0],
                [f32::NAN, 0.0, 0.0],
                [2.0, 0.0, 0.0],
            ],
            normals: Some(vec![[0.0, 0.0, f32::INFINITY]; 5]),
            uvs: Some(vec![[0.0, f32::NAN]; 5]),
            triangles: vec![[0, 1, 2], [0, 1, 3], [0, 1, 4], [1, 1, 2]],
            warnings: Vec::new(),
        };
        mesh.drop_degenerate();
        assert_eq!(mesh.triangles, vec![[0, 1, 2]]);
        assert_eq!(mesh.warnings.len(), 4);
        assert!(mesh.warnings[1].starts_with("2 triangles without area"));
        assert!(mesh.positions.iter().flatten().all(|v| v.is_finite()));
    }
}
