//! What do robust numerics cost, and what do they save?
//!
//! Cheaper choices stand in for those that Phalanx makes, by the traits that kernels are written
//! over: another triangle test ([`TriangleTest`](phalanx::trace::TriangleTest)), lanes with other
//! polynomials and random numbers ([`Numerics`](phalanx::simd::Numerics)), and a plain film beside
//! the exact one. One thread, eight lanes.
//!
//! `cargo bench --bench robust -- --table` measures robust and cheap in turns, round by round, and
//! prints ratios of the rounds. What robustness saves is checked whenever the bench starts:
//! single-precision sums stop, and the cheap triangle test leaks.

#[path = "../common/mod.rs"]
mod common;
mod film;
mod lanes;
#[path = "../rays/scenes.rs"]
mod rooms;
#[path = "../common/splats.rs"]
mod splats;
mod triangles;

use common::{Chains, WHOLE};
use criterion::{BenchmarkId, Throughput};
use film::{Plain, Word};
use glam::Vec2;
use lanes::{CHEAP_MATH, CHEAP_RANDOM, Cheap};
use phalanx::chain::evaluator::Evaluator;
use phalanx::film::{FilterTable, SplatFilm, SplatLog};
use phalanx::pbrt;
use phalanx::scene::{Filter, FilterKind, Scene};
use phalanx::simd::f32x8;
use phalanx::trace::{Coherence, Hit, Ray, Tracer, TriangleTest, Watertight};
use phalanx::transport::World;
use rooms::Wave;
use splats::{Splat, splats};
use std::hint::black_box;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Instant;
use triangles::Fast;

const DEPTH: usize = 4;
const CHAINS: usize = 512;
/// Iterations of a visit.
const STRIDE: u32 = 16;
/// Splats of a log, as in a render.
const LOG: usize = 8192;
/// Side of the films.
const SIDE: u32 = 512;
/// Rounds of the table; an odd number has a median.
const ROUNDS: usize = 41;

/// A robust choice and a cheap one.
struct Pair<'a> {
    name: String,
    robust: Box<dyn FnMut() + 'a>,
    cheap: Box<dyn FnMut() + 'a>,
    /// Mutations, rays or splats of a call.
    elements: u64,
}

fn trace<T: TriangleTest>(tracer: &Tracer, wave: &Wave) {
    let mut hits = vec![Hit::default(); wave.rays.len()];
    let mut blocked = vec![0; wave.rays.len()];
    for list in black_box(&wave.list).chunks(1024) {
        if wave.shadow {
            tracer.occluded_by::<f32x8, T>(Coherence::Unknown, &wave.rays, list, &mut blocked);
        } else {
            tracer.closest_by::<f32x8, T>(Coherence::Unknown, &wave.rays, list, &mut hits);
        }
    }
    black_box((hits, blocked));
}

fn tracing<'a>(pairs: &mut Vec<Pair<'a>>, rooms: &'a [(usize, Tracer, Vec<Wave>)]) {
    for (triangles, tracer, waves) in rooms {
        let chosen = ["camera tiles", "bounce sorted", "shadow sorted"];
        for wave in waves.iter().filter(|w| chosen.contains(&w.name)) {
            pairs.push(Pair {
                name: format!("triangle test, {triangles} triangles, {}", wave.name),
                robust: Box::new(|| trace::<Watertight>(tracer, wave)),
                cheap: Box::new(|| trace::<Fast>(tracer, wave)),
                elements: wave.rays.len() as u64,
            });
        }
    }
}

/// Chains of a scene that march with what is cheap switched on or off before each visit.
fn marching<'a>(pairs: &mut Vec<Pair<'a>>, scenes: &'a [(&'static str, Scene)]) {
    for (name, scene) in scenes {
        for (what, switch) in [
            ("polynomials", &CHEAP_MATH),
            ("random numbers", &CHEAP_RANDOM),
        ] {
            let side = |cheap: bool| {
                let world = World::new(scene, DEPTH as u32);
                let film = common::film(scene);
                let mut chains = Chains::new(Evaluator::EIGHT, &world, DEPTH, CHAINS, 1)
                    .expect("the scene is lit");
                Box::new(move || {
                    switch.store(cheap, Relaxed);
                    chains.march_by::<Cheap>(&world, &film, STRIDE);
                    switch.store(false, Relaxed);
                })
            };
            pairs.push(Pair {
                name: format!("{what}, {name}"),
                robust: side(false),
                cheap: side(true),
                elements: CHAINS as u64 * u64::from(STRIDE),
            });
        }
    }
}

fn filters() -> [(&'static str, FilterTable); 2] {
    let kinds = [
        ("box", 0.5, FilterKind::Box),
        ("gaussian", 2.0, FilterKind::Gaussian { alpha: 2.0 }),
    ];
    kinds.map(|(name, radius, kind)| {
        let radius = Vec2::splat(radius);
        (
            name,
            FilterTable::new(&Filter { radius, kind }, [0, SIDE, 0, SIDE]),
        )
    })
}

fn exact_film<'a>(filter: FilterTable, splats: &'a [Splat]) -> impl FnMut() + 'a {
    let film = SplatFilm::new(filter, 1, 1e15);
    let mut log = SplatLog::default();
    log.reserve(LOG);
    let mut logs = splats.chunks_exact(LOG).cycle();
    move || {
        for &(colour, raster) in logs.next().into_iter().flatten() {
            log.push(colour, raster, 1);
        }
        film.add(WHOLE, &mut log);
    }
}

fn plain_film<'a, W: Word + 'a>(filter: FilterTable, splats: &'a [Splat]) -> impl FnMut() + 'a {
    let mut film = Plain::<W>::new(filter);
    let mut logs = splats.chunks_exact(LOG).cycle();
    move || {
        if let Some(splats) = logs.next() {
            film.add(splats, 1.0);
        }
    }
}

fn filming<'a>(pairs: &mut Vec<Pair<'a>>, splats: &'a [Splat]) {
    for i in 0..2 {
        let filter = || filters().into_iter().nth(i).expect("two filters");
        let pair = |word: &str, cheap: Box<dyn FnMut() + 'a>| Pair {
            name: format!("film of {word}, {}", filter().0),
            robust: Box::new(exact_film(filter().1, splats)),
            cheap,
            elements: LOG as u64,
        };
        pairs.push(pair("f64", Box::new(plain_film::<f64>(filter().1, splats))));
        pairs.push(pair("f32", Box::new(plain_film::<f32>(filter().1, splats))));
    }
}

/// Sums of single precision stop at 2^24 splats of one pixel; exact ones do not.
fn sums_stop() {
    let pixel = || {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        FilterTable::new(&filter, [0, 1, 0, 1])
    };
    const FULL: u64 = 1 << 24;
    let exact = SplatFilm::new(pixel(), 1, 2.0 * FULL as f64);
    let (mut single, mut double) = (Plain::<f32>::new(pixel()), Plain::<f64>::new(pixel()));
    let mut log = SplatLog::default();
    log.reserve(LOG);
    // One splat as heavy as 2^24, and then a thousand light ones.
    for (weight, count) in [(FULL, 1), (1, 1000)] {
        for _ in 0..count {
            log.push([1.0; 3], [0.5; 2], weight);
        }
        exact.add(WHOLE, &mut log);
        let splats = vec![([1.0; 3], [0.5; 2]); count];
        single.add(&splats, weight as f64);
        double.add(&splats, weight as f64);
    }
    let all = FULL as f32 + 1000.0;
    assert_eq!(exact.resolve(&[1.0])[0], [all; 3]);
    assert_eq!(double.sums, [f64::from(all); 3]);
    assert_eq!(single.sums, [FULL as f32; 3]);
}

/// A closed cushion, an octahedron subdivided, around the origin.
const CLOSED: &str = "Camera \"perspective\"\nWorldBegin\nLightSource \"point\" \"rgb I\" [1 1 1]\n\
    Shape \"loopsubdiv\" \"integer nlevels\" 4 \"integer indices\" \
    [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5] \"point P\" \
    [1.1 0.01 0.02  -1.2 0.03 0  0.02 1.3 0.01  0.03 -1.1 0.02  0.01 0.02 1.2  0 0.03 -1.3]\nWorldEnd\n";

/// Rays from within the cushion through the edges of its triangles, as far inwards as said.
fn from_within(scene: &Scene, inwards: f32) -> Vec<Ray> {
    let origin = [0.013f32, 0.027, -0.011];
    let mut rays = Vec::new();
    for triangle in &scene.triangles {
        let [a, b, c] = triangle.v.map(|v| scene.vertices[v as usize].p);
        for i in 0..16 {
            let w = (i as f32 + 0.5) / 16.0;
            let edge = [0, 1, 2].map(|k| (1.0 - w) * a[k] + w * b[k]);
            let d = [0, 1, 2].map(|k| edge[k] + inwards * (c[k] - edge[k]) - origin[k]);
            rays.push(Ray::endless(origin, d));
        }
    }
    rays
}

/// Rays that nothing stops: those that look for a hit, and those that ask whether there is one.
fn escapes<T: TriangleTest>(tracer: &Tracer, rays: &[Ray]) -> [usize; 2] {
    let list: Vec<u32> = (0..rays.len() as u32).collect();
    let mut all = [0; 2];
    for coherence in [Coherence::Coherent, Coherence::Incoherent] {
        let mut hits = vec![Hit::default(); rays.len()];
        let mut blocked = vec![0; rays.len()];
        tracer.closest_by::<f32x8, T>(coherence, rays, &list, &mut hits);
        tracer.occluded_by::<f32x8, T>(coherence, rays, &list, &mut blocked);
        all[0] += hits.iter().filter(|h| h.is_none()).count();
        all[1] += blocked.iter().filter(|b| **b == 0).count();
    }
    all
}

/// The cheap triangle test lets rays through the edges of a closed mesh; the watertight one does
/// not.
fn triangles_leak() {
    let scene = pbrt::load_str(CLOSED, "closed.pbrt", "".as_ref()).expect("the cushion loads");
    let tracer = Tracer::build(&scene);
    let edges = from_within(&scene, 0.0);
    assert_eq!(escapes::<Watertight>(&tracer, &edges), [0, 0]);
    let [closest, any] = escapes::<Fast>(&tracer, &edges);
    // Chance alone would let a quarter slip through.
    assert!(closest > 0 && any > 0);
    assert!(2 * closest.max(any) < edges.len(), "{closest} {any}");
    // What is away from all edges is hit.
    assert_eq!(escapes::<Fast>(&tracer, &from_within(&scene, 0.4)), [0, 0]);
    println!(
        "of {} rays through edges, {closest} and {any} escape the cheap test",
        2 * edges.len()
    );
}

fn seconds(run: &mut dyn FnMut()) -> f64 {
    let start = Instant::now();
    run();
    start.elapsed().as_secs_f64()
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

fn table(pairs: &mut [Pair]) {
    println!("| robust, M/s | cheap, M/s | robust time over cheap | quartiles | |");
    println!("|---|---|---|---|---|");
    for pair in pairs {
        let mut times = [Vec::new(), Vec::new()];
        for round in 0..=ROUNDS {
            let mut both = [0.0; 2];
            for turn in 0..2 {
                let which = (round + turn) % 2;
                let run = if which == 0 {
                    &mut pair.robust
                } else {
                    &mut pair.cheap
                };
                both[which] = seconds(run);
            }
            // The first is to warm up.
            if round > 0 {
                times[0].push(both[0]);
                times[1].push(both[1]);
            }
        }
        let mut ratios: Vec<f64> = times[0].iter().zip(&times[1]).map(|(r, c)| r / c).collect();
        let speed = |times: &mut [f64]| pair.elements as f64 / quantile(times, 0.5) / 1e6;
        let [robust, cheap] = &mut times;
        println!(
            "| {:.2} | {:.2} | {:.3} | {:.3} to {:.3} | {} |",
            speed(robust),
            speed(cheap),
            quantile(&mut ratios, 0.5),
            quantile(&mut ratios, 0.25),
            quantile(&mut ratios, 0.75),
            pair.name
        );
    }
}

fn main() {
    sums_stop();
    triangles_leak();
    let side = if common::quick() { 16 } else { 256 };
    let details: &[usize] = if common::quick() {
        &[0, 8]
    } else {
        &[0, 18, 76]
    };
    let rooms: Vec<_> = details
        .iter()
        .map(|&detail| {
            let scene = rooms::room(detail);
            let tracer = Tracer::build(&scene);
            let waves = rooms::waves(&scene, &tracer, side);
            (scene.triangles.len(), tracer, waves)
        })
        .collect();
    let scenes = common::scenes();
    let splats = splats(SIDE, 64 * LOG);
    let mut pairs = Vec::new();
    tracing(&mut pairs, &rooms);
    marching(&mut pairs, &scenes);
    filming(&mut pairs, &splats);
    if std::env::args().any(|a| a == "--table") {
        return table(&mut pairs);
    }
    let mut c = common::criterion();
    for pair in &mut pairs {
        let mut group = c.benchmark_group(format!("robust/{}", pair.name));
        group.throughput(Throughput::Elements(pair.elements));
        group.bench_function(BenchmarkId::from_parameter("robust"), |b| {
            b.iter(&mut pair.robust)
        });
        group.bench_function(BenchmarkId::from_parameter("cheap"), |b| {
            b.iter(&mut pair.cheap)
        });
        group.finish();
    }
    c.final_summary();
}
