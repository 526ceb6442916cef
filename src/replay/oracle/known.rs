//! What the oracle knows of a scene, and all that it asks the renderer.

use super::path::PathVertex;
use super::sky::Sky;
use crate::camera::Region;
use crate::scene::{NONE, Scene, Sides};
use crate::surface::Tabulated;
use crate::transport::World;

/// Weighs paths of a scene in `f64`.
pub struct Oracle<'a> {
    pub(super) scene: &'a Scene,
    /// Probability of choosing each light.
    pub choice: Vec<f64>,
    /// Of each light whose emission goes by direction.
    pub(super) skies: Vec<Option<Sky>>,
    /// What tells reflections from transmissions, if there are shading normals at all.
    pub(in crate::replay) sides: Option<Sides>,
    /// What tabulated BSDFs look up.
    pub(super) tables: &'a Tabulated,
    /// Raster positions that are sampled.
    pub(super) region: Region,
    /// The camera has a lens.
    pub(super) lens: bool,
    /// Some BSDF asks for tangents.
    pub(super) tangents: bool,
    /// Radius of the ball that distant lights shine on.
    pub(super) radius: f64,
    world: &'a World<'a>,
}

impl<'a> Oracle<'a> {
    /// For paths of `scene`, of which `world` was made.
    pub fn new(scene: &'a Scene, world: &'a World<'a>) -> Self {
        Self {
            scene,
            choice: choice_probabilities(world),
            skies: (scene.lights.iter())
                .map(|l| Sky::of(scene, &l.kind))
                .collect(),
            sides: world.sides,
            tables: &world.materials.tables,
            region: world.camera.region,
            lens: world.plan.lens,
            tangents: world.wanted.tangent,
            radius: world.geometry.radius.into(),
            world,
        }
    }

    /// Rays can meet an area light by chance.
    pub(super) fn is_met(&self, light: u32) -> bool {
        self.world.lights.is_met(light)
    }

    /// A vertex at barycentric coordinates `b`, with the shading frame that its bump or normal map
    /// makes of it.
    pub(super) fn perturbed(&self, v: PathVertex, b: [f64; 2]) -> PathVertex {
        let Some(perturbation) = v.perturbation else {
            return v;
        };
        let d = (self.world.geometry).derivatives((v.primitive, NONE), b, v.p.into());
        let normals = [v.ns.into(), v.ng.into()];
        let materials = &self.world.materials;
        match materials.perturb(v.material as usize, &perturbation, &d, normals) {
            Some(perturbed) => PathVertex {
                ns: perturbed.ns.to_array(),
                tangent: perturbed.tangent.to_array(),
                ..v
            },
            None => v,
        }
    }
}

/// The widths of the lights' intervals, exactly: choices change only at multiples of 2^-24.
fn choice_probabilities(world: &World) -> Vec<f64> {
    let n = world.lights.len();
    let grid = 1u32 << 24;
    let at = |i: u32| world.lights.choose::<f32>(i as f32 / grid as f32, 1)[0] as usize;
    // First grid point whose light is beyond `light`.
    let end = |light: usize| {
        let (mut low, mut high) = (0, grid);
        while low < high {
            let mid = low + (high - low) / 2;
            if at(mid) > light {
                high = mid;
            } else {
                low = mid + 1;
            }
        }
        low
    };
    let mut start = 0;
    (0..n)
        .map(|light| {
            let stop = end(light);
            let p = f64::from(stop - start) / f64::from(grid);
            start = stop;
            p
        })
        .collect()
}
