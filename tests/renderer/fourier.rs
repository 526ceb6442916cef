//! Tabulated Fourier series: tables of functions that are known, their samples, and files that are
//! none.

use crate::{common, support};

use common::stats::{FALSE_ALARM, Random, assert_follows};
use phalanx::replay::vector::*;
use phalanx::simd::{Lanes, Vec3, f32x8};
use phalanx::surface::fourier::Fourier;
use phalanx::surface::fourier_table::FourierTable;
use phalanx::surface::{Bsdf, BsdfValue, Mode, Tabulated};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A file of `f(wo, wi) |cos wi|` of a function of the cosines of `-wi` and `wo` and of the azimuth
/// between, as layerlab writes it.
fn file(mu: &[f32], orders: usize, channels: usize, f: impl Fn(f64, f64, f64) -> V) -> Vec<u8> {
    let n = mu.len();
    let (mut series, mut coefficients) = (Vec::new(), Vec::<f32>::new());
    let mut means = vec![0.0f64; n * n];
    for (o, mu_o) in mu.iter().enumerate() {
        for (i, mu_i) in mu.iter().enumerate() {
            let steps = 4 * orders;
            let values: Vec<V> = (0..steps)
                .map(|s| {
                    f(
                        (*mu_i).into(),
                        (*mu_o).into(),
                        (s as f64 + 0.5) * PI / steps as f64,
                    )
                })
                .collect();
            series.push([coefficients.len() as u32, orders as u32]);
            for c in 0..channels {
                for k in 0..orders {
                    let term = |(s, v): (usize, &V)| {
                        v[c] * (k as f64 * (s as f64 + 0.5) * PI / steps as f64).cos()
                    };
                    let sum: f64 = values.iter().enumerate().map(term).sum();
                    let factor = if k == 0 { 1.0 } else { 2.0 };
                    coefficients.push((factor * sum / steps as f64) as f32);
                }
            }
            let mean = series[series.len() - 1][0] as usize;
            means[o * n + i] = coefficients[mean].into();
        }
    }
    let cdf = means.chunks(n).flat_map(|row| integrals(mu, row));
    let mut bytes = b"SCATFUN\x01".to_vec();
    let head = [1, n, coefficients.len(), orders, channels, 1, 0, 0, 0];
    let mut words: Vec<u32> = head.map(|x| x as u32).to_vec();
    words.push(1f32.to_bits());
    words.extend([0; 4]);
    words.extend(mu.iter().map(|x| x.to_bits()));
    words.extend(cdf.map(|x| (x as f32).to_bits()));
    words.extend(series.into_iter().flatten());
    words.extend(coefficients.iter().map(|x| x.to_bits()));
    bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
    bytes
}

/// Of Catmull-Rom splines, up to each node.
fn integrals(mu: &[f32], row: &[f64]) -> Vec<f64> {
    let x = |i: usize| f64::from(mu[i]);
    let n = mu.len();
    let mut sums = vec![0.0];
    for i in 0..n - 1 {
        let width = x(i + 1) - x(i);
        let slope = |a: usize, b: usize| width * (row[b] - row[a]) / (x(b) - x(a));
        let even = row[i + 1] - row[i];
        let d0 = if i > 0 { slope(i - 1, i + 1) } else { even };
        let d1 = if i + 2 < n { slope(i, i + 2) } else { even };
        let part = width * ((row[i] + row[i + 1]) / 2.0 + (d0 - d1) / 12.0);
        sums.push(sums[i] + part);
    }
    sums
}

/// Cosines, dense at the ends and on both sides of 0.
fn cosines(n: usize) -> Vec<f32> {
    let half = |k: usize| (1.0 - (PI * (k as f64 + 0.5) / n as f64).cos()) / 2.0;
    let up: Vec<f32> = (0..n).map(|k| half(k) as f32).collect();
    let down = up.iter().rev().map(|x| -x);
    [&[-1.0][..], &down.collect::<Vec<_>>(), &up, &[1.0]].concat()
}

/// `f |cos wi|` of grey reflection off rough metal (Trowbridge and Reitz), of alpha 0.5.
fn metal(mu_i: f64, mu_o: f64, phi: f64) -> V {
    if mu_i * mu_o >= 0.0 {
        return [0.0; 3];
    }
    let direction = |z: f64, phi: f64| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * phi.cos(), r * phi.sin(), z.abs()]
    };
    // The azimuth is that of `-wi`.
    let (o, i) = (direction(mu_o, 0.0), direction(mu_i, phi + PI));
    let h = unit(add(o, i));
    let a2 = 0.25;
    let d = a2 / (PI * (h[2] * h[2] * (a2 - 1.0) + 1.0).powi(2));
    let lambda = |z: f64| ((1.0 + a2 * (1.0 / (z * z) - 1.0)).sqrt() - 1.0) / 2.0;
    let g = 1.0 / (1.0 + lambda(o[2]) + lambda(i[2]));
    let f = d * g / (4.0 * o[2] * i[2]);
    [f * i[2], 0.5 * f * i[2], 0.25 * f * i[2]]
}

fn lambert(albedo: f64) -> impl Fn(f64, f64, f64) -> V {
    move |mu_i, mu_o, _| {
        [if mu_i * mu_o < 0.0 {
            albedo * mu_i.abs() / PI
        } else {
            0.0
        }; 3]
    }
}

fn tables(file: &[u8]) -> Tabulated {
    let mut tables = Tabulated::default();
    let table = FourierTable::parse(file).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(tables.name_of(&Arc::new(table)), 0.0);
    tables
}

fn eval<L: Lanes>(tables: &Tabulated, wo: V, wi: V, mode: Mode) -> BsdfValue<L> {
    let [wo, wi] = [narrow(wo), narrow(wi)].map(Vec3::splat);
    Fourier::eval_in(tables, &[L::zero(); 8], wo, wi, mode)
}

#[test]
fn tables_have_the_values_of_what_they_were_made_of() {
    let mut random = Random(1);
    let plain = tables(&file(&cosines(24), 1, 1, lambert(0.7)));
    let glossy = tables(&file(&cosines(32), 40, 1, metal));
    for _ in 0..2000 {
        let (wo, wi) = (random.direction(), random.direction());
        if wo[2].abs().min(wi[2].abs()) < 0.25 {
            continue;
        }
        let value = eval::<f32>(&plain, wo, wi, Mode::Radiance);
        let expected = if wo[2] * wi[2] > 0.0 { 0.7 / PI } else { 0.0 };
        assert!(
            (f64::from(value.f.x) - expected).abs() < 2e-4,
            "{wo:?} {wi:?} {value:?}"
        );
        let density = if wo[2] * wi[2] > 0.0 {
            wi[2].abs() / PI
        } else {
            0.0
        };
        assert!(
            (f64::from(value.pdf) - density).abs() < 2e-3,
            "{value:?} {density}"
        );

        let value = eval::<f32>(&glossy, wo, wi, Mode::Radiance);
        let phi = wo[1].atan2(wo[0]) - (-wi[1]).atan2(-wi[0]);
        let expected = metal(-wi[2], wo[2], phi)[0] / wi[2].abs();
        let off = (f64::from(value.f.x) - expected).abs();
        assert!(
            off < 0.01 + 0.03 * expected,
            "{wo:?} {wi:?} {value:?} {expected}"
        );
        // Both kinds of walk see one function.
        let back = eval::<f32>(&glossy, wi, wo, Mode::Importance);
        assert_eq!(
            (back.f.x, back.pdf, back.pdf_reverse),
            (value.f.x, value.pdf_reverse, value.pdf)
        );
        let eight = eval::<f32x8>(&glossy, wo, wi, Mode::Radiance);
        assert_eq!(
            (eight.f.lane(5), eight.pdf.lane(5)),
            (value.f.lane(0), value.pdf)
        );
    }
}

#[test]
fn colours_are_luminance_red_and_blue() {
    let y = 0.2126 * 0.8 + 0.7152 * 0.4 + 0.0722 * 0.1;
    let colour = |mu_i: f64, mu_o: f64, phi: f64| {
        let [x, ..] = lambert(1.0)(mu_i, mu_o, phi);
        [y * x, 0.8 * x, 0.1 * x]
    };
    let tables = tables(&file(&cosines(24), 1, 3, colour));
    let wi = unit([0.3, 0.5, 0.6]);
    let value = eval::<f32>(&tables, unit([-0.5, 0.1, 0.8]), wi, Mode::Radiance);
    for (f, expected) in value.f.lane(0).into_iter().zip([0.8, 0.4, 0.1]) {
        assert!((f64::from(f) * PI - expected).abs() < 2e-3, "{value:?}");
    }
}

#[test]
fn sampling_follows_the_density() {
    const CELLS: usize = 10;
    const FINE: usize = 24;
    const SAMPLES: usize = 40_000;
    let mut random = Random(2);
    let tables = tables(&file(&cosines(24), 16, 1, metal));
    for wo in [
        unit([0.2, 0.1, 0.9]),
        unit([-0.8, 0.3, -0.4]),
        [0.0, 0.0, 1.0],
    ] {
        let wo32 = narrow(wo);
        let n = CELLS * FINE;
        let mut expected = vec![0.0; CELLS * CELLS + 1];
        for i in 0..n * n {
            let [x, y] = [i % n, i / n].map(|k| (k as f64 + 0.5) / n as f64);
            let (z, phi) = (2.0 * x - 1.0, y * TAU);
            let r = (1.0 - z * z).sqrt();
            let value = eval::<f32>(
                &tables,
                wo,
                [r * phi.cos(), r * phi.sin(), z],
                Mode::Radiance,
            );
            let share = 2.0 * TAU / (n * n) as f64 * SAMPLES as f64;
            expected[i % n / FINE + CELLS * (i / n / FINE)] += f64::from(value.pdf) * share;
        }
        let all: f64 = expected.iter().sum();
        // Where splines fall below 0 there is nothing, and what is sampled there is lost.
        assert!((all / SAMPLES as f64 - 1.0).abs() < 0.01, "{all}");
        expected[CELLS * CELLS] = (SAMPLES as f64 - all).max(0.0);
        let mut observed = vec![0.0; CELLS * CELLS + 1];
        for _ in 0..SAMPLES {
            let u = std::array::from_fn(|_| random.uniform());
            let wo = Vec3::<f32>::splat(wo32);
            let s = Fourier::sample_in(&tables, &[0.0; 8], wo, u, Mode::Radiance);
            let w = wide(s.wi.lane(0));
            if s.throughput.x == 0.0 {
                observed[CELLS * CELLS] += 1.0;
                continue;
            }
            assert!((dot(w, w) - 1.0).abs() < 1e-5, "{w:?}");
            let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
            let phi = w[1].atan2(w[0]).rem_euclid(TAU) / TAU;
            observed[cell((w[2] + 1.0) / 2.0) + CELLS * cell(phi)] += 1.0;
        }
        assert_follows(&observed, &expected, FALSE_ALARM / 3.0, &format!("{wo:?}"));
    }
}

#[test]
fn files_that_are_none_are_refused() {
    let good = file(&cosines(4), 2, 1, lambert(0.5));
    assert!(FourierTable::parse(&good).is_ok());
    let with = |at: usize, word: u32| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&word.to_le_bytes());
        FourierTable::parse(&bad).expect_err("is refused")
    };
    let mu = 64;
    let cdf = mu + 4 * 10;
    let series = cdf + 4 * 100;
    for (error, expected) in [
        (FourierTable::parse(&good[..40]).unwrap_err(), "too short"),
        (
            FourierTable::parse(&good[..good.len() - 4]).unwrap_err(),
            "cut short",
        ),
        (with(0, 0), "is no Fourier BSDF"),
        (with(8, 3), "flags 3"),
        (with(12, u32::MAX), "4294967295 cosines"),
        (with(12, 4000), "cut short"),
        (with(16, u32::MAX), "cut short"),
        (with(24, 2), "2 channels"),
        (with(44, f32::NAN.to_bits()), "index of refraction"),
        (with(mu + 8, 0.9f32.to_bits()), "do not rise"),
        (with(cdf + 4, f32::INFINITY.to_bits()), "no numbers"),
        (with(series, u32::MAX), "beyond its coefficients"),
        (with(series + 4, u32::MAX), "beyond its coefficients"),
    ] {
        assert!(error.contains(expected), "{error}: {expected}");
    }
}

/// A picture of a table is that of what it was made of, under all integrators.
#[test]
fn pictures_of_tables_are_those_of_surfaces() {
    use support::{expect_integrators_agree, head, run, scene, settings};
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("half.bsdf");
    std::fs::write(&name, file(&cosines(24), 1, 1, lambert(0.6))).unwrap();
    let text = |material: &str| {
        head(
            12,
            9,
            4,
            "LookAt 0 -3 1  0 0 .4  0 0 1\nCamera \"perspective\" \"float fov\" [45]",
        ) + "LightSource \"infinite\" \"rgb L\" [.3 .3 .3]
               LightSource \"point\" \"rgb I\" [8 8 8] \"point from\" [1 -2 3]\n"
            + material
            + "\nShape \"sphere\" \"float radius\" .7
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
               \"point P\" [-3 -3 -.7 3 -3 -.7 3 3 -.7 -3 3 -.7]\nWorldEnd\n"
    };
    let table = scene(&text(&format!(
        "Material \"fourier\" \"string bsdffile\" \"{}\"",
        name.display()
    )));
    assert!(table.warnings.is_empty(), "{:?}", table.warnings);
    expect_integrators_agree(&table, 64, 16, [3, 3], "fourier");
    let matte = scene(&text("Material \"matte\" \"rgb Kd\" [.6 .6 .6]"));
    let mean = |scene| {
        let picture = run(
            scene,
            &settings(scene, phalanx::scene::IntegratorKind::Pt, 256),
        );
        picture.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / picture.pixels.len() as f64
    };
    let (a, b) = (mean(&table), mean(&matte));
    assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
}
