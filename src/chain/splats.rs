//! What chains splat: colours over targets, with exact weights.
//!
//! # Independent samples
//!
//! Large steps are independent samples of the whole picture, accepted or not. [`Batch::combine`]
//! has the film keep all of them, beside the states of the chains, in a layer of their own, weighed
//! against each other by the balance heuristic (Kelemen, Szirmay-Kalos, Antal and Csonka 2002). Of
//! `M` mutations, states have the density `I / b` in primary sample space, large steps, `p M` of
//! them, the density 1; so that with a constant `c`, about `p b`,
//!
//! ```text
//! w(u)     = (I / b) / (I / b + p)   = I / (I + c)     weight of u as a state
//! 1 - w(u) = p / (I / b + p)         = c / (I + c)     weight of u as a large step
//! ```
//!
//! A state is splatted with the colour `w F / I`, where `F` are its contributions and `I` their
//! mean channels, added up. Both layers hold the same splats:
//!
//! ```text
//! states:       b / M      * sum over states, by their Metropolis weights, of  w F / I
//! large steps:  c / (p M)  * sum over large steps of                           w F / I
//! ```
//!
//! The first has the expectation of `w F` (states have the density `I / b`, so that the scale has
//! to be the best `b` there is), the second, since `c w / I = c / (I + c) = 1 - w`, that of `(1 -
//! w) F`: `c` enters both, and any other would do. It is found before the chains march and stays;
//! `b` may be refined meanwhile. A state is splatted with `F / (I / b + p)` and its Metropolis
//! weight, a large step once more with weight 1: Kelemen's equations, but for `b`, which need not
//! be known when they splat.
//!
//! [`Batch::combine`]: super::batch::Batch::combine

use super::accept::colour;
use crate::film::{Destination, SplatLog};
use crate::simd::record::record;
use crate::simd::{Lanes, Vec3};
use crate::transport::records::SplatLanes;

/// Weights are kept as integers in units of 2^-32, so that a state's weight is exact however its
/// visits are grouped.
pub(super) const WEIGHT_BITS: u32 = 32;

record! {
    /// A splat of a chain's state. It is written when chains accept or reject, and read by the
    /// film's logs and by monitors.
    pub struct ChainSplat / ChainSplatLanes {
        /// Linear sRGB over the target of the state, at most 3 a channel; times `w` of
        /// `Batch::combine` if large steps are splatted too.
        colour: [f32; 3],
        /// Raster position, in pixels.
        raster: [f32; 2],
        /// Light vertices of its strategy.
        s: u32,
    } free 2
}

/// A splat with its colour over the target of its state, times `scale`.
#[inline(always)]
pub(super) fn normalised<L: Lanes>(
    splat: &SplatLanes<L>,
    target: L,
    scale: Option<L>,
) -> ChainSplatLanes<L> {
    let [r, g, b] = colour(splat.rgb.to_array(), target);
    let colour = Vec3::new(r, g, b);
    ChainSplatLanes {
        colour: scale.map_or(colour, |scale| colour * scale),
        raster: splat.raster,
        s: splat.s,
    }
}

/// Stores the splats of new current states, and returns those of the states that are left.
#[inline(always)]
pub(super) fn exchange<L: Lanes>(
    taken: L::Mask,
    new: ChainSplatLanes<L>,
    states: &mut [ChainSplat],
    left: &mut [ChainSplat],
    list: &[u32],
) -> ChainSplatLanes<L> {
    let old = ChainSplatLanes::load(states, list);
    ChainSplatLanes::select(taken, new, old).store(states, list);
    let goes = ChainSplatLanes::select(taken, old, new);
    goes.store(left, list);
    goes
}

impl<L: Lanes> ChainSplatLanes<L> {
    #[inline(always)]
    fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self {
            colour: Vec3::select(mask, a.colour, b.colour),
            raster: [0, 1].map(|i| L::select(mask, a.raster[i], b.raster[i])),
            s: L::uint_select(mask, a.s, b.s),
        }
    }
}

/// `w` of the module's equations.
#[inline(always)]
pub(super) fn weight<L: Lanes>(target: L, constant: L) -> L {
    // In this order nothing overflows that matters: a target beyond c has the weight 1, one far
    // below it that of its ratio.
    let one = L::one();
    (one / (one + constant / target)).or_zero(target.gt(L::zero()))
}

/// Logs splats with their weights; those without light need none, where there are several to a
/// state (`sparse`).
#[inline(always)]
pub(super) fn push(log: &mut SplatLog, states: &[ChainSplat], weights: &[u64], sparse: bool) {
    for (state, weight) in states.iter().zip(weights) {
        let [r, g, b] = state.colour;
        let dark = sparse && r + g + b == 0.0;
        log.push(state.colour, state.raster, if dark { 0 } else { *weight });
    }
}

/// The proposed state. If it was accepted it is `current`, otherwise `left`.
#[inline(always)]
pub(super) fn proposal<'a>(
    taken: f32,
    current: &'a ChainSplat,
    left: &'a ChainSplat,
) -> &'a ChainSplat {
    if taken > 0.0 { current } else { left }
}

/// The same destination for weights in units of 2^-32: divides its scale by 2^32.
pub(super) fn in_units(to: Destination) -> Destination {
    Destination {
        scale: to.scale / ONE as f64,
        ..to
    }
}

/// A weight of 1.
pub(super) const ONE: u64 = 1 << WEIGHT_BITS;

/// `x` in `[0, 1]` in units of 2^-32, rounded. In a sum with 2^52 the integer is the mantissa; a
/// cast would have to look for numbers that do not fit.
#[inline(always)]
pub(super) fn fixed(x: f32) -> u64 {
    let sum = f64::from(x) * ONE as f64 + (1u64 << 52) as f64;
    sum.to_bits() & ((1 << 52) - 1)
}

/// All ones for 1, 0 for 0.
#[inline(always)]
pub(super) fn mask(flag: f32) -> u64 {
    // Not a cast, which would look for numbers that do not fit.
    u64::from(flag.to_bits() != 0).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_rounded_shares() {
        for x in [0.0, 1.0, 0.5, 1e-9, 1e-20, 0.999_999_94, 1.0 / 3.0] {
            let exact = f64::from(x) * ONE as f64;
            assert!((fixed(x) as f64 - exact).abs() <= 0.5, "{x}");
        }
        assert_eq!(fixed(1.0), ONE);
        assert_eq!((mask(0.0), mask(1.0)), (0, u64::MAX));
    }
}
