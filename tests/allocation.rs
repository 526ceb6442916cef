//! Once warm, marching chains asks the system for no memory: every list, log and stack is kept from
//! one iteration to the next.

use phalanx::chain::batch::Workspace;
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::ProposalDistribution;
use phalanx::film::{Destination, FilterTable, Half, SplatFilm, Tiling};
use phalanx::pbrt::load_str;
use phalanx::simd::f32x8;
use phalanx::simd::rng::{Purpose, Stream};
use phalanx::transport::bidirectional::BidirectionalLayout;
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::{PathSampler, Paths, World};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

/// The system's allocator, and how often this thread has asked it for memory.
struct Counting;

thread_local! {
    /// Of this thread: the test harness has others.
    static REQUESTS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that is ending has no counter left.
    let _ = REQUESTS.try_with(|n| n.set(n.get() + 1));
}

// SAFETY: every request is passed on as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.realloc(memory, layout, size) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const CHAINS: usize = 256;
const WARM_UP: u32 = 200;
/// Iterations that may not allocate; splat logs go to the film several times meanwhile.
const ITERATIONS: u32 = 200;

/// Requests for memory that marching makes after it is warm, depth by depth, and for samplers of
/// all depths.
fn requests(evaluator: Evaluator, text: &str) -> Vec<(Option<u32>, u64)> {
    let scene = load_str(text, "scene.pbrt", Path::new("")).unwrap();
    let world = World::new(&scene, 6);
    let proposals = ProposalDistribution::new(1, 0.3, 0.01);
    let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
    let half = Half {
        scale: 1.0,
        part: 0.5,
    };
    let film = SplatFilm::judged(filter, 1e12, vec![half; 2]);
    let to = Destination {
        layer: 0,
        scale: 1.0,
        half: true,
    };
    let mut workspace = Workspace::new(&world);
    let mut found = Vec::new();
    let whole = [
        PathSampler::Unidirectional(UnidirectionalLayout::new(&world.plan, 6)),
        PathSampler::Bidirectional(BidirectionalLayout::new(&world)),
    ];
    let samplers = world.plan.depths.iter().map(PathSampler::from).chain(whole);
    for sampler in samplers {
        let bootstrap = Evaluator::EIGHT.bootstrap(&world, &sampler, 1, 10_000, &|| false);
        if bootstrap.estimate.mean() <= 0.0 {
            continue;
        }
        let seeds = bootstrap.seeds(1, sampler.id(), CHAINS);
        let mut batch = evaluator.batch(&world, &sampler, 0, &seeds, 1, &mut workspace.paths);
        if sampler.depth().is_none() {
            batch.combine(0.3 * bootstrap.estimate.mean() as f32, 1);
        }
        batch.watch(&[0; CHAINS], &Tiling::new(scene.film.crop));
        let mut march = |iterations| {
            evaluator.march(
                &mut batch,
                &world,
                &proposals,
                iterations,
                &mut workspace,
                &film,
                to,
            );
        };
        march(WARM_UP);
        let before = REQUESTS.get();
        march(ITERATIONS);
        found.push((sampler.depth(), REQUESTS.get() - before));
    }
    assert!(found.len() >= 5, "the scene has light at few depths");
    found
}

fn expect_none(text: &str) {
    for evaluator in Evaluator::BOTH {
        let found = requests(evaluator, text);
        assert!(
            found.iter().all(|(_, n)| *n == 0),
            "(depth, allocations): {found:?}"
        );
    }
}

#[test]
fn the_built_in_scene() {
    expect_none(include_str!("../scenes/cornell.pbrt"));
}

#[test]
fn textures_sky_and_lens() {
    expect_none(include_str!("reference/env-lens.pbrt"));
}

#[test]
fn several_lights_and_materials() {
    expect_none(include_str!("reference/room-v4.pbrt"));
}

/// Bidirectional evaluations, which keep every vertex, with parts and without.
#[test]
fn kept_vertices() {
    let scene = load_str(
        include_str!("reference/room-v4.pbrt"),
        "scene.pbrt",
        Path::new(""),
    );
    let scene = scene.unwrap();
    let world = World::new(&scene, 6);
    let mut paths = Paths::new(&world);
    let all = BidirectionalLayout::new(&world);
    for layout in [all.clone(), all.with_parts()] {
        let mut samples = Samples::new(layout.total(), CHAINS);
        let mut evaluate = |batches: std::ops::Range<u32>| {
            for i in batches {
                let stream = Stream::new(1, Purpose::Bidirectional);
                samples.fill::<f32x8>(&stream, CHAINS, |path| [path as u32, i]);
                Evaluator::EIGHT.bidirectional(&world, &layout, &samples, CHAINS, &mut paths);
            }
        };
        evaluate(0..50);
        let before = REQUESTS.get();
        evaluate(50..100);
        assert_eq!(REQUESTS.get() - before, 0);
    }
}

#[test]
fn the_counter_counts() {
    let before = REQUESTS.get();
    drop(std::hint::black_box(vec![1u8; 100]));
    assert!(REQUESTS.get() > before);
}
