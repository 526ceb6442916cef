//! What does a splat cost?
//!
//! Logs of splats are written and handed in to films of a few kilobytes, of 512 x 512 pixels and of
//! four megapixels, with the box of one pixel and pbrt's Gaussian, into one layer or sixteen by
//! turns, and into films that know their own error (the half that is summed twice). Positions are
//! uniform on the film: no caching helps that a picture would not have, and the memory is there.
//! Throughput is splats a second on one thread; there are no lanes here.

mod common;
#[path = "common/splats.rs"]
mod splats;

use criterion::{BenchmarkId, Criterion, Throughput};
use glam::Vec2;
use phalanx::film::{Destination, FilterTable, Half, SplatFilm, SplatLog};
use phalanx::scene::{Filter, FilterKind};
use splats::splats;

/// Splats of a log, as in a render.
const LOG: usize = 8192;
const SIDES: [u32; 3] = [32, 512, 2048];

const HALF: Half = Half {
    scale: 1.0,
    part: 0.5,
};

/// The half of all chains that a judged film sums twice.
fn to(layer: usize) -> Destination {
    Destination {
        layer,
        scale: 1.0,
        half: true,
    }
}

/// Splats something on every page of memory: what comes after finds it there, as all but the first
/// splats of a render do.
fn touch(film: &SplatFilm, side: u32, layers: usize) {
    let mut log = SplatLog::default();
    log.reserve(LOG);
    for layer in 0..layers {
        for (y, x) in (0..side).flat_map(|y| (0..side).step_by(128).map(move |x| (y, x))) {
            if log.room() == 0 {
                film.add(to(layer), &mut log);
            }
            let [x, y] = [x, y].map(|v| v as f32 + 0.5);
            log.push([1.0; 3], [x, y], 1);
        }
        film.add(to(layer), &mut log);
    }
}

fn film(c: &mut Criterion, side: u32, filter: (&str, Filter), layers: usize, judged: bool) {
    let table = FilterTable::new(&filter.1, [0, side, 0, side]);
    let film = if judged {
        SplatFilm::judged(table, 1e15, vec![HALF; layers])
    } else {
        SplatFilm::new(table, layers, 1e15)
    };
    touch(&film, side, layers);
    let splats = splats(side, 64 * LOG);
    let mut logs = splats.chunks_exact(LOG).cycle();
    let mut log = SplatLog::default();
    log.reserve(LOG);
    let mut layer = 0;
    let mut group = c.benchmark_group(format!(
        "splat/{}/{layers} layers{}",
        filter.0,
        if judged { " judged" } else { "" }
    ));
    group.throughput(Throughput::Elements(LOG as u64));
    group.bench_function(BenchmarkId::new("side", side), |b| {
        b.iter(|| {
            for &(colour, raster) in logs.next().into_iter().flatten() {
                log.push(colour, raster, 1 << 31);
            }
            let scale = 1.0 / (1u64 << 32) as f64;
            film.add(Destination { scale, ..to(layer) }, &mut log);
            layer = (layer + 1) % layers;
        });
    });
    group.finish();
}

fn main() {
    let one_pixel = Filter {
        radius: Vec2::splat(0.5),
        kind: FilterKind::Box,
    };
    let gaussian = Filter {
        radius: Vec2::splat(2.0),
        kind: FilterKind::Gaussian { alpha: 2.0 },
    };
    let mut c = common::criterion();
    let sides = if common::quick() { &SIDES[..2] } else { &SIDES };
    for &side in sides {
        for filter in [("box", one_pixel), ("gaussian", gaussian)] {
            for layers in [1, 16] {
                film(&mut c, side, filter, layers, false);
            }
            film(&mut c, side, filter, 16, true);
        }
    }
    c.final_summary();
}
