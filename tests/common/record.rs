//! Whole paths, and what a path is worth: an independent account of bidirectional transport in `f64`.
//!
//! [`Recorder::record`] makes the path that given primary samples stand for, vertex by vertex, from the renderer's sampling routines (each
//! tested by itself) but without its walk, running sums, or connections. [`Recorder::reference`] then computes, from the vertices alone:
//!
//! * the measurement contribution `F` with respect to the product of areas of the surface vertices: importance (the camera's density),
//!   BSDFs with cosines against *shading* normals towards the light, and `|cos ng| / d^2` per segment;
//! * the density `p_s` of the path under every strategy `s`, with respect to the same measure. A direction sampled with density `p`
//!   (solid angle) makes a density `p |cos ng| / d^2` at the vertex it arrives at, cosines against *geometric* normals. The vertex on
//!   an environment is its direction (solid angle); a light from infinity arrives with density `|cos ng| / (pi R^2)`. A vertex on a
//!   delta BSDF has the same delta distribution in every strategy, up to a factor that depends on the direction of the walk (below); a
//!   strategy that would have to connect it has density 0.
//!
//! Refraction of solid angles at a delta vertex: `p(back) / p(forth) = (n_o^2 cos_o) / (n_t^2 cos_t)`, since
//! `n_o^2 cos_o dw_o = n_t^2 cos_t dw_t`. The balance heuristic gives the path the value `F / sum p_s`, whatever strategy sampled it.

use super::bsdf::{self, Kernels};
use super::stats::Random;
use super::vector::*;
use phalanx::geometry::shading_frame;
use phalanx::plan::DepthPlan;
use phalanx::scene::{LightKind, NONE, Projection, Scene, SpotFalloff};
use phalanx::simd::{Row, Vec3};
use phalanx::surface::{Kind, Mode};
use phalanx::transport::World;
use phalanx::transport::samples::Samples;
use std::f64::consts::{PI, TAU};

/// A vertex on a surface.
#[derive(Clone, Debug)]
pub struct Vertex {
    pub p: V,
    pub error: f64,
    pub ng: V,
    pub ns: V,
    pub tangent: V,
    pub kind: Kind,
    pub row: [f32; 8],
    pub light: u32,
}

/// Where a path meets its light.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Area {
        light: u32,
        p: V,
    },
    Point {
        light: u32,
    },
    Distant {
        light: u32,
    },
    /// Unit direction from the scene to the sky.
    Sky {
        light: u32,
        direction: V,
    },
}

/// A path from the camera to a light.
#[derive(Clone, Debug)]
pub struct Path {
    pub s: u32,
    pub camera: V,
    /// `x1 ..= xk`.
    pub surface: Vec<Vertex>,
    pub end: End,
    /// Nothing stands between the connected vertices.
    pub visible: bool,
}

/// What [`Recorder::reference`] finds.
#[derive(Clone, Debug)]
pub struct Reference {
    /// `F`.
    pub contribution: V,
    /// `p_s` for `s = 0 ..= k + 1`.
    pub density: Vec<f64>,
}

impl Reference {
    /// What the renderer should report: `F / sum p_s`, mean of the channels.
    pub fn value(&self) -> f64 {
        let f = self.contribution.iter().sum::<f64>() / 3.0;
        if f > 0.0 {
            f / self.density.iter().sum::<f64>()
        } else {
            0.0
        }
    }
}

pub struct Recorder<'a> {
    pub scene: &'a Scene,
    pub world: &'a World<'a>,
    /// Probability of choosing each light.
    pub choice: Vec<f64>,
}

type Flight = (V, V);

impl<'a> Recorder<'a> {
    pub fn new(scene: &'a Scene, world: &'a World<'a>) -> Self {
        Self {
            scene,
            world,
            choice: choice_probabilities(world),
        }
    }

    fn trace(&self, (o, d): Flight) -> Option<Vertex> {
        let (o, d) = (narrow(o), narrow(d));
        let ray = [Row([
            o[0],
            o[1],
            o[2],
            f32::INFINITY,
            d[0],
            d[1],
            d[2],
            0.0,
        ])];
        let mut hit = [Row::default()];
        self.world.tracer.closest::<f32>(&ray, &[0], &mut hit);
        let [t, b1, b2, prim, ..] = hit[0].0;
        let prim = prim.to_bits();
        if prim == NONE {
            return None;
        }
        let wanted = phalanx::geometry::Wanted {
            uv: true,
            tangent: true,
            normals: true,
            spheres: !self.scene.spheres.is_empty(),
        };
        let point = (self.world.geometry).surface_point::<f32>(
            &[prim],
            Vec3::splat(o),
            Vec3::splat(d),
            [t, b1, b2],
            wanted,
        );
        let (shape, light) = self.world.geometry.shape_of(prim);
        let material = shape.material as usize;
        Some(Vertex {
            p: wide(point.p.lane(0)),
            error: point.error.into(),
            ng: wide(point.ng.lane(0)),
            ns: wide(point.ns.lane(0)),
            // Without anisotropy the renderer has no tangents.
            tangent: if self.world.materials.anisotropic {
                wide(point.tangent.lane(0))
            } else {
                [0.0; 3]
            },
            kind: self.world.materials.entries[material].kind,
            row: self.world.materials.evaluate(material, point.uv).0,
            light,
        })
    }

    /// Samples a direction at a vertex reached along `wo` (unit, away from the surface).
    fn scatter(&self, v: &Vertex, wo: V, u: [f32; 3], mode: Mode) -> Option<Flight> {
        let frame = shading_frame::<f32>(Vec3::splat(narrow(v.ns)), Vec3::splat(narrow(v.tangent)));
        let local = frame.to_local(Vec3::splat(narrow(wo))).lane(0);
        let u = if v.kind.has_lobes() {
            u
        } else {
            [u[0], u[1], 0.0]
        };
        let (wi, weight, ..) = Kernels::sample::<f32>(v.kind, &v.row, &[local], &[u], mode)[0];
        if weight.iter().all(|w| *w <= 0.0) {
            return None;
        }
        let wi = frame.to_world(Vec3::splat(wi)).normalize().lane(0);
        let wi = wide(wi);
        sides_agree(wo, wi, v).then(|| (offset(v, wi), wi))
    }

    fn blocked(&self, a: V, b: V) -> bool {
        let (o, d) = (narrow(a), narrow(sub(b, a)));
        let ray = [Row([o[0], o[1], o[2], 1.0, d[0], d[1], d[2], 0.0])];
        let mut blocked = [0];
        self.world.tracer.occluded::<f32>(&ray, &[0], &mut blocked);
        blocked[0] != 0
    }

    /// The path that column `i` of `samples` stands for, if it has all its vertices.
    pub fn record(&self, plan: &DepthPlan, samples: &Samples, i: usize) -> Option<Path> {
        let at = &plan.layout;
        let u = |d: usize| samples.row(d)[i];
        let count = plan.strategies.len();
        let s = if count > 1 {
            plan.strategies[((u(at.strategy) * count as f32) as usize).min(count - 1)]
        } else {
            *plan.strategies.first()?
        };
        let t = plan.depth + 2 - s;
        let lens_at = |d: usize| {
            if self.world.plan.lens {
                (u(d), u(d + 1))
            } else {
                (0.0, 0.0)
            }
        };
        let bounce = |base: usize, j: usize| {
            let d = base + j * at.per_bounce;
            let lobe = if at.per_bounce > 2 { u(d + 2) } else { 0.0 };
            [u(d), u(d + 1), lobe]
        };
        let pick = |d: usize| {
            if self.world.plan.light_choice {
                self.world.lights.choose::<f32>(u(d), 1)[0]
            } else {
                0
            }
        };
        let geometry = &self.world.geometry;

        let mut surface: Vec<Vertex> = Vec::new();
        let mut camera = [0.0; 3];
        if t >= 2 {
            let (x, y) = self
                .world
                .camera
                .region
                .place(u(at.raster), u(at.raster + 1));
            let ray = self.world.camera.ray::<f32>(x, y, lens_at(at.lens));
            camera = wide(ray.origin.lane(0));
            let mut flight = (camera, wide(ray.direction.lane(0)));
            for j in 0..t - 1 {
                let last = j == t - 2;
                let Some(v) = self.trace(flight) else {
                    if !(last && s == 0) {
                        return None;
                    }
                    assert!(
                        self.world.lights.infinite.len() <= 1,
                        "one sky a test scene"
                    );
                    let light = *self.world.lights.infinite.first()?;
                    let direction = flight.1;
                    return Some(Path {
                        s,
                        camera,
                        surface,
                        end: End::Sky { light, direction },
                        visible: true,
                    });
                };
                if last && s == 0 {
                    if v.light == NONE {
                        return None;
                    }
                    let end = End::Area {
                        light: v.light,
                        p: v.p,
                    };
                    return Some(Path {
                        s,
                        camera,
                        surface,
                        end,
                        visible: true,
                    });
                }
                if !last {
                    let wo = scale(flight.1, -1.0);
                    let u = bounce(at.camera_bounce, j as usize);
                    flight = self.scatter(&v, wo, u, Mode::Radiance)?;
                }
                surface.push(v);
            }
        }
        if s == 1 {
            let tip = surface.last()?.clone();
            if tip.kind.is_delta() {
                return None;
            }
            let light = pick(at.connection_choice);
            let p = Vec3::splat(narrow(tip.p));
            let w = [u(at.connection), u(at.connection + 1)];
            let seen = (self.world.lights).sample_direct::<f32>(geometry, &[light], p, w);
            if !seen.valid {
                return None;
            }
            let (to_light, target) = (wide(seen.to_light.lane(0)), wide(seen.target.lane(0)));
            let end = match self.scene.lights[light as usize].kind {
                LightKind::Triangle { .. } | LightKind::Sphere { .. } => End::Area {
                    light,
                    p: self.on_light(light, target),
                },
                LightKind::Point { .. } | LightKind::Spot { .. } => End::Point { light },
                LightKind::Distant { .. } => End::Distant { light },
                LightKind::InfiniteConstant { .. } | LightKind::InfiniteImage { .. } => End::Sky {
                    light,
                    direction: to_light,
                },
            };
            let visible = !self.blocked(offset(&tip, to_light), target);
            return Some(Path {
                s,
                camera,
                surface,
                end,
                visible,
            });
        }
        // A light subpath of s - 1 surface vertices.
        let light = pick(at.light_choice);
        let w = std::array::from_fn(|c| u(at.emission + c));
        let ray = (self.world.lights).sample_emission::<f32>(geometry, &[light], w);
        if !ray.valid {
            return None;
        }
        let mut flight = (wide(ray.origin.lane(0)), wide(ray.direction.lane(0)));
        let end = match self.scene.lights[light as usize].kind {
            LightKind::Triangle { .. } | LightKind::Sphere { .. } => {
                End::Area { light, p: flight.0 }
            }
            LightKind::Point { .. } | LightKind::Spot { .. } => End::Point { light },
            LightKind::Distant { .. } => End::Distant { light },
            _ => End::Sky {
                light,
                direction: scale(flight.1, -1.0),
            },
        };
        let mut from_light = Vec::new();
        for j in 0..s - 1 {
            let v = self.trace(flight)?;
            if j < s - 2 {
                let wo = scale(flight.1, -1.0);
                let u = bounce(at.light_bounce, j as usize);
                flight = self.scatter(&v, wo, u, Mode::Importance)?;
            }
            from_light.push(v);
        }
        let tip = from_light.last()?.clone();
        if tip.kind.is_delta() {
            return None;
        }
        let visible;
        if t == 1 {
            let link = (self.world.camera)
                .connect::<f32>(Vec3::splat(narrow(tip.p)), lens_at(at.connection));
            if !link.valid {
                return None;
            }
            camera = wide(link.origin.lane(0));
            visible = !self.blocked(offset(&tip, wide(link.to_camera.lane(0))), camera);
        } else {
            let other = surface.last()?;
            if other.kind.is_delta() {
                return None;
            }
            let w = unit(sub(tip.p, other.p));
            visible = !self.blocked(offset(other, w), offset(&tip, scale(w, -1.0)));
        }
        surface.extend(from_light.into_iter().rev());
        Some(Path {
            s,
            camera,
            surface,
            end,
            visible,
        })
    }

    /// The point of an area light that `p` was moved off, to start or end a ray.
    fn on_light(&self, light: u32, p: V) -> V {
        match self.scene.lights[light as usize].kind {
            LightKind::Triangle { triangle, .. } => {
                let [a, b, c] = (self.scene.triangles[triangle as usize].v)
                    .map(|i| wide(self.scene.vertices[i as usize].p));
                let n = unit(cross(sub(b, a), sub(c, a)));
                sub(p, scale(n, dot(sub(p, a), n)))
            }
            LightKind::Sphere { sphere, .. } => {
                let sphere = &self.scene.spheres[sphere as usize];
                let apply = |m: &[[f32; 4]; 3], v: V| -> V {
                    m.map(|r| {
                        let r = r.map(f64::from);
                        r[0] * v[0] + r[1] * v[1] + r[2] * v[2] + r[3]
                    })
                };
                apply(&sphere.to_world, unit(apply(&sphere.to_unit, p)))
            }
            _ => unreachable!("an area light"),
        }
    }

    /// Contribution and densities of a path.
    pub fn reference(&self, path: &Path, strategies: &[u32]) -> Reference {
        let k = path.surface.len();
        let x = &path.surface;
        // Directions along the path, from the camera; the last one leads to the light.
        let mut towards: Vec<V> = Vec::with_capacity(k + 1);
        let mut inv_d2: Vec<f64> = Vec::with_capacity(k + 1);
        let end = self.end(&path.end);
        let mut from = path.camera;
        for to in x.iter().map(|v| Some(v.p)).chain([end.position]) {
            match to {
                Some(p) => {
                    let v = sub(p, from);
                    towards.push(unit(v));
                    inv_d2.push(1.0 / dot(v, v));
                    from = p;
                }
                None => {
                    towards.push(end.direction);
                    inv_d2.push(1.0);
                }
            }
        }
        let parallel = self.scene.camera.projection == Projection::Orthographic;
        if parallel {
            towards[0] = self.axis();
            inv_d2[0] = 1.0;
        }
        // At every surface vertex: cosines, and the BSDF from the camera's side (forth) and from the light's (back).
        let cos_in: Vec<f64> = (0..k).map(|j| dot(towards[j], x[j].ng).abs()).collect();
        let cos_out: Vec<f64> = (0..k).map(|j| dot(towards[j + 1], x[j].ng).abs()).collect();
        let joints: Vec<Joint> = (0..k)
            .map(|j| joint(&x[j], scale(towards[j], -1.0), towards[j + 1]))
            .collect();
        let end_cos = |w: V| end.normal.map_or(1.0, |n| dot(w, n).abs());
        let (emitted, emission_pdf) = self.emission(&path.end, &end, scale(towards[k], -1.0));

        // Where k = 0 the camera sees the light itself.
        let arrive = |j: usize| {
            if j < k {
                cos_in[j] * inv_d2[j]
            } else {
                end_cos(towards[k]) * inv_d2[k]
            }
        };
        let mut contribution = scale(emitted, self.camera_pdf(towards[0]) * arrive(0));
        for (j, joint) in joints.iter().enumerate() {
            for (value, f_cos) in contribution.iter_mut().zip(joint.f_cos) {
                *value *= f_cos * arrive(j + 1);
            }
        }
        let density = (0..=k as u32 + 1)
            .map(|s| {
                if !strategies.contains(&s) {
                    return 0.0;
                }
                let t = k + 2 - s as usize;
                let delta = |j: usize| x[j].kind.is_delta();
                // Vertices x_{t-1} and x_t are joined; x_0 and the light can always be.
                if s >= 1 && (t >= 2 && delta(t - 2) || s >= 2 && delta(t - 1)) {
                    return 0.0;
                }
                if s == 0 && end.is_delta {
                    return 0.0;
                }
                let mut p = 1.0;
                for j in 0..t - 1 {
                    let direction = if j == 0 {
                        self.camera_pdf(towards[0])
                    } else {
                        joints[j - 1].forth
                    };
                    p *= direction * arrive(j);
                }
                if s >= 1 {
                    p *= end.pdf;
                }
                if s >= 2 {
                    // inv_d2 is 1 where the light is at infinity, and the emission density that of the disk.
                    p *= emission_pdf * cos_out[k - 1] * inv_d2[k];
                    for j in (t - 1..k - 1).rev() {
                        p *= joints[j + 1].back * cos_out[j] * inv_d2[j + 1];
                    }
                }
                p
            })
            .collect();
        Reference {
            contribution,
            density,
        }
    }

    /// How far the reference moves if vertices move by what `f32` positions and ray offsets may: the tolerance of a comparison.
    pub fn sensitivity(&self, path: &Path, strategies: &[u32], random: &mut Random) -> f64 {
        let value = self.reference(path, strategies).value();
        let mut worst = 0.0f64;
        for _ in 0..3 {
            // Both ways, so that one of them crosses any edge nearby.
            let seed = random.next();
            for sign in [-1.0, 1.0] {
                let mut random = Random(seed);
                let mut moved = path.clone();
                let mut shift = |p: &mut V, by: f64| {
                    *p = add(*p, scale(random.direction(), sign * by));
                };
                for v in &mut moved.surface {
                    shift(&mut v.p, POSITION_ERROR);
                    shift(&mut v.ns, NORMAL_ERROR);
                    shift(&mut v.ng, NORMAL_ERROR);
                }
                if let End::Area { p, .. } = &mut moved.end {
                    shift(p, POSITION_ERROR);
                }
                worst = worst.max((self.reference(&moved, strategies).value() - value).abs());
            }
        }
        worst
    }

    fn axis(&self) -> V {
        let m = &self.scene.camera.to_world;
        [m[0][2], m[1][2], m[2][2]].map(f64::from)
    }

    /// Density of camera rays: uniform over the sampled region of the screen, on the plane `z = 1` of a perspective camera.
    fn camera_pdf(&self, direction: V) -> f64 {
        let film = &self.scene.film;
        let [x0, x1, y0, y1] = self.scene.camera.screen.map(f64::from);
        let region = self.world.camera.region;
        let pixel = (x1 - x0) / f64::from(film.width) * (y1 - y0) / f64::from(film.height);
        let area = pixel.abs() * f64::from(region.width) * f64::from(region.height);
        if self.scene.camera.projection == Projection::Orthographic {
            1.0 / area
        } else {
            1.0 / (area * dot(direction, self.axis()).powi(3))
        }
    }

    fn end(&self, end: &End) -> EndPoint {
        match *end {
            End::Area { light, p } => {
                let (pdf, normal) = match self.scene.lights[light as usize].kind {
                    LightKind::Triangle { triangle, .. } => {
                        let [a, b, c] = self.scene.triangles[triangle as usize]
                            .v
                            .map(|i| wide(self.scene.vertices[i as usize].p));
                        let n = cross(sub(b, a), sub(c, a));
                        (2.0 / length(n), unit(n))
                    }
                    LightKind::Sphere { sphere, .. } => {
                        let sphere = &self.scene.spheres[sphere as usize];
                        let m = sphere.to_unit.map(|r| r.map(f64::from));
                        let w: V = std::array::from_fn(|r| {
                            m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3]
                        });
                        // The gradient of |M^-1 p|; areas grow by |M^-T w| / |det M^-1|.
                        let w = unit(w);
                        let n: V = std::array::from_fn(|c| {
                            m[0][c] * w[0] + m[1][c] * w[1] + m[2][c] * w[2]
                        });
                        let column = |c: usize| [m[0][c], m[1][c], m[2][c]];
                        let det = dot(column(0), cross(column(1), column(2))).abs();
                        let normal = scale(unit(n), sphere.facing.into());
                        (det / length(n) / (2.0 * TAU), normal)
                    }
                    _ => unreachable!("an area light"),
                };
                EndPoint {
                    position: Some(p),
                    normal: Some(normal),
                    direction: [0.0; 3],
                    pdf: self.choice[light as usize] * pdf,
                    is_delta: false,
                }
            }
            End::Point { light } => {
                let p = match self.scene.lights[light as usize].kind {
                    LightKind::Point { p, .. } | LightKind::Spot { p, .. } => p,
                    _ => unreachable!("a point-like light"),
                };
                EndPoint {
                    position: Some(wide(p.to_array())),
                    normal: None,
                    direction: [0.0; 3],
                    pdf: self.choice[light as usize],
                    is_delta: true,
                }
            }
            End::Distant { light } => {
                let LightKind::Distant { direction, .. } = self.scene.lights[light as usize].kind
                else {
                    unreachable!("a distant light")
                };
                EndPoint {
                    position: None,
                    normal: None,
                    direction: scale(wide(direction.to_array()), -1.0),
                    pdf: self.choice[light as usize],
                    is_delta: true,
                }
            }
            End::Sky { light, direction } => {
                let seen =
                    (self.world.lights).escaped::<f32>(light, Vec3::splat(narrow(direction)));
                EndPoint {
                    position: None,
                    normal: None,
                    direction,
                    pdf: seen.direct_pdf.into(),
                    is_delta: false,
                }
            }
        }
    }

    /// Radiance (intensity, irradiance) that leaves a light along `w`, and the density of emitting it (for lights at infinity, of the
    /// place on the disk).
    fn emission(&self, end: &End, point: &EndPoint, w: V) -> (V, f64) {
        let disk = 1.0 / (PI * f64::from(self.world.geometry.radius).powi(2));
        match *end {
            End::Area { light, .. } => {
                let (l, two_sided) = match self.scene.lights[light as usize].kind {
                    LightKind::Triangle { l, two_sided, .. }
                    | LightKind::Sphere { l, two_sided, .. } => (l, two_sided),
                    _ => unreachable!("an area light"),
                };
                let cos = dot(w, point.normal.expect("a surface"));
                let lit = cos > 0.0 || two_sided;
                let sides = if two_sided { 2.0 } else { 1.0 };
                let l = if lit { wide(l) } else { [0.0; 3] };
                (l, cos.abs() / (sides * PI))
            }
            End::Point { light } => match self.scene.lights[light as usize].kind {
                LightKind::Point { i, .. } => (wide(i), 0.5 / TAU),
                LightKind::Spot {
                    axis,
                    i,
                    cos_total,
                    cos_falloff,
                    falloff,
                    ..
                } => {
                    let (total, full) = (f64::from(cos_total), f64::from(cos_falloff));
                    let cos = dot(w, wide(axis.to_array()));
                    let x = ((cos - total) / (full - total)).clamp(0.0, 1.0);
                    let factor = match falloff {
                        SpotFalloff::V3 => x.powi(4),
                        SpotFalloff::V4 => x * x * (3.0 - 2.0 * x),
                    };
                    (scale(wide(i), factor), 1.0 / (TAU * (1.0 - total)))
                }
                _ => unreachable!("a point-like light"),
            },
            End::Distant { light } => match self.scene.lights[light as usize].kind {
                LightKind::Distant { l, .. } => (wide(l), disk),
                _ => unreachable!("a distant light"),
            },
            End::Sky { light, direction } => {
                let seen =
                    (self.world.lights).escaped::<f32>(light, Vec3::splat(narrow(direction)));
                (wide(seen.radiance.lane(0)), disk)
            }
        }
    }
}

/// Rays start off surfaces by some ten half-ulps of the magnitudes in a position; scenes have a radius of at most 1.
const POSITION_ERROR: f64 = 1e-6;
/// Positions on the surface are good to an ulp, and the normals of spheres turn by that over the radius, here at least a tenth.
const NORMAL_ERROR: f64 = 1e-6;

struct EndPoint {
    position: Option<V>,
    normal: Option<V>,
    /// To a light at infinity.
    direction: V,
    /// Density of choosing it: area, discrete, or solid angle.
    pdf: f64,
    is_delta: bool,
}

/// A BSDF on a path: `wo` to the camera, `wi` to the light.
struct Joint {
    /// `f |cos ns|` towards the light, radiance mode; the weight of a delta lobe.
    f_cos: V,
    forth: f64,
    back: f64,
}

fn joint(v: &Vertex, wo: V, wi: V) -> Joint {
    let row = v.row.map(f64::from);
    let (co, ci) = (dot(wo, v.ns), dot(wi, v.ns));
    let mut out = if v.kind.is_delta() {
        let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
        match v.kind {
            Kind::Mirror => Joint {
                f_cos: rgb(0),
                forth: 1.0,
                back: 1.0,
            },
            Kind::SmoothConductor => Joint {
                f_cos: std::array::from_fn(|c| bsdf::conductor(co.abs(), row[c], row[3 + c])),
                forth: 1.0,
                back: 1.0,
            },
            // The probability of the lobe is in every density and in the value: left out.
            _ if co * ci > 0.0 => Joint {
                f_cos: rgb(0),
                forth: 1.0,
                back: 1.0,
            },
            _ => {
                let eta = if co > 0.0 { row[6] } else { 1.0 / row[6] };
                Joint {
                    f_cos: scale(rgb(3), 1.0 / (eta * eta)),
                    forth: 1.0,
                    back: (co / ci).abs() / (eta * eta),
                }
            }
        }
    } else {
        let (s, t) = axes(v);
        let local = |w: V| [dot(w, s), dot(w, t), dot(w, v.ns)];
        let value = bsdf::eval(v.kind, &row, local(wo), local(wi));
        Joint {
            f_cos: scale(value.f, ci.abs()),
            forth: value.pdf,
            back: value.pdf_reverse,
        }
    };
    if !sides_agree(wo, wi, v) {
        out.f_cos = [0.0; 3];
    }
    out
}

/// Axes of the shading frame; where there is no tangent any will do.
fn axes(v: &Vertex) -> (V, V) {
    let s = sub(v.tangent, scale(v.ns, dot(v.ns, v.tangent)));
    let s = if dot(v.tangent, v.tangent) > 0.0 {
        unit(s)
    } else {
        let least = if v.ns[0].abs() < 0.7 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        unit(cross(v.ns, least))
    };
    (s, cross(v.ns, s))
}

fn sides_agree(wo: V, wi: V, v: &Vertex) -> bool {
    let agree = |w: V| dot(w, v.ng) * dot(w, v.ns) > 0.0;
    agree(wo) && agree(wi)
}

/// The renderer's own way off a surface, so that rays are the same to the bit.
fn offset(v: &Vertex, w: V) -> V {
    let [p, ng, w] = [v.p, v.ng, w].map(|v| Vec3::<f32>::splat(narrow(v)));
    wide(phalanx::trace::offset::leave(p, v.error as f32, ng, w).lane(0))
}

/// The widths of the lights' intervals, exactly: choices change only at multiples of 2^-24.
fn choice_probabilities(world: &World) -> Vec<f64> {
    let n = world.lights.len();
    let grid = 1u32 << 24;
    let at = |i: u32| world.lights.choose::<f32>(i as f32 / grid as f32, 1)[0] as usize;
    // First grid point whose light is beyond `light`.
    let end = |light: usize| {
        let (mut low, mut high) = (0, grid);
        while low < high {
            let mid = low + (high - low) / 2;
            if at(mid) > light {
                high = mid;
            } else {
                low = mid + 1;
            }
        }
        low
    };
    let mut start = 0;
    (0..n)
        .map(|light| {
            let stop = end(light);
            let p = f64::from(stop - start) / f64::from(grid);
            start = stop;
            p
        })
        .collect()
}
