//! Three-vectors of lanes, and orthonormal frames.

use super::{Lanes, Mask};
use std::ops::{Add, Mul, Neg, Sub};

/// `N` three-vectors.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<L> {
    /// First components of all vectors.
    pub x: L,
    /// Second components.
    pub y: L,
    /// Third components.
    pub z: L,
}

impl<L: Lanes> Vec3<L> {
    /// Of its components.
    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Self {
        Self { x, y, z }
    }
    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: [f32; 3]) -> Self {
        Self::new(L::splat(v[0]), L::splat(v[1]), L::splat(v[2]))
    }
    /// Zero vectors.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat([0.0; 3])
    }
    /// Fused from the last component to the first.
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.x.mul_add(o.x, self.y.mul_add(o.y, self.z * o.z))
    }
    /// Each component is `a * d - b * c` with the second product rounded first, so that swapping
    /// the operands negates the result exactly only for the unfused form; it is therefore not
    /// fused.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }
    /// Squared length.
    #[inline(always)]
    pub fn length2(self) -> L {
        self.dot(self)
    }
    /// Unit vector; a zero or non-finite vector gives a non-finite result.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (L::one() / self.length2().sqrt())
    }
    /// `self * s + o`.
    #[inline(always)]
    pub fn mul_add(self, s: L, o: Self) -> Self {
        Self::new(
            self.x.mul_add(s, o.x),
            self.y.mul_add(s, o.y),
            self.z.mul_add(s, o.z),
        )
    }
    /// Component-wise product.
    #[inline(always)]
    pub fn mul_elem(self, o: Self) -> Self {
        Self::new(self.x * o.x, self.y * o.y, self.z * o.z)
    }
    /// Lane-wise `mask ? a : b`.
    #[inline(always)]
    pub fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self::new(
            L::select(mask, a.x, b.x),
            L::select(mask, a.y, b.y),
            L::select(mask, a.z, b.z),
        )
    }
    /// `self` where `mask`, else 0.
    #[inline(always)]
    pub fn or_zero(self, mask: L::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// Largest absolute component.
    #[inline(always)]
    pub fn max_abs(self) -> L {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }
    /// True where every component is finite.
    #[inline(always)]
    pub fn is_finite(self) -> L::Mask {
        self.x
            .is_finite()
            .and(self.y.is_finite())
            .and(self.z.is_finite())
    }
    /// The components.
    #[inline(always)]
    pub fn to_array(self) -> [L; 3] {
        [self.x, self.y, self.z]
    }
    /// The vector of lane `i`.
    #[inline(always)]
    pub fn lane(self, i: usize) -> [f32; 3] {
        [self.x.lane(i), self.y.lane(i), self.z.lane(i)]
    }
    /// Rows `m` of a 3x4 affine map applied to a point.
    #[inline(always)]
    pub fn transform_point(self, m: &[[f32; 4]; 3]) -> Self {
        let row = |r: &[f32; 4]| self.dot(Self::splat([r[0], r[1], r[2]])) + L::splat(r[3]);
        Self::new(row(&m[0]), row(&m[1]), row(&m[2]))
    }
    /// Linear part of rows `m` applied to a direction.
    #[inline(always)]
    pub fn transform_vector(self, m: &[[f32; 4]; 3]) -> Self {
        let row = |r: &[f32; 4]| self.dot(Self::splat([r[0], r[1], r[2]]));
        Self::new(row(&m[0]), row(&m[1]), row(&m[2]))
    }
}

impl From<Vec3<f32>> for [f32; 3] {
    #[inline(always)]
    fn from(v: Vec3<f32>) -> Self {
        v.to_array()
    }
}

impl<L: Lanes> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<L: Lanes> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<L: Lanes> Mul<L> for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: L) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<L: Lanes> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// A right-handed orthonormal frame around `n` (local `z`).
#[derive(Clone, Copy, Debug)]
pub struct Frame<L> {
    /// Local `x`, unit.
    pub s: Vec3<L>,
    /// Local `y`, unit.
    pub t: Vec3<L>,
    /// Local `z`, unit: the normal.
    pub n: Vec3<L>,
}

impl<L: Lanes> Frame<L> {
    /// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    #[inline(always)]
    pub fn new(n: Vec3<L>) -> Self {
        let sign = L::one().copysign(n.z);
        let a = -L::one() / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(
                (sign * n.x * n.x).mul_add(a, L::one()),
                sign * b,
                -sign * n.x,
            ),
            t: Vec3::new(b, (n.y * n.y).mul_add(a, sign), -n.y),
            n,
        }
    }
    /// The coordinates of a world vector in the frame.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3<L>) -> Vec3<L> {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }
    /// The inverse of [`Self::to_local`].
    #[inline(always)]
    pub fn to_world(&self, v: Vec3<L>) -> Vec3<L> {
        self.s.mul_add(v.x, self.t.mul_add(v.y, self.n * v.z))
    }
}
