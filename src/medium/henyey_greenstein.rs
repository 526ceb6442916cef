//! The phase function of Henyey and Greenstein (1941), as pbrt has it. Both directions point away
//! from the vertex, so that what goes straight on has a cosine of -1 between them.

use crate::simd::{Frame, Lanes, Vec3, math};
use std::f32::consts::PI;

/// Value and density of `wi` given `wo`, per solid angle; the same with the two exchanged.
#[inline(always)]
pub fn value<L: Lanes>(g: L, wo: Vec3<L>, wi: Vec3<L>) -> L {
    let one = L::one();
    // `1 + g^2 + 2 g cos`, by the half angle that is small where the peak is: of nearly opposite
    // directions the cosine has lost its digits.
    let forward = g.ge(L::zero());
    let (plus, minus) = ((wo + wi).length2(), (wo - wi).length2());
    let gap = L::select(forward, one - g, one + g);
    let far = L::select(forward, plus, minus);
    let d = gap.mul_add(gap, g.abs() * far);
    (one - g) * (one + g) / (L::splat(4.0 * PI) * d * d.sqrt())
}

/// A direction distributed so, and its density.
#[inline(always)]
pub fn sample<L: Lanes>(g: L, wo: Vec3<L>, u: [L; 2]) -> (Vec3<L>, L) {
    let one = L::one();
    let x = one - u[0] - u[0];
    // Inversion without a division by `g`, which may be 0.
    let below = g.mul_add(x, one);
    let half = L::splat(0.5);
    let (x2, g2) = (x * x, g * g);
    let above = x + half * g * (x2 + L::splat(3.0)) + g2 * x + half * g * g2 * (x2 - one);
    let cos = (-above / (below * below)).max(-one).min(one);
    let sin = ((one - cos) * (one + cos)).max(L::zero()).sqrt();
    let (s, c) = math::sin_cos_turns(u[1]);
    let frame = Frame::new(wo);
    let wi = frame.to_world(Vec3::new(sin * c, sin * s, cos)).normalize();
    (wi, value(g, wo, wi))
}
