//! Affine maps between the unit sphere and internal space: what makes an analytic sphere or ellipsoid.

use crate::scene::Sphere;
use crate::simd::{Lanes, Row, Vec3};

/// Four rows of a sphere: both maps, row by row, and its facing.
pub(super) fn sphere_rows(s: &Sphere) -> [Row; 4] {
    let two = |a: [f32; 4], b: [f32; 4]| Row([a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]);
    let (w, u) = (s.to_world, s.to_unit);
    [
        two(w[0], w[1]),
        two(w[2], u[0]),
        two(u[1], u[2]),
        two([s.facing, 0.0, 0.0, 0.0], [0.0; 4]),
    ]
}

/// Affine maps between unit spheres and internal space, one a lane.
pub(super) struct SphereMap<L: Lanes> {
    pub to_world: [[L; 4]; 3],
    pub to_unit: [[L; 4]; 3],
    pub facing: L,
}

impl<L: Lanes> SphereMap<L> {
    #[inline(always)]
    pub(super) fn apply(m: &[[L; 4]; 3], v: Vec3<L>, w: L) -> Vec3<L> {
        let row = |r: &[L; 4]| {
            v.x.mul_add(r[0], v.y.mul_add(r[1], v.z.mul_add(r[2], r[3] * w)))
        };
        Vec3::new(row(&m[0]), row(&m[1]), row(&m[2]))
    }
    #[inline(always)]
    pub(super) fn to_world(&self, w: Vec3<L>) -> Vec3<L> {
        Self::apply(&self.to_world, w, L::one())
    }
    #[inline(always)]
    pub(super) fn vector_to_world(&self, w: Vec3<L>) -> Vec3<L> {
        Self::apply(&self.to_world, w, L::zero())
    }
    #[inline(always)]
    pub(super) fn to_unit(&self, p: Vec3<L>) -> Vec3<L> {
        Self::apply(&self.to_unit, p, L::one())
    }
    /// Inverse transpose applied to `w`, not normalised.
    #[inline(always)]
    pub(super) fn normal_vector(&self, w: Vec3<L>) -> Vec3<L> {
        let m = &self.to_unit;
        let column = |c: usize| w.x.mul_add(m[0][c], w.y.mul_add(m[1][c], w.z * m[2][c]));
        Vec3::new(column(0), column(1), column(2))
    }
    #[inline(always)]
    pub(super) fn normal(&self, w: Vec3<L>) -> Vec3<L> {
        let n = self.normal_vector(w);
        let tiny = L::splat(f32::MIN_POSITIVE);
        (n * (L::one() / n.max_abs().max(tiny))).normalize() * self.facing
    }
    /// Sums of the magnitudes that a mapped point is computed from.
    #[inline(always)]
    pub(super) fn reach(&self, w: Vec3<L>) -> Vec3<L> {
        let row =
            |r: &[L; 4]| (r[0] * w.x).abs() + (r[1] * w.y).abs() + (r[2] * w.z).abs() + r[3].abs();
        Vec3::new(
            row(&self.to_world[0]),
            row(&self.to_world[1]),
            row(&self.to_world[2]),
        )
    }
    /// Uniform on the unit sphere, as a density over the mapped area: `dA = |det M| |M^-T w| dw`.
    #[inline(always)]
    pub(super) fn area_pdf(&self, w: Vec3<L>) -> L {
        let m = &self.to_world;
        let column = |c: usize| Vec3::new(m[0][c], m[1][c], m[2][c]);
        let det = column(0).dot(column(1).cross(column(2))).abs();
        let n = self.normal_vector(w);
        let stretch = n.max_abs();
        let length = stretch * (n * (L::one() / stretch)).length2().sqrt();
        L::splat(0.25 * std::f32::consts::FRAC_1_PI) / (det * length)
    }
}
