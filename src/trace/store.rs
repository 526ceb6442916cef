//! The vertices of all triangles, once, for both trees.
//!
//! The triangles of one leaf of the wide tree make a *group* of up to eight. A group of `n` is nine
//! rows of `n` floats, vertex by vertex and axis by axis, without padding: one ray loads eight
//! floats from the start of each row, where lanes from `n` on are somebody else's numbers and are
//! masked off; a packet broadcasts single entries. So a triangle takes 40 bytes, its
//! index included, however full the leaves are; blocks of eight lanes would take 65.

use super::ray::{Ray, permute};
use crate::memory::Table;
use crate::simd::prefetch::prefetch;
use crate::simd::{Lanes, f32x8};

/// Most triangles in a group.
pub const WIDTH: usize = 8;
/// Floats that can be read from the start of a group on. There are more than its rows, so that the
/// compiler sees from a few masks that no offset needs a check.
const WINDOW: usize = 256 + WIDTH;

/// Triangles in leaf order, while the store is filled.
#[derive(Default)]
pub struct Builder {
    /// Rows of one group after the other, and a last window.
    rows: Vec<f32>,
    /// Indices in the scene.
    index: Vec<u32>,
}

/// The triangles of one leaf of the wide tree.
#[derive(Clone, Copy)]
pub struct Group<'a> {
    rows: &'a [f32; WINDOW],
    size: usize,
}

impl Builder {
    pub fn with_capacity(count: usize) -> Self {
        Self {
            rows: Vec::with_capacity(9 * count + WINDOW),
            index: Vec::with_capacity(count),
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
        }
        self.index.extend_from_slice(indices);
        self.rows.extend_from_slice(&rows[..9 * size]);
    }

    pub fn finish(mut self) -> Triangles {
        self.rows.resize(self.rows.len() + WINDOW, 0.0);
        Triangles {
            rows: Table::new(self.rows),
            index: Table::new(self.index),
        }
    }
}

/// The store.
pub struct Triangles {
    rows: Table<f32>,
    index: Table<u32>,
}

impl Triangles {
    pub fn len(&self) -> usize {
        self.index.entries().len()
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.rows.entries()) + size_of_val(self.index.entries())
    }

    pub fn view(&self) -> View<'_> {
        View {
            rows: self.rows.entries(),
            index: self.index.entries(),
        }
    }
}

/// The store as rays read it.
#[derive(Clone, Copy)]
pub struct View<'a> {
    rows: &'a [f32],
    index: &'a [u32],
}

impl<'a> View<'a> {
    /// The group of `size` triangles whose first is at a position in leaf order.
    #[inline(always)]
    pub fn group(&self, first: usize, size: usize) -> Group<'a> {
        let window = &self.rows[9 * first..][..WINDOW];
        Group {
            rows: window.try_into().expect("a window"),
            size,
        }
    }

    /// Index in the scene.
    #[inline(always)]
    pub fn index(&self, position: usize) -> u32 {
        self.index[position]
    }

    /// Prefetches the group whose first triangle is at a position.
    #[inline(always)]
    pub fn prefetch(&self, first: usize) {
        prefetch::<256, _>(self.rows, 9 * first);
    }
}

impl<'a> Group<'a> {
    /// The group with its axes in `order`.
    #[inline(always)]
    pub fn ordered(&self, order: [usize; 3]) -> Ordered<'a> {
        let size = self.size & 15;
        let axis = |k: usize| (order[k] & 3) * size;
        Ordered {
            rows: self.rows,
            vertex: 3 * size,
            axis: [axis(0), axis(1), axis(2)],
        }
    }

    /// Bits of the lanes of [`Ordered::all`] that hold triangles.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        (1 << self.size) - 1
    }
}

/// A group whose rows are in a ray's own order of axes.
#[derive(Clone, Copy)]
pub struct Ordered<'a> {
    rows: &'a [f32; WINDOW],
    /// From one vertex to the next, and from the first row of a vertex to each axis.
    vertex: usize,
    axis: [usize; 3],
}

impl Ordered<'_> {
    /// One triangle, in every lane.
    #[inline(always)]
    pub fn one<L: Lanes>(&self, place: usize) -> [[L; 3]; 3] {
        let place = place & (WIDTH - 1);
        let [x, y, z] = self.axis.map(|axis| axis + place);
        let entry = |v: usize, row: usize| L::splat(self.rows[v * self.vertex + row]);
        let vertex = |v: usize| [entry(v, x), entry(v, y), entry(v, z)];
        [vertex(0), vertex(1), vertex(2)]
    }

    /// All triangles, one a lane; see [`Group::lanes`].
    #[inline(always)]
    pub fn all(&self) -> [[f32x8; 3]; 3] {
        let [x, y, z] = self.axis;
        let row = |v: usize, row: usize| {
            let start = v * self.vertex + row;
            let lanes: [f32; WIDTH] = self.rows[start..start + WIDTH].try_into().expect("eight");
            f32x8::new(lanes)
        };
        let vertex = |v: usize| [row(v, x), row(v, y), row(v, z)];
        [vertex(0), vertex(1), vertex(2)]
    }
}

/// Vertices in each ray's own order of axes.
#[inline(always)]
pub fn permuted<L: Lanes>(p: [[L; 3]; 3], ray: &Ray<L>) -> [[L; 3]; 3] {
    let own = |p: [L; 3]| permute::<L>(p, ray.swap_x, ray.swap_y);
    [own(p[0]), own(p[1]), own(p[2])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_of_every_group_is_found() {
        let corner = |index: u32, vertex: usize| {
            [0, 1, 2].map(|k| (9 * index + 3 * vertex as u32 + k) as f32)
        };
        let mut builder = Builder::default();
        for size in 1..=WIDTH as u32 {
            let first = size * (size - 1) / 2;
            let indices: Vec<u32> = (first..first + size).collect();
            builder.push(&indices, corner);
        }
        let triangles = builder.finish();
        assert_eq!(triangles.len(), 36);
        let view = triangles.view();
        for size in 1..=WIDTH {
            let first = size * (size - 1) / 2;
            let group = view.group(first, size);
            assert_eq!(group.lanes().count_ones() as usize, size);
            for order in [[0, 1, 2], [2, 1, 0], [0, 2, 1]] {
                let all = group.ordered(order).all();
                for place in 0..size {
                    let index = view.index(first + place);
                    assert_eq!(index as usize, first + place);
                    let one = group.ordered(order).one::<f32>(place);
                    for v in 0..3 {
                        for k in 0..3 {
                            let expected = corner(index, v)[order[k]];
                            assert_eq!(one[v][k], expected);
                            assert_eq!(all[v][k].to_array()[place], expected);
                        }
                    }
                }
            }
        }
    }
}
