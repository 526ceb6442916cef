//! One path, step by step, from its primary samples: in `f32` by the renderer's kernels, and once more in `f64`.
//!
//! 1. [`Recorder::walk`] makes the path that given primary samples stand for, vertex by vertex, from the kernels that the renderer's waves
//!    call ([`walk`], `join`): positions, throughputs, densities, running sums, MIS weight and contribution, to the same bits as
//!    [`World::evaluate_multiplexed`](crate::transport::World::evaluate_multiplexed).
//! 2. [`Recorder::reference`] computes from the vertices alone, in `f64`, the contribution, the density under every strategy and the MIS weight
//!    ([`mod@reference`]); it shares no BSDF, density or weight with the renderer ([`bsdf`], [`sky`], [`lights`]).
//! 3. [`Recorder::retrace`] walks the path once more in `f64`, from the same primary samples along the same primitives, so that the whole of what
//!    `f32` does to a path can be told from what it does to the last formula.
//! 4. [`Recorder::sensitivity`] says how far these move if the vertices move by what `f32` makes of positions.
//!
//! Vertices are in internal space (see [`crate::scene`]), contributions in linear sRGB.

pub mod bsdf;
pub mod coated;
pub mod compare;
mod exact;
mod frustum;
mod join;
mod kernel;
pub mod lights;
pub mod panorama;
pub mod path;
pub mod reference;
pub mod report;
pub mod sensitivity;
pub mod sky;
pub mod spectral;
mod texels;
pub mod vector;
pub mod walk;
pub mod warp;

pub use self::path::{End, Path, Vertex};
pub use self::reference::{Joint, Reference};
pub use self::report::Report;
pub use self::sensitivity::Sensitivity;
pub use self::walk::{Fate, Walk};

use self::sky::Sky;
use crate::scene::Scene;
use crate::transport::World;

/// Records and weighs paths of a scene.
pub struct Recorder<'a> {
    pub scene: &'a Scene,
    pub world: &'a World<'a>,
    /// Probability of choosing each light.
    pub choice: Vec<f64>,
    /// Of each light whose emission goes by direction.
    skies: Vec<Option<Sky>>,
}

impl<'a> Recorder<'a> {
    pub fn new(scene: &'a Scene, world: &'a World<'a>) -> Self {
        Self {
            scene,
            world,
            choice: choice_probabilities(world),
            skies: (scene.lights.iter())
                .map(|l| Sky::of(scene, &l.kind))
                .collect(),
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
