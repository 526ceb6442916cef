//! The rays of a wave through media, and what media emit along them.

use super::super::World;
use super::super::paths::{Lists, Paths};
use super::super::samples::{Bounce, Samples};
use super::super::weigh::Sink;
use super::{Distances, How};
use crate::plan::DepthPlan;
use crate::simd::Lanes;

impl World<'_> {
    /// The rays of a wave of multiplexed paths go as far as they do through media.
    pub(in crate::transport) fn fly_both<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &Lists,
        (depth, wave): (&DepthPlan, u32),
    ) {
        let at = &depth.layout;
        let first = at.camera_distance + wave as usize * at.strides.distance;
        // The last ray of `s = 0` is there to meet a light.
        let how = |s: u32, t: u32| {
            let last = (s == 0) & (t == wave + 2);
            How {
                straight: last,
                glows: last,
            }
        };
        self.fly_on::<L>(paths, &lists.camera, (samples, Bounce::at(first)), how);
        self.shine::<L>(paths, &lists.camera, depth.choice.factors()[0]);
        let at = Bounce {
            first: at.light_distance,
            per_bounce: at.strides.distance,
            wave,
        };
        self.fly_on::<L>(paths, &lists.light, (samples, at), |_, _| How::default());
    }

    /// Adds what media have emitted along the latest rays of the camera subpaths of `list`,
    /// `factor` times.
    pub(in crate::transport) fn shine<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        factor: f32,
    ) {
        if self.emits {
            let sink = Sink {
                splats: &mut paths.splats.camera,
                part: None,
                dispersion: self.plan.dispersion.then_some(&paths.dispersion),
                kept: None,
                late: true,
            };
            self.glow::<L>(&mut paths.rays, list, factor, sink);
        }
    }

    /// The rays of `list`, traced already, go as far as they do through media; how, `how` says of
    /// the numbers of light and camera vertices.
    pub(in crate::transport) fn fly_on<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        (samples, at): (&Samples, Bounce),
        how: impl Fn(u32, u32) -> How,
    ) {
        let Paths {
            rays,
            subpaths,
            s,
            t,
            clock,
            ..
        } = paths;
        let distances = Distances { samples, at, t };
        let of = |i: usize| how(s[i], t[i]);
        self.fly::<L>(rays, &mut subpaths.flight, list, distances, of, clock);
    }
}
