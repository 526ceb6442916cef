//! Eight lanes with cheaper numbers: polynomials of the lowest degree that leaves relative errors
//! below 1e-3 (least maximum, by weighted least squares), and random numbers of the kind that a
//! kernel in a hurry makes for itself.
//!
//! What is cheap is asked at run time, so that both sides of a comparison are the same compiled
//! code and pay for asking.

use phalanx::simd::{Lanes, Numerics, Row, UintLanes, f32x8};
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

pub static CHEAP_MATH: AtomicBool = AtomicBool::new(false);
pub static CHEAP_RANDOM: AtomicBool = AtomicBool::new(false);

/// What makes the robust numbers.
type Base = f32x8;
type Uint = <Base as Lanes>::Uint;
type Mask = <Base as Lanes>::Mask;

#[derive(Clone, Copy, Debug)]
pub struct Cheap(Base);

/// Whether numbers are cheap now.
#[inline(always)]
fn on(what: &AtomicBool) -> bool {
    what.load(Relaxed)
}

impl Numerics for Cheap {
    /// Errors 6e-4 and 1.2e-5.
    #[inline(always)]
    fn sin_cos_octant(x: Self) -> (Self, Self) {
        if !on(&CHEAP_MATH) {
            let (s, c) = Base::sin_cos_octant(x.0);
            return (Self(s), Self(c));
        }
        let x2 = x * x;
        let s = (Self::splat(-0.162_427_89) * x2).mul_add(x, x);
        let c = Self::splat(0.040_488_93)
            .mul_add(x2, Self::splat(-0.499_776_3))
            .mul_add(x2, Self::one());
        (s, c)
    }

    /// Error 5e-4.
    #[inline(always)]
    fn ln_of(exponent: Self, z: Self) -> Self {
        if !on(&CHEAP_MATH) {
            return Self(Base::ln_of(exponent.0, z.0));
        }
        let p = Self::splat(-0.225_117_89)
            .mul_add(z, Self::splat(0.350_791_9))
            .mul_add(z, Self::splat(-0.501_838_1));
        exponent.mul_add(Self::splat(std::f32::consts::LN_2), (p * z).mul_add(z, z))
    }

    /// Error 1.3e-4.
    #[inline(always)]
    fn exp_of_rest(r: Self) -> Self {
        if !on(&CHEAP_MATH) {
            return Self(Base::exp_of_rest(r.0));
        }
        let p = Self::splat(0.166_628_13).mul_add(r, Self::splat(0.503_941_06));
        (p * r).mul_add(r, r) + Self::one()
    }

    /// Error 9e-4.
    #[inline(always)]
    fn atan_of_rest(z: Self) -> Self {
        if !on(&CHEAP_MATH) {
            return Self(Base::atan_of_rest(z.0));
        }
        (Self::splat(-0.307_625_54) * z * z).mul_add(z, z)
    }

    /// One hash to 32 bits, and on from there by a linear congruential generator whose high bits
    /// are folded over its low ones. Counters collide, which is part of the bargain.
    #[inline(always)]
    fn hash(v: [Uint; 4]) -> [Uint; 4] {
        if !on(&CHEAP_RANDOM) {
            return Base::hash(v);
        }
        let all = Uint::splat;
        let fold = |v: Uint| UintLanes::xor(v, UintLanes::shr::<16>(v));
        let mul = |a: Uint, b: u32| UintLanes::mul(a, all(b));
        let sum = [mul(v[1], 0x85eb_ca77), mul(v[2], 0xc2b2_ae3d), v[3]]
            .into_iter()
            .fold(mul(v[0], 0x9e37_79b1), UintLanes::add);
        let step = |v: Uint| UintLanes::add(mul(v, 1_664_525), all(1_013_904_223));
        let x = mul(fold(sum), 0x7feb_352d);
        let y = step(x);
        let z = step(y);
        let w = step(z);
        [fold(x), fold(y), fold(z), fold(w)]
    }
}

macro_rules! operators {
    ($($trait:ident $f:ident, $assign:ident $g:ident;)*) => { $(
        impl $trait for Cheap {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                Self(self.0.$f(other.0))
            }
        }
        impl $assign for Cheap {
            #[inline(always)]
            fn $g(&mut self, other: Self) {
                *self = self.$f(other);
            }
        }
    )* };
}
operators! {
    Add add, AddAssign add_assign;
    Sub sub, SubAssign sub_assign;
    Mul mul, MulAssign mul_assign;
}

impl Div for Cheap {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl Neg for Cheap {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

/// Methods that are those of the base.
macro_rules! as_the_base {
    ($(fn $f:ident($($arg:ident),*) -> Self;)*) => { $(
        #[inline(always)]
        fn $f(self $(, $arg: Self)*) -> Self {
            Self(Lanes::$f(self.0 $(, $arg.0)*))
        }
    )* };
    ($(fn $f:ident($arg:ident) -> Mask;)*) => { $(
        #[inline(always)]
        fn $f(self, $arg: Self) -> Mask {
            Lanes::$f(self.0, $arg.0)
        }
    )* };
}

impl Lanes for Cheap {
    const N: usize = Base::N;
    type Mask = Mask;
    type Uint = Uint;

    as_the_base! {
        fn mul_add(a, b) -> Self;
        fn sqrt() -> Self;
        fn min(other) -> Self;
        fn max(other) -> Self;
        fn abs() -> Self;
        fn floor() -> Self;
    }
    as_the_base! {
        fn lt(other) -> Mask;
        fn le(other) -> Mask;
        fn eq(other) -> Mask;
    }

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(Base::splat(x))
    }
    #[inline(always)]
    fn load(src: &[f32]) -> Self {
        Self(Lanes::load(src))
    }
    #[inline(always)]
    fn store(self, dst: &mut [f32]) {
        Lanes::store(self.0, dst);
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(Lanes::from_fn(f))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        Lanes::lane(self.0, i)
    }
    #[inline(always)]
    fn select(mask: Mask, a: Self, b: Self) -> Self {
        Self(<Base as Lanes>::select(mask, a.0, b.0))
    }
    #[inline(always)]
    fn to_bits(self) -> Uint {
        Lanes::to_bits(self.0)
    }
    #[inline(always)]
    fn from_bits(bits: Uint) -> Self {
        Self(<Base as Lanes>::from_bits(bits))
    }
    #[inline(always)]
    fn from_uint24(bits: Uint) -> Self {
        Self(<Base as Lanes>::from_uint24(bits))
    }
    #[inline(always)]
    fn uint_eq(a: Uint, b: Uint) -> Mask {
        <Base as Lanes>::uint_eq(a, b)
    }
    #[inline(always)]
    fn uint_lt(a: Uint, b: Uint) -> Mask {
        <Base as Lanes>::uint_lt(a, b)
    }
    #[inline(always)]
    fn uint_select(mask: Mask, a: Uint, b: Uint) -> Uint {
        <Base as Lanes>::uint_select(mask, a, b)
    }
    #[inline(always)]
    fn load_rows(rows: &[Row], index: &[u32]) -> [Self; Row::WIDTH] {
        Base::load_rows(rows, index).map(Self)
    }
    #[inline(always)]
    fn store_rows(columns: [Self; Row::WIDTH], rows: &mut [Row], index: &[u32]) {
        Base::store_rows(columns.map(|c| c.0), rows, index);
    }
}
