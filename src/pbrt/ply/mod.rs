//! Meshes from PLY files: ASCII or binary of either byte order, plain or gzip.
//!
//! `ply-rs-bw` reads the header and single elements of binary files; the loop over the elements is
//! here, so that vertices and faces go straight into the mesh and the counts in the header are
//! judged before anything is allocated. A file cannot hold more elements than bytes, and deflate
//! expands no more than 1032 times. Elements of ASCII files are read by `ascii`, which takes
//! numbers that the crate does not.

mod ascii;
mod body;
mod elements;
mod header;
#[cfg(test)]
mod properties;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use ply_rs_bw::ply::{Header, PropertyType};

use self::body::{Lines, each};
use self::elements::{Face, Skipped, Vertex};
use self::header::{check_counts, read_header};
use super::mesh::{MeshData, Room};
use crate::formats::file_bytes;

const DEFLATE_RATIO: u64 = 1032;
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
    /// With each quad as the two triangles that pbrt-v3 makes of it; where there are no texture
    /// coordinates, they depend on which corner comes first.
    pub fn into_triangles(mut self) -> MeshData {
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [d, a, c]];
        let triangles = self.quads.into_iter().flat_map(halves);
        self.mesh.triangles.extend(triangles);
        self.mesh.drop_degenerate();
        self.mesh
    }
}

/// Reads the `vertex` and `face` elements. Normals and texture coordinates are read where all their
/// components are there; other elements and properties are skipped.
pub fn read_ply(path: &Path) -> Result<PlyMesh, String> {
    read_ply_within(path, &mut |_| Ok(()))
}

/// [`read_ply`]; `room` is asked for memory, in bytes, beyond what [`bytes_needed`] foresees.
pub fn read_ply_within(path: &Path, room: Room) -> Result<PlyMesh, String> {
    let mesh = open(path).and_then(|(reader, bytes)| read(reader, bytes, room));
    mesh.map_err(|message| one_line(path, &message))
}

/// Memory that [`read_ply`] will take, in bytes, by the counts in the header, and faces of three or
/// four corners.
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

/// What vertices have beside positions.
struct Fields {
    normals: bool,
    uvs: bool,
}

/// Looks whether the file has all that a mesh must have.
fn fields_of(header: &Header) -> Result<Fields, String> {
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
    Ok(Fields {
        normals: has(3..6),
        uvs: has(6..8),
    })
}

fn read(mut source: Box<dyn BufRead>, bytes: u64, room: Room) -> Result<PlyMesh, String> {
    let (header, lines) = read_header(&mut source)?;
    check_counts(&header, bytes)?;
    let mut reader = Lines {
        source,
        line: String::new(),
        number: lines,
    };

    let has = fields_of(&header)?;
    let mut mesh = MeshData {
        normals: has.normals.then(Vec::new),
        uvs: has.uvs.then(Vec::new),
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

    check_indices(&mesh, &quads)?;
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

fn check_indices(mesh: &MeshData, quads: &[[u32; 4]]) -> Result<(), String> {
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
    Ok(())
}
