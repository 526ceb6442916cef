//! Hair: its scattering function against textbook forms in `f64` and against its own samples,
//! energy, and pictures of it.

use crate::{common, support};

use common::bsdf::Kernels;
use common::stats::{FALSE_ALARM, Random, assert_follows};
use phalanx::replay::vector::*;
use phalanx::scene::IntegratorKind;
use phalanx::simd::f32x8;
use phalanx::surface::{HairMaterial, Kind, Mode, Pigment, hair};
use std::f64::consts::{PI, TAU};
use support::{Runs, expect_integrators_agree, head, scene, settings};

/// As scene files have it.
#[derive(Clone, Copy, Debug)]
struct Fibre {
    sigma: [f32; 3],
    h: f32,
    eta: f32,
    beta: [f32; 2],
    alpha: f32,
}

impl Fibre {
    fn row(&self) -> [f32; 8] {
        hair::row(self.sigma, self.h, self.eta, self.beta, self.alpha)
    }

    /// Variances and scale, by the polynomials of Chiang et al. 2016.
    fn widths(&self) -> ([f64; 4], f64) {
        let [m, n] = self.beta.map(f64::from);
        let v = (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2);
        let s = (PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22));
        ([v, v / 4.0, 4.0 * v, 4.0 * v], s)
    }

    /// `f |cos|` towards `i` of a camera at `o`, in angles, and the density of samples from `o`.
    fn value(&self, o: V, i: V, h: f64) -> (V, f64) {
        let (v, s) = self.widths();
        let eta = f64::from(self.eta);
        let (theta_o, theta_i) = (o[0].clamp(-1.0, 1.0).asin(), i[0].clamp(-1.0, 1.0).asin());
        let phi = i[2].atan2(i[1]) - o[2].atan2(o[1]);
        let gamma_o = h.asin();
        let bent = (eta * eta - theta_o.sin().powi(2)).sqrt() / theta_o.cos();
        let gamma_t = (h / bent).clamp(-1.0, 1.0).asin();
        let theta_t = (theta_o.sin() / eta).asin();
        let way = 2.0 * gamma_t.cos() / theta_t.cos();
        let f = phalanx::replay::bsdf::dielectric(theta_o.cos() * gamma_o.cos(), eta).0;
        let a: [V; 4] = {
            let t: V = std::array::from_fn(|c| (-f64::from(self.sigma[c]) * way).exp());
            let term = |g: &dyn Fn(f64) -> f64| t.map(g);
            [
                [f; 3],
                term(&|t| (1.0 - f).powi(2) * t),
                term(&|t| (1.0 - f).powi(2) * t * t * f),
                // A geometric series.
                term(&|t| (1.0 - f).powi(2) * t * (t * f).powi(2) / (1.0 - t * f)),
            ]
        };
        let total: f64 = a.iter().flatten().sum();
        let tilt = f64::from(self.alpha).to_radians();
        let (mut value, mut pdf) = ([0.0; 3], 0.0);
        for p in 0..4 {
            let theta = theta_o + [-2.0 * tilt, tilt, 4.0 * tilt, 0.0][p];
            let m = longitudinal(theta, theta_i, v[p]);
            let n = if p < 3 {
                let middle = 2.0 * p as f64 * gamma_t - 2.0 * gamma_o + p as f64 * PI;
                let off = (phi - middle + PI).rem_euclid(TAU) - PI;
                let cdf = |x: f64| 1.0 / (1.0 + (-x / s).exp());
                let e = (-off.abs() / s).exp();
                e / (s * (1.0 + e).powi(2)) / (cdf(PI) - cdf(-PI))
            } else {
                1.0 / TAU
            };
            value = add(value, scale(a[p], m * n));
            pdf += a[p].iter().sum::<f64>() / total * m * n;
        }
        (value, pdf)
    }
}

/// d'Eon et al. 2011, equation 7; the Bessel function by its integral.
fn longitudinal(theta_o: f64, theta_i: f64, v: f64) -> f64 {
    // Cosines of angles that tilts take out of the range are turned back.
    let a = theta_i.cos() * theta_o.cos().abs() / v;
    let b = theta_i.sin() * theta_o.sin() / v;
    let n = 4000;
    let bessel =
        (0..n).map(|k| (a * (((f64::from(k) + 0.5) * PI / f64::from(n)).cos() - 1.0)).exp());
    let bessel = bessel.sum::<f64>() / f64::from(n);
    (a - b - 1.0 / v).exp() * bessel / (v * (1.0 - (-2.0 / v).exp()))
}

fn fibres() -> Vec<Fibre> {
    let base = Fibre {
        sigma: [0.4, 1.0, 3.0],
        h: 0.3,
        eta: 1.55,
        beta: [0.3, 0.3],
        alpha: 2.0,
    };
    vec![
        base,
        Fibre {
            h: -0.95,
            sigma: [0.0; 3],
            ..base
        },
        Fibre {
            h: 0.0,
            alpha: 0.0,
            beta: [1.0, 1.0],
            ..base
        },
        Fibre {
            h: 0.7,
            alpha: -20.0,
            beta: [0.2, 0.6],
            ..base
        },
        Fibre {
            h: 1.0,
            eta: 1.2,
            beta: [0.5, 0.15],
            ..base
        },
        Fibre {
            h: -0.4,
            eta: 3.0,
            sigma: [50.0, 0.1, 0.0],
            ..base
        },
    ]
}

#[test]
fn values_are_those_of_the_formulas() {
    let mut random = Random(1);
    let smooth = |f: Fibre| Fibre {
        beta: [0.02, 0.05],
        ..f
    };
    for fibre in fibres().into_iter().chain(fibres().into_iter().map(smooth)) {
        let wo: Vec<[f32; 3]> = (0..300).map(|_| narrow(random.direction())).collect();
        // Half of them where the lobes are.
        let wi: Vec<[f32; 3]> = wo
            .iter()
            .enumerate()
            .map(|(k, w)| {
                let r = random.direction();
                let spread = if k % 2 == 0 { 1.0 } else { 0.05 };
                let across = unit([0.0, r[1], r[2]]);
                let cos = (1.0 - f64::from(w[0]).powi(2)).max(0.0).sqrt();
                let mirror = [-f64::from(w[0]), across[1] * cos, across[2] * cos];
                narrow(unit(add(mirror, scale(random.direction(), spread))))
            })
            .collect();
        for mode in [Mode::Radiance, Mode::Importance] {
            let values = Kernels::eval::<f32x8>(Kind::Hair, &fibre.row(), &wo, &wi, mode);
            for ((o, i), (f, pdf, reverse)) in wo.iter().zip(&wi).zip(values) {
                let (o, i, h) = (wide(*o), wide(*i), f64::from(fibre.h));
                let of = |from: V, to: V, h: f64| fibre.value(from, to, h);
                let ((value, camera), (_, light), cos) = match mode {
                    Mode::Radiance => (of(o, i, h), of(i, o, -h), i[2]),
                    Mode::Importance => (of(i, o, h), of(o, i, -h), o[2]),
                };
                let (forth, back) = match mode {
                    Mode::Radiance => (camera, light),
                    Mode::Importance => (light, camera),
                };
                // Angles are good to some 1e-6, and lobes as narrow as 0.002.
                let (v, s) = fibre.widths();
                let slack = 2e-5 + 4e-6 / s + 4e-6 / v[1].sqrt();
                let near = |a: f32, b: f64, what: &str| {
                    assert!(
                        (f64::from(a) - b).abs() <= slack * b.abs() + 1e-12 * (1.0 + b),
                        "{what} of {fibre:?} at {o:?} {i:?}: {a} {b}"
                    )
                };
                near(pdf, forth, "density");
                near(reverse, back, "reverse density");
                for c in 0..3 {
                    near(f[c] * cos.abs() as f32, value[c], "value");
                }
            }
        }
    }
}

/// Cells of equal solid angle around the fibre.
#[test]
fn sampling_follows_the_density() {
    const CELLS: usize = 12;
    const FINE: usize = 24;
    const SAMPLES: usize = 100_000;
    let at = |x: f64, phi: f64| {
        let r = (1.0 - x * x).max(0.0).sqrt();
        [x, r * phi.cos(), r * phi.sin()]
    };
    let mut random = Random(2);
    let p = FALSE_ALARM / (4 * fibres().len()) as f64;
    for fibre in fibres() {
        let row = fibre.row();
        for (sin, mode) in [
            (0.1, Mode::Radiance),
            (-0.9, Mode::Radiance),
            (0.5, Mode::Importance),
            (0.97, Mode::Importance),
        ] {
            let wo = narrow(at(sin, 2.1));
            let n = CELLS * FINE;
            let wi: Vec<[f32; 3]> = (0..n * n)
                .map(|i| {
                    let [x, y] = [i % n, i / n].map(|k| (k as f64 + 0.5) / n as f64);
                    narrow(at(2.0 * x - 1.0, y * TAU))
                })
                .collect();
            let values = Kernels::eval::<f32x8>(Kind::Hair, &row, &vec![wo; n * n], &wi, mode);
            let mut expected = vec![0.0; CELLS * CELLS];
            for (i, (_, pdf, _)) in values.iter().enumerate() {
                let share = 2.0 * TAU / (n * n) as f64 * SAMPLES as f64;
                expected[i % n / FINE + CELLS * (i / n / FINE)] += f64::from(*pdf) * share;
            }
            let all: f64 = expected.iter().sum::<f64>() / SAMPLES as f64;
            assert!((all - 1.0).abs() < 2e-3, "{fibre:?} {sin} {all}");
            let u: Vec<[f32; 3]> = (0..SAMPLES)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let sampled = Kernels::sample::<f32x8>(Kind::Hair, &row, &vec![wo; SAMPLES], &u, mode);
            let mut observed = vec![0.0; CELLS * CELLS];
            for (wi, ..) in sampled {
                let w = wide(wi);
                let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
                let phi = w[2].atan2(w[1]).rem_euclid(TAU) / TAU;
                observed[cell((w[0] + 1.0) / 2.0) + CELLS * cell(phi)] += 1.0;
            }
            assert_follows(
                &observed,
                &expected,
                p,
                &format!("{fibre:?} at {sin} {mode:?}"),
            );
        }
    }
}

/// Hair without pigment scatters all that it receives, in whatever direction.
#[test]
fn white_hair_absorbs_nothing() {
    let mut random = Random(3);
    for fibre in fibres() {
        let row = Fibre {
            sigma: [0.0; 3],
            ..fibre
        }
        .row();
        let wo: Vec<[f32; 3]> = (0..2000).map(|_| narrow(random.direction())).collect();
        let u: Vec<[f32; 3]> = wo
            .iter()
            .map(|_| std::array::from_fn(|_| random.uniform()))
            .collect();
        for (_, weight, ..) in Kernels::sample::<f32x8>(Kind::Hair, &row, &wo, &u, Mode::Radiance) {
            assert!((weight[1] - 1.0).abs() < 1e-5, "{fibre:?}: {weight:?}");
        }
    }
}

/// Some hairs in a corner, one of them thick, seen from near, under a lamp.
fn tuft(material: &str, depth: u32) -> String {
    let mut random = Random(4);
    let mut text = head(16, 12, depth, "LookAt 0 -2.5 .6  0 0 .45  0 0 1\nCamera \"perspective\" \"float fov\" [38]")
        + "Material \"matte\" \"rgb Kd\" [.5 .4 .3]
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -2 0 2 -2 0 2 2 0 -2 2 0]
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 1 0 2 1 0 2 1 3 -2 1 3]
           AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 6 6]
           Translate .8 .3 1.8 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" .4 AttributeEnd\n";
    text += material;
    for i in 0..60 {
        let mut at = |spread: f64| (f64::from(random.uniform()) - 0.5) * spread;
        let (x, y, bend) = (at(1.4), at(0.8), at(1.0));
        let width = if i == 0 { 0.2 } else { 0.06 };
        text += &format!(
            "\nShape \"curve\" \"float width\" {width} \"string type\" \"cylinder\" \"point P\" [{x} {y} 0  {x} {y} .4  {} {y} .7  {} {} 1]",
            x + bend * 0.3,
            x + bend,
            y + at(0.4)
        );
    }
    text + "\nWorldEnd\n"
}

#[test]
fn integrators_agree_about_hair() {
    let blond = "Material \"hair\" \"float eumelanin\" .2 \"float beta_m\" .25";
    let tuft = scene(&tuft(blond, 5));
    expect_integrators_agree(&tuft, 64, 16, [4, 3], "hair");
    // A surface that is no fibre has its `h` from `v`, and normals that differ.
    let text = head(12, 9, 4, "LookAt 0 -3 .8  0 0 .3  0 0 1\nCamera \"perspective\" \"float fov\" [40]")
        + "LightSource \"point\" \"rgb I\" [9 9 9] \"point from\" [2 -2 3]
           Material \"matte\" Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -2 -1 2 -2 -1 2 2 -1 -2 2 -1]
           Material \"hair\" \"rgb color\" [.7 .4 .2] \"float beta_m\" .5 \"float beta_n\" .5
           Shape \"sphere\" \"float radius\" .6
           Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1.5 .6 -.5 1.5 .6 -.5 0 .6 1.5]
           \"normal N\" [-.5 -1 0 .5 -1 0 0 -1 .5] \"float uv\" [0 0 1 .2 .5 1]\nWorldEnd\n";
    expect_integrators_agree(&scene(&text), 64, 16, [3, 3], "hair-sphere");
}

/// Under an even sky, what absorbs nothing cannot be seen.
#[test]
fn white_hair_is_as_bright_as_the_sky() {
    let text = tuft(
        "Material \"hair\" \"rgb sigma_a\" [0 0 0] \"float alpha\" 5",
        60,
    );
    let from = text.find("Material \"matte\"").unwrap();
    let to = text.find("Material \"hair\"").unwrap();
    let text = format!(
        "{}LightSource \"infinite\" \"rgb L\" [1 1 1]\n{}",
        &text[..from],
        &text[to..]
    );
    let scene = scene(&text);
    let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 16), 8);
    for estimate in runs.grid(4, 3) {
        estimate.expect(1.0, "a sky full of hair");
    }
}

fn material(text: &str) -> HairMaterial {
    let text = format!(
        "{}{text}\nShape \"sphere\"\nWorldEnd\n",
        head(4, 4, 2, "Camera \"perspective\"")
    );
    let scene = scene(&text);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene.materials[0]
        .kind
        .get::<HairMaterial>()
        .expect("hair")
        .clone()
}

/// pbrt takes the first of absorption, colour and melanin that there is.
#[test]
fn pigments_are_those_that_pbrt_takes() {
    let of = |text: &str| material(&format!("Material \"hair\" {text}")).pigment;
    let constant = phalanx::scene::Param::Constant;
    assert_eq!(
        of(""),
        Pigment::Melanin([constant([1.3; 3]), constant([0.0; 3])])
    );
    assert_eq!(
        of("\"float pheomelanin\" .5"),
        Pigment::Melanin([constant([0.0; 3]), constant([0.5; 3])])
    );
    let color = "\"rgb color\" [.5 .4 .3] \"float eumelanin\" 2";
    assert_eq!(of(color), Pigment::Reflectance(constant([0.5, 0.4, 0.3])));
    let all = format!("{color} \"rgb sigma_a\" [3 2 1]");
    assert_eq!(of(&all), Pigment::Absorption(constant([3.0, 2.0, 1.0])));
}
