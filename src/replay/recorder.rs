//! What paths of a scene are recorded and weighed with.

use super::oracle::{Oracle, Path, Reference};
use crate::scene::Scene;
use crate::transport::World;

/// Records and weighs paths of a scene.
pub struct Recorder<'a> {
    /// Whose paths.
    pub scene: &'a Scene,
    /// The same scene, prepared for the renderer.
    pub world: &'a World<'a>,
    /// The same scene, in `f64`.
    pub oracle: Oracle<'a>,
}

impl<'a> Recorder<'a> {
    /// For paths of `scene`, of which `world` was made.
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
