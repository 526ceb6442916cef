//! Where a ray meets a primitive that is known, in `f64`.

use super::known::Oracle;
use super::lights::ellipsoid;
use super::path::PathVertex;
use super::rays::Ray;
use super::vector::*;

impl Oracle<'_> {
    /// Where a ray meets the primitive that `near` lies on.
    pub(in crate::replay) fn hit(&self, ray: Ray, near: &PathVertex) -> Option<PathVertex> {
        let triangles = self.scene.triangles.len() as u32;
        let v = if near.primitive < triangles {
            self.hit_triangle(ray, near)
        } else {
            self.hit_sphere(ray, near, near.primitive - triangles)
        }?;
        v.p.iter().all(|x| x.is_finite()).then_some(v)
    }

    fn hit_triangle(&self, (o, d): Ray, near: &PathVertex) -> Option<PathVertex> {
        let indices = self.scene.triangles.get(near.primitive as usize)?.v;
        let [a, b, c] = self.corners(near.primitive);
        let (e1, e2) = (sub(b, a), sub(c, a));
        let n = cross(e1, e2);
        let t = dot(sub(a, o), n) / dot(d, n);
        if t.is_nan() || t <= 0.0 {
            return None;
        }
        let p = add(o, scale(d, t));
        let from = sub(p, a);
        let area = dot(n, n);
        let (b1, b2) = (
            dot(cross(from, e2), n) / area,
            dot(cross(e1, from), n) / area,
        );
        let corner = indices.map(|i| self.scene.vertices[i as usize]);
        let weights = [1.0 - b1 - b2, b1, b2];
        let mut smooth = [0.0; 3];
        for (corner, weight) in corner.iter().zip(weights) {
            smooth = add(smooth, scale(wide(corner.n), weight));
        }
        let ng = unit(n);
        let [uv0, uv1, uv2] = corner.map(|v| v.uv.map(f64::from));
        let (du1, dv1) = (uv1[0] - uv0[0], uv1[1] - uv0[1]);
        let (du2, dv2) = (uv2[0] - uv0[0], uv2[1] - uv0[1]);
        let det = du1 * dv2 - dv1 * du2;
        let mut along = [0.0; 3];
        for (i, weight) in indices.iter().zip(weights) {
            let given = self.scene.tangents.get(*i as usize);
            along = add(
                along,
                scale(wide(given.copied().unwrap_or_default()), weight),
            );
        }
        let tangent = if self.tangents && dot(along, along) > 0.0 {
            along
        } else if self.tangents && det != 0.0 {
            scale(sub(scale(e1, dv2), scale(e2, dv1)), 1f64.copysign(det))
        } else {
            [0.0; 3]
        };
        let v = PathVertex {
            p,
            ng,
            ns: if dot(smooth, smooth) > 0.0 {
                unit(smooth)
            } else {
                ng
            },
            tangent,
            ..near.clone()
        };
        Some(self.perturbed(v, [b1, b2]))
    }

    fn hit_sphere(&self, (o, d): Ray, near: &PathVertex, index: u32) -> Option<PathVertex> {
        let sphere = self.scene.spheres.get(index as usize)?;
        let (o, d) = (
            transform_point(&sphere.to_unit, o),
            transform_vector(&sphere.to_unit, d),
        );
        let (a, b) = (dot(d, d), dot(o, d));
        // A ray that only touches it in f32 may miss it by a rounding.
        let c = dot(o, o) - 1.0;
        let root = (b * b - a * c).max(0.0).sqrt();
        let q = -b - root.copysign(b);
        let there = transform_point(&sphere.to_unit, near.p);
        let at = |t: f64| unit(add(o, scale(d, t)));
        let miss = |t: f64| {
            let off = sub(at(t), there);
            if t > 0.0 {
                dot(off, off)
            } else {
                f64::INFINITY
            }
        };
        let (t0, t1) = (c / q, q / a);
        let t = if miss(t0) <= miss(t1) { t0 } else { t1 };
        if t.is_nan() || t <= 0.0 {
            return None;
        }
        let w = at(t);
        let p = transform_point(&sphere.to_world, w);
        let (n, _) = ellipsoid(sphere, p);
        let v = PathVertex {
            p,
            ng: n,
            ns: n,
            tangent: if self.tangents {
                transform_vector(&sphere.to_world, [-w[1], w[0], 0.0])
            } else {
                [0.0; 3]
            },
            ..near.clone()
        };
        Some(self.perturbed(v, [0.0; 2]))
    }
}
