//! How many chains should march together?
//!
//! Few leave queues of rare materials and strategies with part-filled lanes; many leave the caches.
//! As in a render, several batches take turns of sixteen iterations each, so that each finds the
//! caches as the others left them. Throughput is mutations a second on one thread at eight lanes.

mod common;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::chain::evaluator::Evaluator;
use phalanx::film::SplatFilm;
use phalanx::transport::World;

const SIZES: [usize; 7] = [64, 128, 256, 512, 1024, 2048, 4096];
const DEPTHS: [usize; 2] = [2, 6];
/// Chains in all: the same for all sizes, so that only the grouping differs.
const CHAINS: usize = 8192;
/// Iterations of a visit.
const STRIDE: u32 = 16;

fn sizes(c: &mut Criterion, name: &str, world: &World, film: &SplatFilm, depth: usize) {
    let all = if common::quick() { SIZES[6] } else { CHAINS };
    let mut group = c.benchmark_group(format!("batch/{name}/depth {depth}"));
    for size in SIZES {
        let Some(mut chains) = Chains::new(Evaluator::EIGHT, world, depth, size, all / size) else {
            break;
        };
        group.throughput(Throughput::Elements(size as u64 * u64::from(STRIDE)));
        group.bench_function(BenchmarkId::new("chains", size), |b| {
            b.iter(|| chains.march(world, film, STRIDE));
        });
    }
    group.finish();
}

fn main() {
    let mut c = common::criterion();
    for (name, scene) in &common::scenes() {
        let world = World::new(scene, DEPTHS[1] as u32);
        let film = common::film(scene);
        for depth in DEPTHS {
            sizes(&mut c, name, &world, &film, depth);
        }
    }
    c.final_summary();
}
