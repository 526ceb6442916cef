//! How far a path's worth moves if its vertices do: the conditioning that any comparison of `f32`
//! with `f64` has to allow for.

use super::compare::relative;
use super::oracle::path::{End, Path};
use super::oracle::reference::Reference;
use super::oracle::vector::*;
use super::oracle::warp;
use super::recorder::Recorder;

/// Rays start off surfaces by some ten half-ulps of the magnitudes in a position; scenes have a
/// radius of at most 1.
const POSITION_ERROR: f64 = 1e-6;
/// Positions on the surface are good to an ulp, and the normals of spheres turn by that over the
/// radius, here at least a tenth.
const NORMAL_ERROR: f64 = 1e-6;

/// Largest changes under small movements of the vertices.
#[derive(Clone, Debug, Default)]
pub struct Sensitivity {
    /// Of [`Reference::value`].
    pub value: f64,
    /// Of the MIS weight of the path's own strategy.
    pub weight: f64,
    /// Of the densities at each surface vertex, forth and back, relative.
    pub densities: Vec<[f64; 2]>,
}

impl Recorder<'_> {
    /// How far the reference moves if vertices move by what `f32` positions and ray offsets may:
    /// the tolerance of a comparison. Six movements in random directions, which follow from `seed`.
    pub fn sensitivity(&self, path: &Path, strategies: &[u32], seed: u64) -> Sensitivity {
        let still = self.reference(path, strategies);
        self.sensitivity_to(path, strategies, seed, &still, 3, 1.0)
    }

    /// The same for `pairs` of opposite movements, `factor` times as far, of a path whose reference
    /// is known.
    pub fn sensitivity_to(
        &self,
        path: &Path,
        strategies: &[u32],
        seed: u64,
        still: &Reference,
        pairs: usize,
        factor: f64,
    ) -> Sensitivity {
        let mut worst = Sensitivity {
            densities: vec![[0.0; 2]; still.joints.len()],
            ..Sensitivity::default()
        };
        let mut random = Directions(seed);
        for _ in 0..pairs {
            let start = random.0;
            // Both ways, so that one of them crosses any edge nearby.
            for sign in [-factor, factor] {
                random.0 = start;
                let mut moved = path.clone();
                let mut shift = |p: &mut V, by: f64| *p = add(*p, scale(random.next(), sign * by));
                for v in &mut moved.surface {
                    shift(&mut v.p, POSITION_ERROR);
                    shift(&mut v.ns, NORMAL_ERROR);
                    shift(&mut v.ng, NORMAL_ERROR);
                }
                match &mut moved.end {
                    End::Area { p, .. } => shift(p, POSITION_ERROR),
                    End::Sky { direction, .. } => {
                        shift(direction, NORMAL_ERROR);
                        *direction = unit(*direction);
                    }
                    End::Point { .. } | End::Distant { .. } => {}
                }
                let reference = self.reference(&moved, strategies);
                let change =
                    |now: f64, then: f64| if now == then { 0.0 } else { (now - then).abs() };
                let value = change(reference.value(), still.value());
                let weight = change(reference.weight(path.s), still.weight(path.s));
                worst.value = worst.value.max(value);
                worst.weight = worst.weight.max(weight);
                let joints = reference.joints.iter().zip(&still.joints);
                for (worst, (now, then)) in worst.densities.iter_mut().zip(joints) {
                    worst[0] = worst[0].max(relative(now.forth, then.forth));
                    worst[1] = worst[1].max(relative(now.back, then.back));
                }
            }
        }
        worst
    }
}

/// Uniformly distributed unit vectors from splitmix64 (Steele et al. 2014).
struct Directions(u64);

impl Directions {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn next(&mut self) -> V {
        warp::sphere(self.uniform(), self.uniform())
    }
}
