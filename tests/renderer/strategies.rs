//! Strategies of a depth, each weighted and summed, give what path tracing gives of that depth.

use crate::common;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, assert_agree};
use phalanx::chain::evaluator::Evaluator;
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};

const MAX_DEPTH: u32 = 4;
const BATCH: usize = 2048;
const BATCHES: usize = 30;
/// Tiles along each side of the region: means over the whole picture would hide what is only
/// misplaced.
const TILES: usize = 2;

fn fill(samples: &mut Samples, random: &mut Random) {
    for d in 0..samples.dimensions() {
        samples.row_mut(d).fill_with(|| random.uniform());
    }
}

fn value(o: &Splat) -> f64 {
    assert!(o.rejected == 0);
    // Channels weighed apart, so that swapped ones show.
    f64::from(o.rgb[0]) + 2.0 * f64::from(o.rgb[1]) + 3.0 * f64::from(o.rgb[2])
}

/// Adds a sample to the tile it falls into and a zero to the others.
fn add(tiles: &mut [Mean], world: &World, raster: [f32; 2], value: f64) {
    let r = world.camera.region;
    let at =
        |x: f32, x0: f32, w: f32| (((x - x0) / w * TILES as f32).floor() as usize).min(TILES - 1);
    let tile = at(raster[0], r.x0, r.width) + TILES * at(raster[1], r.y0, r.height);
    for (i, t) in tiles.iter_mut().enumerate() {
        t.add(if i == tile { value } else { 0.0 });
    }
}

#[test]
fn sums_over_strategies_are_what_path_tracing_sees() {
    let mut random = Random(21);
    let scenes = scenes::all();
    let comparisons = scenes.len() * (MAX_DEPTH as usize + 1) * TILES * TILES;
    for (name, mut scene) in scenes {
        scenes::without_delta_caustics(&mut scene);
        let world = World::new(&scene, MAX_DEPTH);
        let mut paths = Paths::new(&world);
        let mut other = Paths::new(&world);
        for plan in &world.plan.depths {
            let k = plan.depth;
            let mut multiplexed = [Mean::default(); TILES * TILES];
            let mut traced = [Mean::default(); TILES * TILES];
            let mut by_strategy = vec![0.0; k as usize + 2];
            let mut samples = Samples::new(plan.layout.total, BATCH);
            let layout = UnidirectionalLayout::new(&world.plan, k);
            let mut numbers = Samples::new(layout.total(), BATCH);
            for _ in 0..BATCHES {
                fill(&mut samples, &mut random);
                Evaluator::EIGHT.multiplexed(&world, plan, &samples, BATCH, &mut paths);
                for o in &paths.splats.camera {
                    add(&mut multiplexed, &world, o.raster, value(o));
                    by_strategy[o.s as usize] += value(o) / (BATCH * BATCHES) as f64;
                }
                // The same numbers with one scattering event less: the difference is this depth
                // alone.
                fill(&mut numbers, &mut random);
                Evaluator::EIGHT.unidirectional(&world, &layout, &numbers, BATCH, &mut paths);
                if k > 0 {
                    let shorter = UnidirectionalLayout::new(&world.plan, k - 1);
                    Evaluator::EIGHT.unidirectional(&world, &shorter, &numbers, BATCH, &mut other);
                }
                for (i, o) in paths.splats.camera.iter().enumerate() {
                    let less = if k > 0 {
                        value(&other.splats.camera[i])
                    } else {
                        0.0
                    };
                    add(&mut traced, &world, o.raster, value(o) - less);
                }
            }
            for (tile, (a, b)) in multiplexed.iter().zip(&traced).enumerate() {
                assert_agree(
                    a,
                    b,
                    FALSE_ALARM / comparisons as f64,
                    &format!("{name}, depth {k}, tile {tile}, strategies {by_strategy:.3?}"),
                );
            }
            let apart = (0..TILES * TILES)
                .map(|i| {
                    let (a, b) = (multiplexed[i], traced[i]);
                    let error = a.error().hypot(b.error()).max(1e-30);
                    (a.mean() - b.mean()) / error
                })
                .map(|x| format!("{x:+.1}"))
                .collect::<Vec<_>>();
            println!(
                "{name}, depth {k}: {by_strategy:.4?}, sigmas {}",
                apart.join(" ")
            );
        }
    }
}
