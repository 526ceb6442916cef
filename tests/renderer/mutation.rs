//! Small mutations of every distribution, tuned and not: where proposals go, and that pictures stay
//! what they are.

use crate::common;
use crate::support;

use common::stats::{FALSE_ALARM, assert_follows, chi_square_tail};
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::{DEFAULT_SIGMA, Mutation, ONE_MINUS_EPSILON, ProposalDistribution};
use phalanx::chain::tune::{ACCEPTANCE, Tune};
use phalanx::integrate::{EndedBy, Observer, Phase, Settings, render};
use phalanx::pbrt::load;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::transport::samples::Samples;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use support::stage::{GREY, lamp, lit_stage, stage};
use support::{Estimate, Runs, head, run, scene, settings};

const DIMENSIONS: usize = 5;
const CHAINS: usize = 1024;

/// Proposals of small steps of many chains that stand at `from` in every dimension.
fn proposals(distribution: &ProposalDistribution, from: f32, steps: u32) -> Vec<f32> {
    let ids: Vec<u32> = (0..CHAINS as u32).collect();
    let mut current = Samples::new(DIMENSIONS, CHAINS);
    for d in 0..DIMENSIONS {
        current.row_mut(d).fill(from);
    }
    let (mut wide, mut narrow) = (current.clone(), current.clone());
    let (mut large, mut decide) = (vec![0.0; CHAINS], vec![0.0; CHAINS]);
    let mut all = Vec::new();
    for i in 0..steps {
        Evaluator::EIGHT.propose(
            distribution,
            &ids,
            i,
            &current,
            &mut wide,
            &mut large,
            &mut decide,
        );
        assert!(large.iter().all(|l| *l == 0.0));
        Evaluator::ONE.propose(
            distribution,
            &ids,
            i,
            &current,
            &mut narrow,
            &mut large,
            &mut decide,
        );
        for d in 0..DIMENSIONS {
            let bits = |s: &Samples| -> Vec<u32> { s.row(d).iter().map(|u| u.to_bits()).collect() };
            assert_eq!(bits(&wide), bits(&narrow), "widths differ");
            all.extend_from_slice(wide.row(d));
        }
    }
    all
}

/// Probability of an offset in `[-1/2, d)` around the ring, in closed form.
fn probability(mutation: Mutation, sigma: f64, d: f64) -> f64 {
    match mutation {
        Mutation::Gaussian => {
            let cdf = |z: f64| {
                let tail = chi_square_tail(z * z, 1) / 2.0;
                if z > 0.0 { 1.0 - tail } else { tail }
            };
            let winds = (-2..=2).map(f64::from);
            winds
                .map(|k| cdf((d + k) / sigma) - cdf((k - 0.5) / sigma))
                .sum()
        }
        Mutation::Kelemen => {
            let scale = sigma / f64::from(DEFAULT_SIGMA);
            let (s1, s2) = (scale / 1024.0, scale / 64.0);
            let within = |r: f64| ((r / s1).max(1.0).min(s2 / s1)).ln() / (s2 / s1).ln();
            // Of the line; the bounds are within half the ring here.
            0.5 + 0.5 * within(d.abs()) * d.signum()
        }
        Mutation::Cauchy => 0.5 + ((PI * d).tan() / (PI * sigma).tanh()).atan() / PI,
    }
}

#[test]
fn offsets_follow_their_laws() {
    let cells = 64;
    for mutation in Mutation::ALL {
        for sigma in [0.002f32, DEFAULT_SIGMA, 0.3] {
            let distribution = ProposalDistribution::new(11, 0.0, sigma).with_mutation(mutation);
            for from in [0.0, 0.3, ONE_MINUS_EPSILON] {
                let all = proposals(&distribution, from, 20);
                let mut counts = vec![0.0; cells];
                for u in &all {
                    assert!((0.0..1.0).contains(u), "{u}");
                    let d = f64::from(*u) - f64::from(from);
                    let d = d - (d + 0.5).floor();
                    let part = probability(mutation, f64::from(sigma), d);
                    // Equal shares: a gap of the distribution, as about 0, is between two.
                    counts[((part * cells as f64) as usize).min(cells - 1)] += 1.0;
                }
                let what = format!("{mutation:?}, sigma {sigma}, from {from}");
                let expected = vec![all.len() as f64 / cells as f64; cells];
                assert_follows(&counts, &expected, FALSE_ALARM, &what);
            }
        }
    }
}

#[test]
fn kelemen_has_the_bounds_of_the_paper() {
    let distribution =
        ProposalDistribution::new(12, 0.0, DEFAULT_SIGMA).with_mutation(Mutation::Kelemen);
    let all = proposals(&distribution, 0.5, 200);
    let sizes: Vec<f32> = all.iter().map(|u| (u - 0.5).abs()).collect();
    let least = sizes.iter().copied().fold(1.0, f32::min);
    let most = sizes.iter().copied().fold(0.0, f32::max);
    // Samples near 1/2 are multiples of 2^-24.
    let rounding = 1.0 / 16_777_216.0;
    assert!(
        least >= 1.0 / 1024.0 - rounding && least < 1.001 / 1024.0,
        "{least}"
    );
    assert!(
        most <= 1.0 / 64.0 + rounding && most > 0.999 / 64.0,
        "{most}"
    );
}

/// What chains may do, and what it is called.
fn ways() -> Vec<(&'static str, Settings)> {
    let scene = lit_stage(16, 12);
    let base = settings(&scene, IntegratorKind::Mmlt, 105);
    let with = |mutation, sigma, large_step| Settings {
        mutation,
        tune: Tune { sigma, large_step },
        ..base.clone()
    };
    vec![
        ("kelemen", with(Mutation::Kelemen, false, false)),
        ("cauchy", with(Mutation::Cauchy, false, false)),
        ("tuned sigma", with(Mutation::Gaussian, true, false)),
        ("all tuned", with(Mutation::Kelemen, true, true)),
    ]
}

/// The whole picture and twelve regions of it, every channel.
#[test]
fn pictures_are_those_of_path_tracing() {
    let scene = lit_stage(16, 12);
    let truth = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 105), 16);
    let comparisons = ways().len() * 39;
    for (name, settings) in ways() {
        let runs = Runs::new(&scene, &settings, 16);
        let all = |runs: &Runs| -> Vec<Estimate> {
            let whole = (0..3).map(|c| runs.whole(c));
            whole.chain(runs.grid(4, 3)).collect()
        };
        for (i, (a, b)) in all(&runs).iter().zip(all(&truth)).enumerate() {
            a.expect_same_among(comparisons, &b, &format!("{name}, {i}"));
        }
    }
}

fn hard(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(name);
    let mut scene = load(&file).unwrap();
    scene.set_resolution(32, 24).unwrap();
    scene
}

fn tuned(scene: &Scene) -> Settings {
    Settings {
        chains: 512,
        bootstrap: 40_000,
        tune: Tune {
            sigma: true,
            large_step: true,
        },
        ..settings(scene, IntegratorKind::Mmlt, 400)
    }
}

/// What is tuned is reported, frozen, and used: small steps are accepted as often as they should
/// be, nearer to it than untuned ones.
#[test]
fn hard_scenes_are_tuned() {
    for name in ["slit.pbrt", "mirror-caustic.pbrt"] {
        let scene = hard(name);
        let tuned = tuned(&scene);
        let plain = Settings {
            tune: Tune::default(),
            ..tuned.clone()
        };
        let [after, before] = [&tuned, &plain].map(|s| run(&scene, s).stats);
        println!(
            "{name}: small steps accepted {:.3}, untuned {:.3}",
            after.acceptance_small, before.acceptance_small
        );
        assert!(
            (after.acceptance_small - ACCEPTANCE).abs()
                < (before.acceptance_small - ACCEPTANCE).abs()
        );
        assert!(after.rays > before.rays);
        for depth in &before.depths {
            let tuned = (depth.sigma, depth.large_step_probability);
            assert_eq!(tuned, (plain.sigma, plain.large_step_probability));
        }
        for depth in &after.depths {
            println!(
                "  depth {:?}: sigma {:.2e}, large steps {:.3}",
                depth.depth, depth.sigma, depth.large_step_probability
            );
            assert!(depth.sigma > 0.0 && depth.sigma <= 0.5);
            assert!(depth.large_step_probability > 0.0 && depth.large_step_probability < 1.0);
        }
    }
}

/// Chains that are set to what others were tuned to are those others, to the last bit: nothing is
/// left of the tuning but its result.
#[test]
fn what_is_tuned_is_frozen() {
    // The lamp is not in view: one depth carries light, and has the one sigma and the one
    // probability.
    let camera = "LookAt 0 2.4 2  0 0 -.5  0 1 0\nCamera \"perspective\" \"float fov\" [30]";
    let scene = scene(&(head(16, 12, 1, camera) + &lamp("[8 8 8]") + &stage(GREY)));
    let tuned = tuned(&scene);
    let found = run(&scene, &tuned);
    let [depth] = &found.stats.depths[..] else {
        panic!("more than one depth");
    };
    let set = Settings {
        sigma: depth.sigma,
        large_step_probability: depth.large_step_probability,
        tune: Tune::default(),
        ..tuned
    };
    let again = run(&scene, &set);
    assert_eq!(found.pixels, again.pixels);
    assert_eq!(found.stats.acceptance_small, again.stats.acceptance_small);
}

// --- Stops ---

/// Stops after so many reports of the bootstrap, which tuning is a part of.
struct StopAfter {
    reports: u64,
    seen: AtomicU64,
}

impl Observer for StopAfter {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        assert!(done <= total);
        if phase == Phase::Bootstrap {
            self.seen.fetch_add(1, Ordering::Relaxed);
        }
    }
    fn stop(&self) -> bool {
        self.seen.load(Ordering::Relaxed) >= self.reports
    }
}

#[test]
fn tuning_stops_when_it_should() {
    let scene = lit_stage(16, 12);
    let endless = Settings {
        mutations_per_pixel: 1 << 30,
        bootstrap: 2000,
        threads: 2,
        ..tuned(&scene)
    };
    let boot = 2;
    let all = boot + u64::from(endless.tune.steps() / 8);
    for reports in [boot, boot + 1, 9, 20, all] {
        let observer = StopAfter {
            reports,
            seen: AtomicU64::new(0),
        };
        let render = render(&scene, &endless, &observer).unwrap();
        assert_eq!(render.ended_by, EndedBy::Observer);
        assert!(render.pixels.iter().flatten().all(|v| v.is_finite()));
        assert!(render.stats.mutations > 0);
        let warned = render.warnings.iter().any(|w| w.contains("tune"));
        assert_eq!(warned, reports < all, "{reports} {:?}", render.warnings);
    }
    let limited = Settings {
        time: Some(Duration::from_millis(40)),
        ..endless
    };
    assert!(run(&scene, &limited).ended_by != EndedBy::Effort);
}
