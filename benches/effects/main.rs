//! What effects cost: where they are used, and where they are not.
//!
//! One small room, as plain as can be (`none.pbrt`), and the same room with one effect more (the other files here), or several. `planned` runs
//! what the scene calls for; `forced` has every effect turned on, so that the difference is what the plan saves. Throughput is mutations of
//! chains of one depth a second, on one thread at eight lanes. `instructions.sh` counts instructions.

#[path = "../common/mod.rs"]
mod common;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::plan::Forced;
use phalanx::scene::{self, Scene};
use phalanx::simd::f32x8;
use phalanx::transport::World;
use std::path::Path;

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
            Chains::new::<f32x8>(&world, DEPTH, CHAINS, BATCHES).expect("the room is lit");
        group.bench_function(BenchmarkId::from_parameter(how), |b| {
            b.iter(|| chains.march::<f32x8>(&world, &film, STRIDE));
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
        let scene = scene::load(&folder.join(format!("{name}.pbrt"))).expect("the scene loads");
        (name, scene)
    };
    names.into_iter().map(load).collect()
}

fn main() {
    let mut c = common::criterion();
    for (name, scene) in scenes() {
        compare(&mut c, &name, &scene);
    }
    c.final_summary();
}
