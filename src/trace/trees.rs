//! The tables of a tracer, as rays read them.

use super::bvh8::Node8;
use super::large::LargeSurface;
use super::node::Node;
use super::sphere::LeafSphere;
use super::store::View;

/// The tables of a tracer, as rays read them.
pub(super) struct Trees<'a> {
    pub nodes: &'a [Node],
    pub wide: &'a [Node8],
    pub triangles: View<'a>,
    pub spheres: &'a [LeafSphere],
    pub large: &'a [LargeSurface],
    /// Whether single rays take turns.
    pub in_turns: bool,
}
