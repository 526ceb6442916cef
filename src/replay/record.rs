//! Recording a path: the renderer's own waves walk it, alone, and a probe notes what they say.

use super::oracle::path::{End, PathVertex};
use super::oracle::spectral;
use super::oracle::vector::wide;
use super::recorder::Recorder;
use super::walk::{Chosen, Fate, Meeting, Sampled, Subpath, SubpathVertex, Walk};
use crate::camera::{CameraConnection, CameraRay};
use crate::light::{DirectSample, EmissionSample, Kind};
use crate::plan::DepthPlan;
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, Vec3};
use crate::surface::bump::Perturbation;
use crate::transport::mis::Partial;
use crate::transport::paths::Side;
use crate::transport::probe::{Arrived, Ended, Probe, Scattered};
use crate::transport::records::LinkLanes;
use crate::transport::samples::Samples;
use crate::transport::{Paths, Splat};

impl Recorder<'_> {
    /// The path of the given depth that `samples`, laid out as `plan.layout`, stand for; samples
    /// that are missing are 0.
    pub fn walk(&self, plan: &DepthPlan, samples: &[f32]) -> Walk {
        let layout = &plan.layout;
        let mut matrix = Samples::new(layout.total, 1);
        for (dimension, u) in samples.iter().take(layout.total).enumerate() {
            matrix.row_mut(dimension)[0] = *u;
        }
        let mut paths = Paths::new(self.world);
        let mut witness = Witness {
            recorder: self,
            camera: None,
            light: None,
            fate: Fate::NoStrategy,
            end: None,
            meetings: Vec::new(),
            lens: [0.0; 3],
            visible: None,
            perturbation: None,
        };
        self.world
            .evaluate_multiplexed_with::<f32, _>(plan, &matrix, 1, &mut paths, &mut witness);
        let Splat {
            rgb,
            raster,
            s,
            rejected,
            ..
        } = paths.splats.camera[0];
        let u = samples.get(layout.wavelength).copied().unwrap_or(0.0);
        let wavelength = paths.wavelength(0).map(|single| Chosen {
            single,
            colour_f64: spectral::colour(u.into()),
        });
        Walk {
            s,
            t: plan.depth + 2 - s,
            choices: plan.strategies.len(),
            wavelength,
            factor: plan.choice.factor(s),
            camera: witness.camera,
            light: witness.light,
            fate: witness.fate,
            meetings: witness.meetings,
            lens: witness.lens,
            raster,
            visible: witness.visible,
            rgb,
            rejected: rejected != 0,
        }
    }
}

/// Listens to the waves of a single path: lane 0 is its.
struct Witness<'a> {
    recorder: &'a Recorder<'a>,
    camera: Option<Subpath>,
    light: Option<Subpath>,
    /// As far as is known.
    fate: Fate,
    /// Where the path would meet its light, once something is linked.
    end: Option<End>,
    meetings: Vec<Meeting>,
    lens: [f32; 3],
    visible: Option<bool>,
    /// What a bump or normal map says of the vertex that is being arrived at.
    perturbation: Option<Perturbation>,
}

impl Witness<'_> {
    fn subpath(&mut self, side: Side) -> Option<&mut Subpath> {
        match side {
            Side::Camera => self.camera.as_mut(),
            Side::Light => self.light.as_mut(),
        }
    }

    fn meet<L: Lanes>(&mut self, end: End, weight: L, rgb: Vec3<L>) {
        self.fate = Fate::Whole;
        self.meetings.push(Meeting {
            end,
            weight: weight.lane(0),
            rgb: rgb.lane(0),
        });
    }

    /// The end of a path at `p` on a light, or at infinity in the unit direction `w`.
    fn end_on(&self, light: u32, p: [f32; 3], w: [f32; 3]) -> End {
        match self.recorder.world.lights.kind(light) {
            kind if kind.is_area() => End::Area {
                light,
                p: self.recorder.oracle.on_light(light, wide(p)),
            },
            kind if kind.is_point() => End::Point { light },
            Kind::Distant => End::Distant { light },
            _ => End::Sky {
                light,
                direction: wide(w),
            },
        }
    }

    /// The vertex that the light subpath started from.
    fn origin(&self) -> Option<End> {
        let Subpath {
            light,
            origin,
            direction,
            ..
        } = self.light.as_ref()?;
        Some(self.end_on(*light, *origin, direction.map(|x| -x)))
    }

    fn step(&mut self, path: u32, at: &Arrived) -> SubpathVertex {
        let i = path as usize;
        let place = &at.endpoints.place[i];
        let frame = &at.endpoints.frame[i];
        let energy = &at.endpoints.energy[i];
        let material = at.material(path);
        let entry = &self.recorder.world.materials.entries[material as usize];
        SubpathVertex {
            vertex: PathVertex {
                p: wide(place.p),
                error: place.error.into(),
                ng: wide(frame.ng),
                ns: wide(frame.ns),
                surface: at.hits[i].b,
                tangent: wide(energy.tangent),
                kind: at.endpoints.kind[i],
                row: at.row(path).0,
                share: at.share(path),
                dispersive: entry.dispersive,
                light: energy.light,
                primitive: energy.primitive,
                material,
                perturbation: self.perturbation.take(),
            },
            wo: place.wo,
            beta: energy.beta,
            partial: Partial {
                d_vcm: place.d_vcm,
                d_vc: frame.d_vc,
            },
            sampled: None,
        }
    }
}

impl Probe for Witness<'_> {
    fn camera_started<L: Lanes>(&mut self, _: &[u32], ray: &CameraRay<L>) {
        self.camera = Some(Subpath {
            origin: ray.origin.lane(0),
            direction: ray.direction.lane(0),
            beta: [1.0; 3],
            pdf: ray.pdf.lane(0),
            light: NONE,
            steps: Vec::new(),
        });
    }

    fn light_started<L: Lanes>(
        &mut self,
        _: &[u32],
        lights: &[u32],
        ray: &EmissionSample<L>,
        alive: u32,
    ) {
        self.light = Some(Subpath {
            origin: ray.origin.lane(0),
            direction: ray.direction.lane(0),
            beta: ray.beta.lane(0),
            pdf: 0.0,
            light: lights[0],
            steps: Vec::new(),
        });
        if alive & 1 == 0 {
            self.fate = Fate::Unlit;
        }
    }

    fn perturbed(&mut self, _: u32, perturbation: &Option<Perturbation>) {
        self.perturbation = *perturbation;
    }

    fn arrived(&mut self, list: &[u32], at: &Arrived) {
        for &path in list {
            let step = self.step(path, at);
            if let Some(subpath) = self.subpath(at.side) {
                subpath.steps.push(step);
            }
        }
    }

    fn scattered<L: Lanes>(&mut self, _: &[u32], side: Side, event: &Scattered<L>) {
        let sample = &event.sample;
        if let Some(step) = self.subpath(side).and_then(|s| s.steps.last_mut()) {
            let share = Vec3::splat(step.vertex.share);
            let throughput = sample.throughput.mul_elem(share) * event.adjoint;
            step.sampled = Some(Sampled {
                wi: event.wi.lane(0),
                throughput: throughput.lane(0),
                pdf: sample.pdf.lane(0),
                pdf_reverse: sample.pdf_reverse.lane(0),
            });
        }
        if event.alive & 1 == 0 {
            self.fate = Fate::Absorbed(side);
        }
    }

    fn linked_light<L: Lanes>(
        &mut self,
        _: &[u32],
        lights: &[u32],
        point: &DirectSample<L>,
        alive: u32,
    ) {
        if alive & 1 == 0 {
            self.fate = Fate::Unlit;
            return;
        }
        let [p, w] = [point.end, point.to_light].map(|v| v.lane(0));
        self.end = Some(self.end_on(lights[0], p, w));
    }

    fn linked_lens<L: Lanes>(&mut self, _: &[u32], point: &CameraConnection<L>) {
        if point.valid.bits() & 1 == 0 {
            self.fate = Fate::OutOfView;
            return;
        }
        self.lens = point.origin.lane(0);
        self.end = self.origin();
    }

    fn linked_endpoints<L: Lanes>(&mut self, _: &[u32], _: &LinkLanes<L>, alive: u32) {
        if alive & 1 == 0 {
            self.fate = Fate::Coincident;
            return;
        }
        self.end = self.origin();
    }

    fn weighed<L: Lanes>(&mut self, _: &[u32], weight: L, rgb: Vec3<L>) {
        if let Some(end) = self.end {
            self.meet(end, weight, rgb);
        }
    }

    fn looked(&mut self, list: &[u32], blocked: &[u32]) {
        for &path in list {
            self.visible = Some(blocked[path as usize] == 0);
        }
    }

    fn emission<L: Lanes>(&mut self, _: &[u32], lights: &[u32], weight: L, rgb: Vec3<L>) {
        let end = self.camera.as_ref().and_then(|c| c.steps.last());
        if let Some(p) = end.map(|end| end.vertex.p) {
            let light = lights[0];
            self.meet(End::Area { light, p }, weight, rgb);
        }
    }

    fn escaped<L: Lanes>(
        &mut self,
        _: &[u32],
        (light, direction): (u32, Vec3<L>),
        weight: L,
        rgb: Vec3<L>,
    ) {
        let direction = wide(direction.lane(0));
        self.meet(End::Sky { light, direction }, weight, rgb);
    }

    fn ended(&mut self, _: u32, why: Ended) {
        self.fate = match why {
            Ended::Missed(side) => Fate::Missed(side),
            Ended::Delta(side) => Fate::Delta(side),
            Ended::Dark => Fate::Dark,
            Ended::Blocked => Fate::Blocked,
        };
    }
}
