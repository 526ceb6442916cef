//! pbrt-v4's bilinear patches as triangles.
//!
//! A patch is `p(u, v) = (1-u)(1-v) p00 + u (1-v) p10 + (1-u) v p01 + u v p11`. Where position, normal and texture coordinates are
//! all affine in one another two triangles are exact; elsewhere a grid approximates the patch.

use glam::{DVec2, DVec3};

use super::{MAX_TRIANGLES, MeshData};

/// A grid follows a curved patch to this fraction of its size.
const TOLERANCE: f64 = 1e-4;
/// Cells along a side of a patch that is not affine: at least enough to carry a texture, at most a bound on memory.
const CELLS: [f64; 2] = [8.0, 64.0];
/// Cells of all patches of one mesh that are aimed at; many small patches need fewer each.
const CELL_BUDGET: f64 = (1u32 << 23) as f64;
/// Relative deviation from a plane quadrilateral that is taken as rounding of the file's numbers.
const AFFINE: f64 = 1e-5;

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

    /// `(s, t)` with `p11 = p00 + s (p10 - p00) + t (p01 - p00)` if the corners are coplanar and convex: (1, 1) for a
    /// parallelogram.
    fn planar(&self) -> Option<(f64, f64)> {
        let [a, b, c, d] = self.0;
        let (x, y, z) = (b - a, c - a, d - a);
        let normal = x.cross(y);
        let area = normal.length_squared();
        let (s, t) = (z.cross(y).dot(normal) / area, x.cross(z).dot(normal) / area);
        let convex = s > 0.0 && t > 0.0 && s + t > 1.0;
        (convex && self.follows((s, t), self.extent())).then_some((s, t))
    }

    /// Whether the triangles' interpolation of this attribute is that of one affine map over the whole patch.
    fn follows(&self, (s, t): (f64, f64), scale: f64) -> bool {
        let [a, b, c, d] = self.0;
        (a + s * (b - a) + t * (c - a) - d).length() <= AFFINE * scale
    }

    /// `dp/du x dp/dv`, the front of the patch.
    fn normal(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c, d] = self.0;
        let du = (b - a).lerp(d - c, v);
        let dv = (c - a).lerp(d - b, u);
        du.cross(dv).normalize_or_zero()
    }
}

/// Patches of four indices each: vertices p00, p10, p01, p11. Without `uv` every patch covers the unit square. The front is
/// pbrt's, `cross(dp/du, dp/dv)`; given normals are passed on and do not turn it.
pub fn bilinear_mesh(
    p: &[[f32; 3]],
    n: Option<&[[f32; 3]]>,
    uv: Option<&[[f32; 2]]>,
    indices: &[u32],
) -> Result<MeshData, String> {
    if !indices.len().is_multiple_of(4) {
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

    let patches = indices.len() / 4;
    let most_cells = (CELL_BUDGET / patches.max(1) as f64)
        .sqrt()
        .clamp(1.0, CELLS[1])
        .floor();
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..Default::default()
    };
    let mut flat = true;
    for patch in indices.chunks_exact(4) {
        let corner = |i: usize| patch[i] as usize;
        let position = Corners(std::array::from_fn(|i| p[corner(i)].map(f64::from).into()));
        let normal =
            n.map(|n| Corners(std::array::from_fn(|i| n[corner(i)].map(f64::from).into())));
        let texture = Corners(std::array::from_fn(|i| {
            let [u, v] = uv.map_or(UNIT_SQUARE[i], |uv| uv[corner(i)]).map(f64::from);
            DVec2::new(u, v).extend(0.0)
        }));

        let affine = position.planar().is_some_and(|st| {
            texture.follows(st, texture.extent()) && normal.is_none_or(|n| n.follows(st, n.reach()))
        });
        let cells = if affine {
            1
        } else {
            cells(&position, most_cells)
        };
        if (mesh.triangles.len() + 2 * cells * cells) as u64 > MAX_TRIANGLES {
            return Err(format!(
                "{patches} patches need more than {MAX_TRIANGLES} triangles"
            ));
        }
        flat &= affine;
        append(&mut mesh, position, normal, texture, cells as u32);
    }
    if n.is_none() && flat {
        mesh.normals = None;
    }
    mesh.drop_degenerate();
    Ok(mesh)
}

fn cells(position: &Corners, most: f64) -> usize {
    // A cell of side 1 / n deviates from its triangles by at most |twist| / (4 n^2).
    let n = (position.twist().length() / (4.0 * TOLERANCE * position.extent())).sqrt();
    // NaN (a patch without size) becomes 0 and then the least.
    (n.max(0.0).ceil().max(CELLS[0]).min(most)) as usize
}

fn append(
    mesh: &mut MeshData,
    position: Corners,
    normal: Option<Corners>,
    texture: Corners,
    cells: u32,
) {
    let first = mesh.positions.len() as u32;
    let uvs = mesh.uvs.get_or_insert_default();
    let normals = mesh.normals.get_or_insert_default();
    for row in 0..=cells {
        for column in 0..=cells {
            let (u, v) = (column as f64 / cells as f64, row as f64 / cells as f64);
            let shading = normal.map_or_else(|| position.normal(u, v), |n| n.at(u, v));
            mesh.positions.push(position.at(u, v).as_vec3().into());
            normals.push(shading.as_vec3().into());
            uvs.push(texture.at(u, v).truncate().as_vec2().into());
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
