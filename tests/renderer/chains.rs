//! Odd numbers of chains and steps, and stops. What else breaks Metropolis renderers is in
//! `hard_cases`.

use crate::support;

use phalanx::integrate::{EndedBy, Observer, Phase, Render, Settings, render};
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use support::stage::{CAMERA, GREY, lamp, lit_stage, renders, stage};
use support::{BOTH, Estimate, Runs, head, inward_box, run, scene, settings};

/// A light walled in. Rounding puts points that lie within some 1e-7 of an edge beyond the
/// adjoining wall, and what scatters there escapes: measured, 1e-5 of the light.
#[test]
fn a_light_walled_in() {
    let walls = "Material \"matte\"\n".to_string() + &inward_box([-1.0, 0.0, 2.2, 2.7, 0.0, 1.0]);
    let [open, walled] = ["", &walls].map(|walls| {
        let scene = scene(&(head(32, 24, 3, CAMERA) + &lamp("[8 8 8]") + walls + &stage(GREY)));
        let settings = Settings {
            bootstrap: 200_000,
            ..settings(&scene, IntegratorKind::Mmlt, 16)
        };
        let render = run(&scene, &settings);
        render.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>()
    });
    println!("{:.2e} of the light leaks out", walled / open);
    assert!(walled <= 1e-4 * open);
}

// --- Chains ---

/// MMLT with changed settings has this mean.
#[track_caller]
fn expect_mean(
    pt: &Estimate,
    scene: &Scene,
    change: &dyn Fn(&mut Settings),
    seeds: u64,
    what: &str,
) {
    let mmlt = renders(scene, IntegratorKind::Mmlt, change, seeds);
    mmlt.whole(1).expect_same(pt, what);
}

fn mean_of_pt(scene: &Scene) -> Estimate {
    renders(scene, IntegratorKind::Pt, &|_| {}, 48).whole(1)
}

#[test]
fn odd_chains() {
    let on = lit_stage(16, 12);
    let pt = mean_of_pt(&on);
    let check = |change: &dyn Fn(&mut Settings), seeds, what: &str| {
        expect_mean(&pt, &on, change, seeds, what);
    };
    check(&|s| s.chains = 1, 24, "one chain");
    check(
        &|s| s.chains = 10_000,
        24,
        "as many chains as mutations, nearly",
    );
    check(&|s| s.chains = 30_000, 24, "more chains than mutations");
    check(&|s| s.large_step_probability = 1.0, 24, "large steps only");
    check(
        &|s| s.large_step_probability = 0.02,
        48,
        "hardly any large step",
    );
    // A depth that the bootstrap missed altogether is left out, so it must not hide a lamp that few
    // pixels see.
    let lamp_behind = format!(
        "AttributeBegin\nTranslate 0 0 1.5\n{}AttributeEnd\n",
        lamp("[8 8 8]")
    );
    let behind = scene(&(head(16, 12, 4, CAMERA) + &lamp_behind + &stage(GREY)));
    expect_mean(
        &mean_of_pt(&behind),
        &behind,
        &|s| s.bootstrap = 300,
        48,
        "a small bootstrap",
    );
}

// --- Stops ---

/// Stops once the render has reported some progress.
struct StopAfter {
    phase: Phase,
    reports: u64,
    seen: AtomicU64,
}

impl Observer for StopAfter {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        assert!(done <= total);
        if phase == self.phase {
            self.seen.fetch_add(1, Ordering::Relaxed);
        }
    }
    fn stop(&self) -> bool {
        self.seen.load(Ordering::Relaxed) >= self.reports
    }
}

fn expect_near(render: Render, truth: &Estimate, what: &str) {
    assert!(render.ended_by != EndedBy::Effort, "{what}: ran to its end");
    let runs = Runs::of(vec![render]);
    let mean = runs.whole(1).mean;
    println!(
        "{what}: {mean:.5} against {:.5} +- {:.5}",
        truth.mean, truth.error
    );
    // A run that goes on for a tenth of a second is good to half a percent; what is lost or counted
    // twice is more.
    assert!(
        (mean / truth.mean - 1.0).abs() < 0.05,
        "{what}: {mean} is not {truth:?}"
    );
}

#[test]
fn stopped_renders_are_normalised() {
    let scene = lit_stage(32, 24);
    let truth = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 128), 8).whole(1);
    let whole = PathSamplerKind::ALL.map(IntegratorKind::Pssmlt);
    for kind in BOTH.into_iter().chain(whole) {
        let endless = Settings {
            bootstrap: 20_000,
            chains: 1000,
            threads: 2,
            ..settings(&scene, kind, 1 << 30)
        };
        for millis in [0, 150, 600] {
            let limited = Settings {
                time: Some(Duration::from_millis(millis)),
                ..endless.clone()
            };
            let begin = Instant::now();
            let render = run(&scene, &limited);
            // The machine may be busy; without the limit it would be years.
            assert!(begin.elapsed() < Duration::from_secs(60));
            assert!(render.ended_by != EndedBy::Effort);
            if millis > 0 {
                expect_near(render, &truth, &format!("{kind:?}, {millis} ms"));
            }
        }
        for reports in [4, 8] {
            let observer = StopAfter {
                phase: Phase::Render,
                reports,
                seen: AtomicU64::new(0),
            };
            let render = render(&scene, &endless, &observer).unwrap();
            expect_near(
                render,
                &truth,
                &format!("{kind:?}, stopped after {reports} reports"),
            );
        }
    }
}

/// Many short stopped runs have the mean of whole ones: nothing leaks at the stop itself.
#[test]
fn stops_are_unbiased() {
    let scene = lit_stage(12, 9);
    let truth = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), 24).whole(1);
    let stopped = (0..300).map(|seed| {
        let observer = StopAfter {
            phase: Phase::Render,
            reports: 3,
            seen: AtomicU64::new(0),
        };
        let settings = Settings {
            seed,
            bootstrap: 1000,
            ..settings(&scene, IntegratorKind::Mmlt, 1 << 20)
        };
        let render = render(&scene, &settings, &observer).unwrap();
        assert!(render.ended_by != EndedBy::Effort);
        render
    });
    Runs::of(stopped.collect())
        .whole(1)
        .expect_same(&truth, "stopped after three rounds");
}

#[test]
fn a_stop_during_the_bootstrap_is_harmless() {
    let scene = lit_stage(16, 12);
    for reports in 0..4 {
        let observer = StopAfter {
            phase: Phase::Bootstrap,
            reports,
            seen: AtomicU64::new(0),
        };
        let settings = Settings {
            bootstrap: 50_000,
            threads: 2,
            ..settings(&scene, IntegratorKind::Mmlt, 1 << 30)
        };
        let render = render(&scene, &settings, &observer).unwrap();
        assert!(render.ended_by != EndedBy::Effort);
        assert!(render.pixels.iter().flatten().all(|v| v.is_finite()));
    }
}
