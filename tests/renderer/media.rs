//! Participating media: closed forms, and all integrators against each other.

use crate::support;

use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, PathSamplerKind};
use phalanx::simd::Width;
use std::f64::consts::PI;
use support::{Runs, head, inward_box, run, scene, settings};

const SEEDS: u64 = 12;

/// Independent samples and chains, with the work that makes them about as noisy.
const ALL: [(IntegratorKind, u64); 6] = [
    (IntegratorKind::Pt, 24),
    (IntegratorKind::Lt, 48),
    (IntegratorKind::Bdpt, 12),
    (IntegratorKind::Mmlt, 96),
    (IntegratorKind::Pssmlt(PathSamplerKind::Pt), 48),
    (IntegratorKind::Pssmlt(PathSamplerKind::Bdpt), 24),
];

fn homogeneous(name: &str, absorption: [f64; 3], scattering: [f64; 3], g: f64) -> String {
    let rgb = |[r, g, b]: [f64; 3]| format!("[{r} {g} {b}]");
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" {} \
         \"rgb sigma_s\" {} \"float g\" [{g}]\n",
        rgb(absorption),
        rgb(scattering)
    )
}

/// All integrators have the picture of `text` as its whole says, and as path tracing says in four
/// regions.
fn expect_agreement(text: &str, effort: u64, name: &str) {
    let scene = scene(text);
    let comparisons = (ALL.len() - 1) * 3 * 5;
    let runs = |(kind, work): (IntegratorKind, u64)| {
        let runs = Runs::new(&scene, &settings(&scene, kind, work * effort), SEEDS);
        runs.show(&format!("{name}-{kind:?}"));
        runs
    };
    let pt = runs(ALL[0]);
    for of in &ALL[1..] {
        let other = runs(*of);
        for c in 0..3 {
            let what = format!("{name} {:?} channel {c}", of.0);
            let one = pt.whole(c);
            other.whole(c).expect_same_among(comparisons, &one, &what);
        }
        for (i, (a, b)) in other.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
            let what = format!("{name} {:?} region {} channel {}", of.0, i / 3, i % 3);
            a.expect_same_among(comparisons, &b, &what);
        }
    }
}

/// The airlight integral: a point light in fog without an end, scattered once.
#[test]
fn single_scattering_of_a_point_light() {
    const ABSORPTION: [f64; 3] = [0.05, 0.1, 0.0];
    const SCATTERING: [f64; 3] = [0.1, 0.2, 0.4];
    const G: f64 = 0.5;
    let fog = homogeneous("fog", ABSORPTION, SCATTERING, G);
    let camera = format!(
        "{fog}MediumInterface \"\" \"fog\"\nLookAt 0 0 -4  0 0 0  0 1 0\n\
         Camera \"perspective\" \"float fov\" [30]"
    );
    let text = head(8, 8, 1, &camera)
        + "LightSource \"point\" \"rgb I\" [1 1 1] \"point from\" [0 1.5 0]\n\
           Material \"matte\" \"rgb Kd\" [0 0 0]\nTranslate 0 0 -6\n\
           Shape \"sphere\" \"float radius\" [.1]\n";
    let truth = |c: usize| {
        let (s, t) = (SCATTERING[c], SCATTERING[c] + ABSORPTION[c]);
        let edge = (PI / 12.0).tan();
        let (n, mut sum) = (24, 0.0);
        for pixel in 0..n * n {
            let at = |i: i32| (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0) * edge;
            let (x, y) = (at(pixel % n), at(pixel / n));
            let length = (1.0 + x * x + y * y).sqrt();
            let d = [x / length, y / length, 1.0 / length];
            let steps = 4000;
            for i in 0..steps {
                // Distances from 0 to 100.
                let v = (f64::from(i) + 0.5) / f64::from(steps);
                let (far, width) = (100.0 * v * v, 200.0 * v / f64::from(steps));
                let p = [d[0] * far, d[1] * far, d[2] * far - 4.0];
                let to = [-p[0], 1.5 - p[1], -p[2]];
                let r = (to[0] * to[0] + to[1] * to[1] + to[2] * to[2]).sqrt();
                let cos = -(d[0] * to[0] + d[1] * to[1] + d[2] * to[2]) / r;
                let den = 1.0 + G * G - 2.0 * G * cos;
                let phase = (1.0 - G * G) / (4.0 * PI * den.powf(1.5));
                sum += width * s * phase * (-t * (far + r)).exp() / (r * r);
            }
        }
        sum / f64::from(n * n)
    };
    let scene = scene(&text);
    for (kind, work) in ALL {
        let runs = Runs::new(&scene, &settings(&scene, kind, 4 * work), SEEDS);
        for c in 0..3 {
            let what = format!("airlight {kind:?} channel {c}");
            runs.whole(c).expect(truth(c), &what);
        }
    }
}

/// A light behind slabs of two media, seen through their borders: what passes is no random number.
#[test]
fn slabs_let_pass_what_they_should() {
    let slab = |medium: &str, z0: f64, z1: f64| {
        format!(
            "AttributeBegin\nMaterial \"\"\nMediumInterface \"{medium}\" \"\"\n\
             ReverseOrientation\n{}AttributeEnd\n",
            inward_box([-3.0, 3.0, -3.0, 3.0, z0, z1])
        )
    };
    let (a, b) = ([0.1, 0.0, 0.5], [0.2, 0.7, 3.0]);
    for (thick, scale) in [(1.0, 1.0), (1e-3, 1.0), (1.0, 1e-4)] {
        let text = head(4, 4, 0, "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"")
            + &homogeneous("one", a.map(|v| v * scale), b.map(|v| v * scale), 0.0)
            + &homogeneous("two", b, [0.0; 3], 0.0)
            + &slab("one", 0.0, thick)
            + &slab("two", 1.5, 1.75)
            + "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\nMaterial \"matte\"\n\
               Translate 0 0 3\nReverseOrientation\nShape \"disk\" \"float radius\" [20]\n";
        let scene = scene(&text);
        for (kind, _) in ALL {
            let render = run(&scene, &settings(&scene, kind, 4));
            for pixel in &render.pixels {
                for c in 0..3 {
                    let depth = (a[c] + b[c]) * thick * scale + b[c] * 0.25;
                    let truth = (c as f64 + 1.0) * (-depth).exp();
                    let off = (f64::from(pixel[c]) - truth).abs();
                    assert!(off < 1e-4 * truth, "{kind:?} {thick}: {pixel:?} {truth}");
                }
            }
        }
    }
}

/// Inside black walls that emit, filled with what scatters and does not absorb, there is the same
/// light everywhere.
#[test]
fn a_furnace_filled_with_fog_stays_as_bright() {
    let fog = homogeneous("fog", [0.0; 3], [1.0, 0.3, 2.0], 0.7);
    let camera = format!(
        "{fog}MediumInterface \"\" \"fog\"\nLookAt 0.2 -0.1 0.3  -0.4 0.5 -0.6  0 1 0\n\
         Camera \"perspective\" \"float fov\" [70]"
    );
    let text = head(6, 6, 24, &camera)
        + "Material \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 4]\n\
           ReverseOrientation\nShape \"sphere\" \"float radius\" [1]\n";
    let scene = scene(&text);
    for (kind, work) in ALL {
        let runs = Runs::new(&scene, &settings(&scene, kind, work), SEEDS);
        for (c, truth) in [1.0, 2.0, 4.0].into_iter().enumerate() {
            let what = format!("furnace {kind:?} channel {c}");
            runs.whole(c).expect(truth, &what);
        }
    }
}

/// A coloured ball of fog, milk in glass, and thin fog around all of it, the camera in it.
fn mixed() -> String {
    let camera = homogeneous("air", [0.02, 0.02, 0.05], [0.08, 0.05, 0.03], 0.6)
        + "MediumInterface \"\" \"air\"\nLookAt 0 1 -4  0 0 0  0 1 0\n\
           Camera \"perspective\" \"float fov\" [40]";
    head(12, 12, 5, &camera)
        + &homogeneous("fog", [0.1, 0.05, 0.02], [2.0, 1.0, 0.5], 0.3)
        + &homogeneous("milk", [0.0, 0.1, 0.4], [3.0, 3.0, 1.0], -0.3)
        + "AttributeBegin\nMediumInterface \"\" \"air\"\nAreaLightSource \"diffuse\" \
           \"rgb L\" [9 8 7]\nMaterial \"matte\"\nTranslate 1.5 2 -1\n\
           Shape \"sphere\" \"float radius\" [.6]\nAttributeEnd\n\
           AttributeBegin\nMaterial \"\"\nMediumInterface \"fog\" \"air\"\nTranslate -.9 0 0\n\
           Shape \"sphere\" \"float radius\" [.7]\nAttributeEnd\n\
           AttributeBegin\nMaterial \"glass\" \"float uroughness\" [.3] \"float vroughness\" [.3]\n\
           MediumInterface \"milk\" \"air\"\nTranslate .9 0 0\n\
           Shape \"sphere\" \"float radius\" [.7]\nAttributeEnd\n\
           MediumInterface \"\" \"air\"\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
           \"point P\" [-5 -1 -5 -5 -1 5 5 -1 5 5 -1 -5]\n"
}

#[test]
fn integrators_agree_about_fog_and_milk() {
    expect_agreement(&mixed(), 1, "media-mixed");
}

/// Light from infinity and from a spotlight.
#[test]
fn integrators_agree_about_lights_in_fog() {
    let camera = homogeneous("air", [0.0, 0.02, 0.05], [0.15, 0.1, 0.1], 0.3)
        + "MediumInterface \"\" \"air\"\nLookAt 0 .5 -3  0 0 0  0 1 0\n\
           Camera \"perspective\" \"float fov\" [50]";
    let text = head(10, 10, 4, &camera)
        + "LightSource \"spot\" \"rgb I\" [9 9 9] \"point from\" [1 2 0] \"point to\" [0 -1 0]\n\
           LightSource \"distant\" \"rgb L\" [1 .5 .2] \"point from\" [-1 1 -1]\n\
           LightSource \"infinite\" \"rgb L\" [.2 .3 .5]\n\
           Material \"matte\" \"rgb Kd\" [.6 .6 .6]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
           \"point P\" [-2 -1 -2 -2 -1 2 2 -1 2 2 -1 -2]\n\
           Shape \"sphere\" \"float radius\" [.5]\n";
    expect_agreement(&text, 1, "media-lights");
}

/// The width of lanes changes no bit.
#[test]
fn lanes_change_nothing() {
    let scene = scene(&mixed());
    for (kind, _) in ALL {
        let of = |lanes| {
            let settings = Settings {
                lanes,
                ..settings(&scene, kind, 2)
            };
            run(&scene, &settings).pixels
        };
        assert_eq!(of(Width::One), of(Width::Eight), "{kind:?}");
    }
}
