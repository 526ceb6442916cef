//! The few transcendental functions the kernels need, as polynomials in [`Lanes`] operations: every
//! width gives the same bits. Coefficients of `ln`, `exp`, `atan` and `asin` are those of the
//! Cephes library (Moshier 1992, `single/`); sine and cosine are its kernels behind an exact
//! reduction of turns. The polynomials themselves are in [`numerics`](super::Numerics).

use super::{Lanes, Mask, UintLanes};

/// `(sin 2 pi u, cos 2 pi u)` for `u` in `[-1, 2]`; absolute error below 1.5e-7.
#[inline(always)]
pub fn sin_cos_turns<L: Lanes>(u: L) -> (L, L) {
    // Quadrant, and the rest in [-1/8, 1/8] turns: both steps are exact.
    let q = u.mul_add(L::splat(4.0), L::splat(0.5)).floor();
    let r = q.mul_add(L::splat(-0.25), u);
    let (s, c) = sin_cos_eighth(r);
    // q mod 4 through floats: q is a small integer.
    let q4 = (q * L::splat(0.25)).floor().mul_add(L::splat(-4.0), q);
    let one = L::one();
    let odd = q4.eq(one).or(q4.eq(L::splat(3.0)));
    let (sin, cos) = (L::select(odd, c, s), L::select(odd, s, c));
    let sin = L::select(q4.ge(L::splat(2.0)), -sin, sin);
    let cos = L::select(q4.eq(one).or(q4.eq(L::splat(2.0))), -cos, cos);
    (sin, cos)
}

/// The same for `u` in `[-1/8, 1/8]`.
#[inline(always)]
fn sin_cos_eighth<L: Lanes>(u: L) -> (L, L) {
    L::sin_cos_octant(u * L::splat(std::f32::consts::TAU))
}

/// A point of the unit circle from a random word, uniform: the three highest bits choose the
/// octant, the next 21 the place in it. Neither a range to reduce nor quadrants to tell apart.
#[inline(always)]
pub fn on_circle<L: Lanes>(word: L::Uint) -> (L, L) {
    let place = L::from_uint24(word.shr::<8>().and(L::Uint::splat(0x1f_ffff)));
    // At the middles of 2^21 intervals.
    let eighth = place.mul_add(L::splat(1.0 / 16_777_216.0), L::splat(1.0 / 33_554_432.0));
    let (s, c) = sin_cos_eighth(eighth);
    let steep = L::uint_eq(word.and(L::Uint::splat(1 << 29)), L::Uint::splat(0));
    let sign = L::Uint::splat(1 << 31);
    let signed = |v: L, word: L::Uint| L::from_bits(v.to_bits().xor(word.and(sign)));
    (
        signed(L::select(steep, c, s), word),
        signed(L::select(steep, s, c), word.shl::<1>()),
    )
}

/// Natural logarithm of a positive normal number; relative error a few ulp.
#[inline(always)]
pub fn ln<L: Lanes>(x: L) -> L {
    let bits = x.to_bits();
    // Mantissa into [sqrt(1/2), sqrt(2)); 128 more in the exponent keeps it positive.
    let shifted = bits.add(L::Uint::splat(0x4000_0000 - 0x3f35_04f3));
    let exponent = L::from_uint24(shifted.shr::<23>()) - L::splat(128.0);
    let mantissa = L::from_bits(
        shifted
            .and(L::Uint::splat(0x007f_ffff))
            .add(L::Uint::splat(0x3f35_04f3)),
    );
    L::ln_of(exponent, mantissa - L::one())
}

/// Exponential; arguments outside `[-87, 88]` are clamped to it.
#[inline(always)]
pub fn exp<L: Lanes>(x: L) -> L {
    let x = x.max(L::splat(-87.0)).min(L::splat(88.0));
    let n = x
        .mul_add(L::splat(std::f32::consts::LOG2_E), L::splat(0.5))
        .floor();
    let r = n.mul_add(L::splat(-0.693_359_4), x);
    let r = n.mul_add(L::splat(2.121_944_4e-4), r);
    let y = L::exp_of_rest(r);
    // 2^n by its bits; n + 127 is in [1, 254].
    let scale = L::from_bits(float_to_uint(n + L::splat(127.0)).shl::<23>());
    y * scale
}

/// Arc tangent of `y / x` in `(-pi, pi]`; `atan2(0, 0)` is 0.
#[inline(always)]
pub fn atan2<L: Lanes>(y: L, x: L) -> L {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = (ax.min(ay), ax.max(ay));
    let ratio = L::select(large.gt(L::zero()), small / large, L::zero());
    // atan on [0, 1]: fold above tan(pi / 8).
    let fold = ratio.gt(L::splat(0.414_213_57));
    let z = L::select(fold, (ratio - L::one()) / (ratio + L::one()), ratio);
    let a = L::atan_of_rest(z);
    let a = L::select(fold, a + L::splat(std::f32::consts::FRAC_PI_4), a);
    let a = L::select(ay.gt(ax), L::splat(std::f32::consts::FRAC_PI_2) - a, a);
    let a = L::select(x.lt(L::zero()), L::splat(std::f32::consts::PI) - a, a);
    a.copysign(y)
}

/// Arc cosine; the argument is clamped to `[-1, 1]`.
#[inline(always)]
pub fn acos<L: Lanes>(x: L) -> L {
    let x = x.max(L::splat(-1.0)).min(L::one());
    let s = ((L::one() - x) * (L::one() + x)).max(L::zero()).sqrt();
    atan2(s, x)
}

/// Uniform samples of the square to the unit disk (Shirley and Chiu 1997, "A Low Distortion Map
/// Between Disk and Square").
#[inline(always)]
pub fn concentric_disk<L: Lanes>(u: L, v: L) -> (L, L) {
    let a = u.mul_add(L::splat(2.0), L::splat(-1.0));
    let b = v.mul_add(L::splat(2.0), L::splat(-1.0));
    let wide = a.abs().gt(b.abs());
    let (r, other) = (L::select(wide, a, b), L::select(wide, b, a));
    // Turns: (other / r) / 8, or a quarter less that.
    let eighth = L::select(r.eq(L::zero()), L::zero(), other / r) * L::splat(0.125);
    let turns = L::select(wide, eighth, L::splat(0.25) - eighth);
    let (sin, cos) = sin_cos_turns(turns);
    (r * cos, r * sin)
}

/// A cosine-distributed unit vector around `+z`; its density is `z / pi`.
#[inline(always)]
pub fn cosine_hemisphere<L: Lanes>(u: L, v: L) -> super::Vec3<L> {
    let (x, y) = concentric_disk(u, v);
    let z = (L::one() - x * x - y * y).max(L::zero()).sqrt();
    super::Vec3::new(x, y, z)
}

/// A uniformly distributed unit vector.
#[inline(always)]
pub fn uniform_sphere<L: Lanes>(u: L, v: L) -> super::Vec3<L> {
    let z = u.mul_add(L::splat(-2.0), L::one());
    let r = (L::one() - z * z).max(L::zero()).sqrt();
    let (sin, cos) = sin_cos_turns(v);
    super::Vec3::new(r * cos, r * sin, z)
}

/// A non-negative integer below 2^22, held as a float, to an integer.
#[inline(always)]
pub fn float_to_uint<L: Lanes>(x: L) -> L::Uint {
    // 2^23 + x has x in its mantissa.
    (x + L::splat(8_388_608.0))
        .to_bits()
        .and(L::Uint::splat(0x007f_ffff))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::f32x8;

    /// Largest error of `f` against `g` over a fine sweep, in units of the last place of the true
    /// value but at least of `floor`.
    fn worst_ulp(
        range: (f64, f64),
        floor: f64,
        f: impl Fn(f32) -> f32,
        g: impl Fn(f64) -> f64,
    ) -> f64 {
        let n = 1_000_000;
        (0..=n)
            .map(|i| (range.0 + (range.1 - range.0) * i as f64 / n as f64) as f32)
            .map(|x| {
                let truth = g(x as f64);
                let ulp = truth.abs().max(floor) * f64::from(f32::EPSILON) / 2.0;
                (f(x) as f64 - truth).abs() / ulp
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn errors_in_ulp() {
        let tau = std::f64::consts::TAU;
        // Sine and cosine are absolute: near their zeros the argument itself is rounded.
        let s = worst_ulp((0.0, 1.0), 1.0, |x| sin_cos_turns(x).0, |x| (tau * x).sin());
        let c = worst_ulp((0.0, 1.0), 1.0, |x| sin_cos_turns(x).1, |x| (tau * x).cos());
        let l = worst_ulp((1e-6, 1.0), 1e-1, ln, f64::ln);
        let l2 = worst_ulp((1.0, 1e6), 1e-1, ln, f64::ln);
        let e = worst_ulp((-80.0, 80.0), 0.0, exp, f64::exp);
        let a = worst_ulp((-1.0, 1.0), 1.0, acos, f64::acos);
        let t = worst_ulp(
            (-1.0, 1.0),
            0.1,
            |x| atan2(x, 0.3),
            |x| x.atan2(0.3f32 as f64),
        );
        println!("sin {s:.2} cos {c:.2} ln {l:.2} {l2:.2} exp {e:.2} acos {a:.2} atan2 {t:.2} ulp");
        for worst in [s, c, l, l2, e, t] {
            assert!(worst < 4.0, "{worst}");
        }
        // acos near 1 amplifies the rounding of 1 - x^2 under the root.
        assert!(a < 8.0, "{a}");
    }

    #[test]
    fn words_spread_evenly_over_the_circle() {
        let n = 1 << 16;
        let mut angles: Vec<f64> = (0..n)
            .map(|i: u32| {
                // One word in each of n intervals.
                let (x, y) = on_circle::<f32>(i << 16 | 0x8000);
                assert!((x.hypot(y) - 1.0).abs() < 2e-7);
                f64::from(y).atan2(f64::from(x))
            })
            .collect();
        angles.sort_by(f64::total_cmp);
        let step = std::f64::consts::TAU / f64::from(n);
        for pair in angles.windows(2) {
            assert!((pair[1] - pair[0] - step).abs() < 1e-6 + 0.01 * step);
        }
    }

    #[test]
    fn widths_agree_to_the_bit() {
        for i in 0..10_000u32 {
            let x: [f32; 8] = std::array::from_fn(|l| (i * 8 + l as u32) as f32 / 80_000.0);
            let v = f32x8::new(x);
            let (s8, c8) = sin_cos_turns(v);
            let y = v * f32x8::splat(2.0) - f32x8::splat(1.0);
            let (l8, e8, a8, t8) = (
                ln(v + f32x8::splat(1e-7)),
                exp(y * f32x8::splat(50.0)),
                acos(y),
                atan2(y, v),
            );
            for l in 0..8 {
                let (s, c) = sin_cos_turns(x[l]);
                let y = x[l] * 2.0 - 1.0;
                assert_eq!(s8.lane(l).to_bits(), s.to_bits());
                assert_eq!(c8.lane(l).to_bits(), c.to_bits());
                assert_eq!(l8.lane(l).to_bits(), ln(x[l] + 1e-7).to_bits());
                assert_eq!(e8.lane(l).to_bits(), exp(y * 50.0).to_bits());
                assert_eq!(a8.lane(l).to_bits(), acos(y).to_bits());
                assert_eq!(t8.lane(l).to_bits(), atan2(y, x[l]).to_bits());
            }
        }
    }
}
