//! Vertices of subpaths set aside, for evaluations that join them all.

use super::dispersion::Dispersion;
use super::endpoints::Endpoints;
use super::list::List;
use super::side::Side;
use crate::plan::Plan;

/// Vertices of the subpaths of a batch.
#[derive(Default)]
pub(super) struct Kept {
    /// By side and number of the surface vertex.
    pub sides: [Vec<KeptVertex>; 2],
}

/// One vertex of each path.
#[derive(Default)]
pub(super) struct KeptVertex {
    pub endpoints: Endpoints,
    /// Paths that have it and can be joined there.
    pub joined: List,
    /// By path, whether it is among these.
    pub joins: Vec<bool>,
    /// The subpath has met what disperses light, here or before; empty in a scene without.
    dispersed: Vec<bool>,
}

impl Kept {
    /// Room for so many vertices by side of `room` paths; none has any.
    pub fn start(&mut self, counts: [usize; 2], room: usize, plan: &Plan) {
        for (side, count) in self.sides.iter_mut().zip(counts) {
            if side.len() < count {
                side.resize_with(count, KeptVertex::default);
            }
            for vertex in side {
                if vertex.joins.len() < room {
                    vertex.endpoints.resize(room, plan.media);
                    vertex.joined.reserve(room);
                    vertex.joins.resize(room, false);
                }
                if plan.dispersion && vertex.dispersed.len() < room {
                    vertex.dispersed.resize(room, false);
                }
                for &path in &*vertex.joined {
                    vertex.joins[path as usize] = false;
                }
                vertex.joined.clear();
            }
        }
    }
}

impl KeptVertex {
    /// The subpaths of `list` have arrived here.
    pub fn note(&mut self, arrived: &Endpoints, dispersion: &Dispersion, list: &[u32], side: Side) {
        for &path in list {
            let joins = !arrived.kind[path as usize].is_delta();
            self.joins[path as usize] = joins;
            self.joined.push_if(path, joins);
        }
        if !self.dispersed.is_empty() {
            for &path in list {
                self.dispersed[path as usize] = dispersion.has_met(path, side);
            }
        }
    }

    /// Whether a path has met what disperses light, here or before.
    pub fn has_dispersed(&self, path: u32) -> bool {
        self.dispersed.get(path as usize).is_some_and(|d| *d)
    }
}
