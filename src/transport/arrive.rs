//! Subpaths have hit surfaces: hits become endpoints, with the BSDFs that they have there.

use super::World;
use super::dispersion::Dispersion;
use super::mis::Partial;
use super::paths::{Endpoints, Parameters, Rays, Side, Subpaths};
use super::probe::{Arrived, Probe};
use super::records::*;
use super::samples::ComponentSamples;
use crate::geometry::Wanted;
use crate::scene::NONE;
use crate::simd::{Lanes, UintLanes};
use crate::surface::bump::{Perturbation, PerturbedFrame};
use crate::surface::texture::Place;
use glam::DVec3;

impl World<'_> {
    /// The subpaths of `list` have hit surfaces: makes the hits their endpoints. Parameter rows of
    /// their own go to the slot `slot`: the vertex number where all vertices are kept
    /// (bidirectional evaluations), else 0. Of mixtures `component` chooses components.
    pub(super) fn arrive<L: Lanes>(
        &self,
        rays: &Rays,
        list: &[u32],
        (subpaths, dispersion): (&mut Subpaths, &mut Dispersion),
        (side, slot): (Side, usize),
        component: ComponentSamples,
        probe: &mut impl Probe,
    ) {
        let at = (side, slot);
        let (whole, mut parted) = (list, Default::default());
        let mut list = list;
        if self.plan.media {
            parted = std::mem::take(&mut subpaths.parted);
            self.part(&rays.hit, list, &mut parted);
            list = &parted[0];
            let (flights, endpoints) = (&subpaths.flight, &mut subpaths.endpoints[side as usize]);
            self.arrive_in_media::<L>(rays, &parted[1], flights, endpoints);
        }
        match (self.materials.own_rows, self.wanted.any()) {
            (false, false) => self.arrive_at::<L, false, false>(rays, list, subpaths, at),
            (false, true) => self.arrive_at::<L, false, true>(rays, list, subpaths, at),
            (true, false) => self.arrive_at::<L, true, false>(rays, list, subpaths, at),
            (true, true) => self.arrive_at::<L, true, true>(rays, list, subpaths, at),
        }
        let endpoints = &mut subpaths.endpoints[side as usize];
        if self.plan.media {
            self.surround(&rays.hit, &subpaths.flight, whole, endpoints);
        }
        let parameters = &mut subpaths.parameters;
        if self.plan.mixtures {
            self.choose_components(endpoints, parameters, at, component);
        }
        // `arrive_at` has asked for their texels (`prefetch_texels`), which had time to come.
        for &(path, material, uv) in &parameters.textured {
            let place = self.place(endpoints, path, uv);
            let row = parameters.own(slot, side, path) as usize;
            let nm = dispersion.nm(path as usize);
            parameters.rows[row] = self.materials.evaluate(material as usize, &place, nm);
        }
        if self.plan.subsurface {
            for &(path, material, uv) in &parameters.textured {
                let place = self.place(endpoints, path, uv);
                let below = self.materials.bssrdf(material as usize, &place);
                subpaths.below.note(path, below);
            }
        }
        if self.plan.bumps {
            self.perturb(&rays.hit, &parameters.textured, endpoints, probe);
        }
        if self.plan.dispersion {
            let dispersive = |material: u32| self.materials.entries[material as usize].dispersive;
            let textured = parameters.textured.iter();
            dispersion.note(whole, side, textured.map(|t| (t.0, dispersive(t.1))));
        }
        let arrived = Arrived {
            side,
            hits: &rays.hit,
            endpoints,
            parameters,
        };
        probe.arrived(list, &arrived);
        parameters.textured.clear();
        subpaths.parted = parted;
    }

    /// Where a path's endpoint is, as textures see it.
    #[inline(always)]
    fn place(&self, endpoints: &Endpoints, path: u32, uv: [f32; 2]) -> Place {
        let mut place = Place {
            uv,
            ..Place::default()
        };
        if self.materials.uses_point {
            place.p = endpoints.place[path as usize].p;
            place.n = endpoints.frame[path as usize].ng;
        }
        place
    }

    /// Chooses among the components of the mixtures that have been arrived at; the endpoints are as
    /// if of that component alone.
    fn choose_components(
        &self,
        endpoints: &mut Endpoints,
        parameters: &mut Parameters,
        (side, slot): (Side, usize),
        component: ComponentSamples,
    ) {
        let mixed = std::mem::take(&mut parameters.mixed);
        for &(path, material, uv) in &mixed {
            let sample = component.sample(path);
            let place = self.place(endpoints, path, uv);
            let chosen = (self.materials).choose(material as usize, &place, sample.unwrap_or(0.0));
            let entry = self.materials.entries[chosen.material as usize];
            let mut row = chosen.material;
            if entry.per_hit {
                row = parameters.own(slot, side, path);
                parameters.textured.push((path, chosen.material, uv));
            }
            endpoints.kind[path as usize] = entry.kind;
            endpoints.frame[path as usize].params = row;
            if sample.is_some() {
                parameters.shares.push((path, chosen.share));
            }
        }
        parameters.mixed = mixed;
        parameters.mixed.clear();
    }

    /// Multiplies the throughput of endpoints by the shares of the components that they are of
    /// ([`mixture`](crate::surface::mixture)): for what they scatter, not for what they emit.
    pub(super) fn weigh_components(&self, subpaths: &mut Subpaths, side: Side) {
        if !self.plan.mixtures {
            return;
        }
        for (path, share) in subpaths.parameters.shares.drain(..) {
            let energy = &mut subpaths.endpoints[side as usize].energy[path as usize];
            for c in 0..3 {
                energy.beta[c] *= share[c];
            }
        }
    }

    /// Stores the endpoints of `list`; those of mixtures, if there are any, are left in
    /// `parameters.mixed`. Without `OWN` no hit has a row of its own and there are no mixtures,
    /// without `MORE` nothing but places and geometric normals of triangles is wanted: loops that
    /// all hits go through do not ask.
    fn arrive_at<L: Lanes, const OWN: bool, const MORE: bool>(
        &self,
        rays: &Rays,
        list: &[u32],
        subpaths: &mut Subpaths,
        (side, slot): (Side, usize),
    ) {
        let Subpaths {
            flight: flights,
            endpoints,
            parameters,
            ..
        } = subpaths;
        let endpoints = &mut endpoints[side as usize];
        for chunk in list.chunks(L::N) {
            let ray = RayLanes::<L>::load(&rays.ray, chunk);
            let hit = HitLanes::<L>::load(&rays.hit, chunk);
            let flight = FlightLanes::<L>::load(flights, chunk);
            let mut prim = [0u32; 8];
            for (prim, &path) in prim.iter_mut().zip(chunk) {
                *prim = rays.hit[path as usize].primitive;
            }
            let mut instance = [NONE; 8];
            if MORE && self.wanted.instances {
                for (instance, &path) in instance.iter_mut().zip(chunk) {
                    *instance = rays.hit[path as usize].instance;
                }
            }
            let point = self.geometry.surface_point(
                (&prim[..chunk.len()], &instance[..chunk.len()]),
                ray.origin,
                ray.direction,
                [hit.t, hit.b[0], hit.b[1]],
                if MORE { self.wanted } else { Wanted::default() },
            );
            let distant = flight.distant.gt(L::zero());
            let distance2 = L::select(distant, L::one(), hit.t * hit.t);
            let cos = ray.direction.dot(point.ng).abs();
            let partial = Partial {
                d_vcm: flight.d_vcm,
                d_vc: flight.d_vc,
            }
            .arrive(distance2, cos);
            let (mut params, mut lights) = ([0u32; 8], [0u32; 8]);
            for (i, &path) in chunk.iter().enumerate() {
                let (shape, light) = self.geometry.shape_of(prim[i]);
                lights[i] = light;
                let entry = self.materials.entries[shape.material as usize];
                endpoints.kind[path as usize] = entry.kind;
                params[i] = shape.material;
                if OWN && (entry.per_hit || entry.mixture) {
                    let uv = [point.uv[0].lane(i), point.uv[1].lane(i)];
                    let mut place = Place {
                        uv,
                        ..Place::default()
                    };
                    if self.materials.uses_point {
                        place.p = point.p.lane(i);
                        place.n = point.ng.lane(i);
                    }
                    self.materials
                        .prefetch_texels(shape.material as usize, &place);
                    if entry.mixture {
                        parameters.mixed.push((path, shape.material, uv));
                    } else {
                        params[i] = parameters.own(slot, side, path);
                        parameters.textured.push((path, shape.material, uv));
                    }
                }
            }
            let wide = |v: &[u32; 8]| L::Uint::from_fn(|i| v[i]);
            EndpointPlaceLanes {
                p: point.p,
                error: point.error,
                wo: -ray.direction,
                d_vcm: partial.d_vcm,
            }
            .store(&mut endpoints.place, chunk);
            EndpointFrameLanes {
                ng: point.ng,
                params: wide(&params),
                ns: point.ns,
                d_vc: partial.d_vc,
            }
            .store(&mut endpoints.frame, chunk);
            EndpointEnergyLanes {
                beta: flight.beta,
                primitive: wide(&prim),
                tangent: point.tangent,
                light: wide(&lights),
            }
            .store(&mut endpoints.energy, chunk);
        }
    }

    /// Tilts the shading frames of those textured endpoints that have a bump or normal map.
    fn perturb(
        &self,
        hits: &[Hit],
        textured: &[(u32, u32, [f32; 2])],
        endpoints: &mut Endpoints,
        probe: &mut impl Probe,
    ) {
        for &(path, material, uv) in textured {
            if !self.materials.is_bumped(material as usize) {
                continue;
            }
            let index = path as usize;
            let energy = &mut endpoints.energy[index];
            let frame = &mut endpoints.frame[index];
            let place = Place {
                uv,
                p: endpoints.place[index].p,
                n: frame.ng,
            };
            let hit = &hits[index];
            let of = (energy.primitive, hit.instance);
            let (perturbation, ns, tangent) =
                self.shading_at(material as usize, of, hit.b, &place, frame.ns);
            frame.ns = ns;
            energy.tangent = tangent;
            probe.perturbed(path, &perturbation);
        }
    }

    /// What the bump or normal map of a material says at a hit, and the shading normal and tangent
    /// that follow; `place.n` is the geometric normal towards the front, `ns` the shading
    /// normal of the surface.
    fn shading_at(
        &self,
        material: usize,
        of: (u32, u32),
        b: [f32; 2],
        place: &Place,
        ns: [f32; 3],
    ) -> (Option<Perturbation>, [f32; 3], [f32; 3]) {
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let (p, ng, ns) = (wide(place.p), wide(place.n), wide(ns));
        let d = self.geometry.derivatives(of, b.map(f64::from), p);
        let perturbation = self.materials.perturbation(material, place, &d, ns);
        let perturbed =
            perturbation.and_then(|r| self.materials.perturb(material, &r, &d, [ns, ng]));
        let PerturbedFrame { ns, tangent } = perturbed.unwrap_or(PerturbedFrame {
            ns,
            tangent: d.dpdu,
        });
        let narrow = |v: DVec3| v.as_vec3().to_array();
        (perturbation, narrow(ns), narrow(tangent))
    }
}
