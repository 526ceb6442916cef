//! Lanes: one source for every width.
//!
//! 1. Every kernel is generic over [`Lanes`] and is instantiated at one lane (plain `f32`) and at
//!    eight ([`wide::f32x8`]).
//! 2. Only operations that IEEE 754 defines exactly are offered, plus polynomials built of them
//!    ([`math`]), so both widths give the same bits. `mul_add` is fused in both widths or in
//!    neither.
//! 3. `min` and `max` follow one NaN rule: the second operand is returned unless the comparison is
//!    true.
//! 4. Records of eight floats ([`Row`]) are loaded whole and transposed: x86-64-v3 gathers are no
//!    faster than scalar loads, and a record is one cache line where eight arrays are eight.
//!    [`record`] gives their fields names.

mod eight;
pub mod math;
mod numerics;
mod one;
pub mod prefetch;
pub mod record;
pub mod rng;
pub mod sobol;
mod vec3;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

pub use self::numerics::Numerics;
pub use self::vec3::{Frame, Vec3};
pub use wide::f32x8;

/// A record of eight floats, aligned for one vector load.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct Row(pub [f32; 8]);

impl Row {
    /// Floats of a record, whatever the width of the lanes.
    pub const WIDTH: usize = 8;
}

/// Lanes of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// Plain `f32`.
    One,
    /// [`f32x8`].
    Eight,
}

impl Width {
    /// How many.
    pub fn lanes(self) -> u32 {
        match self {
            Width::One => 1,
            Width::Eight => 8,
        }
    }
}

/// One truth value per lane.
pub trait Mask: Copy + Debug + Send + Sync + 'static {
    /// All lanes equal to `value`.
    fn splat(value: bool) -> Self;
    /// Lane `i` is bit `i` of `bits`.
    fn from_bits(bits: u32) -> Self;
    /// Bit `i` is lane `i`; bits above the width are 0.
    fn bits(self) -> u32;
    /// Lane-wise.
    fn and(self, other: Self) -> Self;
    /// Lane-wise.
    fn or(self, other: Self) -> Self;
    /// `self` and not `other`.
    fn and_not(self, other: Self) -> Self;
    /// Lane-wise; bits above the width stay 0.
    fn not(self) -> Self {
        Self::splat(true).and_not(self)
    }
    /// True in some lane.
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// True in every lane.
    fn all(self) -> bool;
}

/// Unsigned 32-bit lanes; arithmetic wraps.
pub trait UintLanes: Copy + Debug + Send + Sync + 'static {
    /// All lanes equal to `x`.
    fn splat(x: u32) -> Self;
    /// Lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self;
    /// The value of lane `i`.
    fn lane(self, i: usize) -> u32;
    /// Modulo 2^32.
    fn add(self, other: Self) -> Self;
    /// Modulo 2^32.
    fn sub(self, other: Self) -> Self;
    /// Modulo 2^32.
    fn mul(self, other: Self) -> Self;
    /// Bit by bit.
    fn xor(self, other: Self) -> Self;
    /// Bit by bit.
    fn and(self, other: Self) -> Self;
    /// Bit by bit.
    fn or(self, other: Self) -> Self;
    /// To the left by 0 to 31 bits; zeros move in.
    fn shl<const BITS: i32>(self) -> Self;
    /// To the right by 0 to 31 bits; zeros move in.
    fn shr<const BITS: i32>(self) -> Self;
}

/// A vector of `N` floats, `N` 1 or 8.
pub trait Lanes:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Numerics
{
    /// Number of lanes.
    const N: usize;
    /// Result of comparisons, of as many lanes.
    type Mask: Mask;
    /// The same lanes as integers, for bit patterns and indices.
    type Uint: UintLanes;

    /// All lanes equal to `x`.
    fn splat(x: f32) -> Self;
    /// The first `N` values of `src`.
    fn load(src: &[f32]) -> Self;
    /// Into the first `N` places of `dst`.
    fn store(self, dst: &mut [f32]);
    /// Lane `i` is `f(i)`.
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;
    /// The value of lane `i`.
    fn lane(self, i: usize) -> f32;

    /// `self * a + b`, fused if the target has FMA (in every width alike).
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Correctly rounded; NaN below 0.
    fn sqrt(self) -> Self;
    /// `self < other ? self : other`.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`.
    fn max(self, other: Self) -> Self;
    /// Clears the sign bit, also that of a NaN.
    fn abs(self) -> Self;
    /// The greatest whole number that is not above.
    fn floor(self) -> Self;

    /// `self < other`; false where one is NaN, as in all comparisons.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`: zeros of both signs are equal.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self > other`.
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`.
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// Lane-wise `mask ? a : b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;

    /// Bit patterns, IEEE 754 binary32.
    fn to_bits(self) -> Self::Uint;
    /// The inverse of [`Self::to_bits`].
    fn from_bits(bits: Self::Uint) -> Self;
    /// Integers below 2^24 to floats, exactly.
    fn from_uint24(bits: Self::Uint) -> Self;
    /// `a == b`.
    fn uint_eq(a: Self::Uint, b: Self::Uint) -> Self::Mask;
    /// `a < b`, unsigned.
    fn uint_lt(a: Self::Uint, b: Self::Uint) -> Self::Mask;
    /// Lane-wise `mask ? a : b`.
    fn uint_select(mask: Self::Mask, a: Self::Uint, b: Self::Uint) -> Self::Uint;

    /// Rows `index[lane]` of a table, transposed: component `c` of the result is column `c`.
    /// `index` has 1 to `N` entries; missing lanes repeat the last.
    fn load_rows(rows: &[Row], index: &[u32]) -> [Self; Row::WIDTH];
    /// The inverse: writes `index.len()` rows.
    fn store_rows(columns: [Self; Row::WIDTH], rows: &mut [Row], index: &[u32]);

    /// All lanes 0.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// All lanes 1.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
    /// `self` where `mask`, else 0.
    #[inline(always)]
    fn or_zero(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// `|self|` with the sign of `sign`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let s = sign.to_bits().and(Self::Uint::splat(0x8000_0000));
        Self::from_bits(self.abs().to_bits().or(s))
    }
    /// True where the value is neither infinite nor NaN.
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().le(Self::splat(f32::MAX))
    }
}
