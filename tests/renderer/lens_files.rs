//! pbrt's `realistic` camera: against the closed form of a thin lens, and through real designs.

use crate::common;
use crate::support;

use common::stats::Random;
use phalanx::camera::Camera;
use phalanx::integrate::{Render, Silent, Width, render};
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, PathSamplerKind, Projection, Scene};
use phalanx::transport::World;
use std::f64::consts::PI;
use support::{Estimate, Runs, run, settings};

/// A stop of 10 mm before a lens of focal length 100 mm, 1 mm thick.
const THIN: &str = "# stop\n0 0.001 1 10\n100 1 1.5 20\n-100 100 1 20\n";

/// How deep in that lens its principal planes lie, in metres.
const PLANE: f64 = 1e-3 / 3.0;

/// The double Gauss of US patent 2673491, scaled to 50 mm.
const GAUSS: &str = "29.475 3.76 1.67 25.2\n84.83 0.12 1 25.2\n19.275 4.025 1.67 23\n\
                     40.77 3.275 1.699 23\n12.75 5.705 1 18\n0 4.5 0 17.1\n\
                     -14.495 1.18 1.603 17\n40.77 6.065 1.658 20\n-20.385 0.19 1 20\n\
                     437.065 3.22 1.717 20\n-39.73 0 1 20\n";

/// A scene beside lens files of both.
fn load(text: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, lenses) in [
        ("thin.dat", THIN),
        ("gauss.dat", GAUSS),
        ("bad.dat", "1 2\nx 4"),
    ] {
        std::fs::write(folder.path().join(name), lenses).unwrap();
    }
    std::fs::write(folder.path().join("three.dat"), "1 2 3").unwrap();
    load_str(text, "t.pbrt", folder.path()).map_err(|e| e.to_string())
}

fn loaded(text: &str) -> Scene {
    load(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn film_distance(scene: &Scene) -> f64 {
    match &scene.camera.projection {
        Projection::Lenses(lenses) => lenses.elements.last().unwrap().thickness,
        other => panic!("{other:?}"),
    }
}

/// An edge of light far behind the plane in focus, as the lens and as pbrt's perspective camera
/// with a disk for a lens blur it. Rays are within 3 degrees of the axis, and what the lens does
/// not bring to a point is below a twentieth of a pixel. Brightness: the irradiance of a disk of
/// radiance 1 at the distance of the film.
#[test]
fn a_thin_lens_is_a_perspective_camera_with_a_lens() {
    let film =
        "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 4 \"float diagonal\" 10\n";
    let edge = "Integrator \"path\" \"integer maxdepth\" 0\nPixelFilter \"box\"\nWorldBegin\n\
                AreaLightSource \"diffuse\" \"rgb L\" [2 2 2] \"bool twosided\" true\n\
                Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
                \"point3 P\" [0.02 -9 4 9 -9 4 9 9 4 0.02 9 4]\n";
    let real = loaded(&format!(
        "Camera \"realistic\" \"string lensfile\" \"thin.dat\" \"float aperturediameter\" 10 \
         \"float focusdistance\" 0.5\n{film}{edge}"
    ));
    assert!(real.warnings.is_empty(), "{:?}", real.warnings);
    // The lensmaker's equation, between the principal planes.
    let z = film_distance(&real) + PLANE;
    let lens = z + PLANE;
    let power = 1.0 / z + 1.0 / (0.5 - lens);
    assert!((power - 10.0).abs() < 0.03, "{z}: {power}");
    let half_height = 5e-3 / 17f64.sqrt();
    let fov = 2.0 * (half_height / z).atan().to_degrees();
    let thin = loaded(&format!(
        "LookAt 0 0 {lens}  0 0 {}  0 1 0\nCamera \"perspective\" \"float fov\" {fov} \
         \"float lensradius\" 0.005 \"float focaldistance\" {}\n{film}{edge}",
        lens + 1.0,
        0.5 - lens
    ));
    let pictures = |scene: &Scene, kind| Runs::new(scene, &settings(scene, kind, 256), 16);
    let truth = pictures(&thin, IntegratorKind::Pt);
    for kind in support::BOTH {
        let seen = pictures(&real, kind);
        seen.show(&format!("thin lens {kind:?}"));
        for i in 0..16 {
            let x = (f64::from(i) - 7.5) / 8.0 * 4.0 * half_height;
            let cos2 = z * z / (z * z + x * x);
            let exposure = PI * 0.005 * 0.005 / (z * z) * cos2 * cos2;
            let scaled = |runs: &Runs, by: f64| {
                let e = runs.region([i, i + 1, 0, 4], 0);
                Estimate {
                    mean: e.mean * by,
                    error: e.error * by,
                    ..e
                }
            };
            let what = format!("thin lens {kind:?} column {i}");
            let seen = scaled(&seen, 1.0 / exposure);
            seen.expect_same_among(32, &scaled(&truth, 1.0), &what);
        }
    }
}

/// What a point of the film gathers of a sky of radiance 1.
fn gathered(scene: &Scene, place: [f32; 2], n: usize) -> Estimate {
    let camera = Camera::new(&scene.camera, &scene.film);
    let mut random = Random(17);
    let values: Vec<f64> = (0..n)
        .map(|_| {
            let lens = (random.uniform(), random.uniform());
            f64::from(camera.ray::<f32, false>(place[0], place[1], lens).weight)
        })
        .collect();
    Estimate::of(&values)
}

/// v3's simple weighting divides by the area of the pupil's box: pbrt's grid of 2^20 points on a
/// square of three radii, and two steps more on every side. All shapes of v4's stop are as bright
/// as the disk.
#[test]
fn brightness_is_that_of_the_disk() {
    let view = |v4: bool, more: &str| {
        let film = if v4 { "rgb" } else { "image" };
        loaded(&format!(
            "Camera \"realistic\" \"string lensfile\" \"thin.dat\" \"float aperturediameter\" 10 \
             \"float focusdistance\" 2 {more}\nFilm \"{film}\" \"integer xresolution\" 20 \
             \"integer yresolution\" 20\nWorldBegin\nShape \"sphere\"\n"
        ))
    };
    let middle = [10.0, 10.0];
    let step = 2.0 * 2.0f64.sqrt() * 3.0 * 10.0 / 1024.0;
    let simple = gathered(&view(false, ""), middle, 100_000);
    // The stop is seen through the lens, a little larger than it is: so is its box, alike.
    let share = simple.mean / (PI * 25.0 / (10.0 + 2.0 * step).powi(2));
    assert!((share - 1.0).abs() < 0.01, "{share}");
    let z = film_distance(&view(true, "")) + PLANE;
    let disk = PI * 0.005 * 0.005 / (z * z);
    for time in [1.0, 0.25] {
        let more = format!("\"bool simpleweighting\" \"false\" \"float shutterclose\" {time}");
        let seen = gathered(&view(false, &more), middle, 100_000);
        assert!((seen.mean / disk / time - 1.0).abs() < 0.015, "{seen:?}");
    }
    let circle = gathered(
        &view(true, "\"string aperture\" \"circular\""),
        middle,
        200_000,
    );
    assert!(
        (circle.mean / disk - 1.0).abs() < 0.015,
        "{circle:?} {disk}"
    );
    for shape in ["gaussian", "square", "pentagon", "star"] {
        let seen = view(true, &format!("\"string aperture\" \"{shape}\""));
        gathered(&seen, middle, 200_000).expect_same(&circle, shape);
    }
}

/// A lit scene through a real design.
fn still_life() -> Scene {
    loaded(
        "LookAt 0 0.3 -1.2  0 0.1 0  0 1 0\n\
         Camera \"realistic\" \"string lensfile\" \"gauss.dat\" \"float aperturediameter\" 17 \
         \"float focusdistance\" 1.2\n\
         Film \"image\" \"integer xresolution\" 24 \"integer yresolution\" 16\n\
         Integrator \"path\" \"integer maxdepth\" 3\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [0.5 0.6 0.8]\n\
         AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [9 8 7]\nTranslate 0.3 0.5 0\n\
         Shape \"sphere\" \"float radius\" 0.1\nAttributeEnd\n\
         Material \"matte\" \"rgb Kd\" [0.7 0.4 0.2]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 0 -2 2 0 -2 2 0 2 -2 0 2]\n\
         Translate 0 0.1 0\nMaterial \"glass\"\nShape \"sphere\" \"float radius\" 0.1\nWorldEnd\n",
    )
}

#[test]
fn all_integrators_see_the_same_through_lenses() {
    let scene = still_life();
    let of = |kind, effort| Runs::new(&scene, &settings(&scene, kind, effort), 6);
    let truth = of(IntegratorKind::Pt, 24);
    truth.show("lenses pt");
    let others = [
        IntegratorKind::Bdpt,
        IntegratorKind::Mmlt,
        IntegratorKind::Pssmlt(PathSamplerKind::Pt),
        IntegratorKind::Auto,
    ];
    for kind in others {
        let seen = of(kind, 24);
        let (a, b) = (seen.grid(3, 2), truth.grid(3, 2));
        for (i, (a, b)) in a.iter().zip(&b).enumerate() {
            a.expect_same_among(4 * 18, b, &format!("{kind:?} region {i}"));
        }
    }
}

#[test]
fn lanes_change_no_bit_and_nothing_is_joined_to_lenses() {
    let scene = still_life();
    let world = World::new(&scene, 3);
    for depth in &world.plan.depths {
        let joined = depth.strategies.iter().any(|s| *s > depth.depth);
        assert!(!joined, "{:?}", depth.strategies);
    }
    for kind in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
        let by = |lanes| -> Render {
            let settings = phalanx::integrate::Settings {
                lanes,
                ..settings(&scene, kind, 4)
            };
            run(&scene, &settings)
        };
        assert!(by(Width::One).pixels == by(Width::Eight).pixels, "{kind:?}");
    }
    let refused = render(&scene, &settings(&scene, IntegratorKind::Lt, 1), &Silent);
    let error = refused.err().expect("an error").to_string();
    assert!(error.contains("realistic camera; use pt"), "{error}");
}

#[test]
fn what_lenses_cannot_be_is_said() {
    let camera = |more: &str| {
        let text = format!("Camera \"realistic\" {more}\nWorldBegin\nShape \"sphere\"\n");
        load(&text).err().unwrap_or_else(|| panic!("{more}"))
    };
    let file = |name: &str| format!("\"string lensfile\" \"{name}\"");
    for (more, message) in [
        (String::new(), "needs a lens file"),
        (file("none.dat"), "none.dat: "),
        (file("bad.dat"), "bad.dat:2: \"x\" is no number"),
        (
            file("three.dat"),
            "a surface has 4 numbers, but there are 3",
        ),
        (
            file("gauss.dat") + "\"float aperturediameter\" -1",
            "aperture diameter -1 is not above 0",
        ),
        (
            file("gauss.dat") + "\"float aperturediameter\" 0.01",
            "is the aperture, or a lens, too small?",
        ),
        (
            file("gauss.dat") + "\"float focusdistance\" 0.05",
            "focus distance 0.05 is too short",
        ),
        (
            file("gauss.dat") + "\"string aperture\" \"none.png\"",
            "none.png",
        ),
    ] {
        let error = camera(&more);
        let begins = error.starts_with("t.pbrt:1:1: Camera \"realistic\": ");
        assert!(begins && error.contains(message), "{more}: {error}");
    }
    let wide = format!(
        "Camera \"realistic\" {} \"float aperturediameter\" 99\nWorldBegin\nShape \"sphere\"\n",
        file("gauss.dat")
    );
    let warnings = loaded(&wide).warnings;
    assert!(warnings[0].contains("cut down to it"), "{warnings:?}");
}
