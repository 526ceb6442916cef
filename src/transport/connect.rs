//! The last step of a path: its tips are joined, or the camera subpath has met a light. One visibility ray at most.

use super::World;
use super::clock::Stage;
use super::list::List;
use super::mis::{self, Partial};
use super::paths::{Lists, Paths, Side, Tip};
use super::samples::Samples;
use super::sides;
use crate::BARE;
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, Row, Vec3};
use crate::surface::Bsdf;

/// Which dimensions a connection reads.
#[derive(Clone, Copy)]
pub(super) struct ConnectionSamples {
    pub choice: usize,
    pub point: usize,
}

impl<L: Lanes> Tip<L> {
    #[inline(always)]
    fn partial(&self) -> Partial<L> {
        Partial {
            d_vcm: self.d_vcm,
            d_vc: self.d_vc,
        }
    }
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
            let light = paths.tips[0].energy[path as usize].0[7].to_bits();
            lit.push_if(path, light != NONE);
        }
        for chunk in lit.chunks(L::N) {
            let mut lights = [0u32; 8];
            for (light, &path) in lights.iter_mut().zip(chunk) {
                *light = paths.tips[0].energy[path as usize].0[7].to_bits();
            }
            let tip = paths.tips[0].load::<L>(chunk);
            let cos = tip.wo.dot(tip.ng);
            let lights = &lights[..chunk.len()];
            let mut surface = [L::zero(); 2];
            if self.lights.has_pictures() {
                let [_, b1, b2, ..] = L::load_rows(&paths.hit, chunk);
                surface = [b1, b2];
            }
            let seen = (self.lights).emitted(&self.geometry, lights, tip.p, cos, surface);
            let direct = seen.direct_pdf * L::splat(paths.rivals.direct);
            let emission = seen.emission_pdf * L::splat(paths.rivals.light);
            let weight = tip.partial().weight_hit(direct, emission);
            let all = tip.beta.mul_elem(seen.radiance);
            let rgb = all * (weight * L::splat(factor));
            self.add(paths, chunk, rgb, || all * L::splat(factor));
        }
    }

    /// `s = 0`: adds what the escaped camera rays of `list` see of the environments, `factor` times.
    pub(super) fn escape<L: Lanes>(&self, paths: &mut Paths, list: &[u32], factor: f32) {
        for chunk in list.chunks(L::N) {
            let ray = L::load_rows(&paths.ray, chunk);
            let flight = L::load_rows(&paths.flight, chunk);
            let beta = Vec3::new(flight[0], flight[1], flight[2]);
            // Densities stay over solid angle: nothing was arrived at.
            let partial = Partial {
                d_vcm: flight[3],
                d_vc: flight[4],
            };
            let direction = Vec3::new(ray[4], ray[5], ray[6]);
            // Each environment is a path space of its own, with its own densities.
            for &light in &self.lights.infinite {
                let seen = self.lights.escaped(light, direction);
                let direct = seen.direct_pdf * L::splat(paths.rivals.direct);
                let emission = seen.emission_pdf * L::splat(paths.rivals.light);
                let weight = partial.weight_hit(direct, emission);
                let all = beta.mul_elem(seen.radiance);
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
            let value = &paths.value[0][path as usize].0;
            let rgb = &mut paths.outcome[path as usize].rgb;
            for c in 0..3 {
                // Not a product: what is blocked may be infinite.
                rgb[c] += if visible { value[c] } else { 0.0 };
            }
        }
        if !paths.part.is_empty() {
            for &path in &*lists.trace {
                let visible = paths.blocked[path as usize] == 0;
                let value = paths.value[0][path as usize].0;
                let part = &mut paths.part[path as usize].0;
                for (sum, v) in part.iter_mut().zip(value) {
                    *sum += if visible { v } else { 0.0 };
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
            let tip = paths.tips[0].load::<L>(chunk);
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
            let seen = self.lights.sample_direct(&self.geometry, light, tip.p, u);
            let w = seen.to_light;
            shadow_ray(&mut paths.ray, chunk, tip.offset(w), seen.target);
            store_link(&mut paths.link, chunk, w, L::one());
            let r = seen.radiance;
            let chance = L::one().or_zero(seen.delta.not());
            L::store_rows(
                [
                    r.x,
                    r.y,
                    r.z,
                    seen.pdf,
                    seen.emission_ratio,
                    chance,
                    L::zero(),
                    L::zero(),
                ],
                &mut paths.end,
                chunk,
            );
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
            let tip = paths.tips[1].load::<L>(chunk);
            let lens = if !PINHOLE && self.camera.connects_by_choice() {
                (
                    samples.gather(at.point, chunk),
                    samples.gather(at.point + 1, chunk),
                )
            } else {
                (L::zero(), L::zero())
            };
            let link = self.camera.connect::<L, PINHOLE>(tip.p, lens);
            shadow_ray(
                &mut paths.ray,
                chunk,
                tip.offset(link.to_camera),
                link.origin,
            );
            store_link(&mut paths.link, chunk, -link.to_camera, L::one());
            let zero = L::zero();
            L::store_rows(
                [zero, zero, zero, link.pdf, zero, zero, zero, zero],
                &mut paths.end,
                chunk,
            );
            for (i, &path) in chunk.iter().enumerate() {
                paths.outcome[path as usize].raster =
                    [link.raster.0.lane(i), link.raster.1.lane(i)];
            }
            joined.push_where(chunk, link.valid.bits());
        }
    }

    fn link_tips<L: Lanes>(&self, paths: &mut Paths, list: &[u32], joined: &mut List) {
        for chunk in list.chunks(L::N) {
            let camera = paths.tips[0].load::<L>(chunk);
            let light = paths.tips[1].load::<L>(chunk);
            let v = light.p - camera.p;
            let d2 = v.length2();
            let w = v * (L::one() / d2.sqrt());
            shadow_ray(&mut paths.ray, chunk, camera.offset(w), light.offset(-w));
            store_link(&mut paths.link, chunk, w, d2);
            // Coincident tips have no direction between them and contribute nothing.
            joined.push_where(chunk, d2.gt(L::splat(f32::MIN_POSITIVE)).bits());
        }
    }

    /// Values and densities of one side's BSDF along the link.
    fn evaluate<B: Bsdf, L: Lanes>(&self, paths: &mut Paths, list: &[u32], side: Side) {
        for chunk in list.chunks(L::N) {
            let tip = paths.tips[side as usize].load::<L>(chunk);
            let link = L::load_rows(&paths.link, chunk);
            let w = Vec3::new(link[0], link[1], link[2]);
            let wi = if side == Side::Camera { w } else { -w };
            let mut params = [0u32; 8];
            for (i, slot) in params.iter_mut().enumerate().take(chunk.len()) {
                *slot = tip.params.lane(i).to_bits();
            }
            let row = L::load_rows(&paths.params, &params[..chunk.len()]);
            let value =
                sides::eval::<B, L>(self.sides, &row, &tip.normals(), [tip.wo, wi], side.mode());
            let wi_ng = wi.dot(tip.ng);
            let cos = match side {
                Side::Camera => wi.dot(tip.ns).abs(),
                Side::Light => mis::adjoint_cosine(wi_ng, tip.wo.dot(tip.ns), tip.wo.dot(tip.ng)),
            };
            let f = value.f * cos;
            let zero = L::zero();
            L::store_rows(
                [
                    f.x,
                    f.y,
                    f.z,
                    value.pdf,
                    value.pdf_reverse,
                    wi_ng.abs(),
                    zero,
                    zero,
                ],
                &mut paths.value[side as usize],
                chunk,
            );
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
            let tip = paths.tips[0].load::<L>(chunk);
            let value = L::load_rows(&paths.value[0], chunk);
            let end = L::load_rows(&paths.end, chunk);
            let weight = tip.partial().weight_direct(
                value[3],
                value[4],
                value[5],
                end[3],
                end[4] * L::splat(paths.rivals.light),
                end[5].gt(L::zero()),
            );
            let scale = weight * L::splat(factor) / end[3];
            let f = Vec3::new(value[0], value[1], value[2]);
            let all = tip
                .beta
                .mul_elem(f)
                .mul_elem(Vec3::new(end[0], end[1], end[2]));
            let unweighted = || all * (L::splat(factor) / end[3]);
            self.keep(paths, chunk, all * scale, unweighted, live);
        }
    }

    fn weigh_lens<L: Lanes>(&self, paths: &mut Paths, list: &[u32], factor: f32, live: &mut List) {
        for chunk in list.chunks(L::N) {
            let tip = paths.tips[1].load::<L>(chunk);
            let value = L::load_rows(&paths.value[1], chunk);
            let end = L::load_rows(&paths.end, chunk);
            let camera = end[3] * value[5] * L::splat(paths.rivals.camera);
            let weight = tip.partial().weight_camera(camera, value[4]);
            let f = Vec3::new(value[0], value[1], value[2]);
            let all = tip.beta.mul_elem(f);
            let rgb = all * (end[3] * weight * L::splat(factor));
            let unweighted = || all * (end[3] * L::splat(factor));
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
            let tips = [
                paths.tips[0].load::<L>(chunk),
                paths.tips[1].load::<L>(chunk),
            ];
            let values = [
                L::load_rows(&paths.value[0], chunk),
                L::load_rows(&paths.value[1], chunk),
            ];
            let inv_d2 = L::one() / L::load_rows(&paths.link, chunk)[3];
            let side = |i: usize| mis::Side {
                partial: tips[i].partial(),
                pdf: values[i][3],
                pdf_reverse: values[i][4],
                cos: values[i][5],
            };
            let weight = mis::weight_connect(&side(0), &side(1), inv_d2);
            let f = |i: usize| {
                let v = &values[i];
                tips[i].beta.mul_elem(Vec3::new(v[0], v[1], v[2]))
            };
            let last = chunk.len() - 1;
            let factor = L::from_fn(|i| factors[paths.s[chunk[i.min(last)] as usize] as usize]);
            let all = f(0).mul_elem(f(1));
            let rgb = all * (inv_d2 * weight * factor);
            self.keep(paths, chunk, rgb, || all * (inv_d2 * factor), live);
        }
    }

    /// Parks contributions in `value[0]` until visibility is known; those that are not zero (also if not finite, so that they are counted) stay
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
        L::store_rows(
            [rgb.x, rgb.y, rgb.z, zero, all.x, all.y, all.z, zero],
            &mut paths.value[0],
            list,
        );
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
            let (v, u) = (rgb.lane(i), all.lane(i));
            let part = &mut paths.part[path as usize].0;
            for c in 0..3 {
                part[c] += v[c];
                part[4 + c] += u[c];
            }
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

/// From `o` to `target`: `t = 1` is the target.
#[inline(always)]
fn shadow_ray<L: Lanes>(rays: &mut [Row], list: &[u32], o: Vec3<L>, target: Vec3<L>) {
    let d = target - o;
    L::store_rows(
        [o.x, o.y, o.z, L::one(), d.x, d.y, d.z, L::zero()],
        rays,
        list,
    );
}

#[inline(always)]
fn store_link<L: Lanes>(links: &mut [Row], list: &[u32], w: Vec3<L>, distance2: L) {
    let zero = L::zero();
    L::store_rows(
        [w.x, w.y, w.z, distance2, zero, zero, zero, zero],
        links,
        list,
    );
}
