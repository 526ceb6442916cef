//! Normals of meshes through transforms of any scale.

use glam::{DMat3, DVec3, Vec3};

/// What vertex normals of a mesh are transformed by. Between vertices they are interpolated as long
/// as they are, so that all keep their proportions; one factor brings them to where `f32` holds
/// them.
pub(super) struct NormalMap {
    /// Largest entry about 1.
    by: DMat3,
    /// Brings the longest normal to about 1.
    scale: f64,
}

impl NormalMap {
    /// `normals` may be left out if the longest is about 1.
    pub fn of(by: DMat3, normals: &[DVec3]) -> Self {
        let entries = by.to_cols_array();
        let largest = |a: f64, b: f64| if b.is_finite() { a.max(b.abs()) } else { a };
        Self {
            by: by * to_about_one(entries.into_iter().fold(0.0, largest)),
            scale: to_about_one(
                (normals.iter())
                    .flat_map(|n| n.to_array())
                    .fold(0.0, largest),
            ),
        }
    }

    /// Zero if it is not a number.
    pub fn apply(&self, n: DVec3) -> Vec3 {
        let n = (self.by * (n * self.scale)).as_vec3();
        if n.is_finite() { n } else { Vec3::ZERO }
    }
}

/// The power of two that brings `x > 0` to about 1; exact, so that normals of length 1 keep their
/// bits. 1 for 0.
fn to_about_one(x: f64) -> f64 {
    if x > 0.0 {
        (-x.log2().round()).clamp(-1000.0, 1000.0).exp2()
    } else {
        1.0
    }
}
