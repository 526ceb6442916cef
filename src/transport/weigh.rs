//! What paths carry, weighed among the strategies that could have made them ([`super::mis`]): light
//! hit by chance, and connections.
//!
//! Contributions of connections wait in a table until visibility is known; only those that carry
//! something cost a ray.

use super::World;
use super::dispersion::Dispersion;
use super::list::List;
use super::mis::{self, Partial};
use super::paths::{Connections, Endpoints};
use super::probe::{Ended, Probe};
use super::records::*;
use super::share;
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, Vec3};

/// Which strategies run: densities of the others enter a weight times these, 1 for those that do
/// and 0 for those that do not.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrategyMask {
    /// Of points sampled on lights (`s = 1`), in the weight of a light hit by chance.
    pub direct: f32,
    /// Of all strategies with more light vertices.
    pub light: f32,
    /// Of all strategies with fewer light vertices, in the weight of a light subpath that is
    /// joined to the camera.
    pub camera: f32,
}

impl StrategyMask {
    pub const ALL: Self = Self {
        direct: 1.0,
        light: 1.0,
        camera: 1.0,
    };
    pub const NONE: Self = Self {
        direct: 0.0,
        light: 0.0,
        camera: 0.0,
    };
    /// Of camera subpaths that are joined to points on lights alone.
    pub const UNIDIRECTIONAL: Self = Self {
        light: 0.0,
        ..Self::ALL
    };
}

/// Where contributions go, and what colours them on their way.
pub(super) struct Sink<'a> {
    pub splats: &'a mut [Splat],
    /// The contribution of one strategy alone, weighted and unweighted, if pictures of strategies
    /// are asked for.
    pub part: Option<&'a mut [Contribution]>,
    /// Wavelengths, where light is dispersed.
    pub dispersion: Option<&'a Dispersion>,
    /// The most of a contribution that is kept, if chains bring the rest.
    pub kept: Option<f32>,
    /// What passes through media takes part in that: it is known with visibility.
    pub late: bool,
}

impl Sink<'_> {
    /// Adds to the splats of the paths in `list`, and to the part that is asked for. Returns what
    /// it adds, coloured.
    #[inline(always)]
    pub(super) fn add<L: Lanes>(
        &mut self,
        list: &[u32],
        rgb: Vec3<L>,
        unweighted: impl FnOnce() -> Vec3<L>,
    ) -> Vec3<L> {
        let rgb = self.shared(self.coloured(list, rgb));
        for (i, &path) in list.iter().enumerate() {
            let v = rgb.lane(i);
            let out = &mut self.splats[path as usize].rgb;
            for c in 0..3 {
                out[c] += v[c];
            }
        }
        if self.part.is_none() {
            return rgb;
        }
        let all = self.coloured(list, unweighted());
        if let Some(part) = &mut self.part {
            for (i, &path) in list.iter().enumerate() {
                part[path as usize].add(rgb.lane(i), all.lane(i));
            }
        }
        rgb
    }

    /// Adds the contributions of `list` that are not blocked.
    pub(super) fn add_visible(
        &mut self,
        contributions: &[Contribution],
        blocked: &[u32],
        list: &[u32],
    ) {
        for &path in list {
            let visible = blocked[path as usize] == 0;
            let added = self.passed(contributions[path as usize].weighted);
            let rgb = &mut self.splats[path as usize].rgb;
            for c in 0..3 {
                // Not a product: what is blocked may be infinite.
                rgb[c] += if visible { added[c] } else { 0.0 };
            }
        }
        if let Some(part) = &mut self.part {
            for &path in list {
                if blocked[path as usize] == 0 {
                    let added = contributions[path as usize];
                    let weighted = passed(self.late.then_some(self.kept).flatten(), added.weighted);
                    part[path as usize].add(weighted, added.unweighted);
                }
            }
        }
    }

    /// Contributions with the colours of the paths' wavelengths ([`super::wavelength`]).
    #[inline(always)]
    fn coloured<L: Lanes>(&self, list: &[u32], rgb: Vec3<L>) -> Vec3<L> {
        match self.dispersion {
            Some(dispersion) => dispersion.colour(list, rgb),
            None => rgb,
        }
    }

    /// What is kept of a contribution of which is known what passes.
    #[inline(always)]
    fn passed(&self, rgb: [f32; 3]) -> [f32; 3] {
        passed(self.late.then_some(self.kept).flatten(), rgb)
    }

    /// What is kept of contributions.
    #[inline(always)]
    fn shared<L: Lanes>(&self, rgb: Vec3<L>) -> Vec3<L> {
        match self.kept {
            Some(bound) => share::keep(rgb, bound),
            None => rgb,
        }
    }
}

#[inline(always)]
fn passed(kept: Option<f32>, rgb: [f32; 3]) -> [f32; 3] {
    match kept {
        Some(bound) => share::keep::<f32>(Vec3::splat(rgb), bound).lane(0),
        None => rgb,
    }
}

impl World<'_> {
    /// `s = 0`: adds what the camera endpoints of `list` emit, `factor` times (one over the
    /// probability of the strategy). Their last hits are still those of the endpoints: paths of
    /// this strategy have no light subpath.
    pub(super) fn emission<L: Lanes>(
        &self,
        (endpoints, hits, flights): (&Endpoints, &[Hit], &[Flight]),
        list: &[u32],
        lit: &mut List,
        (mask, factor): (StrategyMask, f32),
        mut sink: Sink,
        probe: &mut impl Probe,
    ) {
        lit.clear();
        for &path in list {
            let light = endpoints.energy[path as usize].light;
            lit.push_if(path, light != NONE);
            if light == NONE {
                probe.ended(path, Ended::Dark);
            }
        }
        for chunk in lit.chunks(L::N) {
            let mut lights = [0u32; 8];
            for (light, &path) in lights.iter_mut().zip(chunk) {
                *light = endpoints.energy[path as usize].light;
            }
            let end = endpoints.load::<L>(chunk);
            let cos = end.place.wo.dot(end.frame.ng);
            let lights = &lights[..chunk.len()];
            let mut surface = [L::zero(); 2];
            if self.lights.has_pictures() {
                surface = HitLanes::<L>::load(hits, chunk).b;
            }
            let seen = (self.lights).emitted(&self.geometry, lights, end.place.p, cos, surface);
            let direct = seen.direct_pdf * L::splat(mask.direct);
            let emission = seen.emission_pdf * L::splat(mask.light);
            let weight = end.partial().weight_hit(direct, emission);
            let all = end.energy.beta.mul_elem(seen.radiance);
            let rgb = all * (weight * L::splat(factor));
            let added = sink.add(chunk, rgb, || all * L::splat(factor));
            self.note_chance(
                flights,
                chunk,
                |i| lights[i],
                (seen.radiance, weight),
                sink.splats,
            );
            probe.emission(chunk, lights, weight, added);
        }
    }

    /// `s = 0`: adds what the escaped camera rays of `list` see of the environments, `factor`
    /// times.
    pub(super) fn environment<L: Lanes>(
        &self,
        (rays, flights): (&[Ray], &[Flight]),
        list: &[u32],
        (mask, factor): (StrategyMask, f32),
        mut sink: Sink,
        probe: &mut impl Probe,
    ) {
        for chunk in list.chunks(L::N) {
            let direction = RayLanes::<L>::load(rays, chunk).direction;
            let flight = FlightLanes::<L>::load(flights, chunk);
            // Densities stay over solid angle: nothing was arrived at.
            let partial = Partial {
                d_vcm: flight.d_vcm,
                d_vc: flight.d_vc,
            };
            // Each environment is a path space of its own, with its own densities.
            for &light in &self.lights.infinite {
                let seen = self.lights.escaped(light, direction);
                let direct = seen.direct_pdf * L::splat(mask.direct);
                let emission = seen.emission_pdf * L::splat(mask.light);
                let weight = partial.weight_hit(direct, emission);
                let all = flight.beta.mul_elem(seen.radiance);
                let rgb = all * (weight * L::splat(factor));
                let added = sink.add(chunk, rgb, || all * L::splat(factor));
                let met = (seen.radiance, weight);
                self.note_chance(flights, chunk, |_| light, met, sink.splats);
                probe.escaped(chunk, (light, direction), weight, added);
            }
        }
    }
}

/// `s = 1`.
pub(super) fn direct<L: Lanes>(
    connections: &mut Connections,
    list: &[u32],
    (mask, factor): (StrategyMask, f32),
    sink: &Sink,
    live: &mut List,
    probe: &mut impl Probe,
) {
    for chunk in list.chunks(L::N) {
        let value = EndpointValueLanes::<L>::load(&connections.value[0], chunk);
        let end = LightEndLanes::<L>::load(&connections.light_end, chunk);
        let weight = value.joint().weight_direct(
            end.pdf,
            end.emission_ratio * L::splat(mask.light),
            end.hittable.gt(L::zero()),
        );
        let scale = weight * L::splat(factor) / end.pdf;
        let all = value.beta.mul_elem(end.radiance);
        let unweighted = || all * (L::splat(factor) / end.pdf);
        let kept = keep(
            &mut connections.contribution,
            chunk,
            (all * scale, unweighted),
            sink,
            live,
        );
        probe.weighed(chunk, weight, kept);
    }
}

/// `t = 1`.
pub(super) fn lens<L: Lanes>(
    connections: &mut Connections,
    list: &[u32],
    (mask, factor): (StrategyMask, f32),
    sink: &Sink,
    live: &mut List,
    probe: &mut impl Probe,
) {
    for chunk in list.chunks(L::N) {
        let value = EndpointValueLanes::<L>::load(&connections.value[1], chunk);
        let pdf = LensEndLanes::<L>::load(&connections.lens_end, chunk).pdf;
        let camera = pdf * value.cos * L::splat(mask.camera);
        let weight = value.joint().weight_camera(camera);
        let rgb = value.beta * (pdf * weight * L::splat(factor));
        let unweighted = || value.beta * (pdf * L::splat(factor));
        let kept = keep(
            &mut connections.contribution,
            chunk,
            (rgb, unweighted),
            sink,
            live,
        );
        probe.weighed(chunk, weight, kept);
    }
}

/// `s, t >= 2`: what both endpoints make of a link of such a squared length.
#[inline(always)]
pub(super) fn general<L: Lanes>(
    [camera, light]: [&EndpointValueLanes<L>; 2],
    distance2: L,
    factor: L,
    contributions: &mut [Contribution],
    list: &[u32],
    (sink, live): (&Sink, &mut List),
    probe: &mut impl Probe,
) {
    let inv_d2 = L::one() / distance2;
    let weight = mis::weight_connect(&camera.joint(), &light.joint(), inv_d2);
    let all = camera.beta.mul_elem(light.beta);
    let rgb = all * (inv_d2 * weight * factor);
    let unweighted = || all * (inv_d2 * factor);
    let kept = keep(contributions, list, (rgb, unweighted), sink, live);
    probe.weighed(list, weight, kept);
}

/// Keeps contributions, with their weights and without, until visibility is known; those that are
/// not zero (also if not finite, so that they are counted) stay alive. Without their weights they
/// are kept only for the pictures of single strategies (`--strategies`). Returns those with their
/// weights, coloured.
#[inline(always)]
fn keep<L: Lanes>(
    contributions: &mut [Contribution],
    list: &[u32],
    (rgb, unweighted): (Vec3<L>, impl FnOnce() -> Vec3<L>),
    sink: &Sink,
    live: &mut List,
) -> Vec3<L> {
    let mut rgb = sink.coloured(list, rgb);
    if !sink.late {
        rgb = sink.shared(rgb);
    }
    let zero = L::zero();
    let dark = |v: Vec3<L>| v.x.eq(zero).and(v.y.eq(zero)).and(v.z.eq(zero)).bits();
    let mut all = Vec3::zero();
    let mut unlit = dark(rgb);
    if sink.part.is_some() {
        all = sink.coloured(list, unweighted());
        unlit &= dark(all);
    }
    ContributionLanes {
        weighted: rgb,
        unweighted: all,
    }
    .store(contributions, list);
    live.push_where(list, !unlit);
    rgb
}
