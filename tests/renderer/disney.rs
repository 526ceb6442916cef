//! v3 `disney`: its BSDF against pbrt-v3's formulas in `f64`, samples against their density,
//! energy, and pictures.

mod formulas;

use self::formulas::{formulas, rows};
use crate::{common, support};

use common::bsdf::Kernels;
use common::stats::{FALSE_ALARM, Mean, Random, assert_follows, normal_quantile};
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::Mode;
use phalanx::surface::disney_row::{Parts, Values};
use std::f64::consts::TAU;
use support::{expect_integrators_agree, head, inward_box, scene};

#[test]
fn values_are_those_of_pbrt() {
    let mut random = Random(31);
    let narrow64 = |w: V| narrow(w);
    for (kind, values) in rows() {
        let row = values.row();
        for mode in [Mode::Radiance, Mode::Importance] {
            let mut wo: Vec<[f32; 3]> = (0..4000).map(|_| narrow64(random.direction())).collect();
            let mut wi: Vec<[f32; 3]> = (0..4000).map(|_| narrow64(random.direction())).collect();
            // Near the mirror direction, too.
            for (o, i) in wo.iter_mut().zip(&mut wi).step_by(2) {
                let mirror = [-f64::from(o[0]), -f64::from(o[1]), o[2].into()];
                *i = narrow(unit(add(mirror, scale(random.direction(), 0.05))));
            }
            let found = Kernels::eval::<f32x8>(kind, &row, &wo, &wi, mode);
            for ((o, i), (f, ..)) in wo.iter().zip(&wi).zip(found) {
                let (o, i) = (wide(*o), wide(*i));
                if o[2].abs().min(i[2].abs()) < 1e-3 {
                    continue;
                }
                let want = formulas(kind, &row, o, i, mode);
                // Directions are as good as their last place.
                let mut shaken = [0.0f64; 3];
                for _ in 0..8 {
                    let mut shake = |w: V| unit(add(w, scale(random.direction(), 5e-7)));
                    let other = formulas(kind, &row, shake(o), shake(i), mode);
                    for c in 0..3 {
                        shaken[c] = shaken[c].max((other[c] - want[c]).abs());
                    }
                }
                for c in 0..3 {
                    let off = (f64::from(f[c]) - want[c]).abs();
                    let most = 1e-5 * want[c] + 4.0 * shaken[c] + 1e-9;
                    assert!(
                        off <= most,
                        "{kind:?} {values:?} {mode:?} at {o:?} {i:?}: {f:?} is {want:?} +- {most}"
                    );
                }
            }
        }
    }
}

/// A number that is packed is right to 1/64000, and 0 and 1 are exact.
#[test]
fn rows_keep_what_they_are_given() {
    let (kind, values) = rows()[1];
    let found = Parts::<f32>::of(&values.row());
    let near = |a: f32, b: f32| assert!((a - b).abs() <= 2e-4 * b.max(1.0), "{kind:?} {a} {b}");
    for (a, b) in [
        (found.colour.x, values.colour[0]),
        (found.colour.z, values.colour[2]),
        (found.metallic, values.metallic),
        (found.transmission, values.transmission),
        (found.specular_tint, values.specular_tint),
        (found.anisotropic, values.anisotropic),
        (found.sheen, values.sheen),
        (found.sheen_tint, values.sheen_tint),
        (found.clearcoat, values.clearcoat),
        (found.flatness, values.flatness),
        (found.through, values.through),
        (found.roughness, values.roughness),
    ] {
        near(a, b);
    }
    assert_eq!(found.eta, values.eta);
    for end in [0.0, 1.0] {
        let ends = Values {
            colour: [end; 3],
            roughness: end,
            metallic: end,
            transmission: end,
            ..Values::default()
        };
        let found = Parts::<f32>::of(&ends.row());
        assert_eq!(found.colour.y, end);
        assert_eq!(
            [found.roughness, found.metallic, found.transmission],
            [end; 3]
        );
    }
}

/// Reflections by the slope of their half vector, on a scale that holds lobes of any width; what
/// passes, by its height.
fn place(o: V, i: V, side: f64) -> Option<(f64, f64, bool)> {
    if i[2] * side > 0.0 {
        let h = unit(add(o, i));
        let slope = (h[0] * h[0] + h[1] * h[1]).sqrt() / h[2].abs();
        let x = ((slope.ln() - LOW) / (HIGH - LOW)).clamp(0.0, 1.0);
        Some((x, h[1].atan2(h[0]).rem_euclid(TAU) / TAU, true))
    } else if i[2] * side < 0.0 {
        Some((i[2].abs(), i[1].atan2(i[0]).rem_euclid(TAU) / TAU, false))
    } else {
        None
    }
}

/// Logarithms of the least and of the greatest slope.
const LOW: f64 = -10.0;
const HIGH: f64 = 9.0;

/// Samples have the density that is said of them, in both hemispheres.
#[test]
fn samples_follow_their_density() {
    const X: usize = 19;
    const Y: usize = 6;
    const FINE: usize = 40;
    const SAMPLES: usize = 120_000;
    let angles = [0.2, 0.8, 1.4];
    let mut random = Random(32);
    let cases = rows();
    let p = FALSE_ALARM / (cases.len() * angles.len() * 2) as f64;
    for (kind, values) in cases {
        let row = values.row();
        for theta in angles {
            for side in [1.0, -1.0] {
                let o32 = narrow([
                    f64::sin(theta) * 0.8,
                    f64::sin(theta) * 0.6,
                    side * f64::cos(theta),
                ]);
                let o = wide(o32);
                let mut expected = vec![0.0; 2 * X * Y + 1];
                let (mut at, mut wi, mut weight) = (vec![], vec![], vec![]);
                let (nx, ny) = (X * FINE, Y * FINE);
                for k in 0..nx * ny {
                    let x = ((k % nx) as f64 + 0.5) / nx as f64;
                    let y = ((k / nx) as f64 + 0.5) / ny as f64;
                    let (sin, cos) = (y * TAU).sin_cos();
                    let cell = k % nx / FINE + X * (k / nx / FINE);
                    // Reflections.
                    let slope = (LOW + x * (HIGH - LOW)).exp();
                    let h = unit([slope * cos, slope * sin, side]);
                    let oh = dot(o, h);
                    let i = sub(scale(h, 2.0 * oh), o);
                    if oh > 0.0 && i[2] * side > 0.0 {
                        let solid = slope * slope * h[2].abs().powi(3) * (HIGH - LOW) * TAU;
                        at.push(cell);
                        wi.push(narrow(unit(i)));
                        weight.push(4.0 * oh * solid);
                    }
                    // Transmissions.
                    let r = (1.0 - x * x).sqrt();
                    at.push(X * Y + cell);
                    wi.push(narrow([r * cos, r * sin, -side * x]));
                    weight.push(TAU);
                }
                let all = vec![o32; wi.len()];
                let densities = Kernels::eval::<f32x8>(kind, &row, &all, &wi, Mode::Radiance);
                for ((value, at), weight) in densities.iter().zip(&at).zip(&weight) {
                    let part = weight * SAMPLES as f64 / (nx * ny) as f64;
                    expected[*at] += f64::from(value.1) * part;
                }
                let total: f64 = expected.iter().sum();
                let what = format!("{kind:?} {values:?} at {theta}, side {side}");
                assert!(total < 1.005 * SAMPLES as f64, "{what}: {total}");
                expected[2 * X * Y] = (SAMPLES as f64 - total).max(0.0);
                let u: Vec<[f32; 3]> = (0..SAMPLES)
                    .map(|_| std::array::from_fn(|_| random.uniform()))
                    .collect();
                let all = vec![o32; SAMPLES];
                let mut observed = vec![0.0; 2 * X * Y + 1];
                for (i, f, pdf, _) in Kernels::sample::<f32x8>(kind, &row, &all, &u, Mode::Radiance)
                {
                    let cell = match place(o, wide(i), side) {
                        // Black samples are samples, too, if there is light in their lobe.
                        Some((x, y, reflects)) if f != [0.0; 3] => {
                            assert!(pdf > 0.0);
                            let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                            let cell = index(x, X) + X * index(y, Y);
                            cell + if reflects { 0 } else { X * Y }
                        }
                        _ => 2 * X * Y,
                    };
                    observed[cell] += 1.0;
                }
                assert_follows(&observed, &expected, p, &what);
            }
        }
    }
}

/// The mean weight of samples is the integral of pbrt's formulas over all directions: what the
/// material reflects and lets through.
#[test]
fn samples_bring_as_much_as_the_formulas() {
    const SAMPLES: usize = 200_000;
    let mut random = Random(33);
    let cases = rows();
    let reach = normal_quantile(FALSE_ALARM / (cases.len() * 12) as f64);
    for (kind, values) in cases {
        let row = values.row();
        for (theta, side) in [(0.3, 1.0), (1.2, 1.0), (0.3, -1.0), (1.2, -1.0)] {
            let o32 = narrow([f64::sin(theta), 0.0, side * f64::cos(theta)]);
            let o = wide(o32);
            let mut truth = [0.0; 3];
            let (nx, ny) = (1200, 240);
            for k in 0..nx * ny {
                let x = ((k % nx) as f64 + 0.5) / f64::from(nx);
                let (sin, cos) = (((k / nx) as f64 + 0.5) / f64::from(ny) * TAU).sin_cos();
                let slope = (LOW + x * (HIGH - LOW)).exp();
                let h = unit([slope * cos, slope * sin, side]);
                let oh = dot(o, h);
                let i = sub(scale(h, 2.0 * oh), o);
                let part = 1.0 / f64::from(nx * ny);
                if oh > 0.0 && i[2] * side > 1e-9 {
                    let solid = slope * slope * h[2].abs().powi(3) * (HIGH - LOW) * TAU;
                    let weight = 4.0 * oh * solid * i[2].abs() * part;
                    let f = formulas(kind, &row, o, unit(i), Mode::Radiance);
                    truth = add(truth, scale(f, weight));
                }
                let r = (1.0 - x * x).sqrt();
                let f = formulas(kind, &row, o, [r * cos, r * sin, -side * x], Mode::Radiance);
                truth = add(truth, scale(f, TAU * x * part));
            }
            let u: Vec<[f32; 3]> = (0..SAMPLES)
                .map(|_| std::array::from_fn(|_| random.uniform()))
                .collect();
            let all = vec![o32; SAMPLES];
            let mut means = [Mean::default(), Mean::default(), Mean::default()];
            for (_, f, ..) in Kernels::sample::<f32x8>(kind, &row, &all, &u, Mode::Radiance) {
                for (mean, f) in means.iter_mut().zip(f) {
                    mean.add(f.into());
                }
            }
            for (c, mean) in means.iter().enumerate() {
                let off = (mean.mean() - truth[c]).abs();
                let most = reach * mean.error() + 1e-3 * truth[c] + 1e-6;
                assert!(
                    off <= most,
                    "{kind:?} {values:?} at {theta}, {side}: {} is {}",
                    mean.mean(),
                    truth[c]
                );
            }
        }
    }
}

/// Light goes both ways alike, but for what refraction does to solid angles, and densities are
/// those of the way back.
#[test]
fn both_ways_are_alike() {
    let mut random = Random(34);
    for (kind, values) in rows() {
        let row = values.row();
        let wo: Vec<[f32; 3]> = (0..4000).map(|_| narrow(random.direction())).collect();
        let wi: Vec<[f32; 3]> = (0..4000).map(|_| narrow(random.direction())).collect();
        let forth = Kernels::eval::<f32x8>(kind, &row, &wo, &wi, Mode::Importance);
        let back = Kernels::eval::<f32x8>(kind, &row, &wi, &wo, Mode::Radiance);
        for (n, (forth, back)) in forth.iter().zip(back).enumerate() {
            let shallow = wo[n][2].abs().min(wi[n][2].abs());
            let slack = f32::EPSILON * (64.0 + 8.0 / shallow.max(1e-6));
            let near = |a: f32, b: f32, what: &str| {
                assert!(
                    (a - b).abs() <= slack * a.abs().max(b.abs()) + 1e-12,
                    "{what} of {kind:?} {values:?} at {:?} {:?}: {a} {b}",
                    wo[n],
                    wi[n]
                );
            };
            near(forth.1, back.2, "density");
            near(forth.2, back.1, "reverse density");
            for c in 0..3 {
                near(forth.0[c], back.0[c], "value");
            }
        }
    }
}

/// Balls of all lobes in a lit box.
fn room() -> String {
    let lamp = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [8 8 7]\nMaterial \"matte\"\n\
                Translate 0 1.6 -.5\nShape \"sphere\" \"float radius\" [.3]\nAttributeEnd\n";
    let balls = [
        "\"rgb color\" [.8 .3 .1] \"float metallic\" [.4] \"float clearcoat\" [1] \
         \"float clearcoatgloss\" [.5] \"float sheen\" [1] \"float speculartint\" [.5]",
        "\"rgb color\" [.6 .9 .7] \"float spectrans\" [.9] \"float roughness\" [.4] \
         \"float eta\" [1.4]",
        "\"rgb color\" [.3 .5 .9] \"bool thin\" \"true\" \"float flatness\" [.5] \
         \"float difftrans\" [1.2] \"float spectrans\" [.4] \"float anisotropic\" [.6]",
    ];
    let mut text = head(
        8,
        8,
        4,
        "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [50]",
    ) + lamp
        + "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
        + &inward_box([-2.0, 2.0, -1.0, 2.0, -4.5, 2.0]);
    for (i, ball) in balls.iter().enumerate() {
        text += &format!(
            "AttributeBegin\nMaterial \"disney\" {ball}\nTranslate {} -.4 0\n\
             Shape \"sphere\" \"float radius\" [.6]\nAttributeEnd\n",
            1.25 * (i as f64 - 1.0)
        );
    }
    text
}

#[test]
fn integrators_agree() {
    expect_integrators_agree(&scene(&room()), 64, 16, [4, 3], "disney");
}

/// Every parameter is read, with pbrt's defaults, and what cannot be is said.
#[test]
fn files_are_read_as_pbrt_reads_them() {
    use phalanx::pbrt::load_str;
    use phalanx::scene::Param;
    use phalanx::surface::DisneyMaterial;
    let of = |parameters: &str| {
        let text = head(4, 4, 1, "Camera \"perspective\"")
            + &format!("Material \"disney\" {parameters}\nShape \"sphere\"\n")
            + "LightSource \"point\"\n";
        load_str(&text, "test.pbrt", ".".as_ref())
    };
    let read = |parameters: &str| {
        let scene = of(parameters).unwrap();
        let material = scene.materials[scene.shapes[0].material as usize]
            .kind
            .clone();
        let phalanx::scene::MaterialKind::Bsdf(material) = &material else {
            panic!("{material:?}");
        };
        let any: &dyn std::any::Any = &**material;
        (
            any.downcast_ref::<DisneyMaterial>().unwrap().clone(),
            scene.warnings,
        )
    };
    let number = |x: f32| Param::Constant([x; 3]);
    let (plain, _) = read("");
    assert_eq!(plain.color, number(0.5));
    assert_eq!(plain.eta, number(1.5));
    assert_eq!(plain.sheen_tint, number(0.5));
    assert_eq!(plain.diffuse_transmission, number(1.0));
    assert!(!plain.thin);
    let (full, warnings) = read(
        "\"rgb color\" [.1 .2 .3] \"float metallic\" .1 \"float eta\" 1.2 \"float roughness\" .3 \
         \"float speculartint\" .4 \"float anisotropic\" .5 \"float sheen\" .6 \
         \"float sheentint\" .7 \"float clearcoat\" .8 \"float clearcoatgloss\" .9 \
         \"float spectrans\" .15 \"bool thin\" \"true\" \"float flatness\" .25 \
         \"float difftrans\" .35 \"rgb scatterdistance\" [1 1 1]",
    );
    let found = [
        full.metallic,
        full.eta,
        full.roughness,
        full.specular_tint,
        full.anisotropic,
        full.sheen,
        full.sheen_tint,
        full.clearcoat,
        full.clearcoat_gloss,
        full.specular_transmission,
        full.flatness,
        full.diffuse_transmission,
    ];
    let given = [
        0.1, 1.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.15, 0.25, 0.35,
    ];
    assert_eq!(found, given.map(number));
    assert!(full.thin && warnings.is_empty(), "{warnings:?}");
    let (_, warnings) = read("\"float metallic\" 2");
    assert!(warnings[0].contains("\"metallic\" of 2"), "{warnings:?}");
    let error = of("\"rgb scatterdistance\" [1 1 1]")
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("test.pbrt:6:1: Material \"disney\": its \"scatter"),
        "{error}"
    );
}
