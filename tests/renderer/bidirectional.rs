//! Bidirectional evaluation is multiplexed evaluation of all strategies at once, path by path, and
//! sums to what path tracing sees.

use crate::common;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, assert_agree};
use phalanx::chain::evaluator::Evaluator;
use phalanx::plan::DepthPlan;
use phalanx::transport::bidirectional::{BidirectionalLayout, Strategy};
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};

const MAX_DEPTH: u32 = 4;
/// Not a multiple of eight.
const BATCH: usize = 500;

fn fill(samples: &mut Samples, random: &mut Random) {
    for d in 0..samples.dimensions() {
        samples.row_mut(d).fill_with(|| random.uniform());
    }
}

/// The samples of a bidirectional evaluation that a multiplexed one of a strategy reads, in its
/// order.
fn multiplexed(
    world: &World,
    depth: &DepthPlan,
    strategy: Strategy,
    layout: &BidirectionalLayout,
    samples: &Samples,
) -> Samples {
    let to = &depth.layout;
    let mut made = Samples::new(to.total, BATCH);
    let mut copy = |to: usize, from: usize, n: usize| {
        for i in 0..n {
            made.row_mut(to + i).copy_from_slice(samples.row(from + i));
        }
    };
    let plan = &world.plan;
    let k = depth.depth as usize;
    let component = usize::from(plan.mixtures);
    let choice = usize::from(plan.light_choice);
    copy(to.raster, layout.at.raster, 2);
    copy(to.lens, layout.at.lens, if plan.lens { 2 } else { 0 });
    copy(
        to.wavelength,
        layout.at.wavelength,
        usize::from(plan.dispersion),
    );
    copy(to.camera_bounce, layout.at.camera_bounce, k * to.per_bounce);
    copy(
        to.camera_component,
        layout.at.camera_component,
        k * component,
    );
    if strategy.s >= 2 {
        copy(to.light_choice, layout.at.light_choice, choice);
        copy(to.emission, layout.at.emission, 4);
        copy(
            to.light_bounce,
            layout.at.light_bounce,
            (k - 1) * to.per_bounce,
        );
        copy(to.light_component, layout.at.light_component, k * component);
    }
    if strategy.s == 1 {
        let from =
            layout.at.connection_choice + (strategy.t as usize - 2) * layout.at.strides.connection;
        copy(to.connection_choice, from, choice);
        copy(to.connection, from + choice, 2);
    }
    if strategy.t == 1 {
        let n = 2 * usize::from(world.camera.connects_by_choice());
        copy(
            to.connection,
            layout.at.camera_point + (strategy.s as usize - 2) * n,
            n,
        );
    }
    if depth.strategies.len() > 1 {
        let at = depth.strategies.iter().position(|s| *s == strategy.s);
        let u = (at.unwrap() as f32 + 0.5) / depth.strategies.len() as f32;
        made.row_mut(to.strategy).fill(u);
    }
    made
}

/// Equal but for the order of a few multiplications.
fn expect_equal(a: [f32; 3], b: [f32; 3], what: &str) {
    for (a, b) in a.into_iter().zip(b) {
        assert!((a - b).abs() <= 1e-6 * a.max(b), "{what}: {a} is not {b}");
    }
}

#[test]
fn every_strategy_is_that_of_multiplexed_paths() {
    let mut random = Random(5);
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, MAX_DEPTH);
        let layout = BidirectionalLayout::new(&world).with_parts();
        let mut samples = Samples::new(layout.total(), BATCH);
        fill(&mut samples, &mut random);
        let (mut paths, mut other) = (Paths::new(&world), Paths::new(&world));
        Evaluator::EIGHT.bidirectional(&world, &layout, &samples, BATCH, &mut paths);
        let mut lit = 0;
        let mut sums = vec![[0.0f32; 3]; BATCH];
        for (index, &strategy) in layout.strategies().iter().enumerate() {
            let depth = &world.plan.depths[strategy.depth() as usize];
            let own = multiplexed(&world, depth, strategy, &layout, &samples);
            Evaluator::EIGHT.multiplexed(&world, depth, &own, BATCH, &mut other);
            let choices = depth.strategies.len() as f32;
            for i in 0..BATCH {
                let what = format!("{name}, {strategy:?}, path {i}");
                let truth = &other.splats.camera[i];
                assert_eq!(truth.s, strategy.s);
                let part = paths.splats.parts[index][i];
                let weighted = part.weighted;
                expect_equal(weighted, truth.rgb.map(|v| v / choices), &what);
                if weighted == [0.0; 3] {
                    continue;
                }
                lit += 1;
                let at = match strategy.t {
                    1 => paths.splats.light[strategy.s as usize - 2][i],
                    _ => paths.splats.camera[i],
                };
                assert_eq!(at.raster, truth.raster, "{what}");
                if strategy.t == 1 {
                    assert_eq!(at.rgb, weighted, "{what}");
                } else {
                    (sums[i].iter_mut().zip(weighted)).for_each(|(sum, v)| *sum += v);
                }
                // Weights are at most 1.
                for c in 0..3 {
                    assert!(
                        weighted[c] <= part.unweighted[c] * (1.0 + 1e-6),
                        "{what}: {part:?}"
                    );
                }
            }
        }
        for (i, (sum, splat)) in sums.iter().zip(&paths.splats.camera).enumerate() {
            expect_equal(*sum, splat.rgb, &format!("{name}, sum of path {i}"));
        }
        println!(
            "{name}: {lit} of {} contributions",
            BATCH * layout.strategies().len()
        );
        assert!(lit > BATCH / 4, "{name}: {lit}");
    }
}

/// Light tracing is what bidirectional evaluation makes of the same light subpaths, without
/// weights.
#[test]
fn light_tracing_is_unweighted() {
    let mut random = Random(6);
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, MAX_DEPTH);
        let layout = BidirectionalLayout::new(&world).with_parts();
        let mut samples = Samples::new(layout.total(), BATCH);
        fill(&mut samples, &mut random);
        let (mut paths, mut other) = (Paths::new(&world), Paths::new(&world));
        Evaluator::EIGHT.bidirectional(&world, &layout, &samples, BATCH, &mut paths);
        let short = BidirectionalLayout::light_tracing(&world);
        let mut own = Samples::new(short.total(), BATCH);
        let camera = layout.at.camera_bounce;
        assert_eq!(short.at.camera_bounce, camera);
        for d in 0..camera {
            own.row_mut(d).copy_from_slice(samples.row(d));
        }
        let direct = layout.at.connection_choice - layout.at.light_choice;
        for (from, to, n) in [
            (layout.at.light_choice, short.at.light_choice, direct),
            (
                layout.at.camera_point,
                short.at.camera_point,
                layout.total() - layout.at.camera_point,
            ),
        ] {
            assert!(to + n <= short.total());
            for d in 0..n {
                own.row_mut(to + d).copy_from_slice(samples.row(from + d));
            }
        }
        Evaluator::EIGHT.bidirectional(&world, &short, &own, BATCH, &mut other);
        assert_eq!(paths.splats.light.len(), other.splats.light.len());
        for (index, strategy) in layout.strategies().iter().enumerate() {
            for i in 0..BATCH {
                let unweighted = paths.splats.parts[index][i].unweighted;
                if strategy.t == 1 {
                    let splat = &other.splats.light[strategy.s as usize - 2][i];
                    expect_equal(splat.rgb, unweighted, name);
                } else if strategy.depth() == 0 {
                    expect_equal(other.splats.camera[i].rgb, unweighted, name);
                }
            }
        }
    }
}

const BATCHES: usize = 40;
/// Tiles along each side of the region.
const TILES: usize = 2;

/// Adds what a sample brings to each tile.
fn add(tiles: &mut [Mean], world: &World, splats: &[Splat]) {
    let r = world.camera.region;
    let at =
        |x: f32, x0: f32, w: f32| (((x - x0) / w * TILES as f32).floor() as usize).min(TILES - 1);
    let mut values = [0.0; TILES * TILES];
    for o in splats {
        assert_eq!(o.rejected, 0);
        let [red, green, blue] = o.rgb.map(f64::from);
        if o.rgb != [0.0; 3] {
            let tile = at(o.raster[0], r.x0, r.width) + TILES * at(o.raster[1], r.y0, r.height);
            values[tile] += red + 2.0 * green + 3.0 * blue;
        }
    }
    (tiles.iter_mut().zip(values)).for_each(|(tile, value)| tile.add(value));
}

#[test]
fn sums_are_what_path_tracing_sees() {
    let mut random = Random(7);
    let scenes = scenes::all();
    let comparisons = scenes.len() * TILES * TILES;
    for (name, mut scene) in scenes {
        scenes::without_delta_caustics(&mut scene);
        let world = World::new(&scene, MAX_DEPTH);
        let layout = BidirectionalLayout::new(&world);
        let plain = UnidirectionalLayout::new(&world.plan, MAX_DEPTH);
        let mut samples = Samples::new(layout.total(), BATCH);
        let mut numbers = Samples::new(plain.total(), BATCH);
        let mut paths = Paths::new(&world);
        let mut tiles = [[Mean::default(); TILES * TILES]; 2];
        for _ in 0..BATCHES {
            fill(&mut samples, &mut random);
            Evaluator::EIGHT.bidirectional(&world, &layout, &samples, BATCH, &mut paths);
            for i in 0..BATCH {
                let mut all = vec![paths.splats.camera[i]];
                all.extend(paths.splats.light.iter().map(|splats| splats[i]));
                add(&mut tiles[0], &world, &all);
            }
            fill(&mut numbers, &mut random);
            Evaluator::EIGHT.unidirectional(&world, &plain, &numbers, BATCH, &mut paths);
            for splat in &paths.splats.camera {
                add(&mut tiles[1], &world, &[*splat]);
            }
        }
        let [bidirectional, traced] = tiles;
        for (tile, (a, b)) in bidirectional.iter().zip(&traced).enumerate() {
            let what = format!("{name}, tile {tile}");
            assert_agree(a, b, FALSE_ALARM / comparisons as f64, &what);
        }
    }
}
