//! A PLY file becomes a mesh that is whole, or is refused with a message of one line.

use phalanx::pbrt::ply::{PlyMesh, read_ply};

use super::files;

pub fn check(data: &[u8]) {
    files::with_file("input.ply", data, |path| {
        match read_ply(path).map(PlyMesh::into_triangles) {
            Ok(mesh) => {
                let vertices = mesh.positions.len();
                let indices = mesh.triangles.iter().flatten();
                assert!(indices.into_iter().all(|&i| (i as usize) < vertices));
                assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
                if let Some(normals) = &mesh.normals {
                    assert!(normals.len() == vertices);
                    assert!(normals.iter().flatten().all(|x| x.is_finite()));
                }
                if let Some(uvs) = &mesh.uvs {
                    assert!(uvs.len() == vertices);
                    assert!(uvs.iter().flatten().all(|x| x.is_finite()));
                }
            }
            Err(message) => {
                assert!(message.contains("input.ply: "), "{message:?}");
                assert!(!message.contains('\n'), "{message:?}");
            }
        }
    });
}
