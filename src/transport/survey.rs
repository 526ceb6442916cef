//! A look around before a render: how much of the picture shows specular surfaces, and how much of
//! each lamp's light they are the first to get.
//!
//! First rays say it, of camera and light subpaths alike: a few thousand are traced.

use super::World;
use super::paths::{Paths, Side};
use super::records::*;
use super::samples::{Bounce, Samples};
use crate::plan::Layout;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use std::collections::BTreeMap;

/// First rays of each side.
const RAYS: usize = 4096;

/// What first rays have met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Survey {
    /// Part of the picture that shows specular surfaces.
    pub seen: f64,
    /// Materials of these, and the part of the picture of each.
    pub shown: BTreeMap<u32, f64>,
    /// By lamp of [`Chance`](crate::plan::Chance).
    pub lamps: Vec<LampSurvey>,
    /// Power of all lights, those that nothing can meet by chance included.
    pub power: f64,
}

/// What the first rays of a lamp have met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LampSurvey {
    /// Its power, in units of [`Survey::power`].
    pub power: f64,
    /// Power that falls on specular surfaces first.
    pub specular: f64,
    /// Materials of these, and the power that each gets.
    pub through: BTreeMap<u32, f64>,
}

impl World<'_> {
    /// Traces first rays, the same ones in every render of the scene.
    pub fn survey<L: Lanes>(&self) -> Survey {
        let mut survey = Survey::default();
        let Some(chance) = &self.chance else {
            return survey;
        };
        survey.lamps = vec![LampSurvey::default(); chance.lamps.len()];
        // Of paths by any strategy: all first rays have their samples.
        let at = Layout::multiplexed(&self.plan, 2, &[0, 1, 2, 3]);
        let mut samples = Samples::new(at.total, RAYS);
        let stream = Stream::new(0, Purpose::Pilot);
        samples.fill::<L>(&stream, RAYS, |i| [i as u32, u32::MAX]);
        let mut paths = Paths::new(self);
        self.look_around::<L>(&at, &samples, &mut paths, &mut survey);
        self.shine_around::<L>(&at, &samples, &mut paths, &mut survey);
        survey
    }

    /// The material that a path's ray has hit, if that is specular there.
    fn specular(&self, paths: &Paths, side: Side, path: u32) -> Option<u32> {
        let endpoints = &paths.subpaths.endpoints[side as usize];
        let delta = endpoints.kind[path as usize].is_delta();
        let primitive = endpoints.energy[path as usize].primitive;
        delta.then(|| self.geometry.shape_of(primitive).0.material)
    }

    fn look_around<L: Lanes>(
        &self,
        at: &Layout,
        samples: &Samples,
        paths: &mut Paths,
        survey: &mut Survey,
    ) {
        paths.resize(RAYS);
        self.start_wavelengths(samples, at.wavelength, RAYS, &mut paths.dispersion);
        let mut lists = std::mem::take(&mut paths.lists);
        lists.clear();
        (0..RAYS as u32).for_each(|path| lists.camera.push(path));
        let place = (at.raster, at.lens);
        self.start_camera::<L>(
            samples,
            &lists.camera,
            place,
            true,
            paths.camera_starts(),
            &mut (),
        );
        let list = (&mut lists.camera, &mut lists.scratch);
        self.drop_blocked(&paths.subpaths.flight, list, &mut ());
        self.trace::<L>(&mut paths.rays, &lists.camera, &mut paths.clock);
        for &path in &*lists.camera {
            lists.emission.push_if(path, !paths.rays.missed(path));
        }
        let component = Some(Bounce::at(at.camera_component));
        let side = (Side::Camera, 0);
        self.arrive_on::<L>(paths, &lists.emission, side, (samples, component), &mut ());
        let each = 1.0 / lists.camera.len().max(1) as f64;
        for &path in &*lists.emission {
            if let Some(material) = self.specular(paths, Side::Camera, path) {
                survey.seen += each;
                *survey.shown.entry(material).or_default() += each;
            }
        }
        paths.lists = lists;
    }

    fn shine_around<L: Lanes>(
        &self,
        at: &Layout,
        samples: &Samples,
        paths: &mut Paths,
        survey: &mut Survey,
    ) {
        paths.resize(RAYS);
        // As camera subpaths of one vertex leave them.
        paths.t[..RAYS].fill(1);
        self.start_wavelengths(samples, at.wavelength, RAYS, &mut paths.dispersion);
        let mut lists = std::mem::take(&mut paths.lists);
        lists.clear();
        (0..RAYS as u32).for_each(|path| lists.starting.push(path));
        self.start_light::<L>(
            samples,
            &lists.starting,
            (at.light_choice, at.emission),
            (&mut paths.rays.ray, &mut paths.subpaths.flight),
            &mut lists.light,
            &mut (),
        );
        let powers: Vec<f64> = (paths.subpaths.flight[..RAYS].iter())
            .map(|flight| flight.beta.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0)
            .collect();
        let lamps = self.lamps_of::<L>(at, samples, paths);
        self.trace::<L>(&mut paths.rays, &lists.light, &mut paths.clock);
        for &path in &*lists.light {
            lists.emission.push_if(path, !paths.rays.missed(path));
            let power = powers[path as usize];
            survey.power += power;
            if let Some(lamp) = lamps[path as usize] {
                survey.lamps[lamp as usize].power += power;
            }
        }
        let component = Some(Bounce::at(at.light_component));
        let side = (Side::Light, 0);
        self.arrive_on::<L>(paths, &lists.emission, side, (samples, component), &mut ());
        for &path in &*lists.emission {
            let material = self.specular(paths, Side::Light, path);
            if let (Some(lamp), Some(material)) = (lamps[path as usize], material) {
                let lamp = &mut survey.lamps[lamp as usize];
                lamp.specular += powers[path as usize];
                *lamp.through.entry(material).or_default() += powers[path as usize];
            }
        }
        paths.lists = lists;
    }

    /// The lamps that light subpaths have started from; `None` of lights that nothing meets.
    fn lamps_of<L: Lanes>(
        &self,
        at: &Layout,
        samples: &Samples,
        paths: &Paths,
    ) -> Vec<Option<u32>> {
        let all: Vec<u32> = (0..RAYS as u32).collect();
        let mut lamps = Vec::with_capacity(RAYS);
        for chunk in all.chunks(L::N) {
            let lights = if self.plan.light_choice {
                let choice = samples.gather(at.light_choice, chunk);
                self.lights.choose::<L>(choice, chunk.len())
            } else {
                [0; 8]
            };
            let direction = RayLanes::<L>::load(&paths.rays.ray, chunk).direction;
            for (i, light) in lights.into_iter().take(chunk.len()).enumerate() {
                // Where an environment is brightest depends on the direction.
                let radiance = if self.lights.kind(light).is_environment() {
                    let seen = self.lights.escaped(light, direction * L::splat(-1.0));
                    seen.radiance.lane(i).iter().sum::<f32>() / 3.0
                } else {
                    0.0
                };
                let met = self.lights.is_met(light);
                let chance = self.chance.as_ref().filter(|_| met);
                lamps.push(chance.map(|chance| chance.lamp(light, radiance)));
            }
        }
        lamps
    }
}
