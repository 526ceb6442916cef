//! Rows 1, 25, 28 and 38: no light, tiny lights, lights of one colour, narrow cones, lights that no
//! ray meets.
//!
//! `tests/program/cli.rs` says what the program prints of a scene without light, and that it ends
//! well (row 1); `tests/renderer/chains.rs` walls a light in.

use super::COMPARISONS;
use crate::support::stage::{CAMERA, GREY, lamp, stage};
use crate::support::{BOTH, Runs, head, run, scene, settings};
use phalanx::integrate::{EndedBy, Render, Settings};
use phalanx::plan::Forced;
use phalanx::scene::{IntegratorKind, PathSamplerKind};

// --- None ---

/// Row 1: no bootstrap path carries light. The picture is black and whole, and a warning says why.
#[test]
fn pictures_without_light_are_black_and_say_so() {
    // Above the wall, which would see it.
    let up = lamp("[8 8 8]")
        .replace("Rotate 90", "Rotate -90")
        .replace(" 2.5 ", " 3.5 ");
    let no_bounce = "Material \"matte\" \"rgb Kd\" [0 0 0]\nAttributeBegin\nTranslate 0 0 9\n"
        .to_string()
        + &lamp("[8 8 8]")
        + "AttributeEnd\n"
        + &stage([0.0; 3]);
    let scenes = [
        ("no lights", stage(GREY)),
        ("nothing at all", String::new()),
        ("a light that faces away", up + &stage(GREY)),
        ("a light of power 0", lamp("[0 0 0]") + &stage(GREY)),
        (
            "an infinite light of power 0",
            "LightSource \"infinite\" \"rgb L\" [0 0 0]\n".to_string() + &stage(GREY),
        ),
        (
            "a point light of power 0",
            "LightSource \"point\" \"rgb I\" [0 0 0]\n".to_string() + &stage(GREY),
        ),
        ("nothing reflects", no_bounce),
    ];
    for (what, world) in scenes {
        let scene = scene(&(head(16, 12, 3, CAMERA) + &world));
        for kind in IntegratorKind::ALL {
            for forced in [&[][..], &[Forced::All]] {
                let settings = Settings {
                    forced: forced.into(),
                    // Black is no picture that is known to be right.
                    target_error: Some(0.5),
                    ..settings(&scene, kind, 8)
                };
                expect_black(
                    &run(&scene, &settings),
                    &format!("{what}, {kind:?}, {forced:?}"),
                );
            }
        }
    }
}

fn expect_black(render: &Render, what: &str) {
    assert!(
        render.pixels.iter().all(|p| *p == [0.0; 3]),
        "{what}: not black"
    );
    assert_eq!(render.pixels.len() as u32, render.width * render.height);
    let told = render
        .warnings
        .iter()
        .filter(|w| w.ends_with("the picture is black") || w.contains("the picture is black;"));
    assert_eq!(told.count(), 1, "{what}: {:?}", render.warnings);
    assert_eq!(render.ended_by, EndedBy::Effort, "{what}");
    assert_eq!(render.stats.relative_error, None, "{what}");
    let figures = [render.stats.b, render.stats.b_stderr];
    assert_eq!(figures.map(f64::to_bits), [0, 0], "{what}: {figures:?}");
}

/// Row 1: tables that are empty, whatever is turned on: no light, no light with an area, no shape,
/// no triangle, no material of one's own, no texture.
#[test]
fn empty_tables() {
    let flat = "AttributeBegin\nAreaLightSource \"diffuse\"\n\
                Shape \"trianglemesh\" \"point P\" [0 0 3 0 0 3 0 0 3] \"integer indices\" [0 1 2]\nAttributeEnd\n";
    let point = "LightSource \"point\" \"point from\" [0 4 0]\n";
    let ball = "Shape \"sphere\"\n";
    let triangle =
        "Shape \"trianglemesh\" \"point P\" [-1 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";
    let glass = "Material \"glass\"\n".to_string() + ball;
    let worlds = [
        ("nothing", String::new()),
        ("a light without area alone", flat.into()),
        ("a light without area", flat.to_string() + triangle),
        ("a ball in the dark", ball.into()),
        ("a triangle in the dark", triangle.into()),
        ("glass in the dark", glass),
        ("a light and nothing to shine on", point.into()),
        ("a lit ball", point.to_string() + ball),
        ("a lit triangle", point.to_string() + triangle),
        ("a sky", "LightSource \"infinite\"\n".into()),
    ];
    for (what, world) in &worlds {
        let scene = scene(&(head(4, 3, 2, CAMERA) + world));
        for kind in IntegratorKind::ALL {
            for forced in Forced::ALL {
                let settings = Settings {
                    forced: vec![forced],
                    bootstrap: 256,
                    ..settings(&scene, kind, 2)
                };
                let render = run(&scene, &settings);
                let finite = render.pixels.iter().flatten().all(|v| v.is_finite());
                assert!(finite, "{what}, {kind:?}, {forced:?}");
                if scene.lights.is_empty() {
                    expect_black(&render, &format!("{what}, {kind:?}, {forced:?}"));
                }
            }
        }
    }
}

// --- Tiny ---

/// Row 25: tiny lights. A sphere of radius `r` and radiance `I / (pi r^2)` lights what it does not
/// touch exactly as a point of intensity `I` does: from a hundredth of the scene to a millionth,
/// with a radiance of up to 4e10.
#[test]
fn spheres_shrink_to_points() {
    let at = "AttributeBegin\nTranslate .7 2.2 1\n";
    let i = 4.0;
    let render = |light: &str, kind| {
        let scene = scene(&(head(12, 9, 3, CAMERA) + at + light + "AttributeEnd\n" + &stage(GREY)));
        Runs::new(&scene, &settings(&scene, kind, 192), 24)
    };
    let point = format!("LightSource \"point\" \"rgb I\" [{i} {i} {i}]\n");
    let truth = render(&point, IntegratorKind::Pt);
    // Its own shadow takes less than 1e-5 of what is reflected.
    for r in [1e-2, 1e-4, 1e-6, 3e-6] {
        let l = i / (std::f64::consts::PI * r * r);
        let sphere = format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\nShape \"sphere\" \"float radius\" [{r}]\n"
        );
        for kind in BOTH {
            let runs = render(&sphere, kind);
            for (j, (a, b)) in runs.grid(2, 2).iter().zip(truth.grid(2, 2)).enumerate() {
                if j % 3 == 1 {
                    let what = format!("radius {r:e}, {kind:?}, region {}", j / 3);
                    a.expect_same_among(COMPARISONS, &b, &what);
                }
            }
        }
    }
}

/// Row 25: the same for panels, down to some billionths of the scene, where the square of their
/// normal nearly leaves `f32`. The panel is in the middle of the scene, so that its corners have
/// all their digits.
#[test]
fn panels_shrink_to_points() {
    let power = 2.0;
    let render = |side: f64, kind| {
        let l = power / (side * side);
        let h = side / 2.0;
        let text = head(
            8,
            8,
            2,
            "LookAt 0 0 4  0 -.9 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]",
        ) + &format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-{h} 0 -{h} {h} 0 -{h} {h} 0 {h} -{h} 0 {h}]\nAttributeEnd\n\
                 Material \"matte\" \"rgb Kd\" [.7 .7 .7]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -1 -2 -2 -1 2 2 -1 2 2 -1 -2]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 1 -2 2 1 -2 2 1 2 -2 1 2]\n"
        );
        let scene = scene(&text);
        Runs::new(&scene, &settings(&scene, kind, 192), 24)
    };
    // At this size the panel is a point but for 1e-6 of its light.
    let truth = render(1e-3, IntegratorKind::Pt);
    assert!(truth.whole(1).mean > 0.01);
    for side in [1e-4, 1e-6, 1e-8] {
        for kind in BOTH {
            let what = format!("side {side:e}, {kind:?}");
            render(side, kind)
                .whole(1)
                .expect_same_among(COMPARISONS, &truth.whole(1), &what);
        }
    }
}

/// Row 25: lights without area are dropped, and the rest of the picture is as it was.
#[test]
fn lights_without_area_shine_on_nothing() {
    let light = |shape: &str| {
        format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1e9 1e9 1e9]\nTranslate 0 1 1\n{shape}\nAttributeEnd\n"
        )
    };
    let lit =
        |extra: &str| scene(&(head(12, 9, 3, CAMERA) + &lamp("[8 8 8]") + extra + &stage(GREY)));
    let plain = lit("");
    for kind in BOTH {
        let truth = run(&plain, &settings(&plain, kind, 16)).pixels;
        for shape in [
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 0 1] \"point P\" [0 0 0 .1 0 0 .2 0 0]",
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1e-12 0 0 0 1e-12 0]",
        ] {
            let scene = lit(&light(shape));
            assert!(!scene.warnings.is_empty(), "{shape}: no warning");
            let pixels = run(&scene, &settings(&scene, kind, 16)).pixels;
            assert!(pixels == truth, "{kind:?}: {shape}");
        }
    }
}

// --- Colour ---

/// Row 28: saturated colour. Blue light alone: the same blue channel as under white light, and no
/// more noise in it.
#[test]
fn saturated_light_is_no_noisier() {
    let lit = |l: &str| scene(&(head(16, 12, 4, CAMERA) + &lamp(l) + &stage(GREY)));
    let [blue, white] = ["[0 0 8]", "[8 8 8]"].map(|l| {
        let scene = lit(l);
        Runs::new(&scene, &settings(&scene, IntegratorKind::Mmlt, 64), 32)
    });
    for c in 0..2 {
        assert_eq!(blue.whole(c).mean, 0.0);
    }
    blue.whole(2)
        .expect_same_among(COMPARISONS, &white.whole(2), "blue channel");
    let noise = |runs: &Runs| {
        let (columns, rows) = (16, 12);
        let cells = runs.grid(columns, rows);
        let error2: f64 = cells
            .iter()
            .skip(2)
            .step_by(3)
            .map(|e| e.error.powi(2))
            .sum();
        error2.sqrt()
    };
    let ratio = noise(&blue) / noise(&white);
    println!("noise of the blue channel, blue over white light: {ratio:.4}");
    // 192 pixels of 32 runs each measure a standard deviation to a percent or two.
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

// --- Narrow ---

/// Row 38: one flux through cones of 5 degrees to a ten-thousandth, along an axis and askew. Almost
/// none of the room is lit by the cone itself, so what is seen has been reflected where it ends.
#[test]
fn cones_of_one_flux_light_a_room_alike() {
    let room = "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\nAttributeBegin\nReverseOrientation\nShape \"sphere\"\nAttributeEnd\n";
    let render = |degrees: f64, to: &str, kind| {
        let versine = 2.0 * (degrees.to_radians() / 2.0).sin().powi(2);
        let i = 1.0 / versine;
        let text = head(
            8,
            8,
            3,
            "LookAt 0 0 .9 0 0 -1 0 1 0\nCamera \"perspective\" \"float fov\" [80]",
        ) + &format!(
            "LightSource \"spot\" \"point from\" [.1 -.5 .2] \"point to\" [{to}] \"float coneangle\" [{degrees}] \
                 \"float conedeltaangle\" [0] \"rgb I\" [{i} {i} {i}]\n{room}"
        );
        let scene = scene(&text);
        Runs::new(&scene, &settings(&scene, kind, 64), 16).whole(1)
    };
    for to in [".1 .5 .2", ".6 .4 -.47"] {
        let truth = render(1.0, to, IntegratorKind::Bdpt);
        assert!(truth.mean > 0.01);
        for degrees in [0.05, 0.001, 0.0001] {
            for kind in [
                IntegratorKind::Bdpt,
                IntegratorKind::Lt,
                IntegratorKind::Mmlt,
            ] {
                let what = format!("{degrees} degrees towards {to}, {kind:?}");
                render(degrees, to, kind).expect_same_among(COMPARISONS, &truth, &what);
            }
        }
    }
}

// --- Unseen ---

/// An area light with alpha 0 lights what a black lamp in its place lights that nobody sees, is
/// itself not seen, and casts no shadow, by every integrator.
#[test]
fn lights_that_no_ray_meets_shine_all_the_same() {
    let panel = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-.5 0 -.5 .5 0 -.5 .5 0 .5 -.5 0 .5]";
    let world = |alpha: &str, extra: &str| {
        format!(
            "AttributeBegin\nTranslate 0 2.2 .5\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [6 6 6]\n\
             {panel} {alpha}\nAttributeEnd\n{extra}"
        ) + &stage(GREY)
    };
    let render = |camera: &str, world: &str, kind| {
        let scene = scene(&(head(12, 9, 3, camera) + world));
        Runs::new(&scene, &settings(&scene, kind, 96), 16)
    };
    let all = [
        IntegratorKind::Pt,
        IntegratorKind::Lt,
        IntegratorKind::Bdpt,
        IntegratorKind::Pssmlt(PathSamplerKind::Bdpt),
        IntegratorKind::Mmlt,
    ];
    let hidden = "\"float alpha\" 0";
    // The lamp itself is in the upper half of the picture; the lower half sees what it lights.
    let truth = render(CAMERA, &world("", ""), IntegratorKind::Pt);
    assert!(truth.whole(1).mean > 0.05);
    // A lamp overhead whose light must pass through it.
    let over = "LightSource \"point\" \"rgb I\" [30 30 30] \"point from\" [0 2.9 .5]\n";
    let bare = |kind| render(CAMERA, &(over.to_string() + &stage(GREY)), kind);
    let alone = bare(IntegratorKind::Pt);
    for kind in all {
        let lit = render(CAMERA, &world(hidden, ""), kind);
        let both = render(CAMERA, &world(hidden, over), kind);
        for (j, a) in lit
            .grid(2, 2)
            .iter()
            .enumerate()
            .filter(|(j, _)| j % 3 == 1 && *j >= 6)
        {
            let b = &truth.grid(2, 2)[j];
            a.expect_same_among(COMPARISONS, b, &format!("{kind:?}, region {}", j / 3));
            let sum = [
                a.mean + alone.grid(2, 2)[j].mean,
                a.error.hypot(alone.grid(2, 2)[j].error),
            ];
            let mut through = alone.grid(2, 2).swap_remove(j);
            (through.mean, through.error) = (sum[0], sum[1]);
            both.grid(2, 2)[j].expect_same_among(
                COMPARISONS,
                &through,
                &format!("{kind:?} through it"),
            );
        }
        // Straight at it from below, with nothing behind.
        let up = "LookAt 0 1 .5 0 2 .5 0 0 1\nCamera \"perspective\" \"float fov\" [20]";
        let light = world(hidden, "");
        let seen = render(
            up,
            &light[..light
                .find("Material \"matte\" \"rgb Kd\" [0.7")
                .unwrap_or(light.len())],
            kind,
        );
        assert_eq!(seen.whole(1).mean, 0.0, "{kind:?} sees it");
    }
}
