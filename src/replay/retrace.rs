//! The same path once more in `f64`, from its primary samples: not only weighed but walked in
//! double precision.
//!
//! Every decision is the one that the walk in `f32` took (strategy, light, lobe, primitive hit);
//! what varies smoothly between decisions (rays, intersections with the known primitive, normals,
//! sampled directions) is computed in `f64`. Numbers of the scene count as exact as they are in
//! `f32`; the parameters of a textured BSDF, and the index of a dispersive one, are those that
//! `f32` looked up.

use super::oracle::bend::{Taken, bend};
use super::oracle::path::{End, Path, PathVertex};
use super::oracle::rays::Ray;
use super::oracle::vector::{V, scale, wide};
use super::recorder::Recorder;
use super::walk::{Subpath, SubpathVertex, Walk};
use crate::plan::DepthPlan;

impl Recorder<'_> {
    /// The paths of `walk`, which `samples` stand for, in double precision. `None` where the
    /// decisions cannot be followed: the primitive that `f32` hit is not met any more.
    pub fn retrace(&self, plan: &DepthPlan, samples: &[f32], walk: &Walk) -> Option<Vec<Path>> {
        let (at, oracle) = (&plan.layout, &self.oracle);
        let u = |d: usize| f64::from(samples.get(d).copied().unwrap_or(0.0));
        let bounce = |base: usize, j: usize| {
            let d = base + j * at.per_bounce;
            [
                u(d),
                u(d + 1),
                if at.per_bounce > 2 { u(d + 2) } else { 0.0 },
            ]
        };
        let lens = |d: usize| oracle.lens_point(u(d), u(d + 1));
        let mut camera = [0.0; 3];
        let mut seen = Vec::new();
        let mut left = None;
        if let Some(subpath) = &walk.camera {
            let raster = [u(at.raster), u(at.raster + 1)];
            let ray = oracle.camera_ray(raster, lens(at.lens));
            camera = ray.0;
            let samples = |j| bounce(at.camera_bounce, j);
            let escapes = walk
                .meetings
                .iter()
                .any(|m| walk.s == 0 && matches!(m.end, End::Sky { .. }));
            (seen, left) = self.follow(ray, &subpath.steps, &samples, escapes)?;
        }
        let mut lit = Vec::new();
        let mut ends = Vec::new();
        for meeting in &walk.meetings {
            ends.push(match (walk.s, meeting.end) {
                (0, End::Area { light, .. }) => End::Area {
                    light,
                    p: seen.pop()?.p,
                },
                (0, End::Sky { light, .. }) => End::Sky {
                    light,
                    direction: left?,
                },
                (1, end) => oracle.chosen_point(end, [u(at.connection), u(at.connection + 1)])?,
                (_, end) => {
                    let numbers = [0, 1, 2, 3].map(|c| u(at.emission + c));
                    let subpath: &Subpath = walk.light.as_ref()?;
                    let (ray, end) = oracle.emitted_ray(end, numbers)?;
                    let samples = |j| bounce(at.light_bounce, j);
                    lit = self.follow(ray, &subpath.steps, &samples, false)?.0;
                    end
                }
            });
        }
        if walk.t == 1 {
            camera = oracle.camera_point(lens(at.connection));
        }
        lit.reverse();
        seen.extend(lit);
        let colour = walk.colour_of(&seen);
        let path = |end| Path {
            s: walk.s,
            camera,
            surface: seen.clone(),
            end,
            colour,
        };
        Some(ends.into_iter().map(path).collect())
    }

    /// The vertices of `steps` along the ray, and the direction in which the subpath goes on if it
    /// `leaves`.
    fn follow(
        &self,
        mut ray: Ray,
        steps: &[SubpathVertex],
        samples: &dyn Fn(usize) -> [f64; 3],
        leaves: bool,
    ) -> Option<(Vec<PathVertex>, Option<V>)> {
        let mut vertices = Vec::with_capacity(steps.len());
        for (j, step) in steps.iter().enumerate() {
            let v = self.oracle.hit(ray, &step.vertex)?;
            if j + 1 < steps.len() || leaves {
                let taken = Taken {
                    ng: step.vertex.ng,
                    ns: step.vertex.ns,
                    wo: wide(step.wo),
                    wi: step.sampled.map(|s| wide(s.wi)),
                };
                let wo = scale(ray.1, -1.0);
                ray = (v.p, bend(self.oracle.sides, &v, wo, samples(j), taken));
            }
            vertices.push(v);
        }
        Some((vertices, leaves.then_some(ray.1)))
    }
}
