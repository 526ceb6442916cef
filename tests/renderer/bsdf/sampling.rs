//! Samples against the densities that BSDFs say of them.

use super::rows::{at_angle, rough_rows};
use crate::common::bsdf::{Kernels, shaken};
use crate::common::stats::{FALSE_ALARM, Random, assert_follows};
use phalanx::replay::bsdf;
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::{Kind, Mode};
use std::f64::consts::TAU;

fn is_glossy(kind: Kind) -> bool {
    matches!(kind, Kind::RoughConductor | Kind::Plastic)
}

/// Rows whose density one of the maps below spreads out: a narrow lobe and a wide one together have
/// none.
fn rows_for_chi_square() -> Vec<(Kind, [f32; 8])> {
    let mut rows = rough_rows();
    // Half of a substrate's samples are diffuse, and black ones count as lost.
    rows.retain(|(kind, row)| {
        *kind != Kind::Substrate || row[6].min(row[7]) >= 0.2 && row[3] > 0.0
    });
    rows.retain(|(kind, row)| match kind {
        Kind::CoatedDiffuse => {
            let (ax, ay) = bsdf::unpacked_alphas(row[4].into());
            ax.min(ay) >= 0.2
        }
        // The lobe of the conductor is that much wider outside.
        // Thinner than air: nothing comes from beyond the critical angle, and black samples count
        // as lost. The density of a conductor's lobe is infinite there, which the midpoint
        // rule does not see.
        Kind::CoatedDiffuseBase | Kind::CoatedConductorBase | Kind::CoatedConductor
            if row[3] < 1.0 =>
        {
            false
        }
        Kind::CoatedConductor | Kind::CoatedConductorBase => {
            let (ax, ay) = bsdf::unpacked_alphas(row[5].into());
            ax.min(ay) >= 0.2
        }
        _ => true,
    });
    // These scatter into both hemispheres, and have files of their own.
    rows.retain(|(kind, _)| !matches!(kind, Kind::RoughDielectric | Kind::Hair));
    for (kind, row) in &mut rows {
        if *kind == Kind::Plastic && row[6].min(row[7]) < 0.2 {
            row[..3].fill(0.0);
        }
    }
    rows
}

/// Directions are spread by slopes of the half vector, not by the cosine.
fn by_slopes(kind: Kind, row: &[f32; 8]) -> bool {
    is_glossy(kind) && row[..3] == [0.0; 3] || kind == Kind::RoughConductor
}

/// Slopes of the half vector over the roughness, in polar coordinates. The radius `r` stands as
/// `q = r^2 / (1 + r^2)`: microfacet lobes of any roughness spread over this square. Returns the
/// direction that belongs to a point of it, and its Jacobian to solid angle.
fn from_slopes(wo: V, ax: f64, ay: f64, q: f64, phi: f64) -> Option<(V, f64)> {
    let r = (q / (1.0 - q)).sqrt();
    let h = unit([r * phi.cos() * ax, r * phi.sin() * ay, 1.0]);
    let c = dot(wo, h);
    let wi = sub(scale(h, 2.0 * c), wo);
    let jacobian = 4.0 * c * h[2].powi(3) * ax * ay / (2.0 * (1.0 - q) * (1.0 - q));
    (c > 0.0 && wi[2] > 0.0).then_some((wi, jacobian))
}

fn to_slopes(wo: V, ax: f64, ay: f64, wi: V) -> (f64, f64) {
    let h = unit(add(wo, wi));
    let (x, y) = (h[0] / h[2] / ax, h[1] / h[2] / ay);
    let r2 = x * x + y * y;
    (r2 / (1.0 + r2), y.atan2(x).rem_euclid(TAU))
}

/// The hemisphere as a square: areas of a sphere are those of its cylinder.
fn from_height(z: f64, phi: f64) -> V {
    let r = (1.0 - z * z).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

#[test]
fn sampling_follows_the_density() {
    const CELLS: usize = 12;
    const FINE: usize = 24;
    const SAMPLES: usize = 150_000;
    let angles = [0.0, 0.7, 1.4];
    let cases = rows_for_chi_square();
    let p = FALSE_ALARM / (cases.len() * angles.len()) as f64;
    let mut random = Random(1);
    for (kind, row) in cases {
        for theta in angles {
            let side = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
            let wo32 = at_angle(theta, 0.6, side);
            let wo = [wo32[0].into(), wo32[1].into(), f64::from(wo32[2]).abs()];
            let (ax, ay) = (f64::from(row[6]), f64::from(row[7]));
            // Expected: densities reported by `eval`, by the midpoint rule.
            let mut expected = vec![0.0; CELLS * CELLS + 1];
            let (mut at, mut wi, mut jacobian) = (vec![], vec![], vec![]);
            let n = CELLS * FINE;
            for i in 0..n * n {
                let q = ((i % n) as f64 + 0.5) / n as f64;
                let phi = ((i / n) as f64 + 0.5) / n as f64 * TAU;
                let point = if by_slopes(kind, &row) {
                    from_slopes(wo, ax, ay, q, phi)
                } else if kind == Kind::DiffuseTransmission {
                    Some((from_height(2.0 * q - 1.0, phi), 2.0))
                } else {
                    Some((from_height(q, phi), 1.0))
                };
                if let Some((w, j)) = point {
                    at.push(i % n / FINE + CELLS * (i / n / FINE));
                    wi.push(narrow([w[0], w[1], side * w[2]]));
                    jacobian.push(j);
                }
            }
            let values =
                Kernels::eval::<f32x8>(kind, &row, &vec![wo32; wi.len()], &wi, Mode::Radiance);
            let cell = TAU / (n * n) as f64 * SAMPLES as f64;
            for ((value, at), j) in values.iter().zip(&at).zip(&jacobian) {
                expected[*at] += f64::from(value.1) * j * cell;
            }
            let all: f64 = expected.iter().sum();
            assert!(
                all < 1.01 * SAMPLES as f64,
                "{kind:?} {row:?} {theta} {all}"
            );
            // Samples below the surface are lost.
            expected[CELLS * CELLS] = (SAMPLES as f64 - all).max(0.0);
            let u: Vec<[f32; 3]> = (0..SAMPLES)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let sampled =
                Kernels::sample::<f32x8>(kind, &row, &vec![wo32; SAMPLES], &u, Mode::Radiance);
            let mut observed = vec![0.0; CELLS * CELLS + 1];
            for (wi, weight, ..) in sampled {
                let w = [wi[0].into(), wi[1].into(), f64::from(wi[2]) * side];
                let transmits = kind == Kind::DiffuseTransmission;
                if weight == [0.0; 3] || (w[2] <= 0.0 && !transmits) {
                    observed[CELLS * CELLS] += 1.0;
                    continue;
                }
                let (q, phi) = if by_slopes(kind, &row) {
                    to_slopes(wo, ax, ay, w)
                } else {
                    let q = if transmits { (w[2] + 1.0) / 2.0 } else { w[2] };
                    (q, w[1].atan2(w[0]).rem_euclid(TAU))
                };
                let index = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
                observed[index(q) + CELLS * index(phi / TAU)] += 1.0;
            }
            assert_follows(
                &observed,
                &expected,
                p,
                &format!("{kind:?} {row:?} at {theta}"),
            );
        }
    }
}

#[test]
fn samples_and_evaluations_are_consistent() {
    let mut random = Random(2);
    for (kind, row) in rough_rows() {
        for theta in [0.0, 0.3, 1.0, 1.5, 1.570] {
            for side in [1.0, -1.0] {
                let wo = vec![at_angle(theta, 2.0, side); 64];
                let u: Vec<[f32; 3]> = (0..64)
                    .map(|_| std::array::from_fn(|_| random.uniform()))
                    .collect();
                let sampled = Kernels::sample::<f32x8>(kind, &row, &wo, &u, Mode::Importance);
                let wi: Vec<[f32; 3]> = sampled.iter().map(|s| s.0).collect();
                let forth = Kernels::eval::<f32x8>(kind, &row, &wo, &wi, Mode::Importance);
                let back = Kernels::eval::<f32x8>(kind, &row, &wi, &wo, Mode::Radiance);
                for (i, (wi, weight, pdf, pdf_reverse)) in sampled.into_iter().enumerate() {
                    if weight == [0.0; 3] {
                        continue;
                    }
                    let what = format!("{kind:?} {row:?} {:?} {wi:?}", wo[i]);
                    let (f, p, r) = forth[i];
                    // The same few operations on the same directions.
                    let near = |a: f32, b: f32, what: &str| {
                        let ulps = 16.0 * f32::EPSILON * a.abs().max(b.abs());
                        assert!((a - b).abs() <= ulps, "{what}: {a} {b}");
                    };
                    let length = dot(wide(wi), wide(wi)).sqrt();
                    assert!((length - 1.0).abs() < 1e-5, "{what}: length {length}");
                    near(pdf, p, &format!("pdf, {what}"));
                    near(pdf_reverse, r, &format!("reverse, {what}"));
                    for c in 0..3 {
                        let expected = f[c] * wi[2].abs() / p;
                        near(weight[c], expected, &format!("weight, {what}"));
                    }
                    // The swapped pair: the same, but for the rounding of the two cosines against
                    // the half vector.
                    let shallow = wo[i][2].abs().min(wi[2].abs());
                    let mut relative = f32::EPSILON * (16.0 + 4.0 / shallow);
                    if kind == Kind::Plastic {
                        // Its Fresnel term is steep at the critical angle.
                        let h = unit(add(wide(wo[i]), wide(wi)));
                        let c = dot(h, wide(wi)).abs().min(1.0);
                        let f = |c: f64| bsdf::dielectric(c, 1.0 / 1.5).0;
                        relative += (shaken(f, c) / f(c)) as f32;
                    }
                    let near = |a: f32, b: f32, what: &str| {
                        let slack = relative * a.abs().max(b.abs());
                        assert!((a - b).abs() <= slack, "{what}: {a} {b}");
                    };
                    near(back[i].1, r, &format!("reverse pdf, {what}"));
                    near(back[i].2, p, &format!("reversed reverse, {what}"));
                    for (back, forth) in back[i].0.into_iter().zip(f) {
                        near(back, forth, &format!("reciprocity, {what}"));
                    }
                }
            }
        }
    }
}
