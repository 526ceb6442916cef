//! The weights of the running sums are the balance heuristic: whole paths, recorded and weighed in `f64`, strategy by strategy.

mod common;

use common::record::Recorder;
use common::scenes;
use common::stats::Random;
use phalanx::simd::f32x8;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, World};

/// Scattering events of the longest paths compared.
const MAX_DEPTH: u32 = 5;
/// Paths per scene and depth.
const PATHS: usize = 10_000;

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
            world.evaluate_multiplexed::<f32x8>(plan, &samples, PATHS, &mut paths);
            let choices = plan.strategies.len() as f64;
            // By strategy: paths that carry light, and visibilities that differ.
            let mut lit = vec![0; plan.depth as usize + 2];
            let (mut differ, mut wild) = (0, 0);
            for i in 0..PATHS {
                let outcome = paths.outcome[i];
                assert!(
                    outcome.rejected == 0,
                    "{name}, depth {}, path {i}",
                    plan.depth
                );
                let got = outcome.rgb.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0 / choices;
                let recorded = recorder.record(plan, &samples, i);
                let Some(path) = recorded.as_ref().filter(|p| p.visible) else {
                    differ += usize::from(got > 0.0);
                    continue;
                };
                assert_eq!(path.s, outcome.s);
                let reference = recorder.reference(path, &plan.strategies);
                let want = reference.value();
                let spread = recorder.sensitivity(path, &plan.strategies, &mut random);
                if spread > 0.01 * want {
                    // A rounding error decides what such a path is worth.
                    wild += usize::from(want > 0.0);
                    continue;
                }
                if want == 0.0 && got == 0.0 {
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
                    reference.density[path.s as usize] / reference.density.iter().sum::<f64>(),
                );
            }
            // Rays that graze an edge may be decided either way, and few paths hang on a rounding error.
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
