//! The figures of a walk beside those of its reference, one by one.

use super::oracle::reference::Reference;
use super::walk::{Subpath, Walk};
use crate::transport::paths::Side;

/// The densities of a direction that was sampled, in both precisions.
#[derive(Clone, Copy, Debug)]
pub struct Densities {
    /// Subpath that sampled it.
    pub side: Side,
    /// Vertex of the subpath; 1 is its first on a surface.
    pub vertex: usize,
    /// Vertex of the path, from the camera.
    pub joint: usize,
    /// As sampled, and the reverse.
    pub single: [f32; 2],
    /// The same of the reference.
    pub double: [f64; 2],
}

/// `|a - b| / |b|`: 0 where both are equal, infinite where only the reference is 0.
pub fn relative(a: f64, b: f64) -> f64 {
    if a == b {
        return 0.0;
    }
    let error = ((a - b) / b).abs();
    if error.is_nan() { f64::INFINITY } else { error }
}

/// The sampled densities of both subpaths, over solid angle; those of delta lobes over their own.
pub fn densities(walk: &Walk, reference: &Reference) -> Vec<Densities> {
    let k = reference.joints.len();
    let mut list = Vec::new();
    for (side, subpath) in [(Side::Camera, &walk.camera), (Side::Light, &walk.light)] {
        let steps = subpath
            .iter()
            .flat_map(|s: &Subpath| s.steps.iter().enumerate());
        for (i, step) in steps {
            let j = match side {
                Side::Camera => i,
                Side::Light => k.wrapping_sub(i + 1),
            };
            let (Some(sampled), Some(joint)) = (step.sampled, reference.joints.get(j)) else {
                continue;
            };
            let double = match side {
                Side::Camera => [joint.forth, joint.back],
                Side::Light if step.vertex.kind.is_delta() => [1.0, joint.forth / joint.back],
                Side::Light => [joint.back, joint.forth],
            };
            list.push(Densities {
                side,
                vertex: i + 1,
                joint: j,
                single: [sampled.pdf, sampled.pdf_reverse],
                double,
            });
        }
    }
    list
}

/// Mean of the channels of the contribution of one meeting, times the probability of its strategy;
/// before visibility.
pub fn contribution(walk: &Walk, meeting: usize) -> f64 {
    let rgb = walk.meetings.get(meeting).map_or([0.0; 3], |m| m.rgb);
    rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0 / f64::from(walk.factor.max(1.0))
}
