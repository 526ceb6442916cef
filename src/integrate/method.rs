//! What integrators of Markov chains differ in.

use crate::transport::PathSampler;

/// Path samplers with a film layer of their own; further ones share the last.
pub(super) const LAYERS: usize = 16;

/// A Metropolis integrator.
pub(super) struct Method {
    pub name: &'static str,
    /// An integral each; ascending by depth.
    pub samplers: Vec<PathSampler>,
    /// Large steps are splatted as independent samples, too.
    pub combined: bool,
}

impl Method {
    /// Layers of the film for so many samplers.
    pub fn layers(samplers: usize, combined: bool) -> usize {
        samplers.clamp(1, LAYERS) + usize::from(combined)
    }

    /// The layer for large steps.
    pub fn independent(&self) -> Option<usize> {
        self.combined.then(|| self.samplers.len().clamp(1, LAYERS))
    }
}
