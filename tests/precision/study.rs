//! How far `f32` is from `f64`: contributions, sampled densities and MIS weights of random and of hard paths.

use super::adversary;
use super::common::scenes;
use super::common::stats::Random;
use super::tail::Tail;
use phalanx::plan::DepthPlan;
use phalanx::replay::compare::{contribution, densities, relative};
use phalanx::replay::{Fate, Path, Recorder, Reference, Walk};
use phalanx::scene::Scene;
use phalanx::transport::World;
use phalanx::transport::paths::Side;

/// Scattering events of the longest paths.
const MAX_DEPTH: u32 = 5;
/// Errors that must be explained.
const LARGE: f64 = 1e-3;
/// One path in so many is shaken, however well it does.
const CONDITIONED: usize = 10;
/// Weights below it are beyond what the running sums tell apart (they saturate at 1e18).
const SATURATED: f64 = 1e-16;
/// Contributions below it have lost digits as they neared the smallest `f32`.
const TINY: f64 = 1e-34;

/// Errors of a set of paths of a scene.
#[derive(Default)]
struct Errors {
    /// Against `f64` from the same vertices.
    contribution: Tail,
    weight: Tail,
    /// Each sampled density, forwards and in reverse.
    density: Tail,
    /// Against `f64` from the same primary samples.
    whole_contribution: Tail,
    whole_weight: Tail,
    /// Errors of contributions over what rounding of the operations and of the vertices allows, of some paths.
    conditioned: Tail,
    /// Paths that could not be followed in `f64`.
    lost: usize,
    paths: usize,
    worst: Vec<Case>,
    unexplained: Vec<Case>,
    /// Large errors of contributions or weights that conditioning explains, and that saturation or underflow does.
    ill: usize,
    out_of_range: usize,
}

/// A path worth a look.
#[derive(Clone)]
struct Case {
    error: f64,
    what: &'static str,
    depth: u32,
    strategy: (u32, u32),
    samples: Vec<f32>,
    figures: [f64; 3],
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let list: Vec<String> = self.samples.iter().map(f32::to_string).collect();
        let (s, t) = self.strategy;
        let [single, double, moved] = self.figures;
        write!(
            f,
            "{:.1e} {} (s, t) = ({s}, {t}): {single:e} is {double:e} +- {moved:.1e}\n    --depth {} --samples {}",
            self.error,
            self.what,
            self.depth,
            list.join(",")
        )
    }
}

impl Errors {
    fn look(&mut self, recorder: &Recorder, plan: &DepthPlan, samples: &[f32]) {
        let walk = recorder.walk(plan, samples);
        if walk.fate != Fate::Whole {
            return;
        }
        let strategies = &plan.strategies;
        let exact = recorder.retrace(plan, samples, &walk);
        self.lost += usize::from(exact.is_none());
        for (i, path) in walk.paths().enumerate() {
            let reference = recorder.reference(&path, strategies);
            let double = [reference.value(), reference.weight(path.s)];
            let single = [contribution(&walk, i), f64::from(walk.meetings[i].weight)];
            if single[0] == 0.0 && double[0] == 0.0 {
                continue;
            }
            let errors = [0, 1].map(|c| relative(single[c], double[c]));
            self.contribution.add(errors[0]);
            self.weight.add(errors[1]);
            self.paths += 1;
            if self.paths % CONDITIONED == 0 && double[0] > TINY {
                let moved = recorder.sensitivity_to(&path, strategies, 2, &reference, 8, 1.0);
                let reach = roundings(plan) * double[0] + moved.value;
                self.conditioned.add((single[0] - double[0]).abs() / reach);
            }
            self.look_at_densities(recorder, plan, &walk, &path, &reference, samples);
            if let Some(path) = exact.as_ref().and_then(|e| e.get(i)) {
                let exact = recorder.reference(path, strategies);
                self.whole_contribution
                    .add(relative(single[0], exact.value()));
                self.whole_weight
                    .add(relative(single[1], exact.weight(path.s)));
            }
            for (c, what) in [(0, "contribution"), (1, "weight")] {
                let mut case = Case {
                    error: errors[c],
                    what,
                    depth: plan.depth,
                    strategy: (walk.s, walk.t),
                    samples: samples.to_vec(),
                    figures: [single[c], double[c], 0.0],
                };
                let worst = self.worst.last().map_or(0.0, |c| c.error);
                if errors[c] > worst || self.worst.len() < 3 {
                    self.worst.push(case.clone());
                    self.worst.sort_by(|a, b| b.error.total_cmp(&a.error));
                    self.worst.truncate(3);
                }
                if errors[c] <= LARGE {
                    continue;
                }
                let explained = explained(plan, |pairs, factor| {
                    let moved =
                        recorder.sensitivity_to(&path, strategies, 1, &reference, pairs, factor);
                    case.figures[2] = [moved.value, moved.weight][c];
                    ((single[c] - double[c]).abs(), double[c], case.figures[2])
                });
                if explained {
                    self.ill += 1;
                } else if double[1] < SATURATED || double[0] < TINY {
                    self.out_of_range += 1;
                } else {
                    self.unexplained.push(case);
                }
            }
        }
    }

    fn look_at_densities(
        &mut self,
        recorder: &Recorder,
        plan: &DepthPlan,
        walk: &Walk,
        path: &Path,
        reference: &Reference,
        samples: &[f32],
    ) {
        for d in densities(walk, reference) {
            for c in 0..2 {
                let (single, double) = (f64::from(d.single[c]), d.double[c]);
                let error = relative(single, double);
                self.density.add(error);
                if error <= LARGE {
                    continue;
                }
                let mut moved = 0.0;
                // Forth from the camera is back from the light.
                let way = if d.side == Side::Camera { c } else { 1 - c };
                let explained = explained(plan, |pairs, factor| {
                    let all = recorder.sensitivity_to(
                        path,
                        &plan.strategies,
                        1,
                        reference,
                        pairs,
                        factor,
                    );
                    // Of a delta lobe only the ratio varies, which is kept as the way back.
                    let [forth, back] = all.densities[d.joint];
                    moved = if path.surface[d.joint].kind.is_delta() {
                        back
                    } else {
                        [forth, back][way]
                    };
                    (error, 1.0, moved)
                });
                if explained {
                    self.ill += 1;
                    continue;
                }
                self.unexplained.push(Case {
                    error,
                    what: "density",
                    depth: plan.depth,
                    strategy: (walk.s, walk.t),
                    samples: samples.to_vec(),
                    figures: [single, double, moved * double],
                });
            }
        }
    }

    fn sort(&mut self) {
        for tail in [
            &mut self.contribution,
            &mut self.weight,
            &mut self.density,
            &mut self.whole_contribution,
            &mut self.whole_weight,
            &mut self.conditioned,
        ] {
            tail.sort();
        }
    }
}

/// What the roundings of a path's formulas may add up to, relative: an ulp of each of the some ten factors that a vertex brings.
fn roundings(plan: &DepthPlan) -> f64 {
    10.0 * f64::from(f32::EPSILON) * f64::from(plan.depth + 2)
}

/// Whether rounding of the vertices explains an error: `moved` gives the error, the figure that it is of, and how far that moves, for so
/// many pairs of movements and a factor. More movements, and further ones, if a few have found nothing.
fn explained(plan: &DepthPlan, mut moved: impl FnMut(usize, f64) -> (f64, f64, f64)) -> bool {
    [(3, 1.0), (30, 1.0)].into_iter().any(|(pairs, factor)| {
        let (error, figure, moved) = moved(pairs, factor);
        error <= 4e-6 * f64::from(plan.depth + 2) * figure + moved
    })
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

fn print(name: &str, errors: &Errors) {
    for (what, tail) in [
        ("contribution, same vertices", &errors.contribution),
        ("MIS weight, same vertices", &errors.weight),
        ("sampled densities, same vertices", &errors.density),
        ("contribution, same samples", &errors.whole_contribution),
        ("MIS weight, same samples", &errors.whole_weight),
        ("contribution, over its conditioning", &errors.conditioned),
    ] {
        println!("| {name} | {what} | {tail} |");
    }
    println!(
        "{name}: large errors: {} ill-conditioned, {} out of range, {} unexplained; {} not followed in f64",
        errors.ill,
        errors.out_of_range,
        errors.unexplained.len(),
        errors.lost
    );
    for case in errors.worst.iter() {
        println!("  worst {case}");
    }
    for case in errors.unexplained.iter().take(10) {
        println!("  UNEXPLAINED {case}");
    }
}

#[test]
#[ignore = "minutes: the study of PERF.md"]
fn study() {
    let count = |name: &str, default: usize| {
        std::env::var(name).map_or(default, |v| v.parse().expect("a number"))
    };
    let random = count("PATHS", 1_000_000);
    let hard = count("HARD", 100_000);
    for (name, scene) in scenes::all() {
        let [random, hard] = errors(&scene, random, hard);
        print(&format!("{name}; random"), &random);
        print(&format!("{name}; hard"), &hard);
    }
}
