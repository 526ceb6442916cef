//! Several numbers in one float, in rows of conductors under a coat.

use super::microfacet::{pack_halves, unpack_halves};
use crate::simd::{Lanes, UintLanes, Vec3};

/// A thickness whose last eight bits say how often light may meet the conductor.
pub fn pack_bounces(thickness: f32, bounces: u32) -> f32 {
    let bits = thickness.max(f32::MIN_POSITIVE * 256.0).to_bits();
    f32::from_bits(bits & !0xff | bounces.min(255))
}

/// Greatest number of a packed colour.
pub const BRIGHTEST: f32 = 2.0;

/// What the lobe of a rough coat's conductor may be multiplied by, at least and at most.
const GAIN: [f32; 2] = [0.25, 4.0];

/// Steps of a forward share.
const SHARES: f32 = 127.0;

/// The bits of the least gain: those above are two of the exponent and seven of the mantissa.
const LEAST_GAIN: u32 = 0x3e80_0000;

/// Thickness of a rough coat as a half, gain of its conductor's lobe in nine bits (right to 1/256
/// of itself), and how much of later bounces goes forward, 0 to 1, in seven.
pub fn pack_layer(thickness: f32, gain: f32, forward: f32) -> f32 {
    let bits = gain.clamp(GAIN[0], GAIN[1]).to_bits() - LEAST_GAIN;
    let code = ((bits + (1 << 15)) >> 16).min(511);
    let share = (forward.clamp(0.0, 1.0) * SHARES).round() as u32;
    let half = pack_halves(thickness, 1.0).to_bits() & 0xffff_0000;
    f32::from_bits(half | code << 7 | share)
}

/// What [`pack_layer`] has packed.
#[inline(always)]
pub fn unpack_layer<L: Lanes>(packed: L) -> [L; 3] {
    let bits = packed.to_bits();
    let [thickness, _] = unpack_halves(packed);
    let code = bits.and(L::Uint::splat(0xff80)).shl::<9>();
    let gain = L::from_bits(code.add(L::Uint::splat(LEAST_GAIN)));
    let share = L::from_uint24(bits.and(L::Uint::splat(0x7f)));
    // A quotient is exactly 1 where all goes forward: what is left of the even share must be 0.
    [thickness, gain, share / L::splat(SHARES)]
}

/// Three numbers of eight bits, 0 to [`BRIGHTEST`], as one whole number.
pub fn pack_colour(colour: [f32; 3]) -> f32 {
    let step = |x: f32| (x / BRIGHTEST * 255.0).clamp(0.0, 255.0).round();
    (step(colour[0]) * 256.0 + step(colour[1])) * 256.0 + step(colour[2])
}

/// What [`pack_colour`] has packed.
#[inline(always)]
pub fn unpack_colour<L: Lanes>(packed: L) -> Vec3<L> {
    let (inverse, step) = (L::splat(1.0 / 256.0), L::splat(-256.0));
    let upper = (packed * inverse).floor();
    let first = (upper * inverse).floor();
    Vec3::new(
        first,
        first.mul_add(step, upper),
        upper.mul_add(step, packed),
    ) * L::splat(BRIGHTEST / 255.0)
}
