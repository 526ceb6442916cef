//! A scene runs the effects that it calls for; those it does not call for change nothing when they
//! are turned on.

use crate::common;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::pbrt::load_str;
use phalanx::plan::{DepthPlan, Effect, Forced};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};
use std::path::Path;

/// Paths evaluated at a time.
const N: usize = 4096;
const MAX_DEPTH: u32 = 3;

fn evaluate(world: &World, plan: &DepthPlan, random: &mut Random, paths: &mut Paths) -> Vec<Splat> {
    let mut samples = Samples::new(plan.layout.total, N);
    for d in 0..plan.layout.total {
        samples.row_mut(d).fill_with(|| random.uniform());
    }
    Evaluator::EIGHT.multiplexed(world, plan, &samples, N, paths);
    std::mem::take(&mut paths.splats.camera)
}

#[test]
fn effects_that_move_no_samples_leave_every_bit() {
    let still = [
        Forced::Surfaces,
        Forced::Textures,
        Forced::Normals,
        Forced::Bumps,
        Forced::AlphaMasks,
        Forced::Spheres,
        Forced::Lights,
    ];
    for (name, scene) in scenes::all() {
        let planned = World::new(&scene, MAX_DEPTH);
        let forced = World::with_forced(&scene, MAX_DEPTH, &still);
        for (a, b) in planned.plan.depths.iter().zip(&forced.plan.depths) {
            assert_eq!(a.layout, b.layout, "{name}");
            let [a, b] = [(&planned, a), (&forced, b)]
                .map(|(world, plan)| evaluate(world, plan, &mut Random(1), &mut Paths::new(world)));
            assert!(a == b, "{name}");
        }
    }
}

#[test]
fn all_effects_together_leave_the_picture() {
    let mut compared = 0;
    let mut worst = 0.0f64;
    for (name, scene) in scenes::all() {
        let worlds = [
            World::new(&scene, MAX_DEPTH),
            World::with_forced(&scene, MAX_DEPTH, &[Forced::All]),
        ];
        let mut paths = worlds.each_ref().map(Paths::new);
        for depth in 0..=MAX_DEPTH as usize {
            let mut random = Random(7 + depth as u64);
            let means = [0, 1].map(|i| {
                let (world, paths) = (&worlds[i], &mut paths[i]);
                let mut mean = Mean::default();
                for _ in 0..8 {
                    let splats = evaluate(world, &world.plan.depths[depth], &mut random, paths);
                    for o in &splats {
                        assert_eq!(o.rejected, 0, "{name}");
                        mean.add(f64::from(o.rgb.iter().sum::<f32>()));
                    }
                }
                mean
            });
            let [a, b] = means;
            let error = a.error().hypot(b.error());
            let off = (a.mean() - b.mean()).abs();
            if error == 0.0 {
                assert_eq!(off, 0.0, "{name}, depth {depth}");
                continue;
            }
            compared += 1;
            worst = worst.max(off / error);
            assert!(
                off < error * normal_quantile(FALSE_ALARM),
                "{name}, depth {depth}: {} +- {} and, with all effects, {} +- {}",
                a.mean(),
                a.error(),
                b.mean(),
                b.error()
            );
        }
    }
    println!("{compared} means, at most {worst:.2} standard errors apart");
    assert!(compared > 20);
}

const GLASS: &str = r#"
Camera "perspective" "float lensradius" [0.1] "float focaldistance" [4]
WorldBegin
MakeNamedMaterial "Pot1" "string type" "glass" "float uroughness" [.2] "float vroughness" [.1]
LightSource "point" "rgb I" [1 1 1] "point from" [0 3 0]
NamedMaterial "Pot1"
Translate 0 0 5
Shape "sphere"
WorldEnd
"#;

#[test]
fn every_effect_has_a_reason() {
    let scene = load_str(GLASS, "pot.pbrt", Path::new("")).expect("the scene loads");
    let world = World::new(&scene, 2);
    let effects = &world.plan.effects;
    let list: Vec<(&str, String)> = (effects.members().into_iter())
        .map(|m| (m.effect, m.reason))
        .collect();
    let plane = "such surfaces do not all lie in one plane";
    let pot = "material \"Pot1\", pot.pbrt:4";
    let expected = [
        ("rough dielectric", pot),
        ("choice of lobe", pot),
        ("tangents", pot),
        ("spheres", "one sphere"),
        ("point light", "light, pot.pbrt:5"),
        ("lens", "the camera's lensradius"),
        ("paths with bounces", "a surface that is not black"),
        ("paths of two or more bounces", plane),
        ("connections (s = 1, t = 1)", "a BSDF that is not a delta"),
        ("joined subpaths (s, t >= 2)", plane),
    ];
    assert_eq!(list, expected.map(|(e, r)| (e, r.to_string())));
    for absent in [Effect::EmitterHits, Effect::Textures, Effect::LightChoice] {
        assert!(!effects.has(absent) && effects.absent().contains(&absent.name()));
    }
    assert_eq!(
        effects.members().len() + effects.absent().len(),
        Effect::all().count()
    );
}
