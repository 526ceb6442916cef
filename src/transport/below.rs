//! The workspace of subpaths on their way below surfaces: probes, and what they have found.

use super::list::List;
use super::records::Ray;
use crate::geometry::SurfacePoint;
use crate::surface::Bssrdf;
use glam::DVec3;
use std::f64::consts::TAU;

/// Probabilities of the axes: two in the surface, and its normal.
const AXES: [f64; 3] = [0.25, 0.25, 0.5];

/// Subpaths on their way below surfaces.
#[derive(Default)]
pub(super) struct Below {
    /// What is below endpoints, where that differs from hit to hit.
    pub bssrdfs: Vec<Option<Bssrdf>>,
    pub walks: Vec<Walk>,
    /// What is left of the probes.
    pub probes: Vec<Ray>,
    /// Those that go in.
    pub enter: List,
    /// Those that do not.
    pub stay: List,
    pub left: List,
    pub next: List,
}

/// A probe, and the hit that has been chosen so far.
#[derive(Clone, Copy, Default)]
pub(super) struct Walk {
    /// Where light goes in.
    pub from: DVec3,
    /// The axes there, the normal last.
    pub axes: [DVec3; 3],
    pub end: DVec3,
    pub material: u32,
    /// Chooses among the hits.
    pub u: f64,
    /// Hits so far.
    pub found: u32,
    pub chosen: Place,
}

#[derive(Clone, Copy, Default)]
pub(super) struct Place {
    pub p: [f32; 3],
    pub error: f32,
    pub ng: [f32; 3],
    pub ns: [f32; 3],
    pub primitive: u32,
}

impl Below {
    pub fn resize(&mut self, n: usize) {
        self.bssrdfs.resize_with(n, || None);
        self.walks.resize(n, Walk::default());
        self.probes.resize(n, Ray::default());
        for list in [
            &mut self.enter,
            &mut self.stay,
            &mut self.left,
            &mut self.next,
        ] {
            list.reserve(n);
        }
    }

    /// What is below the endpoint of a path whose hits have parameters of their own.
    pub fn note(&mut self, path: u32, bssrdf: Option<Bssrdf>) {
        self.bssrdfs[path as usize] = bssrdf;
    }
}

pub(super) fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

impl Walk {
    /// The probe that primary samples choose; `u` has the choice of axis, channel and hit.
    pub fn start(&mut self, bssrdf: &Bssrdf, u: f64, place: [f64; 2]) -> Option<Ray> {
        let (axis, u) = match u {
            _ if u < 0.5 => (2, 2.0 * u),
            _ if u < 0.75 => (0, 4.0 * (u - 0.5)),
            _ => (1, 4.0 * (u - 0.75)),
        };
        let channel = ((3.0 * u) as usize).min(2);
        self.u = 3.0 * u - channel as f64;
        let [r, reach] = bssrdf.sample(channel, place[0])?;
        let (sin, cos) = (TAU * place[1]).sin_cos();
        let [along, x, y] = [0, 1, 2].map(|i| self.axes[(axis + i) % 3]);
        let half = (reach * reach - r * r).max(0.0).sqrt() * along;
        let middle = self.from + r * (cos * x + sin * y);
        self.end = middle + half;
        let [origin, direction] = [middle - half, 2.0 * half].map(|v| v.as_vec3().to_array());
        Some(Ray::new(origin, 1.0, direction))
    }

    /// A hit on the same material.
    pub fn meet(&mut self, point: &SurfacePoint<f32>, primitive: u32) {
        self.found += 1;
        let share = 1.0 / f64::from(self.found);
        if self.u >= share {
            self.u = (self.u - share) / (1.0 - share);
            return;
        }
        self.u /= share;
        self.chosen = Place {
            p: point.p.lane(0),
            error: point.error,
            ng: point.ng.lane(0),
            ns: point.ns.lane(0),
            primitive,
        };
    }

    /// Light that comes out of the chosen point over the density of having chosen it, by channel.
    pub fn weight(&self, bssrdf: &Bssrdf) -> [f64; 3] {
        if self.found == 0 {
            return [0.0; 3];
        }
        let d = wide(self.chosen.p) - self.from;
        let n = wide(self.chosen.ng);
        let distance = d.length();
        let mut density = 0.0;
        for axis in 0..3 {
            let [x, y] = [1, 2].map(|i| d.dot(self.axes[(axis + i) % 3]));
            let channels = bssrdf.densities(x.hypot(y), distance);
            let mean = channels.iter().sum::<f64>() / 3.0;
            density += AXES[axis] * n.dot(self.axes[axis]).abs() * mean;
        }
        let scale = f64::from(self.found) / density;
        match scale.is_finite() {
            true => bssrdf.value(distance).map(|v| v * scale),
            false => [0.0; 3],
        }
    }
}
