//! Rows 5, 6, 9 and 10: weights, strategies, lights at infinity, and the camera's end.
//!
//! `tests/renderer/strategies.rs` has the sums over strategies against path tracing depth by depth
//! (row 6), `tests/renderer/scenes_hard.rs` an image sky and each light by itself (row 9).

use super::COMPARISONS;
use crate::common::scenes;
use crate::common::stats::{Mean, Random};
use crate::support::stage::{GREY, stage};
use crate::support::{
    BOTH, Runs, expect_integrators_agree_among, head, run, scene, settings, standard_errors,
};
use phalanx::chain::evaluator::Evaluator;
use phalanx::integrate::Settings;
use phalanx::replay::Recorder;
use phalanx::scene::IntegratorKind;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, World};

// --- Weights ---

/// Scattering events of the longest paths compared.
const MAX_DEPTH: u32 = 5;
/// Contributions below this are none; those of lit paths are about 1.
const NOTHING: f64 = 1e-15;
/// Paths per scene and depth.
const PATHS: usize = 3_000;

/// Row 5: weights. Whole paths of every light and material, recorded and weighed in `f64` from all
/// densities: the running sums give every strategy the balance heuristic, so that weights of a path
/// sum to 1.
#[test]
fn every_strategy_reports_the_balance_heuristic() {
    let mut random = Random(11);
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, MAX_DEPTH);
        let recorder = Recorder::new(&scene, &world);
        let mut paths = Paths::new(&world);
        for plan in &world.plan.depths {
            let mut samples = Samples::new(plan.layout.total, PATHS);
            for d in 0..plan.layout.total {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, PATHS, &mut paths);
            let choices = plan.strategies.len() as f64;
            // By strategy: paths that carry light, and visibilities that differ.
            let mut lit = vec![0; plan.depth as usize + 2];
            let (mut differ, mut wild) = (0, 0);
            for i in 0..PATHS {
                let splat = paths.splats.camera[i];
                assert!(
                    splat.rejected == 0,
                    "{name}, depth {}, path {i}",
                    plan.depth
                );
                let got = splat.rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0 / choices;
                let recorded = recorder.walk(plan, &samples.column(i)).path();
                let Some(path) = &recorded else {
                    differ += usize::from(got > 0.0);
                    continue;
                };
                assert_eq!(path.s, splat.s);
                let reference = recorder.reference(path, &plan.strategies);
                let want = reference.value();
                let spread = recorder
                    .sensitivity(path, &plan.strategies, random.next())
                    .value;
                if spread > 0.01 * want {
                    // A rounding error decides what such a path is worth.
                    wild += usize::from(want > 0.0);
                    continue;
                }
                // Vertices on one flat face are joined along it: what passes there is made of
                // rounding errors of cosines.
                if want.max(got) < NOTHING {
                    continue;
                }
                lit[path.s as usize] += 1;
                // A dozen roundings a vertex, and the vertices' own.
                let tolerance = want * 4e-6 * f64::from(plan.depth + 2) + 4.0 * spread;
                assert!(
                    (got - want).abs() <= tolerance,
                    "{name}, depth {}, s = {}: {got:e} where {want:e} +- {tolerance:e} is right; weight {}\n{reference:?}\n{path:#?}",
                    plan.depth,
                    path.s,
                    reference.weight(path.s),
                );
            }
            // Rays that graze an edge may be decided either way, and few paths hang on a rounding
            // error.
            assert!(
                differ <= PATHS / 1000 && wild <= PATHS / 200,
                "{name}: {differ} {wild}"
            );
            println!(
                "{name}, depth {}: lit {lit:?}, visibility differs {differ}, wild {wild}",
                plan.depth
            );
        }
    }
}

/// Row 6: each strategy alone. In a box lit by a lamp, light hit by chance, light sampled from the
/// wall, and light subpaths that end in the camera can each make every path: without weights each
/// gives the whole, and so do all strategies, weighted and summed.
#[test]
fn each_strategy_alone_gives_the_whole() {
    let n = 4096;
    let mut random = Random(61);
    let (name, scene) = scenes::all().swap_remove(0);
    let world = World::new(&scene, 3);
    let recorder = Recorder::new(&scene, &world);
    let mut paths = Paths::new(&world);
    for plan in &world.plan.depths[1..] {
        let k = plan.depth;
        let choices = plan.strategies.len() as f64;
        let mut summed = Mean::default();
        let mut alone = [
            (0, Mean::default()),
            (1, Mean::default()),
            (k + 1, Mean::default()),
        ];
        let mut samples = Samples::new(plan.layout.total, n);
        for _ in 0..60 {
            for d in 0..plan.layout.total {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, n, &mut paths);
            for (i, o) in paths.splats.camera.iter().enumerate() {
                let got = o.rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
                summed.add(got);
                for (s, mean) in &mut alone {
                    // Other strategies carry nothing of this one: a strategy is drawn once in
                    // `choices` times.
                    let mut value = 0.0;
                    if o.s == *s && got > 0.0 {
                        let path = recorder
                            .walk(plan, &samples.column(i))
                            .path()
                            .expect("a path with light");
                        let reference = recorder.reference(&path, &plan.strategies);
                        value = got / reference.weight(*s);
                    }
                    mean.add(value);
                }
            }
        }
        for (s, mean) in alone {
            let error = mean.error().hypot(summed.error());
            let off = (mean.mean() - summed.mean()) / error;
            println!(
                "{name}, depth {k}, of {choices}: s = {s} alone {:.5} +- {:.5}, all {:.5} +- {:.5}: {off:+.2}",
                mean.mean(),
                mean.error(),
                summed.mean(),
                summed.error()
            );
            assert!(
                off.abs() < standard_errors(COMPARISONS, 1e4),
                "depth {k}, s = {s}: {off}"
            );
            // A bias of so much would show.
            assert!(
                error < 0.05 * summed.mean(),
                "depth {k}, s = {s}: too noisy to tell"
            );
        }
    }
}

// --- Infinity ---

/// Row 9: infinite and distant lights. Densities over directions at the light's end of a path, over
/// an area where it meets the scene. The camera sees all of the floor from above, so that light
/// subpaths, which fall on the whole scene, weigh as much as camera subpaths.
#[test]
fn sun_and_constant_sky() {
    let view = "LookAt 0 6 .5  0 0 .5  0 0 -1\nCamera \"orthographic\" \"float screenwindow\" [-3 3 -2.5 2.5]";
    let lights = "LightSource \"distant\" \"rgb L\" [2 2 1] \"point from\" [1 2 2] \"point to\" [0 0 0]\n\
                  LightSource \"infinite\" \"rgb L\" [.2 .3 .5]\n";
    let glossy = "Material \"plastic\" \"rgb Kd\" [.2 .3 .5] \"rgb Ks\" [.4 .4 .4] \"float roughness\" [.2]\n\
                  AttributeBegin\nTranslate -1 .5 1\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n";
    let text = head(24, 20, 3, view) + lights + &stage(GREY) + glossy;
    let name = "sun and sky";
    expect_integrators_agree_among(COMPARISONS, &scene(&text), 48, 64, [2, 2], name);
}

// --- Borders ---

/// Row 10: raster positions of light subpaths, and borders. A field of constant radiance is flat to
/// the border of the picture, under every filter, with and without a crop window: it is seen by
/// chance (depth 0), and by light subpaths that end in the camera (depth 1, a lit wall).
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
        // A wall lit by a distant light: all of depth 1, and not by chance. It is little larger
        // than what is seen of it, so that a good part comes by light subpaths.
        (
            "lit wall",
            1,
            "LightSource \"distant\" \"rgb L\" [3.14159265 3.14159265 3.14159265] \"point from\" [0 0 1] \"point to\" [0 0 0]\n\
             Material \"matte\" \"rgb Kd\" [1 1 1]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-5.7 -4.7 -5 5.7 -4.7 -5 5.7 4.7 -5 -5.7 4.7 -5]\n",
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
                // All of the light falls on the region that the brightness is the mean of.
                let short = |kind| Settings {
                    bootstrap: 1024,
                    ..settings(&scene, kind, 12)
                };
                let render = run(&scene, &short(IntegratorKind::Mmlt));
                let (b, error) = (render.stats.b, render.stats.b_stderr);
                let reach = standard_errors(COMPARISONS, 1e4) * error + 1e-5;
                assert!(
                    (b - truth).abs() <= reach,
                    "{field} {filter} {crop}: {b} +- {error}"
                );
                for kind in BOTH {
                    let runs = Runs::new(&scene, &short(kind), 24);
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
                        // PT's weights of a flat field are exact but for the quadrature of the
                        // filter's norm.
                        e.error = e.error.hypot(1e-5);
                        e.expect_among(COMPARISONS, truth, &format!("{name}, {part}"));
                    }
                }
            }
        }
    }
}
