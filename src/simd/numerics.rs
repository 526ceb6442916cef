//! The choices that a lane type makes about its numbers: what polynomials leave of elementary
//! functions, and a hash.
//!
//! Phalanx has one choice of each. They are methods of a trait so that others can be put in their
//! place from outside: `benches/robust` does, to measure what accuracy costs.

use super::{Lanes, UintLanes};

/// The provided methods are what all pictures are made with.
pub trait Numerics: Sized {
    /// `(sin x, cos x)` for `x` in `[-pi / 4, pi / 4]`.
    #[inline(always)]
    fn sin_cos_octant(x: Self) -> (Self, Self)
    where
        Self: Lanes,
    {
        let all = Self::splat;
        let x2 = x * x;
        let s = all(-1.951_529_6e-4)
            .mul_add(x2, all(8.332_161e-3))
            .mul_add(x2, all(-1.666_665_5e-1));
        let s = (s * x2).mul_add(x, x);
        let c = all(2.443_315_7e-5)
            .mul_add(x2, all(-1.388_731_6e-3))
            .mul_add(x2, all(4.166_664_6e-2));
        let c = (c * x2).mul_add(x2, all(-0.5).mul_add(x2, Self::one()));
        (s, c)
    }

    /// `ln(2^exponent (1 + z))` for `z` from `sqrt(1/2) - 1` to `sqrt(2) - 1`.
    #[inline(always)]
    fn ln_of(exponent: Self, z: Self) -> Self
    where
        Self: Lanes,
    {
        let all = Self::splat;
        let p = all(7.037_683_6e-2)
            .mul_add(z, all(-1.151_461e-1))
            .mul_add(z, all(1.167_699_9e-1))
            .mul_add(z, all(-1.242_014_1e-1))
            .mul_add(z, all(1.424_932_3e-1))
            .mul_add(z, all(-1.666_805_8e-1))
            .mul_add(z, all(2.000_071_5e-1))
            .mul_add(z, all(-2.499_999_4e-1))
            .mul_add(z, all(3.333_333e-1));
        let z2 = z * z;
        let y = p * z2 * z;
        let y = exponent.mul_add(all(-2.121_944_4e-4), y);
        let y = all(-0.5).mul_add(z2, y);
        exponent.mul_add(all(0.693_359_4), z + y)
    }

    /// `e^r` for `r` in `[-ln 2 / 2, ln 2 / 2]`.
    #[inline(always)]
    fn exp_of_rest(r: Self) -> Self
    where
        Self: Lanes,
    {
        let all = Self::splat;
        let p = all(1.987_569_1e-4)
            .mul_add(r, all(1.398_2e-3))
            .mul_add(r, all(8.333_452e-3))
            .mul_add(r, all(4.166_579_6e-2))
            .mul_add(r, all(1.666_666_6e-1))
            .mul_add(r, all(0.5));
        (p * r).mul_add(r, r) + Self::one()
    }

    /// Arc tangent of `z` in `[-tan(pi / 8), tan(pi / 8)]`.
    #[inline(always)]
    fn atan_of_rest(z: Self) -> Self
    where
        Self: Lanes,
    {
        let all = Self::splat;
        let z2 = z * z;
        let p = all(8.053_744_6e-2)
            .mul_add(z2, all(-1.387_768_5e-1))
            .mul_add(z2, all(1.997_771e-1))
            .mul_add(z2, all(-3.333_295e-1));
        (p * z2).mul_add(z, z)
    }

    /// Four words that look random, a function of four: pcg4d (Jarzynski and Olano 2020, "Hash
    /// Functions for GPU Rendering", JCGT 9(3), section 4.2).
    #[inline(always)]
    fn hash(v: [Self::Uint; 4]) -> [Self::Uint; 4]
    where
        Self: Lanes,
    {
        let a = Self::Uint::splat(1_664_525);
        let c = Self::Uint::splat(1_013_904_223);
        let step = |v: Self::Uint| v.mul(a).add(c);
        let (mut x, mut y, mut z, mut w) = (step(v[0]), step(v[1]), step(v[2]), step(v[3]));
        x = x.add(y.mul(w));
        y = y.add(z.mul(x));
        z = z.add(x.mul(y));
        w = w.add(y.mul(z));
        let fold = |v: Self::Uint| v.xor(v.shr::<16>());
        (x, y, z, w) = (fold(x), fold(y), fold(z), fold(w));
        x = x.add(y.mul(w));
        y = y.add(z.mul(x));
        z = z.add(x.mul(y));
        w = w.add(y.mul(z));
        [x, y, z, w]
    }
}

impl Numerics for f32 {}
impl Numerics for super::f32x8 {}
