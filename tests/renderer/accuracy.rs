//! Does a render know how wrong it is?
//!
//! Many short renders of three scenes, an easy one, one with a caustic and one lit through a slit,
//! tell how far from the truth such renders are; each of them had claimed how far it is. The truth
//! is the mean of all other renders, whose own error is part of the comparison.
//!
//! The small version is in the suite. `cargo test --release --test renderer accuracy:: -- --ignored
//! --nocapture` makes a large one, and prints its figures.

use crate::support;

use phalanx::integrate::{EndedBy, Render, Settings, Silent, render};
use phalanx::metrics;
use phalanx::pbrt;
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use std::path::Path;
use std::time::Duration;

const EASY: &str = include_str!("../reference/cornell.pbrt");
const CAUSTIC: &str = include_str!("../reference/cornell-glass.pbrt");
const SLIT: &str = include_str!("../../scenes/slit.pbrt");

fn scene(text: &str, side: u32) -> Scene {
    let mut scene = pbrt::load_str(text, "scene.pbrt", Path::new("tests/reference")).unwrap();
    scene.set_resolution(side, side).unwrap();
    scene
}

/// What many renders claim, and what is true of them.
struct Calibration {
    /// Part of the 95 % intervals of tile means that hold the truth.
    coverage: f64,
    /// Estimated over true relMSE, both averaged over renders.
    relmse_ratio: f64,
    relmse: f64,
    /// Root mean square of `b`'s deviation, over that of its claimed standard error.
    b_ratio: f64,
    /// The same of the integral of each depth.
    depth_ratios: Vec<f64>,
}

/// Half width of a 95 % interval in standard errors of so many groups: Student's t of 3 degrees of
/// freedom for samples, and of 15 for chains, of which some depths have a few groups less.
fn t_95(groups: usize) -> f64 {
    if groups == 4 { 3.182 } else { 2.131 }
}

fn calibrate(scene: &Scene, settings: &Settings, renders: u64) -> Calibration {
    let all: Vec<Render> = (0..renders)
        .map(|seed| {
            render(
                scene,
                &Settings {
                    seed,
                    ..settings.clone()
                },
                &Silent,
            )
            .unwrap()
        })
        .collect();
    let n = renders as f64;
    let sum = |of: &dyn Fn(&Render) -> Vec<f64>| {
        let mut sums = of(&all[0]);
        for r in &all[1..] {
            sums.iter_mut().zip(of(r)).for_each(|(sum, v)| *sum += v);
        }
        sums
    };
    // Of everything: the mean of all renders but one.
    let others = |sum: f64, own: f64| (sum - own) / (n - 1.0);
    let tiles = sum(&|r| r.stats.tiles.as_ref().unwrap().mean.clone());
    let pixels = sum(&|r| {
        r.pixels
            .as_flattened()
            .iter()
            .map(|v| f64::from(*v))
            .collect()
    });
    let (mut held, mut intervals, mut estimated, mut exact) = (0, 0, 0.0, 0.0);
    for r in &all {
        let own = r.stats.tiles.as_ref().unwrap();
        for (tile, (mean, stderr)) in own
            .mean
            .iter()
            .zip(own.stderr.as_ref().unwrap())
            .enumerate()
        {
            let truth = others(tiles[tile], *mean);
            let width = t_95(own.groups) * stderr * (1.0 + 1.0 / (n - 1.0)).sqrt();
            held += u32::from((mean - truth).abs() <= width);
            intervals += 1;
        }
        let own = r.pixels.as_flattened().iter();
        let truth: Vec<f32> = own
            .zip(&pixels)
            .map(|(own, sum)| others(*sum, f64::from(*own)) as f32)
            .collect();
        // The mean of the others is off by as much as one render, over n - 1.
        exact += metrics::relmse(&r.pixels, truth.as_chunks().0) * (n - 1.0) / n;
        estimated += r.stats.relmse.unwrap();
    }
    let ratio = |value: &dyn Fn(&Render) -> f64, claim: &dyn Fn(&Render) -> f64| {
        let mean = all.iter().map(value).sum::<f64>() / n;
        let spread: f64 = all.iter().map(|r| (value(r) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let claimed = all.iter().map(|r| claim(r).powi(2)).sum::<f64>() / n;
        (spread / claimed).sqrt()
    };
    let depths = all[0].stats.depths.len();
    Calibration {
        coverage: f64::from(held) / f64::from(intervals),
        relmse_ratio: estimated / exact,
        relmse: exact / n,
        b_ratio: ratio(&|r| r.stats.b, &|r| r.stats.b_stderr),
        depth_ratios: (0..depths)
            .map(|d| ratio(&|r| r.stats.depths[d].b, &|r| r.stats.depths[d].b_stderr))
            .collect(),
    }
}

const OVER_PT: IntegratorKind = IntegratorKind::Pssmlt(PathSamplerKind::Pt);
const OVER_BDPT: IntegratorKind = IntegratorKind::Pssmlt(PathSamplerKind::Bdpt);

/// Scene, integrator, mutations or samples per pixel, and bootstrap paths: few paths find the slit.
const CASES: [(&str, &str, IntegratorKind, u64, u64); 8] = [
    ("easy", EASY, IntegratorKind::Mmlt, 64, 20_000),
    ("caustic", CAUSTIC, IntegratorKind::Mmlt, 128, 20_000),
    ("slit", SLIT, IntegratorKind::Mmlt, 200, 60_000),
    ("easy", EASY, IntegratorKind::Pt, 32, 1),
    ("easy", EASY, IntegratorKind::Bdpt, 16, 1),
    ("easy", EASY, IntegratorKind::Lt, 16, 1),
    ("easy", EASY, OVER_PT, 16, 20_000),
    ("easy", EASY, OVER_BDPT, 8, 20_000),
];

fn check(side: u32, renders: u64, effort: u64) {
    for (name, text, integrator, own, bootstrap) in CASES {
        let scene = scene(text, side);
        let settings = Settings {
            integrator,
            mutations_per_pixel: own * effort,
            samples_per_pixel: own * effort,
            bootstrap: bootstrap * effort,
            chains: 2048,
            ..Settings::of(&scene)
        };
        let c = calibrate(&scene, &settings, renders);
        println!(
            "{name} {integrator:?}: {renders} renders of relMSE {:.4}: 95 % intervals hold {:.1} %, relMSE estimated {:.2} times the true one, \
             error of b {:.2} of the claimed, of b_k {:.2?}",
            c.relmse,
            100.0 * c.coverage,
            c.relmse_ratio,
            c.b_ratio,
            c.depth_ratios
        );
        assert!(
            (0.90..=0.99).contains(&c.coverage),
            "{name}: {}",
            c.coverage
        );
        // Where little noise is left but that of the lamp's edges, windows smear it over what is
        // dark beside them.
        let most = match integrator {
            IntegratorKind::Bdpt => 1.7,
            _ => 1.3,
        };
        assert!(
            (1.0 / 1.3..=most).contains(&c.relmse_ratio),
            "{name}: {}",
            c.relmse_ratio
        );
        // 40 renders know a standard deviation to 11 %.
        for ratio in c.depth_ratios.iter().chain([&c.b_ratio]) {
            assert!((0.6..=1.5).contains(ratio), "{name}: {ratio}");
        }
    }
}

#[test]
fn claims_hold() {
    check(48, 40, 1);
}

#[test]
#[ignore = "takes minutes; prints the figures of PERF.md"]
fn claims_hold_in_large_renders() {
    check(96, 256, 4);
}

#[test]
fn a_target_ends_the_render_when_it_is_reached_and_not_before() {
    let scene = scene(EASY, 64);
    let endless = Settings {
        mutations_per_pixel: 1 << 20,
        samples_per_pixel: 1 << 20,
        bootstrap: 20_000,
        chains: 1024,
        target_error: Some(0.2),
        time: Some(Duration::from_secs(60)),
        ..Settings::of(&scene)
    };
    for integrator in IntegratorKind::ALL {
        let done = support::run(
            &scene,
            &Settings {
                integrator,
                ..endless.clone()
            },
        );
        assert_eq!(done.ended_by, EndedBy::Target, "{integrator:?}");
        let error = done.stats.relative_error.unwrap();
        // Chains go on until the end of a round of a quarter second, and until they have mixed.
        assert!(error <= 0.2, "{integrator:?}: {error}");
    }
    // Chains that only ever make small steps do not mix, however good the picture looks.
    let stuck = support::run(
        &scene,
        &Settings {
            integrator: IntegratorKind::Mmlt,
            large_step_probability: 0.0,
            sigma: 1e-4,
            target_error: Some(100.0),
            time: Some(Duration::from_secs(1)),
            ..endless
        },
    );
    assert_eq!(stuck.ended_by, EndedBy::Time, "{:?}", stuck.warnings);
    let warning = stuck
        .warnings
        .iter()
        .find(|w| w.starts_with("chains disagree"))
        .unwrap();
    for part in ["depth ", "strategy (s, t) = (", "pixels ", "split R-hat "] {
        assert!(warning.contains(part), "{part}: {warning}");
    }
}

#[test]
fn well_mixed_chains_raise_no_warning() {
    let scene = scene(EASY, 48);
    let settings = Settings {
        integrator: IntegratorKind::Mmlt,
        mutations_per_pixel: 2000,
        bootstrap: 50_000,
        chains: 64,
        ..Settings::of(&scene)
    };
    let done = support::run(&scene, &settings);
    assert_eq!(done.warnings, Vec::<String>::new());
    assert!(done.stats.rhat.unwrap() < 1.1);
    let check = done.stats.cross_check.unwrap();
    assert!(check.compared > 20 && check.missed == 0, "{check:?}");
}
