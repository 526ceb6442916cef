//! What do eight lanes buy over one, for the whole step of a chain and for the stages that can be run alone?
//!
//! Same kernels, same chains, same bits; throughput is mutations (or primary samples) a second on one thread.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use phalanx::chain::batch::{Batch, Workspace};
use phalanx::chain::bootstrap::{Bootstrap, regenerate};
use phalanx::chain::mutate::Kernel;
use phalanx::film::{FilterTable, SplatFilm};
use phalanx::scene::{self, Scene};
use phalanx::simd::{Lanes, f32x8};
use phalanx::transport::World;
use phalanx::transport::samples::Samples;
use std::hint::black_box;
use std::path::Path;

const CHAINS: usize = 512;

fn default_scene() -> Scene {
    let text = include_str!("../scenes/cornell.pbrt");
    scene::load_str(text, "cornell.pbrt", Path::new(".")).expect("the default scene loads")
}

/// Marches one batch of chains of depth `depth`; a criterion iteration is one mutation of each.
fn step<L: Lanes>(c: &mut Criterion, scene: &Scene, world: &World, depth: usize) {
    let plan = &world.plan.depths[depth];
    let bootstrap = Bootstrap::run::<L>(world, plan, 1, 20_000, &|| false);
    let seeds = bootstrap.seeds(1, depth as u32, CHAINS);
    let mut workspace = Workspace::new(world);
    let mut batch = Batch::new::<L>(world, depth, 0, &seeds, 1, &mut workspace.paths);
    let kernel = Kernel::new(1, 0.3, 0.01);
    let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
    let film = SplatFilm::new(filter, 1, 1e12);
    let mut group = c.benchmark_group(format!("step/depth {depth}"));
    group.throughput(Throughput::Elements(CHAINS as u64));
    group.bench_function(BenchmarkId::new("lanes", L::N), |b| {
        b.iter(|| batch.march::<L>(world, &kernel, 1, &mut workspace, &film, 0, 1.0));
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

fn lanes(c: &mut Criterion) {
    let scene = default_scene();
    let world = World::new(&scene, 8);
    for depth in [1, 4, 8] {
        step::<f32>(c, &scene, &world, depth);
        step::<f32x8>(c, &scene, &world, depth);
    }
    propose::<f32>(c, &world);
    propose::<f32x8>(c, &world);
}

criterion_group!(benches, lanes);
criterion_main!(benches);
