//! Surfaces over a grid: height fields, and NURBS, which pbrt-v3 evaluates at [`DICE`] times
//! [`DICE`] points.

use glam::{DVec3, DVec4};

use super::{MeshData, narrow_normals};

/// Points of a NURBS surface in each direction: pbrt-v3's number, whose facets show.
pub const DICE: usize = 30;

/// More control points than this never act on one point.
const MAX_ORDER: usize = 32;

/// The corners of each cell are split along the diagonal from its first.
fn cells(nu: usize, nv: usize) -> Vec<[u32; 3]> {
    let corner = |u: usize, v: usize| (v * nu + u) as u32;
    let mut triangles = Vec::with_capacity(2 * (nu - 1) * (nv - 1));
    for v in 0..nv - 1 {
        for u in 0..nu - 1 {
            let [a, b] = [corner(u, v), corner(u + 1, v)];
            let [c, d] = [corner(u + 1, v + 1), corner(u, v + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// Heights over the unit square, `nu` in a row; at least two rows of at least two. `(u, v)` is
/// `(x, y)`.
pub fn height_field(nu: usize, heights: &[f64]) -> MeshData {
    let nv = heights.len() / nu.max(1);
    if nu < 2 || nv < 2 {
        return MeshData {
            warnings: vec!["the shape has no area".into()],
            ..Default::default()
        };
    }
    let at = |i: usize, n: usize| (i as f64 / (n - 1) as f64) as f32;
    let places = (0..nv).flat_map(|v| (0..nu).map(move |u| [at(u, nu), at(v, nv)]));
    let uvs: Vec<_> = places.collect();
    let positions = uvs
        .iter()
        .zip(heights)
        .map(|(p, z)| [p[0], p[1], *z as f32]);
    let mut mesh = MeshData {
        positions: positions.collect(),
        triangles: cells(nu, nv),
        uvs: Some(uvs),
        ..Default::default()
    };
    mesh.drop_degenerate();
    mesh
}

/// Knots of one direction, and the range of the parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Knots {
    order: usize,
    /// Do not decrease.
    knots: Vec<f64>,
    range: [f64; 2],
}

impl Knots {
    /// For so many control points; or what is wrong. Without a range, all of it.
    pub fn new(
        points: usize,
        order: usize,
        knots: &[f64],
        range: [Option<f64>; 2],
    ) -> Result<Self, String> {
        if !(2..=MAX_ORDER.min(points)).contains(&order) {
            return Err(format!(
                "the order {order} must be between 2 and the number of control points ({points}), at most {MAX_ORDER}"
            ));
        }
        if knots.len() != points + order {
            return Err(format!(
                "has {} knots, must be {points} control points and the order {order}",
                knots.len()
            ));
        }
        if !knots.is_sorted() || !knots.iter().all(|k| k.is_finite()) {
            return Err("the knots must not decrease".into());
        }
        let [low, high] = [knots[order - 1], knots[points]];
        let range = [range[0].unwrap_or(low), range[1].unwrap_or(high)];
        if range.iter().any(|t| !(low..=high).contains(t)) {
            return Err(format!("is asked for beyond its knots, {low} to {high}"));
        }
        Ok(Self {
            order,
            knots: knots.to_vec(),
            range,
        })
    }

    fn points(&self) -> usize {
        self.knots.len() - self.order
    }

    fn at(&self, i: usize) -> f64 {
        let s = i as f64 / (DICE - 1) as f64;
        self.range[0] * (1.0 - s) + self.range[1] * s
    }

    /// The interval of knots that a parameter lies in; at a knot the one before it.
    fn interval(&self, t: f64) -> usize {
        let last = self.points() - 1;
        let beyond = |i: usize| t > self.knots[i + 1];
        (self.order - 1..last).find(|&i| !beyond(i)).unwrap_or(last)
    }

    /// Weights of the control points from the first that acts on `t`, and their derivatives.
    fn weights(&self, t: f64) -> (usize, [[f64; MAX_ORDER]; 2]) {
        let (k, at) = (self.order, self.interval(t));
        let knot = |i: usize| self.knots[i];
        let part = |x: f64, of: f64| if of > 0.0 { x / of } else { 0.0 };
        // Cox and de Boor: from degree 0 up; entry `j` is of control point `at - degree + j`.
        let (mut w, mut d) = ([0.0; MAX_ORDER], [0.0; MAX_ORDER]);
        w[0] = 1.0;
        for degree in 1..k {
            let mut next = [0.0; MAX_ORDER];
            for j in 0..degree {
                // Of one degree lower, over the knots from `i` to `i + degree`.
                let i = at + 1 - degree + j;
                let span = knot(i + degree) - knot(i);
                let right = part(t - knot(i), span);
                next[j + 1] += w[j] * right;
                next[j] += w[j] * (1.0 - right);
                if degree == k - 1 {
                    let slope = part(degree as f64 * w[j], span);
                    d[j + 1] += slope;
                    d[j] -= slope;
                }
            }
            w = next;
        }
        (at + 1 - k, [w, d])
    }
}

/// A NURBS surface through homogeneous control points, rows of `u`. `(u, v)` are the parameters
/// themselves, as in pbrt-v3; the front is where `dp/du x dp/dv` points.
pub fn nurbs(u: &Knots, v: &Knots, points: &[DVec4]) -> Result<MeshData, String> {
    let nu = u.points();
    if points.len() != nu * v.points() {
        return Err(format!(
            "has {} control points, must be {nu} times {}",
            points.len(),
            v.points()
        ));
    }
    let of_u: Vec<_> = (0..DICE).map(|i| u.weights(u.at(i))).collect();
    let mut mesh = MeshData::default();
    let mut normals = Vec::with_capacity(DICE * DICE);
    let uvs = mesh.uvs.get_or_insert_default();
    for j in 0..DICE {
        let (first_v, by_v) = v.weights(v.at(j));
        for (i, (first_u, by_u)) in of_u.iter().enumerate() {
            let sum = |a: &[f64; MAX_ORDER], b: &[f64; MAX_ORDER]| {
                let mut sum = DVec4::ZERO;
                for (row, wv) in b[..v.order].iter().enumerate() {
                    let row = &points[(first_v + row) * nu + first_u..][..u.order];
                    sum += row.iter().zip(a).map(|(p, wu)| *p * *wu).sum::<DVec4>() * *wv;
                }
                sum
            };
            let p = sum(&by_u[0], &by_v[0]);
            let place = p.truncate() / p.w;
            let slope = |d: DVec4| (d.truncate() - place * d.w) / p.w;
            let du = slope(sum(&by_u[1], &by_v[0]));
            let dv = slope(sum(&by_u[0], &by_v[1]));
            mesh.positions.push(place.as_vec3().to_array());
            let n: DVec3 = du.cross(dv).normalize_or_zero();
            normals.push(n);
            uvs.push([u.at(i) as f32, v.at(j) as f32]);
        }
    }
    mesh.normals = Some(narrow_normals(&normals));
    mesh.triangles = cells(DICE, DICE);
    mesh.drop_degenerate();
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_fields_lie_over_the_unit_square() {
        let mesh = height_field(3, &[0.0, 1.0, 2.0, 0.0, 1.0, 2.0]);
        assert_eq!(mesh.positions[4], [0.5, 1.0, 1.0]);
        assert_eq!(mesh.uvs.as_ref().unwrap()[5], [1.0, 1.0]);
        assert_eq!(mesh.triangles.len(), 4);
        assert_eq!(mesh.triangles[..2], [[0, 1, 4], [0, 4, 3]]);
        assert!(height_field(1, &[0.0; 4]).triangles.is_empty());
    }

    /// Rational quadratic arcs make an exact quarter of a cylinder.
    #[test]
    fn nurbs_are_rational() {
        let w = 0.5f64.sqrt();
        let arc = |z: f64| {
            let corner = |x: f64, y: f64, w: f64| DVec4::new(x * w, y * w, z * w, w);
            [
                corner(1.0, 0.0, 1.0),
                corner(1.0, 1.0, w),
                corner(0.0, 1.0, 1.0),
            ]
        };
        let points = [arc(0.0), arc(2.0)].concat();
        let u = Knots::new(3, 3, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [None; 2]).unwrap();
        let v = Knots::new(2, 2, &[3.0, 3.0, 4.0, 4.0], [Some(3.5), None]).unwrap();
        let mesh = nurbs(&u, &v, &points).unwrap();
        assert_eq!(mesh.triangles.len(), 2 * 29 * 29);
        let (normals, uvs) = (mesh.normals.unwrap(), mesh.uvs.unwrap());
        for ((p, n), uv) in mesh.positions.iter().zip(&normals).zip(&uvs) {
            assert!((p[0].hypot(p[1]) - 1.0).abs() < 1e-6, "{p:?}");
            let out = n[0] * p[0] + n[1] * p[1];
            assert!((out - 1.0).abs() < 1e-6, "{p:?} {n:?}");
            assert!((p[2] - 2.0 * (uv[1] - 3.0)).abs() < 1e-5, "{p:?} {uv:?}");
        }
        assert!(mesh.positions[0][2] == 1.0 && mesh.positions[899][2] == 2.0);
    }

    /// With equal weights, and knots in the middle: at the knot of a cubic, 1/6, 4/6, 1/6.
    #[test]
    fn weights_are_those_of_b_splines() {
        let knots: Vec<f64> = (0..9).map(f64::from).collect();
        let knots = Knots::new(5, 4, &knots, [None; 2]).unwrap();
        let (first, [w, d]) = knots.weights(4.0);
        let expected = [0.0, 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        assert_eq!(first, 0);
        for (w, e) in w.iter().zip(expected) {
            assert!((w - e).abs() < 1e-12, "{w} {e}");
        }
        for (d, e) in d.iter().zip([0.0, -0.5, 0.0, 0.5]) {
            assert!((d - e).abs() < 1e-12, "{d} {e}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let flat = [0.0, 0.0, 1.0, 1.0];
        assert!(Knots::new(2, 2, &flat, [None; 2]).is_ok());
        assert!(
            Knots::new(2, 3, &flat, [None; 2])
                .unwrap_err()
                .contains("order")
        );
        assert!(
            Knots::new(3, 2, &flat, [None; 2])
                .unwrap_err()
                .contains("knots")
        );
        let turned = [0.0, 1.0, 0.0, 1.0];
        assert!(
            Knots::new(2, 2, &turned, [None; 2])
                .unwrap_err()
                .contains("decrease")
        );
        let beyond = [Some(-1.0), None];
        assert!(
            Knots::new(2, 2, &flat, beyond)
                .unwrap_err()
                .contains("beyond")
        );
    }
}
