//! Points on instances ([`crate::scene::instance`]): found in the object's space, and taken to
//! their place in `f64`, so that only their rounding adds to their error.

use glam::{DMat3, DVec3};

use super::derivatives::{Derivatives, of_unit};
use super::large::{lanes, put, put_one};
use super::{Geometry, SurfacePoint, Wanted};
use crate::scene::{Instance, NONE};
use crate::simd::{Lanes, Vec3};

/// The rounding of a coordinate to `f32`, twice.
const ROUNDING: f64 = 1.0 / 8_388_608.0;

impl Geometry<'_> {
    fn placed(&self, instance: u32) -> Option<&Instance> {
        if instance == NONE {
            return None;
        }
        self.instances.placed.get(instance as usize)
    }

    /// [`Self::surface_point`] where some hits may be on instances.
    #[cold]
    #[inline(never)]
    pub(super) fn instanced_point<L: Lanes>(
        &self,
        (prim, instance): (&[u32], &[u32]),
        [mut origin, mut direction]: [Vec3<L>; 2],
        hit: [L; 3],
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        for (i, &instance) in instance.iter().enumerate() {
            if let Some(placed) = self.placed(instance) {
                let along = wide(direction.lane(i)) * f64::from(hit[0].lane(i));
                let there =
                    (placed.to_world.inverse()).transform_point3(wide(origin.lane(i)) + along);
                put(&mut origin, i, there.as_vec3().to_array());
                put(&mut direction, i, [0.0; 3]);
            }
        }
        let mut point = self.own_point(prim, [origin, direction], hit, wanted);
        for (i, &instance) in instance.iter().enumerate() {
            if let Some(placed) = self.placed(instance) {
                point.place(i, placed);
            }
        }
        point
    }

    /// The derivatives at a point `p`, internal space, of a primitive in its place or of an
    /// instance; `b1`, `b2` are its barycentric coordinates if that is a triangle.
    pub fn derivatives(
        &self,
        (primitive, instance): (u32, u32),
        b: [f64; 2],
        p: DVec3,
    ) -> Derivatives {
        let Some(placed) = self.placed(instance) else {
            return self.own_derivatives(primitive, b, p).0;
        };
        let (by, back) = (placed.to_world.matrix3, placed.to_world.inverse());
        let (d, n) = self.own_derivatives(primitive, b, back.transform_point3(p));
        let normals: DMat3 = back.matrix3.transpose();
        let turned = |along: DVec3| match normals * along {
            DVec3::ZERO => DVec3::ZERO,
            along => of_unit(normals * n, along),
        };
        Derivatives {
            dpdu: by * d.dpdu,
            dpdv: by * d.dpdv,
            dndu: turned(d.dndu),
            dndv: turned(d.dndv),
            smooth: d.smooth,
        }
    }

    /// The distance from the origin within which all instances lie.
    pub(super) fn reach_of_instances(&self) -> f64 {
        let reach = |instance: &Instance| {
            let bounds = self.instances.objects[instance.object as usize].bounds;
            let [low, high] = instance.around(bounds);
            low.abs().max(high.abs()).length()
        };
        (self.instances.placed.iter().map(reach)).fold(0.0, f64::max)
    }
}

impl<L: Lanes> SurfacePoint<L> {
    /// Takes the point of one lane from its object's space to its place.
    fn place(&mut self, i: usize, placed: &Instance) {
        let wide = |v: Vec3<L>| DVec3::from(v.lane(i).map(f64::from));
        let normals = placed.to_world.matrix3.inverse().transpose();
        let (p, ng) = (wide(self.p), wide(self.ng));
        let there = placed.to_world.transform_point3(p);
        let n = normals * ng;
        let length = n.length();
        let unit = n / length;
        let near = f64::from(lanes(self.error)[i]) + ng.abs().dot(p.abs()) * ROUNDING;
        let error = near / length + unit.abs().dot(there.abs()) * ROUNDING;
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let ns = normals * wide(self.ns);
        let tangent = placed.to_world.transform_vector3(wide(self.tangent));
        put(&mut self.p, i, narrow(there));
        put(&mut self.ng, i, narrow(unit));
        put(&mut self.ns, i, narrow(ns.normalize_or(unit)));
        put(&mut self.tangent, i, narrow(tangent));
        self.error = put_one(self.error, i, error as f32);
    }
}
