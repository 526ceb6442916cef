//! What [`math`](super::math) and [`rng`](super::rng) are measured against ([`crate::switches`]): polynomials of the lowest degree that
//! leaves relative errors below 1e-3 (least maximum, by weighted least squares), and the kind of random numbers that a kernel in a hurry
//! makes for itself.

use super::{Lanes, UintLanes};

/// `(sin x, cos x)` for `x` in `[-pi / 4, pi / 4]`; errors 6e-4 and 1.2e-5.
#[inline(always)]
pub fn sin_cos<L: Lanes>(x: L) -> (L, L) {
    let x2 = x * x;
    let s = (L::splat(-0.162_427_89) * x2).mul_add(x, x);
    let c = L::splat(0.040_488_93)
        .mul_add(x2, L::splat(-0.499_776_3))
        .mul_add(x2, L::one());
    (s, c)
}

/// `ln(1 + z)` for `z` from `sqrt(1/2) - 1` to `sqrt(2) - 1`; error 5e-4.
#[inline(always)]
pub fn ln_1p<L: Lanes>(z: L) -> L {
    let p = L::splat(-0.225_117_89)
        .mul_add(z, L::splat(0.350_791_9))
        .mul_add(z, L::splat(-0.501_838_1));
    (p * z).mul_add(z, z)
}

/// `e^r` for `r` in `[-ln 2 / 2, ln 2 / 2]`; error 1.3e-4.
#[inline(always)]
pub fn exp<L: Lanes>(r: L) -> L {
    let p = L::splat(0.166_628_13).mul_add(r, L::splat(0.503_941_06));
    (p * r).mul_add(r, r) + L::one()
}

/// Arc tangent of `z` in `[-tan(pi / 8), tan(pi / 8)]`; error 9e-4.
#[inline(always)]
pub fn atan<L: Lanes>(z: L) -> L {
    (L::splat(-0.307_625_54) * z * z).mul_add(z, z)
}

/// Four words of a counter: one hash to 32 bits, and on from there by a linear congruential generator whose high bits are folded over its
/// low ones. Counters collide, which is part of the bargain.
#[inline(always)]
pub fn words<L: Lanes>(v: [L::Uint; 4]) -> [L::Uint; 4] {
    let all = L::Uint::splat;
    let fold = |v: L::Uint| v.xor(v.shr::<16>());
    let sum = (v[0].mul(all(0x9e37_79b1)))
        .add(v[1].mul(all(0x85eb_ca77)))
        .add(v[2].mul(all(0xc2b2_ae3d)))
        .add(v[3]);
    let step = |v: L::Uint| v.mul(all(1_664_525)).add(all(1_013_904_223));
    let x = fold(sum).mul(all(0x7feb_352d));
    let y = step(x);
    let z = step(y);
    let w = step(z);
    [fold(x), fold(y), fold(z), fold(w)]
}
