//! Points on large surfaces ([`crate::scene::large`]), found in `f64`: what is left of their error
//! is the rounding of the point, and, where that is next to nothing, what `f64` makes of the plane.

use glam::{DVec2, DVec3};

use super::point::{AreaSample, SurfacePoint, Wanted};
use crate::scene::{Large, NONE, Scene};
use crate::simd::{Lanes, Vec3};

/// The rounding of a coordinate to `f32`, twice.
const ROUNDING: f64 = 1.0 / 8_388_608.0;

/// The large surfaces of a scene by primitive.
pub(super) struct LargeSurfaces<'a> {
    table: &'a Large,
    /// Per primitive its place in the table, or [`NONE`]; empty if there are no large surfaces.
    places: Vec<u32>,
    /// Per triangle of the table its unit normal, and twice its area.
    planes: Vec<(DVec3, f64)>,
    /// Per sphere of the table: 1 if the outside is the front, -1 if the inside is.
    facing: Vec<f64>,
}

/// A point of a large surface.
#[derive(Clone, Copy)]
pub(super) struct LargePoint {
    p: [f32; 3],
    error: f32,
    ng: [f32; 3],
}

impl LargePoint {
    /// `off` is what `f64` has lost of the surface's place.
    fn new(p: DVec3, n: DVec3, off: f64) -> Self {
        Self {
            p: p.as_vec3().to_array(),
            error: (p.abs().dot(n.abs()) * ROUNDING + off) as f32,
            ng: n.as_vec3().to_array(),
        }
    }
}

impl<'a> LargeSurfaces<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let spheres = scene.large.spheres.iter();
        Self {
            table: &scene.large,
            places: (scene.large).places(scene.triangles.len(), scene.spheres.len()),
            planes: (scene.large.triangles.iter()).map(|t| t.plane()).collect(),
            facing: spheres
                .map(|s| scene.spheres[s.sphere as usize].facing.into())
                .collect(),
        }
    }

    /// No primitive is in the table.
    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The point of a primitive next to `x`, and its barycentric coordinates; `None` if the
    /// primitive is not large.
    fn nearest(
        &self,
        prim: u32,
        x: impl FnOnce(Option<[DVec3; 3]>) -> DVec3,
    ) -> Option<(LargePoint, [f32; 2])> {
        let place = *self.places.get(prim as usize)?;
        if place == NONE {
            return None;
        }
        if let Some(triangle) = self.table.triangles.get(place as usize) {
            let [a, b, c] = triangle.p;
            let (e1, e2) = (b - a, c - a);
            let (unit, area) = self.planes[place as usize];
            let x = x(Some(triangle.p));
            let x = x - unit * unit.dot(x - a);
            let from = x - a;
            let inner = DVec2::new(from.cross(e2).dot(unit), e1.cross(from).dot(unit)) / area;
            let b1 = (inner.x as f32).clamp(0.0, 1.0);
            let b2 = (inner.y as f32).clamp(0.0, 1.0 - b1);
            return Some((LargePoint::new(x, unit, triangle.off), [b1, b2]));
        }
        let place = place as usize - self.table.triangles.len();
        let sphere = &self.table.spheres[place];
        let w = (sphere.to_unit.transform_point3(x(None))).normalize_or(DVec3::Z);
        let n = sphere.to_unit.matrix3.transpose() * w * self.facing[place];
        let p = sphere.to_world.transform_point3(w);
        // The tracer knows how far `f64` is from a sphere.
        Some((LargePoint::new(p, n.normalize_or_zero(), 0.0), [0.0; 2]))
    }

    /// The large surfaces among the primitives that rays have hit; `b` becomes theirs.
    #[cold]
    #[inline(never)]
    pub(super) fn hit<L: Lanes>(
        &self,
        prim: &[u32],
        [origin, direction]: [Vec3<L>; 2],
        t: L,
        b: &mut [L; 2],
    ) -> [Option<LargePoint>; 8] {
        let wide = |v: Vec3<L>, i: usize| DVec3::from(v.lane(i).map(f64::from));
        let mut inner = b.map(lanes);
        let mut found = [None; 8];
        for (i, &prim) in prim.iter().enumerate() {
            let t = f64::from(t.lane(i));
            let near = self.nearest(prim, |corners| match corners {
                // Not the hit of a ray but a place on the surface.
                Some([p0, p1, p2]) if t == 0.0 => {
                    let [b1, b2] = [inner[0][i], inner[1][i]].map(f64::from);
                    p0 * (1.0 - b1 - b2) + p1 * b1 + p2 * b2
                }
                _ => wide(origin, i) + wide(direction, i) * t,
            });
            if let Some((point, [b1, b2])) = near {
                (inner[0][i], inner[1][i]) = (b1, b2);
                found[i] = Some(point);
            }
        }
        *b = inner.map(|b| L::load(&b));
        found
    }

    /// Points that were sampled on primitives, `p` and its barycentric coordinates, where those are
    /// large.
    #[cold]
    #[inline(never)]
    pub(super) fn sampled<L: Lanes>(
        &self,
        prim: impl Iterator<Item = u32>,
        p: Vec3<L>,
        mut b: [L; 2],
    ) -> [Option<LargePoint>; 8] {
        let (mut prims, mut n) = ([NONE; 8], 0);
        for prim in prim {
            prims[n] = prim;
            n += 1;
        }
        self.hit(&prims[..n], [p, Vec3::zero()], L::zero(), &mut b)
    }
}

impl<L: Lanes> SurfacePoint<L> {
    /// Replaces points of large surfaces, which `f32` has found badly, by those of `f64`.
    #[cold]
    #[inline(never)]
    pub(super) fn correct(&mut self, found: &[Option<LargePoint>; 8], wanted: Wanted) {
        for (i, point) in found.iter().enumerate() {
            let Some(LargePoint { p, error, ng }) = *point else {
                continue;
            };
            let is_geometric = !wanted.normals || self.ns.lane(i) == self.ng.lane(i);
            put(&mut self.p, i, p);
            put(&mut self.ng, i, ng);
            if is_geometric {
                put(&mut self.ns, i, ng);
            }
            self.error = put_one(self.error, i, error);
        }
    }
}

impl<L: Lanes> AreaSample<L> {
    /// The same for sampled points.
    #[cold]
    #[inline(never)]
    pub(super) fn corrected(mut self, found: &[Option<LargePoint>; 8]) -> Self {
        for (i, point) in found.iter().enumerate() {
            let Some(LargePoint { p, error, ng }) = *point else {
                continue;
            };
            put(&mut self.p, i, p);
            put(&mut self.ng, i, ng);
            self.error = put_one(self.error, i, error);
        }
        self
    }
}

pub(super) fn lanes<L: Lanes>(x: L) -> [f32; 8] {
    let mut out = [0.0; 8];
    x.store(&mut out);
    out
}

pub(super) fn put_one<L: Lanes>(x: L, i: usize, value: f32) -> L {
    let mut all = lanes(x);
    all[i] = value;
    L::load(&all)
}

pub(super) fn put<L: Lanes>(v: &mut Vec3<L>, i: usize, [x, y, z]: [f32; 3]) {
    v.x = put_one(v.x, i, x);
    v.y = put_one(v.y, i, y);
    v.z = put_one(v.z, i, z);
}
