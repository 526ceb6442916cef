//! pbrt-v4's bilinear patches as triangles.
//!
//! A patch is `p(u, v) = (1-u)(1-v) p00 + u (1-v) p10 + (1-u) v p01 + u v p11`. Where position,
//! normal and texture coordinates are all affine in one another two triangles are exact; elsewhere
//! a grid approximates the patch.

use glam::{DVec2, DVec3};

use super::{MAX_TRIANGLES, MeshData, Room};

/// A grid follows a curved patch to this fraction of its size.
const TOLERANCE: f64 = 1e-4;
/// A grid follows normals and texture coordinates to this fraction of their extent.
const ATTRIBUTE_TOLERANCE: f64 = 1e-3;
/// Cells along a side of a patch, at most.
const MOST_CELLS: f64 = 64.0;
/// Cells of all patches of one mesh that are aimed at; many small patches need fewer each.
const CELL_BUDGET: f64 = (1u32 << 23) as f64;
/// Relative deviation from a plane quadrilateral that is taken as rounding of the file's numbers.
const AFFINE: f64 = 1e-5;
/// Rounding of a coordinate of the file, as a part of it.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

const UNIT_SQUARE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];

/// Corners 00, 10, 01, 11 of one attribute.
#[derive(Clone, Copy)]
struct Corners([DVec3; 4]);

impl Corners {
    fn at(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c, d] = self.0;
        a.lerp(b, u).lerp(c.lerp(d, u), v)
    }

    /// The coefficient of `u v`: zero for a parallelogram.
    fn twist(&self) -> DVec3 {
        let [a, b, c, d] = self.0;
        a - b - c + d
    }

    fn extent(&self) -> f64 {
        let [a, b, c, d] = self.0;
        (d - a).length().max((c - b).length())
    }

    /// Length of the longest corner.
    fn reach(&self) -> f64 {
        self.0.iter().fold(0.0, |most, c| most.max(c.length()))
    }

    /// Twice the area, along the normal, of the quadrilateral's outline.
    fn outline(&self) -> DVec3 {
        let [a, b, c, d] = self.0;
        (d - a).cross(c - b)
    }

    /// Whether the two triangles that meet in the diagonal from 00 to 11 cover just what the patch
    /// does: its corners are in one plane, and turn one way. Corners may coincide. `slack` is
    /// what counts as rounding.
    fn is_plane_and_convex(&self, slack: f64) -> bool {
        let [a, b, c, d] = self.0;
        let outline = self.outline();
        let Some(normal) = outline.try_normalize() else {
            return false;
        };
        let around = [a, b, d, c];
        let turns = (0..4).all(|i| {
            let [before, here, after] = [3, 4, 5].map(|k| around[(i + k) % 4]);
            let turn = (after - here).cross(before - here).dot(normal);
            turn >= -slack * self.extent()
        });
        turns && (b - a).dot(normal).abs() <= slack
    }

    /// How far the triangles' interpolation of this attribute is from that of one affine map of
    /// `position` over the whole patch.
    fn deviation(&self, position: &Corners) -> f64 {
        let [a, b, c, d] = position.0;
        let (x, y, z) = (b - a, c - a, d - a);
        let normal = x.cross(y);
        let area = normal.length_squared();
        if area <= AFFINE * position.extent().powi(4) {
            return self.twist().length();
        }
        let (s, t) = (z.cross(y).dot(normal) / area, x.cross(z).dot(normal) / area);
        let [a, b, c, d] = self.0;
        (a + s * (b - a) + t * (c - a) - d).length()
    }

    /// `dp/du x dp/dv`, the front of the patch.
    fn normal(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c, d] = self.0;
        let du = (b - a).lerp(d - c, v);
        let dv = (c - a).lerp(d - b, u);
        du.cross(dv).normalize_or_zero()
    }
}

/// Vertices that patches refer to.
#[derive(Clone, Copy)]
struct Vertices<'a> {
    p: &'a [[f32; 3]],
    n: Option<&'a [[f32; 3]]>,
    uv: Option<&'a [[f32; 2]]>,
    /// Something looks at texture coordinates.
    textured: bool,
}

/// One patch, and how it is cut up.
struct Patch {
    position: Corners,
    normal: Option<Corners>,
    texture: Corners,
    /// Triangles show the patch's own normal: it is flat, or there are vertex normals.
    flat: bool,
    cells: u32,
}

impl Vertices<'_> {
    /// Indices are in range.
    fn patch(&self, indices: &[u32; 4], most_cells: f64) -> Patch {
        let at = |i: usize| indices[i] as usize;
        let position = Corners(std::array::from_fn(|i| self.p[at(i)].map(f64::from).into()));
        let normal =
            (self.n).map(|n| Corners([0, 1, 2, 3].map(|i| n[at(i)].map(f64::from).into())));
        let texture = Corners(std::array::from_fn(|i| {
            let uv = self.uv.map_or(UNIT_SQUARE[i], |uv| uv[at(i)]);
            DVec2::from(uv.map(f64::from)).extend(0.0)
        }));

        let size = position.extent();
        let largest = position
            .0
            .iter()
            .map(|p| p.abs().max_element())
            .fold(0.0, f64::max);
        let slack = AFFINE * size + ROUNDING * largest;
        let flat = position.is_plane_and_convex(slack);
        // A cell of side 1 / n deviates from its triangles by at most 1 / (4 n^2) of what the whole
        // does.
        let mut cells = if flat {
            1.0
        } else {
            (position.twist().length() / (4.0 * TOLERANCE * size)).sqrt()
        };
        let mut follow = |attribute: &Corners, extent: f64| {
            let off = attribute.deviation(&position);
            if off > AFFINE * extent + ROUNDING * extent * largest / size {
                cells = cells.max((off / (4.0 * ATTRIBUTE_TOLERANCE * extent)).sqrt());
            }
        };
        if self.textured {
            follow(&texture, texture.extent());
        }
        if let Some(normal) = &normal {
            follow(normal, normal.reach());
        }
        Patch {
            flat: flat || normal.is_some(),
            position,
            normal,
            texture,
            // NaN (a patch without size) becomes 0 and then the least.
            cells: cells.max(0.0).ceil().clamp(1.0, most_cells) as u32,
        }
    }
}

/// Cells along the sides of each of so many patches, at most.
fn most_cells(patches: usize) -> f64 {
    (CELL_BUDGET / patches.max(1) as f64)
        .sqrt()
        .clamp(1.0, MOST_CELLS)
        .floor()
}

/// Memory of a cell of a grid, roughly: a vertex and two triangles, and copies of them as meshes
/// are added to a scene.
const CELL_BYTES: u64 = 128;

impl Patch {
    fn bytes(&self) -> u64 {
        u64::from(self.cells).pow(2) * CELL_BYTES
    }
}

/// Patches of four indices each: vertices p00, p10, p01, p11. Without `uv` every patch covers the
/// unit square. The front is pbrt's, `cross(dp/du, dp/dv)`; given normals are passed on and do not
/// turn it. `room` is asked for memory.
pub fn bilinear_mesh_within(
    p: &[[f32; 3]],
    n: Option<&[[f32; 3]]>,
    uv: Option<&[[f32; 2]]>,
    indices: &[u32],
    room: Room,
) -> Result<MeshData, String> {
    let (patches, rest) = indices.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(format!("{} indices are not a multiple of 4", indices.len()));
    }
    let lengths = [("N", n.map(<[_]>::len)), ("uv", uv.map(<[_]>::len))];
    for (name, length) in lengths {
        if length.is_some_and(|l| l != p.len()) {
            return Err(format!(
                "{} values of {name:?} for {} vertices",
                length.unwrap_or(0),
                p.len()
            ));
        }
    }
    if let Some(bad) = indices.iter().find(|&&i| i as usize >= p.len()) {
        return Err(format!(
            "index {bad} is out of range, there are {} vertices",
            p.len()
        ));
    }

    let most_cells = most_cells(patches.len());
    let vertices = Vertices {
        p,
        n,
        uv,
        textured: true,
    };
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..Default::default()
    };
    let mut flat = true;
    for indices in patches {
        let patch = vertices.patch(indices, most_cells);
        let cells = patch.cells as usize;
        if (mesh.triangles.len() + 2 * cells * cells) as u64 > MAX_TRIANGLES {
            return Err(format!(
                "{} patches need more than {MAX_TRIANGLES} triangles",
                patches.len()
            ));
        }
        room(patch.bytes())?;
        flat &= patch.flat;
        append(&mut mesh, &patch);
    }
    if n.is_none() && flat {
        mesh.normals = None;
    }
    mesh.drop_degenerate();
    Ok(mesh)
}

/// Adds patches over the vertices of `mesh` to it: p00, p10, p01, p11, in range. Where two
/// triangles show all that is to be seen of a patch, they share its vertices. If texture
/// coordinates matter the mesh has them. `room` is asked for memory.
pub fn append_patches(
    mesh: &mut MeshData,
    patches: &[[u32; 4]],
    textured: bool,
    room: Room,
) -> Result<(), String> {
    let most_cells = most_cells(patches.len());
    let given = mesh.positions.len();
    let has_normals = mesh.normals.is_some();
    for &indices in patches {
        let vertices = Vertices {
            p: &mesh.positions[..given],
            n: mesh.normals.as_deref().filter(|_| has_normals),
            uv: mesh.uvs.as_deref(),
            textured,
        };
        let patch = vertices.patch(&indices, most_cells);
        if patch.flat && patch.cells == 1 {
            let [a, b, c, d] = indices;
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
            continue;
        }
        room(patch.bytes())?;
        // Zero stands for no normal.
        let normals = mesh.normals.get_or_insert_default();
        normals.resize(mesh.positions.len(), [0.0; 3]);
        append(mesh, &patch);
    }
    Ok(())
}

/// Adds a patch as a grid with vertices of its own.
fn append(mesh: &mut MeshData, patch: &Patch) {
    let cells = patch.cells;
    let first = mesh.positions.len() as u32;
    for row in 0..=cells {
        for column in 0..=cells {
            let (u, v) = (column as f64 / cells as f64, row as f64 / cells as f64);
            let shading =
                (patch.normal).map_or_else(|| patch.position.normal(u, v), |n| n.at(u, v));
            let position = patch.position.at(u, v);
            mesh.positions.push(position.as_vec3().into());
            if let Some(normals) = &mut mesh.normals {
                normals.push(shading.as_vec3().into());
            }
            if let Some(uvs) = &mut mesh.uvs {
                uvs.push(patch.texture.at(u, v).truncate().as_vec2().into());
            }
        }
    }
    let stride = cells + 1;
    for row in 0..cells {
        for column in 0..cells {
            let a = first + row * stride + column;
            let (b, c, d) = (a + 1, a + stride, a + stride + 1);
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [`bilinear_mesh_within`] any memory.
    fn bilinear_mesh(
        p: &[[f32; 3]],
        n: Option<&[[f32; 3]]>,
        uv: Option<&[[f32; 2]]>,
        indices: &[u32],
    ) -> Result<MeshData, String> {
        bilinear_mesh_within(p, n, uv, indices, &mut |_| Ok(()))
    }

    const SQUARE: [[f32; 3]; 4] = [
        [0.0, 0.0, 1.0],
        [2.0, 0.0, 1.0],
        [0.0, 2.0, 1.0],
        [2.0, 2.0, 1.0],
    ];

    fn triangle_normals(mesh: &MeshData) -> impl Iterator<Item = DVec3> {
        mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| DVec3::from(mesh.positions[v as usize].map(f64::from)));
            (b - a).cross(c - a) * 0.5
        })
    }

    #[test]
    fn a_parallelogram_is_two_triangles() {
        let mesh = bilinear_mesh(&SQUARE, None, None, &[0, 1, 2, 3]).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        assert_eq!(mesh.positions, SQUARE);
        assert_eq!(mesh.uvs.as_deref(), Some(&UNIT_SQUARE[..]));
        assert_eq!(mesh.normals, None);
        assert!(triangle_normals(&mesh).all(|n| n == DVec3::new(0.0, 0.0, 2.0)));
    }

    #[test]
    fn a_trapezoid_keeps_area_and_texture() {
        let p = [
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [2.0, 1.0, 0.0],
        ];
        let mesh = bilinear_mesh(&p, None, None, &[0, 1, 2, 3]).unwrap();
        assert!(mesh.triangles.len() > 2);
        let area: f64 = triangle_normals(&mesh).map(|n| n.z).sum();
        assert!((area - 2.5).abs() < 1e-5);
        // Where the texture coordinates are affine in the position, two triangles are exact.
        let uv = p.map(|p| [3.0 * p[0] + p[1], 0.5 - p[1]]);
        assert_eq!(
            bilinear_mesh(&p, None, Some(&uv), &[0, 1, 2, 3])
                .unwrap()
                .triangles
                .len(),
            2
        );
    }

    #[test]
    fn a_saddle_is_followed() {
        let p = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [1.0, 1.0, 0.0],
        ];
        let mesh = bilinear_mesh(&p, None, None, &[0, 1, 2, 3]).unwrap();
        let normals = mesh.normals.as_ref().unwrap();
        assert_eq!(normals.len(), mesh.positions.len());
        for (p, n) in mesh.positions.iter().zip(normals) {
            let [x, y, z] = p.map(f64::from);
            assert!((z - (x + y - 2.0 * x * y)).abs() < 1e-6);
            let expected = DVec3::new(2.0 * y - 1.0, 2.0 * x - 1.0, 1.0).normalize();
            assert!(DVec3::from(n.map(f64::from)).dot(expected) > 1.0 - 1e-6);
        }
        assert!(triangle_normals(&mesh).all(|n| n.z > 0.0));
    }

    #[test]
    fn mistakes_are_errors() {
        assert!(bilinear_mesh(&SQUARE, None, None, &[0, 1, 2]).is_err());
        assert!(bilinear_mesh(&SQUARE, None, None, &[0, 1, 2, 4]).is_err());
        assert!(bilinear_mesh(&SQUARE, Some(&[[0.0; 3]]), None, &[0, 1, 2, 3]).is_err());
        assert!(bilinear_mesh(&SQUARE, None, Some(&[]), &[0, 1, 2, 3]).is_err());
        let mesh = bilinear_mesh(&[[f32::NAN; 3]; 4], None, None, &[0, 1, 2, 3]).unwrap();
        assert!(mesh.triangles.is_empty() && !mesh.warnings.is_empty());
        let mesh = bilinear_mesh(&[[1.0; 3]; 4], None, None, &[0, 1, 2, 3]).unwrap();
        assert!(mesh.triangles.is_empty() && !mesh.warnings.is_empty());
    }
}
