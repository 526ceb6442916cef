//! What do eight lanes buy over one, for the whole step of a chain and for the stages that can be
//! run alone?
//!
//! Same kernels, same chains, same bits; throughput is mutations, paths or primary samples a second
//! on one thread. Rays alone are the question of `benches/rays`; splats, which have no lanes, of
//! `benches/film`.

mod common;

use common::Chains;
use criterion::{BenchmarkId, Criterion, Throughput};
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::ProposalDistribution;
use phalanx::film::SplatFilm;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, World};
use std::hint::black_box;

const CHAINS: usize = 512;
const DEPTHS: [usize; 3] = [1, 4, 8];

/// Marches one batch of chains of depth `depth`; a criterion iteration is one mutation of each.
fn step(
    evaluator: Evaluator,
    c: &mut Criterion,
    name: &str,
    world: &World,
    film: &SplatFilm,
    depth: usize,
) {
    let Some(mut chains) = Chains::new(evaluator, world, depth, CHAINS, 1) else {
        return;
    };
    let mut group = c.benchmark_group(format!("step/{name}/depth {depth}"));
    group.throughput(Throughput::Elements(CHAINS as u64));
    group.bench_function(BenchmarkId::new("lanes", evaluator.width.lanes()), |b| {
        b.iter(|| chains.march(world, film, 1));
    });
    group.finish();
}

/// Evaluates uniform paths, as the bootstrap does: everything between primary samples and
/// contributions.
fn evaluate(evaluator: Evaluator, c: &mut Criterion, name: &str, world: &World, depth: usize) {
    let plan = &world.plan.depths[depth];
    let indices: Vec<u64> = (0..CHAINS as u64).collect();
    let samples = evaluator.regenerate(plan, 1, &indices);
    let mut paths = Paths::new(world);
    let mut group = c.benchmark_group(format!("evaluate/{name}/depth {depth}"));
    group.throughput(Throughput::Elements(CHAINS as u64));
    group.bench_function(BenchmarkId::new("lanes", evaluator.width.lanes()), |b| {
        b.iter(|| evaluator.multiplexed(world, plan, black_box(&samples), CHAINS, &mut paths));
    });
    group.finish();
}

/// Proposals alone: random numbers and Gaussian steps.
fn propose(evaluator: Evaluator, c: &mut Criterion, world: &World) {
    let plan = world.plan.depths.last().expect("a plan has depths");
    let seeds: Vec<u64> = (0..CHAINS as u64).collect();
    let ids: Vec<u32> = (0..CHAINS as u32).collect();
    let current = evaluator.regenerate(plan, 1, &seeds);
    let mut proposed = Samples::new(plan.layout.total, CHAINS);
    let proposals = ProposalDistribution::new(1, 0.3, 0.01);
    let (mut large, mut decide) = (vec![0.0; CHAINS], vec![0.0; CHAINS]);
    let mut group = c.benchmark_group("propose");
    group.throughput(Throughput::Elements((CHAINS * plan.layout.total) as u64));
    group.bench_function(BenchmarkId::new("lanes", evaluator.width.lanes()), |b| {
        let mut iteration = 0;
        b.iter(|| {
            iteration += 1;
            evaluator.propose(
                &proposals,
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

/// Uniform primary samples alone, as the bootstrap draws them: random numbers and additive
/// recurrences.
fn draw(evaluator: Evaluator, c: &mut Criterion, world: &World) {
    let plan = world.plan.depths.last().expect("a plan has depths");
    let indices: Vec<u64> = (0..CHAINS as u64).collect();
    let mut group = c.benchmark_group("draw");
    group.throughput(Throughput::Elements((CHAINS * plan.layout.total) as u64));
    group.bench_function(BenchmarkId::new("lanes", evaluator.width.lanes()), |b| {
        b.iter(|| evaluator.regenerate(plan, 1, black_box(&indices)));
    });
    group.finish();
}

fn main() {
    let mut c = common::criterion();
    for (name, scene) in &common::scenes() {
        let world = World::new(scene, DEPTHS[2] as u32);
        let film = common::film(scene);
        for depth in DEPTHS {
            step(Evaluator::ONE, &mut c, name, &world, &film, depth);
            step(Evaluator::EIGHT, &mut c, name, &world, &film, depth);
            evaluate(Evaluator::ONE, &mut c, name, &world, depth);
            evaluate(Evaluator::EIGHT, &mut c, name, &world, depth);
        }
    }
    let scene = common::cornell();
    let world = World::new(&scene, DEPTHS[2] as u32);
    propose(Evaluator::ONE, &mut c, &world);
    propose(Evaluator::EIGHT, &mut c, &world);
    draw(Evaluator::ONE, &mut c, &world);
    draw(Evaluator::EIGHT, &mut c, &world);
    c.final_summary();
}
