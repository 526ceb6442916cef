//! Affine maps between the unit sphere and internal space: what makes an analytic sphere or
//! ellipsoid.

use crate::scene::Sphere;
use crate::simd::record::record;
use crate::simd::{Lanes, Vec3};

record! {
    /// Two rows of an affine map: linear part and offset.
    struct MapRows / MapRowsLanes {
        /// Internal space, or the unit sphere's.
        first: [f32; 4],
        /// Likewise.
        second: [f32; 4],
    }
}

record! {
    /// What is left of a sphere beside its maps.
    struct Facing / FacingLanes {
        /// 1, or -1 where normals point inwards.
        facing: f32,
    } free 7
}

/// Spheres as kernels read them.
pub(super) struct SphereTables {
    /// To internal space: the first two rows; the last, and the first of the way back; the last
    /// two of that.
    maps: [Vec<MapRows>; 3],
    facing: Vec<Facing>,
}

impl SphereTables {
    pub(super) fn new(spheres: &[Sphere]) -> Self {
        let rows = |choose: fn(&Sphere) -> [[f32; 4]; 2]| {
            let both = spheres.iter().map(choose);
            both.map(|[first, second]| MapRows { first, second })
                .collect()
        };
        Self {
            maps: [
                rows(|s| [s.to_world[0], s.to_world[1]]),
                rows(|s| [s.to_world[2], s.to_unit[0]]),
                rows(|s| [s.to_unit[1], s.to_unit[2]]),
            ],
            facing: (spheres.iter())
                .map(|s| Facing {
                    facing: s.facing,
                    ..Facing::default()
                })
                .collect(),
        }
    }

    /// The spheres `index`, 1 to `N`.
    #[inline(always)]
    pub(super) fn load<L: Lanes>(&self, index: &[u32]) -> SphereMap<L> {
        let [a, b, c] = [0, 1, 2].map(|i| MapRowsLanes::<L>::load(&self.maps[i], index));
        SphereMap {
            to_world: [a.first, a.second, b.first],
            to_unit: [b.second, c.first, c.second],
            facing: FacingLanes::<L>::load(&self.facing, index).facing,
        }
    }
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
