//! Replaying paths: the walk is the renderer's to the bit, and `phalanx replay` as a user meets it.

mod common;

use common::scenes;
use common::stats::Random;
use phalanx::replay::Recorder;
use phalanx::simd::f32x8;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Outcome, Paths, World};

/// What a path leaves behind.
fn bits(o: &Outcome) -> ([u32; 3], [u32; 2], u32, bool) {
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
            world.evaluate_multiplexed::<f32x8>(plan, &samples, n, &mut paths);
            for (i, o) in paths.outcome.iter().enumerate() {
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
