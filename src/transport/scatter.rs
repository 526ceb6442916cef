//! Endpoints scatter, queue by queue: one per BSDF kind.

use super::World;
use super::clock::Stage;
use super::list::List;
use super::paths::{Endpoint, Endpoints, Lists, Paths, Side};
use super::probe::{Probe, Scattered};
use super::records::*;
use super::samples::{Bounce, Samples};
use super::sides::{self, Sampled};
use crate::simd::{Lanes, Mask, Row, UintLanes};
use crate::surface::{Bsdf, Kind};

impl World<'_> {
    /// Sorts `list` into the queues of its endpoints' BSDF kinds.
    pub(super) fn queue(&self, kinds: &[Kind], list: &[u32], queues: &mut [List]) {
        if let [kind] = self.plan.kinds[..] {
            queues[kind as usize].clear();
            queues[kind as usize].extend(list);
            return;
        }
        for &kind in &self.plan.kinds {
            queues[kind as usize].clear();
        }
        for &path in list {
            queues[kinds[path as usize] as usize].push(path);
        }
    }

    /// Scatters the endpoints of `list`, all of one BSDF; survivors are appended to `alive` with a
    /// new ray and flight record. `t[path]` is its number of camera vertices.
    fn scatter<B: Bsdf, L: Lanes, P: Probe>(
        &self,
        samples: &Samples,
        list: &[u32],
        (endpoints, params): (&Endpoints, &[Row]),
        (side, bounce, t): (Side, Bounce, &[u32]),
        (rays, flights, alive): (&mut [Ray], &mut [Flight], &mut List),
        probe: &mut P,
    ) {
        let mode = side.mode();
        for chunk in list.chunks(L::N) {
            let end = endpoints.load::<L>(chunk);
            let Endpoint {
                place,
                frame,
                energy,
            } = &end;
            let row = frame.load_params(params, chunk.len());
            let mut first = [0usize; 8];
            for (slot, &path) in first.iter_mut().zip(chunk) {
                *slot = bounce.dimension(t, path);
            }
            let mut u = [L::zero(); 3];
            for (c, u) in u.iter_mut().enumerate() {
                if c < 2 || B::LOBES {
                    *u = samples.gather_each(&first, c, chunk);
                }
            }
            let Sampled { wi, sample, valid } = sides::sample::<B, L>(
                self.sides,
                &self.materials.tables,
                &row,
                &end.normals(),
                place.wo,
                u,
                mode,
            );
            let wi_ng = wi.dot(frame.ng);
            let cos_out = if B::MEDIUM { L::one() } else { wi_ng.abs() };
            let mut beta = energy.beta.mul_elem(sample.throughput);
            let mut adjoint = L::one();
            if side == Side::Light && !B::MEDIUM {
                // Weight and density are made of the local cosine, which has to cancel: of a
                // grazing direction the dot product is another number.
                // Where the normals are one, it is the other cosine of the correction that cancels.
                let shading = wi.dot(frame.ns).abs();
                let cos = L::select(shading.eq(cos_out), shading, sample.wi.z.abs());
                adjoint =
                    sides::adjoint_cosine(wi_ng, place.wo.dot(frame.ns), place.wo.dot(frame.ng))
                        / cos;
                adjoint = adjoint.or_zero(cos.gt(L::zero()));
                beta = beta * adjoint;
            }
            let partial =
                (end.partial()).scatter(cos_out, sample.pdf, sample.pdf_reverse, B::DELTA);
            let medium = if self.plan.media {
                endpoints.media_towards::<L>(chunk, wi_ng)
            } else {
                L::Uint::splat(0)
            };
            let open = match (&self.chance, B::DELTA) {
                (None, _) => L::zero(),
                (_, true) => FlightLanes::<L>::load(flights, chunk).open,
                (_, false) => L::one(),
            };
            RayLanes::endless(place.leave(frame.ng, wi), wi).store(rays, chunk);
            FlightLanes {
                beta,
                d_vcm: partial.d_vcm,
                d_vc: partial.d_vc,
                distant: L::zero(),
                medium,
                open,
            }
            .store(flights, chunk);
            let lit = beta.x.max(beta.y).max(beta.z).gt(L::zero());
            let goes_on = valid.and(lit).bits();
            alive.push_where(chunk, goes_on);
            let event = Scattered {
                wi,
                sample,
                adjoint,
                alive: goes_on,
            };
            probe.scattered(chunk, side, &event);
        }
    }

    /// Scatters the endpoints of `lists.camera` or `lists.light` queue by queue; the list is left
    /// with the survivors.
    pub(super) fn scatter_queues<L: Lanes, P: Probe>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        side: Side,
        bounce: Bounce,
        probe: &mut P,
    ) {
        let list = match side {
            Side::Camera => &mut lists.camera,
            Side::Light => &mut lists.light,
        };
        if list.is_empty() {
            return;
        }
        if self.plan.dispersion {
            paths.dispersion.touch(list, side);
        }
        let endpoints = &paths.subpaths.endpoints[side as usize];
        self.queue(&endpoints.kind, list, &mut lists.queues);
        list.clear();
        paths.clock.lap(Stage::Sort);
        let from = (endpoints, &paths.subpaths.parameters.rows[..]);
        let at = (side, bounce, &paths.t[..]);
        for &kind in &self.plan.kinds {
            let queue = &lists.queues[kind as usize];
            if !queue.is_empty() {
                paths.clock.count(Stage::Shade, queue.len(), L::N);
                let rays = &mut paths.rays.ray[..];
                let to = (rays, &mut paths.subpaths.flight[..], &mut *list);
                crate::for_kind!(
                    kind,
                    self.scatter::<_, L, P>(samples, queue, from, at, to, probe)
                );
            }
        }
        paths.clock.lap(Stage::Shade);
    }
}
