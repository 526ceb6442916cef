//! The last step of a path: its endpoints are joined, or one of them to a light or the lens. One
//! visibility ray.

use super::World;
use super::clock::{Clock, Stage};
use super::list::List;
use super::paths::{Connections, Endpoint, Endpoints, Lists, Paths, Rays, Side};
use super::probe::Probe;
use super::records::*;
use super::samples::{ConnectionSamples, Samples};
use super::sides;
use super::weigh::{self, Sink, StrategyMask};
use crate::simd::{Lanes, Mask, Row, Vec3};
use crate::surface::{Bsdf, Kind};

/// What is joined, and where it goes.
pub(super) struct Joining<'a> {
    /// By side.
    pub endpoints: [&'a Endpoints; 2],
    /// Parameter rows of their BSDFs.
    pub params: &'a [Row],
    pub rays: &'a mut Rays,
    pub connections: &'a mut Connections,
    pub sink: Sink<'a>,
    pub clock: &'a mut Clock,
}

/// How connections are weighed.
#[derive(Clone, Copy)]
pub(super) struct Weighing<'a> {
    pub mask: StrategyMask,
    /// Of strategies, by light vertices: one over the probability that a path chooses it.
    pub factors: &'a [f32],
    /// Light vertices of every path.
    pub s: &'a [u32],
}

impl World<'_> {
    /// Joins the endpoints of the paths in the lists `direct` (`s = 1`), `lens` (`t = 1`) and
    /// `general`, and adds the visible contributions to their splats.
    pub(super) fn connect<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        at: ConnectionSamples,
        (mask, factors): (StrategyMask, &[f32]),
        probe: &mut impl Probe,
    ) {
        if self.plan.dispersion {
            for (list, side) in [
                (&lists.direct, Side::Camera),
                (&lists.general, Side::Camera),
                (&lists.lens, Side::Light),
                (&lists.general, Side::Light),
            ] {
                paths.dispersion.touch(list, side);
            }
        }
        let [camera, light] = &paths.subpaths.endpoints;
        let joining = Joining {
            endpoints: [camera, light],
            params: &paths.subpaths.parameters.rows,
            rays: &mut paths.rays,
            connections: &mut paths.connections,
            sink: Sink {
                splats: &mut paths.splats.camera,
                part: None,
                dispersion: self.plan.dispersion.then_some(&paths.dispersion),
                kept: None,
                late: self.plan.media,
            },
            clock: &mut paths.clock,
        };
        let weighing = Weighing {
            mask,
            factors,
            s: &paths.s,
        };
        self.join::<L, _>(joining, samples, lists, at, weighing, probe);
    }

    /// The same, where it is known already which of the paths have met what disperses light, their
    /// endpoints included.
    pub(super) fn join<L: Lanes, P: Probe>(
        &self,
        joining: Joining,
        samples: &Samples,
        lists: &mut Lists,
        at: ConnectionSamples,
        weighing: Weighing,
        probe: &mut P,
    ) {
        let Joining {
            endpoints,
            params,
            rays,
            connections,
            mut sink,
            clock,
        } = joining;
        let [direct, lens, general] = &mut lists.joined;
        direct.clear();
        lens.clear();
        general.clear();
        let [camera, light] = endpoints;
        let to = (&mut rays.ray[..], &mut *connections, &mut *direct);
        self.link_direct::<L>(camera, samples, &lists.direct, at, to, probe);
        let splats = &mut *sink.splats;
        let to = (&mut rays.ray[..], &mut *connections, splats, &mut *lens);
        if self.camera.is_pinhole() {
            self.link_lens::<L, true>(light, samples, &lists.lens, at, to, probe);
        } else {
            self.link_lens::<L, false>(light, samples, &lists.lens, at, to, probe);
        }
        for (list, side) in [(&*direct, Side::Camera), (&*lens, Side::Light)] {
            let from = (endpoints[side as usize], params);
            for (kind, queue) in self.queues_of(from.0, list, &mut lists.queues) {
                clock.count(Stage::Connect, queue.len(), L::N);
                crate::for_kind!(
                    kind,
                    self.evaluate_side::<_, L>(from, queue, side, &mut *connections)
                );
            }
        }
        clock.lap(Stage::Connect);
        // Contributions first: no ray for what carries nothing.
        let live = &mut lists.trace;
        live.clear();
        let Weighing { mask, factors, s } = weighing;
        weigh::direct::<L>(connections, direct, (mask, factors[1]), &sink, live, probe);
        // Where `t = 1`, no strategy has more light vertices.
        let most = factors[factors.len() - 1];
        weigh::lens::<L>(connections, lens, (mask, most), &sink, live, probe);
        clock.lap(Stage::Mis);
        // The camera's BSDF is evaluated with the link, the light's with the weight: each endpoint
        // is loaded whole once.
        let list = &lists.general;
        for (kind, queue) in self.queues_of(camera, list, &mut lists.queues) {
            clock.count(Stage::Connect, queue.len(), L::N);
            let to = (&mut rays.ray[..], &mut *connections, &mut *general);
            crate::for_kind!(
                kind,
                self.link_endpoints::<_, L, P>(endpoints, params, queue, to, probe)
            );
        }
        for (kind, queue) in self.queues_of(light, general, &mut lists.queues) {
            clock.count(Stage::Connect, queue.len(), L::N);
            let (from, weights) = ((light, params), (s, factors));
            crate::for_kind!(
                kind,
                self.weigh_endpoints::<_, L, P>(
                    from,
                    queue,
                    weights,
                    connections,
                    (&sink, &mut *live),
                    probe
                )
            );
        }
        clock.lap(Stage::Connect);
        if self.plan.media {
            for (list, from) in [(&*direct, camera), (&*lens, light), (&*general, camera)] {
                self.note_media(rays, from, list);
            }
            self.look::<L>(rays, &mut connections.contribution, live, clock);
        } else {
            self.trace_visibility::<L>(rays, live, clock);
        }
        probe.looked(live, &rays.blocked);
        sink.add_visible(&connections.contribution, &rays.blocked, live);
        clock.lap(Stage::Mis);
    }

    /// `s = 1`: camera endpoints to points on lights.
    fn link_direct<L: Lanes>(
        &self,
        endpoints: &Endpoints,
        samples: &Samples,
        list: &[u32],
        at: ConnectionSamples,
        (rays, connections, joined): (&mut [Ray], &mut Connections, &mut List),
        probe: &mut impl Probe,
    ) {
        for chunk in list.chunks(L::N) {
            let place = EndpointPlaceLanes::<L>::load(&endpoints.place, chunk);
            let ng = EndpointFrameLanes::<L>::load(&endpoints.frame, chunk).ng;
            let light = if self.plan.light_choice {
                self.lights
                    .choose::<L>(samples.gather(at.choice, chunk), chunk.len())
            } else {
                [0; 8]
            };
            let u = [
                samples.gather(at.point, chunk),
                samples.gather(at.point + 1, chunk),
            ];
            let light = &light[..chunk.len()];
            let seen = self.lights.sample_direct(&self.geometry, light, place.p, u);
            let w = seen.to_light;
            RayLanes::between(place.leave(ng, w), seen.end).store(rays, chunk);
            LinkLanes {
                w,
                distance2: L::one(),
            }
            .store(&mut connections.link, chunk);
            LightEndLanes {
                radiance: seen.radiance,
                pdf: seen.pdf,
                emission_ratio: seen.emission_ratio,
                hittable: L::one().or_zero(seen.delta.not()),
            }
            .store(&mut connections.light_end, chunk);
            let alive = seen.valid.bits() & self.emits(light, u);
            joined.push_where(chunk, alive);
            probe.linked_light(chunk, light, &seen, alive);
        }
    }

    /// `t = 1`: light endpoints to points on the lens; splats are told where that is on the film.
    fn link_lens<L: Lanes, const PINHOLE: bool>(
        &self,
        endpoints: &Endpoints,
        samples: &Samples,
        list: &[u32],
        at: ConnectionSamples,
        (rays, connections, splats, joined): (
            &mut [Ray],
            &mut Connections,
            &mut [Splat],
            &mut List,
        ),
        probe: &mut impl Probe,
    ) {
        for chunk in list.chunks(L::N) {
            let place = EndpointPlaceLanes::<L>::load(&endpoints.place, chunk);
            let ng = EndpointFrameLanes::<L>::load(&endpoints.frame, chunk).ng;
            let lens = if !PINHOLE && self.camera.connects_by_choice() {
                (
                    samples.gather(at.point, chunk),
                    samples.gather(at.point + 1, chunk),
                )
            } else {
                (L::zero(), L::zero())
            };
            let link = self.camera.connect::<L, PINHOLE>(place.p, lens);
            let from = place.leave(ng, link.to_camera);
            RayLanes::between(from, link.origin).store(rays, chunk);
            LinkLanes {
                w: -link.to_camera,
                distance2: L::one(),
            }
            .store(&mut connections.link, chunk);
            LensEndLanes { pdf: link.pdf }.store(&mut connections.lens_end, chunk);
            for (i, &path) in chunk.iter().enumerate() {
                splats[path as usize].raster = [link.raster.0.lane(i), link.raster.1.lane(i)];
            }
            joined.push_where(chunk, link.valid.bits());
            probe.linked_lens(chunk, &link);
        }
    }

    /// `list` by the kinds of its endpoints, without empty queues.
    fn queues_of<'a>(
        &'a self,
        endpoints: &Endpoints,
        list: &[u32],
        queues: &'a mut [List; Kind::ALL.len()],
    ) -> impl Iterator<Item = (Kind, &'a [u32])> {
        if !list.is_empty() {
            self.queue(&endpoints.kind, list, queues);
        }
        let kinds = if list.is_empty() {
            &[]
        } else {
            &self.plan.kinds[..]
        };
        let queue_of = |kind: &Kind| (*kind, &*queues[*kind as usize]);
        kinds
            .iter()
            .map(queue_of)
            .filter(|(_, queue)| !queue.is_empty())
    }

    /// What one side's endpoints, linked already, make of their links.
    fn evaluate_side<B: Bsdf, L: Lanes>(
        &self,
        (endpoints, params): (&Endpoints, &[Row]),
        list: &[u32],
        side: Side,
        connections: &mut Connections,
    ) {
        for chunk in list.chunks(L::N) {
            let end = endpoints.load::<L>(chunk);
            let row = end.frame.load_params(params, chunk.len());
            let w = LinkLanes::<L>::load(&connections.link, chunk).w;
            let value = self.value_along::<B, L>(&end, &row, w, side);
            value.store(&mut connections.value[side as usize], chunk);
        }
    }

    /// `s, t >= 2`: links endpoints to endpoints, and evaluates the camera's.
    fn link_endpoints<B: Bsdf, L: Lanes, P: Probe>(
        &self,
        [camera, light]: [&Endpoints; 2],
        params: &[Row],
        list: &[u32],
        (rays, connections, joined): (&mut [Ray], &mut Connections, &mut List),
        probe: &mut P,
    ) {
        for chunk in list.chunks(L::N) {
            let end = camera.load::<L>(chunk);
            let far = EndpointPlaceLanes::<L>::load(&light.place, chunk);
            let far_ng = EndpointFrameLanes::<L>::load(&light.frame, chunk).ng;
            let v = far.p - end.place.p;
            let d2 = v.length2();
            let w = v * (L::one() / d2.sqrt());
            let (from, to) = (end.place.leave(end.frame.ng, w), far.leave(far_ng, -w));
            RayLanes::between(from, to).store(rays, chunk);
            let link = LinkLanes { w, distance2: d2 };
            link.store(&mut connections.link, chunk);
            let row = end.frame.load_params(params, chunk.len());
            let value = self.value_along::<B, L>(&end, &row, w, Side::Camera);
            value.store(&mut connections.value[Side::Camera as usize], chunk);
            // Coincident endpoints have no direction between them and contribute nothing.
            let alive = d2.gt(L::splat(f32::MIN_POSITIVE)).bits();
            joined.push_where(chunk, alive);
            probe.linked_endpoints(chunk, &link, alive);
        }
    }

    /// `s, t >= 2`: evaluates the light's endpoints, and weighs both. The factors are those of `s`
    /// light vertices.
    fn weigh_endpoints<B: Bsdf, L: Lanes, P: Probe>(
        &self,
        (light, params): (&Endpoints, &[Row]),
        list: &[u32],
        (s, factors): (&[u32], &[f32]),
        connections: &mut Connections,
        (sink, live): (&Sink, &mut List),
        probe: &mut P,
    ) {
        for chunk in list.chunks(L::N) {
            let end = light.load::<L>(chunk);
            let row = end.frame.load_params(params, chunk.len());
            let link = LinkLanes::<L>::load(&connections.link, chunk);
            let light = self.value_along::<B, L>(&end, &row, link.w, Side::Light);
            let camera = EndpointValueLanes::<L>::load(&connections.value[0], chunk);
            let last = chunk.len() - 1;
            let factor = L::from_fn(|i| factors[s[chunk[i.min(last)] as usize] as usize]);
            let contributions = &mut connections.contribution;
            let ends = [&camera, &light];
            weigh::general(
                ends,
                link.distance2,
                factor,
                contributions,
                chunk,
                (sink, live),
                probe,
            );
        }
    }

    /// Values and densities of an endpoint's BSDF along a link of direction `w`, from the camera's
    /// side to the light's.
    #[inline(always)]
    fn value_along<B: Bsdf, L: Lanes>(
        &self,
        end: &Endpoint<L>,
        row: &[L; Row::WIDTH],
        w: Vec3<L>,
        side: Side,
    ) -> EndpointValueLanes<L> {
        let Endpoint {
            place,
            frame,
            energy,
        } = end;
        let wi = if side == Side::Camera { w } else { -w };
        let directions = [place.wo, wi];
        let normals = end.normals();
        let value = sides::eval::<B, L>(
            self.sides,
            &self.materials.tables,
            row,
            &normals,
            directions,
            side.mode(),
        );
        let wi_ng = wi.dot(frame.ng);
        let cos = match side {
            _ if B::MEDIUM => L::one(),
            Side::Camera => wi.dot(frame.ns).abs(),
            Side::Light => {
                sides::adjoint_cosine(wi_ng, place.wo.dot(frame.ns), place.wo.dot(frame.ng))
            }
        };
        EndpointValueLanes {
            beta: energy.beta.mul_elem(value.f * cos),
            pdf: value.pdf,
            back: end.partial().back(value.pdf_reverse),
            cos: if B::MEDIUM { L::one() } else { wi_ng.abs() },
        }
    }
}
