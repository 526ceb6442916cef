//! PLY meshes.

use std::path::Path;

use super::shapes::MeshData;

/// Reads an ASCII or binary PLY file, perhaps gzipped.
pub fn read_ply(path: &Path) -> Result<MeshData, String> {
    std::fs::metadata(path).map_err(|e| e.to_string())?;
    Ok(MeshData {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    })
}
