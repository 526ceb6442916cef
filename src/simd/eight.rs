//! Width 8: `wide::f32x8`. Masks are float vectors of all-ones or all-zeros lanes, as the hardware
//! has them.

use super::{Lanes, Mask, Row, UintLanes};
use wide::{f32x8, i32x8, u32x8};

impl Mask for f32x8 {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        f32x8::splat(f32::from_bits(if value { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        let select = u32x8::new([1, 2, 4, 8, 16, 32, 64, 128]);
        bytemuck::cast((u32x8::splat(bits) & select).simd_eq(select))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }
    #[inline(always)]
    fn all(self) -> bool {
        f32x8::all(self)
    }
}

impl UintLanes for u32x8 {
    #[inline(always)]
    fn splat(x: u32) -> Self {
        u32x8::splat(x)
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> u32) -> Self {
        // A loop and not `array::from_fn`, which is not reliably inlined; so below.
        let mut lanes = [0; 8];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f(i);
        }
        u32x8::new(lanes)
    }
    #[inline(always)]
    fn lane(self, i: usize) -> u32 {
        self.to_array()[i]
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self - other
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self * other
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        self ^ other
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }
    #[inline(always)]
    fn shl<const BITS: i32>(self) -> Self {
        self << BITS as u32
    }
    #[inline(always)]
    fn shr<const BITS: i32>(self) -> Self {
        self >> BITS as u32
    }
}

impl Lanes for f32x8 {
    const N: usize = 8;
    type Mask = f32x8;
    type Uint = u32x8;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        f32x8::splat(x)
    }
    #[inline(always)]
    fn load(src: &[f32]) -> Self {
        let lanes: [f32; 8] = src[..8].try_into().expect("a slice of eight");
        f32x8::new(lanes)
    }
    #[inline(always)]
    fn store(self, dst: &mut [f32]) {
        dst[..8].copy_from_slice(&self.to_array());
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f32) -> Self {
        let mut lanes = [0.0; 8];
        for (i, lane) in lanes.iter_mut().enumerate() {
            *lane = f(i);
        }
        f32x8::new(lanes)
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        self.to_array()[i]
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        if cfg!(any(target_feature = "fma", target_arch = "aarch64")) {
            f32x8::mul_add(self, a, b)
        } else {
            self * a + b
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32x8::sqrt(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // minps has the rule of the trait; other instruction sets propagate NaN.
        if cfg!(target_arch = "x86_64") {
            self.fast_min(other)
        } else {
            Self::select(Lanes::lt(self, other), self, other)
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if cfg!(target_arch = "x86_64") {
            self.fast_max(other)
        } else {
            Self::select(Lanes::lt(other, self), self, other)
        }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32x8::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32x8::floor(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> f32x8 {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> f32x8 {
        self.simd_le(other)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> f32x8 {
        self.simd_eq(other)
    }
    #[inline(always)]
    fn select(mask: f32x8, a: Self, b: Self) -> Self {
        mask.select(a, b)
    }
    #[inline(always)]
    fn to_bits(self) -> u32x8 {
        bytemuck::cast(self)
    }
    #[inline(always)]
    fn from_bits(bits: u32x8) -> Self {
        bytemuck::cast(bits)
    }
    #[inline(always)]
    fn from_uint24(bits: u32x8) -> Self {
        f32x8::from_i32x8(bytemuck::cast::<u32x8, i32x8>(bits))
    }
    #[inline(always)]
    fn uint_eq(a: u32x8, b: u32x8) -> f32x8 {
        bytemuck::cast(a.simd_eq(b))
    }
    #[inline(always)]
    fn uint_lt(a: u32x8, b: u32x8) -> f32x8 {
        bytemuck::cast(a.simd_lt(b))
    }
    #[inline(always)]
    fn uint_select(mask: f32x8, a: u32x8, b: u32x8) -> u32x8 {
        Self::select(mask, Self::from_bits(a), Self::from_bits(b)).to_bits()
    }
    #[inline(always)]
    fn load_rows(rows: &[Row], index: &[u32]) -> [Self; 8] {
        let last = index.len() - 1;
        let mut loaded = [f32x8::ZERO; 8];
        for (i, row) in loaded.iter_mut().enumerate() {
            *row = f32x8::new(rows[index[i.min(last)] as usize].0);
        }
        f32x8::transpose(loaded)
    }
    #[inline(always)]
    fn store_rows(columns: [Self; 8], rows: &mut [Row], index: &[u32]) {
        let transposed = f32x8::transpose(columns);
        for (row, &i) in transposed.iter().zip(index) {
            rows[i as usize].0 = row.to_array();
        }
    }
}
