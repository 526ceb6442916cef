//! Rays through media: where they are scattered, how much of them passes, and what they pass
//! through on their way.
//!
//! The tracer knows no media. In a scene that has them, a ray whose hit is a mere border between
//! media is traced again from beyond it, until a surface, the outside or a place in a medium is
//! its end; optical depths add up from piece to piece ([`crate::medium`]). One primary sample a ray
//! says how far it goes, through however many media.
//!
//! A place in a medium is an endpoint like any other, of a kind of its own
//! ([`phase`](crate::surface::phase)). It has no normal, so that no cosine turns a density over
//! solid angle into one over volume.
//!
//! # Weights
//!
//! As in pbrt-v3's bidirectional path tracer, MIS weights leave out how distances are distributed.
//! Weights are functions of the path alone, the same whatever the strategy that made it, and sum
//! to one over all of them: nothing is biased by it. Of the densities that are left out,
//! extinction at vertices is common to all strategies; only the transmittance of the one edge that
//! a strategy joins is missing from its own.

mod look;
mod vertices;
mod waves;

use super::World;
use super::clock::{Clock, Stage};
use super::flying::Flying;
use super::paths::Rays;
use super::records::*;
use super::samples::{Bounce, Samples};
use super::weigh::Sink;
use crate::geometry::Wanted;
use crate::medium::{Piece, Travel, ln_1m};
use crate::scene::NONE;
use crate::simd::{Lanes, Vec3};
use crate::trace::offset;

/// In place of a primitive: the ray was scattered in a medium.
pub const IN_MEDIUM: u32 = NONE - 1;

/// Where rays find out how far they go.
#[derive(Clone, Copy)]
pub(in crate::transport) struct Distances<'a> {
    pub samples: &'a Samples,
    pub at: Bounce,
    /// Camera vertices of all paths.
    pub t: &'a [u32],
}

/// How a ray goes through media.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::transport) struct How {
    /// It is not scattered: only light that it meets counts.
    pub straight: bool,
    /// What media emit on its way is light that it has met.
    pub glows: bool,
}

impl Distances<'_> {
    fn sample(&self, path: u32) -> f32 {
        self.samples.row(self.at.dimension(self.t, path))[path as usize]
    }
}

impl World<'_> {
    /// The rays of `list`, traced already, go on until something ends them: their hits are then
    /// those of surfaces, or [`IN_MEDIUM`], or none, and their flights carry what has passed. `how`
    /// says of a path how its ray goes.
    pub(in crate::transport) fn fly<L: Lanes>(
        &self,
        rays: &mut Rays,
        flights: &mut [Flight],
        list: &[u32],
        distances: Distances,
        how: impl Fn(usize) -> How,
        clock: &mut Clock,
    ) {
        let mut flying = std::mem::take(&mut rays.flying);
        flying.start(rays.ray.len());
        for &path in list {
            let i = path as usize;
            let How { straight, glows } = how(i);
            let least = if straight {
                -f32::INFINITY
            } else {
                ln_1m(distances.sample(path))
            };
            flying.travel[i] = Travel::new(least, glows);
            flying.start[i] = 0.0;
            flying.from[i] = 0.0;
            flying.left.push(path);
        }
        for _ in 0..self.most_layers() {
            flying.next.clear();
            for index in 0..flying.left.len() {
                let path = flying.left[index];
                let i = path as usize;
                let (ray, hit) = (&rays.ray[i], &mut rays.hit[i]);
                let goes_on = self.end_or_cross(&mut flying, i, (ray, hit), &mut flights[i]);
                flying.next.push_if(path, goes_on);
            }
            if flying.next.is_empty() {
                break;
            }
            let next = std::mem::take(&mut flying.next);
            rays.traced += next.len() as u64;
            rays.traced +=
                self.closest::<L>(&flying.beyond, &next, &mut rays.hit, &mut rays.through);
            for &path in &*next {
                rays.hit[path as usize].t += flying.start[path as usize];
            }
            flying.next = std::mem::replace(&mut flying.left, next);
        }
        rays.flying = flying;
        clock.finish(Stage::Trace, list.len(), L::N);
    }

    /// A ray has come to a hit: it has been scattered before, or ends there, or crosses the border
    /// that it is. True if it goes on.
    fn end_or_cross(
        &self,
        flying: &mut Flying,
        i: usize,
        (ray, hit): (&Ray, &mut Hit),
        flight: &mut Flight,
    ) -> bool {
        let end = if hit.is_none() { f32::INFINITY } else { hit.t };
        let piece = Piece {
            origin: ray.origin,
            direction: ray.direction,
            range: [flying.from[i], end.max(flying.from[i])],
        };
        let travel = &mut flying.travel[i];
        if let Some(found) = self.media.scatter(flight.medium, &piece, travel) {
            travel.light(flight.beta);
            hit.t = found.t;
            hit.primitive = IN_MEDIUM;
            for c in 0..3 {
                flight.beta[c] *= found.weight[c];
            }
            return false;
        }
        if let Some((origin, medium)) = self.across(ray, hit) {
            flying.from[i] = hit.t;
            flying.start[i] = along(ray, origin);
            flying.beyond[i] = Ray::new(origin, f32::INFINITY, ray.direction);
            flight.medium = medium;
            return true;
        }
        let travel = &mut flying.travel[i];
        travel.light(flight.beta);
        let through = travel.through();
        for c in 0..3 {
            flight.beta[c] *= through[c];
        }
        false
    }

    /// Where a ray goes on beyond a hit that is a mere border, and the medium there.
    fn across(&self, ray: &Ray, hit: &Hit) -> Option<([f32; 3], u32)> {
        if hit.is_none() {
            return None;
        }
        let shape = self.geometry.shape_of(hit.primitive).0;
        if shape.boundary == NONE || !self.media.is_border(shape.material) {
            return None;
        }
        let wanted = self.border_wanted();
        let [o, d] = [ray.origin, ray.direction].map(Vec3::<f32>::splat);
        let at = [hit.t, hit.b[0], hit.b[1]];
        let of: (&[u32], &[u32]) = (&[hit.primitive], &[hit.instance]);
        let point = (self.geometry).surface_point(of, o, d, at, wanted);
        let [outside, inside] = self.media.media.boundaries[shape.boundary as usize];
        let medium = if d.dot(point.ng) > 0.0 {
            outside
        } else {
            inside
        };
        let origin = offset::leave(point.p, point.error, point.ng, d);
        Some((origin.lane(0), medium))
    }

    /// Adds what media have emitted along the latest rays of camera subpaths, `factor` times (one
    /// over the probability of the strategy). No other strategy makes these paths.
    pub(in crate::transport) fn glow<L: Lanes>(
        &self,
        rays: &mut Rays,
        list: &[u32],
        factor: f32,
        mut sink: Sink,
    ) {
        let lit = &mut rays.flying.next;
        lit.clear();
        let glow = |path: u32| rays.flying.travel[path as usize].glow.unwrap_or_default();
        for &path in list {
            lit.push_if(path, glow(path) != [0.0; 3]);
        }
        for chunk in lit.chunks(L::N) {
            let last = chunk.len() - 1;
            let channel = |c: usize| L::from_fn(|i| glow(chunk[i.min(last)])[c] * factor);
            let rgb = Vec3::new(channel(0), channel(1), channel(2));
            sink.add(chunk, rgb, || rgb);
        }
    }

    /// Places and geometric normals.
    fn border_wanted(&self) -> Wanted {
        Wanted {
            spheres: self.wanted.spheres,
            large: self.wanted.large,
            instances: self.wanted.instances,
            ..Wanted::default()
        }
    }
}

/// How far along a ray a point is, in units of its direction's length.
fn along(ray: &Ray, p: [f32; 3]) -> f32 {
    let [p, o, d] = [p, ray.origin, ray.direction].map(Vec3::<f32>::splat);
    (p - o).dot(d) / d.length2()
}
