//! The tree of a grid: a root that names blocks of 4096 voxels a side, two levels of nodes, and
//! leaves of 8 voxels a side. Where there is no child there is one value for all.

use std::collections::HashMap;

use super::bytes::{array, beside, f32_at, i32_at, slice, u32_at, u64_at};

/// Children along each side of a node, as a power of two; voxels along each side of a child, too;
/// bytes before the mask of children and before the table.
struct Level {
    children: u32,
    child: u32,
    mask: u64,
    table: u64,
}

const UPPER: Level = Level {
    children: 5,
    child: 7,
    mask: 32 + 4096,
    table: 8256,
};
const LOWER: Level = Level {
    children: 4,
    child: 3,
    mask: 32 + 512,
    table: 1088,
};
const LEAF_VALUES: u64 = 96;
const LEAF_BYTES: u64 = LEAF_VALUES + 4 * 512;
const ROOT_BYTES: u64 = 64;
const TILE_BYTES: u64 = 32;
/// Voxels along each side of what the root names, as a power of two.
const BLOCK: u32 = 12;

/// A tree of numbers in the bytes of its grid.
pub struct Tree<'a> {
    bytes: &'a [u8],
    root: u64,
    /// Lowest and highest voxels that are active.
    pub active: [[i32; 3]; 2],
    /// Value of all that is not in the tree.
    pub background: f32,
    /// Entries of the root by what they call their block.
    blocks: HashMap<u64, u64>,
}

/// Voxels of a box, and their values: x goes fastest, then y, then z.
pub struct Voxels<'a> {
    /// The lowest.
    pub low: [i64; 3],
    /// How many along each side.
    pub size: [u32; 3],
    /// As many as there are.
    pub values: &'a mut [f32],
}

impl<'a> Tree<'a> {
    /// Of a root at this place.
    pub fn new(bytes: &'a [u8], root: u64) -> Result<Self, String> {
        slice(bytes, root, ROOT_BYTES)?;
        let mut active = [[0; 3]; 2];
        for (i, bound) in active.iter_mut().flatten().enumerate() {
            *bound = i32_at(bytes, root + 4 * i as u64)?;
        }
        let entries = u64::from(u32_at(bytes, root + 24)?);
        slice(bytes, root + ROOT_BYTES, entries * TILE_BYTES)?;
        let mut blocks = HashMap::new();
        for i in 0..entries {
            let at = root + ROOT_BYTES + i * TILE_BYTES;
            // Of two with one name the first counts.
            blocks.entry(u64_at(bytes, at)?).or_insert(at);
        }
        Ok(Self {
            bytes,
            root,
            active,
            background: f32_at(bytes, root + 28)?,
            blocks,
        })
    }

    /// Fills a box with the values of its voxels.
    pub fn fill(&self, voxels: &mut Voxels) -> Result<(), String> {
        voxels.values.fill(self.background);
        let all = [i64::from(i32::MIN) >> BLOCK, i64::from(i32::MAX) >> BLOCK];
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let last = voxels.low[k] + i64::from(voxels.size[k]) - 1;
            (voxels.low[k] >> BLOCK).max(all[0])..=(last >> BLOCK).min(all[1])
        });
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    // Twenty bits of each coordinate.
                    let name = |i: i64| u64::from(((i << BLOCK) as u32) >> BLOCK);
                    let name = name(x) << 42 | name(y) << 21 | name(z);
                    let Some(&at) = self.blocks.get(&name) else {
                        continue;
                    };
                    let origin = [x << BLOCK, y << BLOCK, z << BLOCK];
                    match i64::from_le_bytes(array(self.bytes, at + 8)?) {
                        0 => voxels.even(origin, BLOCK, f32_at(self.bytes, at + 20)?),
                        child => {
                            let child = beside(self.root, child)?;
                            self.node(&UPPER, child, origin, voxels)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// What a node at this place has of a box.
    fn node(
        &self,
        level: &Level,
        at: u64,
        origin: [i64; 3],
        voxels: &mut Voxels,
    ) -> Result<(), String> {
        let table = beside(at, level.table as i64)?;
        let count = 1u64 << (3 * level.children);
        slice(self.bytes, at, level.table)?;
        slice(self.bytes, table, 8 * count)?;
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let last = voxels.low[k] + i64::from(voxels.size[k]) - 1 - origin[k];
            let first = (voxels.low[k] - origin[k]).max(0);
            (first >> level.child)..=(last >> level.child).min((1 << level.children) - 1)
        });
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    let index = ((x << level.children | y) << level.children | z) as u64;
                    let entry = table + 8 * index;
                    let [mask] = array(self.bytes, at + level.mask + index / 8)?;
                    let low = [x, y, z].map(|i| i << level.child);
                    let low = [0, 1, 2].map(|k| origin[k] + low[k]);
                    if mask >> (index % 8) & 1 == 0 {
                        voxels.even(low, level.child, f32_at(self.bytes, entry)?);
                        continue;
                    }
                    let child = beside(at, i64::from_le_bytes(array(self.bytes, entry)?))?;
                    if level.child == UPPER.child {
                        self.node(&LOWER, child, low, voxels)?;
                    } else {
                        voxels.leaf(low, slice(self.bytes, child, LEAF_BYTES)?);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Voxels<'_> {
    /// Sets those of a cube, `2^side` wide.
    fn even(&mut self, origin: [i64; 3], side: u32, value: f32) {
        self.each(origin, side, |_| value);
    }

    /// Sets those of a leaf.
    fn leaf(&mut self, origin: [i64; 3], leaf: &[u8]) {
        let mut values = [0.0; 512];
        for (i, value) in values.iter_mut().enumerate() {
            *value = f32_at(leaf, LEAF_VALUES + 4 * i as u64).unwrap_or_default();
        }
        self.each(origin, LOWER.child, |[x, y, z]| {
            values[((x * 8 + y) * 8 + z) as usize]
        });
    }

    /// Sets what lies in a cube, by the place within the cube.
    fn each(&mut self, origin: [i64; 3], side: u32, value: impl Fn([i64; 3]) -> f32) {
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let last = self.low[k] + i64::from(self.size[k]);
            origin[k].max(self.low[k])..(origin[k] + (1i64 << side)).min(last)
        });
        for z in zs {
            for y in ys.clone() {
                let row =
                    (z - self.low[2]) as usize * self.size[1] as usize + (y - self.low[1]) as usize;
                let row = row * self.size[0] as usize;
                for x in xs.clone() {
                    let at = [x - origin[0], y - origin[1], z - origin[2]];
                    self.values[row + (x - self.low[0]) as usize] = value(at);
                }
            }
        }
    }
}
