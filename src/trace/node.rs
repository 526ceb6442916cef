//! Nodes of the binary tree as the traversal reads them: one cache line holds the boxes of both
//! children.

use bytemuck::{Pod, Zeroable};

/// Deepest tree that can be traversed; a power of two, so that the stack needs no bounds checks.
pub const MAX_DEPTH: usize = 128;

/// A reference to a child, as 32 bits:
///
/// | bits    | leaf                              | inner node   |
/// |---------|-----------------------------------|--------------|
/// | 31      | 1                                 | 0            |
/// | 30      | 1 for spheres, 0 for triangles    | index        |
/// | 29..26  | number of primitives, 0 to 15     | index        |
/// | 25..0   | first primitive in leaf order     | index        |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(pub u32);

const LEAF: u32 = 1 << 31;
const SPHERES: u32 = 1 << 30;
const COUNT_SHIFT: u32 = 26;
const FIRST_MASK: u32 = (1 << COUNT_SHIFT) - 1;

impl Child {
    /// Most primitives one leaf can hold.
    pub const MAX_COUNT: usize = 15;
    /// Most primitives of one sort a tree can hold.
    pub const MAX_PRIMITIVES: usize = FIRST_MASK as usize + 1;
    /// A leaf of nothing.
    pub const EMPTY: Child = Child(LEAF);

    pub const fn inner(index: usize) -> Self {
        debug_assert!(index < LEAF as usize);
        Self(index as u32)
    }
    pub fn leaf(spheres: bool, first: usize, count: usize) -> Self {
        debug_assert!(count <= Self::MAX_COUNT && first < Self::MAX_PRIMITIVES);
        let kind = if spheres { SPHERES } else { 0 };
        Self(LEAF | kind | (count as u32) << COUNT_SHIFT | first as u32)
    }
    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }
    #[inline(always)]
    pub fn is_sphere_leaf(self) -> bool {
        self.0 & SPHERES != 0
    }
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }
    #[inline(always)]
    pub fn range(self) -> std::ops::Range<usize> {
        let first = (self.0 & FIRST_MASK) as usize;
        first..first + ((self.0 >> COUNT_SHIFT) & 15) as usize
    }
}

/// An axis-aligned box, `bounds[axis]` = (min, max).
pub type Bounds = [[f32; 2]; 3];

/// A box that no ray meets: a point so far away that it lies beyond the largest distance a ray is
/// followed to (see [`super::ray`]). An inverted box would do only for slab tests that know the
/// sign of the direction.
pub const NOWHERE: Bounds = [[1e30; 2]; 3];

/// The smallest box around two.
pub fn union(a: Bounds, b: Bounds) -> Bounds {
    std::array::from_fn(|k| [a[k][0].min(b[k][0]), a[k][1].max(b[k][1])])
}

/// Where the triangles of a leaf are in their group, see [`super::store`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// Place of the leaf's first triangle.
    pub place: u32,
    /// Triangles of the group.
    pub size: u32,
}

/// A child, and where it is met again: a leaf of triangles in the store, an inner node in the wide
/// tree.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(8))]
pub struct Link {
    pub child: Child,
    again: u32,
}

impl Link {
    pub const EMPTY: Link = Link::to(Child::EMPTY);

    /// Not met again.
    pub const fn to(child: Child) -> Self {
        Self { child, again: 0 }
    }
    pub fn set_part(&mut self, part: Part) {
        self.again = part.size << 4 | part.place;
    }
    #[inline(always)]
    pub fn part(self) -> Part {
        Part {
            place: self.again & 15,
            size: self.again >> 4,
        }
    }
    pub fn set_wide(&mut self, wide: Child) {
        self.again = wide.0;
    }
    /// The same subtree in the wide tree, if it has one. The root, which is no child, stands for
    /// none.
    #[inline(always)]
    pub fn wide(self) -> Option<Child> {
        (self.again != 0).then_some(Child(self.again))
    }
}

/// Both children of an inner node.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node {
    pub bounds: [Bounds; 2],
    pub link: [Link; 2],
}

impl Node {
    pub fn child(&self, side: usize) -> Child {
        self.link[side].child
    }
}

const _: () = assert!(size_of::<Node>() == 64);
