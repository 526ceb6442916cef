//! The first rays of subpaths: from the camera, and from lights.

use super::World;
use super::list::List;
use super::probe::{Ended, Probe};
use super::records::*;
use super::samples::Samples;
use crate::simd::{Lanes, Mask, UintLanes, Vec3};

impl World<'_> {
    /// Starts the camera subpaths of `list` at raster positions, which their splats are told;
    /// `raster` is the first dimension of the raster samples, `lens` of the lens samples.
    /// `no_lens_joins` says that no strategy joins light endpoints to the camera.
    pub(super) fn start_camera<L: Lanes>(
        &self,
        samples: &Samples,
        list: &[u32],
        at: (usize, usize),
        no_lens_joins: bool,
        started: (&mut [Ray], &mut [Flight], &mut [Splat]),
        probe: &mut impl Probe,
    ) {
        if self.camera.is_pinhole() {
            self.start_camera_by::<L, true>(samples, list, at, no_lens_joins, started, probe);
        } else {
            self.start_camera_by::<L, false>(samples, list, at, no_lens_joins, started, probe);
        }
    }

    fn start_camera_by<L: Lanes, const PINHOLE: bool>(
        &self,
        samples: &Samples,
        list: &[u32],
        (raster, lens): (usize, usize),
        no_lens_joins: bool,
        (rays, flights, splats): (&mut [Ray], &mut [Flight], &mut [Splat]),
        probe: &mut impl Probe,
    ) {
        for chunk in list.chunks(L::N) {
            let u: L = samples.gather(raster, chunk);
            let v: L = samples.gather(raster + 1, chunk);
            let lens = if !PINHOLE && self.plan.lens {
                (samples.gather(lens, chunk), samples.gather(lens + 1, chunk))
            } else {
                (L::zero(), L::zero())
            };
            let (x, y) = self.camera.region.place(u, v);
            let ray = self.camera.ray::<L, PINHOLE>(x, y, lens);
            let d_vcm = if no_lens_joins {
                L::zero()
            } else {
                L::one() / ray.pdf
            };
            let distant = L::splat(f32::from(u8::from(!PINHOLE && self.camera.is_parallel())));
            RayLanes::endless(ray.origin, ray.direction).store(rays, chunk);
            FlightLanes {
                beta: Vec3::new(ray.weight, ray.weight, ray.weight),
                d_vcm,
                d_vc: L::zero(),
                distant,
                medium: L::Uint::splat(self.media.media.camera),
                open: L::zero(),
            }
            .store(flights, chunk);
            for (i, &path) in chunk.iter().enumerate() {
                splats[path as usize].raster = [x.lane(i), y.lane(i)];
            }
            probe.camera_started(chunk, &ray);
        }
    }

    /// Takes camera subpaths out of `list` whose rays come through no lens.
    pub(super) fn drop_blocked(
        &self,
        flights: &[Flight],
        (list, scratch): (&mut List, &mut List),
        probe: &mut impl Probe,
    ) {
        if !self.plan.lens_system {
            return;
        }
        scratch.clear();
        for &path in &**list {
            let passes = flights[path as usize].beta[0] > 0.0;
            scratch.push_if(path, passes);
            if !passes {
                probe.ended(path, Ended::Blocked);
            }
        }
        list.clear();
        list.extend(scratch);
    }

    /// Starts the light subpaths of `list`; those that leave their light are appended to `started`.
    pub(super) fn start_light<L: Lanes>(
        &self,
        samples: &Samples,
        list: &[u32],
        (choice, emission): (usize, usize),
        (rays, flights): (&mut [Ray], &mut [Flight]),
        started: &mut List,
        probe: &mut impl Probe,
    ) {
        for chunk in list.chunks(L::N) {
            let light = if self.plan.light_choice {
                self.lights
                    .choose::<L>(samples.gather(choice, chunk), chunk.len())
            } else {
                [0; 8]
            };
            // Not by `array::from_fn`, which is not reliably inlined; so below.
            let mut u = [L::zero(); 4];
            for (i, u) in u.iter_mut().enumerate() {
                *u = samples.gather(emission + i, chunk);
            }
            let ray = self
                .lights
                .sample_emission(&self.geometry, &light[..chunk.len()], u);
            RayLanes::endless(ray.origin, ray.direction).store(rays, chunk);
            let distant = L::one().or_zero(ray.distant);
            FlightLanes {
                beta: ray.beta,
                d_vcm: ray.d_vcm,
                d_vc: ray.d_vc,
                distant,
                medium: L::Uint::splat(0),
                open: L::zero(),
            }
            .store(flights, chunk);
            if self.plan.media {
                self.start_in_media(&light[..chunk.len()], chunk, flights, rays);
            }
            let emits = self.emits(&light[..chunk.len()], [u[0], u[1]]);
            let alive = ray.valid.bits() & emits;
            started.push_where(chunk, alive);
            probe.light_started(chunk, &light[..chunk.len()], &ray, alive);
        }
    }
}
