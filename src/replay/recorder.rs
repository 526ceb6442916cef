//! What paths of a scene are recorded and weighed with.

use super::oracle::{Oracle, Path, Reference};
use crate::scene::Scene;
use crate::transport::World;

/// Records and weighs paths of a scene.
pub struct Recorder<'a> {
    pub scene: &'a Scene,
    pub world: &'a World<'a>,
    pub oracle: Oracle<'a>,
}

impl<'a> Recorder<'a> {
    pub fn new(scene: &'a Scene, world: &'a World<'a>) -> Self {
        Self {
            scene,
            world,
            oracle: Oracle::new(scene, world),
        }
    }

    /// Contribution and densities of a path under the given strategies, in `f64`.
    pub fn reference(&self, path: &Path, strategies: &[u32]) -> Reference {
        self.oracle.reference(path, strategies)
    }
}
