//! The tracer's contract: what it is asked, and what it answers. All in internal space.

use crate::simd::record::record;
use crate::simd::{Lanes, Vec3};

record! {
    /// A ray. It is written by whoever asks ([`Tracer::closest`](super::Tracer::closest)), and read
    /// by the tracer.
    pub struct Ray / RayLanes {
        /// Where it starts.
        origin: [f32; 3],
        /// Where it ends, in units of the direction's length; hits have `t` in `(0, t_max)`. May be
        /// infinite.
        t_max: f32,
        /// Where it goes; need not be a unit vector.
        direction: [f32; 3],
    } free 1
}

record! {
    /// The closest hit of a ray. It is written by the tracer.
    pub struct Hit / HitLanes {
        /// Where it is, in units of the length of the ray's direction.
        t: f32,
        /// Barycentric coordinates of vertices 1 and 2 of a triangle; 0 for spheres.
        b: [f32; 2],
        /// An index into the triangles, or their number plus an index into the spheres, or
        /// [`NONE`](crate::scene::NONE).
        primitive: u32,
        /// An index into [`Instances::placed`](crate::scene::Instances::placed), or
        /// [`NONE`](crate::scene::NONE): the primitive is in its place.
        instance: u32,
    } free 3
}

impl Ray {
    /// From `origin` towards `direction`, up to `t_max`.
    pub fn new(origin: impl Into<[f32; 3]>, t_max: f32, direction: impl Into<[f32; 3]>) -> Self {
        Self {
            origin: origin.into(),
            t_max,
            direction: direction.into(),
            ..Self::default()
        }
    }

    /// Without an end.
    pub fn endless(origin: impl Into<[f32; 3]>, direction: impl Into<[f32; 3]>) -> Self {
        Self::new(origin, f32::INFINITY, direction)
    }
}

impl<L: Lanes> RayLanes<L> {
    /// Without an end.
    #[inline(always)]
    pub fn endless(origin: Vec3<L>, direction: Vec3<L>) -> Self {
        Self {
            origin,
            t_max: L::splat(f32::INFINITY),
            direction,
        }
    }

    /// Between two points: `t = 1` is the second.
    #[inline(always)]
    pub fn between(origin: Vec3<L>, target: Vec3<L>) -> Self {
        Self {
            origin,
            t_max: L::one(),
            direction: target - origin,
        }
    }
}

impl Hit {
    /// True if nothing was hit.
    #[inline(always)]
    pub fn is_none(&self) -> bool {
        self.primitive == crate::scene::NONE
    }
}
