//! Subpaths on their way: start at the camera or a light, trace a wave, arrive at surfaces, scatter.

use super::World;
use super::clock::Stage;
use super::list::List;
use super::mis::{self, Partial};
use super::paths::{Paths, Side, Tips};
use super::samples::Samples;
use super::sides::{self, Sampled};
use crate::BARE;
use crate::geometry::Wanted;
use crate::simd::{Lanes, Mask, Row, Vec3};
use crate::surface::Bsdf;
use crate::surface::bump::{Relief, Tilted};
use crate::surface::texture::Place;
use glam::DVec3;

/// Where the primary samples of a bounce are.
#[derive(Clone, Copy)]
pub(super) struct Bounce {
    /// First dimension.
    pub first: usize,
    /// Light subpaths start in different waves: dimensions a path is further for every wave since its start. 0 if all are
    /// at `first`.
    pub per_bounce: usize,
    pub wave: u32,
}

impl Bounce {
    /// All paths have theirs at `first`.
    pub fn at(first: usize) -> Self {
        Self {
            first,
            per_bounce: 0,
            wave: 0,
        }
    }

    #[inline(always)]
    fn dimension(&self, paths: &Paths, path: u32) -> usize {
        if self.per_bounce == 0 {
            return self.first;
        }
        // A light subpath starts when its camera subpath has spent its `t - 1` rays.
        self.first + (self.wave + 1 - paths.t[path as usize]) as usize * self.per_bounce
    }
}

impl World<'_> {
    /// Starts the camera subpaths of `list` at raster positions; `raster` is the first dimension of the raster samples, `lens` of the lens
    /// samples. `one_strategy` says that no strategy joins light tips to the camera.
    pub(super) fn start_camera<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        (raster, lens): (usize, usize),
        one_strategy: bool,
    ) {
        if self.camera.is_pinhole() {
            self.start_camera_by::<L, true>(paths, samples, list, (raster, lens), one_strategy);
        } else {
            self.start_camera_by::<L, false>(paths, samples, list, (raster, lens), one_strategy);
        }
    }

    fn start_camera_by<L: Lanes, const PINHOLE: bool>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        (raster, lens): (usize, usize),
        one_strategy: bool,
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
            let d_vcm = if one_strategy {
                L::zero()
            } else {
                L::one() / ray.pdf
            };
            let distant = L::splat(f32::from(u8::from(!PINHOLE && self.camera.is_parallel())));
            store_ray(&mut paths.ray, chunk, ray.origin, ray.direction);
            let (zero, one) = (L::zero(), L::one());
            L::store_rows(
                [one, one, one, d_vcm, zero, distant, zero, zero],
                &mut paths.flight,
                chunk,
            );
            for (i, &path) in chunk.iter().enumerate() {
                paths.outcome[path as usize].raster = [x.lane(i), y.lane(i)];
            }
        }
    }

    /// Starts the light subpaths of `list`; those that leave their light are appended to `started`.
    pub(super) fn start_light<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        (choice, emission): (usize, usize),
        started: &mut List,
    ) {
        for chunk in list.chunks(L::N) {
            let light = if !BARE && self.plan.light_choice {
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
            store_ray(&mut paths.ray, chunk, ray.origin, ray.direction);
            let distant = L::one().or_zero(ray.distant);
            let b = ray.beta;
            L::store_rows(
                [
                    b.x,
                    b.y,
                    b.z,
                    ray.d_vcm,
                    ray.d_vc,
                    distant,
                    L::zero(),
                    L::zero(),
                ],
                &mut paths.flight,
                chunk,
            );
            let emits = self.emits(&light[..chunk.len()], [u[0], u[1]]);
            started.push_where(chunk, ray.valid.bits() & emits);
        }
    }

    /// Traces the rays of `list`.
    pub(super) fn trace<L: Lanes>(&self, paths: &mut Paths, list: &[u32]) {
        paths.rays += list.len() as u64;
        paths.sorter.sort(&paths.ray, list);
        paths.clock.lap(Stage::Sort);
        let sorted = paths.sorter.sorted();
        paths.rays += self.closest::<L>(&paths.ray, sorted, &mut paths.hit, &mut paths.through);
        paths.clock.count(Stage::Trace, list.len(), L::N);
        paths.clock.lap(Stage::Trace);
    }

    /// The subpaths of `list` have hit surfaces: makes the hits their tips. Of mixtures the samples at `label` choose components; without,
    /// the tips must not scatter.
    pub(super) fn arrive<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        side: Side,
        (samples, label): (&Samples, Option<Bounce>),
    ) {
        match (self.materials.own_rows, self.wanted.any()) {
            (false, false) => self.arrive_at::<L, false, false>(paths, list, side),
            (false, true) => self.arrive_at::<L, false, true>(paths, list, side),
            (true, false) => self.arrive_at::<L, true, false>(paths, list, side),
            (true, true) => self.arrive_at::<L, true, true>(paths, list, side),
        }
        if self.plan.mixtures {
            self.choose_components(paths, side, samples, label);
        }
        // Texels have been asked for, and have had time to come.
        for &(path, material, uv) in &paths.textured {
            let place = self.place(&paths.tips[side as usize], path, uv);
            let row = paths.own_params(side, path) as usize;
            let nm = paths.dispersion.nm(path as usize);
            paths.params[row] = self.materials.evaluate(material as usize, &place, nm);
        }
        if self.plan.bumps {
            self.tilt(paths, side);
        }
        if self.plan.dispersion {
            self.note_dispersive(paths, list, side);
        }
        paths.textured.clear();
        paths.clock.count(Stage::Surface, list.len(), L::N);
        paths.clock.lap(Stage::Surface);
    }

    /// Where a path's tip is, as textures see it.
    #[inline(always)]
    fn place(&self, tips: &Tips, path: u32, uv: [f32; 2]) -> Place {
        let mut place = Place {
            uv,
            ..Place::default()
        };
        if self.materials.uses_point {
            place.p.copy_from_slice(&tips.place[path as usize].0[..3]);
            place.n.copy_from_slice(&tips.frame[path as usize].0[..3]);
        }
        place
    }

    /// Chooses among the components of the mixtures that have been arrived at; the tips are as if of that component alone.
    fn choose_components(
        &self,
        paths: &mut Paths,
        side: Side,
        samples: &Samples,
        label: Option<Bounce>,
    ) {
        let mixed = std::mem::take(&mut paths.mixed);
        for &(path, material, uv) in &mixed {
            let sample = |at: Bounce| samples.row(at.dimension(paths, path))[path as usize];
            let u = label.map_or(0.0, sample);
            let place = self.place(&paths.tips[side as usize], path, uv);
            let chosen = self.materials.choose(material as usize, &place, u);
            let entry = self.materials.entries[chosen.material as usize];
            let mut row = chosen.material;
            if entry.per_hit {
                row = paths.own_params(side, path);
                paths.textured.push((path, chosen.material, uv));
            }
            let tips = &mut paths.tips[side as usize];
            tips.kind[path as usize] = entry.kind;
            tips.frame[path as usize].0[3] = f32::from_bits(row);
            if label.is_some() {
                paths.shares.push((path, chosen.share));
            }
        }
        paths.mixed = mixed;
        paths.mixed.clear();
    }

    /// Multiplies the throughput of tips by the shares of the components that they are of ([`mixture`](crate::surface::mixture)): for what
    /// they scatter, not for what they emit.
    pub(super) fn weigh_components(&self, paths: &mut Paths, side: Side) {
        if !self.plan.mixtures {
            return;
        }
        for (path, share) in paths.shares.drain(..) {
            let energy = &mut paths.tips[side as usize].energy[path as usize].0;
            for c in 0..3 {
                energy[c] *= share[c];
            }
        }
    }

    /// Stores the tips of `list`; those of mixtures, if there are any, are left in `paths.mixed`. Without `OWN` no hit has a row of its own
    /// and there are no mixtures, without `MORE` nothing but places and geometric normals of triangles is wanted: loops that all hits go
    /// through do not ask.
    fn arrive_at<L: Lanes, const OWN: bool, const MORE: bool>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        side: Side,
    ) {
        for chunk in list.chunks(L::N) {
            let ray = L::load_rows(&paths.ray, chunk);
            let hit = L::load_rows(&paths.hit, chunk);
            let flight = L::load_rows(&paths.flight, chunk);
            let mut prim = [0u32; 8];
            for (slot, &path) in prim.iter_mut().zip(chunk) {
                *slot = paths.hit[path as usize].0[3].to_bits();
            }
            let origin = Vec3::new(ray[0], ray[1], ray[2]);
            let direction = Vec3::new(ray[4], ray[5], ray[6]);
            let [t, b1, b2, ..] = hit;
            let point = self.geometry.surface_point(
                &prim[..chunk.len()],
                origin,
                direction,
                [t, b1, b2],
                if MORE { self.wanted } else { Wanted::default() },
            );
            let distant = flight[5].gt(L::zero());
            let distance2 = L::select(distant, L::one(), t * t);
            let cos = direction.dot(point.ng).abs();
            let partial = Partial {
                d_vcm: flight[3],
                d_vc: flight[4],
            }
            .arrive(distance2, cos);
            let (mut params, mut lights) = ([0u32; 8], [0u32; 8]);
            for (i, &path) in chunk.iter().enumerate() {
                let (shape, light) = self.geometry.shape_of(prim[i]);
                lights[i] = light;
                let entry = self.materials.entries[shape.material as usize];
                paths.tips[side as usize].kind[path as usize] = entry.kind;
                params[i] = shape.material;
                if OWN && !BARE && (entry.per_hit || entry.mixture) {
                    let uv = [point.uv[0].lane(i), point.uv[1].lane(i)];
                    let mut place = Place {
                        uv,
                        ..Place::default()
                    };
                    if self.materials.uses_point {
                        place.p = point.p.lane(i);
                        place.n = point.ng.lane(i);
                    }
                    self.materials.announce(shape.material as usize, &place);
                    if entry.mixture {
                        paths.mixed.push((path, shape.material, uv));
                    } else {
                        params[i] = paths.own_params(side, path);
                        paths.textured.push((path, shape.material, uv));
                    }
                }
            }
            let bits = |v: &[u32; 8]| L::from_fn(|i| f32::from_bits(v[i]));
            let tips = &mut paths.tips[side as usize];
            let (p, wo) = (point.p, -direction);
            L::store_rows(
                [p.x, p.y, p.z, point.error, wo.x, wo.y, wo.z, partial.d_vcm],
                &mut tips.place,
                chunk,
            );
            let (ng, ns) = (point.ng, point.ns);
            L::store_rows(
                [
                    ng.x,
                    ng.y,
                    ng.z,
                    bits(&params),
                    ns.x,
                    ns.y,
                    ns.z,
                    partial.d_vc,
                ],
                &mut tips.frame,
                chunk,
            );
            let tangent = point.tangent;
            L::store_rows(
                [
                    flight[0],
                    flight[1],
                    flight[2],
                    bits(&prim),
                    tangent.x,
                    tangent.y,
                    tangent.z,
                    bits(&lights),
                ],
                &mut tips.energy,
                chunk,
            );
        }
    }

    /// Tilts the shading frames of those textured tips that have a bump or normal map.
    fn tilt(&self, paths: &mut Paths, side: Side) {
        let tips = &mut paths.tips[side as usize];
        for &(path, material, uv) in &paths.textured {
            if !self.materials.is_bumped(material as usize) {
                continue;
            }
            let path = path as usize;
            let [x, y, z, ..] = tips.place[path].0;
            let [nx, ny, nz, _, sx, sy, sz, _] = tips.frame[path].0;
            let [_, b1, b2, ..] = paths.hit[path].0;
            let primitive = tips.energy[path].0[3].to_bits();
            let place = Place {
                uv,
                p: [x, y, z],
                n: [nx, ny, nz],
            };
            let (_, ns, tangent) =
                self.shading_at(material as usize, primitive, [b1, b2], &place, [sx, sy, sz]);
            tips.frame[path].0[4..7].copy_from_slice(&ns);
            tips.energy[path].0[4..7].copy_from_slice(&tangent);
        }
    }

    /// What the bump or normal map of a material says at a hit, and the shading normal and tangent that follow; `place.n` is the geometric normal
    /// towards the front, `ns` the shading normal of the surface.
    pub fn shading_at(
        &self,
        material: usize,
        primitive: u32,
        b: [f32; 2],
        place: &Place,
        ns: [f32; 3],
    ) -> (Option<Relief>, [f32; 3], [f32; 3]) {
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let (p, ng, ns) = (wide(place.p), wide(place.n), wide(ns));
        let d = self.geometry.derivatives(primitive, b.map(f64::from), p);
        let relief = self.materials.relief(material, place, &d, ns);
        let tilted = relief.and_then(|r| self.materials.tilt(material, &r, &d, [ns, ng]));
        let Tilted { ns, tangent } = tilted.unwrap_or(Tilted {
            ns,
            tangent: d.dpdu,
        });
        let narrow = |v: DVec3| v.as_vec3().to_array();
        (relief, narrow(ns), narrow(tangent))
    }

    /// Sorts `list` into the queues of its tips' BSDF kinds.
    pub(super) fn queue(&self, paths: &Paths, list: &[u32], side: Side, queues: &mut [List]) {
        if let [kind] = self.plan.kinds[..] {
            queues[kind as usize].clear();
            queues[kind as usize].extend(list);
            return;
        }
        for &kind in &self.plan.kinds {
            queues[kind as usize].clear();
        }
        let kinds = &paths.tips[side as usize].kind;
        for &path in list {
            queues[kinds[path as usize] as usize].push(path);
        }
    }

    /// Scatters the tips of `list`, all of one BSDF; survivors are appended to `alive` with a new ray and flight record.
    pub(super) fn scatter<B: Bsdf, L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        list: &[u32],
        side: Side,
        bounce: Bounce,
        alive: &mut List,
    ) {
        let mode = side.mode();
        for chunk in list.chunks(L::N) {
            let tip = paths.tips[side as usize].load::<L>(chunk);
            let mut params = [0u32; 8];
            for (i, slot) in params.iter_mut().enumerate().take(chunk.len()) {
                *slot = tip.params.lane(i).to_bits();
            }
            let row = L::load_rows(&paths.params, &params[..chunk.len()]);
            let mut first = [0usize; 8];
            for (slot, &path) in first.iter_mut().zip(chunk) {
                *slot = bounce.dimension(paths, path);
            }
            let mut u = [L::zero(); 3];
            for (c, u) in u.iter_mut().enumerate() {
                if c < 2 || B::LOBES {
                    *u = samples.gather_each(&first, c, chunk);
                }
            }
            let Sampled { wi, sample, valid } =
                sides::sample::<B, L>(self.sides, &row, &tip.normals(), tip.wo, u, mode);
            let wi_ng = wi.dot(tip.ng);
            let cos_out = wi_ng.abs();
            let mut beta = tip.beta.mul_elem(sample.weight);
            if side == Side::Light {
                // Weight and density are made of the local cosine, which has to cancel: of a grazing direction the dot product is another number.
                // Where the normals are one, it is the other cosine of the correction that cancels.
                let shading = wi.dot(tip.ns).abs();
                let cos = L::select(shading.eq(cos_out), shading, sample.wi.z.abs());
                let adjoint =
                    mis::adjoint_cosine(wi_ng, tip.wo.dot(tip.ns), tip.wo.dot(tip.ng)) / cos;
                beta = beta * adjoint.or_zero(cos.gt(L::zero()));
            }
            let partial = Partial {
                d_vcm: tip.d_vcm,
                d_vc: tip.d_vc,
            }
            .scatter(cos_out, sample.pdf, sample.pdf_reverse, B::DELTA);
            store_ray(&mut paths.ray, chunk, tip.offset(wi), wi);
            let (zero, b) = (L::zero(), beta);
            L::store_rows(
                [b.x, b.y, b.z, partial.d_vcm, partial.d_vc, zero, zero, zero],
                &mut paths.flight,
                chunk,
            );
            let lit = b.x.max(b.y).max(b.z).gt(L::zero());
            alive.push_where(chunk, valid.and(lit).bits());
        }
    }
}

/// Rays without an end: `tmax` infinite.
#[inline(always)]
fn store_ray<L: Lanes>(rays: &mut [Row], list: &[u32], o: Vec3<L>, d: Vec3<L>) {
    let far = L::splat(f32::INFINITY);
    L::store_rows([o.x, o.y, o.z, far, d.x, d.y, d.z, L::zero()], rays, list);
}
