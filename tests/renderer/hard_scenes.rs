//! Scenes that are hard all through (`scenes`), at 48 x 32 pixels, against long renders of our own
//! path tracer, two against closed forms.
//!
//! `tests/reference/hard/NAME.pfm` is the mean of [`SEEDS`] path-traced pictures with different
//! seeds, and `NAME.se8.pfm` the standard error of its blocks of 8 x 8 pixels. They were made by
//!
//! ```text
//! cargo test --release --test renderer hard_scenes:: -- --ignored --nocapture
//! ```
//!
//! A block, or the whole picture, differs if chance alone makes such a difference in any of the
//! suite's comparisons once in a million changes of seed; errors are measured on both sides. What a
//! bias would have to be to show is printed.

use crate::support;

use phalanx::film::output::write;
use phalanx::formats::tone::Display;
use phalanx::formats::{Picture, pfm};
use phalanx::integrate::Settings;
use phalanx::pbrt::load;
use phalanx::scene::{IntegratorKind, Scene};
use std::path::{Path, PathBuf};
use support::{BOTH, Estimate, Runs, standard_errors};

const SIZE: (u32, u32) = (48, 32);
/// Pixels along a block.
const BLOCK: u32 = 8;
/// Path-traced pictures that make a reference.
const SEEDS: u64 = 32;
/// Comparisons in this suite, at most.
const COMPARISONS: usize = 1500;

/// Each with the path tracer's samples per pixel for each picture of the reference: what it takes
/// to find the light by chance.
const SCENES: [(&str, u64); 7] = [
    ("mirror-caustic", 4096),
    ("slit", 4096),
    ("bulb", 4096),
    ("far", 1024),
    ("microscopic", 2048),
    ("needles", 1024),
    ("bright", 1024),
];

fn root(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)
}

fn scene(name: &str) -> Scene {
    let mut scene = load(&root("scenes").join(format!("{name}.pbrt"))).unwrap();
    scene.set_resolution(SIZE.0, SIZE.1).unwrap();
    scene
}

/// By block, row by row, and channel, and last the whole picture.
fn blocks(runs: &Runs) -> Vec<Estimate> {
    let mut list = runs.grid(SIZE.0 / BLOCK, SIZE.1 / BLOCK);
    list.extend((0..3).map(|c| runs.whole(c)));
    list
}

fn file(name: &str) -> PathBuf {
    root("tests/reference/hard").join(name)
}

/// The reference, as [`blocks`].
fn reference(name: &str) -> Vec<Estimate> {
    let read = |name: String| pfm::read(&std::fs::read(file(&name)).unwrap()).unwrap();
    let mean = read(format!("{name}.pfm"));
    let errors = read(format!("{name}.se8.pfm"));
    let pictures = Runs {
        width: mean.width,
        height: mean.height,
        pictures: vec![mean.pixels.clone()],
    };
    let freedom = (SEEDS - 1) as f64;
    let mut list: Vec<Estimate> = (pictures.grid(errors.width, errors.height).iter())
        .zip(errors.pixels.as_flattened())
        .map(|(block, error)| Estimate {
            mean: block.mean,
            error: f64::from(*error),
            freedom,
        })
        .collect();
    for c in 0..3 {
        let of_blocks = errors.pixels.iter().map(|e| f64::from(e[c]).powi(2));
        list.push(Estimate {
            mean: pictures.whole(c).mean,
            error: of_blocks.sum::<f64>().sqrt() / errors.pixels.len() as f64,
            freedom,
        });
    }
    list
}

/// Renders with [`SEEDS`] seeds each and writes the references.
#[test]
#[ignore = "minutes: makes the references"]
fn make_references() {
    let only = std::env::var("PHALANX_REFERENCE").ok();
    for (name, samples) in SCENES {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let start = std::time::Instant::now();
        let scene = scene(name);
        let settings = Settings {
            integrator: IntegratorKind::Pt,
            samples_per_pixel: samples,
            estimate_error: false,
            seed: 1_000_000,
            ..Settings::of(&scene)
        };
        let runs = Runs::new(&scene, &settings, SEEDS);
        let grid = runs.grid(SIZE.0 / BLOCK, SIZE.1 / BLOCK);
        let picture = |width: u32, height: u32, pixels| Picture {
            width,
            height,
            offset: [0; 2],
            full: [width, height],
            pixels,
        };
        let errors: Vec<[f32; 3]> = (grid.chunks(3))
            .map(|block| [0, 1, 2].map(|c| block[c].error as f32))
            .collect();
        let mean = picture(SIZE.0, SIZE.1, runs.mean());
        let errors = picture(SIZE.0 / BLOCK, SIZE.1 / BLOCK, errors);
        std::fs::create_dir_all(file("")).unwrap();
        write(&file(&format!("{name}.pfm")), &mean, &[], &Display::LINEAR).unwrap();
        write(
            &file(&format!("{name}.se8.pfm")),
            &errors,
            &[],
            &Display::LINEAR,
        )
        .unwrap();
        let whole = runs.whole(1);
        println!(
            "{name}: mean {:.5} +- {:.2} %, {:.0} s",
            whole.mean,
            100.0 * whole.error / whole.mean,
            start.elapsed().as_secs_f64()
        );
    }
}

fn runs(scene: &Scene, integrator: IntegratorKind, effort: u64, seeds: u64) -> Runs {
    let settings = Settings {
        integrator,
        samples_per_pixel: effort,
        mutations_per_pixel: effort,
        ..Settings::of(scene)
    };
    Runs::new(scene, &settings, seeds)
}

/// Mutations per pixel, renders, and bootstrap paths of a depth.
type Size = (u64, u64, u64);

/// 16 long renders: what is rare must be found in each of them, or their scatter does not tell how
/// far they are off. With a tenth of the bootstrap a caustic is missed, unnoticed.
const RARE: Size = (400, 16, 100_000);

/// 32 short ones, which bound a difference as tightly as 16 of three times the samples.
const COMMON: Size = (30, 32, 12_000);

fn compare(name: &str, (effort, seeds, bootstrap): Size) {
    let scene = scene(name);
    let integrator = IntegratorKind::Mmlt;
    let settings = Settings {
        integrator,
        mutations_per_pixel: effort,
        bootstrap,
        ..Settings::of(&scene)
    };
    let runs = Runs::new(&scene, &settings, seeds);
    runs.show(&format!("{name}-{integrator:?}"));
    let (own, truth) = (blocks(&runs), reference(name));
    let mut least = (f64::INFINITY, 0.0f64);
    for (i, (own, truth)) in own.iter().zip(&truth).enumerate() {
        let what = match i / 3 {
            24 => format!("{name} {integrator:?}, all, channel {}", i % 3),
            block => format!("{name} {integrator:?}, block {block}, channel {}", i % 3),
        };
        own.expect_same_among(COMPARISONS, truth, &what);
        let shows = standard_errors(COMPARISONS, own.freedom.min(truth.freedom));
        let shows = shows * own.error.hypot(truth.error) / truth.mean;
        least = (least.0.min(shows), least.1.max(shows));
    }
    println!(
        "{name} {integrator:?}: a bias shows from {:.1} % in the clearest block, {:.0} % in the dimmest",
        100.0 * least.0,
        100.0 * least.1
    );
}

/// Specular, diffuse, specular: hit by chance alone, and then explored.
#[test]
fn a_caustic_seen_in_a_mirror() {
    compare("mirror-caustic", RARE);
}

#[test]
fn light_through_a_door_ajar() {
    compare("slit", RARE);
}

#[test]
fn a_lamp_in_a_glass_bulb() {
    compare("bulb", RARE);
}

#[test]
fn a_hundred_kilometres_from_the_origin() {
    compare("far", COMMON);
}

#[test]
fn micrometres() {
    compare("microscopic", COMMON);
}

#[test]
fn needles_and_slivers() {
    compare("needles", COMMON);
}

#[test]
fn lights_of_one_to_a_billion() {
    compare("bright", COMMON);
}

/// Every pixel of a closed room that glows and reflects alike is the geometric series.
#[test]
fn two_hundred_bounces() {
    let scene = scene("furnace");
    let truth: f64 = (0..=200).map(|k| 0.99f64.powi(k)).sum();
    for (integrator, effort) in [(IntegratorKind::Mmlt, 12), (IntegratorKind::Pt, 1)] {
        let settings = Settings {
            integrator,
            samples_per_pixel: effort,
            mutations_per_pixel: effort,
            bootstrap: 256,
            ..Settings::of(&scene)
        };
        let runs = Runs::new(&scene, &settings, 10);
        for (i, block) in blocks(&runs).iter().enumerate() {
            let what = format!("furnace {integrator:?}, block {}, channel {}", i / 3, i % 3);
            block.expect_among(COMPARISONS, truth, &what);
        }
        let whole = runs.whole(0);
        assert!(whole.error < 0.005 * truth, "too noisy to tell: {whole:?}");
    }
}

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn add(a: V, b: V, t: f64) -> V {
    [0, 1, 2].map(|i| a[i] + t * b[i])
}
fn cross(a: V, b: V) -> V {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}
fn unit(a: V) -> V {
    a.map(|v| v / dot(a, a).sqrt())
}

/// Earth and Moon under the Sun in `f64`: diffuse spheres lit by a sphere that is far away
/// (irradiance `pi L sin^2 cos`), as [`blocks`]. Light from one to the other, a ten-thousandth, is
/// left out.
fn sunlit() -> Vec<f64> {
    let (eye, target) = ([-390e6, 1.5e6, 2.6e6], [-380e6, 0.3e6, 0.4e6]);
    let sun: V = [-1.06e11, 0.1e11, 1.06e11];
    let light = [46000.0, 45000.0, 42000.0];
    let bodies: [(V, f64, V); 2] = [
        ([0.0; 3], 6.371e6, [0.1, 0.2, 0.45]),
        ([-384.4e6, 0.0, 0.0], 1.737e6, [0.35, 0.33, 0.3]),
    ];
    let forward = unit(add(target, eye, -1.0));
    let right = unit(cross([0.0, 1.0, 0.0], forward));
    let up = cross(forward, right);
    let half = 18f64.to_radians().tan();
    const FINE: u32 = 24;
    let (columns, rows) = (SIZE.0 / BLOCK, SIZE.1 / BLOCK);
    let mut sums = vec![0.0; 3 * (columns * rows + 1) as usize];
    for y in 0..SIZE.1 * FINE {
        for x in 0..SIZE.0 * FINE {
            let at = |v: u32, size: u32| 2.0 * (f64::from(v) + 0.5) / f64::from(size * FINE) - 1.0;
            let aspect = f64::from(SIZE.0) / f64::from(SIZE.1);
            let d = add(forward, right, half * aspect * at(x, SIZE.0));
            let d = unit(add(d, up, -half * at(y, SIZE.1)));
            let mut nearest = f64::INFINITY;
            let mut colour = [0.0; 3];
            for (centre, radius, albedo) in bodies {
                let to = add(eye, centre, -1.0);
                let b = -dot(to, d);
                let q = b * b - dot(to, to) + radius * radius;
                let t = b - q.max(0.0).sqrt();
                if q > 0.0 && t > 0.0 && t < nearest {
                    nearest = t;
                    let p = add(eye, d, t);
                    let n = unit(add(p, centre, -1.0));
                    let to_sun = add(sun, p, -1.0);
                    let cos = dot(n, unit(to_sun)).max(0.0);
                    let sin2 = 6.96e8f64.powi(2) / dot(to_sun, to_sun);
                    colour = [0, 1, 2].map(|c| albedo[c] * light[c] * sin2 * cos);
                }
            }
            let block = y / FINE / BLOCK * columns + x / FINE / BLOCK;
            for c in 0..3 {
                let part = colour[c] / f64::from(FINE * FINE);
                sums[(3 * block) as usize + c] += part / f64::from(BLOCK * BLOCK);
                sums[(3 * columns * rows) as usize + c] += part / f64::from(SIZE.0 * SIZE.1);
            }
        }
    }
    sums
}

#[test]
fn astronomical_distances() {
    let scene = scene("astronomical");
    let truth = sunlit();
    for (integrator, effort) in BOTH.iter().zip([64, 200]) {
        let runs = runs(&scene, *integrator, effort, 16);
        runs.show(&format!("astronomical-{integrator:?}"));
        for (i, (block, truth)) in blocks(&runs).iter().zip(&truth).enumerate() {
            let what = format!(
                "astronomical {integrator:?}, block {}, channel {}",
                i / 3,
                i % 3
            );
            block.expect_among(COMPARISONS, *truth, &what);
        }
    }
}
