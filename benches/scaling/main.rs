//! How does the time of a mutation grow with depth, triangles, chains and threads?
//!
//! Each grows alone, the others fixed; throughput is mutations a second at eight lanes, on one
//! thread where threads do not grow. The largest scene, of five million triangles, is built only
//! with `PHALANX_BENCH_LARGE=1` in the environment.

#[path = "../common/mod.rs"]
mod common;
mod room;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::chain::evaluator::Evaluator;
use phalanx::transport::World;
use rayon::ThreadPoolBuilder;
use std::sync::Mutex;

/// Chains of a batch.
const BATCH: usize = 512;
/// Iterations of a visit.
const STRIDE: u32 = 16;
/// Of the chains, where depth does not grow.
const DEPTH: usize = 4;

/// Longer paths, in a closed room: none escapes, and nearly every mutation of depth `k` traces its
/// `k + 1` rays.
fn depth(c: &mut Criterion) {
    let scene = room::lit(4);
    let world = World::new(&scene, 64);
    let film = common::film(&scene);
    let mut group = c.benchmark_group("scaling/depth");
    for depth in [1, 2, 4, 8, 16, 32, 64] {
        let Some(mut chains) = Chains::new(Evaluator::EIGHT, &world, depth, BATCH, 1) else {
            println!("no bootstrap path of depth {depth} carries light");
            break;
        };
        group.throughput(Throughput::Elements(BATCH as u64));
        group.bench_function(BenchmarkId::from_parameter(depth), |b| {
            b.iter(|| chains.march(&world, &film, 1));
        });
    }
    group.finish();
}

/// Larger scenes: a closed room, meshed ever finer.
fn triangles(c: &mut Criterion) {
    let large = std::env::var_os("PHALANX_BENCH_LARGE").is_some_and(|v| v == "1");
    let details: &[usize] = match (common::quick(), large) {
        (true, _) => &[4, 12],
        (false, false) => &[4, 12, 40, 125],
        (false, true) => &[4, 12, 40, 125, 280],
    };
    let mut group = c.benchmark_group("scaling/triangles");
    for &detail in details {
        let scene = room::lit(detail);
        let world = World::new(&scene, DEPTH as u32);
        println!("{:?}", world.tracer.stats());
        let film = common::film(&scene);
        let mut chains =
            Chains::new(Evaluator::EIGHT, &world, DEPTH, BATCH, 1).expect("the room is lit");
        group.throughput(Throughput::Elements(BATCH as u64));
        group.bench_function(BenchmarkId::from_parameter(scene.triangles.len()), |b| {
            b.iter(|| chains.march(&world, &film, 1));
        });
    }
    group.finish();
}

/// More chains, in batches that take turns: the states of all of them leave the caches.
fn chains(c: &mut Criterion) {
    let scene = common::cornell();
    let world = World::new(&scene, DEPTH as u32);
    let film = common::film(&scene);
    let mut group = c.benchmark_group("scaling/chains");
    for count in [1_024, 10_240, 102_400] {
        let mut chains = Chains::new(Evaluator::EIGHT, &world, DEPTH, BATCH, count / BATCH)
            .expect("the box is lit");
        group.throughput(Throughput::Elements(BATCH as u64 * u64::from(STRIDE)));
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| chains.march(&world, &film, STRIDE));
        });
    }
    group.finish();
}

/// More threads, each with chains of its own, on one scene and one film.
fn threads(c: &mut Criterion) {
    // Long enough that waking threads does not count.
    const ITERATIONS: u32 = 64;
    let scene = common::cornell();
    let world = World::new(&scene, DEPTH as u32);
    let film = common::film(&scene);
    let mut group = c.benchmark_group("scaling/threads");
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("threads can be had");
        let own =
            || Chains::new(Evaluator::EIGHT, &world, DEPTH, BATCH, 1).expect("the box is lit");
        let chains: Vec<Mutex<Chains>> = (0..threads).map(|_| Mutex::new(own())).collect();
        let mutations = (threads * BATCH) as u64 * u64::from(ITERATIONS);
        group.throughput(Throughput::Elements(mutations));
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| {
                pool.broadcast(|context| {
                    let mut own = chains[context.index()].lock().expect("no thread panics");
                    own.march(&world, &film, ITERATIONS);
                })
            });
        });
    }
    group.finish();
}

fn main() {
    let mut c = common::criterion();
    depth(&mut c);
    triangles(&mut c);
    chains(&mut c);
    threads(&mut c);
    c.final_summary();
}
