//! Proposals: large steps draw all primary samples afresh, small steps move each by an offset of a
//! fixed proposal, around the ring `[0, 1)`.
//!
//! Every dimension moves at every step, also those that the strategy at hand does not read. In
//! pbrt-v3 (section 16.4.2) samples move only when they are read, and then make up at once for the
//! small steps that they have missed: the same distribution. In both a sample that is first read in
//! a small step started uniform.
//!
//! Offsets of all proposals are as probable as their negatives, to the last bit: a bit of the
//! random word is the sign. On the ring proposals are then symmetric, and the acceptance is the
//! ratio of targets alone.

use crate::simd::rng::{Purpose, Stream, unit_float};
use crate::simd::{Lanes, UintLanes, math};
use crate::transport::samples::Samples;

/// The distribution of the offsets of small steps. All three scale with `sigma`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mutation {
    /// Normal, with standard deviation `sigma` (pbrt-v3, section 16.4.2).
    #[default]
    Gaussian,
    /// `± s2 exp(-ln(s2 / s1) u)` with uniform `u`: between `s1` and `s2`, all orders of magnitude
    /// alike (Kelemen et al. 2002). Where `sigma` is [`DEFAULT_SIGMA`] they are theirs, 1/1024
    /// and 1/64; both scale with `sigma`. The root mean square is 0.66 `sigma`.
    Kelemen,
    /// Cauchy, with half its offsets within `sigma`: mostly short, now and then as long as a large
    /// step.
    Cauchy,
}

/// pbrt's, and that for which [`Mutation::Kelemen`] has the bounds of its paper.
pub const DEFAULT_SIGMA: f32 = 0.01;

/// [`Mutation::Kelemen`]'s bounds at [`DEFAULT_SIGMA`].
const KELEMEN: [f32; 2] = [1.0 / 1024.0, 1.0 / 64.0];

impl Mutation {
    /// Every kind, the default first.
    pub const ALL: [Self; 3] = [Self::Gaussian, Self::Kelemen, Self::Cauchy];

    /// As on the command line and in figures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Kelemen => "kelemen",
            Self::Cauchy => "cauchy",
        }
    }
}

/// How chains propose: how often all afresh, and how far small steps go otherwise.
#[derive(Clone, Copy, Debug)]
pub struct ProposalDistribution {
    /// Probability of a step that draws all primary samples afresh.
    pub large_step_probability: f32,
    /// Scale of a small step, see [`Mutation`].
    pub sigma: f32,
    mutation: Mutation,
    /// Random words of steps.
    steps: Stream,
    /// Random words that choose large steps, and decide what is accepted.
    decisions: Stream,
}

/// The largest `f32` below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// The probability that a uniform number, a multiple of 2^-24, is below `wanted`.
pub fn large_step_probability(wanted: f32) -> f64 {
    let grid = f64::from(1 << 24);
    (f64::from(wanted) * grid).ceil() / grid
}

impl ProposalDistribution {
    /// With [`Mutation::Gaussian`].
    pub fn new(seed: u64, large_step_probability: f32, sigma: f32) -> Self {
        Self {
            large_step_probability,
            sigma,
            mutation: Mutation::Gaussian,
            steps: Stream::new(seed, Purpose::Mutation),
            decisions: Stream::new(seed, Purpose::Decision),
        }
    }

    /// The same with other offsets of small steps.
    pub fn with_mutation(self, mutation: Mutation) -> Self {
        Self { mutation, ..self }
    }

    /// The same for chains that do not count: they use separate random numbers.
    pub fn tuning(self, seed: u64) -> Self {
        Self {
            steps: Stream::new(seed, Purpose::Tuning),
            decisions: Stream::new(seed, Purpose::TuningDecision),
            ..self
        }
    }

    /// The same for chains that find out how well such chains do.
    pub fn piloting(self, seed: u64) -> Self {
        Self {
            steps: Stream::new(seed, Purpose::PilotMutation),
            decisions: Stream::new(seed, Purpose::PilotDecision),
            ..self
        }
    }

    /// Writes the proposals of all chains for one iteration. `ids` are padded to a multiple of
    /// eight; `large` (1 or 0) and `decide` receive the kind of step and the uniform number of
    /// the acceptance test.
    pub fn propose<L: Lanes>(
        &self,
        ids: &[u32],
        iteration: u32,
        current: &Samples,
        proposed: &mut Samples,
        large: &mut [f32],
        decide: &mut [f32],
    ) {
        let counter = (ids, iteration);
        let steps = (large, decide);
        match self.mutation {
            Mutation::Gaussian => {
                let proposal = Gaussian { sigma: self.sigma };
                self.propose_by::<L, _>(proposal, counter, current, proposed, steps);
            }
            Mutation::Kelemen => {
                let proposal = Kelemen::new(self.sigma);
                self.propose_by::<L, _>(proposal, counter, current, proposed, steps);
            }
            Mutation::Cauchy => {
                let proposal = Cauchy::new(self.sigma);
                self.propose_by::<L, _>(proposal, counter, current, proposed, steps);
            }
        }
    }

    #[inline(always)]
    fn propose_by<L: Lanes, O: Offsets>(
        &self,
        proposal: O,
        (ids, iteration): (&[u32], u32),
        current: &Samples,
        proposed: &mut Samples,
        (large, decide): (&mut [f32], &mut [f32]),
    ) {
        let y = L::Uint::splat(iteration);
        for start in (0..ids.len()).step_by(L::N) {
            let x = L::Uint::from_fn(|i| ids[start + i]);
            let [step, accept, ..]: [L; 4] = self.decisions.uniforms(x, y, 0);
            accept.store(&mut decide[start..]);
            let is_large = step.lt(L::splat(self.large_step_probability));
            L::one().or_zero(is_large).store(&mut large[start..]);
            let dimensions = current.dimensions();
            for block in 0..dimensions.div_ceil(4) {
                let words = self.steps.words::<L>(x, y, block as u32);
                let offsets = proposal.offsets::<L>(words);
                for c in 0..4.min(dimensions - 4 * block) {
                    let d = 4 * block + c;
                    let old = L::load(&current.row(d)[start..]);
                    let moved = wrap(offsets[c].mul_add(L::splat(proposal.scale()), old));
                    let new = L::select(is_large, unit_float::<L>(words[c]), moved);
                    new.store(&mut proposed.row_mut(d)[start..]);
                }
            }
        }
    }
}

/// A proposal of small steps.
trait Offsets {
    /// Offsets over [`Self::scale`], of four random words.
    fn offsets<L: Lanes>(&self, words: [L::Uint; 4]) -> [L; 4];
    fn scale(&self) -> f32;
}

struct Gaussian {
    sigma: f32,
}

impl Offsets for Gaussian {
    #[inline(always)]
    fn offsets<L: Lanes>(&self, words: [L::Uint; 4]) -> [L; 4] {
        normals::<L>(words)
    }
    #[inline(always)]
    fn scale(&self) -> f32 {
        self.sigma
    }
}

struct Kelemen {
    /// The upper bound, and the logarithm of the lower over the upper.
    most: f32,
    decay: f32,
}

impl Kelemen {
    fn new(sigma: f32) -> Self {
        let [s1, s2] = KELEMEN;
        Self {
            // Exactly 1 by default.
            most: s2 * (sigma / DEFAULT_SIGMA),
            decay: math::ln(s1 / s2),
        }
    }
}

impl Offsets for Kelemen {
    #[inline(always)]
    fn offsets<L: Lanes>(&self, words: [L::Uint; 4]) -> [L; 4] {
        words.map(|word| {
            // The highest bit is the sign, the next 24 the rest.
            let u = unit_float::<L>(word.shl::<1>());
            let size = math::exp(u * L::splat(self.decay));
            L::from_bits(size.to_bits().or(word.and(L::Uint::splat(1 << 31))))
        })
    }
    #[inline(always)]
    fn scale(&self) -> f32 {
        self.most
    }
}

/// Wound around a ring, a Cauchy proposal is the image of the uniform one: where `phi` is uniform,
/// `2 atan(tanh(g / 2) tan(phi / 2))` is wrapped Cauchy with the scale `g` (McCullagh 1996, "Mobius
/// transformation and Cauchy parameter estimation"), in radians, so that `g = 2 pi sigma`.
/// No offset is longer than half the ring, and none loses digits.
struct Cauchy {
    /// `tanh(pi sigma)`.
    squeeze: f32,
}

impl Cauchy {
    fn new(sigma: f32) -> Self {
        Self {
            squeeze: tanh(std::f64::consts::PI * f64::from(sigma)) as f32,
        }
    }
}

impl Offsets for Cauchy {
    #[inline(always)]
    fn offsets<L: Lanes>(&self, words: [L::Uint; 4]) -> [L; 4] {
        words.map(|word| {
            // Points of the circle and their opposites stand for the same half angle.
            let (x, y) = math::on_circle::<L>(word);
            math::atan2(y * L::splat(self.squeeze), x.abs())
        })
    }
    #[inline(always)]
    fn scale(&self) -> f32 {
        std::f32::consts::FRAC_1_PI
    }
}

/// Lambert's continued fraction, of exact operations only: systems' libraries differ. For `x >= 0`.
fn tanh(x: f64) -> f64 {
    // Beyond, 1 to the last digit; below, forty terms are enough.
    if x > 20.0 {
        return 1.0;
    }
    let terms = (0..40).rev().map(|i| f64::from(2 * i + 1));
    let tail = terms.fold(f64::INFINITY, |tail, odd| odd + x * x / tail);
    x / tail
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Mask, f32x8};

    #[test]
    fn every_word_moves_somewhere_and_back() {
        // Two words make two normal numbers; the second of them has the signs.
        let both = 1 << 31 | 1 << 30;
        expect_symmetric(Gaussian { sigma: 0.01 }, [0, both, 0, both], 0.06);
        let top = [1 << 31; 4];
        expect_symmetric(Kelemen::new(DEFAULT_SIGMA), top, 1.0 / 64.0);
        expect_symmetric(Kelemen::new(0.5), top, 0.8);
        let second = [1 << 30; 4];
        expect_symmetric(Cauchy::new(0.01), second, 0.5);
        expect_symmetric(Cauchy::new(1e6), second, 0.5);
    }

    #[test]
    fn hyperbolic_tangents() {
        for i in 0..3000 {
            let x = f64::from(i) * 0.01;
            assert!((tanh(x) - x.tanh()).abs() <= 1e-15 * x.tanh(), "{x}");
        }
        assert_eq!(tanh(f64::INFINITY), 1.0);
    }

    /// Every offset there is and its negative move every sample into the ring, and are opposite to
    /// the last bit.
    fn expect_symmetric(proposal: impl Offsets, signs: [u32; 4], longest: f32) {
        for i in 0..1 << 19 {
            let words = f32x8_words(i);
            let there = proposal.offsets::<f32x8>(words);
            let flipped = std::array::from_fn(|c| words[c].xor(UintLanes::splat(signs[c])));
            let back = proposal.offsets::<f32x8>(flipped);
            for c in 0..4 {
                assert!(f32x8::uint_eq((-there[c]).to_bits(), back[c].to_bits()).all());
                for old in [0.0, 1e-30, 0.25, ONE_MINUS_EPSILON] {
                    let new =
                        wrap(there[c].mul_add(f32x8::splat(proposal.scale()), f32x8::splat(old)));
                    assert!(
                        new.ge(f32x8::zero()).and(new.lt(f32x8::one())).all(),
                        "{new:?}"
                    );
                }
                assert!(
                    (there[c].abs() * f32x8::splat(proposal.scale()))
                        .le(f32x8::splat(longest))
                        .all()
                );
            }
        }
    }

    /// Each value of 24 bits in some lane of some word, for `i` below 2^19; other bits as they
    /// come.
    fn f32x8_words(i: u32) -> [<f32x8 as Lanes>::Uint; 4] {
        std::array::from_fn(|c| {
            let low = i.wrapping_mul(0x9e37_79b9) >> 24;
            UintLanes::from_fn(|lane| (i << 5 | (c as u32) << 3 | lane as u32) << 8 | low)
        })
    }
}
