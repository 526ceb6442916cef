//! Trees from the top down, for what no clustering sorts well: of good quality by the surface area
//! heuristic, or of the least depth.

use super::crowd::half_area;
use super::flatten::{Flattening, LEAF_SIZE, Pending};
use super::node::{Bounds, Child, union};

/// Intervals along an axis between which a part is split.
const BINS: usize = 16;
/// Depth from which on parts are halved: there are then at most so many levels more as a number of
/// primitives has bits.
const DEEP: usize = 64;

/// How parts are split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Where the areas times numbers of both sides add up to the least (Wald 2007, "On fast
    /// Construction of SAH-based Bounding Volume Hierarchies").
    Area,
    /// At the median.
    Half,
}

impl Flattening<'_> {
    /// Fills the tree.
    pub fn split(&mut self, how: Split) {
        let mut order: Vec<u32> = (0..self.primitives.len() as u32).collect();
        let mut pending = vec![Pending {
            node: 0,
            depth: 1,
            content: 0..order.len(),
        }];
        while let Some(Pending {
            node,
            depth,
            content,
        }) = pending.pop()
        {
            self.tree.depth = self.tree.depth.max(depth + 2);
            let part = &mut order[content.clone()];
            let axis = longest_axis(self.boxes, part);
            let middle = match how {
                Split::Area if depth < DEEP => split_by_area(self.boxes, part, axis),
                _ => None,
            };
            let middle = middle.unwrap_or_else(|| split_half(self.boxes, part, axis));
            let middle = content.start + middle;
            for (side, range) in [content.start..middle, middle..content.end]
                .into_iter()
                .enumerate()
            {
                let members = order[range.clone()].to_vec();
                self.tree.nodes[node].bounds[side] = self.padded(&members);
                self.tree.nodes[node].link[side].child = if members.len() <= LEAF_SIZE as usize {
                    self.leaf(&members)
                } else {
                    let index = self.push_node();
                    pending.push(Pending {
                        node: index,
                        depth: depth + 1,
                        content: range,
                    });
                    Child::inner(index)
                };
            }
        }
    }
}

fn centre(b: &Bounds, axis: usize) -> f32 {
    0.5 * b[axis][0] + 0.5 * b[axis][1]
}

/// The range of the centres along an axis.
fn range(boxes: &[Bounds], part: &[u32], axis: usize) -> [f32; 2] {
    part.iter().fold([f32::MAX, f32::MIN], |r, &i| {
        let c = centre(&boxes[i as usize], axis);
        [r[0].min(c), r[1].max(c)]
    })
}

/// The axis along which the centres are the furthest apart.
fn longest_axis(boxes: &[Bounds], part: &[u32]) -> usize {
    let extent = |axis: usize| {
        let [low, high] = range(boxes, part, axis);
        high - low
    };
    let extents = [extent(0), extent(1), extent(2)];
    (0..3)
        .max_by(|&a, &b| extents[a].total_cmp(&extents[b]))
        .unwrap_or(0)
}

/// Puts the lower half of the centres first, and of boxes around one centre the smaller ones;
/// returns how many come first.
fn split_half(boxes: &[Bounds], part: &mut [u32], axis: usize) -> usize {
    let middle = part.len() / 2;
    if middle == 0 {
        return 0;
    }
    let [low, high] = range(boxes, part, axis);
    let key = |i: u32| {
        let b = &boxes[i as usize];
        if low < high {
            centre(b, axis)
        } else {
            half_area(b)
        }
    };
    part.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    middle
}

/// Puts those first that are cheapest kept together, returns how many; `None` if all centres are
/// one, or a part is small.
fn split_by_area(boxes: &[Bounds], part: &mut [u32], axis: usize) -> Option<usize> {
    let [low, high] = range(boxes, part, axis);
    let scale = BINS as f32 / (high - low);
    if part.len() <= LEAF_SIZE as usize || !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let bin = |i: u32| {
        let place = (centre(&boxes[i as usize], axis) - low) * scale;
        (place as usize).min(BINS - 1)
    };
    let mut bins: [(usize, Option<Bounds>); BINS] = [(0, None); BINS];
    for &i in part.iter() {
        let (count, bounds) = &mut bins[bin(i)];
        let b = boxes[i as usize];
        *count += 1;
        *bounds = Some(bounds.map_or(b, |all| union(all, b)));
    }
    let cost = |bins: &[(usize, Option<Bounds>)]| {
        let count: usize = bins.iter().map(|b| b.0).sum();
        let bounds = bins.iter().filter_map(|b| b.1).reduce(union);
        bounds.map_or(0.0, |b| half_area(&b) * count as f32)
    };
    let cut = (1..BINS)
        .map(|cut| (cost(&bins[..cut]) + cost(&bins[cut..]), cut))
        .min_by(|a, b| a.0.total_cmp(&b.0))?
        .1;
    let mut first = 0;
    for at in 0..part.len() {
        if bin(part[at]) < cut {
            part.swap(first, at);
            first += 1;
        }
    }
    (first > 0 && first < part.len()).then_some(first)
}
