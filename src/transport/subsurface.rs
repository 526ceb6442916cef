//! Light below surfaces: a camera subpath that is refracted where a medium is below the surface
//! comes out of the same material elsewhere, and goes on from there
//! ([`Bssrdf`](crate::surface::Bssrdf); pbrt, 3rd edition, section 15.4).
//!
//! Three primary samples say where. One chooses an axis (the shading normal, or one of two in the
//! surface) and a channel; two, a distance and an azimuth around the axis. The *probe*, a segment
//! parallel to the axis, goes through everything, and meets surfaces of the material any number of
//! times. It is traced again from where it met something, all probes of a batch together, until
//! none is left; of so many hits one stays, chosen by what is left of the first sample as they come
//! (each takes the place of the one before with probability one over its number). So there is
//! nothing to be stored, and no hit is left out however many there are. A probe that meets more
//! surfaces than the scene has goes round in circles of rounding errors, and ends.
//!
//! The density of a point is that of all axes and channels together. As in pbrt profiles are cut
//! off at the radius within which they have 99.9 % of their light.
//!
//! Where light comes out is an endpoint as any other, of a kind of its own
//! ([`Exit`](crate::surface::subsurface::Exit)): it is joined to a light, and scatters. Nothing
//! else could be joined through the surface: all such paths are made by the camera's subpath.

use super::World;
use super::below::{Below, Place, Walk, wide};
use super::clock::{Clock, Stage};
use super::list::List;
use super::paths::{Lists, Paths, Rays, Side};
use super::records::*;
use super::samples::{Bounce, ConnectionSamples, Samples};
use super::weigh::StrategyMask;
use crate::geometry::{SurfacePoint, Wanted};
use crate::plan::BELOW_RADIUS;
use crate::scene::{NONE, Sides};
use crate::simd::{Lanes, Row, Vec3};
use crate::surface::subsurface::Exit;
use crate::surface::{Bssrdf, Kind};
use crate::trace::offset;

/// Where the primary samples of a vertex are.
pub(super) struct BelowSamples {
    /// Three, of the probe.
    pub probe: usize,
    /// Of the direction in which light comes out.
    pub bounce: Bounce,
    /// Of the light that it is joined to there.
    pub connection: ConnectionSamples,
}

impl World<'_> {
    /// The subpaths in `lists.camera` have scattered: those that have been refracted into something
    /// come out of it, are joined to lights there and scatter again. The list is left with all that
    /// go on.
    pub(super) fn go_below<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        at: BelowSamples,
    ) {
        let mut below = std::mem::take(&mut paths.subpaths.below);
        self.start_probes(paths, samples, &lists.camera, at.probe, &mut below);
        self.trace_probes::<L>(&mut paths.rays, &mut below, &mut paths.clock);
        lists.direct.clear();
        self.come_out(paths, &below, &mut lists.direct);
        lists.camera.clear();
        lists.camera.extend(&lists.direct);
        if !self.plan.connectable {
            lists.direct.clear();
        }
        let weighing = (StrategyMask::UNIDIRECTIONAL, &[1.0; 2][..]);
        self.connect::<L>(paths, samples, lists, at.connection, weighing, &mut ());
        self.scatter_queues::<L, ()>(paths, samples, lists, Side::Camera, at.bounce, &mut ());
        lists.camera.extend(&below.stay);
        paths.subpaths.below = below;
    }

    /// What is below the endpoint of a path, if anything is.
    fn bssrdf_of<'a>(&'a self, below: &'a Below, path: u32, material: u32) -> Option<&'a Bssrdf> {
        match self.materials.entries[material as usize].per_hit {
            true => below.bssrdfs[path as usize].as_ref(),
            false => self.materials.even_bssrdf(material as usize),
        }
    }

    /// The material below whose surface a subpath has been refracted.
    fn entered(&self, paths: &Paths, path: usize) -> Option<u32> {
        let end = &paths.subpaths.endpoints[0];
        let primitive = end.energy[path].primitive;
        if primitive == NONE {
            return None;
        }
        let material = self.geometry.shape_of(primitive).0.material;
        if !self.materials.entries[material as usize].subsurface {
            return None;
        }
        let frame = &end.frame[path];
        // As lobes were told apart: see `sides`.
        let geometric = self.sides == Some(Sides::Geometric) && !end.kind[path].is_delta();
        let n = wide(if geometric { frame.ng } else { frame.ns });
        let [wo, wi] = [end.place[path].wo, paths.rays.ray[path].direction].map(wide);
        (n.dot(wo) * n.dot(wi) < 0.0).then_some(material)
    }

    /// Parts the subpaths of `list`, and makes the probes of those that go in.
    fn start_probes(
        &self,
        paths: &Paths,
        samples: &Samples,
        list: &[u32],
        at: usize,
        below: &mut Below,
    ) {
        below.enter.clear();
        below.stay.clear();
        for &path in list {
            let i = path as usize;
            let Some(material) = self.entered(paths, i) else {
                below.stay.push(path);
                continue;
            };
            let Some(bssrdf) = self.bssrdf_of(below, path, material) else {
                continue;
            };
            let sample = |d: usize| f64::from(samples.row(at + d)[i]);
            let end = &paths.subpaths.endpoints[0];
            let n = wide(end.frame[i].ns);
            let (s, t) = n.any_orthonormal_pair();
            let mut walk = Walk {
                from: wide(end.place[i].p),
                axes: [s, t, n],
                material,
                ..Walk::default()
            };
            let place = [sample(BELOW_RADIUS), sample(BELOW_RADIUS + 1)];
            if let Some(probe) = walk.start(bssrdf, sample(0), place) {
                below.walks[i] = walk;
                below.probes[i] = probe;
                below.enter.push(path);
            }
        }
    }

    /// Follows all probes to their ends.
    fn trace_probes<L: Lanes>(&self, rays: &mut Rays, below: &mut Below, clock: &mut Clock) {
        let Below {
            walks,
            probes,
            enter,
            left,
            next,
            ..
        } = below;
        left.clear();
        left.extend(enter);
        for _ in 0..self.most_layers() {
            if left.is_empty() {
                break;
            }
            rays.traced += left.len() as u64;
            rays.traced += self.closest::<L>(probes, left, &mut rays.hit, &mut rays.through);
            next.clear();
            for &path in &**left {
                let i = path as usize;
                let hit = &rays.hit[i];
                if hit.is_none() {
                    continue;
                }
                let point = self.probed_point(&probes[i], hit);
                let walk = &mut walks[i];
                if self.geometry.shape_of(hit.primitive).0.material == walk.material {
                    walk.meet(&point, hit.primitive);
                }
                let d = Vec3::<f32>::splat(probes[i].direction);
                let origin = offset::leave(point.p, point.error, point.ng, d).lane(0);
                let rest = walk.end - wide(origin);
                if rest.dot(wide(probes[i].direction)) > 0.0 {
                    probes[i] = Ray::new(origin, 1.0, rest.as_vec3().to_array());
                    next.push(path);
                }
            }
            std::mem::swap(left, next);
        }
        clock.finish(Stage::Trace, enter.len(), L::N);
    }

    fn probed_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint<f32> {
        let wanted = Wanted {
            uv: false,
            tangent: false,
            ..self.wanted
        };
        let of: (&[u32], &[u32]) = (&[hit.primitive], &[hit.instance]);
        let [o, d] = [ray.origin, ray.direction].map(Vec3::<f32>::splat);
        let at = [hit.t, hit.b[0], hit.b[1]];
        self.geometry.surface_point(of, o, d, at, wanted)
    }

    /// Makes the chosen hits the endpoints of the subpaths that have been refracted; those that
    /// carry anything are appended to `list`.
    fn come_out(&self, paths: &mut Paths, below: &Below, list: &mut List) {
        for &path in &*below.enter {
            let i = path as usize;
            let walk = &below.walks[i];
            let Some(bssrdf) = self.bssrdf_of(below, path, walk.material) else {
                continue;
            };
            let weight = walk.weight(bssrdf);
            let flight = &paths.subpaths.flight[i];
            let beta = [0, 1, 2].map(|c| (f64::from(flight.beta[c]) * weight[c]) as f32);
            if !beta.iter().any(|b| *b > 0.0) {
                continue;
            }
            let Place {
                p,
                error,
                ng,
                ns,
                primitive,
            } = walk.chosen;
            let params = paths.subpaths.parameters.own(0, Side::Camera, path);
            paths.subpaths.parameters.rows[params as usize] = Row(Exit::row(bssrdf.eta));
            let end = &mut paths.subpaths.endpoints[0];
            // Seen from outside, from everywhere alike.
            let wo = ns;
            // No strategy is further back.
            let (d_vcm, d_vc) = (0.0, 0.0);
            end.place[i] = EndpointPlace {
                p,
                error,
                wo,
                d_vcm,
            };
            end.frame[i] = EndpointFrame {
                ng,
                params,
                ns,
                d_vc,
            };
            end.energy[i] = EndpointEnergy {
                beta,
                primitive,
                tangent: [0.0; 3],
                light: NONE,
            };
            end.kind[i] = Kind::SubsurfaceExit;
            if self.plan.media {
                let boundary = self.geometry.shape_of(primitive).0.boundary;
                end.media[i] = match boundary {
                    NONE => [flight.medium; 2],
                    _ => self.media.media.boundaries[boundary as usize],
                };
            }
            list.push(path);
        }
    }
}
