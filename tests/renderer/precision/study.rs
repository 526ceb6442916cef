//! How far `f32` is from `f64`: contributions, sampled densities and MIS weights of random and of
//! hard paths.

use super::adversary;
use super::tail::{QUANTILES, Tail};
use crate::common::scenes;
use crate::common::stats::Random;
use phalanx::plan::DepthPlan;
use phalanx::replay::compare::{Densities, contribution, densities, relative};
use phalanx::replay::vector::{dot, wide};
use phalanx::replay::{Fate, Path, Recorder, Reference, Sensitivity, Walk};
use phalanx::scene::Scene;
use phalanx::surface::microfacet::TrowbridgeReitz;
use phalanx::surface::{Kind, MaterialTable};
use phalanx::transport::World;
use phalanx::transport::paths::Side;
use std::path::PathBuf;

/// Scattering events of the longest paths.
const MAX_DEPTH: u32 = 5;
/// Errors that must be explained.
const LARGE: f64 = 1e-3;
/// One path in so many is shaken, however well it does.
const SHAKEN: usize = 10;
/// Weights below it are beyond what the running sums tell apart (they saturate at 1e18).
const SATURATED: f64 = 1e-16;
/// How often chance may fail one of the some four hundred comparisons of quantiles.
const FALSE_ALARM: f64 = 1e-6;
/// Contributions below it have lost digits as they neared the smallest `f32`.
const TINY: f64 = 1e-34;

/// What is compared: figures of the walk in `f32` against `f64` from the vertices that it found,
/// and from the same primary samples.
#[derive(Clone, Copy, PartialEq)]
enum Figure {
    Contribution,
    Weight,
    /// Each sampled density, and its reverse.
    Density,
    ContributionBySamples,
    WeightBySamples,
    /// Error of the contribution over what rounding of operations and vertices explains, of some
    /// paths.
    Conditioned,
}

const FIGURES: [(Figure, &str); 6] = [
    (Figure::Contribution, "contribution, same vertices"),
    (Figure::Weight, "MIS weight, same vertices"),
    (Figure::Density, "sampled densities, same vertices"),
    (Figure::ContributionBySamples, "contribution, same samples"),
    (Figure::WeightBySamples, "MIS weight, same samples"),
    (
        Figure::Conditioned,
        "contribution, error over its explanation",
    ),
];

/// A path with a large error.
struct Case {
    error: f64,
    what: &'static str,
    strategy: (u32, u32),
    depth: u32,
    samples: Vec<f32>,
    single: f64,
    double: f64,
    /// How far movements of the vertices move the figure.
    moved: f64,
}

impl Case {
    /// With the arguments that replay it.
    fn print(&self, scene: &str) {
        let list: Vec<String> = self.samples.iter().map(f32::to_string).collect();
        println!(
            "  {:.1e}, {}, (s, t) = {:?}: {:e} is {:e} +- {:.1e}\n    phalanx replay {scene} --depth {} --samples {}",
            self.error,
            self.what,
            self.strategy,
            self.single,
            self.double,
            self.moved,
            self.depth,
            list.join(",")
        );
    }
}

/// Errors of a set of paths.
#[derive(Default)]
struct Errors {
    tails: [Tail; FIGURES.len()],
    /// Paths looked at that reach from the camera to a light, and those that could not be followed
    /// in `f64` from their samples.
    paths: usize,
    lost: usize,
    /// Large errors by explanation: the figure moves with the vertices; numbers out of range.
    ill: usize,
    out_of_range: usize,
    unexplained: Vec<Case>,
    /// The largest errors of well-explained figures, too.
    worst: Vec<Case>,
}

/// A path, and what is known about it.
struct Looked<'a> {
    recorder: &'a Recorder<'a>,
    plan: &'a DepthPlan,
    samples: &'a [f32],
    walk: &'a Walk,
    path: &'a Path,
    reference: &'a Reference,
}

impl Looked<'_> {
    fn moves(&self, pairs: usize, factor: f64) -> Sensitivity {
        let strategies = &self.plan.strategies;
        (self.recorder).sensitivity_to(self.path, strategies, 1, self.reference, pairs, factor)
    }

    /// What the roundings of a path's formulas may add up to, relative: an ulp of each of the some
    /// ten factors that a vertex brings.
    fn roundings(&self) -> f64 {
        10.0 * f64::from(f32::EPSILON) * f64::from(self.plan.depth + 2)
    }

    /// Whether rounding of the vertices explains a relative error: `moved` picks a figure's
    /// relative change. If a few movements have found nothing: more; shorter ones, since a
    /// figure can be steeper nearby; and twice as far, since both ends of a segment are moved off
    /// their surfaces.
    fn explained(&self, error: f64, moved: impl Fn(&Sensitivity) -> f64) -> Result<(), f64> {
        let mut most = 0.0f64;
        for (pairs, factor) in [(3, 1.0), (30, 1.0), (300, 0.1), (300, 0.01), (300, 2.0)] {
            most = most.max(moved(&self.moves(pairs, factor)));
            // A few hundred directions do not find the steepest.
            if error <= self.roundings() + 2.0 * most {
                return Ok(());
            }
        }
        Err(most)
    }

    fn case(&self, what: &'static str, single: f64, double: f64, moved: f64) -> Case {
        Case {
            error: relative(single, double),
            what,
            strategy: (self.walk.s, self.walk.t),
            depth: self.plan.depth,
            samples: self.samples.to_vec(),
            single,
            double,
            moved,
        }
    }
}

impl Errors {
    fn add(&mut self, figure: Figure, error: f64) {
        self.tails[figure as usize].add(error);
    }

    fn tail(&self, figure: Figure) -> &Tail {
        &self.tails[figure as usize]
    }

    fn look(&mut self, recorder: &Recorder, plan: &DepthPlan, samples: &[f32]) {
        let walk = recorder.walk(plan, samples);
        if walk.fate != Fate::Whole {
            return;
        }
        let exact = recorder.retrace(plan, samples, &walk);
        self.lost += usize::from(exact.is_none());
        for (i, path) in walk.paths().enumerate() {
            let reference = recorder.reference(&path, &plan.strategies);
            let single = [contribution(&walk, i), walk.meetings[i].weight.into()];
            let double = [reference.value(), reference.weight(path.s)];
            if single[0] == 0.0 && double[0] == 0.0 {
                continue;
            }
            let looked = Looked {
                recorder,
                plan,
                samples,
                walk: &walk,
                path: &path,
                reference: &reference,
            };
            self.figures(&looked, single, double);
            for d in densities(&walk, &reference) {
                self.density(&looked, &d);
            }
            if let Some(path) = exact.as_ref().and_then(|e| e.get(i)) {
                let exact = recorder.reference(path, &plan.strategies);
                let by_samples = [exact.value(), exact.weight(path.s)];
                let errors = [0, 1].map(|c| relative(single[c], by_samples[c]));
                self.add(Figure::ContributionBySamples, errors[0]);
                self.add(Figure::WeightBySamples, errors[1]);
            }
        }
    }

    /// Contribution and MIS weight.
    fn figures(&mut self, looked: &Looked, single: [f64; 2], double: [f64; 2]) {
        self.paths += 1;
        if self.paths.is_multiple_of(SHAKEN) && double[0] > TINY {
            let reach = looked.roundings() * double[0] + looked.moves(8, 1.0).value;
            let error = (single[0] - double[0]).abs() / reach;
            self.add(Figure::Conditioned, error);
        }
        let what = ["contribution", "MIS weight"];
        for (c, figure) in [Figure::Contribution, Figure::Weight]
            .into_iter()
            .enumerate()
        {
            let error = relative(single[c], double[c]);
            self.add(figure, error);
            if self.worst.len() < 3 || self.worst.iter().any(|w| error > w.error) {
                self.worst
                    .push(looked.case(what[c], single[c], double[c], 0.0));
                self.worst.sort_by(|a, b| b.error.total_cmp(&a.error));
                self.worst.truncate(3);
            }
            if error <= LARGE {
                continue;
            }
            // Where the figure itself is 0, its changes are judged as they are.
            let (error, scale) = if double[c] > 0.0 {
                (error, double[c])
            } else {
                (single[c], 1.0)
            };
            let moved = |m: &Sensitivity| [m.value, m.weight][c] / scale;
            let Err(moved) = looked.explained(error, moved) else {
                self.ill += 1;
                continue;
            };
            if double[1] < SATURATED || double[0] < TINY {
                self.out_of_range += 1;
            } else {
                let case = looked.case(what[c], single[c], double[c], moved * scale);
                self.unexplained.push(case);
            }
        }
    }

    fn density(&mut self, looked: &Looked, d: &Densities) {
        for c in 0..2 {
            let (single, double) = (f64::from(d.single[c]), d.double[c]);
            let error = relative(single, double);
            self.add(Figure::Density, error);
            if error <= LARGE {
                continue;
            }
            // Forth from the camera is back from the light. Of a delta lobe only the ratio varies,
            // which is kept as the way back.
            let delta = looked.path.surface[d.joint].kind.is_delta();
            let way = match d.side {
                _ if delta => 1,
                Side::Camera => c,
                Side::Light => 1 - c,
            };
            match looked.explained(error, |m| m.densities[d.joint][way]) {
                Ok(()) => self.ill += 1,
                Err(moved) => {
                    let case = looked.case("density", single, double, moved * double);
                    self.unexplained.push(case);
                }
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        for (tail, more) in self.tails.iter_mut().zip(&other.tails) {
            tail.merge(more);
        }
    }

    fn sort(&mut self) {
        self.tails.iter_mut().for_each(Tail::sort);
    }

    /// A line on explanations, and the cases.
    fn print_cases(&self, name: &str, scene: &str) {
        println!(
            "{name}: of {} paths {} have large errors that vertices explain, {} out of range, {} unexplained; {} not followed in f64; worst:",
            self.paths,
            self.ill,
            self.out_of_range,
            self.unexplained.len(),
            self.lost,
        );
        self.worst.iter().for_each(|case| case.print(scene));
        if !self.unexplained.is_empty() {
            println!("  unexplained:");
            let some = self.unexplained.iter().take(10);
            some.for_each(|case| case.print(scene));
        }
    }
}

/// Random and hard paths of a scene, the same number at every depth that has any.
fn errors(scene: &Scene, random: usize, hard: usize) -> [Errors; 2] {
    let world = World::new(scene, MAX_DEPTH);
    let recorder = Recorder::new(scene, &world);
    let plans: Vec<&DepthPlan> = (world.plan.depths.iter())
        .filter(|p| !p.strategies.is_empty())
        .collect();
    let mut numbers = Random(81);
    let mut all = [Errors::default(), Errors::default()];
    for i in 0..random {
        let plan = plans[i % plans.len()];
        let samples: Vec<f32> = (0..plan.layout.total).map(|_| numbers.uniform()).collect();
        all[0].look(&recorder, plan, &samples);
    }
    for i in 0..hard {
        let plan = plans[i / adversary::KINDS % plans.len()];
        let samples = adversary::samples(&recorder, plan, i % adversary::KINDS, &mut numbers);
        all[1].look(&recorder, plan, &samples);
    }
    all.iter_mut().for_each(Errors::sort);
    all
}

const NAMES: [&str; 2] = ["random", "hard"];

/// Every scene, by name, and where it is as a file.
fn files() -> Vec<(&'static str, Scene, String)> {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("precision");
    let files = scenes::write_all(&folder);
    let scenes = scenes::all().into_iter().zip(files);
    scenes
        .map(|((name, scene), file)| (name, scene, file.display().to_string()))
        .collect()
}

#[test]
#[ignore = "half a minute: the study of PERF.md"]
fn study() {
    let mut whole = [Errors::default(), Errors::default()];
    let mut rows = Vec::new();
    for (name, scene, file) in files() {
        let all = errors(&scene, 1_000_000, 100_000);
        for (kind, errors) in NAMES.into_iter().zip(&all) {
            errors.print_cases(&format!("{name}, {kind}"), &file);
            rows.push(format!(
                "| {name}, {kind} | {} |",
                errors.tail(Figure::Contribution)
            ));
        }
        whole.iter_mut().zip(&all).for_each(|(w, a)| w.merge(a));
    }
    whole.iter_mut().for_each(Errors::sort);
    let heads: Vec<String> = QUANTILES
        .iter()
        .map(|q| format!("{} %", 100.0 * q))
        .collect();
    let heads = format!(
        "{} | most | above 1e-3 |\n|---|---|---|---|---|---|---|---|---|",
        heads.join(" | ")
    );
    println!("\n| all scenes | number | {heads}");
    for (figure, what) in FIGURES {
        for (kind, errors) in NAMES.into_iter().zip(&whole) {
            println!("| {what}: {kind} | {} |", errors.tail(figure));
        }
    }
    println!("\n| contribution, same vertices | number | {heads}");
    rows.iter().for_each(|row| println!("{row}"));
}

/// A light subpath that leaves a smooth surface along it: its shading cosine is 2e-5, which `f32`
/// has to 0.5 % only, and which the contribution does not depend on.
#[test]
fn shading_cosines_of_light_subpaths_cancel() {
    #[rustfmt::skip]
    let samples = [
        0.93830067, 0.24867639, 0.93135726, 0.3713879, 0.0252176, 0.35599014, 0.84293455,
        0.16341792, 0.7696406, 0.5689418, 0.50890124, 0.3647563, 0.27099153, 0.9428323,
        0.83895636, 0.968773, 0.22067596, 0.41639817, 0.5621471, 0.3292729, 0.21216708,
        0.12026163, 0.13963784, 0.48659468, 0.28553092, 0.6926863, 0.2628933, 0.07916844,
        0.60936546, 0.44787338, 0.42045027, 0.07848963, 0.6997314, 0.9893746, 0.75733656,
        0.7528815, 0.8200637, 0.17777741f32,
    ];
    let (_, scene) = scenes::all().swap_remove(3);
    let world = World::new(&scene, 5);
    let recorder = Recorder::new(&scene, &world);
    let plan = &world.plan.depths[5];
    let walk = recorder.walk(plan, &samples);
    let path = walk.path().expect("a path that carries light");
    let leaves = &walk.light.as_ref().expect("a light subpath").steps[3];
    let along = leaves.sampled.expect("not its endpoint").wi;
    let cos = dot(wide(along), leaves.vertex.ns);
    assert!(cos.abs() < 1e-4, "{cos}");
    let reference = recorder.reference(&path, &plan.strategies);
    let error = relative(contribution(&walk, 0), reference.value());
    assert!(error < 1e-4, "{error:e}");
}

/// Width, in radians, of the narrowest refracted lobe of a scene, at most 1: an error of a
/// direction is that much larger relative to it. The half vector of a refraction lies along `n_o wo
/// + n_i wi`, whose length is the distance of the indices where light goes straight on.
fn narrowest_lobe(scene: &Scene) -> f64 {
    let table = MaterialTable::new(scene);
    let rows = table.entries.iter().zip(&table.rows);
    rows.filter(|(entry, _)| entry.kind == Kind::RoughDielectric)
        .map(|(_, row)| {
            let TrowbridgeReitz { ax, ay } = TrowbridgeReitz::<f32>::of_packed(row.0[7]);
            f64::from(ax.min(ay) * (row.0[6] - 1.0).abs())
        })
        .fold(1.0, f64::min)
}

/// The study in small. A position is good to some ulps, so that a factor with a cosine `c` and a
/// distance `d` in it is good to some ulps over `c d`; paths with a small `c d` are as rare as it
/// is small. The error that one in `1 / p` paths exceeds should then be no more than an ulp over
/// `p` for every vertex, and over the width of the narrowest refracted lobe ([`narrowest_lobe`]):
/// no more paths lie above it than chance brings there. Beyond, what counts is that the figure
/// moves as much if the vertices do.
#[test]
fn single_precision_is_good_to_ulps_over_rarity() {
    for (name, scene, file) in files() {
        let ulps = f64::from(f32::EPSILON) * f64::from(MAX_DEPTH + 2) / narrowest_lobe(&scene);
        let all = errors(&scene, 50_000, 13_000);
        for (kind, errors) in NAMES.into_iter().zip(&all) {
            let name = format!("{name}, {kind}");
            errors.print_cases(&name, &file);
            for (figure, what) in FIGURES {
                println!("  {what}: {}", errors.tail(figure));
            }
            assert!(errors.unexplained.is_empty(), "{name}: see above");
            assert!(errors.tail(Figure::Contribution).len() > 150, "{name}");
        }
        let [random, hard] = all;
        // Samples that no sampler draws may ask for a direction within the surface, which f64 does
        // not follow.
        assert!(random.lost == 0 && hard.lost < hard.paths / 50, "{name}");
        for (figure, rarest) in [
            (Figure::Contribution, 0.99),
            (Figure::Weight, 0.999),
            (Figure::Density, 0.999),
            // Of lacquered scenes 3 million paths put the last at 1.10 times its bound, within
            // what chance may do to the paths here.
            (Figure::ContributionBySamples, 0.99),
            (Figure::WeightBySamples, 0.99),
        ] {
            for q in QUANTILES.into_iter().filter(|q| *q <= rarest) {
                let (tail, bound) = (random.tail(figure), ulps / (1.0 - q));
                let (error, what) = (tail.quantile(q), FIGURES[figure as usize].1);
                let chance = tail.chance(bound, 1.0 - q, random.paths);
                assert!(
                    chance > FALSE_ALARM,
                    "{name}: {what}, {q}: {error:e} > {bound:e}, by chance once in {:e}",
                    1.0 / chance
                );
            }
        }
        // Of random paths none is explained by less than it takes.
        let explained = random.tail(Figure::Conditioned);
        assert!(
            explained.quantile(0.999) < 0.5 && explained.quantile(1.0) < 1.0,
            "{name}"
        );
        assert!(
            hard.tail(Figure::Conditioned).quantile(0.99) < 1.0
                && hard.tail(Figure::Conditioned).quantile(1.0) < 2.0,
            "{name}"
        );
    }
}
