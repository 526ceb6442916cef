//! What paths of a scene are recorded and weighed with.

use super::sky::Sky;
use crate::scene::Scene;
use crate::transport::World;

/// Records and weighs paths of a scene.
pub struct Recorder<'a> {
    pub scene: &'a Scene,
    pub world: &'a World<'a>,
    /// Probability of choosing each light.
    pub choice: Vec<f64>,
    /// Of each light whose emission goes by direction.
    pub(super) skies: Vec<Option<Sky>>,
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
