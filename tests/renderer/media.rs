//! Participating media: closed forms, and all integrators against each other.

mod colours;

use crate::support;

use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
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

/// Those of which every pixel is exact where every sample is.
const SAMPLED: [IntegratorKind; 3] = [IntegratorKind::Pt, IntegratorKind::Lt, IntegratorKind::Bdpt];

fn homogeneous(name: &str, absorption: [f64; 3], scattering: [f64; 3], g: f64) -> String {
    let rgb = |[r, g, b]: [f64; 3]| format!("[{r} {g} {b}]");
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"rgb sigma_a\" {} \
         \"rgb sigma_s\" {} \"float g\" [{g}]\n",
        rgb(absorption),
        rgb(scattering)
    )
}

/// All integrators have the picture of a scene as its whole says, and as path tracing says in four
/// regions.
pub fn expect_agreement(scene: &Scene, effort: u64, name: &str) {
    let comparisons = (ALL.len() - 1) * 3 * 5;
    let runs = |(kind, work): (IntegratorKind, u64)| {
        let runs = Runs::new(scene, &settings(scene, kind, work * effort), SEEDS);
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
                let cos = (d[0] * to[0] + d[1] * to[1] + d[2] * to[2]) / r;
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
        let text = head(
            4,
            4,
            0,
            "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"",
        ) + &homogeneous("one", a.map(|v| v * scale), b.map(|v| v * scale), 0.0)
            + &homogeneous("two", b, [0.0; 3], 0.0)
            + &slab("one", 0.0, thick)
            + &slab("two", 1.5, 1.75)
            + "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\nMaterial \"matte\"\n\
               Translate 0 0 3\nReverseOrientation\nShape \"disk\" \"float radius\" [20]\n";
        let scene = scene(&text);
        for kind in SAMPLED {
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
    expect_agreement(&scene(&mixed()), 1, "media-mixed");
}

/// Light from infinity and from a spotlight, above a ground of which the back is seen: the file
/// says of it that it is in a vacuum.
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
           AttributeBegin\nReverseOrientation\nShape \"trianglemesh\"\n\
           \"integer indices\" [0 1 2 0 2 3]\n\
           \"point P\" [-2 -1 -2 -2 -1 2 2 -1 2 2 -1 -2]\n\
           AttributeEnd\nShape \"sphere\" \"float radius\" [.5]\n";
    expect_agreement(&scene(&text), 1, "media-lights");
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

/// Values of a small grid, none of them like another.
pub const DENSITY: [f64; 24] = [
    0.3, 1.2, 0.0, 0.7, 2.0, 0.1, 0.9, 0.4, 1.1, 0.0, 0.0, 1.6, 0.2, 0.8, 1.9, 0.5, 0.6, 1.3, 0.0,
    1.0, 0.35, 0.15, 1.7, 0.45,
];

fn grid_values() -> String {
    DENSITY.map(|v| v.to_string()).join(" ")
}

/// The density of that grid at a point of the unit cube, as pbrt interpolates it.
fn density(p: [f64; 3]) -> f64 {
    let size = [2i64, 3, 4];
    let q = [0, 1, 2].map(|k| p[k] * size[k] as f64 - 0.5);
    let mut sum = 0.0;
    for corner in 0..8 {
        let mut weight = 1.0;
        let mut at = [0i64; 3];
        for k in 0..3 {
            let bit = (corner >> k & 1) as f64;
            let low = q[k].floor();
            let part = q[k] - low;
            weight *= if bit == 1.0 { part } else { 1.0 - part };
            at[k] = low as i64 + bit as i64;
        }
        if (0..3).all(|k| at[k] >= 0 && at[k] < size[k]) {
            sum += weight * DENSITY[((at[2] * 3 + at[1]) * 2 + at[0]) as usize];
        }
    }
    sum
}

/// A box of interface around the unit cube, `size` wide, the camera looking along z.
fn before_grid(depth: u32, medium: &str) -> String {
    head(
        4,
        4,
        depth,
        "Scale -1 1 1\nLookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"",
    ) + "Translate -1 -1 0 Scale 2 2 2\n"
        + medium
        + "AttributeBegin\nMaterial \"\"\nMediumInterface \"smoke\" \"\"\nTranslate .5 .5 .5\n\
           Shape \"sphere\" \"float radius\" [2]\nAttributeEnd\n\
           AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nMaterial \"matte\"\n\
           Translate .5 .5 3\nReverseOrientation\nShape \"disk\" \"float radius\" [1]\n\
           AttributeEnd\n"
}

/// Rays through a grid lose what the integral of its density says.
#[test]
fn grids_let_pass_what_their_integral_says() {
    let medium = format!(
        "MakeNamedMedium \"smoke\" \"string type\" \"heterogeneous\" \"integer nx\" [2] \
         \"integer ny\" [3] \"integer nz\" [4] \"float density\" [{}] \
         \"rgb sigma_a\" [.2 .2 .2] \"rgb sigma_s\" [.5 .5 .5]\n",
        grid_values()
    );
    let scene = scene(&before_grid(0, &medium));
    for (kind, _) in ALL {
        // Where a sample falls within its pixel is chance: pixels are compared with their means.
        let runs = Runs::new(&scene, &settings(&scene, kind, 64), SEEDS);
        let (n, steps) = (24, 256);
        let mut truth = 0.0;
        for i in 0..n * n {
            let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let (x, y) = (at(i % n), at(i / n));
            let depth: f64 = (0..steps)
                .map(|k| density([x, y, (f64::from(k) + 0.5) / f64::from(steps)]))
                .sum::<f64>()
                * 2.0
                / f64::from(steps);
            truth += (-0.7 * depth).exp() / f64::from(n * n);
        }
        for c in 0..3 {
            runs.whole(c)
                .expect(truth, &format!("grid {kind:?} channel {c}"));
        }
    }
}

#[test]
fn integrators_agree_about_smoke() {
    let v3 = format!(
        "MakeNamedMedium \"smoke\" \"string type\" \"heterogeneous\" \"integer nx\" [2] \
         \"integer ny\" [3] \"integer nz\" [4] \"float density\" [{}] \"float g\" [.4] \
         \"rgb sigma_a\" [.4 .2 .0] \"rgb sigma_s\" [1 1.2 1.4]\n",
        grid_values()
    );
    expect_agreement(&scene(&before_grid(4, &v3)), 1, "media-smoke");
}

/// What a medium emits and does not scatter, in closed form.
#[test]
fn media_emit_what_they_should() {
    let camera = "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"\n\
                  Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
                  PixelFilter \"box\"\nIntegrator \"volpath\" \"integer maxdepth\" 3\nWorldBegin\n";
    let text = camera.to_owned()
        + "MakeNamedMedium \"fire\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.5 1 0] \
           \"rgb sigma_s\" [0 0 0] \"rgb Le\" [2 3 4] \"float Lescale\" .5\n\
           Material \"interface\" MediumInterface \"fire\" \"\"\n\
           Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \
           \"point3 P\" [-9 -9 0 9 -9 0 9 9 0 -9 9 0]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
           \"point3 P\" [-9 -9 2 9 -9 2 9 9 2 -9 9 2]\n";
    let scene = scene(&text);
    for kind in SAMPLED {
        let render = run(&scene, &settings(&scene, kind, 4));
        for pixel in &render.pixels {
            for (c, (a, l)) in [(0.5f64, 1.0), (1.0, 1.5), (0.0, 2.0)]
                .into_iter()
                .enumerate()
            {
                let truth = l * (1.0 - (-2.0 * a).exp());
                let off = (f64::from(pixel[c]) - truth).abs();
                assert!(off < 1e-4, "{kind:?}: {pixel:?} channel {c} {truth}");
            }
        }
    }
}

/// A medium that scatters what it emits; light tracing does not follow that.
#[test]
fn integrators_agree_about_fire() {
    let camera = "LookAt 0 .5 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n\
                  Film \"rgb\" \"integer xresolution\" 10 \"integer yresolution\" 10\n\
                  PixelFilter \"box\"\nIntegrator \"volpath\" \"integer maxdepth\" 3\nWorldBegin\n";
    let text = format!(
        "{camera}MakeNamedMedium \"even\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.5 1 .1] \
         \"rgb sigma_s\" [1 .5 2] \"rgb Le\" [2 3 4]\n\
         AttributeBegin Translate -1.6 -.8 -.8 Scale 1.6 1.6 1.6\n\
         MakeNamedMedium \"hot\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer ny\" 3 \
         \"integer nz\" 4 \"float density\" [{0}] \"float temperature\" [{0}] \
         \"float temperaturescale\" 1500 \"rgb sigma_a\" [.5 1 1] \"rgb sigma_s\" [2 2 1]\n\
         AttributeEnd\n\
         Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
         \"point3 P\" [-5 -1 -5 -5 -1 5 5 -1 5 5 -1 -5]\n\
         Material \"interface\"\n\
         AttributeBegin MediumInterface \"hot\" \"\" Translate -.8 0 0 Shape \"sphere\" \
         \"float radius\" .79 AttributeEnd\n\
         AttributeBegin MediumInterface \"even\" \"\" Translate .8 0 0 Shape \"sphere\" \
         \"float radius\" .7 AttributeEnd\n",
        grid_values()
    );
    let scene = scene(&text);
    let comparisons = 4 * 3 * 5;
    let pt = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), SEEDS);
    pt.show("media-fire");
    for (kind, work) in ALL
        .into_iter()
        .filter(|(kind, _)| !matches!(kind, IntegratorKind::Pt | IntegratorKind::Lt))
    {
        let other = Runs::new(&scene, &settings(&scene, kind, work), SEEDS);
        for (i, (a, b)) in other.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
            let what = format!("fire {kind:?} region {} channel {}", i / 3, i % 3);
            a.expect_same_among(comparisons, &b, &what);
        }
    }
}

/// Thick and thin media, nested, with narrow phase functions.
#[test]
fn integrators_agree_about_hard_media() {
    let camera = homogeneous("air", [0.0; 3], [1e-4, 2e-4, 0.0], -0.9)
        + "MediumInterface \"\" \"air\"\nLookAt 0 .3 -3  0 0 0  0 1 0\n\
           Camera \"perspective\" \"float fov\" [50]";
    let text = head(8, 8, 6, &camera)
        + &homogeneous("thick", [0.1, 1.0, 10.0], [500.0, 1000.0, 200.0], 0.0)
        + &homogeneous("narrow", [0.0; 3], [3.0, 2.0, 1.0], 0.99)
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [20 20 20]\nMaterial \"matte\"\n\
           Translate 0 2 -2\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n\
           AttributeBegin\nMaterial \"\"\nMediumInterface \"narrow\" \"air\"\n\
           Shape \"sphere\" \"float radius\" [1]\n\
           MediumInterface \"thick\" \"narrow\"\nShape \"sphere\" \"float radius\" [.5]\n\
           AttributeEnd\n";
    expect_agreement(&scene(&text), 2, "media-hard");
}

/// What files say of media, in numbers: presets, scales, sides.
#[test]
fn files_are_read_as_pbrt_reads_them() {
    let v3 = head(4, 4, 1, "Camera \"perspective\"")
        + "MakeNamedMedium \"milk\" \"string type\" \"homogeneous\" \"string preset\" \"Wholemilk\" \
           \"float scale\" [10]\n\
           MakeNamedMedium \"same\" \"string type\" \"homogeneous\" \"float scale\" [10]\n\
           MakeNamedMedium \"unused\" \"string type\" \"heterogeneous\"\n\
           MediumInterface \"milk\" \"same\"\nMaterial \"\"\nShape \"sphere\"\n\
           AttributeBegin\nMediumInterface \"milk\"\nShape \"sphere\" \"float radius\" [.5]\n\
           AttributeEnd\n";
    let scene = scene(&v3);
    let media = &scene.media;
    assert_eq!(media.list.len(), 2, "{:?}", media.list);
    let per_length = |v: f64| (v * 10.0 / scene.space.scale) as f32;
    for medium in &media.list {
        for (c, (a, s)) in [(0.0011, 2.55), (0.0024, 3.21), (0.014, 3.77)]
            .iter()
            .enumerate()
        {
            assert!((medium.scattering[c] / per_length(*s) - 1.0).abs() < 1e-6);
            assert!((medium.extinction[c] / per_length(a + s) - 1.0).abs() < 1e-6);
        }
    }
    let named = |i: u32| media.list[i as usize].name.as_str();
    assert_eq!(media.boundaries.len(), 1);
    assert_eq!(media.boundaries[0].map(named), ["same", "milk"]);
    // The camera of v3 is in the medium that is outside at the end.
    assert_eq!(named(media.camera), "same");
    assert!(
        scene.warnings.iter().any(|w| w.contains("\"density\"")),
        "{:?}",
        scene.warnings
    );
}
