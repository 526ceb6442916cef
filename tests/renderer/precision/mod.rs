//! Lane widths, extreme primary samples, long paths, and how far `f32` is from `f64`.

mod adversary;
use crate::common;
mod study;
mod tail;

use adversary::extreme;
use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};

fn bits(o: &Splat) -> ([u32; 3], [u32; 2], u32, u32) {
    (
        o.rgb.map(f32::to_bits),
        o.raster.map(f32::to_bits),
        o.s,
        o.rejected,
    )
}

#[test]
fn both_widths_give_the_same_outcomes() {
    let mut random = Random(31);
    let n = 1000;
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 4);
        let (mut one, mut eight) = (Paths::new(&world), Paths::new(&world));
        for plan in &world.plan.depths {
            let mut samples = Samples::new(plan.layout.total, n);
            for d in 0..plan.layout.total {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            Evaluator::ONE.multiplexed(&world, plan, &samples, n, &mut one);
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, n, &mut eight);
            for i in 0..n {
                assert_eq!(
                    bits(&one.splats.camera[i]),
                    bits(&eight.splats.camera[i]),
                    "{name}, depth {}, path {i}",
                    plan.depth
                );
            }
        }
    }
}

#[test]
fn extreme_samples_give_numbers() {
    let mut random = Random(32);
    let n = 2048;
    let mut total = 0;
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 5);
        let mut paths = Paths::new(&world);
        for plan in &world.plan.depths {
            let mut samples = Samples::new(plan.layout.total, n);
            let mut rejected = vec![];
            for _ in 0..2 {
                for d in 0..plan.layout.total {
                    samples.row_mut(d).fill_with(|| extreme(&mut random));
                }
                // Some paths repeat one number.
                for i in (0..n).step_by(7) {
                    let u = extreme(&mut random);
                    for d in 1..plan.layout.total {
                        samples.row_mut(d)[i] = u;
                    }
                }
                Evaluator::EIGHT.multiplexed(&world, plan, &samples, n, &mut paths);
                for (i, o) in paths.splats.camera.iter().enumerate() {
                    assert!(o.rgb.iter().all(|v| v.is_finite() && *v >= 0.0));
                    if o.rejected > 0 {
                        let numbers: Vec<f32> =
                            (0..plan.layout.total).map(|d| samples.row(d)[i]).collect();
                        rejected.push((o.s, numbers));
                    }
                }
                total += n;
            }
            assert!(
                rejected.is_empty(),
                "{name}, depth {}: {} rejected, first {:?}",
                plan.depth,
                rejected.len(),
                rejected[0]
            );
        }
    }
    println!("{total} paths");
}

#[test]
fn long_paths_stay_finite_and_right() {
    // Radiosity of a closed box of albedo r lit from inside by a black-backed lamp: each depth
    // carries nearly r times the last, less what the lamp's own dark surface takes; it is
    // bounded by the geometric series.
    for (depth, n) in [(64, 4096), (200, 1024)] {
        let scene = scenes::furnace(0.99);
        let world = World::new(&scene, depth);
        let mut paths = Paths::new(&world);
        let mut random = Random(33);
        let mut estimates = vec![];
        for k in [depth / 4, depth] {
            let plan = &world.plan.depths[k as usize];
            let mut samples = Samples::new(plan.layout.total, n);
            let mut mean = Mean::default();
            let mut lit = vec![0; k as usize + 2];
            for _ in 0..2 {
                for d in 0..plan.layout.total {
                    samples.row_mut(d).fill_with(|| random.uniform());
                }
                Evaluator::EIGHT.multiplexed(&world, plan, &samples, n, &mut paths);
                for o in &paths.splats.camera {
                    assert!(o.rejected == 0 && o.rgb.iter().all(|v| v.is_finite()));
                    mean.add(f64::from(o.rgb[0]));
                    lit[o.s as usize] += usize::from(o.rgb[0] > 0.0);
                }
            }
            // Long subpaths from both sides carry light.
            let half = lit.len() / 2;
            assert!(lit[..half].iter().sum::<usize>() > 0 && lit[half..].iter().sum::<usize>() > 0);
            estimates.push((k, mean));
        }
        let ((k0, a), (k1, b)) = (estimates[0], estimates[1]);
        // The lamp hardly absorbs more than walls do (it is of the same material): one factor of
        // albedo a bounce.
        let ratio = 0.99f64.powi((k1 - k0) as i32);
        let error = (a.error() * ratio).hypot(b.error());
        let off = (b.mean() - a.mean() * ratio) / error;
        println!(
            "depth {k0}: {} depth {k1}: {}, {off:.2} sigmas",
            a.mean(),
            b.mean()
        );
        assert!(
            off.abs() < normal_quantile(FALSE_ALARM),
            "{} to {}: {off} sigmas",
            a.mean() * ratio,
            b.mean()
        );
    }
}
