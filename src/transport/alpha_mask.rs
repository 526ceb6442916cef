//! Rays through alpha masks: what is not there is passed, and distances stay those from where the
//! ray began.
//!
//! The tracer knows no alpha masks. In a scene that has them, rays whose hit lies on a part that is
//! cut out are traced again from beyond it, off the surface by its error bound as rays leave
//! surfaces elsewhere, until none is left.

use super::World;
use super::list::List;
use super::records::{Hit, Ray};
use crate::geometry::{SurfacePoint, Wanted, sampled_barycentrics};
use crate::scene::NONE;
use crate::simd::{Lanes, Vec3};
use crate::surface::texture::Place;
use crate::trace::offset;

/// Workspace of rays on their way through alpha masks.
#[derive(Default)]
pub struct Through {
    rays: Vec<Ray>,
    /// How far along its ray each has come, in units of its direction's length.
    passed: Vec<f32>,
    left: List,
    next: List,
}

impl Through {
    /// Room for `n` rays, and for the paths whose rays are on their way and go on; no path is.
    fn start(&mut self, n: usize) {
        if self.rays.len() < n {
            self.rays.resize(n, Ray::default());
            self.passed.resize(n, 0.0);
        }
        self.left.reserve(n);
        self.next.reserve(n);
        self.left.clear();
    }
}

impl World<'_> {
    /// [`Tracer::closest`](crate::trace::Tracer::closest), through alpha masks. Returns how many
    /// more rays that took.
    pub fn closest<L: Lanes>(
        &self,
        rays: &[Ray],
        list: &[u32],
        hits: &mut [Hit],
        through: &mut Through,
    ) -> u64 {
        self.tracer.closest::<L>(rays, list, hits);
        if !self.plan.alpha_masks {
            return 0;
        }
        through.start(rays.len());
        let Through {
            rays: beyond,
            passed,
            left,
            next,
        } = through;
        left.extend(list);
        let mut more = 0;
        for _ in 0..self.most_layers() {
            next.clear();
            for &i in &**left {
                let ray = &rays[i as usize];
                if let Some(origin) = self.beyond(ray, &hits[i as usize], false) {
                    let so_far = along(ray, origin);
                    passed[i as usize] = so_far;
                    beyond[i as usize] = Ray::new(origin, ray.t_max - so_far, ray.direction);
                    next.push(i);
                }
            }
            if next.is_empty() {
                return more;
            }
            more += next.len() as u64;
            self.tracer.closest::<L>(beyond, next, hits);
            for &i in &**next {
                hits[i as usize].t += passed[i as usize];
            }
            std::mem::swap(left, next);
        }
        for &i in &**left {
            hits[i as usize].primitive = NONE;
        }
        more
    }

    /// [`Tracer::occluded`](crate::trace::Tracer::occluded), through alpha masks; `hits` is
    /// scratch. Returns how many more rays that took.
    pub fn occluded<L: Lanes>(
        &self,
        rays: &[Ray],
        list: &[u32],
        blocked: &mut [u32],
        hits: &mut [Hit],
        through: &mut Through,
    ) -> u64 {
        self.tracer.occluded::<L>(rays, list, blocked);
        if !self.plan.alpha_masks {
            return 0;
        }
        through.start(rays.len());
        let Through {
            rays: beyond,
            left,
            next,
            ..
        } = through;
        for &i in list {
            beyond[i as usize] = rays[i as usize];
            left.push_if(i, blocked[i as usize] != 0);
        }
        let mut more = 0;
        for _ in 0..self.most_layers() {
            // Something is in the way; what, and can it be passed?
            self.tracer.closest::<L>(beyond, left, hits);
            next.clear();
            for &i in &**left {
                let ray = &mut beyond[i as usize];
                if let Some(o) = self.beyond(ray, &hits[i as usize], true) {
                    let d = std::array::from_fn(|c| {
                        ray.direction[c].mul_add(ray.t_max, ray.origin[c]) - o[c]
                    });
                    *ray = Ray::new(o, 1.0, d);
                    next.push(i);
                }
            }
            more += (left.len() + next.len()) as u64;
            if next.is_empty() {
                return more;
            }
            self.tracer.occluded::<L>(beyond, next, blocked);
            left.clear();
            for &i in &**next {
                left.push_if(i, blocked[i as usize] != 0);
            }
        }
        more
    }

    /// Where a ray goes on, if its hit lies on a part of a shape that is cut out, or, for `shadow`
    /// rays, that casts none.
    pub(super) fn beyond(&self, ray: &Ray, hit: &Hit, shadow: bool) -> Option<[f32; 3]> {
        let Hit {
            t,
            b,
            primitive,
            instance,
            ..
        } = *hit;
        if hit.is_none() || self.geometry.shape_of(primitive).0.alpha == NONE {
            return None;
        }
        let [o, d] = [ray.origin, ray.direction].map(Vec3::splat);
        let of = (primitive, instance);
        let (there, casts_shadow, point) = self.is_there(of, o, d, [t, b[0], b[1]]);
        let stops = there && (casts_shadow || !shadow);
        (!stops).then(|| offset::leave(point.p, point.error, point.ng, d).lane(0))
    }

    /// Whether a point of a shape with alpha masks is there, and casts a shadow if so; as for
    /// [`Geometry::surface_point`](crate::geometry::Geometry::surface_point).
    fn is_there(
        &self,
        (primitive, instance): (u32, u32),
        origin: Vec3<f32>,
        direction: Vec3<f32>,
        hit: [f32; 3],
    ) -> (bool, bool, SurfacePoint<f32>) {
        let wanted = Wanted {
            uv: true,
            tangent: false,
            normals: false,
            spheres: self.wanted.spheres,
            large: self.wanted.large,
            instances: self.wanted.instances,
        };
        let of: (&[u32], &[u32]) = (&[primitive], &[instance]);
        let point = (self.geometry).surface_point(of, origin, direction, hit, wanted);
        let place = Place {
            uv: point.uv,
            p: point.p.lane(0),
            n: point.ng.lane(0),
        };
        let alpha = self.geometry.shape_of(primitive).0.alpha;
        let masks = &self.alpha_masks;
        (
            masks.is_there(alpha, primitive, &place),
            masks.casts_shadow(alpha, &place),
            point,
        )
    }

    /// Bits of the lanes whose point, sampled on the lane's light by `u`, is there to emit.
    pub fn emits<L: Lanes>(&self, lights: &[u32], u: [L; 2]) -> u32 {
        if !self.plan.masked_lights {
            return u32::MAX;
        }
        let mut bits = 0;
        for (i, &light) in lights.iter().enumerate() {
            let there = self.point_emits(light, [u[0].lane(i), u[1].lane(i)]);
            bits |= u32::from(there) << i;
        }
        bits
    }

    fn point_emits(&self, light: u32, [u, v]: [f32; 2]) -> bool {
        let primitive = self.lights.primitive(&self.geometry, light);
        if primitive == NONE || self.geometry.shape_of(primitive).0.alpha == NONE {
            return true;
        }
        let (mut p, mut hit) = (Vec3::zero(), [0.0; 3]);
        if primitive < self.geometry.triangles() {
            let [b1, b2] = sampled_barycentrics(u, v);
            hit = [0.0, b1, b2];
        } else {
            let sphere = primitive - self.geometry.triangles();
            p = self.geometry.sample_spheres(&[sphere], u, v, false).p;
        }
        self.is_there((primitive, NONE), p, Vec3::zero(), hit).0
    }

    /// No ray crosses more surfaces than this: what still goes on after that goes round in circles
    /// of rounding errors.
    pub(super) fn most_layers(&self) -> usize {
        self.tracer.stats().triangles + 2 * self.tracer.stats().spheres
    }
}

/// How far along a ray a point is, in units of its direction's length.
fn along(ray: &Ray, p: [f32; 3]) -> f32 {
    let [p, o, d] = [p, ray.origin, ray.direction].map(Vec3::<f32>::splat);
    (p - o).dot(d) / d.length2()
}
