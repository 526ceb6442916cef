//! Proposals: large steps draw all primary samples afresh, small steps move each by a Gaussian.
//!
//! Every dimension moves at every step; the law is that of pbrt's lazy catch-up, in which an untouched sample takes its missed small steps at
//! once (pbrt-v3, section 16.4.2), without samples that are used for the first time in a small step starting anywhere but uniform.

use crate::simd::rng::{Purpose, Stream, unit_float};
use crate::simd::{Lanes, UintLanes, math};
use crate::transport::samples::Samples;

/// Parameters of the mutation kernel.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    pub large_step_probability: f32,
    /// Standard deviation of a small step.
    pub sigma: f32,
    mutation: Stream,
    decision: Stream,
}

/// The largest `f32` below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// The probability that a uniform number, a multiple of 2^-24, is below `wanted`.
pub fn large_step_probability(wanted: f32) -> f64 {
    let grid = f64::from(1 << 24);
    (f64::from(wanted) * grid).ceil() / grid
}

impl Kernel {
    pub fn new(seed: u64, large_step_probability: f32, sigma: f32) -> Self {
        Self {
            large_step_probability,
            sigma,
            mutation: Stream::new(seed, Purpose::Mutation),
            decision: Stream::new(seed, Purpose::Decision),
        }
    }

    /// Writes the proposals of all chains for one iteration. `ids` are padded to a multiple of eight; `large` (1 or 0) and `decide` receive the
    /// kind of step and the uniform number of the acceptance test.
    pub fn propose<L: Lanes>(
        &self,
        ids: &[u32],
        iteration: u32,
        current: &Samples,
        proposed: &mut Samples,
        large: &mut [f32],
        decide: &mut [f32],
    ) {
        let y = L::Uint::splat(iteration);
        for start in (0..ids.len()).step_by(L::N) {
            let x = L::Uint::from_fn(|i| ids[start + i]);
            let [step, accept, ..]: [L; 4] = self.decision.uniforms(x, y, 0);
            accept.store(&mut decide[start..]);
            let is_large = step.lt(L::splat(self.large_step_probability));
            L::one().or_zero(is_large).store(&mut large[start..]);
            let dimensions = current.dimensions();
            for block in 0..dimensions.div_ceil(4) {
                let words = self.mutation.words::<L>(x, y, block as u32);
                let normals = normals::<L>(words);
                for c in 0..4.min(dimensions - 4 * block) {
                    let d = 4 * block + c;
                    let old = L::load(&current.row(d)[start..]);
                    let moved = wrap(normals[c].mul_add(L::splat(self.sigma), old));
                    let new = L::select(is_large, unit_float::<L>(words[c]), moved);
                    new.store(&mut proposed.row_mut(d)[start..]);
                }
            }
        }
    }
}

/// Into `[0, 1)`. `x - floor(x)` of a tiny negative number rounds to 1.
#[inline(always)]
pub fn wrap<L: Lanes>(x: L) -> L {
    (x - x.floor()).min(L::splat(ONE_MINUS_EPSILON))
}

/// Four independent standard normal numbers of four words (Box and Muller 1958).
#[inline(always)]
pub fn normals<L: Lanes>(words: [L::Uint; 4]) -> [L; 4] {
    let pair = |a: L::Uint, b: L::Uint| {
        // In (0, 1]: the logarithm is finite.
        let u = (L::from_uint24(a.shr::<8>()) + L::one()) * L::splat(1.0 / 16_777_216.0);
        let r = (math::ln(u) * L::splat(-2.0)).max(L::zero()).sqrt();
        let (x, y) = math::on_circle::<L>(b);
        (r * x, r * y)
    };
    let (a, b) = pair(words[0], words[1]);
    let (c, d) = pair(words[2], words[3]);
    [a, b, c, d]
}
