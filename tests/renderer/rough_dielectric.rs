//! Rough glass: both of its lobes against their densities, reciprocity between the modes, energy,
//! and what it becomes as it gets smooth.

use crate::common;

use common::bsdf::Kernels;
use common::stats::{FALSE_ALARM, Mean, Random, assert_follows, normal_quantile};
use phalanx::replay::bsdf::{self, unpacked_alphas};
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::microfacet::pack_alphas;
use phalanx::surface::{Kind, Mode};
use std::f64::consts::TAU;

const KIND: Kind = Kind::RoughDielectric;

fn glass(eta: f32, ax: f32, ay: f32) -> [f32; 8] {
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, eta, pack_alphas(ax, ay)]
}

fn at_angle(theta: f64, phi: f64, side: f64) -> [f32; 3] {
    narrow([
        theta.sin() * phi.cos(),
        theta.sin() * phi.sin(),
        side * theta.cos(),
    ])
}

/// Directions that a half vector `h` reflects and refracts `wo` to, with the Jacobians of `h`
/// (Walter et al. 2007, equations 14 and 17). `eta` is the index of the far side over that of the
/// side of `wo`; `wo[2] > 0`.
fn lobes(wo: V, h: V, eta: f64) -> [Option<(V, f64)>; 2] {
    let c = dot(wo, h);
    if c <= 0.0 {
        return [None; 2];
    }
    let reflected = sub(scale(h, 2.0 * c), wo);
    let sin2 = (1.0 - c * c) / (eta * eta);
    let refracted = (sin2 < 1.0).then(|| {
        let cos = (1.0 - sin2).sqrt();
        let w = sub(scale(h, c / eta - cos), scale(wo, 1.0 / eta));
        (w, (eta * cos - c).powi(2) / (eta * eta * cos))
    });
    [
        (reflected[2] > 0.0).then_some((reflected, 4.0 * c)),
        refracted.filter(|(w, _)| w[2] < 0.0),
    ]
}

/// The half vector of a pair of directions, on the side of `wo`, and which lobe they are of.
fn half_vector(wo: V, wi: V, eta: f64) -> (V, usize) {
    if wi[2] > 0.0 {
        return (unit(add(wo, wi)), 0);
    }
    let h = unit(add(wo, scale(wi, eta)));
    (scale(h, 1f64.copysign(h[2])), 1)
}

/// Cells are those of the half vector's slopes over the roughness, in polar coordinates, the radius
/// `r` as `r / (1 + r)`, since refraction at grazing angles is all in steep slopes; a square for
/// each lobe, and one cell for samples that are lost.
#[test]
fn sampling_follows_the_density() {
    const CELLS: usize = 12;
    const FINE: usize = 24;
    const SAMPLES: usize = 200_000;
    const LOST: usize = 2 * CELLS * CELLS;
    let mut cases = Vec::new();
    for eta in [1.5f32, 0.6, 1.05, 3.0] {
        for (ax, ay) in [(0.003, 0.003), (0.1, 0.1), (0.1, 0.5), (0.8, 0.8)] {
            for theta in [0.0, 0.7, 1.4] {
                for side in [1.0, -1.0] {
                    cases.push((glass(eta, ax, ay), theta, side));
                }
            }
        }
    }
    let p = FALSE_ALARM / cases.len() as f64;
    let mut random = Random(1);
    for (row, theta, side) in cases {
        let wo32 = at_angle(theta, 0.6, side);
        let flip = |w: [f32; 3]| [w[0].into(), w[1].into(), f64::from(w[2]) * side];
        let wo: V = flip(wo32);
        let eta = f64::from(row[6]).powf(side);
        let (ax, ay) = unpacked_alphas(row[7].into());
        let n = CELLS * FINE;
        let (mut at, mut wi, mut jacobian) = (vec![], vec![], vec![]);
        for i in 0..n * n {
            let q = ((i % n) as f64 + 0.5) / n as f64;
            let phi = ((i / n) as f64 + 0.5) / n as f64 * TAU;
            let r = q / (1.0 - q);
            let h = unit([r * phi.cos() * ax, r * phi.sin() * ay, 1.0]);
            let to_h = h[2].powi(3) * ax * ay * r / ((1.0 - q) * (1.0 - q));
            for (lobe, found) in lobes(wo, h, eta).into_iter().enumerate() {
                if let Some((w, j)) = found {
                    at.push(CELLS * CELLS * lobe + i % n / FINE + CELLS * (i / n / FINE));
                    wi.push(narrow([w[0], w[1], w[2] * side]));
                    jacobian.push(j * to_h);
                }
            }
        }
        let wos = vec![wo32; wi.len()];
        let values = Kernels::eval::<f32x8>(KIND, &row, &wos, &wi, Mode::Radiance);
        let cell = TAU / (n * n) as f64 * SAMPLES as f64;
        let mut expected = vec![0.0; LOST + 1];
        for ((value, at), j) in values.iter().zip(&at).zip(&jacobian) {
            expected[*at] += f64::from(value.1) * j * cell;
        }
        let all: f64 = expected.iter().sum();
        let what = format!("{row:?} at {theta}, side {side}");
        assert!(all < 1.01 * SAMPLES as f64, "{what}: {all}");
        expected[LOST] = (SAMPLES as f64 - all).max(0.0);
        let u: Vec<[f32; 3]> = (0..SAMPLES)
            .map(|_| std::array::from_fn(|_| random.uniform()))
            .collect();
        let wos = vec![wo32; SAMPLES];
        let mut observed = vec![0.0; LOST + 1];
        for (wi, weight, ..) in Kernels::sample::<f32x8>(KIND, &row, &wos, &u, Mode::Radiance) {
            if weight == [0.0; 3] {
                observed[LOST] += 1.0;
                continue;
            }
            let (h, lobe) = half_vector(wo, flip(wi), eta);
            let (x, y) = (h[0] / h[2] / ax, h[1] / h[2] / ay);
            let r = x.hypot(y);
            let phi = y.atan2(x).rem_euclid(TAU) / TAU;
            let index = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
            let place = index(r / (1.0 + r)) + CELLS * index(phi);
            observed[CELLS * CELLS * lobe + place] += 1.0;
        }
        assert_follows(&observed, &expected, p, &what);
    }
}

/// `f(wo, wi)` of radiance over the square of the index on the side of `wo` is `f(wi, wo)` over
/// that on the side of `wi`, and what importance sees is the same with the directions swapped
/// (Veach 1997, equations 5.13 and 5.14).
#[test]
fn transmission_is_reciprocal_but_for_the_square_of_the_index() {
    let mut random = Random(2);
    for eta in [0.6f32, 1.05, 1.5, 3.0] {
        let row = glass(eta, 0.3, 0.5);
        let wo: Vec<[f32; 3]> = (0..4000).map(|_| narrow(random.direction())).collect();
        let u: Vec<[f32; 3]> = (0..wo.len())
            .map(|_| std::array::from_fn(|_| random.uniform()))
            .collect();
        let sampled = Kernels::sample::<f32x8>(KIND, &row, &wo, &u, Mode::Radiance);
        let wi: Vec<[f32; 3]> = sampled.iter().map(|s| s.0).collect();
        let forth = Kernels::eval::<f32x8>(KIND, &row, &wo, &wi, Mode::Radiance);
        let back = Kernels::eval::<f32x8>(KIND, &row, &wi, &wo, Mode::Radiance);
        let swapped = Kernels::eval::<f32x8>(KIND, &row, &wi, &wo, Mode::Importance);
        let mut transmitted = 0;
        for i in 0..wo.len() {
            if wo[i][2] * wi[i][2] > 0.0 {
                continue;
            }
            let index = |w: [f32; 3]| if w[2] > 0.0 { 1.0 } else { f64::from(eta) };
            let [f, g] = [(forth[i], wo[i]), (back[i], wi[i])]
                .map(|(v, w)| f64::from(v.0[1]) / index(w).powi(2));
            assert!((f - g).abs() <= 1e-5 * f, "{eta} {:?} {:?}", wo[i], wi[i]);
            let (f, s) = (forth[i], swapped[i]);
            for (a, b) in [(f.0[1], s.0[1]), (f.1, s.2), (f.2, s.1)] {
                assert!((a - b).abs() <= 1e-5 * a, "{eta}: {a} {b}");
            }
            transmitted += usize::from(f.0[1] > 0.0);
        }
        assert!(transmitted > 100, "{transmitted}");
    }
}

/// Mean weight of samples in either mode, divided by what smooth glass has of it.
fn albedo(row: &[f32; 8], cos: f64, side: f64, mode: Mode) -> Mean {
    let n = 40_000;
    let mut random = Random(23);
    let wo = vec![at_angle(cos.acos(), 0.4, side); n];
    let u: Vec<[f32; 3]> = (0..n)
        .map(|_| std::array::from_fn(|_| random.uniform()))
        .collect();
    let mut mean = Mean::default();
    for (wi, weight, ..) in Kernels::sample::<f32x8>(KIND, row, &wo, &u, mode) {
        let crosses = f64::from(wi[2]) * side < 0.0;
        let scale = match mode {
            Mode::Radiance if crosses => f64::from(row[6]).powf(2.0 * side),
            _ => 1.0,
        };
        mean.add(f64::from(weight[0]) * scale);
    }
    mean
}

/// Nothing is gained; what is lost is what microfacets send into other microfacets, little where
/// they are smooth and none in the limit.
#[test]
fn white_glass_loses_only_what_is_scattered_twice() {
    let tail = normal_quantile(FALSE_ALARM);
    for eta in [0.7f32, 1.1, 1.5, 3.0] {
        for (cos, side, mode) in [
            (1.0, 1.0, Mode::Radiance),
            (0.7, -1.0, Mode::Radiance),
            (0.3, 1.0, Mode::Importance),
            (0.1, -1.0, Mode::Importance),
        ] {
            let mut last = 1.0;
            let mut before = 0.0;
            for alpha in [1e-3f32, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0] {
                let mean = albedo(&glass(eta, alpha, alpha), cos, side, mode);
                let reach = tail * mean.error() + 1e-5;
                let what = format!("eta {eta}, cos {cos}, side {side}, alpha {alpha}: {mean:?}");
                assert!(mean.mean() <= 1.0 + reach, "{what}");
                // Continuous, with a slope of the order of 1 / cos, as a metal's.
                let alpha = f64::from(alpha);
                let step = 2.0 * (alpha - before) * (1.0 + 0.2 / cos);
                assert!((mean.mean() - last).abs() <= step + reach, "{what}");
                (last, before) = (mean.mean(), alpha);
            }
        }
    }
}

/// As the roughness goes to 0, the share of reflections goes to the Fresnel reflectance, and
/// directions go to the mirror's and Snell's.
#[test]
fn nearly_smooth_glass_is_smooth_glass() {
    let mut random = Random(5);
    for eta in [0.7f32, 1.1, 1.5] {
        let row = glass(eta, 1e-3, 1e-3);
        for (theta, side) in [(0.0f64, 1.0), (0.5, -1.0), (1.2, 1.0)] {
            let wo = at_angle(theta, 0.4, side);
            let relative = f64::from(eta).powf(side);
            let (reflectance, _) = bsdf::dielectric(theta.cos(), relative);
            let n = 20_000;
            let u: Vec<[f32; 3]> = (0..n)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let wos = vec![wo; n];
            let mut reflected = 0.0;
            for (wi, ..) in Kernels::sample::<f32x8>(KIND, &row, &wos, &u, Mode::Radiance) {
                reflected += f64::from(u8::from(f64::from(wi[2]) * side > 0.0)) / n as f64;
            }
            let slack = 6.0 * (reflectance * (1.0 - reflectance) / n as f64).sqrt() + 1e-3;
            assert!(
                (reflected - reflectance).abs() <= slack,
                "{eta} {theta}: {reflected} {reflectance}"
            );
        }
    }
}

#[test]
fn packed_alphas_are_right_to_a_few_thousandths() {
    for i in 0..=6000 {
        let alpha = 10f32
            .powf(f32::from(i as u16) / 1000.0 - 3.0)
            .clamp(1e-3, 1e3);
        let packed = pack_alphas(alpha, 1.0);
        assert!(packed.is_normal());
        let (x, y) = unpacked_alphas(packed.into());
        assert!((x / f64::from(alpha) - 1.0).abs() <= 1.0 / 2048.0 && y == 1.0);
        let here = phalanx::surface::microfacet::TrowbridgeReitz::<f32>::of_packed(packed);
        assert_eq!((f64::from(here.ax), f64::from(here.ay)), (x, y));
    }
}
