//! The last step of a path: its tips are joined, or the camera subpath has met a light. One visibility ray at most.

use super::World;
use super::clock::Stage;
use super::list::List;
use super::mis::{self, Partial};
use super::paths::{Endpoint, Lists, Paths, Side};
use super::records::*;
use super::samples::Samples;
use crate::BARE;
use crate::geometry::shading_frame;
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, Vec3};
use crate::surface::Bsdf;

/// Which dimensions a connection reads.
#[derive(Clone, Copy)]
pub(super) struct ConnectionSamples {
    pub choice: usize,
    pub point: usize,
}

impl World<'_> {
    /// `s = 0`: adds what the camera tips of `list` emit to their outcomes, `factor` times (one over the probability of the strategy). Their last
    /// hits are still those of the tips: paths of this strategy have no light subpath.
    pub(super) fn emission<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        lit: &mut List,
        factor: f32,
    ) {
        lit.clear();
        for &path in list {
            let light = paths.endpoints[0].energy[path as usize].light;
            lit.push_if(path, light != NONE);
        }
        for chunk in lit.chunks(L::N) {
            let mut lights = [0u32; 8];
            for (light, &path) in lights.iter_mut().zip(chunk) {
                *light = paths.endpoints[0].energy[path as usize].light;
            }
            let end = paths.endpoints[0].load::<L>(chunk);
            let cos = end.place.wo.dot(end.frame.ng);
            let lights = &lights[..chunk.len()];
            let mut surface = [L::zero(); 2];
            if self.lights.has_pictures() {
                surface = HitLanes::<L>::load(&paths.hit, chunk).b;
            }
            let seen = (self.lights).emitted(&self.geometry, lights, end.place.p, cos, surface);
            let direct = seen.direct_pdf * L::splat(paths.rivals.direct);
            let emission = seen.emission_pdf * L::splat(paths.rivals.light);
            let weight = end.partial().weight_hit(direct, emission);
            let all = end.energy.beta.mul_elem(seen.radiance);
            let rgb = all * (weight * L::splat(factor));
            self.add(paths, chunk, rgb, || all * L::splat(factor));
        }
    }

    /// `s = 0`: adds what the escaped camera rays of `list` see of the environments, `factor` times.
    pub(super) fn escape<L: Lanes>(&self, paths: &mut Paths, list: &[u32], factor: f32) {
        for chunk in list.chunks(L::N) {
            let direction = RayLanes::<L>::load(&paths.ray, chunk).direction;
            let flight = FlightLanes::<L>::load(&paths.flight, chunk);
            // Densities stay over solid angle: nothing was arrived at.
            let partial = Partial {
                d_vcm: flight.d_vcm,
                d_vc: flight.d_vc,
            };
            // Each environment is a path space of its own, with its own densities.
            for &light in &self.lights.infinite {
                let seen = self.lights.escaped(light, direction);
                let direct = seen.direct_pdf * L::splat(paths.rivals.direct);
                let emission = seen.emission_pdf * L::splat(paths.rivals.light);
                let weight = partial.weight_hit(direct, emission);
                let all = flight.beta.mul_elem(seen.radiance);
                let rgb = all * (weight * L::splat(factor));
                self.add(paths, chunk, rgb, || all * L::splat(factor));
            }
        }
    }

    /// Joins the tips of the paths in the lists `direct` (`s = 1`), `lens` (`t = 1`) and `general`, and adds the visible
    /// contributions to their outcomes, times the factors of their strategies: `factors[s]` for `s` light vertices.
    pub(super) fn connect<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        at: ConnectionSamples,
        factors: &[f32],
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
        self.join::<L>(paths, samples, lists, at, factors);
    }

    /// The same, where it is known already which of the paths have met what disperses light, their tips included.
    pub(super) fn join<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        at: ConnectionSamples,
        factors: &[f32],
    ) {
        let [direct, lens, general] = &mut lists.joined;
        direct.clear();
        lens.clear();
        general.clear();
        self.link_direct::<L>(paths, samples, &lists.direct, at, direct);
        if self.camera.is_pinhole() {
            self.link_lens::<L, true>(paths, samples, &lists.lens, at, lens);
        } else {
            self.link_lens::<L, false>(paths, samples, &lists.lens, at, lens);
        }
        self.link_tips::<L>(paths, &lists.general, general);
        for (list, side) in [
            (&*direct, Side::Camera),
            (&*general, Side::Camera),
            (&*lens, Side::Light),
            (&*general, Side::Light),
        ] {
            if list.is_empty() {
                continue;
            }
            self.queue(paths, list, side, &mut lists.queues);
            for &kind in &self.plan.kinds {
                let queue = &lists.queues[kind as usize];
                if !queue.is_empty() {
                    paths.clock.count(Stage::Connect, queue.len(), L::N);
                    crate::for_kind!(kind, self.evaluate::<_, L>(paths, queue, side));
                }
            }
        }
        paths.clock.lap(Stage::Connect);
        // Contributions first: no ray for what carries nothing.
        lists.trace.clear();
        self.weigh_direct::<L>(paths, direct, factors[1], &mut lists.trace);
        // Where `t = 1`, no strategy has more light vertices.
        let most = factors[factors.len() - 1];
        self.weigh_lens::<L>(paths, lens, most, &mut lists.trace);
        self.weigh_tips::<L>(paths, general, factors, &mut lists.trace);
        paths.clock.lap(Stage::Mis);
        paths.rays += lists.trace.len() as u64;
        paths.sorter.sort(&paths.ray, &lists.trace);
        paths.clock.lap(Stage::Sort);
        // Hits have been arrived at, and their rows are free.
        paths.rays += self.occluded::<L>(
            &paths.ray,
            paths.sorter.sorted(),
            &mut paths.blocked,
            &mut paths.hit,
            &mut paths.through,
        );
        paths.clock.count(Stage::Occlusion, lists.trace.len(), L::N);
        paths.clock.lap(Stage::Occlusion);
        for &path in &*lists.trace {
            let visible = paths.blocked[path as usize] == 0;
            let added = paths.contribution[path as usize].weighted;
            let rgb = &mut paths.outcome[path as usize].rgb;
            for c in 0..3 {
                // Not a product: what is blocked may be infinite.
                rgb[c] += if visible { added[c] } else { 0.0 };
            }
        }
        if !paths.part.is_empty() {
            for &path in &*lists.trace {
                if paths.blocked[path as usize] == 0 {
                    let added = paths.contribution[path as usize];
                    paths.part[path as usize].add(added.weighted, added.unweighted);
                }
            }
        }
        paths.clock.lap(Stage::Mis);
    }

    fn link_direct<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        at: ConnectionSamples,
        joined: &mut List,
    ) {
        for chunk in list.chunks(L::N) {
            let place = EndpointPlaceLanes::<L>::load(&paths.endpoints[0].place, chunk);
            let ng = EndpointFrameLanes::<L>::load(&paths.endpoints[0].frame, chunk).ng;
            let light = if !BARE && self.plan.light_choice {
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
            shadow_ray(&mut paths.ray, chunk, place.leave(ng, w), seen.target);
            store_link(&mut paths.link, chunk, w, L::one());
            LightEndLanes {
                radiance: seen.radiance,
                pdf: seen.pdf,
                emission_ratio: seen.emission_ratio,
                by_chance: L::one().or_zero(seen.delta.not()),
            }
            .store(&mut paths.light_end, chunk);
            joined.push_where(chunk, seen.valid.bits() & self.emits(light, u));
        }
    }

    fn link_lens<L: Lanes, const PINHOLE: bool>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        at: ConnectionSamples,
        joined: &mut List,
    ) {
        for chunk in list.chunks(L::N) {
            let place = EndpointPlaceLanes::<L>::load(&paths.endpoints[1].place, chunk);
            let ng = EndpointFrameLanes::<L>::load(&paths.endpoints[1].frame, chunk).ng;
            let lens = if !PINHOLE && self.camera.connects_by_choice() {
                (
                    samples.gather(at.point, chunk),
                    samples.gather(at.point + 1, chunk),
                )
            } else {
                (L::zero(), L::zero())
            };
            let link = self.camera.connect::<L, PINHOLE>(place.p, lens);
            shadow_ray(
                &mut paths.ray,
                chunk,
                place.leave(ng, link.to_camera),
                link.origin,
            );
            store_link(&mut paths.link, chunk, -link.to_camera, L::one());
            LensEndLanes { pdf: link.pdf }.store(&mut paths.lens_end, chunk);
            for (i, &path) in chunk.iter().enumerate() {
                paths.outcome[path as usize].raster =
                    [link.raster.0.lane(i), link.raster.1.lane(i)];
            }
            joined.push_where(chunk, link.valid.bits());
        }
    }

    fn link_tips<L: Lanes>(&self, paths: &mut Paths, list: &[u32], joined: &mut List) {
        for chunk in list.chunks(L::N) {
            let [camera, light] = [0, 1]
                .map(|side| EndpointPlaceLanes::<L>::load(&paths.endpoints[side].place, chunk));
            let [camera_ng, light_ng] = [0, 1]
                .map(|side| EndpointFrameLanes::<L>::load(&paths.endpoints[side].frame, chunk).ng);
            let v = light.p - camera.p;
            let d2 = v.length2();
            let w = v * (L::one() / d2.sqrt());
            let (from, to) = (camera.leave(camera_ng, w), light.leave(light_ng, -w));
            shadow_ray(&mut paths.ray, chunk, from, to);
            store_link(&mut paths.link, chunk, w, d2);
            // Coincident tips have no direction between them and contribute nothing.
            joined.push_where(chunk, d2.gt(L::splat(f32::MIN_POSITIVE)).bits());
        }
    }

    /// Values and densities of one side's BSDF along the link.
    fn evaluate<B: Bsdf, L: Lanes>(&self, paths: &mut Paths, list: &[u32], side: Side) {
        for chunk in list.chunks(L::N) {
            let end = paths.endpoints[side as usize].load::<L>(chunk);
            let Endpoint {
                place,
                frame,
                energy,
            } = &end;
            let w = LinkLanes::<L>::load(&paths.link, chunk).w;
            let wi = if side == Side::Camera { w } else { -w };
            let row = frame.load_params(&paths.params, chunk.len());
            let local = shading_frame(frame.ns, energy.tangent);
            let value = B::eval(
                &row,
                local.to_local(place.wo),
                local.to_local(wi),
                side.mode(),
            );
            let wi_ng = wi.dot(frame.ng);
            let cos = match side {
                Side::Camera => wi.dot(frame.ns).abs(),
                Side::Light => {
                    mis::adjoint_cosine(wi_ng, place.wo.dot(frame.ns), place.wo.dot(frame.ng))
                }
            };
            let agree = mis::sides_agree(place.wo, wi, frame.ng, frame.ns);
            EndpointValueLanes {
                beta: energy.beta.mul_elem((value.f * cos).or_zero(agree)),
                pdf: value.pdf,
                back: end.partial().back(value.pdf_reverse),
                cos: wi_ng.abs(),
            }
            .store(&mut paths.value[side as usize], chunk);
        }
    }

    fn weigh_direct<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        factor: f32,
        live: &mut List,
    ) {
        for chunk in list.chunks(L::N) {
            let value = EndpointValueLanes::<L>::load(&paths.value[0], chunk);
            let end = LightEndLanes::<L>::load(&paths.light_end, chunk);
            let weight = value.joint().weight_direct(
                end.pdf,
                end.emission_ratio * L::splat(paths.rivals.light),
                end.by_chance.gt(L::zero()),
            );
            let scale = weight * L::splat(factor) / end.pdf;
            let all = value.beta.mul_elem(end.radiance);
            let unweighted = || all * (L::splat(factor) / end.pdf);
            self.keep(paths, chunk, all * scale, unweighted, live);
        }
    }

    fn weigh_lens<L: Lanes>(&self, paths: &mut Paths, list: &[u32], factor: f32, live: &mut List) {
        for chunk in list.chunks(L::N) {
            let value = EndpointValueLanes::<L>::load(&paths.value[1], chunk);
            let pdf = LensEndLanes::<L>::load(&paths.lens_end, chunk).pdf;
            let camera = pdf * value.cos * L::splat(paths.rivals.camera);
            let weight = value.joint().weight_camera(camera);
            let rgb = value.beta * (pdf * weight * L::splat(factor));
            let unweighted = || value.beta * (pdf * L::splat(factor));
            self.keep(paths, chunk, rgb, unweighted, live);
        }
    }

    fn weigh_tips<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        factors: &[f32],
        live: &mut List,
    ) {
        for chunk in list.chunks(L::N) {
            let camera = EndpointValueLanes::<L>::load(&paths.value[0], chunk);
            let light = EndpointValueLanes::<L>::load(&paths.value[1], chunk);
            let inv_d2 = L::one() / LinkLanes::<L>::load(&paths.link, chunk).distance2;
            let weight = mis::weight_connect(&camera.joint(), &light.joint(), inv_d2);
            let last = chunk.len() - 1;
            let factor = L::from_fn(|i| factors[paths.s[chunk[i.min(last)] as usize] as usize]);
            let all = camera.beta.mul_elem(light.beta);
            let rgb = all * (inv_d2 * weight * factor);
            self.keep(paths, chunk, rgb, || all * (inv_d2 * factor), live);
        }
    }

    /// Keeps contributions until visibility is known; those that are not zero (also if not finite, so that they are counted) stay
    /// alive. Without their weights they are kept if parts are asked for.
    #[inline(always)]
    fn keep<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        rgb: Vec3<L>,
        unweighted: impl FnOnce() -> Vec3<L>,
        live: &mut List,
    ) {
        let rgb = self.coloured(paths, list, rgb);
        let zero = L::zero();
        let dark = |v: Vec3<L>| v.x.eq(zero).and(v.y.eq(zero)).and(v.z.eq(zero)).bits();
        let mut all = Vec3::zero();
        let mut unlit = dark(rgb);
        if !paths.part.is_empty() {
            all = self.coloured(paths, list, unweighted());
            unlit &= dark(all);
        }
        ContributionLanes {
            weighted: rgb,
            unweighted: all,
        }
        .store(&mut paths.contribution, list);
        live.push_where(list, !unlit);
    }

    /// Adds to the outcomes of the paths in `list`, and to the parts that are asked for.
    #[inline(always)]
    fn add<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        rgb: Vec3<L>,
        unweighted: impl FnOnce() -> Vec3<L>,
    ) {
        let rgb = self.coloured(paths, list, rgb);
        for (i, &path) in list.iter().enumerate() {
            let v = rgb.lane(i);
            let out = &mut paths.outcome[path as usize].rgb;
            for c in 0..3 {
                out[c] += v[c];
            }
        }
        if paths.part.is_empty() {
            return;
        }
        let all = self.coloured(paths, list, unweighted());
        for (i, &path) in list.iter().enumerate() {
            paths.part[path as usize].add(rgb.lane(i), all.lane(i));
        }
    }

    /// Contributions with the colours of the paths' wavelengths ([`super::wavelength`]).
    #[inline(always)]
    fn coloured<L: Lanes>(&self, paths: &Paths, list: &[u32], rgb: Vec3<L>) -> Vec3<L> {
        if self.plan.dispersion {
            paths.dispersion.colour(list, rgb)
        } else {
            rgb
        }
    }
}

/// From `origin` to `target`: `t = 1` is the target.
#[inline(always)]
fn shadow_ray<L: Lanes>(rays: &mut [Ray], list: &[u32], origin: Vec3<L>, target: Vec3<L>) {
    RayLanes {
        origin,
        t_max: L::one(),
        direction: target - origin,
    }
    .store(rays, list);
}

#[inline(always)]
fn store_link<L: Lanes>(links: &mut [Link], list: &[u32], w: Vec3<L>, distance2: L) {
    LinkLanes { w, distance2 }.store(links, list);
}
