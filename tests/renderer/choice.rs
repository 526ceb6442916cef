//! Which strategies chains choose among, and how: choices that are not uniform are divided out,
//! chains started from uniform bootstrap paths stand where they should, and strategies that are
//! left out carry nothing.

use crate::common;
use crate::support;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, assert_agree};
use phalanx::chain::bootstrap::Moments;
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::strategy_choice::{EVEN, enough, learned};
use phalanx::integrate::{Settings, StrategyChoice, Width};
use phalanx::plan::{Choice, DepthPlan};
use phalanx::replay::Recorder;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};
use support::{Runs, head, run, scene, settings};

const DEPTH: u32 = 4;

/// Half the probability to one strategy, the rest by numbers that are not round.
fn skewed(plan: &DepthPlan, favoured: usize) -> DepthPlan {
    let n = plan.strategies.len();
    let weight = |i: usize| {
        if i == favoured {
            n as f64
        } else {
            // Not too rare: in some scenes a few paths by chance have much of the light.
            1.0 + 1.7 * i as f64 / n as f64
        }
    };
    let weights: Vec<f64> = (0..n).map(weight).collect();
    DepthPlan {
        choice: Choice::weighted(&plan.strategies, &weights),
        ..plan.clone()
    }
}

fn value(o: &Splat) -> f64 {
    f64::from(o.rgb[0]) + 2.0 * f64::from(o.rgb[1]) + 3.0 * f64::from(o.rgb[2])
}

#[test]
fn any_choice_has_the_same_mean() {
    const N: usize = 2048;
    const BATCHES: usize = 16;
    let mut random = Random(5);
    let scenes = scenes::all();
    let comparisons = scenes.len() * (DEPTH as usize + 1);
    for (name, scene) in &scenes {
        let world = World::new(scene, DEPTH);
        let mut paths = Paths::new(&world);
        for plan in &world.plan.depths {
            let other = skewed(plan, random.below(plan.strategies.len().max(1)));
            let means = [plan, &other].map(|plan| {
                let mut mean = Mean::default();
                let mut samples = Samples::new(plan.layout.total, N);
                for _ in 0..BATCHES {
                    for d in 0..samples.dimensions() {
                        samples.row_mut(d).fill_with(|| random.uniform());
                    }
                    Evaluator::EIGHT.multiplexed(&world, plan, &samples, N, &mut paths);
                    paths.splats.camera.iter().for_each(|o| mean.add(value(o)));
                }
                mean
            });
            let what = format!("{name}, depth {}", plan.depth);
            assert_agree(
                &means[0],
                &means[1],
                FALSE_ALARM / comparisons as f64,
                &what,
            );
        }
    }
}

/// The same bootstrap path under another choice: same strategy, same vertices to the bit, and a
/// contribution divided by the new probability in place of the old one.
#[test]
fn first_states_keep_their_paths() {
    const N: usize = 256;
    for (name, scene) in &scenes::all() {
        let world = World::new(scene, DEPTH);
        let recorder = Recorder::new(scene, &world);
        let mut paths = Paths::new(&world);
        for plan in &world.plan.depths {
            if plan.strategies.is_empty() {
                continue;
            }
            let other = skewed(plan, plan.depth as usize % plan.strategies.len());
            let indices: Vec<u64> = (0..N as u64).map(|i| i * i + 3).collect();
            let before = Evaluator::EIGHT.regenerate(plan, 11, &indices);
            let after = Evaluator::EIGHT.regenerate(&other, 11, &indices);
            Evaluator::EIGHT.multiplexed(&world, plan, &before, N, &mut paths);
            let old = paths.splats.camera.clone();
            Evaluator::EIGHT.multiplexed(&world, &other, &after, N, &mut paths);
            for i in 0..N {
                let (a, b) = (&old[i], &paths.splats.camera[i]);
                let what = format!("{name}, depth {}, path {i}", plan.depth);
                assert_eq!((a.s, a.raster), (b.s, b.raster), "{what}");
                let (p, q) = (plan.choice.factor(a.s), other.choice.factor(a.s));
                for c in 0..3 {
                    let expected = f64::from(a.rgb[c]) / f64::from(p) * f64::from(q);
                    let got = f64::from(b.rgb[c]);
                    assert!(
                        (got - expected).abs() <= 1e-6 * expected,
                        "{what}: {got} {expected}"
                    );
                }
                if i % 8 == 0 {
                    let old = recorder.walk(plan, &before.column(i));
                    let new = recorder.walk(&other, &after.column(i));
                    let vertices = |walk: &phalanx::replay::Walk| {
                        let list: Vec<_> = walk.paths().collect();
                        format!("{list:?} {:?}", walk.lens)
                    };
                    assert_eq!(vertices(&old), vertices(&new), "{what}");
                    assert_eq!(new.rgb, b.rgb, "{what}");
                }
            }
        }
    }
}

#[test]
fn every_strategy_stays_possible() {
    let mut choices = 0;
    for (name, scene) in &scenes::all() {
        let world = World::new(scene, DEPTH);
        for plan in &world.plan.depths {
            let bootstrap = Evaluator::EIGHT.bootstrap(&world, plan, 3, 20_000, &|| false);
            let Some(choice) = learned(plan, bootstrap.strategies()) else {
                continue;
            };
            choices += 1;
            let n = plan.strategies.len();
            let probabilities: Vec<f32> = (0..n).map(|i| choice.probability(i)).collect();
            println!("{name}, depth {}: {probabilities:.3?}", plan.depth);
            let sum: f64 = probabilities.iter().map(|p| f64::from(*p)).sum();
            assert_eq!(sum, 1.0);
            for p in probabilities {
                assert!(
                    f64::from(p) >= EVEN / n as f64 - 2f64.powi(-24),
                    "{name}: {p}"
                );
            }
        }
    }
    assert!(choices > 20, "{choices}");
}

/// Sums of `count` paths of which `lit` carry 1.
fn moments(count: u64, lit: f64) -> Moments {
    Moments {
        count,
        sum: lit,
        sum_squares: lit,
    }
}

#[test]
fn little_knowledge_is_none() {
    let scene = &scenes::all()[0].1;
    let world = World::new(scene, DEPTH);
    let plan = &world.plan.depths[2];
    let n = plan.strategies.len();
    let spread = |lit: f64| {
        let mut list = vec![moments(1000, 0.0); n];
        list[1] = moments(1000, lit);
        list
    };
    assert!(learned(plan, &[]).is_none());
    assert!(learned(plan, &spread(0.0)).is_none());
    assert!(learned(plan, &spread(enough(n) - 1.0)).is_none());
    let choice = learned(plan, &spread(enough(n) + 1.0)).unwrap();
    for i in 0..n {
        let share = if i == 1 { 1.0 - EVEN } else { 0.0 };
        let expected = share + EVEN / n as f64;
        assert!((f64::from(choice.probability(i)) - expected).abs() < 1e-6);
    }
    // Much light, all by one path.
    let mut one = spread(0.0);
    one[1].sum = 1e6;
    one[1].sum_squares = 1e12;
    assert!(learned(plan, &one).is_none());
    // Directly seen lights have one strategy.
    assert!(learned(&world.plan.depths[0], &[moments(1000, 900.0)]).is_none());
}

fn with(settings: &Settings, strategy_choice: StrategyChoice) -> Settings {
    Settings {
        strategy_choice,
        ..settings.clone()
    }
}

/// Whole renders, many and short: chains that started out of equilibrium would show.
#[test]
fn learned_choices_have_the_mean_of_path_tracing() {
    const SEEDS: u64 = 16;
    let (columns, rows) = (2, 2);
    let names = [
        "diffuse box, lamp",
        "closed box, specular things",
        "constant sky, lens, glass and brushed metal",
        "sheets",
    ];
    let chosen = scenes::all()
        .into_iter()
        .filter(|(name, _)| names.contains(name));
    let chosen: Vec<(&str, Scene)> = chosen.collect();
    assert_eq!(chosen.len(), names.len());
    for (name, scene) in chosen {
        let base = |kind, effort| Settings {
            max_depth: DEPTH,
            bootstrap: 8192,
            ..settings(&scene, kind, effort)
        };
        let pt = Runs::new(&scene, &base(IntegratorKind::Pt, 128), SEEDS);
        let mmlt = base(IntegratorKind::Mmlt, 64);
        let mmlt = Runs::new(&scene, &with(&mmlt, StrategyChoice::Learned), SEEDS);
        let comparisons = names.len() * (columns * rows * 3) as usize;
        for (i, (a, b)) in mmlt
            .grid(columns, rows)
            .iter()
            .zip(pt.grid(columns, rows))
            .enumerate()
        {
            a.expect_same_among(comparisons, &b, &format!("{name}, part {i}"));
        }
    }
}

#[test]
fn learned_choices_depend_on_nothing_else() {
    let scene = &scenes::all()[1].1;
    let base = Settings {
        seed: 3,
        bootstrap: 8192,
        max_depth: DEPTH,
        ..settings(scene, IntegratorKind::Mmlt, 32)
    };
    let base = with(&base, StrategyChoice::Learned);
    let picture = run(scene, &base).pixels;
    let other = Settings {
        threads: 3,
        lanes: Width::One,
        batch: Some(24),
        ..base.clone()
    };
    assert!(run(scene, &other).pixels == picture);
    let uniform = run(scene, &with(&base, StrategyChoice::Uniform)).pixels;
    assert!(uniform != picture, "nothing was learned");
    // Nothing to choose.
    let direct = |choice| {
        let settings = Settings {
            max_depth: 0,
            ..with(&base, choice)
        };
        run(scene, &settings).pixels
    };
    assert!(direct(StrategyChoice::Learned) == direct(StrategyChoice::Uniform));
}

// --- Strategies that are left out ---

const CAMERA: &str = "LookAt 0 1.5 4  0 .4 0  0 1 0\nCamera \"perspective\" \"float fov\" [50]";
const FLOOR: &str = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
const BALL: &str = "AttributeBegin\nMaterial \"glass\"\nTranslate .3 .7 0\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n";

/// Faces down, and reflects nothing.
const LAMP: &str = "AttributeBegin\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [9 8 7]\nTranslate -.5 2 .3\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [.5]\nAttributeEnd\n";

fn strategies(text: &str) -> Vec<Vec<u32>> {
    let scene = scene(&(head(24, 18, 3, CAMERA) + text));
    let plans = World::new(&scene, 3).plan.depths.clone();
    plans.into_iter().map(|d| d.strategies).collect()
}

#[test]
fn strategies_that_carry_nothing_are_left_out() {
    let none: Vec<u32> = Vec::new();
    let point = "LightSource \"point\" \"rgb I\" [3 3 3] \"point from\" [0 2 0]\n";
    let grey = FLOOR.replace("0 -2 -3 0 3 3 0 3 3 0 -2", "0 -2 -3 0 3 3 0 3 3 0.1 -2");
    let black = FLOOR.replace(".7 .6 .5", "0 0 0");
    let all = vec![
        vec![0],
        vec![0, 1, 2],
        vec![0, 1, 2, 3],
        vec![0, 1, 2, 3, 4],
    ];
    // A ball of glass over a floor: light never goes from floor to floor.
    let flat = vec![vec![0], vec![0, 1, 2], vec![0, 1, 3], vec![0, 1, 4]];
    assert_eq!(strategies(&format!("{LAMP}{FLOOR}{BALL}")), flat);
    // Not so if the floor is bent, if the ball is matte, or if the lamp is.
    assert_eq!(strategies(&format!("{LAMP}{grey}{BALL}")), all);
    assert_eq!(
        strategies(&format!("{LAMP}{FLOOR}{}", BALL.replace("glass", "matte"))),
        all
    );
    assert_eq!(
        strategies(&format!("{}{FLOOR}{BALL}", LAMP.replace("0 0 0", ".1 0 0"))),
        all
    );
    // A floor alone: one bounce.
    let alone = vec![vec![0], vec![0, 1, 2], none.clone(), none.clone()];
    assert_eq!(strategies(&format!("{LAMP}{FLOOR}")), alone);
    // Black surfaces only, and black ones with a ball of glass.
    let dark = vec![vec![0], none.clone(), none.clone(), none.clone()];
    assert_eq!(strategies(&format!("{LAMP}{black}")), dark);
    assert_eq!(
        strategies(&format!("{LAMP}{black}{BALL}")),
        vec![vec![0]; 4]
    );
    // A mixture does what its components do: black ones scatter nothing, glass and black cannot be
    // joined, glass and matte can.
    let mixed = |second: &str| {
        let mix = format!(
            "MakeNamedMaterial \"black\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0]\nMakeNamedMaterial \"other\" \"string type\" {second}\n"
        );
        let ball =
            "\"mix\" \"string namedmaterial1\" \"black\" \"string namedmaterial2\" \"other\"";
        mix + &BALL.replace("\"glass\"", ball)
    };
    let (nothing, glass) = (mixed("\"matte\" \"rgb Kd\" [0 0 0]"), mixed("\"glass\""));
    assert_eq!(strategies(&format!("{LAMP}{black}{nothing}")), dark);
    assert_eq!(strategies(&format!("{LAMP}{FLOOR}{nothing}")), alone);
    assert_eq!(
        strategies(&format!("{LAMP}{black}{glass}")),
        vec![vec![0]; 4]
    );
    assert_eq!(strategies(&format!("{LAMP}{FLOOR}{glass}")), flat);
    assert_eq!(
        strategies(&format!("{LAMP}{FLOOR}{}", mixed("\"matte\""))),
        all
    );
    // Lights that cannot be met.
    let unmet = vec![none.clone(), vec![1, 2], vec![1, 3], vec![1, 4]];
    assert_eq!(strategies(&format!("{point}{FLOOR}{BALL}")), unmet);
}

/// The strategies left out carry nothing indeed, and the others have the same weights with and
/// without them.
#[test]
fn what_is_left_out_is_in_no_weight() {
    const N: usize = 4096;
    let scene = scene(&(head(24, 18, 4, CAMERA) + LAMP + FLOOR + BALL));
    let world = World::new(&scene, DEPTH);
    let mut paths = Paths::new(&world);
    let mut random = Random(9);
    for plan in &world.plan.depths[2..] {
        let strategies: Vec<u32> = (0..=plan.depth + 1).collect();
        let whole = DepthPlan {
            choice: Choice::uniform(&strategies),
            strategies,
            ..plan.clone()
        };
        let (mut lit, mut extra) = (0.0, 0.0);
        for s in whole.strategies.clone() {
            let mut samples = Samples::new(plan.layout.total, N);
            for d in 0..samples.dimensions() {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            let mut choose = |plan: &DepthPlan, i: usize| {
                let u = (i as f32 + 0.5) / plan.strategies.len() as f32;
                samples.row_mut(plan.layout.strategy).fill(u);
                Evaluator::EIGHT.multiplexed(&world, plan, &samples, N, &mut paths);
                assert!(paths.splats.camera.iter().all(|o| o.s == s));
                let n = plan.strategies.len() as f64;
                paths
                    .splats
                    .camera
                    .iter()
                    .map(|o| value(o) / n)
                    .collect::<Vec<f64>>()
            };
            let of_whole = choose(&whole, s as usize);
            match plan.strategies.iter().position(|have| *have == s) {
                None => extra += of_whole.iter().sum::<f64>(),
                Some(i) => {
                    for (a, b) in choose(plan, i).iter().zip(&of_whole) {
                        assert!((a - b).abs() <= 1e-6 * b, "depth {}, s = {s}", plan.depth);
                    }
                    lit += of_whole.iter().sum::<f64>();
                }
            }
        }
        println!("depth {}: {lit:.4e} and {extra:.4e}", plan.depth);
        // Points of the floor are off its plane by roundings.
        assert!(
            extra <= 1e-5 * lit,
            "depth {}: {extra} of {lit}",
            plan.depth
        );
    }
}

/// Caustics and all, the picture is that of path tracing, which knows nothing of strategies.
#[test]
fn a_floor_and_a_glass_ball_are_what_path_tracing_sees() {
    let scene = scene(&(head(16, 12, 4, CAMERA) + LAMP + FLOOR + BALL));
    let runs = |kind, effort, choice| {
        let settings = Settings {
            max_depth: DEPTH,
            bootstrap: 8192,
            ..settings(&scene, kind, effort)
        };
        Runs::new(&scene, &with(&settings, choice), 16)
    };
    let pt = runs(IntegratorKind::Pt, 512, StrategyChoice::Uniform);
    for choice in [StrategyChoice::Uniform, StrategyChoice::Learned] {
        let mmlt = runs(IntegratorKind::Mmlt, 128, choice);
        for (i, (a, b)) in mmlt.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
            a.expect_same_among(24, &b, &format!("{choice:?}, part {i}"));
        }
    }
}
