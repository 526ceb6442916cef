//! The integrator that chooses: whatever it chooses, the picture's expectation is the same.

use crate::common;
use crate::support;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, assert_agree};
use phalanx::chain::evaluator::Evaluator;
use phalanx::integrate::{self, EndedBy, Render, Settings, Shares};
use phalanx::pbrt;
use phalanx::plan::DepthPlan;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::transport::bidirectional::BidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::{PathSampler, Paths, World};
use std::time::Duration;
use support::stage::lit_stage;
use support::{Estimate, Runs, run, scene, settings};

const DEPTH: u32 = 4;
const SEEDS: u64 = 8;

/// Mean channel of all that paths of a sampler bring.
fn mean_of(world: &World, sampler: &PathSampler, random: &mut Random) -> Mean {
    const N: usize = 2048;
    const BATCHES: usize = 12;
    let mut mean = Mean::default();
    let mut paths = Paths::new(world);
    let mut samples = Samples::new(sampler.dimensions(), N);
    for _ in 0..BATCHES {
        for d in 0..samples.dimensions() {
            samples.row_mut(d).fill_with(|| random.uniform());
        }
        Evaluator::EIGHT.sampler(world, sampler, &samples, N, &mut paths);
        for i in 0..N {
            let rows = 0..sampler.splats();
            let rgb = rows.flat_map(|row| paths.splat_row(row)[i].rgb);
            mean.add(rgb.map(f64::from).sum::<f64>() / 3.0);
        }
    }
    mean
}

/// What samples keep and what is left to chains add up, whatever the constant.
#[test]
fn shared_light_is_all_of_it() {
    let mut random = Random(17);
    let scenes = scenes::all();
    let comparisons = scenes.len() * DEPTH as usize;
    for (name, scene) in &scenes {
        let world = World::new(scene, DEPTH);
        if world.lights.infinite.len() > 1 {
            continue;
        }
        for plan in world
            .plan
            .depths
            .iter()
            .skip(1)
            .filter(|p| !p.strategies.is_empty())
        {
            let whole = mean_of(&world, &PathSampler::from(plan), &mut random);
            let bound = (whole.mean() * [0.05, 0.5, 5.0][plan.depth as usize % 3]) as f32;
            if bound <= 0.0 {
                continue;
            }
            let mut kept = vec![0.0; world.plan.depths.len()];
            kept[plan.depth as usize] = bound;
            let layout = BidirectionalLayout::sharing(&world, &kept);
            let samples = mean_of(&world, &PathSampler::Bidirectional(layout), &mut random);
            let left = PathSampler::Multiplexed(DepthPlan {
                kept: bound,
                ..plan.clone()
            });
            let chains = mean_of(&world, &left, &mut random);
            let what = format!("{name}, depth {}", plan.depth);
            assert!(
                samples.mean() > 0.0 && samples.mean() < whole.mean(),
                "{what}"
            );
            // Independent: variances of means add up.
            let sum = Mean {
                n: whole.n,
                sum: (samples.mean() + chains.mean()) * whole.n,
                squares: ((samples.error().powi(2) + chains.error().powi(2)) * whole.n
                    + (samples.mean() + chains.mean()).powi(2))
                    * whole.n,
            };
            assert_agree(&whole, &sum, FALSE_ALARM / comparisons as f64, &what);
        }
    }
}

/// Means over a grid of regions, over renders that differ in their seeds.
fn regions(scene: &Scene, kind: IntegratorKind, effort: u64) -> Vec<Estimate> {
    let settings = Settings {
        max_depth: DEPTH,
        ..settings(scene, kind, effort)
    };
    Runs::new(scene, &settings, SEEDS).grid(2, 2)
}

#[test]
fn it_makes_the_picture_of_bdpt() {
    let all = scenes::all();
    let comparisons = all.len() * 12;
    for (name, scene) in all {
        let others = regions(&scene, IntegratorKind::Bdpt, 24);
        let auto = regions(&scene, IntegratorKind::Auto, 64);
        for (i, (a, b)) in auto.iter().zip(&others).enumerate() {
            let what = format!("{name}, region {}, channel {}", i / 3, i % 3);
            a.expect_same_among(comparisons, b, &what);
        }
    }
}

/// A room whose only light comes through a keyhole from a bright lamp beyond a wall.
fn keyhole() -> Scene {
    scene(
        r#"
        LookAt 0 0.2 2.4  0 -0.2 0  0 1 0
        Camera "perspective" "float fov" 60
        Film "image" "integer xresolution" 24 "integer yresolution" 24
        WorldBegin
        AttributeBegin
          AreaLightSource "diffuse" "rgb L" [900 800 700]
          Translate -2.5 1.5 0
          Shape "sphere" "float radius" 0.04
        AttributeEnd
        Material "matte" "rgb Kd" [0.6 0.6 0.6]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 -1 -3 4 -1 -3 4 -1 3 -4 -1 3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 2 -3 4 2 -3 4 2 3 -4 2 3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 -1 -3 4 -1 -3 4 2 -3 -4 2 -3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 -1 3 4 -1 3 4 2 3 -4 2 3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [4 -1 -3 4 -1 3 4 2 3 4 2 -3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-4 -1 -3 -4 -1 3 -4 2 3 -4 2 -3]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-1.5 -0.9 -3 -1.5 -0.9 3 -1.5 2 3 -1.5 2 -3]
        WorldEnd
        "#,
    )
}

fn auto(scene: &Scene, effort: u64) -> Render {
    let settings = Settings {
        bootstrap: 1 << 14,
        ..settings(scene, IntegratorKind::Auto, effort)
    };
    run(scene, &settings)
}

/// Light through a door ajar.
#[test]
fn chains_bring_what_samples_rarely_find() {
    let mut slit = scene(include_str!("../../scenes/slit.pbrt"));
    slit.set_resolution(80, 80).unwrap();
    let settings = Settings {
        seed: 1,
        bootstrap: 100_000,
        chains: 8192,
        ..settings(&slit, IntegratorKind::Auto, 600)
    };
    let render = run(&slit, &settings);
    let shares = render.stats.shares.unwrap();
    assert!(shares.depths.iter().any(|d| d.kept.is_some()), "{shares}");
    assert!(shares.gain > 1.0 && render.stats.mutations > 0);
    assert!(render.stats.relmse.is_some_and(f64::is_finite));
}

#[test]
fn an_easy_scene_is_for_samples() {
    let render = auto(&lit_stage(24, 18), 400);
    let shares = render.stats.shares.unwrap();
    assert!(shares.depths.iter().all(|d| d.kept.is_none()), "{shares}");
    assert_eq!(render.stats.mutations, 0);
    assert!(render.stats.samples > 0);
}

/// A scene of the repository.
fn of_file(name: &str) -> Scene {
    let root = env!("CARGO_MANIFEST_DIR");
    pbrt::load(format!("{root}/scenes/{name}.pbrt").as_ref()).unwrap()
}

/// What is chosen for some seeds, at 80 x 80 pixels.
fn choices(file: &str, effort: u64) -> Vec<Shares> {
    let mut scene = of_file(file);
    scene.set_resolution(80, 80).unwrap();
    let world = World::new(&scene, scene.integrator.max_depth);
    let choice = |seed| {
        let settings = Settings {
            integrator: IntegratorKind::Auto,
            mutations_per_pixel: effort,
            seed,
            ..Settings::of(&scene)
        };
        integrate::shares(&scene, &world, &settings).unwrap()
    };
    (1..=4).map(choice).collect()
}

/// A moment's luck with spots decides nothing: every seed comes to the same.
#[test]
fn seeds_agree_about_who_is_better() {
    for (file, effort, by_chains) in [("cornell", 1200, false), ("slit", 600, true)] {
        for shares in choices(file, effort) {
            assert_eq!(shares.rays < 0.5, by_chains, "{file}: {shares}");
        }
    }
}

/// Where the only lamp is large, paths from lights are not worth their rays. Where it is in a bulb,
/// or behind a slit, paths from the camera alone would miss light.
#[test]
fn paths_from_the_camera_suffice_under_a_large_lamp() {
    for (file, forward) in [("studio", true), ("bulb", false), ("slit", false)] {
        for shares in choices(file, 1500) {
            assert_eq!(shares.forward, forward, "{file}: {shares}");
        }
    }
}

#[test]
fn paths_from_the_camera_alone_make_the_same_picture() {
    let mut studio = of_file("studio");
    studio.set_resolution(60, 40).unwrap();
    let regions = |kind, effort| {
        let settings = Settings {
            max_depth: DEPTH,
            ..settings(&studio, kind, effort)
        };
        let of_seed = run(&studio, &settings).stats.shares;
        let forward = of_seed.is_some_and(|s| s.forward);
        assert_eq!(forward, kind == IntegratorKind::Auto);
        Runs::new(&studio, &settings, SEEDS).grid(3, 2)
    };
    let others = regions(IntegratorKind::Bdpt, 16);
    let auto = regions(IntegratorKind::Auto, 3000);
    for (i, (a, b)) in auto.iter().zip(&others).enumerate() {
        let what = format!("region {}, channel {}", i / 3, i % 3);
        a.expect_same_among(18, b, &what);
    }
}

/// Samples and chains march side by side: however early the end, all light is in the picture.
#[test]
fn a_render_that_is_cut_short_has_all_of_its_light() {
    let scene = keyhole();
    let whole = auto(&scene, 2000);
    let timed = Settings {
        time: Some(Duration::from_millis(400)),
        bootstrap: 1 << 12,
        ..settings(&scene, IntegratorKind::Auto, 1 << 30)
    };
    let cut = run(&scene, &timed);
    assert_eq!(cut.ended_by, EndedBy::Time);
    let apart = (whole.stats.b - cut.stats.b).abs();
    let error = whole.stats.b_stderr.hypot(cut.stats.b_stderr);
    assert!(
        apart < 6.0 * error + 0.3 * whole.stats.b,
        "{} {}",
        whole.stats.b,
        cut.stats.b
    );
}
