//! What breaks Metropolis renderers: pictures without light, odd sizes, starts and stops, borders and filters, places far from the
//! origin.

mod support;

use phalanx::integrate::{EndedBy, Observer, Phase, Render, Settings, render};
use phalanx::scene::{IntegratorKind, Scene};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use support::{
    BOTH, Estimate, Runs, expect_integrators_agree, head, inward_box, run, scene, settings,
};

const CAMERA: &str = "LookAt 0 1.5 5  0 .8 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]";

/// A floor, a wall, a ball, all of one albedo.
fn stage(albedo: [f64; 3]) -> String {
    let [r, g, b] = albedo;
    format!(
        "Material \"matte\" \"rgb Kd\" [{r} {g} {b}]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 3 0 -2 3 3 -2 -3 3 -2]\n\
         AttributeBegin\nTranslate .3 .6 0\nShape \"sphere\" \"float radius\" [.6]\nAttributeEnd\n"
    )
}

const GREY: [f64; 3] = [0.7, 0.7, 0.7];

/// A lamp over the stage.
fn lamp(l: &str) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" {l}\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
         Translate -.5 2.5 .5\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [.4]\nAttributeEnd\n"
    )
}

fn lit_stage(width: u32, height: u32) -> Scene {
    // The same view whatever the shape of the film.
    let camera = format!("{CAMERA} \"float screenwindow\" [-1.333 1.333 -1 1]");
    scene(&(head(width, height, 4, &camera) + &lamp("[8 8 8]") + &stage(GREY)))
}

// --- No light ---

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
        for kind in BOTH {
            let render = run(&scene, &settings(&scene, kind, 8));
            assert!(
                render.pixels.iter().flatten().all(|v| *v == 0.0),
                "{what}, {kind:?}: not black"
            );
            assert_eq!(render.pixels.len(), 16 * 12);
            if kind == IntegratorKind::Mmlt {
                assert!(!render.warnings.is_empty(), "{what}: no warning");
                println!("{what}: {}", render.warnings.join("; "));
            }
        }
    }
}

/// A light walled in. Rounding puts points that lie within some 1e-7 of an edge beyond the adjoining wall, and what scatters there escapes:
/// measured, 1e-5 of the light.
#[test]
fn a_light_walled_in() {
    let walls = "Material \"matte\"\n".to_string() + &inward_box([-1.0, 0.0, 2.2, 2.7, 0.0, 1.0]);
    let [open, walled] = ["", &walls].map(|walls| {
        let scene = scene(&(head(32, 24, 3, CAMERA) + &lamp("[8 8 8]") + walls + &stage(GREY)));
        let settings = Settings {
            bootstrap: 200_000,
            ..settings(&scene, IntegratorKind::Mmlt, 16)
        };
        let render = run(&scene, &settings);
        render.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>()
    });
    println!("{:.2e} of the light leaks out", walled / open);
    assert!(walled <= 1e-4 * open);
}

// --- Start-up ---

/// Chains that make few mutations show where they started. The mean of many tiny renders must be PT's.
#[test]
fn no_bias_at_the_start() {
    let scene = lit_stage(12, 9);
    let pt = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 1000), 24);
    for (mutations, chains, bootstrap) in [(1, 200, 400), (4, 40, 1000), (20, 8, 2000)] {
        let settings = Settings {
            mutations_per_pixel: mutations,
            chains,
            bootstrap,
            ..settings(&scene, IntegratorKind::Mmlt, 1)
        };
        let mmlt = Runs::new(&scene, &settings, 1000);
        for (i, (a, b)) in mmlt.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
            let what = format!(
                "{mutations} mutations per pixel, {chains} chains, region {}",
                i / 3
            );
            a.expect_same(&b, &what);
        }
        // The means of a thousand runs are good to the same part of a percent as PT's.
        mmlt.whole(1)
            .expect_same(&pt.whole(1), &format!("{mutations} mutations per pixel"));
    }
}

// --- Odd sizes ---

/// MMLT with changed settings has the mean of PT.
#[track_caller]
fn expect_mean_of_pt(scene: &Scene, change: &dyn Fn(&mut Settings), seeds: u64, what: &str) {
    let [pt, mmlt] = BOTH.map(|kind| {
        let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
        let mut s = settings(scene, kind, (20_000 / pixels).max(2));
        change(&mut s);
        Runs::new(scene, &s, seeds)
    });
    mmlt.whole(1).expect_same(&pt.whole(1), what);
}

#[test]
fn odd_films() {
    let check = expect_mean_of_pt;
    check(&lit_stage(1, 1), &|_| (), 24, "one pixel");
    let few = |s: &mut Settings| {
        s.mutations_per_pixel = 3;
        s.samples_per_pixel = 5000;
        s.bootstrap = 1000;
    };
    check(
        &lit_stage(1, 1),
        &few,
        400,
        "one pixel, more chains than mutations",
    );
    check(&lit_stage(10_000, 1), &|_| (), 16, "10000 by 1");
    check(&lit_stage(1, 10_000), &|_| (), 16, "1 by 10000");

    // Depth 0 shows the lamp alone.
    let camera = "LookAt 0 .5 3  -.5 2.5 .5  0 1 0\nCamera \"perspective\" \"float fov\" [50]";
    let text = head(16, 12, 0, camera) + &lamp("[8 8 8]") + &stage(GREY);
    check(&scene(&text), &|_| (), 24, "depth 0");
}

#[test]
fn odd_chains() {
    let check = expect_mean_of_pt;
    let stage_of_few_pixels = lit_stage(16, 12);
    let on = &stage_of_few_pixels;
    check(on, &|s| s.chains = 1, 24, "one chain");
    check(
        on,
        &|s| s.chains = 10_000,
        24,
        "as many chains as mutations, nearly",
    );
    check(on, &|s| s.chains = 30_000, 24, "more chains than mutations");
    check(
        on,
        &|s| s.large_step_probability = 1.0,
        24,
        "large steps only",
    );
    check(
        on,
        &|s| s.large_step_probability = 0.02,
        48,
        "hardly any large step",
    );
    // A depth that the bootstrap missed altogether is left out, so it must not hide a lamp that few pixels see.
    let lamp_behind = format!(
        "AttributeBegin\nTranslate 0 0 1.5\n{}AttributeEnd\n",
        lamp("[8 8 8]")
    );
    let text = head(16, 12, 4, CAMERA) + &lamp_behind + &stage(GREY);
    check(
        &scene(&text),
        &|s| s.bootstrap = 300,
        48,
        "a small bootstrap",
    );
}

/// Depths that share a layer of the film, and products of many densities.
#[test]
fn long_paths() {
    let albedo: f64 = 0.95;
    let depth = 40;
    let text = head(
        8,
        8,
        depth,
        "LookAt 0 0 0  1 .2 .3  0 1 0\nCamera \"perspective\" \"float fov\" [60]",
    ) + &format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [{albedo} {albedo} {albedo}]\n"
    ) + &inward_box([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]);
    let scene = scene(&text);
    let truth: f64 = (0..=depth).map(|k| albedo.powi(k as i32)).sum();
    for kind in BOTH {
        let settings = Settings {
            bootstrap: 512,
            chains: 256,
            ..settings(&scene, kind, 64)
        };
        let runs = Runs::new(&scene, &settings, 12);
        runs.whole(0)
            .expect(truth, &format!("{kind:?} to depth {depth}"));
    }
}

// --- Modes ---

/// Two rooms of which no light passes from one to the other, lit 1000 : 1: small steps cannot lead to the dim one, and the chains that are
/// in it by chance say nothing of its share.
#[test]
fn a_dim_room_beside_a_bright_one() {
    let room = |x: f64, l: f64| {
        format!(
            "AttributeBegin\nTranslate {x} 0 0\nMaterial \"matte\" \"rgb Kd\" [.6 .6 .6]\n{}\
             AreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-.3 .9 .3 .3 .9 .3 .3 .9 .7 -.3 .9 .7]\nAttributeEnd\n",
            open_box()
        )
    };
    let camera =
        "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-2 2 -1 1]";
    let scene = scene(&(head(16, 8, 3, camera) + &room(-1.01, 1000.0) + &room(1.01, 1.0)));
    let [pt, mmlt] = BOTH.map(|kind| {
        let settings = Settings {
            large_step_probability: 0.7,
            ..settings(&scene, kind, 1600)
        };
        Runs::new(&scene, &settings, 24)
    });
    // pbrt's cameras see x grow to the left.
    for (region, what) in [([8, 16, 0, 8], "bright room"), ([0, 8, 0, 8], "dim room")] {
        mmlt.region(region, 0)
            .expect_same(&pt.region(region, 0), what);
    }
    let (bright, dim) = (mmlt.region([8, 16, 0, 8], 0), mmlt.region([0, 8, 0, 8], 0));
    // The rooms are alike: the ratio of their means is that of their lights.
    let scaled = Estimate {
        mean: 1000.0 * dim.mean,
        error: 1000.0 * dim.error,
        freedom: dim.freedom,
    };
    scaled.expect_same(&bright, "a thousand times the dim room");
}

/// `[-1, 1]^3` without its front (`z = 1`).
fn open_box() -> String {
    let quads = [
        "-1 -1 -1 -1 1 -1 -1 1 1 -1 -1 1",
        "1 -1 -1 1 -1 1 1 1 1 1 1 -1",
        "-1 -1 -1 -1 -1 1 1 -1 1 1 -1 -1",
        "-1 1 -1 1 1 -1 1 1 1 -1 1 1",
        "-1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1",
    ];
    let mesh =
        |p| format!("Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{p}]\n");
    quads.map(mesh).concat()
}

// --- Colour ---

/// Blue light alone: the same blue channel as under white light, and no more noise in it.
#[test]
fn saturated_light_is_no_noisier() {
    let lit = |l: &str| scene(&(head(16, 12, 4, CAMERA) + &lamp(l) + &stage(GREY)));
    let [blue, white] = ["[0 0 8]", "[8 8 8]"].map(|l| {
        let scene = lit(l);
        Runs::new(&scene, &settings(&scene, IntegratorKind::Mmlt, 64), 24)
    });
    for c in 0..2 {
        assert_eq!(blue.whole(c).mean, 0.0);
    }
    blue.whole(2).expect_same(&white.whole(2), "blue channel");
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
    // 192 pixels of 24 runs each measure a standard deviation to a percent or two.
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

// --- Borders ---

/// A field of constant radiance is flat to the border of the picture, under every filter, with and without a crop window: it is seen by chance
/// (depth 0), and by light subpaths that end in the camera (depth 1, a lit wall).
#[test]
fn constant_fields_are_flat() {
    let filters = [
        "\"box\"",
        "\"box\" \"float xwidth\" [1.3] \"float ywidth\" [0.8]",
        "\"triangle\"",
        "\"gaussian\"",
        "\"mitchell\"",
        "\"sinc\"",
    ];
    let fields = [
        // The sky alone.
        (
            "sky",
            0,
            "LightSource \"infinite\" \"rgb L\" [1 1 1]\n",
            1.0,
        ),
        // An emissive wall.
        (
            "emissive wall",
            0,
            "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-40 -40 -5 40 -40 -5 40 40 -5 -40 40 -5]\n",
            1.0,
        ),
        // A wall lit by a distant light: all of depth 1, and not by chance.
        (
            "lit wall",
            1,
            "LightSource \"distant\" \"rgb L\" [3.14159265 3.14159265 3.14159265] \"point from\" [0 0 1] \"point to\" [0 0 0]\n\
             Material \"matte\" \"rgb Kd\" [1 1 1]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 -5 9 -9 -5 9 9 -5 -9 9 -5]\n",
            1.0,
        ),
    ];
    for filter in filters {
        for crop in ["", "\"float cropwindow\" [0.25 0.8 0.3 1]"] {
            for (field, depth, world, truth) in fields {
                let text = format!(
                    "LookAt 0 0 0  0 0 -1  0 1 0\nCamera \"perspective\" \"float fov\" [60]\n\
                     Film \"image\" \"integer xresolution\" [16] \"integer yresolution\" [12] {crop}\nPixelFilter {filter}\n\
                     Integrator \"mlt\" \"integer maxdepth\" [{depth}]\nWorldBegin\n{world}"
                );
                let scene = scene(&text);
                for kind in BOTH {
                    let runs = Runs::new(&scene, &settings(&scene, kind, 48), 16);
                    let name = format!("{field} {filter} {crop} {kind:?}");
                    let (w, h) = (runs.width, runs.height);
                    let parts = [
                        ("whole", [0, w, 0, h]),
                        ("left border", [0, 1, 0, h]),
                        ("right border", [w - 1, w, 0, h]),
                        ("upper border", [0, w, 0, 1]),
                        ("lower border", [0, w, h - 1, h]),
                        ("corner", [0, 1, 0, 1]),
                        ("opposite corner", [w - 1, w, h - 1, h]),
                    ];
                    for (part, region) in parts {
                        let mut e = runs.region(region, 1);
                        // PT's weights of a flat field are exact but for the quadrature of the filter's norm.
                        e.error = e.error.hypot(1e-5);
                        e.expect(truth, &format!("{name}, {part}"));
                    }
                }
            }
        }
    }
}

// --- Stops ---

/// Stops once the render has reported some progress.
struct StopAfter {
    phase: Phase,
    reports: u64,
    seen: AtomicU64,
}

impl Observer for StopAfter {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        assert!(done <= total);
        if phase == self.phase {
            self.seen.fetch_add(1, Ordering::Relaxed);
        }
    }
    fn stop(&self) -> bool {
        self.seen.load(Ordering::Relaxed) >= self.reports
    }
}

fn expect_mean(render: Render, truth: &Estimate, what: &str) {
    assert!(render.ended_by != EndedBy::Effort, "{what}: ran to its end");
    let runs = Runs::of(vec![render]);
    let mean = runs.whole(1).mean;
    println!(
        "{what}: {mean:.5} against {:.5} +- {:.5}",
        truth.mean, truth.error
    );
    // A run that goes on for a tenth of a second is good to half a percent; what is lost or counted twice is more.
    assert!(
        (mean / truth.mean - 1.0).abs() < 0.05,
        "{what}: {mean} is not {truth:?}"
    );
}

#[test]
fn stopped_renders_are_normalised() {
    let scene = lit_stage(32, 24);
    let truth = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 128), 8).whole(1);
    for kind in BOTH {
        let endless = Settings {
            bootstrap: 20_000,
            chains: 1000,
            threads: 2,
            ..settings(&scene, kind, 1 << 30)
        };
        for millis in [0, 150, 600] {
            let limited = Settings {
                time: Some(Duration::from_millis(millis)),
                ..endless.clone()
            };
            let begin = Instant::now();
            let render = run(&scene, &limited);
            // The machine may be busy; without the limit it would be years.
            assert!(begin.elapsed() < Duration::from_secs(60));
            assert!(render.ended_by != EndedBy::Effort);
            if millis > 0 {
                expect_mean(render, &truth, &format!("{kind:?}, {millis} ms"));
            }
        }
        for reports in [4, 8] {
            let observer = StopAfter {
                phase: Phase::Render,
                reports,
                seen: AtomicU64::new(0),
            };
            let render = render(&scene, &endless, &observer).unwrap();
            expect_mean(
                render,
                &truth,
                &format!("{kind:?}, stopped after {reports} reports"),
            );
        }
    }
}

/// Many short stopped runs have the mean of whole ones: nothing leaks at the stop itself.
#[test]
fn stops_are_unbiased() {
    let scene = lit_stage(12, 9);
    let truth = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), 24).whole(1);
    let stopped = (0..300).map(|seed| {
        let observer = StopAfter {
            phase: Phase::Render,
            reports: 3,
            seen: AtomicU64::new(0),
        };
        let settings = Settings {
            seed,
            bootstrap: 1000,
            ..settings(&scene, IntegratorKind::Mmlt, 1 << 20)
        };
        let render = render(&scene, &settings, &observer).unwrap();
        assert!(render.ended_by != EndedBy::Effort);
        render
    });
    Runs::of(stopped.collect())
        .whole(1)
        .expect_same(&truth, "stopped after three rounds");
}

#[test]
fn a_stop_during_the_bootstrap_is_harmless() {
    let scene = lit_stage(16, 12);
    for reports in 0..4 {
        let observer = StopAfter {
            phase: Phase::Bootstrap,
            reports,
            seen: AtomicU64::new(0),
        };
        let settings = Settings {
            bootstrap: 50_000,
            threads: 2,
            ..settings(&scene, IntegratorKind::Mmlt, 1 << 30)
        };
        let render = render(&scene, &settings, &observer).unwrap();
        assert!(render.ended_by != EndedBy::Effort);
        assert!(render.pixels.iter().flatten().all(|v| v.is_finite()));
    }
}

// --- Place and size ---

/// The stage with everything in it moved by `d` and scaled by `s`: the picture must be the same.
fn moved(d: f64, s: f64) -> Scene {
    let camera = format!(
        "LookAt {} {} {}  {} {} {}  0 1 0\nCamera \"perspective\" \"float fov\" [40] \"float lensradius\" [{}] \"float focaldistance\" [{}]",
        d,
        d + 1.5 * s,
        d + 5.0 * s,
        d,
        d + 0.8 * s,
        d,
        0.05 * s,
        5.0 * s
    );
    // Intensity is per solid angle: irradiance falls with the square of the scale.
    let i = 4.0 * s * s;
    scene(
        &(head(24, 18, 4, &camera)
            + &format!("Translate {d} {d} {d}\nScale {s} {s} {s}\n")
            + &lamp("[8 8 8]")
            + &format!(
                "AttributeBegin\nTranslate 1 2 1\nLightSource \"point\" \"rgb I\" [{i} {i} {i}]\nAttributeEnd\n"
            )
            + "AttributeBegin\nMaterial \"glass\"\nTranslate -1 .5 1\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n"
            + &stage(GREY)),
    )
}

#[test]
fn scenes_far_away_and_of_any_size() {
    let plain = moved(0.0, 1.0);
    let one = |scene: &Scene| run(scene, &settings(scene, IntegratorKind::Pt, 64)).pixels;
    let mmlt = |scene: &Scene| Runs::new(scene, &settings(scene, IntegratorKind::Mmlt, 64), 12);
    let (pt_plain, mmlt_plain) = (one(&plain), mmlt(&plain));
    let mean: f64 = pt_plain.iter().flatten().map(|v| f64::from(*v)).sum();
    let places = [
        (1e3, 1.0),
        (1e5, 1.0),
        (1e6, 1.0),
        (0.0, 1e-4),
        (0.0, 0.03),
        (0.0, 1e3),
        (0.0, 1e6),
        (1e6, 100.0),
    ];
    for (d, s) in places {
        let scene = moved(d, s);
        // The same primary samples make the same paths, but for roundings that send one in some thousands the other way at an edge.
        let other = one(&scene);
        let off: f64 = (other.iter().flatten().zip(pt_plain.iter().flatten()))
            .map(|(a, b)| f64::from(a - b).abs())
            .sum();
        println!(
            "moved by {d}, scaled by {s}: {:.2e} of the light is elsewhere",
            off / mean
        );
        assert!(
            off / mean < 2e-3,
            "moved by {d}, scaled by {s}: {}",
            off / mean
        );
        let what = format!("moved by {d}, scaled by {s}");
        mmlt(&scene)
            .whole(1)
            .expect_same(&mmlt_plain.whole(1), &what);
    }
}

/// `Scale -1 1 1` around the world shows its mirror image, with emitters on their right sides: meshes, disks and spheres, also inside out.
#[test]
fn mirrored_worlds_are_mirror_images() {
    let world = |scale: &str| {
        head(16, 12, 3, CAMERA)
            + scale
            + &lamp("[8 6 4]")
            + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\nReverseOrientation\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 .2 -1 -2 1.2 -1 -1.2 1.2 -1 -1.2 .2 -1]\n\
               AttributeEnd\n\
               AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [3 2 1]\nTranslate 1.5 .4 0\nShape \"sphere\" \"float radius\" [.3]\n\
               AttributeEnd\n\
               AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [30 20 10]\nTranslate 1.5 1.4 0\nReverseOrientation\n\
               Shape \"sphere\" \"float radius\" [.3]\nAttributeEnd\n"
            + &stage(GREY)
    };
    for kind in BOTH {
        let [plain, mirrored] = ["", "Scale -1 1 1\n"].map(|scale| {
            let scene = scene(&world(scale));
            Runs::new(&scene, &settings(&scene, kind, 64), 16)
        });
        plain.show(&format!("plain-{kind:?}"));
        mirrored.show(&format!("mirrored-{kind:?}"));
        for i in 0..4 {
            let left = plain.region([4 * i, 4 * (i + 1), 0, 12], 0);
            let right = mirrored.region([12 - 4 * i, 16 - 4 * i, 0, 12], 0);
            left.expect_same(&right, &format!("{kind:?} column {i}"));
        }
    }
    expect_integrators_agree(
        &scene(&world("Scale -1 1 1\n")),
        64,
        16,
        [4, 3],
        "mirrored world",
    );
}
