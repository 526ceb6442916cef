//! The same tree with up to eight children per node, for one ray against eight boxes or eight triangles at a time.
//!
//! Node boxes are those of the binary tree, so both trees cull alike; see [`super::triangle`].

use super::node::{Bounds, Child, NOWHERE, Node};
use super::triangle::LeafTriangle;

/// Eight children; unused ones lie [`NOWHERE`].
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node8 {
    /// `[axis][min, max][child]`
    pub bounds: [[[f32; 8]; 2]; 3],
    pub child: [Child; 8],
    _unused: [u32; 8],
}

const _: () = assert!(size_of::<Node8>() == 256);

/// Up to eight triangles. Vertices of missing ones are NaN, which no ray hits.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Block {
    /// `[vertex][axis][triangle]`. There are four axes so that one can be picked at run time without a bounds check; the
    /// fourth of the first vertex is the index of the triangle, as bits.
    pub p: [[[f32; 8]; 4]; 3],
}

const _: () = assert!(size_of::<Block>() == 384);

/// The wide tree. Its triangle leaves refer to `blocks`, its sphere leaves to the spheres of the binary tree.
pub struct Bvh8 {
    pub nodes: Vec<Node8>,
    pub blocks: Vec<Block>,
    /// Levels of nodes.
    pub depth: usize,
}

impl Node8 {
    fn new() -> Self {
        Self {
            bounds: NOWHERE.map(|b| b.map(|x| [x; 8])),
            child: [Child::EMPTY; 8],
            _unused: [0; 8],
        }
    }
}

impl Block {
    fn new(triangles: &[&LeafTriangle]) -> Self {
        let mut block = Self {
            p: [[[f32::NAN; 8]; 4]; 3],
        };
        for (lane, triangle) in triangles.iter().enumerate() {
            for (vertex, p) in triangle.p.iter().enumerate() {
                for axis in 0..3 {
                    block.p[vertex][axis][lane] = p[axis];
                }
            }
            block.p[0][3][lane] = f32::from_bits(triangle.index());
        }
        block
    }

    #[inline(always)]
    pub fn index(&self, lane: usize) -> u32 {
        self.p[0][3][lane].to_bits()
    }
}

/// Triangles in one block.
const WIDTH: usize = 8;

/// Merges nodes of the binary tree: of a node's descendants, the largest boxes are opened until there are eight. A
/// subtree of at most eight triangles becomes one block.
pub fn collapse(nodes: &[Node], triangles: &[LeafTriangle]) -> Bvh8 {
    let small = small_subtrees(nodes);
    let becomes_leaf = |child: Child| child.is_leaf() || small[child.index()];
    let mut tree = Bvh8 {
        nodes: vec![Node8::new()],
        blocks: Vec::new(),
        depth: 1,
    };
    let mut pending = vec![(0, 1, &nodes[0])];
    while let Some((at, depth, node)) = pending.pop() {
        tree.depth = tree.depth.max(depth);
        let mut children: Vec<(Bounds, Child)> = (0..2)
            .map(|side| (node.bounds[side], node.child[side]))
            .filter(|c| c.1 != Child::EMPTY)
            .collect();
        while children.len() < 8 {
            let open = (0..children.len())
                .filter(|&i| !becomes_leaf(children[i].1))
                .max_by(|&a, &b| half_area(&children[a].0).total_cmp(&half_area(&children[b].0)));
            let Some(open) = open else {
                break;
            };
            let node = &nodes[children[open].1.index()];
            children[open] = (node.bounds[0], node.child[0]);
            children.push((node.bounds[1], node.child[1]));
        }
        for (slot, (bounds, child)) in children.into_iter().enumerate() {
            for axis in 0..3 {
                for side in 0..2 {
                    tree.nodes[at].bounds[axis][side][slot] = bounds[axis][side];
                }
            }
            tree.nodes[at].child[slot] = if child.is_leaf() && child.is_sphere_leaf() {
                child
            } else if becomes_leaf(child) {
                let mut members = Vec::with_capacity(WIDTH);
                gather(nodes, triangles, child, &mut members);
                let first = tree.blocks.len();
                tree.blocks.extend(members.chunks(WIDTH).map(Block::new));
                Child::leaf(false, first, tree.blocks.len() - first)
            } else {
                tree.nodes.push(Node8::new());
                let index = tree.nodes.len() - 1;
                pending.push((index, depth + 1, &nodes[child.index()]));
                Child::inner(index)
            };
        }
    }
    tree
}

/// For each node, whether it holds triangles only and few enough for one block.
fn small_subtrees(nodes: &[Node]) -> Vec<bool> {
    let too_many = WIDTH + 1;
    let mut count = vec![0; nodes.len()];
    // Children come after their parents.
    for i in (0..nodes.len()).rev() {
        let of = |child: Child| match child {
            c if !c.is_leaf() => count[c.index()],
            c if c.is_sphere_leaf() => too_many,
            c => c.range().len(),
        };
        count[i] = (of(nodes[i].child[0]) + of(nodes[i].child[1])).min(too_many);
    }
    count.iter().map(|&n| n <= WIDTH).collect()
}

fn gather<'a>(
    nodes: &[Node],
    triangles: &'a [LeafTriangle],
    child: Child,
    members: &mut Vec<&'a LeafTriangle>,
) {
    if child.is_leaf() {
        members.extend(&triangles[child.range()]);
    } else {
        for child in nodes[child.index()].child {
            gather(nodes, triangles, child, members);
        }
    }
}

fn half_area(b: &Bounds) -> f32 {
    let [x, y, z] = b.map(|[min, max]| max - min);
    x * y + y * z + z * x
}
