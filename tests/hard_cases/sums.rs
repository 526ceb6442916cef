//! Rows 2, 16, 17, 26 and 31: what is summed, and how much of it.
//!
//! `film::sums` has the exact sums of the film alone (row 16), `tests/precision.rs` the longest paths depth by depth (row 26), and
//! `tests/chains.rs` odd numbers of chains (row 31).

use super::COMPARISONS;
use super::support::stage::{CAMERA, GREY, both, lamp, lit_stage, stage};
use super::support::{BOTH, Runs, head, inward_box, run, scene, settings};
use phalanx::chain::bootstrap::regenerate;
use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, LightKind, MaterialKind, Param, Scene};
use phalanx::transport::World;
use phalanx::transport::mis::{self, Partial};

// --- Not finite ---

/// The stage, and a panel beside it that can break. Black, or it would be lit and lights would see it.
fn beside(panel: &str) -> Scene {
    scene(
        &(head(16, 12, 3, CAMERA)
            + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
            + panel
            + "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 .2 -1 -1.2 .2 -1 -1.2 1.2 -1 -2 1.2 -1]\n\
               AttributeEnd\n"
            + &lamp("[8 8 8]")
            + &stage(GREY)),
    )
}

/// Row 2: contributions that are not finite, or negative, from lights, from materials, and from shading normals. They are counted, reported
/// once, and left out; the rest of the picture is that of a scene in which what is broken is black.
#[test]
fn broken_contributions_are_left_out() {
    let broken = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0];
    let black = "Material \"matte\" \"rgb Kd\" [0 0 0]\n";
    let whole = |scene: &Scene| {
        let settings = settings(scene, IntegratorKind::Mmlt, 64);
        let renders = (1..=24).map(|seed| {
            let settings = Settings {
                seed,
                ..settings.clone()
            };
            run(scene, &settings)
        });
        renders.collect::<Vec<_>>()
    };
    let truth = {
        let mut scene = beside(black);
        set_radiance(&mut scene, 0.0);
        Runs::of(whole(&scene)).whole(1)
    };
    for value in broken {
        let mut scene = beside(black);
        set_radiance(&mut scene, value);
        let mut renders = whole(&scene);
        for render in &mut renders {
            assert!(render.stats.rejected_nonfinite > 0, "{value}: none counted");
            let told = |w: &&String| w.contains("not finite");
            assert_eq!(render.warnings.iter().filter(told).count(), 1);
            // `Runs` wants none; here they are.
            render.stats.rejected_nonfinite = 0;
        }
        Runs::of(renders).whole(1).expect_same_among(
            COMPARISONS,
            &truth,
            &format!("beside radiance {value}"),
        );

        let mut scene = beside(black);
        for material in &mut scene.materials {
            if let MaterialKind::Diffuse { reflectance, .. } = &mut material.kind {
                *reflectance = Param::Constant([0.5, value, 0.5]);
            }
        }
        check_finite(&scene, &format!("reflectance {value}"));

        let mut scene = beside(black);
        scene
            .vertices
            .iter_mut()
            .for_each(|v| v.n = [0.0, value, 0.5]);
        check_finite(&scene, &format!("normals {value}"));

        let mut scene = beside(black);
        for light in &mut scene.lights {
            if let LightKind::Triangle { l, .. } = &mut light.kind {
                *l = [value; 3];
            }
        }
        check_finite(&scene, &format!("every light {value}"));
    }
}

/// The panel's radiance: its two triangles are the first lights.
fn set_radiance(scene: &mut Scene, value: f32) {
    for light in &mut scene.lights[..2] {
        let LightKind::Triangle { l, .. } = &mut light.kind else {
            panic!("{light:?}");
        };
        *l = [1.0, value, 1.0];
    }
    if value == 0.0 {
        scene.lights[..2].iter_mut().for_each(|light| {
            if let LightKind::Triangle { l, .. } = &mut light.kind {
                *l = [0.0; 3];
            }
        });
    }
}

#[track_caller]
fn check_finite(scene: &Scene, what: &str) {
    for kind in BOTH {
        let render = run(scene, &settings(scene, kind, 8));
        let good = |v: &f32| v.is_finite() && *v >= 0.0;
        assert!(render.pixels.iter().flatten().all(good), "{what}, {kind:?}");
        assert!(render.stats.b.is_finite(), "{what}, {kind:?}");
    }
}

// --- Many ---

/// Row 16: sums of many splats. Thirty million mutations of one value, 1, in one pixel: `f32` sums would stop at 2^24, and a
/// weight that is lost or counted twice would be one part in thirty million. The pixel is 1 to the last digit of `f32`.
#[test]
fn millions_of_equal_splats_are_exact() {
    let text = head(1, 1, 0, CAMERA) + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    let scene = scene(&text);
    let settings = Settings {
        mutations_per_pixel: 30_000_000,
        chains: 512,
        ..settings(&scene, IntegratorKind::Mmlt, 1)
    };
    let render = run(&scene, &settings);
    assert!(render.stats.mutations >= 30_000_000);
    assert_eq!(render.pixels, [[1.0; 3]]);
}

/// Row 17: counters beyond 32 bits. Bootstrap path `i` and path `i + 2^32` are different paths: 100 million of them, 48 depths, are more than
/// 2^32. That the command line takes such numbers, `tests/cli.rs` says.
#[test]
fn paths_are_counted_beyond_32_bits() {
    let scene = lit_stage(4, 4);
    let world = World::new(&scene, 3);
    for plan in &world.plan.depths {
        let low = 12_345u64;
        let indices = [low, low + (1 << 32), low + (1 << 33), low + (1 << 47)];
        let samples = regenerate::<f32>(plan, 1, &indices);
        for d in 0..plan.layout.total {
            let row = &samples.row(d)[..indices.len()];
            for a in 0..row.len() {
                assert!(!row[..a].contains(&row[a]), "dimension {d}: {row:?}");
            }
        }
    }
    let settings = Settings {
        mutations_per_pixel: 1 << 40,
        bootstrap: 100_000_000,
        time: Some(std::time::Duration::ZERO),
        ..settings(&scene, IntegratorKind::Pt, 1 << 40)
    };
    let render = run(&scene, &settings);
    assert!(render.pixels.iter().flatten().all(|v| v.is_finite()));
}

// --- Long ---

/// Row 26: long paths. Depths that share a layer of the film, and products of many densities.
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
            .expect_among(COMPARISONS, truth, &format!("{kind:?} to depth {depth}"));
    }
}

/// Row 26: sums that overflow saturate. What a later density of 0 takes out of a weight must not leave `0 * inf` behind, and whatever goes into
/// a weight, it ends between 0 and 1.
#[test]
fn weights_saturate() {
    let start = |d_vcm: f32, d_vc: f32| Partial { d_vcm, d_vc };
    // A grazing hit after a long way: the sum over earlier strategies is beyond `f32`. None of them can make this bounce.
    let grazing = start(1.0, 1e30)
        .arrive(1.0, 1e-30)
        .scatter(1.0, 0.5, 0.0, false);
    // From the density of the bounce alone: 1 / (1 + 1 / 0.5).
    assert!((grazing.weight_hit(1.0, 0.0) - 1.0 / 3.0).abs() < 1e-6);
    let all = [
        0.0f32,
        1e-45,
        1e-30,
        1.0,
        1e18,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    for a in all {
        for b in all {
            for c in all {
                for d in all {
                    let p = start(a, b).arrive(c, d).scatter(d, c, a, false);
                    for p in [p, start(a, b), start(a, b).scatter(c, d, a, true)] {
                        let joint = |pdf, pdf_reverse, cos| mis::Joint {
                            pdf,
                            back: p.back(pdf_reverse),
                            cos,
                        };
                        for w in [
                            p.weight_hit(c, d),
                            joint(a, b, c).weight_direct(d, a, true),
                            joint(a, d, b).weight_camera(c),
                        ] {
                            assert!((0.0..=1.0).contains(&w), "{a} {b} {c} {d}: {w}");
                        }
                    }
                }
            }
        }
    }
}

// --- Odd ---

/// MMLT with changed settings has the mean of PT.
#[track_caller]
fn expect_mean_of_pt(scene: &Scene, change: &dyn Fn(&mut Settings), seeds: u64, what: &str) {
    let [pt, mmlt] = both(scene, change, seeds);
    mmlt.whole(1)
        .expect_same_among(COMPARISONS, &pt.whole(1), what);
}

/// Row 31: one pixel, one row, one column, depth 0, fewer mutations than chains.
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
