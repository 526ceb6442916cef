//! Parameter rows of every BSDF, and directions to look at them from.

use crate::common::bsdf::{coated_copper, coated_diffuse};
use phalanx::replay::vector::*;
use phalanx::surface::Kind;
use phalanx::surface::coated_rows::pack_bounces;
use phalanx::surface::hair;
use phalanx::surface::microfacet::pack_alphas;

const COPPER: [f32; 6] = [0.2, 0.92, 1.4, 3.9, 2.4, 2.1];

/// Parameter rows of every kind that is not a delta.
pub fn rough_rows() -> Vec<(Kind, [f32; 8])> {
    let mut rows = vec![(Kind::Diffuse, [0.9, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])];
    for sigma in [5.0, 40.0, 90.0] {
        let (a, b) = phalanx::surface::diffuse::oren_nayar_coefficients(sigma);
        rows.push((Kind::OrenNayar, [1.0, 0.5, 0.1, a, b, 0.0, 0.0, 0.0]));
    }
    for (ax, ay) in [
        (0.001, 0.001),
        (0.01, 0.01),
        (0.1, 0.1),
        (0.1, 0.6),
        (0.001, 0.5),
        (1.0, 1.0),
    ] {
        let c = COPPER;
        rows.push((
            Kind::RoughConductor,
            [c[0], c[1], c[2], c[3], c[4], c[5], ax, ay],
        ));
        rows.push((Kind::Plastic, [0.5, 0.3, 0.1, 0.5, 0.5, 0.5, ax, ay]));
    }
    for (eta, ax, ay) in [
        (1.5, 0.001, 0.001),
        (1.5, 0.1, 0.1),
        (1.5, 0.1, 0.6),
        (0.7, 0.3, 0.01),
        (3.0, 1.0, 1.0),
        (1.01, 0.05, 0.05),
    ] {
        rows.push((
            Kind::RoughDielectric,
            [1.0, 0.5, 0.2, 1.0, 0.9, 0.3, eta, pack_alphas(ax, ay)],
        ));
    }
    rows.push((Kind::Plastic, [0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.2, 0.2]));
    rows.push((Kind::Plastic, [0.5, 0.3, 0.1, 0.0, 0.0, 0.0, 0.2, 0.2]));
    for (ax, ay) in [
        (0.001, 0.001),
        (0.05, 0.3),
        (0.2, 0.5),
        (0.5, 0.5),
        (1.0, 1.0),
    ] {
        rows.push((Kind::Substrate, [1.0, 0.3, 0.0, 0.04, 0.5, 0.2, ax, ay]));
        rows.push((Kind::Substrate, [0.0, 0.0, 0.0, 1.0, 0.5, 0.1, ax, ay]));
    }
    rows.push((Kind::Substrate, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.3]));
    for [r, g, b, s, t, u] in [
        [0.5, 0.3, 0.1, 0.2, 0.4, 0.1],
        [0.0, 0.0, 0.0, 0.1, 1.0, 0.5],
        [1.0, 0.9, 0.9, 0.0, 0.0, 0.0],
        [0.3, 0.3, 0.3, 0.7, 0.7, 0.7],
    ] {
        rows.push((Kind::DiffuseTransmission, [r, g, b, s, t, u, 0.0, 0.0]));
    }
    for (eta, alphas, thickness) in [
        (1.5, [0.001, 0.001], 0.01),
        (1.5, [0.1, 0.1], 0.01),
        (1.3, [0.2, 0.6], 0.5),
        (2.0, [1.0, 1.0], 0.01),
        (0.8, [0.3, 0.3], 0.0),
    ] {
        let white = coated_diffuse([1.0, 0.5, 0.0], eta, alphas, thickness);
        rows.push((Kind::CoatedDiffuse, white));
        let black = coated_diffuse([0.0; 3], eta, alphas, thickness);
        rows.push((Kind::CoatedDiffuse, black));
    }
    for (eta, thickness) in [(1.5, 0.01), (1.0, 0.1), (0.8, 0.0), (3.0, 2.0)] {
        let row = [0.2, 0.1, 0.0, eta, thickness, 0.0, 0.0, 0.0];
        rows.push((Kind::CoatedDiffuseBase, row));
    }
    for (eta, coat, conductor) in [
        (1.5, [0.2, 0.2], [0.3, 0.3]),
        (1.3, [0.01, 0.01], [0.001, 0.001]),
        (2.0, [0.6, 0.2], [0.2, 0.5]),
        (0.8, [0.3, 0.3], [0.3, 0.3]),
    ] {
        let rough = coated_copper(eta, Some(coat), conductor);
        rows.push((Kind::CoatedConductor, rough));
        let below = coated_copper(eta, None, conductor);
        rows.push((Kind::CoatedConductorBase, below));
    }
    for (h, beta, alpha) in [(0.3, 0.3, 2.0), (-0.9, 1.0, 0.0), (0.0, 0.05, -10.0)] {
        let row = hair::row([0.4, 0.0, 5.0], h, 1.55, [beta; 2], alpha);
        rows.push((Kind::Hair, row));
    }
    rows
}

pub fn delta_rows() -> Vec<(Kind, [f32; 8])> {
    let mut rows = vec![(Kind::Mirror, [1.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0])];
    let c = COPPER;
    rows.push((
        Kind::SmoothConductor,
        [c[0], c[1], c[2], c[3], c[4], c[5], 0.0, 0.0],
    ));
    for eta in [0.5, 1.0, 1.5, 3.0] {
        rows.push((Kind::Coat, [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        let thickness = pack_bounces(0.01, 5);
        let mirror = [c[0], c[1], c[2], c[3], c[4], c[5], eta, thickness];
        rows.push((Kind::CoatedMirror, mirror));
    }
    for eta in [0.5, 1.0, 1.0001, 1.5, 3.0] {
        rows.push((
            Kind::SmoothDielectric,
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, eta, 0.0],
        ));
    }
    for eta in [0.5, 1.0, 1.5, 3.0] {
        rows.push((
            Kind::ThinDielectric,
            [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ));
    }
    rows
}

pub fn at_angle(theta: f64, phi: f64, side: f64) -> [f32; 3] {
    narrow([
        theta.sin() * phi.cos(),
        theta.sin() * phi.sin(),
        side * theta.cos(),
    ])
}
