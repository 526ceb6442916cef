//! Places in media as endpoints of subpaths, and the media around endpoints of any kind.

use super::super::World;
use super::super::list::List;
use super::super::mis::Partial;
use super::super::paths::{Endpoints, Rays};
use super::super::records::*;
use super::IN_MEDIUM;
use crate::scene::NONE;
use crate::simd::{Lanes, UintLanes, Vec3};
use crate::surface::Kind;

impl World<'_> {
    /// The media that light subpaths start in.
    pub(in crate::transport) fn start_in_media(
        &self,
        lights: &[u32],
        list: &[u32],
        flights: &mut [Flight],
        rays: &[Ray],
    ) {
        for (&light, &path) in lights.iter().zip(list) {
            let i = path as usize;
            let sides = self.media.media.lights.get(light as usize);
            let [front, back] = sides.copied().unwrap_or([NONE; 2]);
            let behind = || self.leaves_back(light, &rays[i]);
            flights[i].medium = if front != back && behind() {
                back
            } else {
                front
            };
        }
    }

    /// Whether a ray leaves the back of the surface that a light is.
    fn leaves_back(&self, light: u32, ray: &Ray) -> bool {
        let primitive = self.lights.primitive(&self.geometry, light);
        if primitive == NONE {
            return false;
        }
        // Any point of a triangle will do, and of a sphere the one where the ray starts.
        let at = [0.0, 1.0 / 3.0, 1.0 / 3.0];
        let origin = Vec3::<f32>::splat(ray.origin);
        let point = (self.geometry).surface_point(
            (&[primitive], &[NONE]),
            origin,
            Vec3::zero(),
            at,
            self.border_wanted(),
        );
        Vec3::<f32>::splat(ray.direction).dot(point.ng) <= 0.0
    }

    /// Parts the subpaths of `list` into those that have hit surfaces and those in media.
    pub(in crate::transport) fn part(
        &self,
        hits: &[Hit],
        list: &[u32],
        [surfaces, media]: &mut [List; 2],
    ) {
        surfaces.reserve(list.len());
        media.reserve(list.len());
        surfaces.clear();
        media.clear();
        for &path in list {
            let is_in = hits[path as usize].primitive == IN_MEDIUM;
            surfaces.push_if(path, !is_in);
            media.push_if(path, is_in);
        }
    }

    /// The subpaths of `list` have been scattered in media: makes these places their endpoints.
    pub(in crate::transport) fn arrive_in_media<L: Lanes>(
        &self,
        rays: &Rays,
        list: &[u32],
        flights: &[Flight],
        endpoints: &mut Endpoints,
    ) {
        for chunk in list.chunks(L::N) {
            let ray = RayLanes::<L>::load(&rays.ray, chunk);
            let t = HitLanes::<L>::load(&rays.hit, chunk).t;
            let flight = FlightLanes::<L>::load(flights, chunk);
            let distant = flight.distant.gt(L::zero());
            let distance2 = L::select(distant, L::one(), t * t);
            let partial = Partial {
                d_vcm: flight.d_vcm,
                d_vc: flight.d_vc,
            }
            .arrive(distance2, L::one());
            let first = self.first_phase;
            let none = L::Uint::splat(NONE);
            EndpointPlaceLanes {
                p: ray.direction.mul_add(t, ray.origin),
                error: L::zero(),
                wo: -ray.direction,
                d_vcm: partial.d_vcm,
            }
            .store(&mut endpoints.place, chunk);
            EndpointFrameLanes {
                ng: Vec3::zero(),
                params: flight.medium.add(L::Uint::splat(first)),
                ns: Vec3::zero(),
                d_vc: partial.d_vc,
            }
            .store(&mut endpoints.frame, chunk);
            EndpointEnergyLanes {
                beta: flight.beta,
                primitive: none,
                tangent: Vec3::zero(),
                light: none,
            }
            .store(&mut endpoints.energy, chunk);
            for &path in chunk {
                endpoints.kind[path as usize] = Kind::HenyeyGreenstein;
            }
        }
    }

    /// Notes which media are on both sides of the endpoints of `list`, on surfaces or not. On the
    /// side that a subpath comes from it is the one that it has come through, whatever the surface
    /// says: files often say of the back of a ground or a wall that it is a vacuum, and then see
    /// it from there. So all strategies agree about such places.
    pub(in crate::transport) fn surround(
        &self,
        hits: &[Hit],
        flights: &[Flight],
        list: &[u32],
        endpoints: &mut Endpoints,
    ) {
        for &path in list {
            let i = path as usize;
            let primitive = hits[i].primitive;
            let boundary = match primitive {
                IN_MEDIUM => NONE,
                _ => self.geometry.shape_of(primitive).0.boundary,
            };
            let medium = flights[i].medium;
            let mut sides = match boundary {
                NONE => [medium; 2],
                _ => self.media.media.boundaries[boundary as usize],
            };
            let (n, wo) = (endpoints.frame[i].ng, endpoints.place[i].wo);
            let along = n[0] * wo[0] + n[1] * wo[1] + n[2] * wo[2];
            sides[usize::from(along <= 0.0)] = medium;
            endpoints.media[i] = sides;
        }
    }
}

impl Endpoints {
    /// The media that rays from the endpoints of `list` start in; `along` are the cosines between
    /// them and the geometric normals.
    #[inline(always)]
    pub(in crate::transport) fn media_towards<L: Lanes>(&self, list: &[u32], along: L) -> L::Uint {
        let last = list.len() - 1;
        L::Uint::from_fn(|i| {
            let sides = self.media[list[i.min(last)] as usize];
            sides[usize::from(along.lane(i) <= 0.0)]
        })
    }
}
