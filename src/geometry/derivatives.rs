//! How points and normals change along texture coordinates, for what displaces surfaces. In `f64`,
//! one hit at a time: few hits ask.

use super::Geometry;
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// Derivatives along texture coordinates; internal space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// Both zero where texture coordinates do not tell directions.
    pub dpdu: DVec3,
    /// Of the point along `v`.
    pub dpdv: DVec3,
    /// Of the unit shading normal.
    pub dndu: DVec3,
    /// Of the unit shading normal along `v`.
    pub dndv: DVec3,
    /// The shading frame is not that of the texture coordinates: the normal or the tangent is
    /// interpolated between vertices.
    pub smooth: bool,
}

impl Geometry<'_> {
    /// The derivatives at a point `p` of a primitive, in the space of its corners, and the unit
    /// shading normal there, zero where the geometric one serves; `b1`, `b2` are its barycentric
    /// coordinates if that is a triangle.
    pub(super) fn own_derivatives(
        &self,
        primitive: u32,
        b: [f64; 2],
        p: DVec3,
    ) -> (Derivatives, DVec3) {
        let triangles = self.triangles();
        if primitive < triangles {
            self.triangle_derivatives(primitive, b)
        } else {
            self.sphere_derivatives(primitive - triangles, p)
        }
    }

    fn triangle_derivatives(&self, triangle: u32, [b1, b2]: [f64; 2]) -> (Derivatives, DVec3) {
        let corners = (self.triangles[triangle as usize].v).map(|v| self.vertices[v as usize]);
        let uv = corners.map(|v| v.uv.map(f64::from));
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let (p, normals) = (corners.map(|v| wide(v.p)), corners.map(|v| wide(v.n)));
        let across = |v: [DVec3; 3]| (v[1] - v[0], v[2] - v[0]);
        let (du1, dv1) = (uv[1][0] - uv[0][0], uv[1][1] - uv[0][1]);
        let (du2, dv2) = (uv[2][0] - uv[0][0], uv[2][1] - uv[0][1]);
        let inverse = 1.0 / (du1 * dv2 - dv1 * du2);
        // pbrt-v3, section 3.6.2.
        let along = |(e1, e2): (DVec3, DVec3)| {
            let by_u = (e1 * dv2 - e2 * dv1) * inverse;
            let by_v = (e2 * du1 - e1 * du2) * inverse;
            if by_u.is_finite() && by_v.is_finite() {
                (by_u, by_v)
            } else {
                (DVec3::ZERO, DVec3::ZERO)
            }
        };
        let (mut dpdu, mut dpdv) = along(across(p));
        let n = normals[0] * (1.0 - b1 - b2) + normals[1] * b1 + normals[2] * b2;
        let smooth = n.length_squared() > 0.0;
        let (mut dndu, mut dndv) = (DVec3::ZERO, DVec3::ZERO);
        if smooth {
            let (by_u, by_v) = along(across(normals));
            (dndu, dndv) = (of_unit(n, by_u), of_unit(n, by_v));
        }
        let given = self.given_tangent(triangle, [1.0 - b1 - b2, b1, b2]);
        let is_given = given != DVec3::ZERO;
        if is_given {
            // pbrt-v4's Triangle: only the part along the surface counts, and what is across it is
            // as long.
            let (e1, e2) = across(p);
            let n = if smooth { n } else { e1.cross(e2) };
            (dpdu, dpdv) = (given, n.normalize_or_zero().cross(given));
        }
        let derivatives = Derivatives {
            dpdu,
            dpdv,
            dndu,
            dndv,
            smooth: smooth || is_given,
        };
        (derivatives, n.normalize_or_zero())
    }

    /// The tangent between the vertices of a triangle; zero where there is none.
    fn given_tangent(&self, triangle: u32, b: [f64; 3]) -> DVec3 {
        let of = |v: u32| {
            let s = self.tangents.get(v as usize).copied().unwrap_or_default();
            DVec3::from(s.map(f64::from))
        };
        let corners = self.triangles[triangle as usize].v.map(of);
        corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2]
    }

    fn sphere_derivatives(&self, sphere: u32, p: DVec3) -> (Derivatives, DVec3) {
        let sphere = &self.spheres[sphere as usize];
        let linear = |m: &[[f32; 4]; 3]| {
            let row = |r: &[f32; 4]| DVec3::new(r[0].into(), r[1].into(), r[2].into());
            // Rows of the map are columns of its transpose.
            DMat3::from_cols(row(&m[0]), row(&m[1]), row(&m[2]))
        };
        let to_world = linear(&sphere.to_world).transpose();
        // The transpose of the inverse, which takes normals.
        let for_normals = linear(&sphere.to_unit);
        let shift = DVec3::from(sphere.to_unit.map(|r| f64::from(r[3])));
        let w = (for_normals.transpose() * p + shift).normalize_or(DVec3::Z);
        // pbrt moves the poles aside, where u has no direction.
        let x = if w.x == 0.0 && w.y == 0.0 { 1e-5 } else { w.x };
        let r = x.hypot(w.y);
        let by_u = DVec3::new(-w.y, x, 0.0) * TAU;
        let by_v = DVec3::new(w.z * x / r, w.z * w.y / r, -r) * -PI;
        let n = for_normals * w;
        let facing = f64::from(sphere.facing);
        let derivatives = Derivatives {
            dpdu: to_world * by_u,
            dpdv: to_world * by_v,
            dndu: of_unit(n, for_normals * by_u) * facing,
            dndv: of_unit(n, for_normals * by_v) * facing,
            smooth: false,
        };
        (derivatives, n.normalize_or_zero() * facing)
    }
}

/// The derivative of `n / |n|` from that of `n`.
pub(super) fn of_unit(n: DVec3, by: DVec3) -> DVec3 {
    let length = n.length();
    let unit = n / length;
    (by - unit * unit.dot(by)) / length
}
