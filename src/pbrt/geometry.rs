//! Geometry in world space, `f64`: meshes and spheres with their orientation folded in, and
//! instances of them.

mod copies;
mod normal_map;

use std::f64::consts::PI;
use std::rc::Rc;

use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

use self::normal_map::NormalMap;
use super::error::{Report, SceneError, Site};
use super::lights::AreaLight;
use super::loading::Loading;
use super::transform::{Place, normal_matrix};
use crate::pbrt::budget::{Budget, Charge};
use crate::pbrt::mesh::MeshData;
use crate::scene;

/// Triangles and spheres a scene may have after instancing: 67 million take about 5 GB.
pub(super) const MAX_PRIMITIVES: usize = 1 << 26;

/// Coordinates beyond this are treated as infinite: squares and products of them must stay numbers.
const FARTHEST: f64 = 1e100;

pub(super) fn is_placeable(p: DVec3) -> bool {
    p.to_array().iter().all(|c| c.abs() <= FARTHEST)
}

/// What is wrong with more than [`MAX_PRIMITIVES`].
pub(super) fn too_many() -> String {
    format!(
        "the scene has more than {MAX_PRIMITIVES} triangles, instances included; use fewer instances or simpler meshes"
    )
}

#[derive(Clone, Copy, Debug)]
pub(super) struct WorldVertex {
    pub p: DVec3,
    /// Of any length; zero if there is none. Lengths count relative to those of the same mesh.
    pub n: Vec3,
    pub uv: Vec2,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct WorldTriangle {
    /// Ordered so that the front is where `cross(p1 - p0, p2 - p0)` points.
    pub v: [u32; 3],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct WorldSphere {
    /// Unit sphere to world.
    pub to_world: DAffine3,
    /// +1 if the front is outside.
    pub facing: f32,
}

/// Primitives of one `Shape` directive: `count` of them from `first` on, in the table of their
/// kind.
#[derive(Clone, Debug)]
pub(super) struct WorldShape {
    pub site: Rc<Site>,
    pub material: u32,
    /// Index into the scene's table, or [`NONE`](scene::NONE).
    pub alpha: u32,
    pub light: Option<Rc<AreaLight>>,
    /// Numbers of media, `[outside, inside]`.
    pub media: [u32; 2],
    /// `power` is that of the whole shape; otherwise each triangle has it, as in pbrt.
    pub power_of_whole: bool,
    pub spheres: bool,
    pub first: u32,
    pub count: u32,
}

/// What the graphics state says about the shapes that follow.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    pub site: Rc<Site>,
    pub place: Place,
    pub reverse: bool,
    pub material: u32,
    /// Index into the scene's table of alpha masks, or [`NONE`](scene::NONE).
    pub alpha: u32,
    /// The material or the alpha mask looks at texture coordinates.
    pub needs_uv: bool,
    /// It matters to the material how tangents lie.
    pub sees_tangents: bool,
    /// The material is a fibre: a curve of it is met once.
    pub fibre: bool,
    pub light: Option<Rc<AreaLight>>,
    /// Numbers of media, `[outside, inside]`.
    pub media: [u32; 2],
}

/// A mesh in object space, checked: indices are in range, optional arrays are as long as
/// `positions`.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<DVec3>>,
    /// pbrt's `S`.
    pub tangents: Option<Vec<DVec3>>,
    pub uvs: Option<Vec<DVec2>>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// From a reader or tessellator, whose word on indices is not taken for granted.
    pub fn from_data(data: MeshData) -> Result<Self, String> {
        let count = data.positions.len();
        if data
            .triangles
            .iter()
            .flatten()
            .any(|&i| i as usize >= count)
        {
            return Err(format!("the mesh has an index beyond its {count} vertices"));
        }
        let triple = |v: [f32; 3]| Vec3::from(v).as_dvec3();
        Ok(Self {
            normals: data
                .normals
                .filter(|n| n.len() == count)
                .map(|n| n.into_iter().map(triple).collect()),
            tangents: None,
            uvs: data
                .uvs
                .filter(|t| t.len() == count)
                .map(|t| t.into_iter().map(|t| Vec2::from(t).as_dvec2()).collect()),
            positions: data.positions.into_iter().map(triple).collect(),
            triangles: data.triangles,
        })
    }
}

#[derive(Debug)]
pub(super) struct Geometry {
    pub vertices: Vec<WorldVertex>,
    /// Of vertices; those beyond its end have none.
    pub tangents: Vec<DVec3>,
    pub triangles: Vec<WorldTriangle>,
    pub spheres: Vec<WorldSphere>,
    pub shapes: Vec<WorldShape>,
    budget: Rc<Budget>,
    room: Charge,
}

/// Peak memory of a vertex, a triangle or a sphere while a scene is loaded: here, and in the table
/// that is made of it.
const VERTEX_BYTES: usize = size_of::<WorldVertex>() + size_of::<scene::Vertex>();
const TRIANGLE_BYTES: usize = size_of::<WorldTriangle>() + size_of::<scene::Triangle>();
const SPHERE_BYTES: usize = size_of::<WorldSphere>() + size_of::<scene::Sphere>();
/// The same of a shape, with the directive that messages name, and of a light on a primitive.
const SHAPE_BYTES: usize =
    2 * (size_of::<WorldShape>() + size_of::<scene::Shape>()) + size_of::<Site>() + 64;
const LIGHT_BYTES: usize = 2 * size_of::<scene::Light>();

impl Geometry {
    pub fn new(budget: &Rc<Budget>) -> Self {
        Self {
            vertices: Vec::new(),
            tangents: Vec::new(),
            triangles: Vec::new(),
            spheres: Vec::new(),
            shapes: Vec::new(),
            budget: Rc::clone(budget),
            room: Charge::none(budget),
        }
    }

    /// Triangles and spheres.
    pub fn primitives(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// Bytes these tables take in memory, roughly.
    pub fn bytes(&self) -> usize {
        self.vertices.len() * size_of::<WorldVertex>()
            + self.tangents.len() * size_of::<DVec3>()
            + self.triangles.len() * size_of::<WorldTriangle>()
            + self.spheres.len() * size_of::<WorldSphere>()
    }

    /// What its memory is taken from.
    pub fn budget(&self) -> &Rc<Budget> {
        &self.budget
    }

    /// Memory for something that is made before it is added.
    pub fn room_to_make(&self, bytes: u64) -> Result<Charge, String> {
        Charge::of(&self.budget, bytes)
    }

    /// Who is told how loading goes.
    pub fn loading(&self) -> &Loading {
        &self.budget.loading
    }

    /// Takes memory for what one directive adds, or says that there is too much of it.
    fn room_for(
        &mut self,
        site: &Site,
        primitives: usize,
        vertices: usize,
        shapes: usize,
    ) -> Result<(), SceneError> {
        let fits = |have: usize, more: usize, limit: usize| {
            have.checked_add(more).is_some_and(|n| n <= limit)
        };
        if fits(self.primitives(), primitives, MAX_PRIMITIVES)
            && fits(self.vertices.len(), vertices, 3 * MAX_PRIMITIVES)
        {
            let each = if vertices > 0 {
                TRIANGLE_BYTES
            } else {
                SPHERE_BYTES
            };
            let bytes = vertices * VERTEX_BYTES + primitives * each + shapes * SHAPE_BYTES;
            self.room.add(bytes as u64).map_err(|e| site.error(e))?;
            self.budget.loading.add_primitives(primitives as u64);
            return Ok(());
        }
        Err(site.error(too_many()))
    }

    /// Takes memory for the lights of so many primitives, and what messages call each of them.
    fn room_for_lights(&mut self, setting: &Setting, primitives: usize) -> Result<(), SceneError> {
        let site = &setting.site;
        let each = match setting.light {
            Some(_) => LIGHT_BYTES + site.pos.file.len() + 32,
            None => 0,
        };
        let room = self.room.add((primitives * each) as u64);
        room.map_err(|e| site.error(e))
    }

    pub fn add_sphere(&mut self, setting: &Setting, radius: f64) -> Result<(), SceneError> {
        let Some(ctm) = setting.place.affine() else {
            return Err(setting.site.error(
                "the current transform is projective, which makes no sphere; use a plymesh",
            ));
        };
        self.room_for(&setting.site, 1, 0, 1)?;
        self.room_for_lights(setting, 1)?;
        let to_world = *ctm * DAffine3::from_scale(DVec3::splat(radius));
        let reach = to_world.matrix3.to_cols_array().map(f64::abs);
        let far = to_world.translation.abs() + DVec3::splat(reach.iter().sum());
        if super::transform::inverse(&to_world).is_none() || !is_placeable(far) {
            return Err(setting
                .site
                .error("its radius and the current transform leave no sphere with a volume"));
        }
        // The outside stays outside under any transform, mirrored or not.
        let facing = if setting.reverse { -1.0 } else { 1.0 };
        let first = self.spheres.len() as u32;
        self.spheres.push(WorldSphere { to_world, facing });
        self.push_shape(setting, true, true, first, 1);
        Ok(())
    }

    fn push_shape(
        &mut self,
        setting: &Setting,
        spheres: bool,
        power_of_whole: bool,
        first: u32,
        count: u32,
    ) {
        self.shapes.push(WorldShape {
            site: Rc::clone(&setting.site),
            material: setting.material,
            alpha: setting.alpha,
            light: setting.light.clone(),
            media: setting.media,
            power_of_whole,
            spheres,
            first,
            count,
        });
    }

    /// Adds a mesh, each triangle's vertices ordered by pbrt's rule: where there are vertex
    /// normals, the front is the side they are on (`ReverseOrientation` turns them round, too);
    /// otherwise it is the image of the front in object space, turned round by
    /// `ReverseOrientation`. Triangles with vertices that are not finite are dropped.
    pub fn add_mesh(
        &mut self,
        setting: &Setting,
        mesh: &Mesh,
        power_of_whole: bool,
        report: &mut Report,
    ) -> Result<(), SceneError> {
        // Without texture coordinates every triangle has its own, (0,0) (1,0) (1,1), and so its own
        // vertices.
        let unshared = mesh.uvs.is_none() && setting.needs_uv;
        let vertex_count = if unshared {
            mesh.triangles.len().saturating_mul(3)
        } else {
            mesh.positions.len()
        };
        self.room_for(&setting.site, mesh.triangles.len(), vertex_count, 1)?;
        self.room_for_lights(setting, mesh.triangles.len())?;

        let facing = if setting.reverse { -1.0 } else { 1.0 };
        let given = mesh.normals.as_deref().unwrap_or_default();
        let normals = NormalMap::of(setting.place.normals() * facing, given);
        let vertex = |i: usize| WorldVertex {
            p: setting.place.point(mesh.positions[i]),
            n: mesh
                .normals
                .as_ref()
                .map_or(Vec3::ZERO, |n| normals.apply(n[i])),
            uv: mesh.uvs.as_ref().map_or(Vec2::ZERO, |t| {
                // What `f32` does not hold is infinite, too.
                let uv = t[i].as_vec2();
                if uv.is_finite() { uv } else { Vec2::ZERO }
            }),
        };
        let base = self.vertices.len() as u32;
        let first = self.triangles.len() as u32;
        if mesh.tangents.is_some() {
            self.room_for_tangents(&setting.site, vertex_count)?;
        }
        let tangent = |i: usize| {
            let s = mesh.tangents.as_ref().map_or(DVec3::ZERO, |s| s[i]);
            setting.place.vector(s)
        };
        if !unshared {
            self.vertices.extend((0..mesh.positions.len()).map(vertex));
            for i in 0..mesh.tangents.as_ref().map_or(0, Vec::len) {
                self.set_tangent(base as usize + i, tangent(i));
            }
        }
        let flip = setting.reverse != setting.place.mirrors();
        let mut dropped = 0;
        for indices in &mesh.triangles {
            let mut v = indices.map(|i| base.wrapping_add(i));
            let corners = if unshared {
                indices.map(|i| vertex(i as usize))
            } else {
                v.map(|i| self.vertices[i as usize])
            };
            if !corners.iter().all(|c| is_placeable(c.p)) {
                dropped += 1;
                continue;
            }
            if unshared {
                let at = self.vertices.len() as u32;
                v = [at, at + 1, at + 2];
                let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE];
                self.vertices.extend(
                    corners
                        .iter()
                        .zip(uvs)
                        .map(|(c, uv)| WorldVertex { uv, ..*c }),
                );
                for (corner, i) in indices.iter().enumerate() {
                    self.set_tangent(at as usize + corner, tangent(*i as usize));
                }
            }
            let [a, b, c] = corners;
            let side = (a.n + b.n + c.n)
                .as_dvec3()
                .dot((b.p - a.p).cross(c.p - a.p));
            if side < 0.0 || side == 0.0 && flip {
                v.swap(1, 2);
            }
            self.triangles.push(WorldTriangle { v });
        }
        if dropped > 0 {
            report.warn_at(
                &setting.site,
                format_args!("{dropped} triangles with vertices that are not finite, or beyond 1e100, dropped"),
            );
        }
        // No index refers to such vertices any more.
        for vertex in &mut self.vertices[base as usize..] {
            if !is_placeable(vertex.p) {
                vertex.p = DVec3::ZERO;
            }
        }
        let count = self.triangles.len() as u32 - first;
        if count > 0 {
            self.push_shape(setting, false, power_of_whole, first, count);
        }
        Ok(())
    }

    /// The tangent of a vertex; zero if it has none.
    pub fn tangent(&self, vertex: usize) -> DVec3 {
        self.tangents.get(vertex).copied().unwrap_or(DVec3::ZERO)
    }

    pub fn set_tangent(&mut self, vertex: usize, tangent: DVec3) {
        if tangent != DVec3::ZERO {
            let end = self.tangents.len().max(vertex + 1);
            self.tangents.resize(end, DVec3::ZERO);
            self.tangents[vertex] = tangent;
        }
    }

    /// Takes memory for the tangents of so many further vertices: here, and in the scene's table.
    fn room_for_tangents(&mut self, site: &Site, vertices: usize) -> Result<(), SceneError> {
        let before = self.vertices.len() - self.tangents.len();
        let each = size_of::<DVec3>() + size_of::<[f32; 3]>();
        let room = self.room.add(((before + vertices) * each) as u64);
        room.map_err(|e| site.error(e))
    }

    pub fn triangle_area(&self, triangle: &WorldTriangle) -> f64 {
        let [a, b, c] = triangle.v.map(|i| self.vertices[i as usize].p);
        (b - a).cross(c - a).length() / 2.0
    }
}

impl WorldSphere {
    /// Surface area of the ellipsoid, by the midpoint rule over the unit sphere.
    pub fn area(&self) -> f64 {
        const STEPS: usize = 64;
        let by = normal_matrix(&self.to_world);
        let mut sum = 0.0;
        for i in 0..STEPS {
            let z = (2 * i + 1) as f64 / STEPS as f64 - 1.0;
            let r = (1.0 - z * z).sqrt();
            for j in 0..STEPS {
                let phi = 2.0 * PI * (j as f64 + 0.5) / STEPS as f64;
                sum += (by * DVec3::new(r * phi.cos(), r * phi.sin(), z)).length();
            }
        }
        sum * 4.0 * PI / (STEPS * STEPS) as f64
    }
}
