//! The sphere test: rays in the space where the ellipsoid is the unit sphere, solved as in Haines,
//! Günther and Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection" (Ray
//! Tracing Gems, chapter 7).
//!
//! The direction is transformed but not normalised, so `t` is the same in both spaces. As for
//! triangles, a sphere is hit only where the ray passes its padded box, and roots within rounding
//! error of the ends of the ray do not count.

use super::node::Bounds;
use super::ray::{PAD, Ray, largest, permute, slab};
use super::triangle::Hit;
use crate::scene::{NONE, Sphere};
use crate::simd::{Lanes, Mask, Vec3};

/// A sphere in leaf order.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct LeafSphere {
    /// Internal space to unit sphere, three rows of a 3x4 matrix.
    to_unit: [[f32; 4]; 3],
    /// Box around the ellipsoid, not padded.
    bounds: Bounds,
    /// Largest row sum of the absolute linear part, and largest translation: they bound the
    /// rounding of the transform.
    stretch: f32,
    shift: f32,
    /// Number of triangles plus index of the sphere.
    index: u32,
    /// Not a sphere but this entry of [`Tree::large`](super::flatten::Tree::large), unless
    /// [`NONE`].
    large: u32,
}

/// 2^-24, the rounding of one operation.
const U: f32 = 1.0 / 16_777_216.0;

impl LeafSphere {
    pub fn new(sphere: &Sphere, index: u32) -> Self {
        let m = &sphere.to_unit;
        Self {
            to_unit: *m,
            bounds: bounds(sphere),
            stretch: m
                .iter()
                .map(|r| r[0].abs() + r[1].abs() + r[2].abs())
                .fold(0.0, f32::max),
            shift: m.iter().map(|r| r[3].abs()).fold(0.0, f32::max),
            index,
            large: NONE,
        }
    }

    /// The place of a large surface in a leaf.
    pub fn large(index: u32) -> Self {
        Self {
            to_unit: [[0.0; 4]; 3],
            bounds: [[0.0; 2]; 3],
            stretch: 0.0,
            shift: 0.0,
            index: 0,
            large: index,
        }
    }

    /// The large surface that this stands for, if any.
    #[inline(always)]
    pub fn as_large(&self) -> Option<usize> {
        (self.large != NONE).then_some(self.large as usize)
    }

    #[inline(always)]
    pub fn index(&self) -> u32 {
        self.index
    }

    /// The nearest root in `(0, t_max]`. With `ANY`, roots within rounding error of the far end do
    /// not count.
    #[inline(always)]
    pub fn hit<L: Lanes, const ANY: bool, const VAST: bool>(
        &self,
        ray: &Ray<L>,
        t_max: L,
    ) -> Hit<L> {
        let zero = L::zero();
        let o = ray.o.transform_point(&self.to_unit);
        let d = ray.d.transform_vector(&self.to_unit);
        // 1 / a is well scaled: |d| is within the conditioning of the transform.
        let a = d.length2();
        let b = -o.dot(d);
        let foot = d.mul_add(b / a, o);
        let root = L::one() - foot.length2();
        let c = o.length2() - L::one();
        let q = b + (a * root.max(zero)).sqrt().copysign(b);

        // Rounding of the transformed origin, and what it does to c and q.
        let moved = |p: Vec3<L>| {
            let largest = p.max_abs() * L::splat(self.stretch) + L::splat(self.shift);
            largest * L::splat(4.0 * U)
        };
        let c_error = |p: Vec3<L>, delta: L| {
            let unit = p.length2() + L::one();
            (p.max_abs() * delta).mul_add(L::splat(6.0), unit * L::splat(4.0 * U))
        };
        let delta = moved(ray.o);
        let error_c = c_error(o, delta);
        let error_q = (o.max_abs() * L::splat(4.0 * U) + delta) * d.max_abs() * L::splat(6.0);
        let (t0, t1) = (c / q, q / a);
        let real = root.ge(zero).and(a.gt(zero));
        let ok0 = real.and(c.abs().gt(error_c)).and(t0.gt(zero));
        let ok1 = real.and(q.abs().gt(error_q)).and(t1.gt(zero));

        let pad = if VAST {
            L::splat(PAD * largest(&self.bounds)) + ray.reach()
        } else {
            ray.pad
        };
        let low = [0, 1, 2].map(|k| L::splat(self.bounds[k][0]) - pad);
        let high = [0, 1, 2].map(|k| L::splat(self.bounds[k][1]) + pad);
        let (near, far) = slab(
            &ray.own,
            permute::<L>(low, ray.swap_x, ray.swap_y),
            permute::<L>(high, ray.swap_x, ray.swap_y),
        );
        let clamp = |t: L| t.min(far).max(near);
        let (t0, t1) = (clamp(t0), clamp(t1));
        let within = near.le(far).and(near.le(t_max));
        let (ok0, ok1) = (
            ok0.and(t0.gt(zero)).and(t0.le(t_max)),
            ok1.and(t1.gt(zero)).and(t1.le(t_max)),
        );
        if ANY {
            // If the far end lies on the sphere, the root next to it is that end.
            let end = ray.d.mul_add(t_max, ray.o);
            let unit_end = d.mul_add(t_max, o);
            let delta = moved(end) + moved(ray.o) + unit_end.max_abs() * L::splat(4.0 * U);
            let delta = delta + d.max_abs() * t_max * L::splat(4.0 * U);
            let on = (unit_end.length2() - L::one())
                .abs()
                .le(c_error(unit_end, delta));
            let (gap0, gap1) = ((t_max - t0).abs(), (t_max - t1).abs());
            let ok0 = ok0.and_not(on.and(gap0.le(gap1)));
            let ok1 = ok1.and_not(on.and(gap1.le(gap0)));
            return Hit {
                mask: within.and(ok0.or(ok1)),
                t: near,
            };
        }
        let first = ok0.and(t0.le(t1)).or(ok0.and_not(ok1));
        Hit {
            mask: within.and(ok0.or(ok1)),
            t: L::select(first, t0, t1),
        }
    }
}

/// Box around the ellipsoid, rounded outwards.
pub fn bounds(sphere: &Sphere) -> Bounds {
    sphere.to_world.map(|r| {
        let r = r.map(f64::from);
        let reach = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
        [
            ((r[3] - reach) as f32).next_down(),
            ((r[3] + reach) as f32).next_up(),
        ]
    })
}
