//! Writes NanoVDB files: what the reader is tested with.

use std::collections::BTreeMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// How a grid is packed in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Codec {
    Stored,
    Zlib,
    /// Shuffled, in blocks of so many bytes; LZ4 of literals alone.
    Blosc(usize),
}

/// A grid, by leaves of 8 voxels a side and by cubes of one value.
#[derive(Clone, Debug)]
pub struct Grid {
    pub name: &'static str,
    /// 0 is unknown, 2 fog.
    pub class: u32,
    /// 1 is float.
    pub kind: u32,
    /// Voxels to the world, in rows.
    pub matrix: [[f64; 3]; 3],
    pub offset: [f64; 3],
    /// Lowest and highest voxels that are active.
    pub active: [[i32; 3]; 2],
    pub background: f32,
    /// Lowest voxels, and values: z goes fastest.
    pub leaves: Vec<([i32; 3], Vec<f32>)>,
    /// Lowest voxels, sides (2^3, 2^7 or 2^12), values.
    pub cubes: Vec<([i32; 3], u32, f32)>,
}

impl Grid {
    /// One whose voxels from `low` on have these values, x fastest, and lie in the world as they
    /// are numbered; all of them are active.
    pub fn dense(name: &'static str, low: [i32; 3], size: [i32; 3], values: &[f32]) -> Self {
        let mut leaves = BTreeMap::new();
        for (i, value) in values.iter().enumerate() {
            let i = i as i32;
            let at = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let at = [0, 1, 2].map(|k| low[k] + at[k]);
            let leaf = leaves
                .entry(at.map(|v| v & !7))
                .or_insert_with(|| vec![0.0; 512]);
            let [x, y, z] = at.map(|v| (v & 7) as usize);
            leaf[(x * 8 + y) * 8 + z] = *value;
        }
        Self {
            name,
            class: 2,
            kind: 1,
            matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            offset: [0.0; 3],
            active: [low, [0, 1, 2].map(|k| low[k] + size[k] - 1)],
            background: 0.0,
            leaves: leaves.into_iter().collect(),
            cubes: Vec::new(),
        }
    }

    /// With voxels of these sizes, the one numbered 0 at a place of the world.
    pub fn placed(mut self, step: [f64; 3], offset: [f64; 3]) -> Self {
        for k in 0..3 {
            self.matrix[k][k] = step[k];
        }
        self.offset = offset;
        self
    }

    /// The value of a voxel.
    pub fn value(&self, at: [i32; 3]) -> f32 {
        for (low, values) in &self.leaves {
            if at.map(|v| v & !7) == *low {
                let [x, y, z] = at.map(|v| (v & 7) as usize);
                return values[(x * 8 + y) * 8 + z];
            }
        }
        for (low, side, value) in &self.cubes {
            if at.map(|v| v >> side << side) == *low {
                return *value;
            }
        }
        self.background
    }

    /// In the world: of the active voxels, up to the one after the highest.
    fn bounds(&self) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for corner in 0..8 {
            let at = [0, 1, 2].map(|k| match corner >> k & 1 {
                0 => f64::from(self.active[0][k]),
                _ => f64::from(self.active[1][k] + 1),
            });
            for k in 0..3 {
                let row = self.matrix[k];
                let x = row[0] * at[0] + row[1] * at[1] + row[2] * at[2] + self.offset[k];
                bounds[0][k] = bounds[0][k].min(x);
                bounds[1][k] = bounds[1][k].max(x);
            }
        }
        bounds
    }

    /// Its bytes, without a file around them.
    pub fn bytes(&self) -> Vec<u8> {
        // Nodes by level: what is in their tables.
        let mut uppers: BTreeMap<[i32; 3], Node> = BTreeMap::new();
        let mut lowers: BTreeMap<[i32; 3], Node> = BTreeMap::new();
        let mut tiles = Vec::new();
        let child = |at: [i32; 3], side: u32, children: u32| {
            let [x, y, z] = at.map(|v| (v >> side & ((1 << children) - 1)) as usize);
            (x << children | y) << children | z
        };
        let lower = |lowers: &mut BTreeMap<_, Node>, at: [i32; 3]| {
            lowers.entry(at.map(|v| v & !127)).or_default();
        };
        for (at, _) in &self.leaves {
            lower(&mut lowers, *at);
        }
        for (at, side, value) in &self.cubes {
            match side {
                3 => {
                    lower(&mut lowers, *at);
                    let node = lowers.get_mut(&at.map(|v| v & !127)).unwrap();
                    node.values.insert(child(*at, 3, 4), *value);
                }
                7 => {
                    let node = uppers.entry(at.map(|v| v & !4095)).or_default();
                    node.values.insert(child(*at, 7, 5), *value);
                }
                _ => tiles.push((*at, *value)),
            }
        }
        for at in lowers.keys() {
            uppers.entry(at.map(|v| v & !4095)).or_default();
        }
        let (upper_bytes, lower_bytes, leaf_bytes) = (8256 + 8 * 32768, 1088 + 8 * 4096, 2144);
        let root = 672 + 64;
        let first_upper = root + 64 + 32 * (tiles.len() + uppers.len());
        let first_lower = first_upper + uppers.len() * upper_bytes;
        let first_leaf = first_lower + lowers.len() * lower_bytes;
        let upper_at = |i: usize| first_upper + i * upper_bytes;
        let lower_at = |i: usize| first_lower + i * lower_bytes;
        for (i, at) in lowers.keys().enumerate() {
            let node = uppers.get_mut(&at.map(|v| v & !4095)).unwrap();
            node.children.insert(child(*at, 7, 5), lower_at(i));
        }
        for (i, (at, _)) in self.leaves.iter().enumerate() {
            let node = lowers.get_mut(&at.map(|v| v & !127)).unwrap();
            node.children
                .insert(child(*at, 3, 4), first_leaf + i * leaf_bytes);
        }
        let mut out = vec![0; first_leaf + self.leaves.len() * leaf_bytes];
        self.write_head(&mut out);
        put(&mut out, 672 + 24, &64i64.to_le_bytes());
        for (i, bound) in self.active.as_flattened().iter().enumerate() {
            put(&mut out, root + 4 * i, &bound.to_le_bytes());
        }
        let entries = (tiles.len() + uppers.len()) as u32;
        put(&mut out, root + 24, &entries.to_le_bytes());
        put(&mut out, root + 28, &self.background.to_le_bytes());
        let name = |at: [i32; 3]| {
            let [x, y, z] = at.map(|v| u64::from(v as u32 >> 12));
            x << 42 | y << 21 | z
        };
        let mut entry = root + 64;
        for (at, value) in tiles {
            put(&mut out, entry, &name(at).to_le_bytes());
            put(&mut out, entry + 20, &value.to_le_bytes());
            entry += 32;
        }
        for (i, (at, node)) in uppers.iter().enumerate() {
            put(&mut out, entry, &name(*at).to_le_bytes());
            let offset = (upper_at(i) - root) as i64;
            put(&mut out, entry + 8, &offset.to_le_bytes());
            entry += 32;
            node.write(&mut out, upper_at(i), 32 + 4096, 8256);
        }
        for (i, node) in lowers.values().enumerate() {
            node.write(&mut out, lower_at(i), 32 + 512, 1088);
        }
        for (i, (_, values)) in self.leaves.iter().enumerate() {
            for (j, value) in values.iter().enumerate() {
                let at = first_leaf + i * leaf_bytes + 96 + 4 * j;
                put(&mut out, at, &value.to_le_bytes());
            }
        }
        out
    }

    fn write_head(&self, out: &mut [u8]) {
        put(out, 0, b"NanoVDB1");
        put(out, 16, &VERSION.to_le_bytes());
        put(out, 32, &(out.len() as u64).to_le_bytes());
        put(out, 40, self.name.as_bytes());
        for (i, value) in self.matrix.as_flattened().iter().enumerate() {
            put(out, 384 + 8 * i, &value.to_le_bytes());
        }
        for (i, value) in self.offset.iter().enumerate() {
            put(out, 528 + 8 * i, &value.to_le_bytes());
        }
        for (i, value) in self.bounds().as_flattened().iter().enumerate() {
            put(out, 560 + 8 * i, &value.to_le_bytes());
        }
        put(out, 632, &self.class.to_le_bytes());
        put(out, 636, &self.kind.to_le_bytes());
    }
}

/// 32.6.0
const VERSION: u32 = 32 << 21 | 6 << 10;

/// Entries of a node: values, and places of children.
#[derive(Default)]
struct Node {
    values: BTreeMap<usize, f32>,
    children: BTreeMap<usize, usize>,
}

impl Node {
    fn write(&self, out: &mut [u8], at: usize, mask: usize, table: usize) {
        for (entry, value) in &self.values {
            put(out, at + table + 8 * entry, &value.to_le_bytes());
        }
        for (entry, child) in &self.children {
            out[at + mask + entry / 8] |= 1 << (entry % 8);
            let offset = (*child - at) as i64;
            put(out, at + table + 8 * entry, &offset.to_le_bytes());
        }
    }
}

fn put(out: &mut [u8], at: usize, bytes: &[u8]) {
    out[at..at + bytes.len()].copy_from_slice(bytes);
}

/// A file of a segment with these grids.
pub fn file(grids: &[Grid], codec: Codec) -> Vec<u8> {
    let number: u16 = match codec {
        Codec::Stored => 0,
        Codec::Zlib => 1,
        Codec::Blosc(_) => 2,
    };
    let mut out = b"NanoVDB2".to_vec();
    out.extend(VERSION.to_le_bytes());
    out.extend((grids.len() as u16).to_le_bytes());
    out.extend(number.to_le_bytes());
    let mut bodies = Vec::new();
    for grid in grids {
        let bytes = grid.bytes();
        let body = match codec {
            Codec::Stored => bytes.clone(),
            Codec::Zlib => {
                let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(&bytes).unwrap();
                counted(encoder.finish().unwrap())
            }
            Codec::Blosc(block) => {
                // Two chunks.
                let (one, other) = bytes.split_at(bytes.len() / 2);
                let mut both = counted(blosc(one, block));
                both.extend(counted(blosc(other, block)));
                both
            }
        };
        let mut meta = vec![0; 176];
        put(&mut meta, 0, &(bytes.len() as u64).to_le_bytes());
        put(&mut meta, 8, &(body.len() as u64).to_le_bytes());
        put(&mut meta, 136, &(grid.name.len() as u32 + 1).to_le_bytes());
        out.extend(meta);
        out.extend(grid.name.as_bytes());
        out.push(0);
        bodies.push(body);
    }
    out.extend(bodies.concat());
    out
}

fn counted(bytes: Vec<u8>) -> Vec<u8> {
    let mut out = (bytes.len() as u64).to_le_bytes().to_vec();
    out.extend(bytes);
    out
}

/// A chunk of shuffled values of four bytes, its blocks in four parts each but for the last.
fn blosc(bytes: &[u8], block: usize) -> Vec<u8> {
    let blocks = bytes.chunks(block).count();
    let mut out = vec![2, 1, 1 | 1 << 5, 4];
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend((block as u32).to_le_bytes());
    out.extend([0; 4]);
    out.resize(16 + 4 * blocks, 0);
    for (i, block_bytes) in bytes.chunks(block).enumerate() {
        let start = out.len() as u32;
        put(&mut out, 16 + 4 * i, &start.to_le_bytes());
        let count = block_bytes.len() / 4;
        let mut shuffled: Vec<u8> = (0..4 * count)
            .map(|j| block_bytes[j % count * 4 + j / count])
            .collect();
        shuffled.extend(&block_bytes[4 * count..]);
        let parts = if block_bytes.len() == block { 4 } else { 1 };
        for (j, part) in shuffled.chunks(block_bytes.len() / parts).enumerate() {
            // Some are stored.
            let packed = if j % 2 == 0 { lz4(part) } else { part.to_vec() };
            out.extend((packed.len() as u32).to_le_bytes());
            out.extend(packed);
        }
    }
    let length = out.len() as u32;
    put(&mut out, 12, &length.to_le_bytes());
    out
}

/// One sequence of literals.
fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut out = vec![(bytes.len().min(15) << 4) as u8];
    if bytes.len() >= 15 {
        let mut rest = bytes.len() - 15;
        while rest >= 255 {
            out.push(255);
            rest -= 255;
        }
        out.push(rest as u8);
    }
    out.extend(bytes);
    out
}
