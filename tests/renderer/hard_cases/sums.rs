//! Rows 2, 16, 17, 26, 31, 39 and 41: what is summed, and how much of it.
//!
//! `film::sums` has the exact sums of the film alone (row 16), `tests/renderer/precision.rs` the
//! longest paths depth by depth (row 26), and `tests/renderer/chains.rs` odd numbers of chains (row
//! 31).

use super::COMPARISONS;
use crate::support::stage::{CAMERA, GREY, both, lamp, lit_stage, stage};
use crate::support::{BOTH, Runs, head, inward_box, run, scene, settings};
use phalanx::chain::evaluator::Evaluator;
use phalanx::integrate::Settings;
use phalanx::scene::{Filter, FilterKind, IntegratorKind, LightKind, Param, Scene};
use phalanx::surface::DiffuseMaterial;
use phalanx::transport::World;
use phalanx::transport::mis::{self, Partial};

// --- Not finite ---

/// The stage, and a panel beside it that can break. Black, or it would be lit and lights would see
/// it.
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

/// Row 2: contributions that are not finite, or negative, from lights, from materials, and from
/// shading normals. They are counted, reported once, and left out; the rest of the picture is that
/// of a scene in which what is broken is black.
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
            (material.kind).change(|diffuse: &mut DiffuseMaterial| {
                diffuse.reflectance = Param::Constant([0.5, value, 0.5]);
            });
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

/// Row 16: sums of many splats. Twenty million mutations of one value, 1, in one pixel: `f32` sums
/// would stop at 2^24, and a weight that is lost or counted twice would be one part in twenty
/// million. The pixel is 1 to the last digit of `f32`.
#[test]
fn millions_of_equal_splats_are_exact() {
    let text = head(1, 1, 0, CAMERA) + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    let scene = scene(&text);
    let settings = Settings {
        mutations_per_pixel: 20_000_000,
        chains: 512,
        ..settings(&scene, IntegratorKind::Mmlt, 1)
    };
    let render = run(&scene, &settings);
    assert!(render.stats.mutations >= 20_000_000);
    assert_eq!(render.pixels, [[1.0; 3]]);
}

/// Row 17: counters beyond 32 bits. Bootstrap path `i` and path `i + 2^32` are different paths: 100
/// million of them, 48 depths, are more than 2^32. That the command line takes such numbers,
/// `tests/program/cli.rs` says.
#[test]
fn paths_are_counted_beyond_32_bits() {
    let scene = lit_stage(4, 4);
    let world = World::new(&scene, 3);
    for plan in &world.plan.depths {
        let low = 12_345u64;
        let indices = [low, low + (1 << 32), low + (1 << 33), low + (1 << 47)];
        let samples = Evaluator::ONE.regenerate(plan, 1, &indices);
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

/// Row 26: sums that overflow saturate. What a later density of 0 takes out of a weight must not
/// leave `0 * inf` behind, and whatever goes into a weight, it ends between 0 and 1.
#[test]
fn weights_saturate() {
    let start = |d_vcm: f32, d_vc: f32| Partial { d_vcm, d_vc };
    // A grazing hit after a long way: the sum over earlier strategies is beyond `f32`. None of them
    // can make this bounce.
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
        200,
        "one pixel, more chains than mutations",
    );
    check(&lit_stage(10_000, 1), &|_| (), 16, "10000 by 1");
    check(&lit_stage(1, 10_000), &|_| (), 16, "1 by 10000");

    // Depth 0 shows the lamp alone.
    let camera = "LookAt 0 .5 3  -.5 2.5 .5  0 1 0\nCamera \"perspective\" \"float fov\" [50]";
    let text = head(16, 12, 0, camera) + &lamp("[8 8 8]") + &stage(GREY);
    check(&scene(&text), &|_| (), 24, "depth 0");
}

// --- Bright ---

const ALL: [IntegratorKind; 7] = IntegratorKind::ALL;

/// All that a render says of its picture, in units of the light.
fn figures(i: f64, kind: IntegratorKind) -> Vec<f64> {
    let text = head(16, 12, 3, CAMERA)
        + &format!(
            "LightSource \"point\" \"point from\" [-.5 2.5 .5] \"rgb I\" [{i:e} {i:e} {i:e}]\n"
        )
        + &stage(GREY);
    let scene = scene(&text);
    let settings = Settings {
        error_layers: true,
        strategies: true,
        ..settings(&scene, kind, 8)
    };
    let render = run(&scene, &settings);
    let layers = std::iter::once(&render.pixels).chain(&render.deviation);
    let parts = render.strategies.iter();
    let layers = layers.chain(parts.flat_map(|s| [&s.weighted, &s.unweighted]));
    let mut figures: Vec<f64> = layers.flatten().flatten().map(|v| f64::from(*v)).collect();
    let tiles = render.stats.tiles.unwrap();
    figures.extend(tiles.mean.iter().chain(tiles.stderr.iter().flatten()));
    figures.extend([render.stats.b, render.stats.b_stderr]);
    figures.iter().map(|v| v / i).collect()
}

/// Row 39: brightness. Pictures, errors and pictures of strategies are in proportion to the light,
/// from the darkest to the brightest that `f32` has room for, with every integrator. All arithmetic
/// scales with a power of 2, but for the rounding of what leaves the range.
#[test]
fn light_of_any_brightness() {
    for kind in ALL {
        let plain = figures(1.0, kind);
        let most = plain.iter().fold(0f64, |most, v| most.max(*v));
        for exponent in [-96, -60, 35, 80, 104] {
            let other = figures(2f64.powi(exponent), kind);
            assert_eq!(plain.len(), other.len());
            for (a, b) in plain.iter().zip(&other) {
                // Products of what is dark are rounded where `f32` ends.
                let bound = 1e-6 * a.abs() + 1e-6 * most;
                assert!(
                    (a - b).abs() <= bound,
                    "{kind:?}, light of 2^{exponent}: {a} {b}"
                );
            }
        }
    }
}

/// Row 39: what one lamp lights is not lost beside what another lights, a hundred billion billion
/// times as much.
#[test]
fn dim_light_beside_bright_light() {
    let camera =
        "LookAt 0 0 1  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1 1 -1 1]";
    let panel = |l: &str, from: f64, to: f64| {
        format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l}]\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
             \"point P\" [{from} -2 0 {to} -2 0 {to} 2 0 {from} 2 0]\nAttributeEnd\n"
        )
    };
    // The camera's right is towards negative x.
    let text = head(2, 1, 0, camera)
        + &panel("1e20 1e-20 3", 0.0, 2.0)
        + &panel("0.3 0.7 1e-30", -2.0, 0.0);
    let scene = scene(&text);
    for kind in [IntegratorKind::Pt, IntegratorKind::Lt, IntegratorKind::Bdpt] {
        let render = run(&scene, &settings(&scene, kind, 16));
        assert_eq!(
            render.pixels,
            [[1e20, 1e-20, 3.0], [0.3, 0.7, 1e-30]],
            "{kind:?}"
        );
    }
}

/// Row 39: values beyond `f32` are its largest number, and are counted.
#[test]
fn pictures_hold_no_infinite_values() {
    let mut scene =
        scene(&(head(2, 2, 0, CAMERA) + "LightSource \"infinite\" \"rgb L\" [1e38 1 1]\n"));
    scene.film.scale *= 1000.0;
    for kind in ALL {
        let render = run(&scene, &settings(&scene, kind, 4));
        for [r, g, _] in &render.pixels {
            assert_eq!(*r, f32::MAX, "{kind:?}");
            // Chains weigh colours by their mean: what is so dark beside another channel is
            // rounded.
            assert!((0.0..=1e32).contains(g), "{kind:?}: {g}");
        }
        let told = render
            .warnings
            .iter()
            .filter(|w| w.starts_with("4 values of the picture are beyond"));
        assert_eq!(told.count(), 1, "{kind:?}: {:?}", render.warnings);
    }
}

// --- Flat ---

/// Row 41: a sky of one value is flat after any number of samples, under every filter: samples are
/// divided by what they weigh, or what they lack is filled in.
#[test]
fn skies_are_flat_at_any_number_of_samples() {
    let filters = [
        "\"box\"",
        "\"box\" \"float xwidth\" [.2] \"float ywidth\" [.8]",
        "\"triangle\"",
        "\"gaussian\"",
        "\"gaussian\" \"float xwidth\" [.3] \"float ywidth\" [.3]",
        "\"gaussian\" \"float xwidth\" [1.7] \"float ywidth\" [.45]",
        "\"mitchell\"",
        "\"mitchell\" \"float xwidth\" [.4] \"float ywidth\" [.4]",
        "\"sinc\"",
        "\"sinc\" \"float xwidth\" [1.3] \"float ywidth\" [6]",
    ];
    for filter in filters {
        for crop in ["", "\"float cropwindow\" [0.25 0.8 0.3 1]"] {
            let text = format!(
                "Camera \"perspective\"\nFilm \"image\" \"integer xresolution\" [24] \"integer yresolution\" [18] {crop}\n\
                 PixelFilter {filter}\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [.3 1 7e5]\n"
            );
            let scene = scene(&text);
            for kind in [IntegratorKind::Pt, IntegratorKind::Lt, IntegratorKind::Bdpt] {
                for samples in [1, 2, 3, 16] {
                    let render = run(&scene, &settings(&scene, kind, samples));
                    for pixel in &render.pixels {
                        assert_eq!(
                            *pixel,
                            [0.3, 1.0, 7e5],
                            "{kind:?}, {filter} {crop}, {samples} samples"
                        );
                    }
                    let error = render.stats.relative_error;
                    assert!(
                        error.is_none_or(|e| e < 1e-6),
                        "{kind:?}, {filter}: {error:?}"
                    );
                }
            }
        }
    }
}

/// Row 41: the same mean with every integrator, whether samples are divided by what they weigh or
/// chains splat them, under filters narrower than a pixel, wider, and with negative weights.
#[test]
fn filters_leave_the_mean() {
    let filters = [
        (FilterKind::Gaussian { alpha: 2.0 }, [0.3, 0.8]),
        (FilterKind::Triangle, [1.5, 0.4]),
        (FilterKind::Mitchell { b: 0.2, c: 0.5 }, [2.0, 2.0]),
    ];
    for (kind, radius) in filters {
        let mut scene = lit_stage(12, 9);
        scene.film.filter = Filter {
            kind,
            radius: radius.into(),
        };
        let of = |integrator, effort| Runs::new(&scene, &settings(&scene, integrator, effort), 48);
        let pt = of(IntegratorKind::Pt, 20);
        for (integrator, effort) in [(IntegratorKind::Bdpt, 8), (IntegratorKind::Mmlt, 60)] {
            let runs = of(integrator, effort).grid(2, 2).into_iter();
            for (i, (a, b)) in runs.zip(pt.grid(2, 2)).enumerate() {
                let what = format!("{kind:?} {radius:?}, {integrator:?}, {i}");
                a.expect_same_among(COMPARISONS, &b, &what);
            }
        }
    }
}
