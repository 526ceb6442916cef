//! Primary sample space Metropolis light transport: it makes its sampler's picture, and large steps
//! are weighed against states without bias.

use crate::common;
use crate::support;

use common::scenes;
use phalanx::chain::batch::Workspace;
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::{Mutation, ProposalDistribution, large_step_probability};
use phalanx::chain::tune::Tune;
use phalanx::film::{Destination, FilterTable, SplatFilm};
use phalanx::integrate::{EndedBy, Settings};
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use phalanx::transport::bidirectional::BidirectionalLayout;
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::{PathSampler, World};
use std::time::Duration;
use support::stage::lit_stage;
use support::{Estimate, Runs, run, settings};

const OVER_PT: IntegratorKind = IntegratorKind::Pssmlt(PathSamplerKind::Pt);
const OVER_BDPT: IntegratorKind = IntegratorKind::Pssmlt(PathSamplerKind::Bdpt);
const BOTH_HOSTS: [IntegratorKind; 2] = [OVER_PT, OVER_BDPT];
/// Many short renders know their error better than few long ones: 24 bound a difference as tightly
/// as 12 of three times the samples.
const SEEDS: u64 = 24;
const GRID: [u32; 2] = [2, 2];
const DEPTH: u32 = 4;

/// Means over a grid of regions, over renders that differ in their seeds.
fn regions(scene: &Scene, kind: IntegratorKind, effort: u64) -> Vec<Estimate> {
    let settings = Settings {
        max_depth: DEPTH,
        bootstrap: 1024,
        ..settings(scene, kind, effort)
    };
    let [columns, rows] = GRID;
    Runs::new(scene, &settings, SEEDS).grid(columns, rows)
}

/// `kind` makes the picture of `other`, whatever light they can reach.
fn expect_same(kind: IntegratorKind, other: (IntegratorKind, u64), effort: u64) {
    let all = scenes::all();
    let comparisons = 2 * all.len() * (GRID[0] * GRID[1] * 3) as usize;
    for (name, scene) in all {
        let others = regions(&scene, other.0, other.1);
        let chains = regions(&scene, kind, effort);
        for (i, (a, b)) in chains.iter().zip(&others).enumerate() {
            let what = format!("{name}, region {}, channel {}", i / 3, i % 3);
            a.expect_same_among(comparisons, b, &what);
        }
    }
}

#[test]
fn over_a_path_tracer_it_makes_the_path_tracers_picture() {
    expect_same(OVER_PT, (IntegratorKind::Pt, 10), 6);
}

/// Light that only light subpaths reach is in both.
#[test]
fn over_bidirectional_paths_it_makes_the_picture_of_mmlt() {
    expect_same(OVER_BDPT, (IntegratorKind::Mmlt, 16), 4);
}

/// From large steps alone, which are independent samples, to none at all.
#[test]
fn any_part_of_large_steps_will_do() {
    let scene = lit_stage(16, 12);
    let means = |kind, change: &dyn Fn(&mut Settings)| {
        let mut settings = settings(&scene, kind, 104);
        change(&mut settings);
        Runs::new(&scene, &settings, 16).grid(GRID[0], GRID[1])
    };
    let pt = means(IntegratorKind::Pt, &|_| {});
    let all = [1.0, 0.03, 1e-9, 0.0].map(|p| (OVER_PT, p));
    for (kind, probability) in all.into_iter().chain([(OVER_BDPT, 1.0), (OVER_BDPT, 0.03)]) {
        let few = |s: &mut Settings| {
            s.large_step_probability = probability;
            // Chains that hardly ever start afresh should start well, and have far to go.
            s.bootstrap = 1 << 13;
            s.chains = 256;
            s.sigma = 0.03;
        };
        for (i, (a, b)) in means(kind, &few).iter().zip(&pt).enumerate() {
            a.expect_same(b, &format!("{kind:?}, p = {probability}, value {i}"));
        }
    }
}

/// Kelemen's own small steps, their scale and the part of large steps found before samples count.
#[test]
fn tuned_chains_make_the_same_picture() {
    let scene = lit_stage(16, 12);
    let tuned = |kind| Settings {
        mutation: Mutation::Kelemen,
        tune: Tune {
            sigma: true,
            large_step: true,
        },
        bootstrap: 1 << 14,
        ..settings(&scene, kind, 104)
    };
    let pt = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 104), 24);
    let pt = pt.grid(GRID[0], GRID[1]);
    for kind in BOTH_HOSTS {
        let chains = Runs::new(&scene, &tuned(kind), 24).grid(GRID[0], GRID[1]);
        for (i, (a, b)) in chains.iter().zip(&pt).enumerate() {
            a.expect_same(b, &format!("{kind:?}, tuned, value {i}"));
        }
        let stats = run(&scene, &tuned(kind)).stats;
        assert_ne!(stats.depths[0].sigma, 0.01);
        assert_ne!(stats.depths[0].large_step_probability, 0.3);
    }
}

/// Weights that sum to 1 are right whatever they are: states and large steps are weighed with a
/// constant far from `p b`, and the picture is the same.
#[test]
fn the_constant_of_the_weights_is_free() {
    const P: f32 = 0.3;
    const CHAINS: usize = 64;
    const STEPS: u32 = 200;
    let scene = lit_stage(16, 12);
    let world = World::new(&scene, 4);
    let over_pt = PathSampler::Unidirectional(UnidirectionalLayout::new(&world.plan, 4));
    let over_bdpt = PathSampler::Bidirectional(BidirectionalLayout::new(&world));
    let area = world.camera.region.area();
    let pictures = |sampler: &PathSampler, factor: f64| {
        let pictures = (0..32).map(|seed| {
            let bootstrap = Evaluator::EIGHT.bootstrap(&world, sampler, seed, 1 << 12, &|| false);
            let b = bootstrap.estimate.mean();
            let seeds = bootstrap.seeds(seed, sampler.id(), CHAINS);
            let mut workspace = Workspace::new(&world);
            let paths = &mut workspace.paths;
            let mut batch = Evaluator::EIGHT.batch(&world, sampler, 0, &seeds, seed, paths);
            let p = large_step_probability(P);
            let constant = (factor * p * b) as f32;
            batch.combine(constant, 1);
            let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
            let mutations = CHAINS as f64 * f64::from(STEPS);
            let film = SplatFilm::new(filter, 2, mutations);
            let to = Destination {
                layer: 0,
                scale: 1.0,
                half: false,
            };
            let proposals = ProposalDistribution::new(seed, P, 0.01);
            Evaluator::EIGHT.march(
                &mut batch,
                &world,
                &proposals,
                STEPS,
                &mut workspace,
                &film,
                to,
            );
            batch.flush(&film, to);
            let scales = [b, f64::from(constant) / p].map(|s| s * area / mutations);
            film.resolve(&scales)
        });
        let runs = Runs {
            width: 16,
            height: 12,
            pictures: pictures.collect(),
        };
        runs.grid(GRID[0], GRID[1])
    };
    let settings = settings(&scene, IntegratorKind::Pt, 104);
    let pt = Runs::new(&scene, &settings, 32).grid(GRID[0], GRID[1]);
    let cases = [0.0, 0.01, 1.0, 100.0, 1e9].map(|factor| (&over_pt, factor));
    for (sampler, factor) in cases.into_iter().chain([(&over_bdpt, 10.0)]) {
        for (i, (a, b)) in pictures(sampler, factor).iter().zip(&pt).enumerate() {
            a.expect_same(b, &format!("c = {factor} p b, value {i}"));
        }
    }
}

/// Large steps that count twice are worth it: where chains have little to do, the picture has less
/// noise than by states alone.
#[test]
fn large_steps_count() {
    let scene = lit_stage(16, 12);
    let error = |kind, effort| {
        let settings = Settings {
            large_step_probability: 1.0,
            ..settings(&scene, kind, effort)
        };
        let runs = Runs::new(&scene, &settings, 24);
        let grid = runs.grid(4, 3);
        grid.iter().map(|e| (e.error / e.mean).powi(2)).sum::<f64>()
    };
    // Independent samples at random places. A path tracer's go pixel by pixel, and the first four
    // of a pixel share out nothing else: as many as chains make have a sixteenth of their variance.
    let (chains, samples) = (error(OVER_PT, 64), error(IntegratorKind::Pt, 4) / 16.0);
    println!("relative variance {chains:.2e}, of the sampler {samples:.2e}");
    // 24 runs of 36 values know a ratio of variances to 7 %.
    assert!(chains < 2.0 * samples, "{chains} {samples}");
}

#[test]
fn figures_are_those_of_one_integral() {
    for kind in BOTH_HOSTS {
        expect_figures_of_one_integral(kind);
    }
}

fn expect_figures_of_one_integral(kind: IntegratorKind) {
    let scene = lit_stage(48, 36);
    let settings = Settings {
        bootstrap: 20_000,
        ..settings(&scene, kind, 500)
    };
    let done = run(&scene, &settings);
    assert_eq!(done.warnings, Vec::<String>::new());
    let stats = &done.stats;
    assert_eq!(stats.integrator, kind.name());
    let [all] = &stats.depths[..] else {
        panic!("{:?}", stats.depths);
    };
    assert_eq!((all.depth, all.share), (None, 1.0));
    assert_eq!(all.mutations, stats.mutations);
    assert_eq!(all.mixing.strategies, []);
    assert!(stats.rhat.unwrap() < 1.1, "{:?}", stats.rhat);
    assert!(stats.ess.unwrap() > 100.0);
    let check = stats.cross_check.as_ref().unwrap();
    assert!(check.compared >= 5 && check.missed == 0, "{check:?}");
    let json = serde_json::to_value(stats).unwrap();
    assert_eq!(json["depths"][0]["depth"], "all");
    // Tiles are those of the picture.
    let tiles = stats.tiles.as_ref().unwrap();
    for (tile, mean) in tiles.mean.iter().enumerate() {
        let (x0, y0) = (tile % tiles.columns * 16, tile / tiles.columns * 16);
        let (mut sum, mut n) = (0.0, 0.0);
        for y in y0..(y0 + 16).min(36) {
            for x in x0..(x0 + 16).min(48) {
                let p = done.pixels[y * 48 + x];
                sum += p.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
                n += 1.0;
            }
        }
        // Tiles are summed in units of 2^-24 of a mutation, each rounded down.
        assert!(
            (mean / (sum / n) - 1.0).abs() < 1e-4,
            "{tile}: {mean} {}",
            sum / n
        );
    }
}

/// Chains that hardly move are found out.
#[test]
fn chains_that_miss_light_are_told() {
    let scene = lit_stage(32, 24);
    let settings = Settings {
        large_step_probability: 0.02,
        sigma: 1e-5,
        chains: 16,
        ..settings(&scene, OVER_PT, 100)
    };
    let done = run(&scene, &settings);
    let told = |start: &str| done.warnings.iter().find(|w| w.starts_with(start));
    let apart = told("chains disagree: those of all depths have not mixed (split R-hat ");
    assert!(apart.is_some(), "{:?}", done.warnings);
}

#[test]
fn a_stop_keeps_the_brightness() {
    let scene = lit_stage(32, 24);
    let pt = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), 8).whole(1);
    for kind in BOTH_HOSTS {
        let stopped = (0..6).map(|seed| {
            let settings = Settings {
                seed,
                time: Some(Duration::from_millis(150)),
                ..settings(&scene, kind, 1 << 20)
            };
            let render = run(&scene, &settings);
            assert_eq!(render.ended_by, EndedBy::Time);
            render
        });
        let stopped = Runs::of(stopped.collect()).whole(1);
        stopped.expect_same(&pt, &format!("{kind:?}, stopped after 150 ms"));
    }
}
