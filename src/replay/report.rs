//! All there is to say about a path, ready to print.

use super::compare::{densities, relative};
use super::oracle::path::Path;
use super::oracle::reference::Reference;
use super::oracle::vector::{length, mean, sub, wide};
use super::recorder::Recorder;
use super::walk::{Fate, Subpath, Walk};
use crate::plan::{Choice, DepthPlan};
use crate::scene::NONE;
use crate::transport::paths::Side;
use serde::Serialize;

/// A path, step by step. Lengths are in internal space (see [`crate::scene`]), colours linear sRGB.
#[derive(Clone, Debug, Serialize)]
pub struct PathReport {
    /// Scattering events.
    pub depth: u32,
    /// Light vertices of the strategy.
    pub s: u32,
    /// Camera vertices of the strategy.
    pub t: u32,
    /// Strategies that the depth chooses among.
    pub strategies: usize,
    /// Probability of this one.
    pub strategy_probability: f32,
    /// The primary samples, and what they are for.
    pub samples: Vec<f32>,
    /// Those of the same path where strategies are chosen uniformly.
    pub uniform_samples: Vec<f32>,
    /// What each of them is for, in order.
    pub layout: Vec<SampleRange>,
    /// Of a path in a scene with dispersion, in nanometres.
    pub wavelength: Option<f32>,
    /// What its light is multiplied by, if a surface that disperses light scatters it.
    pub colour: Option<[f32; 3]>,
    /// [`Fate`] in words.
    pub fate: String,
    /// Of the joined vertices; `None` if no visibility ray was traced.
    pub visible: Option<bool>,
    /// The contribution was not finite, or negative, and was replaced by 0.
    pub rejected: bool,
    /// Raster position, in pixels.
    pub raster: [f32; 2],
    /// Linear sRGB, as in [`Splat`](crate::transport::Splat): 0 if something is in the way.
    pub contribution: [f32; 3],
    /// In order of the walk: the camera subpath, then the light subpath.
    pub vertices: Vec<VertexReport>,
    /// One for each light met; none if the path is not whole.
    pub meetings: Vec<MeetingReport>,
    /// The path could be followed in `f64` from its primary samples.
    pub followed: bool,
}

/// Some primary samples.
#[derive(Clone, Debug, Serialize)]
pub struct SampleRange {
    /// As [`Layout::parts`](crate::plan::Layout::parts) calls it.
    pub name: &'static str,
    /// Index of the first.
    pub first: usize,
    /// How many, at least 1.
    pub count: usize,
}

/// A vertex of a subpath, in `f32`. Vertex 0 is on the lens, or where the light subpath starts.
#[derive(Clone, Debug, Serialize)]
pub struct VertexReport {
    /// `camera` or `light`.
    pub subpath: &'static str,
    /// Number in the subpath, from 0.
    pub vertex: usize,
    /// Internal space.
    pub position: [f32; 3],
    /// Unit geometric normal; `None` where there is no surface.
    pub ng: Option<[f32; 3]>,
    /// Unit shading normal; `None` where there is no surface.
    pub ns: Option<[f32; 3]>,
    /// Name of the kernel; `None` where there is no surface.
    pub bsdf: Option<&'static str>,
    /// Name of the material, empty if it has none; `None` where there is no surface.
    pub material: Option<String>,
    /// Triangles first, then spheres; `None` where there is no surface.
    pub primitive: Option<u32>,
    /// The light that the vertex is on, an index into the scene's; `None` for any other.
    pub light: Option<u32>,
    /// Throughput on arrival, of vertex 0 on leaving.
    pub beta: [f32; 3],
    /// `dVCM` on arrival ([`Partial`](crate::transport::mis::Partial)).
    pub d_vcm: Option<f32>,
    /// `dVC` on arrival.
    pub d_vc: Option<f32>,
    /// Unit direction in which the subpath goes on; `None` at its end.
    pub direction: Option<[f32; 3]>,
    /// Density of `direction` over solid angle; a camera of parallel rays has it over area.
    pub pdf: Option<f32>,
    /// Density of the way back.
    pub pdf_reverse: Option<f32>,
    /// How far the vertex is from where `f64` finds it from the same primary samples.
    pub moved: Option<f64>,
}

/// How a path meets a light, in both precisions.
#[derive(Clone, Debug, Serialize)]
pub struct MeetingReport {
    /// Index into the scene's lights.
    pub light: u32,
    /// Throughputs and sampled densities along the path, MIS weight and contribution.
    pub figures: Vec<Figure>,
    /// One for each strategy of the depth.
    pub densities: Vec<DensityReport>,
    /// Largest relative change of the contribution as vertices move by what `f32` makes of
    /// positions.
    pub contribution_moves: f64,
    /// The same of the MIS weight.
    pub weight_moves: f64,
}

/// A figure in `f32`, in `f64` from the vertices that `f32` found, and in `f64` from the same
/// primary samples; with relative errors of the first.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// What it is.
    pub name: String,
    /// In `f32`, by the renderer.
    pub single: f32,
    /// In `f64`, from the vertices that `f32` found.
    pub by_vertices: f64,
    /// Relative error of `single` against it.
    pub vertices_error: f64,
    /// In `f64`, from the primary samples; `None` if they cannot be followed.
    pub by_samples: Option<f64>,
    /// Relative error of `single` against it.
    pub samples_error: Option<f64>,
}

/// The density of the path under one strategy, over the product of areas, in `f64`; and its part of
/// the sum, the MIS weight.
#[derive(Clone, Debug, Serialize)]
pub struct DensityReport {
    /// Light vertices.
    pub s: u32,
    /// Camera vertices.
    pub t: u32,
    /// Density, from the vertices that `f32` found.
    pub by_vertices: f64,
    /// Its part of the sum.
    pub weight_by_vertices: f64,
    /// Density, from the primary samples; `None` if they cannot be followed.
    pub by_samples: Option<f64>,
    /// Its part of the sum.
    pub weight_by_samples: Option<f64>,
}

impl Recorder<'_> {
    /// Everything about the path that `samples` stand for.
    pub fn report(&self, plan: &DepthPlan, samples: &[f32]) -> PathReport {
        let walk = self.walk(plan, samples);
        let whole = walk.fate == Fate::Whole;
        let exact = whole.then(|| self.retrace(plan, samples, &walk)).flatten();
        let exact = exact.unwrap_or_default();
        let mut vertices = self.vertices(Side::Camera, &walk.camera);
        vertices.extend(self.vertices(Side::Light, &walk.light));
        if let Some(exact) = exact.first() {
            measure(&mut vertices, &walk, exact);
        }
        let meetings = walk.paths().enumerate().map(|(i, path)| {
            let exact = exact.get(i).map(|p| self.reference(p, &plan.strategies));
            self.meeting(plan, &walk, i, &path, exact.as_ref())
        });
        let parts = plan.layout.parts().into_iter();
        PathReport {
            depth: plan.depth,
            s: walk.s,
            t: walk.t,
            strategies: walk.choices,
            strategy_probability: if walk.factor > 0.0 {
                1.0 / walk.factor
            } else {
                0.0
            },
            samples: samples.to_vec(),
            uniform_samples: uniform(plan, samples),
            layout: parts
                .filter(|(_, range)| !range.is_empty())
                .map(|(name, range)| SampleRange {
                    name,
                    first: range.start,
                    count: range.len(),
                })
                .collect(),
            wavelength: walk.wavelength.map(|w| w.single.nm),
            colour: walk.wavelength.map(|w| w.single.colour),
            fate: walk.fate.to_string(),
            visible: walk.visible,
            rejected: walk.rejected,
            raster: walk.raster,
            contribution: walk.rgb,
            vertices,
            meetings: meetings.collect(),
            followed: !exact.is_empty(),
        }
    }

    fn vertices(&self, side: Side, subpath: &Option<Subpath>) -> Vec<VertexReport> {
        let Some(subpath) = subpath else {
            return Vec::new();
        };
        let name = name_of(side);
        let start = VertexReport {
            subpath: name,
            vertex: 0,
            position: subpath.origin,
            ng: None,
            ns: None,
            bsdf: None,
            material: None,
            primitive: None,
            light: index(subpath.light),
            beta: subpath.beta,
            d_vcm: None,
            d_vc: None,
            direction: Some(subpath.direction),
            pdf: (side == Side::Camera).then_some(subpath.pdf),
            pdf_reverse: None,
            moved: None,
        };
        let on_surface = subpath.steps.iter().enumerate().map(|(i, step)| {
            let v = &step.vertex;
            let material = self.scene.materials.get(v.material as usize);
            VertexReport {
                subpath: name,
                vertex: i + 1,
                position: v.p.map(|x| x as f32),
                ng: Some(v.ng.map(|x| x as f32)),
                ns: Some(v.ns.map(|x| x as f32)),
                bsdf: Some(v.kind.name()),
                material: material.map(|m| m.name.clone()),
                primitive: Some(v.primitive),
                light: index(v.light),
                beta: step.beta,
                d_vcm: Some(step.partial.d_vcm),
                d_vc: Some(step.partial.d_vc),
                direction: step.sampled.map(|s| s.wi),
                pdf: step.sampled.map(|s| s.pdf),
                pdf_reverse: step.sampled.map(|s| s.pdf_reverse),
                moved: None,
            }
        });
        std::iter::once(start).chain(on_surface).collect()
    }

    fn meeting(
        &self,
        plan: &DepthPlan,
        walk: &Walk,
        i: usize,
        path: &Path,
        exact: Option<&Reference>,
    ) -> MeetingReport {
        let reference = &self.reference(path, &plan.strategies);
        let moves = self.sensitivity(path, &plan.strategies, 1);
        let mut figures = Figures {
            reference,
            exact,
            list: Vec::new(),
        };
        figures.subpaths(walk);
        let meeting = &walk.meetings[i];
        figures.push("MIS weight".into(), meeting.weight, |r| r.weight(path.s));
        let factor = f64::from(walk.factor);
        for (c, name) in ["red", "green", "blue"].into_iter().enumerate() {
            let name = format!("contribution, {name}");
            figures.push(name, meeting.rgb[c], |r| r.rgb()[c] * factor);
        }
        let density = |s: u32| DensityReport {
            s,
            t: plan.depth + 2 - s,
            by_vertices: reference.density(s),
            weight_by_vertices: reference.weight(s),
            by_samples: exact.map(|r| r.density(s)),
            weight_by_samples: exact.map(|r| r.weight(s)),
        };
        let part = |change: f64, of: f64| if change > 0.0 { change / of } else { 0.0 };
        MeetingReport {
            light: meeting.end.light(),
            figures: figures.list,
            densities: plan.strategies.iter().map(|s| density(*s)).collect(),
            contribution_moves: part(moves.value, reference.value()),
            weight_moves: part(moves.weight, reference.weight(path.s)),
        }
    }
}

/// The primary samples of the same path where strategies are chosen uniformly.
fn uniform(plan: &DepthPlan, samples: &[f32]) -> Vec<f32> {
    let mut samples = samples.to_vec();
    let chooses = plan.strategies.len() > 1 && !plan.choice.is_uniform();
    if let Some(u) = samples.get_mut(plan.layout.strategy).filter(|_| chooses) {
        *u = Choice::uniform(&plan.strategies).carry(&plan.choice, *u);
    }
    samples
}

/// The figures of a path as they are collected.
struct Figures<'a> {
    reference: &'a Reference,
    exact: Option<&'a Reference>,
    list: Vec<Figure>,
}

impl Figures<'_> {
    /// A figure in `f32`, and how references have it.
    fn push(&mut self, name: String, single: f32, double: impl Fn(&Reference) -> f64) {
        let by_samples = self.exact.map(&double);
        self.add(name, single, double(self.reference), by_samples);
    }

    fn add(&mut self, name: String, single: f32, by_vertices: f64, by_samples: Option<f64>) {
        self.list.push(Figure {
            name,
            single,
            by_vertices,
            vertices_error: relative(single.into(), by_vertices),
            by_samples,
            samples_error: by_samples.map(|v| relative(single.into(), v)),
        });
    }

    /// Throughputs, means of the channels, and sampled densities.
    fn subpaths(&mut self, walk: &Walk) {
        let k = self.reference.joints.len();
        let grey = |rgb: [f32; 3]| mean(wide(rgb)) as f32;
        if let Some(camera) = &walk.camera {
            self.push("camera 0: pdf".into(), camera.pdf, |r| r.camera_pdf);
            for (i, step) in camera.steps.iter().enumerate().take(k + 1) {
                let name = format!("camera {}: beta", i + 1);
                self.push(name, grey(step.beta), |r| mean(r.camera_beta(i)));
                self.densities(walk, Side::Camera, i + 1);
            }
        }
        if let Some(light) = &walk.light {
            let name = "light 0: beta".into();
            self.push(name, grey(light.beta), |r| mean(r.emitted_beta));
            for (i, step) in light.steps.iter().enumerate().take(k) {
                let name = format!("light {}: beta", i + 1);
                self.push(name, grey(step.beta), |r| mean(r.light_beta(k - 1 - i)));
                self.densities(walk, Side::Light, i + 1);
            }
        }
    }

    /// Those of the direction sampled at a vertex, if one was.
    fn densities(&mut self, walk: &Walk, side: Side, vertex: usize) {
        let at = |r: &Reference| {
            let mut all = densities(walk, r).into_iter();
            all.find(|d| d.side == side && d.vertex == vertex)
        };
        let Some(d) = at(self.reference) else {
            return;
        };
        let exact = self.exact.and_then(at);
        for (c, what) in ["pdf", "pdf, reverse"].into_iter().enumerate() {
            let name = format!("{} {vertex}: {what}", name_of(side));
            self.add(name, d.single[c], d.double[c], exact.map(|e| e.double[c]));
        }
    }
}

fn name_of(side: Side) -> &'static str {
    match side {
        Side::Camera => "camera",
        Side::Light => "light",
    }
}

fn index(of: u32) -> Option<u32> {
    (of != NONE).then_some(of)
}

/// How far the vertices on surfaces are from those of `exact`.
fn measure(vertices: &mut [VertexReport], walk: &Walk, exact: &Path) {
    let k = exact.surface.len();
    let from_light = walk.light.as_ref().map_or(0, |l| l.steps.len());
    for v in vertices.iter_mut().filter(|v| v.vertex > 0) {
        let j = match v.subpath {
            "camera" => v.vertex - 1,
            _ => k.saturating_sub(v.vertex.min(from_light)),
        };
        v.moved = (exact.surface.get(j)).map(|x| length(sub(wide(v.position), x.p)));
    }
}
