//! Properties of the reader over generated files.

use std::io::Cursor;

use proptest::prelude::*;

use super::*;

fn load(bytes: Vec<u8>) -> Result<MeshData, String> {
    let length = bytes.len() as u64;
    let mesh = read(Box::new(Cursor::new(bytes)), length, &mut |_| Ok(()));
    mesh.map(PlyMesh::into_triangles)
}

/// Vertices of any bits, NaN among them, and triangles between them.
fn mesh() -> impl Strategy<Value = MeshData> {
    let float = || {
        prop_oneof![
            prop::num::f32::ANY,
            prop::sample::select(vec![0.0, 1.0, -0.5])
        ]
    };
    let vertex = (
        prop::array::uniform3(float()),
        prop::array::uniform3(float()),
        prop::array::uniform2(float()),
    );
    let vertices = prop::collection::vec(vertex, 1..8);
    let index = any::<prop::sample::Index>();
    let triangles = prop::collection::vec(prop::array::uniform3(index), 1..8);
    (vertices, triangles, any::<[bool; 2]>()).prop_map(|(vertices, triangles, has)| MeshData {
        positions: vertices.iter().map(|v| v.0).collect(),
        normals: has[0].then(|| vertices.iter().map(|v| v.1).collect()),
        uvs: has[1].then(|| vertices.iter().map(|v| v.2).collect()),
        triangles: triangles
            .iter()
            .map(|t| t.map(|i| i.index(vertices.len()) as u32))
            .collect(),
        warnings: Vec::new(),
    })
}

fn write(mesh: &MeshData, format: &str) -> Vec<u8> {
    let mut names = vec!["x", "y", "z"];
    names.extend(mesh.normals.iter().flat_map(|_| ["nx", "ny", "nz"]));
    names.extend(mesh.uvs.iter().flat_map(|_| ["u", "v"]));
    let properties: String = names
        .iter()
        .map(|n| format!("property float {n}\n"))
        .collect();
    let mut out = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    let mut put = |bytes: &[u8], text: String| match format {
        "ascii" => out.extend((text + " ").bytes()),
        "binary_little_endian" => out.extend(bytes),
        _ => out.extend(bytes.iter().rev()),
    };
    for i in 0..mesh.positions.len() {
        let mut values = mesh.positions[i].to_vec();
        values.extend(mesh.normals.iter().flat_map(|n| n[i]));
        values.extend(mesh.uvs.iter().flat_map(|uv| uv[i]));
        for v in values {
            put(&v.to_le_bytes(), v.to_string());
        }
        put(&[], "\n".into());
    }
    for triangle in &mesh.triangles {
        put(&[3], "3".into());
        for v in triangle {
            put(&v.to_le_bytes(), v.to_string());
        }
        put(&[], "\n".into());
    }
    out
}

const FORMATS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

proptest! {
    #![proptest_config(crate::property::cases(300))]

    /// What was written is read back, in every encoding, less what no mesh may have.
    #[test]
    fn meshes_survive_the_round_trip(mesh in mesh()) {
        let mut expected = mesh.clone();
        expected.drop_degenerate();
        for format in FORMATS {
            let read = load(write(&mesh, format));
            prop_assert_eq!(read.as_ref(), Ok(&expected), "{}", format);
        }
    }

    /// Files with bytes replaced, or cut short, become meshes that are whole, or are refused.
    #[test]
    fn mutated_files_are_whole_or_refused(
        mesh in mesh(),
        format in prop::sample::select(FORMATS.to_vec()),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = write(&mesh, format);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(mesh) = load(bytes) {
            let vertices = mesh.positions.len();
            prop_assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
            prop_assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < vertices));
            prop_assert!(mesh.normals.is_none_or(|n| n.len() == vertices));
            prop_assert!(mesh.uvs.is_none_or(|uv| uv.len() == vertices));
        }
    }
}
