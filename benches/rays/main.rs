//! Rays per second of every way to trace, by class of wave and size of scene.
//!
//! The question: which traversal should which wave take, and what does eight-wide SIMD gain over
//! the scalar tracer? Melem/s are millions of rays per second on one core.

mod scenes;

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, Throughput, measurement::WallTime};
use phalanx::chain::evaluator::Evaluator;
use phalanx::scene::Scene;
use phalanx::trace::{Coherence, Hit, Tracer};

use scenes::Wave;

fn bench_wave(
    evaluator: Evaluator,
    group: &mut BenchmarkGroup<WallTime>,
    method: &str,
    coherence: Coherence,
    tracer: &Tracer,
    wave: &Wave,
) {
    let mut hits = vec![Hit::default(); wave.rays.len()];
    let mut blocked = vec![0; wave.rays.len()];
    group.bench_function(format!("{}/{method}", wave.name), |b| {
        b.iter(|| {
            // Batches as the chains make them: one call per thousand rays.
            for list in black_box(&wave.list).chunks(1024) {
                if wave.shadow {
                    evaluator.shadow(tracer, coherence, &wave.rays, list, &mut blocked);
                } else {
                    evaluator.trace(tracer, coherence, &wave.rays, list, &mut hits);
                }
            }
        })
    });
}

/// Of a scene, by its number of triangles.
fn name(scene: &Scene) -> String {
    match scene.triangles.len() {
        few @ 0..1000 => few.to_string(),
        many => format!("{}k", many / 1000),
    }
}

/// Writes triangles and rays for `benches/embree`, which says how.
fn dump(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for detail in DETAILS {
        let scene = scenes::room(detail);
        let name = name(&scene);
        let vertices: Vec<[f32; 3]> = scene.vertices.iter().map(|v| v.p).collect();
        std::fs::write(
            folder.join(format!("{name}.triangles")),
            bytemuck::cast_slice(&vertices),
        )?;
        for mut wave in scenes::waves(&scene, &Tracer::build(&scene), SIDE) {
            wave.rays
                .iter_mut()
                .for_each(|r| r.free = [f32::from(u8::from(wave.shadow))]);
            let file = format!("{name}.{}.rays", wave.name.replace(' ', "-"));
            std::fs::write(folder.join(file), bytemuck::cast_slice(&wave.rays))?;
        }
    }
    Ok(())
}

/// Rings of a sphere, for 36, 20 thousand, 370 thousand and 2 million triangles.
const DETAILS: [usize; 4] = [0, 18, 76, 178];
/// Rays of a wave are its square.
const SIDE: usize = 512;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|a| a == "--dump") {
        let folder = arguments.get(at + 1).expect("--dump needs a folder");
        dump(Path::new(folder)).expect("the rays can be written");
        return;
    }
    let quick = arguments.iter().any(|a| a == "--test");
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .configure_from_args();
    let details: &[usize] = if quick { &[0, 8] } else { &DETAILS };
    for &detail in details {
        let scene = scenes::room(detail);
        let tracer = Tracer::build(&scene);
        println!("{:?}", tracer.stats());
        let side = if quick { 16 } else { SIDE };
        let mut group = criterion.benchmark_group(name(&scene));
        for wave in &scenes::waves(&scene, &tracer, side) {
            group.throughput(Throughput::Elements(wave.rays.len() as u64));
            let unknown = Coherence::Unknown;
            let [one, eight] = Evaluator::BOTH;
            bench_wave(one, &mut group, "scalar", unknown, &tracer, wave);
            bench_wave(
                eight,
                &mut group,
                "packets",
                Coherence::Coherent,
                &tracer,
                wave,
            );
            bench_wave(
                eight,
                &mut group,
                "single",
                Coherence::Incoherent,
                &tracer,
                wave,
            );
            bench_wave(eight, &mut group, "unknown", unknown, &tracer, wave);
        }
        group.finish();
    }
    criterion.final_summary();
}
