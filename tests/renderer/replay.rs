//! Replaying paths: the walk is the renderer's to the bit, and `phalanx replay` as a user meets it.

use crate::common;
use crate::support::command;

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use command::{command, refused, run, text};
use common::scenes;
use common::stats::Random;
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::{Mutation, ProposalDistribution};
use phalanx::chain::strategy_choice::learned;
use phalanx::chain::tune::Tune;
use phalanx::formats::tone::Display;
use phalanx::integrate::{Settings, Silent, StrategyChoice, render};
use phalanx::pbrt::{load, load_str};
use phalanx::replay::Recorder;
use phalanx::replay::compare::{contribution, relative};
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};
use serde_json::Value;

/// What a path leaves behind.
fn bits(o: &Splat) -> ([u32; 3], [u32; 2], u32, bool) {
    (
        o.rgb.map(f32::to_bits),
        o.raster.map(f32::to_bits),
        o.s,
        o.rejected > 0,
    )
}

#[test]
fn walks_are_what_the_renderer_evaluates() {
    let mut random = Random(71);
    let n = 2000;
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 5);
        let recorder = Recorder::new(&scene, &world);
        let mut paths = Paths::new(&world);
        let mut lit = 0;
        for plan in &world.plan.depths {
            let mut samples = Samples::new(plan.layout.total, n);
            for d in 0..plan.layout.total {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, n, &mut paths);
            for (i, o) in paths.splats.camera.iter().enumerate() {
                let walk = recorder.walk(plan, &samples.column(i));
                let mine = (
                    walk.rgb.map(f32::to_bits),
                    walk.raster.map(f32::to_bits),
                    walk.s,
                    walk.rejected,
                );
                assert_eq!(bits(o), mine, "{name}, depth {}, path {i}", plan.depth);
                lit += usize::from(o.rgb != [0.0; 3]);
            }
        }
        assert!(lit > n / 10, "{name}: {lit}");
    }
}

/// Two skies, one a square map, textures, a bilinear patch, an interface: what the scenes of
/// [`scenes`] lack.
fn odd_scene(dir: &Path) -> Scene {
    let sky = scenes::sky(8, 8);
    phalanx::film::output::write(&dir.join("sky.pfm"), &sky, &[], &Display::LINEAR).unwrap();
    let text = r#"
        LookAt 0 1 4  0 0 0  0 1 0
        Camera "perspective" "float fov" 40
        Film "rgb" "integer xresolution" 16 "integer yresolution" 16
        WorldBegin
        LightSource "infinite" "rgb L" [.2 .3 .4]
        AttributeBegin
          Rotate 20 1 1 0
          LightSource "infinite" "string filename" "sky.pfm"
        AttributeEnd
        Texture "check" "spectrum" "checkerboard" "float uscale" 3 "rgb tex1" [.2 .3 .4] "rgb tex2" [.8 .7 .6]
        Material "diffuse" "texture reflectance" "check"
        Shape "bilinearmesh" "point3 P" [-3 -1 -3  3 -1 -3  -3 -1.2 3  3 -1 3]
        Texture "creases" "float" "wrinkled"
        Texture "marble" "spectrum" "marble" "float scale" 3
        Texture "up" "spectrum" "directionmix" "texture tex1" "marble" "rgb tex2" [.9 .8 .7]
        Material "conductor" "texture roughness" "creases" "texture reflectance" "up"
        Shape "sphere" "float radius" 1
        Material "dielectric"
        Translate 1 0 1.5
        Shape "sphere" "float radius" .5
    "#;
    load_str(text, "odd.pbrt", dir).unwrap()
}

#[test]
fn scenes_with_two_skies_and_textures() {
    let folder = tempfile::tempdir().unwrap();
    let scene = odd_scene(folder.path());
    let world = World::new(&scene, 3);
    let recorder = Recorder::new(&scene, &world);
    let mut paths = Paths::new(&world);
    let mut random = Random(72);
    let mut errors = [vec![], vec![]];
    for plan in &world.plan.depths {
        for _ in 0..3000 {
            let u: Vec<f32> = (0..plan.layout.total).map(|_| random.uniform()).collect();
            let mut samples = Samples::new(plan.layout.total, 1);
            (u.iter().enumerate()).for_each(|(d, u)| samples.row_mut(d)[0] = *u);
            Evaluator::ONE.multiplexed(&world, plan, &samples, 1, &mut paths);
            let walk = recorder.walk(plan, &u);
            assert_eq!(paths.splats.camera[0].rgb, walk.rgb);
            // A camera ray that leaves meets both skies.
            let sky = walk.s == 0 && !walk.meetings.is_empty();
            assert!(!sky || walk.meetings.len() == 2);
            let exact = recorder.retrace(plan, &u, &walk).unwrap_or_default();
            for (i, path) in walk.paths().enumerate() {
                let want = recorder.reference(&path, &plan.strategies).value();
                errors[0].push(relative(contribution(&walk, i), want));
                if let Some(path) = exact.get(i) {
                    let want = recorder.reference(path, &plan.strategies).value();
                    errors[1].push(relative(contribution(&walk, i), want));
                }
            }
        }
    }
    for errors in &mut errors {
        errors.sort_by(f64::total_cmp);
        let n = errors.len();
        let [middle, high] = [0.5, 0.98].map(|q| errors[(q * n as f64) as usize]);
        println!("{n} paths: {middle:e} {high:e}");
        assert!(n > 2000 && middle < 2e-6 && high < 1e-4, "{middle} {high}");
    }
}

#[test]
fn any_numbers_give_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let dark = "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\nShape \"sphere\"\nWorldEnd\n";
    let mut all = scenes::all();
    all.push(("odd", odd_scene(folder.path())));
    all.push(("dark", load_str(dark, "dark.pbrt", folder.path()).unwrap()));
    let mut random = Random(73);
    for (name, scene) in all {
        let world = World::new(&scene, 40);
        let recorder = Recorder::new(&scene, &world);
        for (i, plan) in world.plan.depths.iter().enumerate() {
            for j in 0..30 {
                let bad = [0.0, 1.0, f32::NAN, -1.0, f32::INFINITY, 1e30];
                let mut u: Vec<f32> = (0..plan.layout.total)
                    .map(|_| match (j % 3, random.below(6)) {
                        (0, k) => bad[k],
                        (1, 0) => 0.0,
                        (1, 1) => 1.0 - f32::EPSILON / 2.0,
                        _ => random.uniform(),
                    })
                    .collect();
                // Too few are no panic, either.
                u.truncate(if j == 29 { i } else { usize::MAX });
                let report = recorder.report(plan, &u);
                assert!(report.contribution.iter().all(|v| v.is_finite()), "{name}");
                assert!(serde_json::to_string(&report).is_ok(), "{name}");
            }
        }
    }
}

/// Cornell box, small, at depths that carry light.
const SMALL: &str = "--bootstrap 2000 --chains 64 --mutations 20 --resolution 40x40 --max-depth 4 --seed 7 --integrator mmlt";

#[track_caller]
fn json(folder: &Path, arguments: &str) -> Value {
    let output = run(folder, &format!("replay {arguments} --json"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn floats(value: &Value) -> Vec<f32> {
    let number = |v: &Value| v.as_f64().unwrap() as f32;
    value.as_array().unwrap().iter().map(number).collect()
}

#[test]
fn a_chain_does_again_what_it_did() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.pbrt");
    fs::write(&file, include_str!("../../scenes/cornell.pbrt")).unwrap();
    let mut scene = load(&file).unwrap();
    scene.set_resolution(40, 40).unwrap();
    let settings = Settings {
        integrator: IntegratorKind::Mmlt,
        seed: 7,
        chains: 64,
        bootstrap: 2000,
        mutations_per_pixel: 20,
        max_depth: 4,
        ..Settings::of(&scene)
    };
    use StrategyChoice::{Learned, Uniform};
    for (choice, mutation, auto) in [
        (Uniform, Mutation::Gaussian, false),
        (Learned, Mutation::Cauchy, false),
        (Learned, Mutation::Kelemen, true),
    ] {
        let settings = Settings {
            strategy_choice: choice,
            mutation,
            tune: Tune {
                sigma: auto,
                large_step: auto,
            },
            ..settings.clone()
        };
        expect_chains_of(&scene, &settings, folder.path());
    }
}

fn expect_chains_of(scene: &Scene, settings: &Settings, folder: &Path) {
    let stats = render(scene, settings, &Silent).unwrap().stats;
    let world = World::new(scene, 4);
    let tuned = if settings.tune.sigma {
        "--sigma auto --large-step auto"
    } else {
        ""
    };
    for (depth, chain, iteration) in [(1, 0, 0), (2, 37, 5), (4, 63, 11)] {
        let replayed = json(
            folder,
            &format!(
                "room.pbrt {SMALL} --depth {depth} --chain {chain} --iteration {iteration} --strategy-choice {} --mutation {} {tuned}",
                settings.strategy_choice.name(),
                settings.mutation.name()
            ),
        );
        // As many chains and iterations as the render has.
        let of_depth = &stats.depths[depth];
        let about = &replayed["iteration"];
        let (p, sigma) = (of_depth.large_step_probability, of_depth.sigma);
        let proposals = ProposalDistribution::new(7, p, sigma).with_mutation(settings.mutation);
        let figure = |name: &str| about[name].as_f64().unwrap() as f32;
        assert_eq!(
            (figure("large_step_probability"), figure("sigma")),
            (p, sigma)
        );
        assert_eq!(about["chains"], of_depth.chains);
        assert_eq!(
            about["iterations"].as_u64().unwrap() * of_depth.chains as u64,
            of_depth.mutations
        );
        // All chains of the depth in one batch, at the other width.
        let plan = &world.plan.depths[depth];
        let boot = Evaluator::ONE.bootstrap(&world, plan, 7, 2000, &|| false);
        let mut plan = plan.clone();
        if settings.strategy_choice == StrategyChoice::Learned {
            plan.choice = learned(&plan, boot.strategies()).expect("little light");
        }
        let seeds = boot.seeds(7, plan.depth, of_depth.chains as usize);
        let mut paths = Paths::new(&world);
        let mut batch = Evaluator::ONE.batch(&world, &plan, 0, &seeds, 7, &mut paths);
        for _ in 0..iteration {
            Evaluator::ONE.step(&mut batch, &world, &proposals, &mut paths);
        }
        let state = batch.state(chain);
        Evaluator::ONE.step(&mut batch, &world, &proposals, &mut paths);
        let step = batch.latest(chain);
        assert_eq!(floats(&replayed["current"]["samples"]), state.samples);
        assert_eq!(floats(&replayed["proposal"]["samples"]), step.proposal);
        assert_eq!(about["large"], step.large);
        assert_eq!(about["accepted"], step.accepted);
        assert_eq!(about["bootstrap_path"], seeds[chain]);
        let single = |name: &str| about[name].as_f64().unwrap() as f32;
        assert_eq!(single("acceptance"), step.acceptance);
        assert_eq!(single("drawn"), step.drawn);
        let splat = paths.splats.camera[chain];
        let proposal = &replayed["proposal"];
        assert_eq!(floats(&proposal["contribution"]), splat.rgb);
        assert_eq!(floats(&proposal["raster"]), splat.raster);
        assert_eq!(proposal["s"], splat.s);
        // The arguments that the report ends with are those of the same path.
        let list: Vec<String> = (floats(&proposal["uniform_samples"])
            .iter()
            .map(f32::to_string))
        .collect();
        let again = json(
            folder,
            &format!(
                "room.pbrt --resolution 40x40 --depth {depth} --samples {}",
                list.join(",")
            ),
        );
        assert_eq!(again["path"]["vertices"], proposal["vertices"]);
        assert_eq!(again["path"]["s"], splat.s);
        // A state of a chain carries light, and the weight is that of f64 but for roundings.
        let current = &replayed["current"];
        assert!(floats(&current["contribution"]).iter().any(|v| *v > 0.0));
        let figures = current["meetings"][0]["figures"].as_array().unwrap();
        let weight = figures.iter().find(|f| f["name"] == "MIS weight").unwrap();
        for error in ["vertices_error", "samples_error"] {
            assert!(weight[error].as_f64().unwrap() < 1e-3, "{weight}");
        }
    }
}

#[test]
fn primary_samples_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let first = json(
        folder.path(),
        &format!("{SMALL} --depth 3 --chain 5 --iteration 3"),
    );
    let path = &first["proposal"];
    let list: Vec<String> = (floats(&path["samples"]).iter().map(f32::to_string)).collect();
    let same = "--resolution 40x40 --depth 3";
    let again = json(
        folder.path(),
        &format!("{same} --samples {}", list.join(",")),
    );
    assert_eq!(&again["path"], path);
    fs::write(folder.path().join("u.txt"), list.join("\n")).unwrap();
    let from_file = json(folder.path(), &format!("{same} --samples-file u.txt"));
    assert_eq!(&from_file["path"], path);
    for stdin in ["--samples -", "--samples-file -"] {
        let mut child = command(folder.path(), &format!("replay {same} {stdin} --json"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = child.stdin.take().unwrap();
        pipe.write_all(list.join(", ").as_bytes()).unwrap();
        drop(pipe);
        let output = child.wait_with_output().unwrap();
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(&json["path"], path, "{stdin}");
    }
    // The table says how to get it again.
    let arguments = format!("replay {SMALL} --depth 3 --chain 5 --iteration 3");
    let table = text(&run(folder.path(), &arguments).stdout);
    for part in [
        format!("--depth 3 --samples {}", list.join(",")),
        "MIS weight".into(),
        "Current state".into(),
        "acceptance probability".into(),
        "same vertices".into(),
    ] {
        assert!(table.contains(&part), "{part}: {table}");
    }
    assert!(!table.contains('\x1b'), "{table}");
}

#[test]
fn what_cannot_be_replayed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |arguments: &str| refused(&run(folder.path(), &format!("replay {arguments}")));
    for (arguments, words) in [
        (
            "--depth 2 --samples 0.1,0.2",
            "takes 20 in this scene: 1 strategy, 2 raster position",
        ),
        (
            "--depth 0 --samples 0.5,1",
            "sample 2, \"1\": is not in [0, 1)",
        ),
        ("--depth 0 --samples 0.5,-0.25", "is not in [0, 1)"),
        ("--depth 0 --samples 0.5,nan", "is not in [0, 1)"),
        ("--depth 0 --samples 0.5,x", "\"x\": is not a number"),
        ("--depth 0 --samples-file missing.txt", "missing.txt"),
        ("--depth 0 --samples -", "0 primary samples"),
        ("--depth 0", "--samples"),
        ("--samples 0.1", "--depth"),
        ("--depth 0 --chain 3", "--iteration"),
        (
            "--depth 0 --chain 3 --iteration 2 --samples 0.5,0.5",
            "cannot be used with",
        ),
        ("--depth 9999 --samples 0.5,0.5", "9999"),
        ("--depth 0 --samples 0.5,0.5 missing.pbrt", "missing.pbrt"),
    ] {
        let message = refusal(arguments);
        assert!(message.contains(words), "{arguments}: {message}");
    }
    for (arguments, words) in [
        ("--depth 3 --chain 600 --iteration 0", "64 chains"),
        ("--depth 3 --chain 0 --iteration 100000", "iterations"),
        ("--depth 5 --chain 0 --iteration 0", "the largest is 4"),
    ] {
        let message = refusal(&format!("{SMALL} {arguments}"));
        assert!(message.contains(words), "{arguments}: {message}");
    }
    let dark = "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\nShape \"sphere\"\nWorldEnd\n";
    fs::write(folder.path().join("dark.pbrt"), dark).unwrap();
    let message = refusal("dark.pbrt --depth 1 --chain 0 --iteration 0");
    assert!(message.contains("no chains of depth 1"), "{message}");
}
