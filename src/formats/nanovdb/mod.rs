//! Volumes in NanoVDB files, version 32: sparse trees of numbers, read into a dense box.
//!
//! 1. `segments` finds a grid by its name and unpacks it: stored, zlib, or Blosc with LZ4
//!    ([`blosc`]).
//! 2. The grid's header says what its numbers are, and where.
//! 3. `tree` walks its tree.
//!
//! Everything that a file says of sizes and places is checked before it is allocated or followed.
//! The layout is that of `NanoVDB.h` of OpenVDB (Museth 2021, "NanoVDB: a GPU-friendly and portable
//! VDB data structure"); no living crate reads it.

pub mod blosc;
mod bytes;
mod segments;
mod tree;

use std::fs::File;
use std::path::Path;

use self::bytes::{GRID_HEADER, beside, f64s_at, slice, u32_at};
use self::tree::{Tree, Voxels};
use super::file_bytes;

/// Most voxels along a side.
const MOST_VOXELS: i64 = 1 << 14;

pub use self::bytes::Room;

/// A grid of numbers: all voxels that are active, and one more at each side.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatGrid {
    /// Voxels' indices to the file's world: three rows of a 3x4 matrix.
    pub to_world: [[f64; 4]; 3],
    /// The file's bounds of what is active, in its world: from the lowest voxel to the one after
    /// the highest.
    pub bounds: [[f64; 3]; 2],
    /// Index of the lowest voxel of [`Self::values`].
    pub low: [i64; 3],
    /// Voxels along each side.
    pub size: [u32; 3],
    /// x goes fastest, then y, then z. They may be anything.
    pub values: Vec<f32>,
    /// Value of all that is not in the tree.
    pub background: f32,
}

/// Reads the grid of this name, if the file has one. `room` is asked for memory before it is taken.
///
/// # Errors
/// It is no such file, it is broken, or its grid is none of densities.
pub fn read(path: &Path, name: &str, room: Room) -> Result<Option<FloatGrid>, String> {
    let length = file_bytes(path)?;
    let mut file = File::open(path).map_err(|e| e.to_string())?;
    let grid = segments::find(&mut file, length, name, room)?;
    grid.map(|bytes| parse(&bytes, room)).transpose()
}

/// Of a grid that is not packed.
fn parse(bytes: &[u8], room: Room) -> Result<FloatGrid, String> {
    let head = slice(bytes, 0, GRID_HEADER + 64)?;
    if !matches!(&head[..8], b"NanoVDB0" | b"NanoVDB1") {
        return Err("it has a grid that does not begin as one".into());
    }
    segments::check_version(u32_at(head, 16)?)?;
    let (class, kind) = (u32_at(head, 632)?, u32_at(head, 636)?);
    if !matches!(class, 0 | 2) {
        return Err(format!(
            "its grid is of class {class}, not a fog volume (2) or unknown (0)"
        ));
    }
    if kind != 1 {
        return Err(format!(
            "the values of its grid are of type {kind}; only float (1) is supported"
        ));
    }
    // Of the map from voxels to the world its copies in double precision count.
    let matrix = f64s_at::<9>(head, 296 + 88)?;
    let offset = f64s_at::<3>(head, 296 + 88 + 144)?;
    let to_world = [0, 1, 2].map(|row| {
        let m = &matrix[3 * row..];
        [m[0], m[1], m[2], offset[row]]
    });
    let [a, b, c, d, e, f] = f64s_at::<6>(head, 560)?;
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    if !finite(&[a, b, c, d, e, f]) || !finite(to_world.as_flattened()) {
        return Err("the place of its grid is not a number".into());
    }
    let root = i64::from_le_bytes(bytes::array(head, GRID_HEADER + 24)?);
    let tree = Tree::new(bytes, beside(GRID_HEADER, root)?)?;
    let [low, high] = tree.active.map(|v| v.map(i64::from));
    let mut size = [0; 3];
    for k in 0..3 {
        let voxels = high[k] - low[k] + 3;
        if !(3..=MOST_VOXELS).contains(&voxels) {
            return Err(match voxels {
                ..3 => "no voxel of its grid is active".into(),
                _ => format!("its grid is {voxels} voxels wide; {MOST_VOXELS} are supported"),
            });
        }
        size[k] = voxels as u32;
    }
    let count = size.iter().map(|n| u64::from(*n)).product::<u64>();
    let [x, y, z] = size;
    room(4 * count).map_err(|e| format!("its grid of {x} x {y} x {z} voxels {e}"))?;
    let mut values = vec![0.0; count as usize];
    let low = low.map(|v| v - 1);
    tree.fill(&mut Voxels {
        low,
        size,
        values: &mut values,
    })?;
    Ok(FloatGrid {
        to_world,
        bounds: [[a, b, c], [d, e, f]],
        low,
        size,
        values,
        background: tree.background,
    })
}
