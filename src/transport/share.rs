//! Contributions that independent samples and chains bring together (Bitterli and Jarosz 2019,
//! "Selectively metropolised Monte Carlo light transport simulation").
//!
//! Of a contribution with the mean channel `y`, weighed among all strategies of its depth, samples
//! keep a part and leave the rest to chains:
//!
//! ```text
//! d / (y + d)     kept by samples, so that none brings more than d
//! y / (y + d)     left to chains
//! ```
//!
//! Whatever the constant `d` of a depth, both have the whole as their sum: each side may be as
//! noisy as it likes. `d = 0` leaves all to chains, `d = inf` nothing.

use super::records::Splat;
use crate::plan::DepthPlan;
use crate::simd::{Lanes, Vec3};

/// What samples keep of contributions, at most `bound` a path.
#[inline(always)]
pub(super) fn keep<L: Lanes>(rgb: Vec3<L>, bound: f32) -> Vec3<L> {
    let bound = L::splat(bound);
    rgb * (bound / (mean(rgb) + bound))
}

/// Leaves to chains what samples do not keep. Contributions are over the probability of their
/// strategy; those of a path count before.
pub(super) fn leave(depth: &DepthPlan, splats: &mut [Splat]) {
    for splat in splats {
        let [r, g, b] = splat.rgb;
        let value = (r + g + b) * (1.0 / 3.0);
        if value > 0.0 {
            let part = value / (value + depth.kept * depth.choice.factor(splat.s));
            splat.rgb = splat.rgb.map(|v| v * part);
        }
    }
}

#[inline(always)]
fn mean<L: Lanes>(rgb: Vec3<L>) -> L {
    (rgb.x + rgb.y + rgb.z) * L::splat(1.0 / 3.0)
}
