//! Meshes from PLY files: ASCII or binary of either byte order, plain or gzip.
//!
//! `ply-rs-bw` reads the header and single elements of binary files; the loop over the elements is here, so that vertices and faces go
//! straight into the mesh and the counts in the header are judged before anything is allocated. A file cannot hold more elements
//! than bytes, and deflate expands no more than 1032 times. Elements of ASCII files are read by `ascii`, which takes numbers that the
//! crate does not.

mod ascii;
#[cfg(test)]
mod properties;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    BeginList, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyType,
    ScalarType,
};

use super::shapes::{MeshData, Room};
use crate::formats::file_bytes;

const DEFLATE_RATIO: u64 = 1032;
/// Longest header that is read.
const MAX_HEADER: u64 = 1 << 20;
/// Longest line of an ASCII file, and longest element of a binary one, that is read: polygons do not have a million corners.
const MAX_LINE: u64 = 1 << 22;
/// Longest error message passed on.
const MAX_MESSAGE: usize = 200;

/// What a file holds, as it stands there: vertices may be anything but missing.
#[derive(Debug, Default, PartialEq)]
pub struct PlyMesh {
    /// The triangles, and fans for polygons of more than four corners.
    pub mesh: MeshData,
    /// Faces of four corners, in the order of the file: around the face.
    pub quads: Vec<[u32; 4]>,
}

impl PlyMesh {
    /// With each quad as the two triangles that pbrt-v3 makes of it; where there are no texture coordinates, they depend on which
    /// corner comes first.
    pub fn into_triangles(mut self) -> MeshData {
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [d, a, c]];
        let triangles = self.quads.into_iter().flat_map(halves);
        self.mesh.triangles.extend(triangles);
        self.mesh.drop_degenerate();
        self.mesh
    }
}

/// Reads the `vertex` and `face` elements. Normals and texture coordinates are read where all their components are there; other
/// elements and properties are skipped.
pub fn read_ply(path: &Path) -> Result<PlyMesh, String> {
    read_ply_within(path, &mut |_| Ok(()))
}

/// [`read_ply`]; `room` is asked for memory, in bytes, beyond what [`bytes_needed`] foresees.
pub fn read_ply_within(path: &Path, room: Room) -> Result<PlyMesh, String> {
    let mesh = open(path).and_then(|(reader, bytes)| read(reader, bytes, room));
    mesh.map_err(|message| one_line(path, &message))
}

/// Memory that [`read_ply`] will take, in bytes, by the counts in the header, and faces of three or four corners.
pub fn bytes_needed(path: &Path) -> Result<u64, String> {
    let header = open(path).and_then(|(mut source, bytes)| {
        let (header, _) = read_header(&mut source)?;
        check_counts(&header, bytes).map(|()| header)
    });
    let header = header.map_err(|message| one_line(path, &message))?;
    let count = |name: &str| header.elements.get(name).map_or(0, |e| e.count as u64);
    let vertex = size_of::<[f32; 8]>() as u64;
    let face = size_of::<[[u32; 3]; 2]>() as u64;
    Ok((count("vertex").saturating_mul(vertex)).saturating_add(count("face").saturating_mul(face)))
}

fn one_line(path: &Path, message: &str) -> String {
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    let short: String = message.chars().take(MAX_MESSAGE).collect();
    format!("{}: {short}", path.display())
}

/// The file, unpacked by its content, with a bound on its unpacked length.
fn open(path: &Path) -> Result<(Box<dyn BufRead>, u64), String> {
    let bytes = file_bytes(path)?;
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut reader = BufReader::with_capacity(1 << 16, file);
    if reader
        .fill_buf()
        .map_err(|e| e.to_string())?
        .starts_with(&[0x1f, 0x8b])
    {
        let unpacked = BufReader::with_capacity(1 << 16, MultiGzDecoder::new(reader));
        return Ok((Box::new(unpacked), bytes.saturating_mul(DEFLATE_RATIO)));
    }
    Ok((Box::new(reader), bytes))
}

fn read(mut source: Box<dyn BufRead>, bytes: u64, room: Room) -> Result<PlyMesh, String> {
    let (header, lines) = read_header(&mut source)?;
    check_counts(&header, bytes)?;
    let mut reader = Lines {
        source,
        line: String::new(),
        number: lines,
    };

    let properties = |name: &str| header.elements.get(name).map(|e| &e.properties);
    let vertex = properties("vertex").ok_or("no element \"vertex\"")?;
    let has = |slots: std::ops::Range<usize>| {
        slots.into_iter().all(|slot| {
            vertex.iter().any(|(name, p)| {
                matches!(p.data_type, PropertyType::Scalar(_)) && Vertex::slot(name) == Some(slot)
            })
        })
    };
    if !has(0..3) {
        return Err("vertices without x, y, z".into());
    }
    let face = properties("face").ok_or("no element \"face\"")?;
    if !face
        .iter()
        .any(|(name, p)| Face::is_indices(name) && matches!(p.data_type, PropertyType::List(..)))
    {
        return Err("faces without a list \"vertex_indices\"".into());
    }

    for name in ["vertex", "face"] {
        if header.elements.get(name).is_some_and(|e| e.count == 0) {
            return Err(format!("the file has no elements \"{name}\""));
        }
    }

    let mut mesh = MeshData {
        normals: has(3..6).then(Vec::new),
        uvs: has(6..8).then(Vec::new),
        ..Default::default()
    };
    let mut quads = Vec::new();
    let (mut skipped, mut fans) = (0usize, 0usize);
    let mut foreseen = 2 * header.elements["face"].count as u64;
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => each(&mut reader, &header, element, |v: Vertex| {
                let [x, y, z, nx, ny, nz, u, v] = v.0;
                mesh.positions.push([x, y, z]);
                if let Some(normals) = &mut mesh.normals {
                    normals.push([nx, ny, nz]);
                }
                if let Some(uvs) = &mut mesh.uvs {
                    uvs.push([u, v]);
                }
                Ok(())
            })?,
            "face" => each(&mut reader, &header, element, |face: Face| {
                match *face.0 {
                    [] | [_] | [_, _] => skipped += 1,
                    [a, b, c, d] => quads.push([a, b, c, d]),
                    [first, ref rest @ ..] => {
                        let triangles = (mesh.triangles.len() + rest.len()) as u64;
                        if triangles > foreseen {
                            // The table grows by doubling.
                            let more = foreseen.max(triangles);
                            room(more * size_of::<[u32; 3]>() as u64)?;
                            foreseen += more;
                        }
                        fans += usize::from(rest.len() > 3);
                        let edges = rest.windows(2);
                        (mesh.triangles).extend(edges.map(|edge| [first, edge[0], edge[1]]));
                    }
                }
                Ok(())
            })?,
            _ => each(&mut reader, &header, element, |_: Skipped| Ok(()))?,
        }
    }

    // The check sum of a gzip file is compared at its end only.
    reader.source.fill_buf().map_err(|e| e.to_string())?;

    let vertices = mesh.positions.len();
    if let Some(bad) = mesh
        .triangles
        .iter()
        .flatten()
        .chain(quads.iter().flatten())
        .find(|&&v| v as usize >= vertices)
    {
        return Err(format!(
            "face index {} is out of range, there are {vertices} vertices",
            *bad as i32
        ));
    }
    if skipped > 0 {
        mesh.warnings.push(format!(
            "{skipped} faces with fewer than 3 vertices dropped"
        ));
    }
    if fans > 0 {
        mesh.warnings.push(format!(
            "{fans} faces with more than 4 vertices made into triangles; pbrt leaves them out"
        ));
    }
    Ok(PlyMesh { mesh, quads })
}

/// The header, and how many lines it has. The text is cut out first: the crate would read a line of any length, and refuse comments that
/// are not UTF-8.
fn read_header(source: &mut dyn BufRead) -> Result<(Header, usize), String> {
    let mut text = Vec::new();
    let mut lines = 0;
    loop {
        let start = text.len();
        let mut rest = source.take(MAX_HEADER - start as u64);
        rest.read_until(b'\n', &mut text)
            .map_err(|e| e.to_string())?;
        lines += 1;
        match text[start..].trim_ascii() {
            b"end_header" => break,
            magic if lines == 1 && magic != b"ply" => return Err("not a PLY file".into()),
            _ if text.len() as u64 == MAX_HEADER => return Err("the header is too long".into()),
            _ if text.len() == start => return Err("the header has no end: truncated?".into()),
            _ => {}
        }
    }
    let text = String::from_utf8_lossy(&text);
    let mut reader = Reader::new(text.as_bytes());
    let header = Parser::<Vertex>::new().read_header(&mut reader);
    Ok((header.map_err(|e| e.to_string())?, lines))
}

/// Rejects headers whose elements cannot fit into the file.
fn check_counts(header: &Header, bytes: u64) -> Result<(), String> {
    let size = |t: &ScalarType| match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let mut least = 0u64;
    for element in header.elements.values() {
        let each: u64 = match header.encoding {
            // A digit and a separator for every property, a line end for an element without.
            Encoding::Ascii => (2 * element.properties.len() as u64).max(1),
            _ => element
                .properties
                .values()
                .map(|p| match &p.data_type {
                    PropertyType::Scalar(t) | PropertyType::List(t, _) => size(t),
                })
                .sum(),
        };
        if element.count > u32::MAX as usize {
            return Err(format!(
                "{} elements {:?} are too many",
                element.count, element.name
            ));
        }
        least = least.saturating_add(each.saturating_mul(element.count as u64));
    }
    // The last line of an ASCII file may lack its end.
    if least > bytes.saturating_add(1) {
        return Err(format!(
            "the header promises at least {least} bytes of elements, the file cannot hold more than {bytes}: truncated?"
        ));
    }
    Ok(())
}

/// What follows the header.
struct Lines {
    source: Box<dyn BufRead>,
    line: String,
    /// Lines read so far, those of the header included.
    number: usize,
}

impl Lines {
    /// Reads the next line that is not empty.
    fn next(&mut self) -> Result<&str, String> {
        loop {
            self.line.clear();
            self.number += 1;
            match (&mut self.source).take(MAX_LINE).read_line(&mut self.line) {
                Ok(0) => return Err("the file ends: truncated?".into()),
                Ok(n) if n as u64 == MAX_LINE => return Err("line too long".into()),
                Ok(_) if self.line.trim().is_empty() => continue,
                Ok(_) => return Ok(&self.line),
                Err(e) => return Err(e.to_string()),
            }
        }
    }
}

/// Calls `f` with every element of one kind.
fn each<E: PropertyAccess>(
    reader: &mut Lines,
    header: &Header,
    element: &ElementDef,
    mut f: impl FnMut(E) -> Result<(), String>,
) -> Result<(), String> {
    let parser = Parser::<E>::new();
    if element.properties.is_empty() && header.encoding != Encoding::Ascii {
        return Ok(());
    }
    let has_lists =
        (element.properties.values()).any(|p| matches!(p.data_type, PropertyType::List(..)));
    let most = if has_lists { MAX_LINE } else { u64::MAX };
    for i in 0..element.count {
        let source = &mut *reader.source;
        let parsed = match header.encoding {
            Encoding::Ascii => reader.next().and_then(|line| ascii::element(line, element)),
            encoding => {
                let mut source = source.take(most);
                let read = match encoding {
                    Encoding::BinaryLittleEndian => {
                        parser.read_little_endian_element(&mut source, element)
                    }
                    _ => parser.read_big_endian_element(&mut source, element),
                };
                read.map_err(|e| match source.limit() {
                    0 => format!("longer than {most} bytes"),
                    _ => e.to_string(),
                })
            }
        };
        let read = parsed.map_err(|message| {
            let place = format!("{} {i} of {}", element.name, element.count);
            match header.encoding {
                Encoding::Ascii => format!("line {}: {place}: {message}", reader.number),
                _ => format!("{place}: {message}"),
            }
        })?;
        f(read)?;
    }
    Ok(())
}

/// x y z, nx ny nz, u v.
struct Vertex([f32; 8]);

impl Vertex {
    fn slot(name: &str) -> Option<usize> {
        Some(match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "nx" => 3,
            "ny" => 4,
            "nz" => 5,
            "u" | "s" | "texture_u" | "texture_s" => 6,
            "v" | "t" | "texture_v" | "texture_t" => 7,
            _ => return None,
        })
    }

    fn set(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        if let Some(slot) = Self::slot(name) {
            self.0[slot] = value;
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex([0.0; 8])
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
}

/// Vertex indices; a negative one wraps to a number no mesh reaches.
struct Face(Vec<u32>);

impl Face {
    fn is_indices(name: &str) -> bool {
        matches!(name, "vertex_indices" | "vertex_index")
    }

    fn set<T>(
        &mut self,
        name: &str,
        list: Vec<T>,
        index: impl Fn(T) -> u32,
    ) -> PropertyAccessResult {
        if Self::is_indices(name) {
            self.0 = list.into_iter().map(index).collect();
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Face(Vec::new())
    }
    fn begin_list_uint(&mut self, name: &str, _length: usize) -> BeginList<'_, u32> {
        if Self::is_indices(name) {
            BeginList::Fill(&mut self.0)
        } else {
            BeginList::UseSetter
        }
    }
    fn set_list_int(&mut self, name: &str, list: Vec<i32>) -> PropertyAccessResult {
        self.set(name, list, |v| v as u32)
    }
    fn set_list_char(&mut self, name: &str, list: Vec<i8>) -> PropertyAccessResult {
        self.set(name, list, |v| v as i32 as u32)
    }
    fn set_list_uchar(&mut self, name: &str, list: Vec<u8>) -> PropertyAccessResult {
        self.set(name, list, u32::from)
    }
    fn set_list_short(&mut self, name: &str, list: Vec<i16>) -> PropertyAccessResult {
        self.set(name, list, |v| v as i32 as u32)
    }
    fn set_list_ushort(&mut self, name: &str, list: Vec<u16>) -> PropertyAccessResult {
        self.set(name, list, u32::from)
    }
    fn set_list_float(&mut self, name: &str, list: Vec<f32>) -> PropertyAccessResult {
        self.set(name, list, |v| whole(v.into()))
    }
    fn set_list_double(&mut self, name: &str, list: Vec<f64>) -> PropertyAccessResult {
        self.set(name, list, whole)
    }
}

/// An index that was written as a float; what is none becomes a number no mesh reaches.
fn whole(v: f64) -> u32 {
    if v.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(u32::MAX)).contains(&v) {
        v as i64 as u32
    } else {
        u32::MAX
    }
}

struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Skipped
    }
}

#[cfg(test)]
mod tests {
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
            load(
                (small("ascii", "3", "1", "uchar int") + "0 0 0\n1 0 0\n0 1 0\n" + faces)
                    .as_bytes(),
            )
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
        let text =
            small("ascii", "1", "0", "uchar int").replace("vertex_index", "other") + "0 0 0\n";
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
}
