//! Coats whose roughness, or whose conductor, is looked up in textures.
//!
//! What a coat does over a surface takes many directions to find out ([`coat`](super::coat)), too
//! many for a hit. It is found out at some alphas when a scene is loaded, and interpolated between
//! them. Alphas of `u` and `v` that differ count there by the mean of their squares; lobes have
//! both.

use super::coat::{CoatLayer, Interface};
use super::coated_conductor::{Calibration, Layers};
use super::coated_rows::{pack_colour, pack_layer, unpack_layer};
use super::fresnel;
use super::microfacet::{SMOOTH_ALPHA, pack_alphas, pack_halves};
use super::rough_dielectric::resolved_eta;
use crate::simd::Vec3;

/// Alphas that are tabulated.
const ALPHAS: [f32; 10] = [SMOOTH_ALPHA, 0.05, 0.1, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0, 1.5];

/// Every other one, where two roughnesses vary.
const FEWER: [f32; 6] = [SMOOTH_ALPHA, 0.1, 0.25, 0.45, 0.75, 1.2];

/// What a table is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// Lambertian.
    Diffuse,
    /// With its alphas, if they are the same everywhere.
    Conductor(Option<[f32; 2]>),
}

/// Of one coat.
pub struct CoatTable {
    coat: CoatLayer,
    /// The alphas of interface and conductor that there are entries for: one if they do not vary.
    alphas: [Vec<f32>; 2],
    interfaces: Vec<Interface>,
    /// Of a conductor, by interface, then by conductor.
    layers: Vec<Calibrated>,
}

/// What layers with a conductor that reflects all add to the closed form.
#[derive(Clone, Debug)]
struct Calibrated {
    gain: f32,
    /// How much of `later` goes forward.
    forward: f32,
    /// Diffuse colour of what meets the conductor once, but for its lobe, twice and so on.
    later: Vec<f32>,
}

/// Alpha that counts.
fn mean(alphas: [f32; 2]) -> f32 {
    (alphas[0].mul_add(alphas[0], alphas[1] * alphas[1]) * 0.5).sqrt()
}

/// The entries on either side of `x`, and how far it is on the way to the second.
fn between(nodes: &[f32], x: f32) -> (usize, usize, f32) {
    let next = nodes.partition_point(|n| *n <= x).min(nodes.len() - 1);
    let last = next.saturating_sub(1);
    let width = nodes[next] - nodes[last];
    let t = if width > 0.0 {
        ((x - nodes[last]) / width).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (last, next, t)
}

fn mix(a: f32, b: f32, t: f32) -> f32 {
    (b - a).mul_add(t, a)
}

impl CoatTable {
    /// `fixed` if the coat has its alphas everywhere.
    pub fn new(coat: CoatLayer, base: Base, fixed: bool) -> Self {
        let own = |alphas: [f32; 2]| vec![mean(alphas).max(SMOOTH_ALPHA)];
        let both = !fixed && base == Base::Conductor(None);
        let many = || {
            if both {
                FEWER.to_vec()
            } else {
                ALPHAS.to_vec()
            }
        };
        let of_coat = if fixed { own(coat.alphas) } else { many() };
        let of_base = match base {
            Base::Diffuse => vec![1.0],
            Base::Conductor(Some(alphas)) => own(alphas),
            Base::Conductor(None) => many(),
        };
        let (mut interfaces, mut layers) = (Vec::new(), Vec::new());
        for &a in &of_coat {
            match base {
                Base::Diffuse => interfaces.push(Interface::of([a; 2], coat.eta, coat.thickness)),
                Base::Conductor(_) => {
                    layers.extend(of_base.iter().map(|&b| calibrated(&coat, [a, b])));
                }
            }
        }
        Self {
            coat,
            alphas: [of_coat, of_base],
            interfaces,
            layers,
        }
    }

    /// The interface with these alphas.
    pub fn interface(&self, alphas: [f32; 2]) -> Interface {
        let (a, b, t) = between(&self.alphas[0], mean(alphas));
        Interface::between(&self.interfaces[a], &self.interfaces[b], t)
    }

    /// Row of a conductor of `eta` and `k` relative to the coat.
    pub fn conductor(
        &self,
        [eta, k]: [[f32; 3]; 2],
        interface: [f32; 2],
        conductor: [f32; 2],
    ) -> [f32; 8] {
        let coat = &self.coat;
        let pair = |c: usize| pack_halves(eta[c], k[c]);
        let (gain, forward, later) = self.later(mean(interface), mean(conductor), [eta, k]);
        let (relative, layer) = if coat.is_smooth() {
            (coat.eta, coat.thickness)
        } else {
            let least = interface[0].min(interface[1]).max(SMOOTH_ALPHA);
            (
                resolved_eta(coat.eta, least),
                pack_layer(coat.thickness, gain, forward),
            )
        };
        [
            pair(0),
            pair(1),
            pair(2),
            relative,
            pack_alphas(interface[0], interface[1]),
            pack_alphas(conductor[0], conductor[1]),
            layer,
            pack_colour(later),
        ]
    }

    /// The gain, and the forward share and colour of later bounces.
    fn later(
        &self,
        interface: f32,
        conductor: f32,
        [eta, k]: [[f32; 3]; 2],
    ) -> (f32, f32, [f32; 3]) {
        let (a0, a1, t) = between(&self.alphas[0], interface);
        let (b0, b1, s) = between(&self.alphas[1], conductor);
        let n = self.alphas[1].len();
        let corners =
            [[a0, b0], [a0, b1], [a1, b0], [a1, b1]].map(|[a, b]| &self.layers[a * n + b]);
        let blend = |value: &dyn Fn(&Calibrated) -> f32| {
            let [w, x, y, z] = corners.map(value);
            mix(mix(w, x, s), mix(y, z, s), t)
        };
        let vector = |c: [f32; 3]| Vec3::new(c[0], c[1], c[2]);
        // Below a coat light meets the conductor at all but grazing angles.
        let at = |cos: f32| fresnel::conductor(cos, vector(eta), vector(k));
        let reflected = (at(0.95) + at(0.8) + at(0.6)) * (1.0 / 3.0);
        let mut power = reflected;
        let mut later = Vec3::zero();
        for j in 0..corners[0].later.len() {
            later = later + power * blend(&|entry| entry.later[j]);
            power = power.mul_elem(reflected);
        }
        (
            blend(&|entry| entry.gain),
            blend(&|entry| entry.forward),
            [later.x, later.y, later.z],
        )
    }
}

fn calibrated(coat: &CoatLayer, [interface, conductor]: [f32; 2]) -> Calibrated {
    let layers = Layers {
        eta: [1.0; 3],
        k: [200.0; 3],
        coat_eta: coat.eta,
        coat: (!coat.is_smooth()).then_some([interface; 2]),
        conductor: [conductor; 2],
        thickness: coat.thickness,
        bounces: coat.visits(),
    };
    let Calibration {
        row,
        walk,
        missing,
        forward,
        square,
    } = layers.calibrated();
    let gain = if coat.is_smooth() {
        1.0
    } else {
        unpack_layer(row[6])[1]
    };
    let astray = [&[missing], &walk.each[1..]].concat();
    Calibrated {
        gain,
        forward,
        later: astray.into_iter().map(|x| x / square).collect(),
    }
}
