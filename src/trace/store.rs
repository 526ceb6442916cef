//! The vertices of all triangles, once, for both trees.
//!
//! The triangles of one leaf of the wide tree make a *group* of up to eight. A group of `n` is nine rows of `n` floats, vertex
//! by vertex and axis by axis, without padding: one ray loads eight floats from the start of each row, where lanes from `n`
//! on are somebody else's numbers and are masked off; a packet broadcasts single entries. So a triangle takes 40 bytes, its
//! index included, however full the leaves are; blocks of eight lanes would take 65.

use super::ray::{Ray, permute};
use crate::simd::{Lanes, f32x8};

/// Most triangles in a group.
pub const WIDTH: usize = 8;
/// Most triangles in all.
pub const MAX_TRIANGLES: usize = 1 << INDEX_BITS;

const INDEX_BITS: u32 = 26;
const PLACE_SHIFT: u32 = INDEX_BITS;
const SIZE_SHIFT: u32 = INDEX_BITS + 3;

/// Floats that can be read from the start of a group on: more than its rows, so that no offset below 128 needs a check.
const WINDOW: usize = 128 + WIDTH;

/// Triangles in leaf order.
#[derive(Default)]
pub struct Triangles {
    /// Rows of one group after the other, and a last window.
    rows: Vec<f32>,
    /// By position in leaf order: index in the scene (26 bits), place within the group (3), size of the group less 1 (3).
    labels: Vec<u32>,
}

/// The triangles of one leaf of the wide tree.
#[derive(Clone, Copy)]
pub struct Group<'a> {
    rows: &'a [f32; WINDOW],
    size: usize,
}

impl Triangles {
    pub fn with_capacity(count: usize) -> Self {
        Self {
            rows: Vec::with_capacity(9 * count + WINDOW),
            labels: Vec::with_capacity(count),
        }
    }

    /// Appends a group of 1 to [`WIDTH`] triangles with their indices.
    pub fn push(&mut self, indices: &[u32], corner: impl Fn(u32, usize) -> [f32; 3]) {
        let size = indices.len();
        debug_assert!((1..=WIDTH).contains(&size));
        let mut rows = [0.0; 9 * WIDTH];
        for (place, &index) in indices.iter().enumerate() {
            for vertex in 0..3 {
                let p = corner(index, vertex);
                for axis in 0..3 {
                    rows[(3 * vertex + axis) * size + place] = p[axis];
                }
            }
            let label = index | (place as u32) << PLACE_SHIFT | (size as u32 - 1) << SIZE_SHIFT;
            self.labels.push(label);
        }
        self.rows.extend_from_slice(&rows[..9 * size]);
    }

    /// To be called after the last group.
    pub fn finish(&mut self) {
        self.rows.resize(self.rows.len() + WINDOW, 0.0);
    }

    pub fn len(&self) -> usize {
        self.labels.len()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.rows[..]) + size_of_val(&self.labels[..])
    }

    /// The group of `size` triangles whose first is at a position in leaf order.
    #[inline(always)]
    pub fn group(&self, first: usize, size: usize) -> Group<'_> {
        let window = &self.rows[9 * first..][..WINDOW];
        Group {
            rows: window.try_into().expect("a window"),
            size,
        }
    }

    /// The group a position in leaf order belongs to, and the place there.
    #[inline(always)]
    pub fn locate(&self, position: usize) -> (Group<'_>, usize) {
        let label = self.labels[position];
        let place = (label >> PLACE_SHIFT) as usize & (WIDTH - 1);
        let size = (label >> SIZE_SHIFT) as usize + 1;
        (self.group(position - place, size), place)
    }

    /// Index in the scene.
    #[inline(always)]
    pub fn index(&self, position: usize) -> u32 {
        self.labels[position] & (MAX_TRIANGLES as u32 - 1)
    }

    /// For prefetching: the rows, and where those of a position begin.
    #[inline(always)]
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }
}

impl Group<'_> {
    #[inline(always)]
    fn at(&self, row: usize, place: usize) -> f32 {
        self.rows[(row * self.size + place) & 127]
    }

    /// One triangle with its axes in `order`.
    #[inline(always)]
    pub fn ordered<L: Lanes>(&self, place: usize, order: [usize; 3]) -> [[L; 3]; 3] {
        let [x, y, z] = order;
        let own = |v: usize| {
            let one = |axis: usize| L::splat(self.at(3 * v + axis, place));
            [one(x), one(y), one(z)]
        };
        [own(0), own(1), own(2)]
    }

    /// One triangle in each ray's own order of axes.
    #[inline(always)]
    pub fn permuted<L: Lanes>(&self, place: usize, ray: &Ray<L>) -> [[L; 3]; 3] {
        let [a, b, c] = self.ordered(place, [0, 1, 2]);
        let own = |p: [L; 3]| permute::<L>(p, ray.swap_x, ray.swap_y);
        [own(a), own(b), own(c)]
    }

    /// All triangles, one a lane, with their axes in `order`; see [`Group::lanes`].
    #[inline(always)]
    pub fn all(&self, order: [usize; 3]) -> [[f32x8; 3]; 3] {
        let offset = [0, 1, 2].map(|k| order[k] * self.size);
        let row = |v: usize, k: usize| {
            let start = (3 * v * self.size + offset[k]) & 127;
            let lanes: [f32; 8] = self.rows[start..start + 8].try_into().expect("eight");
            f32x8::new(lanes)
        };
        let own = |v: usize| [row(v, 0), row(v, 1), row(v, 2)];
        [own(0), own(1), own(2)]
    }

    /// Bits of the lanes of [`Group::all`] that hold triangles.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        (1 << self.size) - 1
    }
}
