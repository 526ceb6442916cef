//! What do eight lanes buy over one, for the whole step of a chain and for the stages that can be run alone?
//!
//! Same kernels, same chains, same bits; throughput is mutations, paths or primary samples a second on one thread. Rays alone are
//! the question of `benches/rays`; splats, which have no lanes, of `benches/film`.

mod common;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::chain::mutate::Kernel;
use phalanx::chain::primary::regenerate;
use phalanx::film::SplatFilm;
use phalanx::simd::{Lanes, f32x8};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, World};
use std::hint::black_box;

const CHAINS: usize = 512;
const DEPTHS: [usize; 3] = [1, 4, 8];

/// Marches one batch of chains of depth `depth`; a criterion iteration is one mutation of each.
fn step<L: Lanes>(c: &mut Criterion, name: &str, world: &World, film: &SplatFilm, depth: usize) {
    let Some(mut chains) = Chains::new::<L>(world, depth, CHAINS, 1) else {
        return;
    };
    let mut group = c.benchmark_group(format!("step/{name}/depth {depth}"));
    group.throughput(Throughput::Elements(CHAINS as u64));
    group.bench_function(BenchmarkId::new("lanes", L::N), |b| {
        b.iter(|| chains.march::<L>(world, film, 1));
    });
    group.finish();
}

/// Evaluates uniform paths, as the bootstrap does: everything between primary samples and contributions.
fn evaluate<L: Lanes>(c: &mut Criterion, name: &str, world: &World, depth: usize) {
    let plan = &world.plan.depths[depth];
    let indices: Vec<u64> = (0..CHAINS as u64).collect();
    let samples = regenerate::<L>(plan, 1, &indices);
    let mut paths = Paths::new(world);
    let mut group = c.benchmark_group(format!("evaluate/{name}/depth {depth}"));
    group.throughput(Throughput::Elements(CHAINS as u64));
    group.bench_function(BenchmarkId::new("lanes", L::N), |b| {
        b.iter(|| world.evaluate_multiplexed::<L>(plan, black_box(&samples), CHAINS, &mut paths));
    });
    group.finish();
}

/// Proposals alone: random numbers and Gaussian steps.
fn propose<L: Lanes>(c: &mut Criterion, world: &World) {
    let plan = world.plan.depths.last().expect("a plan has depths");
    let seeds: Vec<u64> = (0..CHAINS as u64).collect();
    let ids: Vec<u32> = (0..CHAINS as u32).collect();
    let current = regenerate::<L>(plan, 1, &seeds);
    let mut proposed = Samples::new(plan.layout.total, CHAINS);
    let kernel = Kernel::new(1, 0.3, 0.01);
    let (mut large, mut decide) = (vec![0.0; CHAINS], vec![0.0; CHAINS]);
    let mut group = c.benchmark_group("propose");
    group.throughput(Throughput::Elements((CHAINS * plan.layout.total) as u64));
    group.bench_function(BenchmarkId::new("lanes", L::N), |b| {
        let mut iteration = 0;
        b.iter(|| {
            iteration += 1;
            kernel.propose::<L>(
                &ids,
                iteration,
                &current,
                &mut proposed,
                &mut large,
                &mut decide,
            );
            black_box(&proposed);
        });
    });
    group.finish();
}

/// Uniform primary samples alone, as the bootstrap draws them: random numbers and additive recurrences.
fn draw<L: Lanes>(c: &mut Criterion, world: &World) {
    let plan = world.plan.depths.last().expect("a plan has depths");
    let indices: Vec<u64> = (0..CHAINS as u64).collect();
    let mut group = c.benchmark_group("draw");
    group.throughput(Throughput::Elements((CHAINS * plan.layout.total) as u64));
    group.bench_function(BenchmarkId::new("lanes", L::N), |b| {
        b.iter(|| regenerate::<L>(plan, 1, black_box(&indices)));
    });
    group.finish();
}

fn main() {
    let mut c = common::criterion();
    for (name, scene) in &common::scenes() {
        let world = World::new(scene, DEPTHS[2] as u32);
        let film = common::film(scene);
        for depth in DEPTHS {
            step::<f32>(&mut c, name, &world, &film, depth);
            step::<f32x8>(&mut c, name, &world, &film, depth);
            evaluate::<f32>(&mut c, name, &world, depth);
            evaluate::<f32x8>(&mut c, name, &world, depth);
        }
    }
    let scene = common::cornell();
    let world = World::new(&scene, DEPTHS[2] as u32);
    propose::<f32>(&mut c, &world);
    propose::<f32x8>(&mut c, &world);
    draw::<f32>(&mut c, &world);
    draw::<f32x8>(&mut c, &world);
    c.final_summary();
}
