//! Scattering functions: sampling against densities, values against `f64`, energy, extremes.

mod rows;
mod sampling;

use self::rows::{at_angle, delta_rows, rough_rows};
use crate::common;

use common::bsdf::{Evaluated, Kernels, Sampled, shaken};
use common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::replay::bsdf;
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::{Kind, Mode, fresnel};
use std::f64::consts::PI;

const EPSILON: f64 = f32::EPSILON as f64;

/// The roughness that a row has, in one direction.
fn roughness_of(kind: Kind, row: &[f64; 8]) -> f64 {
    match kind {
        Kind::RoughDielectric => bsdf::unpacked_alphas(row[7]).0,
        Kind::CoatedDiffuse | Kind::CoatedConductor => bsdf::unpacked_alphas(row[4]).0,
        Kind::CoatedConductorBase => bsdf::unpacked_alphas(row[5]).0,
        Kind::CoatedDiffuseBase => 1.0,
        _ => row[6],
    }
}

#[test]
fn values_are_those_of_the_formulas() {
    let mut random = Random(3);
    for (kind, row) in rough_rows() {
        let row64 = row.map(f64::from);
        let mode = if random.uniform() < 0.5 {
            Mode::Radiance
        } else {
            Mode::Importance
        };
        let wo: Vec<[f32; 3]> = (0..2000).map(|_| narrow(random.direction())).collect();
        // Half of the directions near the mirror direction, where lobes are.
        let wi: Vec<[f32; 3]> = (wo.iter().enumerate())
            .map(|(i, w)| {
                let mirror = [-f64::from(w[0]), -f64::from(w[1]), w[2].into()];
                let spread = if i % 2 == 0 {
                    4.0
                } else {
                    roughness_of(kind, &row64) + 1e-4
                };
                narrow(unit(add(mirror, scale(random.direction(), spread))))
            })
            .collect();
        // From inside, an index near 1 is rounded as a whole, and what is seen of it depends on its
        // distance from 1.
        let by_index = match kind {
            Kind::RoughDielectric => 4.0 * EPSILON / (row64[6] - 1.0).abs(),
            _ => 0.0,
        };
        let values = Kernels::eval::<f32x8>(kind, &row, &wo, &wi, mode);
        for ((wo, wi), (f, pdf, reverse)) in wo.iter().zip(&wi).zip(values) {
            let want = bsdf::eval(kind, &row64, wide(*wo), wide(*wi), mode);
            // Directions are as good as their last place; a half vector made of them in `f32`, a
            // few places worse.
            let (mut shaken, mut trial) = ([0.0f64; 5], 0);
            while trial < 8 {
                let mut shake = |w: [f32; 3]| {
                    let moved = add(wide(w), scale(random.direction(), 4.0 * EPSILON));
                    unit(moved)
                };
                let other = bsdf::eval(kind, &row64, shake(*wo), shake(*wi), mode);
                let change = [
                    other.pdf - want.pdf,
                    other.pdf_reverse - want.pdf_reverse,
                    other.f[0] - want.f[0],
                    other.f[1] - want.f[1],
                    other.f[2] - want.f[2],
                ];
                (shaken.iter_mut().zip(change)).for_each(|(s, c)| *s = s.max(c.abs()));
                trial += 1;
            }
            let near = |a: f32, b: f64, shaken: f64, what: &str| {
                let tolerance = (32.0 * EPSILON + by_index) * b + 4.0 * shaken + 1e-30;
                assert!(
                    (f64::from(a) - b).abs() <= tolerance,
                    "{what} of {kind:?} {row:?} at {wo:?} {wi:?}: {a} is {b} +- {tolerance:e}"
                );
            };
            near(pdf, want.pdf, shaken[0], "density");
            near(reverse, want.pdf_reverse, shaken[1], "reverse density");
            for c in 0..3 {
                near(f[c], want.f[c], shaken[2 + c], "value");
            }
        }
    }
}

/// `A + B g(theta)`, the integral of the factor over the hemisphere with `sin alpha tan beta` split
/// where the angles swap.
fn oren_nayar_albedo(a: f64, b: f64, theta: f64) -> f64 {
    let below = theta.sin() * (theta / 2.0 - (2.0 * theta).sin() / 4.0);
    let above = theta.tan() * (1.0 - theta.sin().powi(3)) / 3.0;
    a + b * (below + above) * 2.0 / PI
}

#[test]
fn nothing_reflects_more_than_it_receives() {
    let mut random = Random(4);
    for (kind, row) in rough_rows() {
        // Of light that hair scatters, the cosine is not that of where it goes.
        if kind == Kind::Hair {
            continue;
        }
        for theta in [0.0, 0.5, 1.2, 1.5, 1.57] {
            let mut mean = Mean::default();
            let n = 20_000;
            let u: Vec<[f32; 3]> = (0..n)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let wo = vec![at_angle(theta, 1.0, 1.0); n];
            for s in Kernels::sample::<f32x8>(kind, &row, &wo, &u, Mode::Importance) {
                mean.add(s.1[0].into());
            }
            // The qualitative model of Oren and Nayar is not passive by itself; its albedo is
            // known.
            let most = match kind {
                Kind::OrenNayar => oren_nayar_albedo(row[3].into(), row[4].into(), theta),
                _ => 1.0,
            };
            let bound = most + normal_quantile(FALSE_ALARM) * mean.error() + 1e-5;
            assert!(
                mean.mean() <= bound,
                "{kind:?} {row:?} at {theta}: {mean:?}"
            );
        }
    }
}

#[test]
fn diffuse_sheets_divide_light_by_their_colours() {
    let mut random = Random(7);
    for (kind, row) in rough_rows() {
        if kind != Kind::DiffuseTransmission {
            continue;
        }
        for side in [1.0, -1.0] {
            let n = 40_000;
            let u: Vec<[f32; 3]> = (0..n)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let wo = vec![at_angle(0.8, 1.0, side); n];
            // Reflected and transmitted, three channels each.
            let mut means = [Mean::default(); 6];
            for s in Kernels::sample::<f32x8>(kind, &row, &wo, &u, Mode::Radiance) {
                let reflected = s.0[2] * wo[0][2] > 0.0;
                for (i, mean) in means.iter_mut().enumerate() {
                    let here = reflected == (i < 3);
                    mean.add(if here { s.1[i % 3].into() } else { 0.0 });
                }
            }
            for (mean, albedo) in means.iter().zip(row) {
                let reach = normal_quantile(FALSE_ALARM) * mean.error() + 1e-6;
                assert!(
                    (mean.mean() - f64::from(albedo)).abs() <= reach,
                    "{row:?}: {mean:?}"
                );
            }
        }
    }
}

/// Of a smooth coat: Schlick's share is reflected, what is admitted is in the end given to the
/// base, both ways.
#[test]
fn substrates_reflect_what_the_model_says() {
    let mut random = Random(8);
    for (rd, rs) in [(1.0, 0.0), (0.5, 0.04), (0.0, 0.5), (1.0, 1.0), (0.8, 0.3)] {
        for theta in [0.0, 0.5, 1.0, 1.3] {
            let n = 100_000;
            let u: Vec<[f32; 3]> = (0..n)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let row = [rd, rd, rd, rs, rs, rs, 0.001, 0.001];
            let wo = vec![at_angle(theta, 1.0, 1.0); n];
            let mut mean = Mean::default();
            for s in Kernels::sample::<f32x8>(Kind::Substrate, &row, &wo, &u, Mode::Radiance) {
                mean.add(s.1[0].into());
            }
            let (rd, rs, c) = (f64::from(rd), f64::from(rs), theta.cos());
            let base = rd * (1.0 - rs) * (1.0 - (1.0 - c / 2.0).powi(5));
            let coat = rs + (1.0 - rs) * (1.0 - c).powi(5);
            // A lobe of this width is not quite a mirror's.
            let reach = normal_quantile(FALSE_ALARM) * mean.error() + 0.01 * coat;
            assert!(
                (mean.mean() - base - coat).abs() <= reach,
                "{rd} {rs} at {theta}: {mean:?} is {}",
                base + coat
            );
        }
    }
}

#[test]
fn smooth_glass_keeps_energy() {
    let mut random = Random(5);
    for (kind, row) in delta_rows() {
        for _ in 0..2000 {
            let wo = narrow(random.direction());
            let u = std::array::from_fn(|_| random.uniform());
            let importance = Kernels::sample::<f32>(kind, &row, &[wo], &[u], Mode::Importance)[0];
            let radiance = Kernels::sample::<f32>(kind, &row, &[wo], &[u], Mode::Radiance)[0];
            let wi = importance.0;
            assert_eq!(wi, radiance.0);
            let reflected = wi[2] * wo[2] > 0.0;
            if kind == Kind::ThinDielectric {
                let reflectance = bsdf::sheet(f64::from(wo[2]).abs(), row[0].into());
                if (f64::from(u[2]) - reflectance).abs() > 1e-4 {
                    assert_eq!(reflected, f64::from(u[2]) < reflectance, "{row:?} {wo:?}");
                }
                let z = if reflected { wo[2] } else { -wo[2] };
                let all = [1.0; 3];
                assert_eq!(importance, ([-wo[0], -wo[1], z], all, 1.0, 1.0));
                assert_eq!(importance, radiance);
                continue;
            }
            if kind != Kind::SmoothDielectric {
                assert!(reflected && importance.1 == radiance.1);
                assert!(importance.1.iter().all(|w| (0.0..=1.0).contains(w)));
                continue;
            }
            assert_eq!(importance.1, [1.0; 3]);
            let eta = if wo[2] > 0.0 { row[6] } else { 1.0 / row[6] };
            let (reflectance, cos_t) = bsdf::dielectric(f64::from(wo[2]).abs(), eta.into());
            if (f64::from(u[2]) - reflectance).abs() > 1e-4 {
                assert_eq!(reflected, f64::from(u[2]) < reflectance, "{row:?} {wo:?}");
            }
            if reflected {
                assert_eq!(radiance.1, [1.0; 3]);
                assert_eq!(wi, [-wo[0], -wo[1], wo[2]]);
                assert_eq!(importance.3, 1.0);
                continue;
            }
            // Radiance over n^2 is what a refraction keeps.
            let scaled = radiance.1[0] * eta * eta;
            assert!((scaled - 1.0).abs() < 4.0 * f32::EPSILON, "{scaled}");
            // Snell; near the critical angle the cosine is the root of a small difference.
            let sin2 = f64::from(wi[0]).powi(2) + f64::from(wi[1]).powi(2);
            let snell = (1.0 - f64::from(wo[2]).powi(2)) / f64::from(eta).powi(2);
            assert!((sin2 - snell).abs() < 8.0 * EPSILON, "{sin2} {snell}");
            let slack = 4.0 * EPSILON / cos_t.max(1e-3) + 1e-6;
            assert!(
                (f64::from(wi[2]).abs() - cos_t).abs() < slack.max(1e-6),
                "{wi:?} {cos_t}"
            );
            // The density back, over the density forth, is the change of solid angle.
            let back = f64::from(wo[2]).abs() / f64::from(wi[2]).abs() / f64::from(eta).powi(2);
            assert!((f64::from(importance.3) / back - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn both_widths_give_the_same_bits() {
    let mut random = Random(6);
    for (kind, row) in rough_rows().into_iter().chain(delta_rows()) {
        let wo: Vec<[f32; 3]> = (0..256).map(|_| narrow(random.direction())).collect();
        let wi: Vec<[f32; 3]> = (0..256).map(|_| narrow(random.direction())).collect();
        let u: Vec<[f32; 3]> = (0..256)
            .map(|_| std::array::from_fn(|_| random.uniform()))
            .collect();
        for mode in [Mode::Radiance, Mode::Importance] {
            let one = Kernels::sample::<f32>(kind, &row, &wo, &u, mode);
            let eight = Kernels::sample::<f32x8>(kind, &row, &wo, &u, mode);
            let bits = |s: &Sampled| {
                let mut all = [0; 8];
                let values = s.0.iter().chain(&s.1).chain([&s.2, &s.3]);
                all.iter_mut()
                    .zip(values)
                    .for_each(|(a, v)| *a = v.to_bits());
                all
            };
            for (a, b) in one.iter().zip(&eight) {
                assert_eq!(bits(a), bits(b), "{kind:?} {row:?}");
            }
        }
        for mode in [Mode::Radiance, Mode::Importance] {
            let one = Kernels::eval::<f32>(kind, &row, &wo, &wi, mode);
            let eight = Kernels::eval::<f32x8>(kind, &row, &wo, &wi, mode);
            for (a, b) in one.iter().zip(&eight) {
                let bits = |v: &Evaluated| (v.0.map(f32::to_bits), v.1.to_bits(), v.2.to_bits());
                assert_eq!(bits(a), bits(b), "{kind:?} {row:?}");
            }
        }
    }
}

#[test]
fn grazing_angles_give_numbers() {
    let corner = [0.0, 1.0 / 16_777_216.0, 0.5, 1.0 - f32::EPSILON / 2.0];
    let mut wo = vec![[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    for exponent in [-45, -38, -30, -20, -10, -7, -5, -3, -1] {
        for side in [1.0, -1.0] {
            let z = 10f64.powi(exponent);
            let r = (1.0 - z * z).sqrt();
            wo.push(narrow([r * 0.6, -r * 0.8, side * z]));
            wo.push(narrow([r, 0.0, side * z]));
            // Nearly along the normal.
            wo.push(narrow([z, 0.0, side]));
        }
    }
    for (kind, row) in rough_rows().into_iter().chain(delta_rows()) {
        for &o in &wo {
            for i in 0..64 {
                let u = [corner[i % 4], corner[i / 4 % 4], corner[i / 16]];
                let (wi, weight, pdf, reverse) =
                    Kernels::sample::<f32>(kind, &row, &[o], &[u], Mode::Radiance)[0];
                let what =
                    format!("{kind:?} {row:?} {o:?} {u:?}: {wi:?} {weight:?} {pdf} {reverse}");
                assert!(weight.iter().all(|w| w.is_finite() && *w >= 0.0), "{what}");
                if weight != [0.0; 3] {
                    assert!(wi.iter().all(|w| w.is_finite()), "{what}");
                    assert!(pdf > 0.0 && reverse >= 0.0, "{what}");
                    assert!(pdf.is_finite() && reverse.is_finite(), "{what}");
                }
            }
            for &i in &wo {
                let (f, pdf, reverse) =
                    Kernels::eval::<f32>(kind, &row, &[o], &[i], Mode::Radiance)[0];
                let what = format!("{kind:?} {row:?} {o:?} {i:?}: {f:?} {pdf} {reverse}");
                assert!(f.iter().all(|v| v.is_finite() && *v >= 0.0), "{what}");
                assert!(pdf.is_finite() && pdf >= 0.0, "{what}");
                assert!(reverse.is_finite() && reverse >= 0.0, "{what}");
            }
        }
    }
}

#[test]
fn fresnel_of_conductors() {
    use phalanx::simd::Vec3;
    for eta in [0.0, 0.05, 0.3, 0.5, 1.0, 1.5, 3.0, 4.0f32] {
        for k in [0.0, 1e-3, 0.1, 0.5, 1.0, 2.0, 4.0, 10.0f32] {
            for i in 0..=1000 {
                let c = (f64::from(i) / 1000.0) as f32;
                let got =
                    fresnel::conductor::<f32>(c, Vec3::splat([eta; 3]), Vec3::splat([k; 3])).x;
                let f = |x: f64| bsdf::conductor(x, eta.into(), k.into());
                let want = f(c.into());
                // Conditioned by the cosine, and by the indices where a root is taken of their
                // squares' difference.
                let d = 4.0 * EPSILON;
                let by_index = [
                    (1.0 + d, 1.0),
                    (1.0 - d, 1.0),
                    (1.0, 1.0 + d),
                    (1.0, 1.0 - d),
                ]
                .into_iter()
                .map(|(a, b)| {
                    let v = bsdf::conductor(c.into(), f64::from(eta) * a, f64::from(k) * b);
                    (v - want).abs()
                })
                .fold(0.0, f64::max);
                // a^2 = (|n^2 - sin^2| + Re(n^2 - sin^2)) / 2 cancels for good conductors.
                let (e, k64, c64) = (f64::from(eta), f64::from(k), f64::from(c));
                let re = e * e - k64 * k64 - (1.0 - c64 * c64);
                let modulus = re.hypot(2.0 * e * k64);
                let a2 = (modulus + re).max(0.0) / 2.0;
                let lost = (a2 + 4.0 * EPSILON * modulus).sqrt() - a2.sqrt();
                let cancelled = 8.0 * c64 * lost / (modulus + c64 * c64).max(1e-300);
                let slack = shaken(f, c.into()) + by_index + cancelled + 32.0 * EPSILON;
                assert!(
                    (f64::from(got) - want).abs() <= slack && (0.0..=1.0 + 1e-6).contains(&got),
                    "eta {eta}, k {k}, cos {c}: {got} is {want} +- {slack:e}"
                );
            }
        }
    }
}

#[test]
fn normals_of_microfacets_integrate_to_one() {
    // The projected area of all microfacets is that of the surface.
    for alpha in [0.01, 0.2, 1.0] {
        let n = 2000;
        let sum: f64 = (0..n)
            .map(|i| {
                let q = (f64::from(i) + 0.5) / f64::from(n);
                let r = (q / (1.0 - q)).sqrt() * alpha;
                let h = unit([r, 0.0, 1.0]);
                let j = h[2].powi(3) * alpha * alpha / (2.0 * (1.0 - q).powi(2));
                bsdf::ggx_d(h, alpha, alpha) * h[2] * j * 2.0 * PI / f64::from(n)
            })
            .sum();
        assert!((sum - 1.0).abs() < 1e-3, "{alpha} {sum}");
    }
}
