//! Bidirectional path tracing gives what path tracing gives, whole or broken off, and its
//! strategies add up to it.

use crate::common;
use crate::support;

use common::scenes;
use phalanx::integrate::{EndedBy, Observer, Phase, Render, Settings, render};
use phalanx::scene::{FilterKind, IntegratorKind, Scene};
use support::stage::lit_stage;
use support::{Estimate, Runs, run, scene, settings, standard_errors};

/// Regions along each side.
const GRID: u32 = 2;
/// Many short renders know their error better than few long ones: 24 bound a difference as tightly
/// as 12 of six times the samples.
const SEEDS: u64 = 16;

#[test]
fn pictures_are_those_of_path_tracing() {
    let all = scenes::all();
    let comparisons = all.len() * 3 * (1 + GRID * GRID) as usize;
    for (name, mut scene) in all {
        scenes::without_delta_caustics(&mut scene);
        let [pt, bdpt] = [(IntegratorKind::Pt, 10), (IntegratorKind::Bdpt, 5)]
            .map(|(kind, spp)| Runs::new(&scene, &settings(&scene, kind, spp), SEEDS));
        bdpt.show(&format!("bdpt-{name}"));
        for c in 0..3 {
            let what = format!("{name}, channel {c}");
            bdpt.whole(c)
                .expect_same_among(comparisons, &pt.whole(c), &what);
        }
        let regions = bdpt.grid(GRID, GRID).into_iter().zip(pt.grid(GRID, GRID));
        for (i, (a, b)) in regions.enumerate() {
            let what = format!("{name}, region {}, channel {}", i / 3, i % 3);
            a.expect_same_among(comparisons, &b, &what);
        }
    }
}

/// Light from a point through a mirror onto surfaces, which path tracing cannot find, as chains
/// find it.
#[test]
fn pictures_are_those_of_chains_where_path_tracing_is_blind() {
    let blind = |scene: &Scene| {
        let mut other = scene.clone();
        scenes::without_delta_caustics(&mut other);
        other.materials != scene.materials
    };
    let all: Vec<_> = (scenes::all().into_iter())
        .filter(|(_, scene)| blind(scene))
        .collect();
    assert!(!all.is_empty());
    let comparisons = all.len() * 3;
    for (name, scene) in all {
        let [mmlt, bdpt] = [(IntegratorKind::Mmlt, 64), (IntegratorKind::Bdpt, 6)]
            .map(|(kind, effort)| Runs::new(&scene, &settings(&scene, kind, effort), SEEDS));
        for c in 0..3 {
            let what = format!("{name}, channel {c}");
            bdpt.whole(c)
                .expect_same_among(comparisons, &mmlt.whole(c), &what);
        }
    }
}

/// A crop window, a wide filter with negative weights, an open lens, mixtures.
const HARD: &str = r#"
LookAt 0 1.5 5  0 .8 0  0 1 0
Camera "perspective" "float fov" [40] "float lensradius" [.05] "float focaldistance" [5]
Film "image" "integer xresolution" [40] "integer yresolution" [30] "float cropwindow" [.1 .9 .2 1] "float scale" [3]
PixelFilter "mitchell"
WorldBegin
LightSource "infinite" "rgb L" [.1 .1 .2]
MakeNamedMaterial "a" "string type" "mirror"
MakeNamedMaterial "b" "string type" "matte" "rgb Kd" [.7 .6 .5]
MakeNamedMaterial "c" "string type" "mix" "string namedmaterial1" "a" "string namedmaterial2" "b"
NamedMaterial "c"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]
NamedMaterial "b"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-3 0 -2 3 0 -2 3 3 -2 -3 3 -2]
AttributeBegin
  Material "glass"
  Translate .3 .6 0
  Shape "sphere" "float radius" [.6]
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [8 7 6]
  Translate -.5 2.5 .5  Rotate 90 1 0 0
  Shape "disk" "float radius" [.4]
AttributeEnd
WorldEnd
"#;

#[test]
fn weighted_pictures_add_up_to_the_picture() {
    let scene = scene(HARD);
    let plain = Settings {
        max_depth: 4,
        ..settings(&scene, IntegratorKind::Bdpt, 5)
    };
    let with = Settings {
        strategies: true,
        ..plain.clone()
    };
    // A batch that ends within a pass, and one pass that is broken off.
    for after in [None, Some(1)] {
        let render = match after {
            None => run(&scene, &with),
            Some(after) => stopped(&scene, &with, after),
        };
        if after.is_none() {
            assert_eq!(run(&scene, &plain).pixels, render.pixels);
        }
        let strategies: Vec<_> = (render.strategies.iter())
            .map(|of| (of.strategy.s, of.strategy.t))
            .collect();
        // 1, then 3, 4, 5 and 6 of depths 1 to 4.
        assert_eq!(strategies.len(), 19);
        assert_eq!(strategies[..4], [(0, 2), (0, 3), (1, 2), (2, 1)]);
        for (i, pixel) in render.pixels.iter().enumerate() {
            for (c, value) in pixel.iter().enumerate() {
                let parts = render.strategies.iter().map(|of| of.weighted[i][c]);
                let sum: f64 = parts.clone().map(f64::from).sum();
                // Every sample rounds its sum to f32, and every picture its pixels.
                let size: f64 = parts.map(|v| f64::from(v.abs())).sum();
                let bound = 1e-6 * (size + f64::from(value.abs()));
                assert!((sum - f64::from(*value)).abs() <= bound, "{sum} {value}");
            }
        }
        for of in &render.strategies {
            let lit = |p: &[[f32; 3]]| p.iter().flatten().any(|v| *v != 0.0);
            assert!(
                lit(&of.weighted) && lit(&of.unweighted),
                "{:?}",
                of.strategy
            );
        }
    }
    assert!(run(&scene, &plain).strategies.is_empty());
}

/// Where nothing is specular and every light can be met, each strategy finds all light of its
/// depth.
#[test]
fn unweighted_pictures_of_a_depth_are_alike() {
    let scene = lit_stage(16, 12);
    let pictures: Vec<Render> = (0..24)
        .map(|seed| {
            let settings = Settings {
                strategies: true,
                max_depth: 3,
                seed,
                ..settings(&scene, IntegratorKind::Bdpt, 150)
            };
            run(&scene, &settings)
        })
        .collect();
    let count = pictures[0].strategies.len();
    assert_eq!(count, 1 + 3 + 4 + 5);
    let mean = |index: usize, half: usize| {
        let means: Vec<f64> = (pictures.iter())
            .map(|p| {
                let pixels = &p.strategies[index].unweighted;
                let rows = &pixels[half * pixels.len() / 2..(half + 1) * pixels.len() / 2];
                let values = rows.as_flattened();
                values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
            })
            .collect();
        Estimate::of(&means)
    };
    for half in 0..2 {
        for index in 2..count {
            let [a, b] = [index - 1, index].map(|i| pictures[0].strategies[i].strategy);
            if a.depth() == b.depth() {
                let what = format!("half {half}, {a:?} against {b:?}");
                mean(index - 1, half).expect_same_among(2 * count, &mean(index, half), &what);
            }
        }
    }
}

/// Stops after the first round that has made so many samples.
struct StopAfter(u64, std::sync::atomic::AtomicBool);

impl Observer for StopAfter {
    fn progress(&self, phase: Phase, done: u64, _: u64) {
        if phase == Phase::Render && done >= self.0 {
            self.1.store(true, std::sync::atomic::Ordering::Relaxed);
        }
    }
    fn stop(&self) -> bool {
        self.1.load(std::sync::atomic::Ordering::Relaxed)
    }
}

fn stopped(scene: &Scene, settings: &Settings, after: u64) -> Render {
    let settings = Settings {
        samples_per_pixel: 1 << 20,
        ..settings.clone()
    };
    let render = render(scene, &settings, &StopAfter(after, false.into())).unwrap();
    assert_eq!(render.ended_by, EndedBy::Observer);
    render
}

/// A round makes 65 536 samples: of 120 000 pixels, a part of the first pass, or a whole pass and a
/// part.
#[test]
fn a_pass_broken_off_is_as_bright_as_a_whole_one() {
    let (width, height) = (400, 300);
    let large = lit_stage(width, height);
    let small = lit_stage(16, 12);
    let pass = u64::from(width * height);
    for kind in [IntegratorKind::Bdpt, IntegratorKind::Lt] {
        let truth = Runs::new(&small, &settings(&small, kind, 128), 12);
        for after in [1, pass + 1] {
            let mut upper = Vec::new();
            let mut lower = Vec::new();
            for seed in 0..6 {
                let settings = Settings {
                    seed,
                    ..settings(&large, kind, 1)
                };
                let render = stopped(&large, &settings, after);
                assert!(
                    !render.stats.samples.is_multiple_of(pass),
                    "no pass is broken off"
                );
                let mean = |rows: std::ops::Range<usize>| {
                    let n = width as usize;
                    let values = render.pixels[rows.start * n..rows.end * n].as_flattened();
                    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
                };
                // Of the first pass 163 rows are done.
                upper.push(mean(0..150));
                lower.push(mean(175..300));
            }
            let grid = truth.grid(1, 12);
            let average = |rows: std::ops::Range<usize>| {
                let values = grid[3 * rows.start..3 * rows.end].iter().map(|e| e.mean);
                values.sum::<f64>() / (3 * rows.len()) as f64
            };
            let error = |rows: std::ops::Range<usize>| {
                // Rows share samples of light subpaths: at most this.
                let errors = grid[3 * rows.start..3 * rows.end].iter().map(|e| e.error);
                errors.sum::<f64>() / (3 * rows.len()) as f64
            };
            for (name, means, rows) in [("upper", &upper, 0..6), ("lower", &lower, 7..12)] {
                let own = Estimate::of(means);
                let whole = average(rows.clone());
                println!(
                    "{kind:?}, {name} part after {after}: {:.5} +- {:.5}, whole {whole:.5}",
                    own.mean, own.error
                );
                if after == 1 && name == "lower" {
                    // What no pass has seen is black.
                    assert_eq!(own.mean, 0.0);
                    continue;
                }
                let bound = standard_errors(8, own.freedom) * own.error.hypot(error(rows));
                assert!((own.mean - whole).abs() <= bound, "{kind:?}, {name}");
                assert!(own.error < 0.02 * whole, "too noisy to tell");
            }
        }
    }
}

/// What a render of many passes claims its error to be is what renders with other seeds scatter by;
/// splats and placed samples of a pass belong together.
#[test]
fn claimed_errors_are_true() {
    expect_true_claims(&[
        (IntegratorKind::Bdpt, FilterKind::Box, 0.5),
        (IntegratorKind::Lt, FilterKind::Box, 0.5),
    ]);
}

/// The same where samples count in several pixels.
#[test]
fn claimed_errors_are_true_under_wide_filters() {
    expect_true_claims(&[
        (IntegratorKind::Pt, FilterKind::Gaussian { alpha: 2.0 }, 2.0),
        (
            IntegratorKind::Bdpt,
            FilterKind::Mitchell { b: 0.333, c: 0.333 },
            2.0,
        ),
    ]);
}

/// Samples beyond the border, where the lamp is, reach pixels of the picture, and count in its
/// tiles as they do there.
#[test]
fn tiles_are_means_of_their_pixels_under_wide_filters() {
    let mut scene = lit_stage(32, 24);
    for (kind, filter) in [
        (IntegratorKind::Pt, FilterKind::Gaussian { alpha: 2.0 }),
        (IntegratorKind::Bdpt, FilterKind::Box),
        (IntegratorKind::Bdpt, FilterKind::Sinc { tau: 3.0 }),
        (IntegratorKind::Lt, FilterKind::Triangle),
    ] {
        scene.film.filter.kind = filter;
        scene.film.filter.radius = [2.0; 2].into();
        let render = run(&scene, &settings(&scene, kind, 64));
        let tiles = render.stats.tiles.expect("told");
        for (i, error) in tiles.stderr.expect("known").into_iter().enumerate() {
            let (left, top) = (i % 2 * 16, i / 2 * 16);
            let pixels = (top..24.min(top + 16))
                .flat_map(|y| &render.pixels[32 * y + left..][..16])
                .flatten();
            let (count, sum) =
                pixels.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + f64::from(*v)));
            let (told, mean) = (tiles.mean[i], sum / count);
            println!("{kind:?}, {filter:?}, tile {i}: {told:.5} +- {error:.5}, pixels {mean:.5}");
            // Told of the same samples: closer than chance would have it.
            assert!(
                (told - mean).abs() < error,
                "{kind:?}, {filter:?}, tile {i}"
            );
        }
    }
}

fn expect_true_claims(filters: &[(IntegratorKind, FilterKind, f32)]) {
    for &(kind, filter, radius) in filters {
        let mut scene = lit_stage(32, 24);
        scene.film.filter.kind = filter;
        scene.film.filter.radius = [radius; 2].into();
        let renders: Vec<Render> = (0..48)
            .map(|seed| {
                let settings = Settings {
                    seed,
                    error_layers: true,
                    ..settings(&scene, kind, 16)
                };
                run(&scene, &settings)
            })
            .collect();
        let n = renders.len() as f64;
        let pixels = renders[0].pixels.len();
        // Every pixel counts alike: beside a lamp beyond the border some six would rule a sum, all
        // by the same samples, and 48 renders know those to a fifth only.
        let (mut share, mut lit) = (0.0, 0.0);
        for i in 0..pixels {
            let values = || renders.iter().map(|r| f64::from(r.pixels[i][1]));
            let mean = values().sum::<f64>() / n;
            let scatter = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
            let variances = renders.iter().map(|r| r.deviation.as_ref().unwrap()[i][1]);
            let claimed = variances.map(|d| f64::from(d).powi(2)).sum::<f64>() / n;
            if claimed + scatter > 0.0 {
                share += claimed / (claimed + scatter);
                lit += 1.0;
            }
        }
        let variance = share / (lit - share);
        let b: Vec<f64> = renders.iter().map(|r| r.stats.b).collect();
        let b = Estimate::of(&b).error * n.sqrt();
        let b_claimed = renders.iter().map(|r| r.stats.b_stderr).sum::<f64>() / n;
        println!(
            "{kind:?}: variance claimed {variance:.3} of the true one, standard error of b {:.3}",
            b_claimed / b
        );
        // Both are of 768 pixels; 48 renders know a standard deviation to 10 %.
        assert!((0.8..1.25).contains(&variance));
        assert!((0.65..1.5).contains(&(b_claimed / b)));
    }
}
