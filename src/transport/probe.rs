//! Probes: what the waves say of a path on its way, to whoever listens.
//!
//! The stages of [`World::evaluate_multiplexed_with`](super::World::evaluate_multiplexed_with) call
//! a hook after each step of a chunk of paths, with the figures that the step has just computed; so
//! what listens needs no choosing, arriving, scattering or joining of its own. Renders listen with
//! `()`, whose hooks are empty: no instruction of them is left.
//!
//! In every hook `list` holds the paths of the chunk, and lane `i` of all figures is of path
//! `list[i]`. Lanes beyond the list mean nothing. In sets of lanes (`alive`) bit `i` is that of
//! lane `i`, and a path whose bit is not set ends there.
//!
//! A path is told of in the order of its steps. It starts from the camera if it has a camera
//! subpath, and arrives and scatters along it; then the same from a light. Then either its camera
//! subpath meets a light ([`Probe::emission`], [`Probe::escaped`]), or its ends are linked, weighed
//! and, if they carry anything, looked along. Wherever it ends earlier, [`Probe::ended`] or a bit
//! says so.

use super::paths::{Endpoints, Parameters, Side};
use super::records::{Hit, LinkLanes};
use crate::camera::{CameraConnection, CameraRay};
use crate::light::{DirectSample, EmissionSample};
use crate::simd::{Lanes, Row, Vec3};
use crate::surface::BsdfSample;
use crate::surface::bump::Perturbation;

/// What listens to the waves. All hooks are empty unless they are written.
#[expect(unused_variables)]
pub trait Probe {
    /// Camera subpaths have their first rays.
    #[inline(always)]
    fn camera_started<L: Lanes>(&mut self, list: &[u32], ray: &CameraRay<L>) {}

    /// Light subpaths have their first rays, from the lights `lights[i]`; those that are not
    /// `alive` carry nothing.
    #[inline(always)]
    fn light_started<L: Lanes>(
        &mut self,
        list: &[u32],
        lights: &[u32],
        ray: &EmissionSample<L>,
        alive: u32,
    ) {
    }

    /// A bump or normal map has been looked up where a path's subpath arrives; [`Probe::arrived`]
    /// follows.
    #[inline(always)]
    fn perturbed(&mut self, path: u32, perturbation: &Option<Perturbation>) {}

    /// Subpaths have arrived at surfaces: all those of a wave and a side, maybe none. Throughputs
    /// are those on arrival, without the share of a mixture's component.
    #[inline(always)]
    fn arrived(&mut self, list: &[u32], at: &Arrived) {}

    /// Endpoints have scattered.
    #[inline(always)]
    fn scattered<L: Lanes>(&mut self, list: &[u32], side: Side, event: &Scattered<L>) {}

    /// `s = 1`: camera endpoints have chosen points on the lights `lights[i]`; those that are not
    /// `alive` get nothing from there.
    #[inline(always)]
    fn linked_light<L: Lanes>(
        &mut self,
        list: &[u32],
        lights: &[u32],
        point: &DirectSample<L>,
        alive: u32,
    ) {
    }

    /// `t = 1`: light endpoints have chosen points on the lens, which sees those that are valid.
    #[inline(always)]
    fn linked_lens<L: Lanes>(&mut self, list: &[u32], point: &CameraConnection<L>) {}

    /// `s, t >= 2`: endpoints have been joined; those that are not `alive` are in one place.
    #[inline(always)]
    fn linked_endpoints<L: Lanes>(&mut self, list: &[u32], link: &LinkLanes<L>, alive: u32) {}

    /// Linked paths have their MIS weights and their contributions, choice of strategy and colour
    /// of the wavelength included, before anything is known of visibility.
    #[inline(always)]
    fn weighed<L: Lanes>(&mut self, list: &[u32], weight: L, rgb: Vec3<L>) {}

    /// The links of all paths that carry something have been looked along; `blocked`, by path, is 0
    /// where nothing is in the way.
    #[inline(always)]
    fn looked(&mut self, list: &[u32], blocked: &[u32]) {}

    /// `s = 0`: camera endpoints are on the lights `lights[i]`. Weights and contributions as in
    /// [`Probe::weighed`].
    #[inline(always)]
    fn emission<L: Lanes>(&mut self, list: &[u32], lights: &[u32], weight: L, rgb: Vec3<L>) {}

    /// `s = 0`: camera subpaths have left the scene along unit `direction`, towards an environment;
    /// called for each environment. Weights and contributions as in [`Probe::weighed`].
    #[inline(always)]
    fn escaped<L: Lanes>(
        &mut self,
        list: &[u32],
        (light, direction): (u32, Vec3<L>),
        weight: L,
        rgb: Vec3<L>,
    ) {
    }

    /// A path has ended. One that has [left the scene](Ended::Missed) as it was to meet a light by
    /// chance may be told of once more, by [`Probe::escaped`].
    #[inline(always)]
    fn ended(&mut self, path: u32, why: Ended) {}
}

/// Nobody listens.
impl Probe for () {}

/// Why a path has ended, outside the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// A ray of this subpath has hit nothing.
    Missed(Side),
    /// The last vertex of this subpath is of a delta BSDF, which cannot be joined.
    Delta(Side),
    /// `s = 0`, and the last vertex is not on a light.
    Dark,
    /// The camera's ray comes through no lens.
    Blocked,
}

/// Tables that say where subpaths have arrived.
pub struct Arrived<'a> {
    /// Whose subpaths.
    pub side: Side,
    /// By path, as all tables.
    pub hits: &'a [Hit],
    /// Of that side.
    pub endpoints: &'a Endpoints,
    /// Rows that the endpoints refer to.
    pub parameters: &'a Parameters,
}

impl Arrived<'_> {
    /// The material of a path's endpoint; of a mixture, that of the component that was chosen.
    pub fn material(&self, path: u32) -> u32 {
        let row = self.endpoints.frame[path as usize].params;
        self.parameters.material(path, row)
    }

    /// Its parameters there.
    pub fn row(&self, path: u32) -> Row {
        self.parameters.rows[self.endpoints.frame[path as usize].params as usize]
    }

    /// What a component of a mixture is multiplied by; else 1.
    pub fn share(&self, path: u32) -> [f32; 3] {
        self.parameters.share(path)
    }
}

/// Scattering events.
pub struct Scattered<L: Lanes> {
    /// In the world, unit.
    pub wi: Vec3<L>,
    /// The direction in the shading frame, the BSDF's weight, and densities per solid angle.
    pub sample: BsdfSample<L>,
    /// What the throughputs of light subpaths are multiplied by beside the weight; 1 of camera
    /// subpaths.
    pub adjoint: L,
    /// Those that go on; the others are absorbed.
    pub alive: u32,
}
