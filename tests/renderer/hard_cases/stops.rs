//! Row 32: renders that are stopped, wherever they are.
//!
//! `tests/program/cli.rs` sends signals to processes.

use super::COMPARISONS;
use crate::support::stage::lit_stage;
use crate::support::{Estimate, Runs, head, run, scene, settings};
use phalanx::integrate::{EndedBy, Observer, Phase, Render, Settings, render};
use phalanx::scene::{IntegratorKind, Scene};
use std::sync::atomic::{AtomicBool, Ordering};

/// Ends a render once so much of a phase is done.
struct StopAt {
    phase: Phase,
    done: u64,
    reached: AtomicBool,
}

impl Observer for StopAt {
    fn progress(&self, phase: Phase, done: u64, _: u64) {
        if phase == self.phase && done >= self.done {
            self.reached.store(true, Ordering::Relaxed);
        }
    }
    fn stop(&self) -> bool {
        self.reached.load(Ordering::Relaxed)
    }
}

fn stopped(scene: &Scene, settings: &Settings, phase: Phase, done: u64) -> Render {
    let observer = StopAt {
        phase,
        done,
        reached: AtomicBool::new(false),
    };
    let render = render(scene, settings, &observer).unwrap();
    assert_eq!(render.ended_by, EndedBy::Observer);
    render
}

/// Row 32: a stop during the bootstrap, even before it has begun: every depth has its paths, and
/// the picture its brightness. A bias of 6 % would show.
#[test]
fn a_bootstrap_cut_short_keeps_all_light() {
    let scene = lit_stage(16, 12);
    let mut cut = settings(&scene, IntegratorKind::Mmlt, 8);
    cut.bootstrap = 1_000_000_000;
    let mut means = Vec::new();
    for seed in 0..512 {
        cut.seed = seed;
        let render = stopped(&scene, &cut, Phase::Build, 1);
        assert!(
            render.warnings.iter().any(|w| w.contains("bootstrap")),
            "{:?}",
            render.warnings
        );
        let values = render.pixels.as_flattened();
        means.push(values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64);
    }
    let whole = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 256), 8);
    let truth: Vec<f64> = (0..3).map(|c| whole.whole(c).mean).collect();
    let truth = truth.iter().sum::<f64>() / 3.0;
    let cut = Estimate::of(&means);
    println!("{:.5} +- {:.5}, whole {truth:.5}", cut.mean, cut.error);
    assert!(cut.error < 0.008 * truth, "too noisy to tell");
    cut.expect_among(COMPARISONS, truth, "brightness");
}

/// Row 32: a pass over the picture broken off: what is rendered has its brightness to the last
/// pixel, what is not is black.
#[test]
fn a_pass_broken_off_is_as_bright_as_a_whole_one() {
    let sky = "LookAt 0 0 0  0 0 1  0 1 0\nCamera \"perspective\"";
    let light = "LightSource \"infinite\" \"rgb L\" [2 2 2]\n";
    let (width, height) = (700, 300);
    for (filter, tolerance) in [
        ("\"box\"", 1e-6),
        (
            "\"triangle\" \"float xwidth\" [1] \"float ywidth\" [1]",
            0.5,
        ),
    ] {
        let text = format!("PixelFilter {filter}\n") + &head(width, height, 1, sky) + light;
        let scene = scene(&text);
        for first in [true, false] {
            // The first round is smaller than a pass, and so are those that a stop ends.
            let after = if first { 1 } else { u64::from(width * height) };
            let settings = settings(&scene, IntegratorKind::Pt, 1000);
            let render = stopped(&scene, &settings, Phase::Render, after);
            let done = render.stats.samples / u64::from(width);
            assert!(first == (done < u64::from(height)), "{done} rows");
            for (i, pixel) in render.pixels.iter().enumerate() {
                let row = i as u64 / u64::from(width);
                // Rows that are done, and those that no sample has reached.
                let [above, below] = [row + 2 < done, row > done + 2];
                if above || !first {
                    let spread = tolerance * if first { 1.0 } else { 1.5 };
                    assert!(
                        (pixel[0] - 2.0).abs() <= 2.0 * spread,
                        "{filter}, row {row} of {done}: {pixel:?}"
                    );
                } else if below {
                    assert_eq!(*pixel, [0.0; 3], "{filter}, row {row} of {done}");
                }
                assert!(pixel.iter().all(|v| v.is_finite() && *v >= 0.0));
            }
            let rows = render.pixels.chunks(width as usize);
            let rendered: Vec<f32> = rows.take(done as usize).flatten().map(|p| p[0]).collect();
            let mean = rendered.iter().sum::<f32>() / rendered.len() as f32;
            assert!((mean - 2.0).abs() < 0.02, "{filter}: {mean}");
        }
    }
}

/// Row 32: time runs out in the bootstrap. The chains get the other half.
#[test]
fn time_is_shared_by_bootstrap_and_chains() {
    let scene = lit_stage(16, 12);
    let mut settings = settings(&scene, IntegratorKind::Mmlt, 1_000_000);
    settings.bootstrap = 1_000_000_000;
    settings.time = Some(std::time::Duration::from_millis(600));
    let render = run(&scene, &settings);
    assert_eq!(render.ended_by, EndedBy::Time);
    assert!(render.stats.mutations > 100_000);
    let part = render.stats.bootstrap_seconds / render.stats.total_seconds;
    assert!((0.2..0.8).contains(&part), "{part}");
}
