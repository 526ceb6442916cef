//! A tree over the triangles of lamps, to find those near a triangle.

use glam::DVec3;

/// A triangle of a lamp.
pub(super) struct Facet {
    /// Index of the lamp.
    pub(super) lamp: usize,
    pub(super) p: [DVec3; 3],
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

/// Facets of one leaf of the tree.
const LEAF: usize = 4;

/// Sorts the facets into a tree whose halves are halves of the list; `tree` gets the boxes in the
/// order of [`visit`].
pub(super) fn arrange(facets: &mut [Facet], tree: &mut Vec<[DVec3; 2]>) {
    let low = (facets.iter()).fold(DVec3::INFINITY, |low, f| low.min(f.low));
    let high = (facets.iter()).fold(DVec3::NEG_INFINITY, |high, f| high.max(f.high));
    tree.push([low, high]);
    if facets.len() <= LEAF {
        return;
    }
    let size = high - low;
    let axis = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
    let middle = facets.len() / 2;
    let centre = |f: &Facet| f.low[axis] + f.high[axis];
    facets.select_nth_unstable_by(middle, |a, b| centre(a).total_cmp(&centre(b)));
    let (left, right) = facets.split_at_mut(middle);
    arrange(left, tree);
    arrange(right, tree);
}

/// Nodes of a tree over so many facets.
fn nodes(facets: usize) -> usize {
    if facets <= LEAF {
        return 1;
    }
    let middle = facets / 2;
    1 + nodes(middle) + nodes(facets - middle)
}

/// Calls `each` with the facets whose boxes meet a box.
pub(super) fn visit(
    facets: &[Facet],
    tree: &[[DVec3; 2]],
    [low, high]: [DVec3; 2],
    each: &mut dyn FnMut(&Facet),
) {
    let meets = |a: DVec3, b: DVec3| a.cmple(high).all() && b.cmpge(low).all();
    let [from, to] = tree[0];
    if !meets(from, to) {
        return;
    }
    if facets.len() <= LEAF {
        facets
            .iter()
            .filter(|f| meets(f.low, f.high))
            .for_each(each);
        return;
    }
    let middle = facets.len() / 2;
    let (left, right) = facets.split_at(middle);
    let (below, above) = tree[1..].split_at(nodes(middle));
    visit(left, below, [low, high], each);
    visit(right, above, [low, high], each);
}
