//! Visibility rays through media: what is in their way, and what passes.

use super::super::World;
use super::super::clock::{Clock, Stage};
use super::super::flying::Flying;
use super::super::paths::{Endpoints, Rays};
use super::super::records::*;
use crate::medium::{Piece, Travel};
use crate::simd::Lanes;

impl World<'_> {
    /// The visibility rays of `list`, of which the media they start in are known
    /// ([`Self::note_media`]): whether they are blocked, and if not, what passes of their
    /// contributions.
    pub(in crate::transport) fn look<L: Lanes>(
        &self,
        rays: &mut Rays,
        contributions: &mut [Contribution],
        list: &[u32],
        clock: &mut Clock,
    ) {
        let mut flying = std::mem::take(&mut rays.flying);
        flying.start(rays.ray.len());
        for &path in list {
            let i = path as usize;
            flying.travel[i] = Travel::new(-f32::INFINITY, false);
            flying.beyond[i] = rays.ray[i];
            flying.left.push(path);
        }
        if self.media.has_borders {
            self.look_across::<L>(rays, &mut flying);
        } else {
            self.trace_visibility::<L>(rays, list, clock);
            for &path in list {
                let i = path as usize;
                let piece = piece(&rays.ray[i], 1.0);
                (self.media).pass(flying.medium[i], &piece, &mut flying.travel[i].passed);
            }
        }
        for &path in list {
            let i = path as usize;
            let through = flying.travel[i].through();
            let Contribution {
                weighted,
                unweighted,
                ..
            } = &mut contributions[i];
            for c in 0..3 {
                weighted[c] *= through[c];
                unweighted[c] *= through[c];
            }
        }
        rays.flying = flying;
        clock.finish(Stage::Occlusion, list.len(), L::N);
    }

    /// Visibility rays go on from border to border.
    fn look_across<L: Lanes>(&self, rays: &mut Rays, flying: &mut Flying) {
        for &path in &*flying.left {
            // What never comes to an end is blocked.
            rays.blocked[path as usize] = 1;
        }
        for _ in 0..self.most_layers() {
            rays.traced += flying.left.len() as u64;
            let left = &flying.left;
            rays.traced +=
                self.closest::<L>(&flying.beyond, left, &mut rays.hit, &mut rays.through);
            flying.next.clear();
            for &path in &**left {
                let i = path as usize;
                let (ray, hit) = (flying.beyond[i], rays.hit[i]);
                let end = if hit.is_none() { 1.0 } else { hit.t };
                let medium = flying.medium[i];
                (self.media).pass(medium, &piece(&ray, end), &mut flying.travel[i].passed);
                if hit.is_none() {
                    rays.blocked[i] = 0;
                    continue;
                }
                let crossed = self.across(&ray, &hit);
                // What casts no shadow is passed, too.
                let unseen = || Some((self.beyond(&ray, &hit, true)?, medium));
                let Some((origin, medium)) = crossed.or_else(unseen) else {
                    continue;
                };
                let target = |c: usize| ray.direction[c].mul_add(ray.t_max, ray.origin[c]);
                let rest = [0, 1, 2].map(|c| target(c) - origin[c]);
                flying.beyond[i] = Ray::new(origin, 1.0, rest);
                flying.medium[i] = medium;
                flying.next.push(path);
            }
            std::mem::swap(&mut flying.left, &mut flying.next);
            if flying.left.is_empty() {
                break;
            }
        }
    }

    /// Notes which media the visibility rays of `list` start in: they leave these endpoints.
    pub(in crate::transport) fn note_media(
        &self,
        rays: &mut Rays,
        endpoints: &Endpoints,
        list: &[u32],
    ) {
        rays.flying.start(rays.ray.len());
        for &path in list {
            let i = path as usize;
            let [n, d] = [endpoints.frame[i].ng, rays.ray[i].direction];
            let along = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
            rays.flying.medium[i] = endpoints.media[i][usize::from(along <= 0.0)];
        }
    }
}

fn piece(ray: &Ray, end: f32) -> Piece {
    Piece {
        origin: ray.origin,
        direction: ray.direction,
        range: [0.0, end],
    }
}
