//! A path as the renderer walks it, in `f32`, every vertex kept.
//!
//! Each step calls the kernel that the renderer's waves call, at one lane and in the same order, so that every figure is the
//! renderer's to the last bit: [`World::evaluate_multiplexed`](crate::transport::World::evaluate_multiplexed) gives the same
//! contribution, without the vertices. `join` is the last step.

use super::kernel::Surface;
use super::path::{End, Path, Vertex};
use super::vector::{V, scale, wide};
use super::{Recorder, spectral};
use crate::plan::DepthPlan;
use crate::scene::{NONE, Sides};
use crate::simd::{Row, Vec3};
use crate::surface::texture::Place;
use crate::trace::offset;
use crate::transport::cutout::Through;
use crate::transport::mis::{self, Partial};
use crate::transport::paths::Side;
use crate::transport::sides::{Normals, Sampled as Sided};
use crate::transport::wavelength::Wavelength;
use std::fmt;

/// A subpath's vertex and how the subpath came there and went on.
#[derive(Clone, Debug)]
pub struct Step {
    pub vertex: Vertex,
    /// Unit, to the previous vertex.
    pub wo: [f32; 3],
    /// Throughput on arrival.
    pub beta: [f32; 3],
    /// Running sums of multiple importance sampling on arrival.
    pub partial: Partial<f32>,
    /// `None` at a tip.
    pub sampled: Option<Sampled>,
}

/// A direction that was sampled from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct Sampled {
    /// Unit.
    pub wi: [f32; 3],
    /// What the throughput was multiplied by.
    pub weight: [f32; 3],
    /// Densities over solid angle of `wi` given `wo`, and of the reverse.
    pub pdf: f32,
    pub pdf_reverse: f32,
}

/// A subpath: where it starts, and its vertices on surfaces.
#[derive(Clone, Debug)]
pub struct Subpath {
    pub origin: [f32; 3],
    /// Unit.
    pub direction: [f32; 3],
    pub beta: [f32; 3],
    /// Camera: density of the ray over solid angle, or over area of the film plane if it is orthographic. Light: 0.
    pub pdf: f32,
    /// Light: index into the scene's lights; camera: [`NONE`].
    pub light: u32,
    pub steps: Vec<Step>,
}

/// What became of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It reaches from the camera to a light; only a visibility ray can still take its light away.
    Whole,
    /// The plan has no strategy for this depth.
    NoStrategy,
    /// A ray of the subpath hit nothing.
    Missed(Side),
    /// A BSDF or the sides of a surface let nothing through.
    Absorbed(Side),
    /// `s = 0`, and the last vertex is not on a light.
    Dark,
    /// The tip is of a delta BSDF, which cannot be joined.
    Delta(Side),
    /// The light sends nothing that way.
    Unlit,
    /// `t = 1`, and the camera does not see the tip.
    OutOfView,
    /// Both tips are in one place.
    Coincident,
}

impl fmt::Display for Fate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |side: &Side| match side {
            Side::Camera => "camera",
            Side::Light => "light",
        };
        match self {
            Fate::Whole => write!(f, "reaches from the camera to a light"),
            Fate::NoStrategy => write!(f, "no strategy can carry light at this depth"),
            Fate::Missed(side) => write!(f, "the {} subpath leaves the scene", name(side)),
            Fate::Absorbed(side) => {
                write!(
                    f,
                    "the {} subpath is absorbed at its last vertex",
                    name(side)
                )
            }
            Fate::Dark => write!(f, "the camera subpath ends on a surface that is no light"),
            Fate::Delta(side) => write!(
                f,
                "the {} subpath ends on a delta BSDF, which cannot be joined",
                name(side)
            ),
            Fate::Unlit => write!(f, "the light sends nothing that way"),
            Fate::OutOfView => write!(f, "the light subpath's tip is out of the camera's view"),
            Fate::Coincident => write!(f, "both subpaths end in one place"),
        }
    }
}

/// How a path meets a light.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    pub end: End,
    /// MIS weight.
    pub weight: f32,
    /// Contribution, choice of strategy included, before visibility.
    pub rgb: [f32; 3],
}

/// The wavelength of a path.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// As the renderer has it.
    pub single: Wavelength,
    /// The colour, in `f64`.
    pub colour_f64: V,
}

/// A path from its primary samples.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Strategy: light vertices `s`, camera vertices `t`.
    pub s: u32,
    pub t: u32,
    /// Strategies that the depth chooses among.
    pub choices: usize,
    /// If the scene has dispersion.
    pub wavelength: Option<Chosen>,
    /// One over the probability of the strategy; 0 if there is none.
    pub factor: f32,
    /// `None` if `t = 1`.
    pub camera: Option<Subpath>,
    /// `None` if `s < 2`.
    pub light: Option<Subpath>,
    pub fate: Fate,
    /// One, if the path is whole; one for each environment if a camera subpath has left a scene with several.
    pub meetings: Vec<Meeting>,
    /// Where the path meets the lens if `t = 1`.
    pub lens: [f32; 3],
    pub raster: [f32; 2],
    /// Of the joined vertices; `None` if no ray asked: nothing is joined, or the contribution is zero anyway.
    pub visible: Option<bool>,
    /// As in [`Outcome`](crate::transport::Outcome).
    pub rgb: [f32; 3],
    pub rejected: bool,
}

impl Walk {
    /// The path or, in a scene with several environments, paths, to the light they meet; visible or not.
    pub fn paths(&self) -> impl Iterator<Item = Path> + '_ {
        let camera = self.camera.as_ref();
        let seen = camera.map_or(&[][..], |c| &c.steps[..]);
        // The vertex on an area light met by chance is the end, not a scattering event.
        let on_light = |m: &Meeting| self.s == 0 && matches!(m.end, End::Area { .. });
        let lit = self.light.as_ref().map_or(&[][..], |l| &l.steps[..]);
        self.meetings.iter().map(move |m| {
            let seen = &seen[..seen.len() - usize::from(on_light(m) && !seen.is_empty())];
            let steps = seen.iter().chain(lit.iter().rev());
            let surface: Vec<Vertex> = steps.map(|s| s.vertex.clone()).collect();
            Path {
                colour: self.colour_of(&surface),
                s: self.s,
                camera: wide(camera.map_or(self.lens, |c| c.origin)),
                surface,
                end: m.end,
            }
        })
    }

    /// The colour of light scattered at these vertices, in `f64`.
    pub(super) fn colour_of(&self, surface: &[Vertex]) -> V {
        match &self.wavelength {
            Some(w) if surface.iter().any(|v| v.dispersive) => w.colour_f64,
            _ => [1.0; 3],
        }
    }

    /// The path, if there is one and nothing blocks it. Paths of which nobody asked whether they are blocked count as visible: they carry
    /// nothing, or have met their light.
    pub fn path(&self) -> Option<Path> {
        self.paths().next().filter(|_| self.visible != Some(false))
    }
}

impl Walk {
    /// A contribution as the renderer colours it; `at_light` says that the camera's last vertex is on the light, and does not scatter.
    pub(super) fn coloured(&self, rgb: Vec3<f32>, at_light: bool) -> Vec3<f32> {
        let Some(w) = &self.wavelength else {
            return rgb;
        };
        let steps = |side: &Option<Subpath>, less: usize| {
            side.as_ref().is_some_and(|s| {
                let count = s.steps.len().saturating_sub(less);
                s.steps[..count].iter().any(|s| s.vertex.dispersive)
            })
        };
        if steps(&self.camera, usize::from(at_light)) || steps(&self.light, 0) {
            rgb.mul_elem(Vec3::splat(w.single.colour))
        } else {
            rgb
        }
    }
}

/// A ray on its way.
pub(super) struct Flight {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub beta: [f32; 3],
    pub partial: Partial<f32>,
    /// Distances do not enter the density of the next vertex.
    pub distant: bool,
}

/// The primary samples of a subpath's vertices.
struct Numbers<'a> {
    bounce: &'a dyn Fn(usize) -> [f32; 3],
    /// The one that chooses a component, of a vertex that scatters in a scene with mixtures.
    label: &'a dyn Fn(usize) -> Option<f32>,
}

/// Where a subpath has ended.
pub(super) enum Ended {
    Tip,
    Absorbed,
    Missed(Flight),
}

impl Recorder<'_> {
    /// The path of the given depth that `samples`, laid out as `plan.layout`, stand for; samples that are missing are 0.
    pub fn walk(&self, plan: &DepthPlan, samples: &[f32]) -> Walk {
        let u = |d: usize| samples.get(d).copied().unwrap_or(0.0);
        let count = plan.strategies.len();
        let s = match plan.strategies[..] {
            [] => 0,
            [only] => only,
            _ => plan.strategies[plan.choice.index(u(plan.layout.strategy))],
        };
        let t = plan.depth + 2 - s;
        let mut walk = Walk {
            s,
            t,
            choices: count,
            wavelength: self.world.wavelengths.as_ref().map(|table| {
                let u = u(plan.layout.wavelength);
                Chosen {
                    single: table.at(u),
                    colour_f64: spectral::colour(u.into()),
                }
            }),
            factor: plan.choice.factor(s),
            camera: None,
            light: None,
            fate: Fate::NoStrategy,
            meetings: Vec::new(),
            lens: [0.0; 3],
            raster: [0.0; 2],
            visible: None,
            rgb: [0.0; 3],
            rejected: false,
        };
        if count > 0 {
            walk.fate = self.walk_subpaths(plan, &u, &mut walk);
            self.settle(&mut walk);
        }
        walk
    }

    fn walk_subpaths(&self, plan: &DepthPlan, u: &dyn Fn(usize) -> f32, walk: &mut Walk) -> Fate {
        let at = &plan.layout;
        let (s, t) = (walk.s, walk.t);
        let nm = walk.wavelength.map_or(0.0, |w| w.single.nm);
        let bounce = |base: usize, j: usize| {
            let d = base + j * at.per_bounce;
            [
                u(d),
                u(d + 1),
                if at.per_bounce > 2 { u(d + 2) } else { 0.0 },
            ]
        };
        // A vertex met by chance is one more than scatter, and of no component.
        let label = |base: usize, j: usize| {
            (self.world.plan.mixtures && j < plan.depth as usize).then(|| u(base + j))
        };
        if t >= 2 {
            let (raster, lens) = ([u(at.raster), u(at.raster + 1)], self.lens(u, at.lens));
            let alone = plan.strategies.len() == 1 || !self.world.plan.connectable;
            let flight = self.camera_flight(raster, lens, alone, walk);
            let rows = Numbers {
                bounce: &|j| bounce(at.camera_bounce, j),
                label: &|j| label(at.camera_label, j),
            };
            let length = t as usize - 1;
            let (steps, ended) = self.advance(flight, nm, length, Side::Camera, rows);
            let reached = steps.len();
            if let Some(camera) = &mut walk.camera {
                camera.steps = steps;
            }
            match ended {
                Ended::Absorbed => return Fate::Absorbed(Side::Camera),
                Ended::Missed(flight) if s == 0 && reached + 2 == t as usize => {
                    return self.escape(flight, walk);
                }
                Ended::Missed(_) => return Fate::Missed(Side::Camera),
                Ended::Tip if s == 0 => return self.meet(walk),
                Ended::Tip => {}
            }
            if self.delta_tip(&walk.camera) {
                return Fate::Delta(Side::Camera);
            }
        }
        if s == 1 {
            let light = self.pick(u, at.connection_choice);
            return self.join_light(light, [u(at.connection), u(at.connection + 1)], walk);
        }
        let light = self.pick(u, at.light_choice);
        let numbers = std::array::from_fn(|c| u(at.emission + c));
        let Some(flight) = self.light_flight(light, numbers, walk) else {
            return Fate::Unlit;
        };
        let rows = Numbers {
            bounce: &|j| bounce(at.light_bounce, j),
            label: &|j| label(at.light_label, j),
        };
        let length = s as usize - 1;
        let (steps, ended) = self.advance(flight, nm, length, Side::Light, rows);
        if let Some(light) = &mut walk.light {
            light.steps = steps;
        }
        match ended {
            Ended::Absorbed => return Fate::Absorbed(Side::Light),
            Ended::Missed(_) => return Fate::Missed(Side::Light),
            Ended::Tip => {}
        }
        if self.delta_tip(&walk.light) {
            return Fate::Delta(Side::Light);
        }
        if t == 1 {
            self.join_lens((u(at.connection), u(at.connection + 1)), walk)
        } else {
            self.join_tips(walk)
        }
    }

    /// Two primary samples if there is a lens.
    fn lens(&self, u: &dyn Fn(usize) -> f32, at: usize) -> (f32, f32) {
        if self.world.plan.lens {
            (u(at), u(at + 1))
        } else {
            (0.0, 0.0)
        }
    }

    /// The light that a primary sample chooses.
    fn pick(&self, u: &dyn Fn(usize) -> f32, at: usize) -> u32 {
        if self.world.plan.light_choice {
            self.world.lights.choose::<f32>(u(at), 1)[0]
        } else {
            0
        }
    }

    fn delta_tip(&self, subpath: &Option<Subpath>) -> bool {
        let tip = subpath.as_ref().and_then(|s| s.steps.last());
        tip.is_some_and(|t| t.vertex.kind.is_delta())
    }

    fn camera_flight(
        &self,
        [u, v]: [f32; 2],
        lens: (f32, f32),
        alone: bool,
        walk: &mut Walk,
    ) -> Flight {
        let camera = &self.world.camera;
        let (x, y) = camera.region.place(u, v);
        let ray = camera.ray::<f32, false>(x, y, lens);
        walk.raster = [x, y];
        let flight = Flight {
            origin: ray.origin.lane(0),
            direction: ray.direction.lane(0),
            beta: [1.0; 3],
            partial: Partial {
                d_vcm: if alone { 0.0 } else { 1.0 / ray.pdf },
                d_vc: 0.0,
            },
            distant: camera.is_parallel(),
        };
        walk.camera = Some(flight.subpath(ray.pdf, NONE));
        flight
    }

    fn light_flight(&self, light: u32, u: [f32; 4], walk: &mut Walk) -> Option<Flight> {
        let lights = &self.world.lights;
        let ray = lights.sample_emission::<f32>(&self.world.geometry, &[light], u);
        let flight = Flight {
            origin: ray.origin.lane(0),
            direction: ray.direction.lane(0),
            beta: ray.beta.lane(0),
            partial: Partial {
                d_vcm: ray.d_vcm,
                d_vc: ray.d_vc,
            },
            distant: ray.distant,
        };
        walk.light = Some(flight.subpath(0.0, light));
        let emits = self.world.emits(&[light], [u[0], u[1]]) & 1 != 0;
        (ray.valid && emits).then_some(flight)
    }

    /// Walks a subpath to its `length`-th surface vertex.
    fn advance(
        &self,
        mut flight: Flight,
        nm: f32,
        length: usize,
        side: Side,
        rows: Numbers,
    ) -> (Vec<Step>, Ended) {
        let mut steps = Vec::with_capacity(length);
        for j in 0..length {
            let Some(mut step) = self.arrive(&flight, nm, (rows.label)(j)) else {
                return (steps, Ended::Missed(flight));
            };
            if j + 1 == length {
                steps.push(step);
                break;
            }
            let next = self.scatter(&mut step, (rows.bounce)(j), side);
            steps.push(step);
            match next {
                Some(next) => flight = next,
                None => return (steps, Ended::Absorbed),
            }
        }
        (steps, Ended::Tip)
    }

    /// `label` is the primary sample that chooses a component if the vertex is of a mixture.
    fn arrive(&self, flight: &Flight, nm: f32, label: Option<f32>) -> Option<Step> {
        let world = self.world;
        let (o, d) = (flight.origin, flight.direction);
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
        world.closest::<f32>(&ray, &[0], &mut hit, &mut Through::default());
        let [t, b1, b2, primitive, ..] = hit[0].0;
        let primitive = primitive.to_bits();
        if primitive == NONE {
            return None;
        }
        let direction = Vec3::splat(d);
        let point = (world.geometry).surface_point::<f32>(
            &[primitive],
            Vec3::splat(o),
            direction,
            [t, b1, b2],
            world.wanted,
        );
        let (shape, light) = world.geometry.shape_of(primitive);
        let place = Place {
            uv: point.uv,
            p: point.p.lane(0),
            n: point.ng.lane(0),
        };
        let (materials, mut material) = (&world.materials, shape.material as usize);
        let mut share = [1.0; 3];
        if materials.entries[material].mixture {
            let chosen = materials.choose(material, &place, label.unwrap_or(0.0));
            material = chosen.material as usize;
            if label.is_some() {
                share = chosen.share;
            }
        }
        let entry = materials.entries[material];
        let row = if entry.per_hit {
            materials.evaluate(material, &place, nm)
        } else {
            materials.rows[material]
        };
        let (relief, ns, tangent) = if materials.is_bumped(material) {
            world.shading_at(material, primitive, [b1, b2], &place, point.ns.lane(0))
        } else {
            (None, point.ns.lane(0), point.tangent.lane(0))
        };
        let distance2 = if flight.distant { 1.0 } else { t * t };
        let cos = direction.dot(point.ng).abs();
        Some(Step {
            vertex: Vertex {
                p: wide(point.p.lane(0)),
                error: point.error.into(),
                ng: wide(point.ng.lane(0)),
                ns: wide(ns),
                surface: [b1, b2],
                tangent: wide(tangent),
                kind: entry.kind,
                row: row.0,
                share,
                dispersive: entry.dispersive,
                light,
                primitive,
                material: material as u32,
                relief,
            },
            wo: (-direction).lane(0),
            beta: flight.beta,
            partial: flight.partial.arrive(distance2, cos),
            sampled: None,
        })
    }

    fn scatter(&self, step: &mut Step, u: [f32; 3], side: Side) -> Option<Flight> {
        let tip = Tip::of(step);
        let v = &step.vertex;
        let surface = tip.surface(self.world.sides, &v.row);
        let Sided { wi, sample, valid } = surface.sample(v.kind, tip.wo, u, side.mode());
        let wi_ng = wi.dot(tip.ng);
        let mut weight = sample.weight.mul_elem(Vec3::splat(v.share));
        let mut beta = tip.beta.mul_elem(sample.weight);
        if side == Side::Light {
            let shading = wi.dot(tip.ns).abs();
            let cos = if shading == wi_ng.abs() {
                shading
            } else {
                sample.wi.z.abs()
            };
            let adjoint = mis::adjoint_cosine(wi_ng, tip.wo.dot(tip.ns), tip.wo.dot(tip.ng)) / cos;
            let adjoint = if cos > 0.0 { adjoint } else { 0.0 };
            beta = beta * adjoint;
            weight = weight * adjoint;
        }
        step.sampled = Some(Sampled {
            wi: wi.lane(0),
            weight: weight.lane(0),
            pdf: sample.pdf,
            pdf_reverse: sample.pdf_reverse,
        });
        let partial = (step.partial).scatter(
            wi_ng.abs(),
            sample.pdf,
            sample.pdf_reverse,
            v.kind.is_delta(),
        );
        let lit = beta.x.max(beta.y).max(beta.z) > 0.0;
        (lit && valid).then(|| Flight {
            origin: tip.offset(wi).lane(0),
            direction: wi.lane(0),
            beta: beta.lane(0),
            partial,
            distant: false,
        })
    }
}

impl Flight {
    fn subpath(&self, pdf: f32, light: u32) -> Subpath {
        Subpath {
            origin: self.origin,
            direction: self.direction,
            beta: self.beta,
            pdf,
            light,
            steps: Vec::new(),
        }
    }
}

/// A vertex as kernels take it.
pub(super) struct Tip {
    pub p: Vec3<f32>,
    pub error: f32,
    pub wo: Vec3<f32>,
    pub ng: Vec3<f32>,
    pub ns: Vec3<f32>,
    pub tangent: Vec3<f32>,
    pub beta: Vec3<f32>,
    pub partial: Partial<f32>,
}

impl Tip {
    /// As what it scatters sees it: the share of a mixture's component is in the throughput.
    pub fn of(step: &Step) -> Self {
        let tip = Self::lit(step);
        Self {
            beta: tip.beta.mul_elem(Vec3::splat(step.vertex.share)),
            ..tip
        }
    }

    /// As what it emits sees it.
    pub fn lit(step: &Step) -> Self {
        let v = &step.vertex;
        // Exact: these are numbers of `f32`.
        let back = |v: V| Vec3::splat(v.map(|x| x as f32));
        Self {
            p: back(v.p),
            error: v.error as f32,
            wo: Vec3::splat(step.wo),
            ng: back(v.ng),
            ns: back(v.ns),
            tangent: back(v.tangent),
            beta: Vec3::splat(step.beta),
            partial: step.partial,
        }
    }

    pub fn surface<'a>(&self, sides: Option<Sides>, row: &'a [f32; 8]) -> Surface<'a> {
        Surface {
            sides,
            row,
            normals: Normals {
                ng: self.ng,
                ns: self.ns,
                tangent: self.tangent,
            },
        }
    }

    /// Where a ray towards `w` starts.
    pub fn offset(&self, w: Vec3<f32>) -> Vec3<f32> {
        offset::leave(self.p, self.error, self.ng, w)
    }
}

/// Unit direction from the scene to an environment that light came from along `direction`.
pub(super) fn reversed(direction: [f32; 3]) -> V {
    scale(wide(direction), -1.0)
}
