//! What integrators of Markov chains differ in.

use crate::transport::Host;

/// Hosts with a film layer of their own; further ones share the last.
pub(super) const LAYERS: usize = 16;

/// A Metropolis integrator.
pub(super) struct Method {
    pub name: &'static str,
    /// An integral each; ascending by depth.
    pub hosts: Vec<Host>,
    /// Large steps are splatted as independent samples, too.
    pub combined: bool,
}

impl Method {
    /// Layers of the film for so many hosts.
    pub fn layers(hosts: usize, combined: bool) -> usize {
        hosts.clamp(1, LAYERS) + usize::from(combined)
    }

    /// The layer for large steps.
    pub fn independent(&self) -> Option<usize> {
        self.combined.then(|| self.hosts.len().clamp(1, LAYERS))
    }
}
