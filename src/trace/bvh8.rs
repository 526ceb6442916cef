//! The same tree with up to eight children per node, for one ray against eight boxes or eight
//! triangles at a time.
//!
//! Node boxes are those of the binary tree, so both trees cull alike; see [`super::triangle`].
//! Which nodes of the binary tree remain is decided as for compressed wide trees (Ylitie, Karras
//! and Laine 2017, section 3.1): by dynamic programming over the number of subtrees a node may
//! leave behind, for the least expected cost. Opening the largest boxes first leaves the nodes half
//! empty.

use bytemuck::{Pod, Zeroable};

use super::flatten::Tree;
use super::node::{Bounds, Child, NOWHERE, Node, Part};
use super::store::{Builder, Triangles, WIDTH};

/// Eight children; unused ones lie [`NOWHERE`].
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Node8 {
    /// `[axis][min, max][child]`
    pub bounds: [[[f32; 8]; 2]; 3],
    pub child: [Child; 8],
    _unused: [u32; 8],
}

const _: () = assert!(size_of::<Node8>() == 256);

/// The wide tree. Its triangle leaves are the groups of the store, its sphere leaves those of the
/// binary tree.
pub struct Bvh8 {
    pub nodes: Vec<Node8>,
    /// Where nodes of the binary tree are met again; the root where they are not.
    again: Vec<Child>,
    /// Number of groups.
    pub groups: usize,
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

/// What visiting a leaf costs, in visits of inner nodes.
const LEAF_COST: f32 = 1.0;

/// The best ways to cut the subtree below a node into at most so many subtrees.
#[derive(Clone, Copy)]
struct Cuts {
    /// Cost of the subtree below, cut into at most 1, 2, ..., 7 wide subtrees; not counting the
    /// node itself.
    cost: [f32; 9],
    /// Subtrees that the first child takes of so many.
    first: [u8; 9],
    /// First triangle of the subtree and their number, or more than [`WIDTH`] if it cannot be a
    /// leaf.
    start: u32,
    count: u32,
}

/// The best ways for a child: the cost of at most so many subtrees, and how many it really is.
struct Offer {
    cost: [f32; 8],
    parts: [u8; 8],
}

impl Cuts {
    fn offer(of: &[Cuts], bounds: &Bounds, child: Child, most: u32) -> Offer {
        let area = half_area(bounds);
        if child.is_leaf() {
            return Offer {
                cost: [area * LEAF_COST; 8],
                parts: [1; 8],
            };
        }
        let cuts = &of[child.index()];
        let mut cost = [area + cuts.cost[8]; 8];
        if cuts.count <= most {
            cost[1] = cost[1].min(area * LEAF_COST);
        }
        let mut parts = [1; 8];
        for n in 2..8 {
            if cuts.cost[n] < cost[n - 1] {
                (cost[n], parts[n]) = (cuts.cost[n], n as u8);
            } else {
                (cost[n], parts[n]) = (cost[n - 1], parts[n - 1]);
            }
        }
        Offer { cost, parts }
    }

    fn of_all(nodes: &[Node], most: u32) -> Vec<Cuts> {
        let nothing = Cuts {
            cost: [0.0; 9],
            first: [1; 9],
            start: 0,
            count: 0,
        };
        let mut cuts = vec![nothing; nodes.len()];
        // Children come after their parents.
        for (i, node) in nodes.iter().enumerate().rev() {
            let span = |child: Child| match child {
                c if !c.is_leaf() => (cuts[c.index()].start, cuts[c.index()].count),
                c if c.is_sphere_leaf() => (0, WIDTH as u32 + 1),
                c => (c.range().start as u32, c.range().len() as u32),
            };
            let (a, b) = (span(node.child(0)), span(node.child(1)));
            let start = if b.1 == 0 {
                a.0
            } else if a.1 == 0 {
                b.0
            } else {
                a.0.min(b.0)
            };
            let mut cut = Cuts {
                start,
                count: a.1 + b.1,
                ..nothing
            };
            let offer =
                |side: usize| Cuts::offer(&cuts, &node.bounds[side], node.child(side), most);
            let (a, b) = (offer(0), offer(1));
            for n in 2..=8 {
                cut.cost[n] = f32::INFINITY;
                for first in 1..n {
                    let cost = a.cost[first] + b.cost[n - first];
                    if cost < cut.cost[n] {
                        (cut.cost[n], cut.first[n]) = (cost, first as u8);
                    }
                }
            }
            cuts[i] = cut;
        }
        cuts
    }
}

/// Up to eight children of a wide node.
struct Family {
    members: [(Bounds, Child); 8],
    len: usize,
}

impl Family {
    /// Opens a node of the binary tree until `parts` of its descendants are left.
    fn open(&mut self, (nodes, cuts): (&[Node], &[Cuts]), node: usize, parts: usize, most: u32) {
        let first = cuts[node].first[parts] as usize;
        for (side, parts) in [first, parts - first].into_iter().enumerate() {
            let (bounds, child) = (nodes[node].bounds[side], nodes[node].child(side));
            if child == Child::EMPTY {
                continue;
            }
            match Cuts::offer(cuts, &bounds, child, most).parts[parts.min(7)] {
                1 => {
                    self.members[self.len] = (bounds, child);
                    self.len += 1;
                }
                parts => self.open((nodes, cuts), child.index(), parts as usize, most),
            }
        }
    }
}

/// Merges nodes of the binary tree, and the triangles of its leaves to groups of at most so many.
pub fn collapse(tree: &Tree, most: usize) -> Bvh8 {
    let nodes = &tree.nodes[..];
    let most = most as u32;
    let cuts = Cuts::of_all(nodes, most);
    let mut wide = Bvh8 {
        nodes: vec![Node8::new()],
        again: vec![Child::inner(0); nodes.len()],
        groups: 0,
        depth: 1,
    };
    let mut pending = vec![(0, 1, 0)];
    while let Some((at, depth, node)) = pending.pop() {
        wide.depth = wide.depth.max(depth);
        let mut family = Family {
            members: [(NOWHERE, Child::EMPTY); 8],
            len: 0,
        };
        family.open((nodes, &cuts), node, 8, most);
        let members = &mut family.members[..family.len];
        // Where any hit will do, the largest is the most likely to have one.
        members.sort_by(|a, b| half_area(&b.0).total_cmp(&half_area(&a.0)));
        for (slot, &(bounds, child)) in members.iter().enumerate() {
            for axis in 0..3 {
                for side in 0..2 {
                    wide.nodes[at].bounds[axis][side][slot] = bounds[axis][side];
                }
            }
            wide.nodes[at].child[slot] = if child.is_leaf() {
                wide.groups += usize::from(!child.is_sphere_leaf());
                child
            } else if is_group(&cuts, &bounds, child, most) {
                let cut = &cuts[child.index()];
                wide.groups += 1;
                Child::leaf(false, cut.start as usize, cut.count as usize)
            } else {
                wide.nodes.push(Node8::new());
                let index = wide.nodes.len() - 1;
                pending.push((index, depth + 1, child.index()));
                Child::inner(index)
            };
            if !child.is_leaf() {
                wide.again[child.index()] = wide.nodes[at].child[slot];
            }
        }
    }
    wide
}

/// Whether a subtree is better tested as a leaf than visited.
fn is_group(cuts: &[Cuts], bounds: &Bounds, child: Child, most: u32) -> bool {
    let cut = &cuts[child.index()];
    let area = half_area(bounds);
    cut.count <= most && area * LEAF_COST <= area + cut.cost[8]
}

impl Bvh8 {
    /// The triangles of the binary tree, in groups as the leaves of this tree ask for; the binary
    /// tree learns where.
    pub fn group(&self, tree: &mut Tree, corner: impl Fn(u32, usize) -> [f32; 3]) -> Triangles {
        let mut parts = vec![Part::default(); tree.triangles.len()];
        for child in self.nodes.iter().flat_map(|n| n.child) {
            if child.is_leaf() && !child.is_sphere_leaf() && child != Child::EMPTY {
                let range = child.range();
                let size = range.len() as u32;
                for (place, part) in (0..).zip(&mut parts[range]) {
                    *part = Part { place, size };
                }
            }
        }
        let mut triangles = Builder::with_capacity(tree.triangles.len());
        let mut at = 0;
        while at < parts.len() {
            let end = at + parts[at].size as usize;
            triangles.push(&tree.triangles[at..end], &corner);
            at = end;
        }
        for link in tree.nodes.iter_mut().flat_map(|n| &mut n.link) {
            let child = link.child;
            if !child.is_leaf() {
                link.set_wide(self.again[child.index()]);
            } else if !child.is_sphere_leaf() && child != Child::EMPTY {
                link.set_part(parts[child.range().start]);
            }
        }
        triangles.finish()
    }
}

fn half_area(b: &Bounds) -> f32 {
    let [x, y, z] = b.map(|[min, max]| max - min);
    x * y + y * z + z * x
}
