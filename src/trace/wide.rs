//! Trees that can be followed both ways.

use super::build::{self, Part};
use super::bvh8::{self, Bvh8};
use super::flatten::Tree;
use super::single::MAX_DEPTH;
use super::store::WIDTH;

/// The best tree that can be followed, binary and wide.
pub fn tree_over(part: &Part) -> (Tree, Bvh8) {
    let widen = |tree: Tree| {
        let wide = bvh8::collapse(&tree, WIDTH);
        (wide.depth <= MAX_DEPTH).then_some((tree, wide))
    };
    build::best(part)
        .and_then(widen)
        .or_else(|| widen(build::halve(part)))
        .expect("halves are not deep")
}
