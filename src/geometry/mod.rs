//! Points on surfaces: from what the tracer reports to positions, normals and texture coordinates,
//! eight hits at a time.
//!
//! Positions are recomputed on the primitive (barycentrics, or the projection to the unit sphere),
//! never taken from the ray, and come with a bound of their rounding error (pbrt-v3, section 3.9).
//! Rays start that far off the surface: no absolute epsilon.

mod derivatives;
mod frame;
mod instances;
mod large;
mod point;
mod sphere;

pub use self::derivatives::Derivatives;
pub use self::frame::shading_frame;
use self::large::LargeSurfaces;
pub use self::point::{AreaSample, SurfacePoint, Wanted};
use self::sphere::{SphereMap, SphereTables};
use crate::scene::{Instances, NONE, Scene, Shape, Sphere, Triangle, Vertex, VertexLanes};
use crate::simd::{Lanes, Mask, Vec3, math};
use crate::trace::offset;

/// Roundings in mapping a point of the unit sphere, that of its length included.
const SPHERE_ERROR: f32 = offset::gamma(10);

/// The primitives of a scene, ready for eight-wide loads.
pub struct Geometry<'a> {
    /// At least one.
    vertices: &'a [Vertex],
    /// Of vertices; those beyond its end have none.
    tangents: &'a [[f32; 3]],
    triangles: &'a [Triangle],
    spheres: &'a [Sphere],
    sphere_tables: SphereTables,
    shapes: &'a [Shape],
    large: LargeSurfaces<'a>,
    instances: &'a Instances,
    /// Radius of a ball about the origin that holds all geometry, at least `f32::MIN_POSITIVE`.
    pub radius: f32,
}

impl<'a> Geometry<'a> {
    /// Borrows the scene's tables. Vertices that no triangle refers to count for nothing.
    pub fn new(scene: &'a Scene) -> Self {
        // Vertices that no triangle refers to can lie anywhere.
        let [triangles, spheres] = [scene.own_triangles(), scene.own_spheres()];
        let corners = (scene.triangles[..triangles.end as usize].iter())
            .flat_map(|t| t.v)
            .map(|i| scene.vertices[i as usize].p);
        let reach = corners
            .map(|p| p.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>())
            .chain(scene.spheres[..spheres.end as usize].iter().map(|s| {
                // Centre plus the Frobenius norm of the linear part bounds every point.
                let centre: f64 = s.to_world.iter().map(|r| f64::from(r[3]).powi(2)).sum();
                let linear: f64 = (s.to_world.iter().flat_map(|r| &r[..3]))
                    .map(|x| f64::from(*x).powi(2))
                    .sum();
                (centre.sqrt() + linear.sqrt()).powi(2)
            }))
            .fold(0.0, f64::max);
        // Lanes without a triangle read vertex 0.
        const NO_VERTEX: &[Vertex] = &[Vertex {
            p: [0.0; 3],
            n: [0.0; 3],
            uv: [0.0; 2],
        }];
        let vertices = match &scene.vertices[..] {
            [] => NO_VERTEX,
            some => some,
        };
        let mut geometry = Self {
            vertices,
            tangents: &scene.tangents,
            triangles: &scene.triangles,
            spheres: &scene.spheres,
            sphere_tables: SphereTables::new(&scene.spheres),
            shapes: &scene.shapes,
            large: LargeSurfaces::new(scene),
            instances: &scene.instances,
            // Without geometry any radius serves, as long as its square and inverse are numbers.
            radius: 1.0,
        };
        let reach = reach.sqrt().max(geometry.reach_of_instances());
        if reach > 0.0 {
            geometry.radius = (reach * 1.000_001) as f32;
        }
        geometry
    }

    /// How many triangles there are: the first primitive that is a sphere.
    pub fn triangles(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// The shape of a primitive (triangles first, then spheres), and the light it is, or [`NONE`].
    #[inline(always)]
    pub fn shape_of(&self, prim: u32) -> (&Shape, u32) {
        let triangles = self.triangles.len() as u32;
        let (shape, local) = if prim < triangles {
            (self.triangles[prim as usize].shape, prim)
        } else {
            let local = prim - triangles;
            (self.spheres[local as usize].shape, local)
        };
        let shape = &self.shapes[shape as usize];
        let light = if shape.light == NONE {
            NONE
        } else {
            shape.light + (local - shape.first)
        };
        (shape, light)
    }

    /// The surface points of hits. `prim` has 1 to `N` entries, none of them [`NONE`], and
    /// `instance` as many if instances are wanted; `origin`, `direction`, `t` are read for spheres,
    /// `b1`, `b2` for triangles.
    #[inline(always)]
    pub fn surface_point<L: Lanes>(
        &self,
        (prim, instance): (&[u32], &[u32]),
        origin: Vec3<L>,
        direction: Vec3<L>,
        hit: [L; 3],
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        if wanted.instances {
            return self.instanced_point((prim, instance), [origin, direction], hit, wanted);
        }
        self.own_point(prim, [origin, direction], hit, wanted)
    }

    /// [`Self::surface_point`] in the space of the primitives' corners.
    #[inline(always)]
    fn own_point<L: Lanes>(
        &self,
        prim: &[u32],
        [origin, direction]: [Vec3<L>; 2],
        hit: [L; 3],
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        if wanted.large && !self.large.is_empty() {
            return self.large_point(prim, origin, direction, hit, wanted);
        }
        self.small_point(prim, origin, direction, hit, wanted)
    }

    /// [`Self::surface_point`] where some surfaces are large. Not inlined: the others keep their
    /// registers.
    #[cold]
    #[inline(never)]
    fn large_point<L: Lanes>(
        &self,
        prim: &[u32],
        origin: Vec3<L>,
        direction: Vec3<L>,
        [t, b1, b2]: [L; 3],
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        let mut inner = [b1, b2];
        let found = self.large.hit(prim, [origin, direction], t, &mut inner);
        let hit = [t, inner[0], inner[1]];
        let mut point = self.small_point(prim, origin, direction, hit, wanted);
        point.correct(&found, wanted);
        point
    }

    /// [`Self::surface_point`], as far as `f32` knows.
    #[inline(always)]
    fn small_point<L: Lanes>(
        &self,
        prim: &[u32],
        origin: Vec3<L>,
        direction: Vec3<L>,
        [t, b1, b2]: [L; 3],
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        let point = self.triangle_point(prim, b1, b2, wanted);
        let triangles = self.triangles.len() as u32;
        if !wanted.spheres || prim.iter().all(|p| *p < triangles) {
            return point;
        }
        let (on_sphere, map) =
            self.sphere_maps::<L>(prim.iter().map(|p| p.wrapping_sub(triangles)));
        let w = map.to_unit(direction.mul_add(t, origin)).normalize();
        let other = self.sphere_point(&map, w, wanted);
        let pick = |a: Vec3<L>, b: Vec3<L>| Vec3::select(on_sphere, a, b);
        SurfacePoint {
            p: pick(other.p, point.p),
            error: L::select(on_sphere, other.error, point.error),
            ng: pick(other.ng, point.ng),
            ns: pick(other.ns, point.ns),
            uv: [
                L::select(on_sphere, other.uv[0], point.uv[0]),
                L::select(on_sphere, other.uv[1], point.uv[1]),
            ],
            tangent: pick(other.tangent, point.tangent),
        }
    }

    #[inline(always)]
    fn triangle_point<L: Lanes>(
        &self,
        prim: &[u32],
        b1: L,
        b2: L,
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        let mut index = [[0u32; 8]; 3];
        for (i, &prim) in prim.iter().enumerate() {
            if let Some(triangle) = self.triangles.get(prim as usize) {
                for c in 0..3 {
                    index[c][i] = triangle.v[c];
                }
            }
        }
        let n = prim.len();
        let corner = |c: usize| VertexLanes::<L>::load(self.vertices, &index[c][..n]);
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let b0 = L::one() - b1 - b2;
        let blend = |x: Vec3<L>, y: Vec3<L>, z: Vec3<L>| z.mul_add(b2, y.mul_add(b1, x * b0));
        let (p0, p1, p2) = (a.p, b.p, c.p);
        let (p, error) = offset::triangle_point([p0, p1, p2], b1, b2);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let ng = unit_cross(e1, e2);
        let mut ns = ng;
        if wanted.normals {
            // Interpolated as they are, normalised after. They may be of any length: its square
            // must stay a number.
            let smooth = blend(a.n, b.n, c.n);
            let tiny = L::splat(f32::MIN_POSITIVE);
            let smooth = smooth * (L::one() / smooth.max_abs().max(tiny));
            let length2 = smooth.length2();
            let has_normal = length2.gt(L::zero());
            ns = Vec3::select(has_normal, smooth * (L::one() / length2.sqrt()), ng);
        }
        let (mut uv, mut tangent) = ([L::zero(); 2], Vec3::zero());
        if wanted.uv || wanted.tangent {
            let mix = |i: usize| c.uv[i].mul_add(b2, b.uv[i].mul_add(b1, a.uv[i] * b0));
            uv = [mix(0), mix(1)];
        }
        if wanted.tangent {
            // dp/du up to a positive factor (pbrt-v3, section 3.6.2).
            let (du1, dv1) = (b.uv[0] - a.uv[0], b.uv[1] - a.uv[1]);
            let (du2, dv2) = (c.uv[0] - a.uv[0], c.uv[1] - a.uv[1]);
            let det = du1 * dv2 - dv1 * du2;
            let dpdu = (e1 * dv2 - e2 * dv1) * L::one().copysign(det);
            tangent = dpdu.or_zero(det.eq(L::zero()).not());
            if !self.tangents.is_empty() {
                let given = self.given_tangents(&index, n, [b0, b1, b2]);
                tangent = Vec3::select(given.max_abs().gt(L::zero()), given, tangent);
            }
        }
        SurfacePoint {
            p,
            error: offset::error_distance(ng, error),
            ng,
            ns,
            uv,
            tangent,
        }
    }

    /// Interpolated between the vertices of `n` triangles; zero where their mesh has none.
    #[cold]
    #[inline(never)]
    fn given_tangents<L: Lanes>(&self, index: &[[u32; 8]; 3], n: usize, b: [L; 3]) -> Vec3<L> {
        let mut sum = Vec3::zero();
        for c in 0..3 {
            let mut corner = [[0.0; 8]; 3];
            for lane in 0..n {
                let s = self.tangents.get(index[c][lane] as usize);
                let s = s.copied().unwrap_or_default();
                (0..3).for_each(|axis| corner[axis][lane] = s[axis]);
            }
            let [x, y, z] = corner.map(|values| L::load(&values));
            sum = Vec3::new(x, y, z).mul_add(b[c], sum);
        }
        sum
    }

    #[inline(always)]
    fn sphere_point<L: Lanes>(
        &self,
        map: &SphereMap<L>,
        w: Vec3<L>,
        wanted: Wanted,
    ) -> SurfacePoint<L> {
        let p = map.to_world(w);
        let ng = map.normal(w);
        let (mut uv, mut tangent) = ([L::zero(); 2], Vec3::zero());
        if wanted.uv {
            uv = unit_sphere_uv(w);
        }
        if wanted.tangent {
            tangent = map.vector_to_world(Vec3::new(-w.y, w.x, L::zero()));
        }
        SurfacePoint {
            p,
            error: offset::error_distance(ng, map.reach(w) * L::splat(SPHERE_ERROR)),
            ng,
            ns: ng,
            uv,
            tangent,
        }
    }

    /// Texture coordinates at barycentric coordinates of triangles; lanes whose `prim` is none get
    /// those of vertex 0.
    #[inline(always)]
    pub fn triangle_uv<L: Lanes>(&self, prim: &[u32], b1: L, b2: L) -> [L; 2] {
        let wanted = Wanted {
            uv: true,
            tangent: false,
            normals: false,
            spheres: false,
            large: false,
            instances: false,
        };
        self.triangle_point(prim, b1, b2, wanted).uv
    }

    /// Texture coordinates at points `p` of spheres (`sphere` are sphere indices).
    #[inline(always)]
    pub fn sphere_uv<L: Lanes>(&self, sphere: &[u32], p: Vec3<L>) -> [L; 2] {
        let (_, map) = self.sphere_maps::<L>(sphere.iter().copied());
        unit_sphere_uv(map.to_unit(p).normalize())
    }

    /// Uniform over triangles (`prim` all triangles) of known areas.
    #[inline(always)]
    pub fn sample_triangles<L: Lanes>(
        &self,
        prim: &[u32],
        u: L,
        v: L,
        inv_area: L,
        uv: bool,
    ) -> AreaSample<L> {
        let [b1, b2] = sampled_barycentrics(u, v);
        let wanted = Wanted {
            uv,
            ..Wanted::default()
        };
        let point = self.triangle_point(prim, b1, b2, wanted);
        let sample = AreaSample {
            p: point.p,
            error: point.error,
            ng: point.ng,
            pdf: inv_area,
            uv: point.uv,
        };
        if !self.large.is_empty() {
            let prims = prim.iter().copied();
            let found = self.large.sampled(prims, sample.p, [b1, b2]);
            return sample.corrected(&found);
        }
        sample
    }

    /// Uniform over the unit sphere behind each sphere (`sphere` are sphere indices); uniform over
    /// area for true spheres.
    #[inline(always)]
    pub fn sample_spheres<L: Lanes>(&self, sphere: &[u32], u: L, v: L, uv: bool) -> AreaSample<L> {
        let (_, map) = self.sphere_maps::<L>(sphere.iter().copied());
        let w = math::uniform_sphere(u, v);
        let wanted = Wanted {
            uv,
            ..Wanted::default()
        };
        let point = self.sphere_point(&map, w, wanted);
        let sample = AreaSample {
            p: point.p,
            error: point.error,
            ng: point.ng,
            pdf: map.area_pdf(w),
            uv: point.uv,
        };
        if !self.large.is_empty() {
            let prims = sphere.iter().map(|s| s.wrapping_add(self.triangles()));
            let found = self.large.sampled(prims, sample.p, [L::zero(); 2]);
            return sample.corrected(&found);
        }
        sample
    }

    /// Density over area of [`Self::sample_spheres`] at points `p` of spheres.
    #[inline(always)]
    pub fn sphere_pdf<L: Lanes>(&self, sphere: &[u32], p: Vec3<L>) -> L {
        let (_, map) = self.sphere_maps::<L>(sphere.iter().copied());
        map.area_pdf(map.to_unit(p).normalize())
    }

    /// Internal area; `f64` inside, so that a tiny light has the area its vertices say.
    pub fn triangle_area(&self, triangle: u32) -> f32 {
        let corner = |c: usize| {
            let vertex = &self.vertices[self.triangles[triangle as usize].v[c] as usize];
            glam::DVec3::from(vertex.p.map(f64::from))
        };
        let (a, b, c) = (corner(0), corner(1), corner(2));
        (0.5 * (b - a).cross(c - a).length()) as f32
    }

    /// Internal area of a sphere or ellipsoid: the mean over directions of its area density's
    /// inverse.
    pub fn sphere_area(&self, sphere: u32) -> f32 {
        let n = 4096;
        let (_, map) = self.sphere_maps::<f32>(std::iter::once(sphere));
        let golden = 0.618_034_f64;
        (0..n)
            .map(|i| {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let w = math::uniform_sphere(u as f32, (f64::from(i) * golden).fract() as f32);
                1.0 / f64::from(map.area_pdf(w)) / f64::from(n)
            })
            .sum::<f64>() as f32
    }

    /// The maps of up to `N` spheres; lanes whose index is out of range get sphere 0 and a false
    /// mask.
    #[inline(always)]
    fn sphere_maps<L: Lanes>(&self, index: impl Iterator<Item = u32>) -> (L::Mask, SphereMap<L>) {
        let mut valid = 0u32;
        let mut pick = [0u32; 8];
        let mut n = 0;
        for s in index {
            if (s as usize) < self.spheres.len() {
                pick[n] = s;
                valid |= 1 << n;
            }
            n += 1;
        }
        let map = self.sphere_tables.load(&pick[..n]);
        (L::Mask::from_bits(valid), map)
    }
}

/// Barycentric coordinates of vertices 1 and 2, uniform over a triangle (pbrt-v3, section 13.6.5).
#[inline(always)]
pub fn sampled_barycentrics<L: Lanes>(u: L, v: L) -> [L; 2] {
    let root = u.sqrt();
    [v * root, L::one() - root]
}

/// Texture coordinates of the unit sphere at unit `w`.
#[inline(always)]
fn unit_sphere_uv<L: Lanes>(w: Vec3<L>) -> [L; 2] {
    // pbrt: u runs with phi, v from the south pole up.
    let turns = math::atan2(w.y, w.x) * L::splat(0.5 * std::f32::consts::FRAC_1_PI);
    let u = L::select(turns.lt(L::zero()), turns + L::one(), turns);
    let v = math::acos(w.z).mul_add(L::splat(-std::f32::consts::FRAC_1_PI), L::one());
    [u, v]
}

/// Unit normal of `a x b`, safe against underflow for tiny edges.
#[inline(always)]
fn unit_cross<L: Lanes>(a: Vec3<L>, b: Vec3<L>) -> Vec3<L> {
    let tiny = L::splat(f32::MIN_POSITIVE);
    let a = a * (L::one() / a.max_abs().max(tiny));
    let b = b * (L::one() / b.max_abs().max(tiny));
    let n = a.cross(b);
    // Slivers lose their length once more.
    (n * (L::one() / n.max_abs().max(tiny))).normalize()
}
