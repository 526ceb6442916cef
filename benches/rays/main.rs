//! Rays per second of every way to trace, by class of wave and size of scene.
//!
//! The question: which traversal should which wave take, and what does eight-wide SIMD gain over the scalar tracer? Melem/s
//! are millions of rays per second on one core.

mod scenes;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, Throughput, measurement::WallTime};
use phalanx::simd::{Lanes, Row, f32x8};
use phalanx::trace::{Coherence, Tracer};

use scenes::Wave;

fn bench_wave<L: Lanes>(
    group: &mut BenchmarkGroup<WallTime>,
    method: &str,
    coherence: Coherence,
    tracer: &Tracer,
    wave: &Wave,
) {
    let mut hits = vec![Row::default(); wave.rays.len()];
    let mut blocked = vec![0; wave.rays.len()];
    group.bench_function(format!("{}/{method}", wave.name), |b| {
        b.iter(|| {
            // Batches as the chains make them: one call per thousand rays.
            for list in black_box(&wave.list).chunks(1024) {
                if wave.shadow {
                    tracer.occluded_with::<L>(coherence, &wave.rays, list, &mut blocked);
                } else {
                    tracer.closest_with::<L>(coherence, &wave.rays, list, &mut hits);
                }
            }
        })
    });
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .configure_from_args();
    let details: &[usize] = if quick { &[8] } else { &[18, 76, 178] };
    for &detail in details {
        let scene = scenes::room(detail);
        let tracer = Tracer::build(&scene);
        println!("{:?}", tracer.stats());
        let side = if quick { 16 } else { 256 };
        let mut group = criterion.benchmark_group(format!("{}k", scene.triangles.len() / 1000));
        for wave in &scenes::waves(&scene, &tracer, side) {
            group.throughput(Throughput::Elements(wave.rays.len() as u64));
            let unknown = Coherence::Unknown;
            bench_wave::<f32>(&mut group, "scalar", unknown, &tracer, wave);
            bench_wave::<f32x8>(&mut group, "packets", Coherence::Coherent, &tracer, wave);
            bench_wave::<f32x8>(&mut group, "single", Coherence::Incoherent, &tracer, wave);
            bench_wave::<f32x8>(&mut group, "unknown", unknown, &tracer, wave);
        }
        group.finish();
    }
    criterion.final_summary();
}
