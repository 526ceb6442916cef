//! Meshes read back, and files that are none.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::*;

fn load(bytes: &[u8]) -> Result<MeshData, String> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    let result = read_ply(file.path()).map(PlyMesh::into_triangles);
    if let Err(message) = &result {
        assert!(
            message.starts_with(&file.path().display().to_string()) && !message.contains('\n'),
            "{message}"
        );
    }
    result
}

fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a quad and a triangle\nelement vertex 5\nproperty float x\nproperty double y\n\
         property float z\nproperty uchar red\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float s\n\
         property float t\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\n\
         property list uchar short more\nelement edge 1\nproperty int a\nend_header\n"
    )
}

const POSITIONS: [[f32; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.5, 0.0],
    [0.0, 1.0, 0.0],
    [-1.0, 0.5, 2.0],
];

fn ascii() -> Vec<u8> {
    let mut text = header("ascii");
    for [x, y, z] in POSITIONS {
        text += &format!("{x} {y} {z} 255 0 0 1 {x} {y}\n");
    }
    text += "1 4 0 1 2 3 2 7 8\n\n0 3 0 3 4 0\n5\n";
    text.into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let mut out = header(if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    })
    .into_bytes();
    let mut put = |bytes: &[u8]| {
        if big {
            out.extend(bytes.iter().rev())
        } else {
            out.extend(bytes)
        }
    };
    for [x, y, z] in POSITIONS {
        put(&x.to_le_bytes());
        put(&f64::from(y).to_le_bytes());
        put(&z.to_le_bytes());
        put(&[255]);
        for v in [0.0, 0.0, 1.0, x, y] {
            put(&f32::to_le_bytes(v));
        }
    }
    for (indices, more) in [(&[0i32, 1, 2, 3][..], &[7i16, 8][..]), (&[0, 3, 4], &[])] {
        put(&[1]);
        put(&[indices.len() as u8]);
        indices.iter().for_each(|i| put(&i.to_le_bytes()));
        put(&[more.len() as u8]);
        more.iter().for_each(|i| put(&i.to_le_bytes()));
    }
    put(&5i32.to_le_bytes());
    out
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn all_encodings_agree() {
    let mesh = load(&ascii()).unwrap();
    assert_eq!(mesh.positions, POSITIONS);
    assert_eq!(mesh.normals, Some(vec![[0.0, 0.0, 1.0]; 5]));
    assert_eq!(mesh.uvs, Some(POSITIONS.map(|p| [p[0], p[1]]).to_vec()));
    assert_eq!(mesh.triangles, vec![[0, 3, 4], [0, 1, 2], [3, 0, 2]]);
    assert!(mesh.warnings.is_empty());
    for bytes in [
        binary(false),
        binary(true),
        gzip(&ascii()),
        gzip(&binary(true)),
    ] {
        assert_eq!(load(&bytes).unwrap(), mesh);
    }
}

#[test]
fn every_truncation_is_an_error() {
    for file in [ascii(), binary(false), binary(true), gzip(&binary(false))] {
        // Without its last byte an ASCII file is still whole.
        for length in 0..file.len() - 2 {
            assert!(load(&file[..length]).is_err(), "{length} of {}", file.len());
        }
    }
}

#[test]
fn flipped_bytes_do_not_panic() {
    for file in [ascii(), binary(false)] {
        for i in 0..file.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut damaged = file.clone();
                damaged[i] ^= flip;
                let _ = load(&damaged);
            }
        }
    }
}

fn small(format: &str, vertices: &str, faces: &str, list: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list {list} vertex_index\nend_header\n"
    )
}

#[test]
fn promises_the_file_cannot_keep() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces) in [
            ("1000000000000", "1"),
            ("3", "1000000000000"),
            ("3", "99999999999999999999999"),
            ("9000", "1"),
        ] {
            let text = small(format, vertices, faces, "uint int");
            assert!(load(text.as_bytes()).is_err());
            assert!(load(&gzip(text.as_bytes())).is_err());
        }
        // An element without properties takes no bytes.
        let text = small(format, "3", "1", "uint int")
            .replace("end_header", "element void 4000000000\nend_header");
        assert!(load(text.as_bytes()).is_err());
    }
    // A list of 2^32 - 1 indices.
    let mut file = small("binary_little_endian", "0", "1", "uint int").into_bytes();
    file.extend([0xff; 64]);
    assert!(load(&file).is_err());
}

#[test]
fn indices_and_polygons() {
    let with = |faces: &str| {
        load((small("ascii", "3", "1", "uchar int") + "0 0 0\n1 0 0\n0 1 0\n" + faces).as_bytes())
    };
    assert_eq!(with("3 0 1 2").unwrap().triangles, vec![[0, 1, 2]]);
    assert!(with("3 0 1 3").unwrap_err().contains("out of range"));
    assert!(with("3 0 1 -1").unwrap_err().contains("index -1"));
    assert!(with("2 0 1").unwrap().warnings[0].contains("fewer than 3"));
    assert!(with("3 0 0 1").unwrap().warnings[0].contains("without area"));
    assert!(
        with("3 0 1 x")
            .unwrap_err()
            .contains("line 13: face 0 of 1: \"vertex_index\": \"x\" is not")
    );
    assert!(with("-1 0 1 2").is_err());
}

/// Numbers as C prints and reads them; vertices that are none go with their triangles.
#[test]
fn numbers_of_other_programs() {
    let text = small("ascii", "5", "3", "uchar int")
        + ".0 -.0 0.\n+1 0 1e-400\n1E0 1.e+0 0\nnan 0 0\n0 -inf 0\n3 0 1 2\n3 0 1 3\n3 0 1 4\n";
    let mesh = load(text.as_bytes()).unwrap();
    assert_eq!(
        mesh.positions[..3],
        [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    );
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    let told = "2 triangles with vertices that are not finite dropped";
    assert_eq!(mesh.warnings, [told]);
}

#[test]
fn headers_are_of_bounded_length_and_any_encoding() {
    let text = small("ascii", "3", "1", "uchar int") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let with = |line: &[u8]| {
        let mut bytes = text.clone().into_bytes();
        bytes.splice(4..4, [b"comment ", line, b"\n"].concat());
        load(&bytes)
    };
    // Latin-1.
    assert_eq!(with(b"caf\xe9").unwrap().triangles.len(), 1);
    let error = with(&vec![b'x'; 2 << 20]).unwrap_err();
    assert!(error.contains("too long"), "{error}");
    assert!(
        load(b"ply\nformat ascii 1.0\n")
            .unwrap_err()
            .contains("truncated")
    );
}

/// Indices written as floats, which only some are.
#[test]
fn indices_that_are_no_integers() {
    for (index, good) in [
        (2.0f32, true),
        (1.5, false),
        (f32::NAN, false),
        (4.3e9, false),
        (-1.0, false),
    ] {
        let mut file = small("binary_little_endian", "3", "1", "uchar float").into_bytes();
        for v in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            file.extend(v.to_le_bytes());
        }
        file.push(3);
        [0.0, 1.0, index]
            .iter()
            .for_each(|v| file.extend(v.to_le_bytes()));
        assert_eq!(load(&file).is_ok(), good, "{index}");
    }
}

#[test]
fn nothing_is_no_mesh() {
    for (vertices, faces, missing) in [("0", "1", "vertex"), ("1", "0", "face")] {
        let text = small("ascii", vertices, faces, "uchar int") + "0 0 0\n";
        let error = load(text.as_bytes()).unwrap_err();
        assert!(
            error.contains(&format!("no elements \"{missing}\"")),
            "{error}"
        );
    }
}

#[test]
fn polygons_are_fans() {
    let text = small("ascii", "5", "2", "uchar int")
        + "0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 1 0\n5 0 1 2 3 4\n3 0 1 2\n";
    let mesh = load(text.as_bytes()).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2]]);
    let told = "1 faces with more than 4 vertices made into triangles; pbrt leaves them out";
    assert_eq!(mesh.warnings, [told]);
}

#[test]
fn missing_parts() {
    assert!(load(b"").is_err());
    assert!(load(b"solid stl\n").is_err());
    assert!(
        load(b"ply\nformat ascii 1.0\nend_header\n")
            .unwrap_err()
            .contains("vertex")
    );
    assert!(
        load(b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n")
            .unwrap_err()
            .contains("x, y, z")
    );
    let text = small("ascii", "1", "0", "uchar int").replace("vertex_index", "other") + "0 0 0\n";
    assert!(
        load(text.as_bytes())
            .unwrap_err()
            .contains("vertex_indices")
    );
    assert!(
        read_ply(Path::new("/missing/a.ply"))
            .unwrap_err()
            .starts_with("/missing/a.ply: ")
    );
}
