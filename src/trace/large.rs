//! The tests of large surfaces ([`crate::scene::large`]): as those of triangles and spheres, in
//! `f64`, one ray at a time at every width.
//!
//! Rays and distances stay `f32`, boxes and the clamping of `t` to them too, so all that is said in
//! `triangle.rs` of the order of traversal holds. What is left of the error bound is the rounding
//! of the end of a shadow ray: origins are off their surface by the rounding of the
//! point (`geometry/large.rs`), which `f64` sees.

use super::node::Bounds;
use super::ray::{PAD, Ray, largest, permute, slab};
use super::triangle::{Hit, covers};
use crate::scene::{Large, Scene};
use crate::simd::{Lanes, Mask};
use glam::DVec3;

/// Rounding of the tests here, relative to the magnitudes that are added up: more than they have.
const ERROR: f64 = 64.0 * f64::EPSILON;
/// Where the end of an `f32` ray may be, relative to the magnitudes that it is made of: the
/// direction is rounded, and scaled.
const END: f64 = 4.0 / 16_777_216.0;

/// A large surface, ready for rays.
pub struct LargeSurface {
    form: Form,
    bounds: Bounds,
    /// Triangles first, then spheres.
    primitive: u32,
}

enum Form {
    Triangle {
        p: [DVec3; 3],
        /// Unit normal.
        n: DVec3,
        /// How far from the plane surfaces may be that lie in it.
        off: f64,
        /// The corners as ordinary neighbours have them.
        seam: Option<[[f32; 3]; 3]>,
    },
    /// From internal space to the unit sphere.
    Sphere { to_unit: glam::DAffine3 },
}

/// A ray in `f64`, and the end of what is looked for.
struct Line {
    o: DVec3,
    d: DVec3,
    t_max: f64,
}

/// A hit of one ray: its distance, and the weights of vertices 1 and 2.
type Found = Option<(f64, [f64; 2])>;

/// The surfaces of a scene's table in its order.
pub fn surfaces(scene: &Scene) -> Vec<LargeSurface> {
    let Large { triangles, spheres } = &scene.large;
    let of_triangles = triangles.iter().map(|t| {
        let corners = scene.triangles[t.triangle as usize].v;
        let corners = corners.map(|v| scene.vertices[v as usize].p);
        let [a, b, c] = t.p;
        LargeSurface {
            form: Form::Triangle {
                p: t.p,
                n: t.plane().0,
                off: t.off,
                seam: t.seam.then_some(corners),
            },
            bounds: around(a.min(b).min(c), a.max(b).max(c)),
            primitive: t.triangle,
        }
    });
    let of_spheres = spheres.iter().map(|s| {
        let m = s.to_world.matrix3.transpose();
        let half = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        let centre = s.to_world.translation;
        LargeSurface {
            form: Form::Sphere { to_unit: s.to_unit },
            bounds: around(centre - half, centre + half),
            primitive: scene.triangles.len() as u32 + s.sphere,
        }
    });
    of_triangles.chain(of_spheres).collect()
}

/// A box, rounded outwards.
fn around(low: DVec3, high: DVec3) -> Bounds {
    std::array::from_fn(|k| [(low[k] as f32).next_down(), (high[k] as f32).next_up()])
}

impl LargeSurface {
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    #[inline(always)]
    pub fn primitive(&self) -> u32 {
        self.primitive
    }

    /// The nearest hits in `(0, t_max]`, and the barycentric coordinates there. With `ANY`, what is
    /// within rounding error of the far end does not count. Not inlined, so that the loops over
    /// ordinary primitives keep their registers.
    #[cold]
    #[inline(never)]
    pub fn hit<L: Lanes, const ANY: bool>(&self, ray: &Ray<L>, t_max: L) -> (Hit<L>, [L; 2]) {
        let pad = L::splat(PAD * largest(&self.bounds)) + ray.reach();
        let low = [0, 1, 2].map(|k| L::splat(self.bounds[k][0]) - pad);
        let high = [0, 1, 2].map(|k| L::splat(self.bounds[k][1]) + pad);
        let (near, far) = slab(
            &ray.own,
            permute::<L>(low, ray.swap_x, ray.swap_y),
            permute::<L>(high, ray.swap_x, ray.swap_y),
        );
        let within = near.le(far).and(near.le(t_max)).bits();
        let shared = self.shared(ray);
        let (mut t, mut b, mut hits) = ([0.0f32; 8], [[0.0f32; 8]; 2], 0u32);
        for i in (0..L::N).filter(|i| within >> i & 1 != 0) {
            let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
            let line = Line {
                o: wide(ray.o.lane(i)),
                d: wide(ray.d.lane(i)),
                t_max: t_max.lane(i).into(),
            };
            let found = match &self.form {
                Form::Triangle { p, n, off, .. } => {
                    let shared = shared.map(|s| s >> i & 1 != 0);
                    line.meet_triangle::<ANY>(p, (*n, *off), shared)
                }
                Form::Sphere { to_unit } => line.meet_sphere::<ANY>(to_unit),
            };
            if let Some((at, inner)) = found {
                hits |= 1 << i;
                t[i] = at as f32;
                b[0][i] = (inner[0] as f32).clamp(0.0, 1.0);
                b[1][i] = (inner[1] as f32).clamp(0.0, 1.0 - b[0][i]);
            }
        }
        let t = L::load(&t).min(far).max(near);
        let mask = L::Mask::from_bits(hits)
            .and(t.gt(L::zero()))
            .and(t.le(t_max));
        (Hit { mask, t }, b.map(|b| L::load(&b)))
    }

    /// Bits of the rays that pass through a seam triangle as its ordinary neighbours see it.
    fn shared<L: Lanes>(&self, ray: &Ray<L>) -> Option<u32> {
        let Form::Triangle {
            seam: Some(corners),
            ..
        } = &self.form
        else {
            return None;
        };
        let p = corners.map(|p| permute::<L>(p.map(L::splat), ray.swap_x, ray.swap_y));
        Some(covers(&ray.own, &p).0.bits())
    }
}

impl Line {
    /// Whether `distance` along a normal `n`, at a speed of `slope`, falls short of the end of the
    /// ray.
    fn is_short(&self, distance: f64, slope: f64, n: DVec3) -> bool {
        self.t_max * slope - distance > END * self.magnitude(n)
    }

    /// What the end of the ray is added up from, along `n`.
    fn magnitude(&self, n: DVec3) -> f64 {
        (self.o.abs() + self.d.abs() * self.t_max).dot(n.abs())
    }

    /// `shared` says whether the ray passes through the triangle in `f32`, if that is of interest.
    fn meet_triangle<const ANY: bool>(
        &self,
        p: &[DVec3; 3],
        (n, off): (DVec3, f64),
        shared: Option<bool>,
    ) -> Found {
        let v = p[0] - self.o;
        let slope = self.d.dot(n);
        let distance = v.dot(n) * 1f64.copysign(slope);
        let slope = slope.abs();
        let error = ERROR * v.abs().dot(n.abs());
        // A ray that leaves a neighbour in the same plane leaves this triangle, too.
        if !(distance > error.max(off) && slope > 0.0) {
            return None;
        }
        if ANY && !self.is_short(distance, slope, n) {
            return None;
        }
        // As in `covers`: every corner is projected by itself, and signs of differences of products
        // are right.
        let own = order(self.d);
        let [dx, dy, dz] = own(self.d);
        let project = |p: DVec3| {
            let [x, y, z] = own(p - self.o);
            [x - z * (dx / dz), y - z * (dy / dz)]
        };
        let [[x0, y0], [x1, y1], [x2, y2]] = [project(p[0]), project(p[1]), project(p[2])];
        let [u, v, w] = [x2 * y1 - y2 * x1, x0 * y2 - y0 * x2, x1 * y0 - y1 * x0];
        let is_inside = u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0;
        if !(is_inside || shared == Some(true)) {
            return None;
        }
        let sum = u + v + w;
        let inner = |x: f64| if sum == 0.0 { 0.0 } else { x / sum };
        Some((distance / slope, [inner(v), inner(w)]))
    }

    fn meet_sphere<const ANY: bool>(&self, to_unit: &glam::DAffine3) -> Found {
        let o = to_unit.transform_point3(self.o);
        let d = to_unit.transform_vector3(self.d);
        let (a, b) = (d.length_squared(), -o.dot(d));
        let root = 1.0 - (o + d * (b / a)).length_squared();
        if !(root >= 0.0 && a > 0.0) {
            return None;
        }
        let c = o.length_squared() - 1.0;
        let q = b + (a * root).sqrt().copysign(b);
        let error_c = ERROR * (o.length_squared() + to_unit.translation.length_squared() + 1.0);
        let (t0, t1) = (c / q, q / a);
        let mut roots = [
            (c.abs() > error_c && t0 > 0.0).then_some(t0),
            (t1 > 0.0 && q.abs() > ERROR * o.length() * d.length()).then_some(t1),
        ];
        if ANY {
            // If the far end lies on the sphere, the root next to it is that end.
            let end = o + d * self.t_max;
            let gradient = to_unit.matrix3.transpose() * end * 2.0;
            if (end.length_squared() - 1.0).abs() <= END * self.magnitude(gradient) + error_c {
                let is_end = (self.t_max - t0).abs() <= (self.t_max - t1).abs();
                roots[usize::from(!is_end)] = None;
            }
        }
        let within = roots.into_iter().flatten().filter(|t| *t <= self.t_max);
        within.reduce(f64::min).map(|t| (t, [0.0; 2]))
    }
}

/// The components of a vector in the order that has the longest of `d` last, the others as in
/// [`super::ray`].
fn order(d: DVec3) -> impl Fn(DVec3) -> [f64; 3] {
    let a = d.abs();
    let swap_x = a.x >= a.y && a.x > a.z;
    let swap_y = a.y > a.x && a.y > a.z;
    move |v| match (swap_x, swap_y) {
        (true, _) => [v.z, v.y, v.x],
        (_, true) => [v.x, v.z, v.y],
        _ => [v.x, v.y, v.z],
    }
}
