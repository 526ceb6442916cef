//! What effects cost: where they are used, and where they are not.
//!
//! One small room, as plain as can be (`none.pbrt`), and the same room with one effect more (the
//! other files here), or several. `planned` runs what the scene calls for; `forced` has every
//! effect turned on, so that the difference is what the plan saves. Throughput is mutations of
//! chains of one depth a second, on one thread at eight lanes. `instructions.sh` counts
//! instructions.
//!
//! `cargo bench --bench effects -- --table` measures all of them in turns instead, round by round,
//! so that a machine that changes its speed does so for all, and prints a table of medians.

#[path = "../common/mod.rs"]
mod common;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::chain::evaluator::Evaluator;
use phalanx::film::SplatFilm;
use phalanx::pbrt;
use phalanx::plan::Forced;
use phalanx::scene::Scene;
use phalanx::transport::World;
use std::path::Path;
use std::time::Instant;

const DEPTH: usize = 4;
/// Chains that march together, and batches that take turns.
const CHAINS: usize = 1024;
const BATCHES: usize = 4;
/// Iterations of a visit.
const STRIDE: u32 = 16;

fn compare(c: &mut Criterion, name: &str, scene: &Scene) {
    let mut group = c.benchmark_group(format!("effects/{name}"));
    group.throughput(Throughput::Elements(CHAINS as u64 * u64::from(STRIDE)));
    for (how, forced) in [("planned", &[][..]), ("forced", &[Forced::All])] {
        let world = World::with_forced(scene, DEPTH as u32, forced);
        let film = common::film(scene);
        let mut chains =
            Chains::new(Evaluator::EIGHT, &world, DEPTH, CHAINS, BATCHES).expect("the room is lit");
        group.bench_function(BenchmarkId::from_parameter(how), |b| {
            b.iter(|| chains.march(&world, &film, STRIDE));
        });
    }
    group.finish();
}

/// The scenes beside this file, `none` first.
fn scenes() -> Vec<(String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/effects");
    let files = std::fs::read_dir(&folder).expect("the folder of this bench");
    let mut names: Vec<String> = files
        .filter_map(|file| {
            let path = file.ok()?.path();
            let name = path.file_stem()?.to_str()?.to_owned();
            // What starts so is a part of others.
            (path.extension()? == "pbrt" && !name.starts_with("part-")).then_some(name)
        })
        .collect();
    names.sort_by_key(|name| (name != "none", name.clone()));
    let load = |name: String| {
        let scene = pbrt::load(&folder.join(format!("{name}.pbrt"))).expect("the scene loads");
        (name, scene)
    };
    names.into_iter().map(load).collect()
}

/// Rounds of the table; an odd number has a median.
const ROUNDS: usize = 41;

/// Chains in a scene, ready to march.
struct Runner<'a> {
    world: World<'a>,
    film: SplatFilm,
    chains: Chains,
}

impl<'a> Runner<'a> {
    fn new(scene: &'a Scene, forced: &[Forced]) -> Self {
        let world = World::with_forced(scene, DEPTH as u32, forced);
        let mut runner = Self {
            film: common::film(scene),
            chains: Chains::new(Evaluator::EIGHT, &world, DEPTH, CHAINS, BATCHES)
                .expect("the room is lit"),
            world,
        };
        runner.march();
        runner
    }

    /// Seconds that all batches take for a visit each.
    fn march(&mut self) -> f64 {
        let start = Instant::now();
        for _ in 0..BATCHES {
            (self.chains).march(&self.world, &self.film, STRIDE);
        }
        start.elapsed().as_secs_f64()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table() {
    let scenes = scenes();
    let mut runners: Vec<[Runner; 2]> = (scenes.iter())
        .map(|(_, scene)| [&[][..], &[Forced::All]].map(|forced| Runner::new(scene, forced)))
        .collect();
    // `[runner][planned, forced][round]`, seconds.
    let mut times = vec![[Vec::new(), Vec::new()]; runners.len()];
    for round in 0..ROUNDS {
        for (runners, times) in runners.iter_mut().zip(&mut times) {
            for turn in 0..2 {
                let which = (round + turn) % 2;
                times[which].push(runners[which].march());
            }
        }
    }
    let mutations = (CHAINS * BATCHES) as f64 * f64::from(STRIDE);
    println!(
        "| scene | M mutations/s | time over that of `none` | all effects forced over planned |"
    );
    println!("|---|---|---|---|");
    let ratios = |a: &[f64], b: &[f64]| median(a.iter().zip(b).map(|(a, b)| a / b).collect());
    for ((name, _), [planned, forced]) in scenes.iter().zip(&times) {
        println!(
            "| {name} | {:.2} | {:.2} | {:.2} |",
            mutations / median(planned.clone()) / 1e6,
            ratios(planned, &times[0][0]),
            ratios(forced, planned)
        );
    }
}

fn main() {
    if std::env::args().any(|a| a == "--table") {
        return table();
    }
    let mut c = common::criterion();
    for (name, scene) in scenes() {
        compare(&mut c, &name, &scene);
    }
    c.final_summary();
}
