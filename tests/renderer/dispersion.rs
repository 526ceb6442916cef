//! Glass whose index depends on the wavelength: where light goes, what colour it has, and that
//! nothing else changes.

use crate::common;

use common::stats::{FALSE_ALARM, Mean, Random, assert_agree, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::pbrt::load_str;
use phalanx::plan::DepthPlan;
use phalanx::replay::Recorder;
use phalanx::replay::spectral;
use phalanx::replay::vector::*;
use phalanx::scene::spectrum::{self, IndexCurve};
use phalanx::scene::{MaterialKind, Scene};
use phalanx::surface::{DielectricMaterial, ThinDielectricMaterial};
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::wavelength::Wavelengths;
use phalanx::transport::{Paths, World};
use std::sync::Arc;

fn scene(text: &str) -> Scene {
    load_str(text, "test.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Whether it is glass.
fn set_dispersion(kind: &mut MaterialKind, curve: Option<&Arc<IndexCurve>>) -> bool {
    kind.change(|glass: &mut DielectricMaterial| glass.dispersion = curve.cloned())
        || kind.change(|glass: &mut ThinDielectricMaterial| glass.dispersion = curve.cloned())
}

/// Gives all glass of a scene an index over the wavelength.
fn disperse(scene: &mut Scene, curve: &Arc<IndexCurve>) {
    for m in &mut scene.materials {
        set_dispersion(&mut m.kind, Some(curve));
    }
}

fn fill(samples: &mut Samples, random: &mut Random) {
    for d in 0..samples.dimensions() {
        samples.row_mut(d).fill_with(|| random.uniform());
    }
}

/// The same samples for a plan without a wavelength.
fn without_wavelength(plan: &DepthPlan, samples: &Samples, n: usize) -> Samples {
    let at = plan.layout.wavelength;
    let mut fewer = Samples::new(plan.layout.total - 1, n);
    for d in 0..plan.layout.total - 1 {
        fewer
            .row_mut(d)
            .copy_from_slice(samples.row(d + usize::from(d >= at)));
    }
    fewer
}

/// The renderer's colours, in `f32`, are those of the oracle, in `f64` and by bisection.
#[test]
fn colours_are_those_of_the_oracle() {
    let table = Wavelengths::new();
    let mut random = Random(51);
    let edges = [0.0, 1e-7, 1e-6, 0.999_999, 0.999_999_9];
    for u in edges.into_iter().chain((0..2000).map(|_| random.uniform())) {
        let (single, double) = (table.at(u), spectral::colour(u.into()));
        let nm = spectral::wavelength(u.into());
        assert!((f64::from(single.nm) - nm).abs() < 1e-3, "{u}: {nm}");
        for c in 0..3 {
            assert!(
                (f64::from(single.colour[c]) - double[c]).abs() < 1e-6,
                "{u}: {single:?} {double:?}"
            );
        }
    }
}

/// Paths through glass of one index are those of RGB glass, with the colour of their wavelength,
/// once, if they touched it: smooth, rough and thin glass, every strategy.
#[test]
fn constant_index_changes_colours_only() {
    const N: usize = 4096;
    let mut random = Random(52);
    let curve = Arc::new(IndexCurve::of(|_| 1.5));
    let (mut touched, mut untouched) = (0, 0);
    for (name, mut plain) in common::scenes::all() {
        let mut glass = false;
        for m in &mut plain.materials {
            let eta = phalanx::scene::Param::Constant([1.5; 3]);
            glass |= m
                .kind
                .change(|glass: &mut DielectricMaterial| glass.eta = eta)
                || (m.kind).change(|glass: &mut ThinDielectricMaterial| glass.eta = eta);
        }
        if !glass {
            continue;
        }
        let mut dispersed = plain.clone();
        disperse(&mut dispersed, &curve);
        for m in &mut plain.materials {
            set_dispersion(&mut m.kind, None);
        }
        let worlds = [World::new(&dispersed, 4), World::new(&plain, 4)];
        assert_eq!(worlds[0].plan.dispersion, worlds[0].wavelengths.is_some());
        assert!(worlds[1].wavelengths.is_none());
        if !worlds[0].plan.dispersion {
            continue;
        }
        let mut paths = [Paths::new(&worlds[0]), Paths::new(&worlds[1])];
        let table = Wavelengths::new();
        for (plan, other) in worlds[0].plan.depths.iter().zip(&worlds[1].plan.depths) {
            assert_eq!(plan.layout.total, other.layout.total + 1);
            let mut samples = Samples::new(plan.layout.total, N);
            fill(&mut samples, &mut random);
            let fewer = without_wavelength(plan, &samples, N);
            Evaluator::EIGHT.multiplexed(&worlds[0], plan, &samples, N, &mut paths[0]);
            Evaluator::EIGHT.multiplexed(&worlds[1], other, &fewer, N, &mut paths[1]);
            for i in 0..N {
                let (ours, rgb) = (paths[0].splats.camera[i], paths[1].splats.camera[i]);
                let w = table.at(samples.row(plan.layout.wavelength)[i]).colour;
                let coloured: [f32; 3] = std::array::from_fn(|c| rgb.rgb[c] * w[c]);
                assert_eq!(ours.raster, rgb.raster);
                assert!(
                    ours.rgb == coloured || ours.rgb == rgb.rgb,
                    "{name}, depth {}, path {i}: {ours:?}, {coloured:?} or {rgb:?}",
                    plan.depth
                );
                if rgb.rgb != [0.0; 3] {
                    touched += usize::from(ours.rgb == coloured);
                    untouched += usize::from(ours.rgb == rgb.rgb);
                }
            }
        }
    }
    println!("{touched} touched, {untouched} not");
    assert!(touched > 1000 && untouched > 1000);
}

/// Paths are coloured if, and only if, a vertex that scatters is of dispersive glass: by the
/// recorded vertices.
#[test]
fn only_paths_through_glass_are_coloured() {
    let mut random = Random(53);
    let (mut some, mut none) = (0, 0);
    for (name, scene) in common::scenes::all() {
        let world = World::new(&scene, 4);
        if !world.plan.dispersion {
            continue;
        }
        let recorder = Recorder::new(&scene, &world);
        for plan in &world.plan.depths {
            for _ in 0..3000 {
                let u: Vec<f32> = (0..plan.layout.total).map(|_| random.uniform()).collect();
                let walk = recorder.walk(plan, &u);
                for path in walk.paths() {
                    let glass = path.surface.iter().any(|v| {
                        scene.materials[v.material as usize]
                            .kind
                            .dispersion()
                            .is_some()
                    });
                    let white = path.colour == [1.0; 3];
                    assert_eq!(glass, !white, "{name}");
                    some += usize::from(glass);
                    none += usize::from(!glass);
                }
            }
        }
    }
    assert!(some > 100 && none > 100, "{some} {none}");
}

/// A scene without dispersion has the primary samples it always had.
#[test]
fn no_glass_no_wavelength() {
    for (name, scene) in common::scenes::all() {
        let world = World::new(&scene, 4);
        let glass = scene
            .materials
            .iter()
            .any(|m| m.kind.dispersion().is_some());
        assert_eq!(world.plan.dispersion, glass, "{name}");
        let plan = &world.plan;
        let choices = usize::from(plan.light_choice) + usize::from(plan.mixtures);
        let per_bounce = plan.per_bounce + 2 + choices;
        let start = if plan.lens { 4 } else { 2 };
        let layout = UnidirectionalLayout::new(plan, 4);
        assert_eq!(layout.total(), start + usize::from(glass) + 4 * per_bounce);
        for plan in &world.plan.depths {
            let at = plan.layout;
            assert_eq!(at.camera_bounce - at.wavelength, usize::from(glass));
        }
    }
}

/// Lossless glass in a white sky is white from everywhere, whatever its index does: at every
/// wavelength the radiance is 1. By path tracing, through a slab at normal incidence and through a
/// ball.
#[test]
fn white_light_stays_white() {
    const N: usize = 1 << 14;
    let slab = r#"Shape "trianglemesh" "integer indices" [0 2 1 0 3 2 4 5 6 4 6 7]
        "point3 P" [-2 -2 0  2 -2 0  2 2 0  -2 2 0  -2 -2 0.5  2 -2 0.5  2 2 0.5  -2 2 0.5]"#;
    let ball = "Shape \"sphere\" \"float radius\" 1";
    let mut random = Random(54);
    for (shape, rough) in [(slab, 0.0), (ball, 0.0)] {
        let text = format!(
            r#"LookAt 0 0 -5  0 0 0  0 1 0
            Camera "orthographic" "float screenwindow" [-0.5 0.5 -0.5 0.5]
            Film "rgb" "integer xresolution" 8 "integer yresolution" 8
            WorldBegin
            LightSource "infinite" "rgb L" [1 1 1] "float scale" 1
            Material "dielectric" "spectrum eta" "glass-F11" "float roughness" {rough}
            {shape}"#
        );
        let scene = scene(&text);
        let depth = 24;
        let world = World::new(&scene, depth);
        let layout = UnidirectionalLayout::new(&world.plan, depth);
        let mut samples = Samples::new(layout.total(), N);
        let mut paths = Paths::new(&world);
        let mut means = [Mean::default(); 3];
        for _ in 0..4 {
            fill(&mut samples, &mut random);
            Evaluator::EIGHT.unidirectional(&world, &layout, &samples, N, &mut paths);
            for o in &paths.splats.camera {
                for c in 0..3 {
                    means[c].add(o.rgb[c].into());
                }
            }
        }
        for mean in means {
            // What has not left after so many bounces: less than 0.1^12.
            let off = (mean.mean() - 1.0).abs();
            assert!(
                off < normal_quantile(FALSE_ALARM) * mean.error() + 1e-5,
                "{mean:?}"
            );
            assert!(mean.error() > 1e-4, "it is not dispersed");
        }
    }
}

/// Newton's experiment: a beam of parallel light along `x`, a slit, a prism with its edge along
/// `z`, and a screen across the beam's way. The camera looks at the screen past the prism, so that
/// raster `y` is `y` on the screen.
struct Experiment {
    n: fn(f64) -> f64,
    /// Corners of the prism in the plane `z = 0`, counterclockwise; light enters by the first side
    /// and leaves by the second.
    corners: [[f64; 2]; 3],
    /// `y` of the beam's middle.
    beam: f64,
    screen: f64,
}

const HALF_VIEW: f64 = 1.5;
const SLIT: f64 = 0.3;

impl Experiment {
    fn new(n: fn(f64) -> f64) -> Self {
        // The prism's edge is up, and the beam bends down.
        Self {
            n,
            corners: [[0.05, 0.6], [-0.35, -0.4], [0.35, -0.4]],
            beam: 0.1,
            screen: 3.0,
        }
    }

    fn centre(&self) -> f64 {
        -1.1
    }

    fn text(&self, eta: &str) -> String {
        let [a, b, c] = self.corners;
        let p: Vec<String> = [-0.5, 0.5]
            .iter()
            .flat_map(|z| [a, b, c].map(|[x, y]| format!("{x} {y} {z}")))
            .collect();
        let quad = |x: f64, y0: f64, y1: f64, z: f64| {
            format!(
                "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [{x} {y0} {} {x} {y1} {} {x} {y1} {z} {x} {y0} {z}]\n",
                -z, -z
            )
        };
        let (d, m, s) = (self.screen, self.centre(), self.beam);
        format!(
            r#"LookAt {} {m} 3  {d} {m} 0  0 1 0
            Camera "orthographic" "float screenwindow" [-{HALF_VIEW} {HALF_VIEW} -{HALF_VIEW} {HALF_VIEW}]
            Film "rgb" "integer xresolution" 64 "integer yresolution" 64
            WorldBegin
            LightSource "distant" "point3 from" [-1 0 0] "point3 to" [0 0 0] "rgb L" [1 1 1]
            Material "diffuse" "rgb reflectance" [0 0 0]
            {}{}
            Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
            {}
            Material "dielectric" {eta}
            Shape "trianglemesh" "integer indices" [0 2 1  3 4 5  0 1 4  0 4 3  1 2 5  1 5 4  2 0 3  2 3 5] "point3 P" [{}]"#,
            d - 3.0,
            quad(-0.8, s + SLIT / 2.0, 0.8, 0.6),
            quad(-0.8, -0.6, s - SLIT / 2.0, 0.6),
            quad(d, m - 1.0, m + 1.0, 0.7),
            p.join(" ")
        )
    }

    /// `y` on the screen and the part that both faces let through, at a wavelength: Snell and
    /// Fresnel.
    fn ray(&self, nm: f64) -> (f64, f64) {
        let n = (self.n)(nm);
        let [a, b, c] = self.corners;
        let mut p = [-2.0, self.beam];
        let mut d = [1.0, 0.0];
        let mut through = 1.0;
        for (from, to, eta) in [(a, b, n), (c, a, 1.0 / n)] {
            let edge = [to[0] - from[0], to[1] - from[1]];
            // p + t d on the edge's line.
            let off = [from[0] - p[0], from[1] - p[1]];
            let t = (off[0] * edge[1] - off[1] * edge[0]) / (d[0] * edge[1] - d[1] * edge[0]);
            p = [p[0] + t * d[0], p[1] + t * d[1]];
            let length = edge[0].hypot(edge[1]);
            // Towards where the ray comes from.
            let mut normal = [-edge[1] / length, edge[0] / length];
            if normal[0] * d[0] + normal[1] * d[1] > 0.0 {
                normal = normal.map(|v| -v);
            }
            let cos = -(normal[0] * d[0] + normal[1] * d[1]);
            let (reflected, cos_t) = phalanx::replay::bsdf::dielectric(cos, eta);
            assert!(reflected < 1.0, "total reflection");
            through *= 1.0 - reflected;
            d = [0, 1].map(|i| d[i] / eta + (cos / eta - cos_t) * normal[i]);
        }
        (p[1] + (self.screen - p[0]) / d[0] * d[1], through)
    }

    /// Mean `y` of each channel on the screen, and the mean of its square.
    fn expected(&self) -> [[f64; 2]; 3] {
        let responses = spectrum::responses();
        std::array::from_fn(|c| {
            let mut sums = [0.0; 3];
            for (i, w) in responses.iter().enumerate() {
                let (y, through) = self.ray((spectrum::FIRST + i) as f64);
                for (k, sum) in sums.iter_mut().enumerate() {
                    *sum += w[c] * through * y.powi(k as i32);
                }
            }
            [sums[1] / sums[0], sums[2] / sums[0]]
        })
    }
}

/// Where red, green and blue fall, and how far they spread, is what Snell's law says at every
/// wavelength.
#[test]
fn a_prism_spreads_light_as_snell_says() {
    const N: usize = 1 << 14;
    const BATCHES: usize = 40;
    // Strong dispersion, so that colours are apart; and the same index at every wavelength.
    let curve: fn(f64) -> f64 = |nm| 1.35 + 35_000.0 / (nm * nm);
    let knots: Vec<String> = (360..=830)
        .map(|nm| format!("{nm} {}", curve(f64::from(nm))))
        .collect();
    let spectral = format!("\"spectrum eta\" [{}]", knots.join(" "));
    let mut random = Random(55);
    for (n, eta) in [
        (curve, spectral.as_str()),
        ((|_| 1.5) as fn(f64) -> f64, "\"float eta\" 1.5"),
    ] {
        let experiment = Experiment::new(n);
        let scene = scene(&experiment.text(eta));
        let world = World::new(&scene, 3);
        let plan = &world.plan.depths[3];
        let mut samples = Samples::new(plan.layout.total, N);
        let mut paths = Paths::new(&world);
        // Sums of 1, y and y^2 by channel and batch.
        let mut sums = vec![[[0.0; 3]; 3]; BATCHES];
        for batch in &mut sums {
            fill(&mut samples, &mut random);
            // Everything from the light: no other strategy sees the screen through the prism.
            samples.row_mut(plan.layout.strategy).fill(0.999);
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, N, &mut paths);
            for o in &paths.splats.camera {
                assert!(o.rgb == [0.0; 3] || o.s == 4);
                let y =
                    experiment.centre() + HALF_VIEW * (1.0 - 2.0 * f64::from(o.raster[1]) / 64.0);
                for c in 0..3 {
                    for k in 0..3 {
                        batch[c][k] += f64::from(o.rgb[c]) * y.powi(k as i32);
                    }
                }
            }
        }
        let expected = experiment.expected();
        for c in 0..3 {
            let total: f64 = sums.iter().map(|b| b[c][0]).sum();
            assert!(total > 0.0, "no light");
            for k in 1..=2 {
                let mean = sums.iter().map(|b| b[c][k]).sum::<f64>() / total;
                let scatter: f64 = (sums.iter())
                    .map(|b| (b[c][k] - mean * b[c][0]).powi(2))
                    .sum();
                let error = scatter.sqrt() / total;
                // Of a uniform beam, from one border to the other.
                let at = |beam: f64| {
                    let moved = Experiment {
                        beam: experiment.beam + beam,
                        ..Experiment::new(n)
                    };
                    moved.expected()[c][k - 1]
                };
                // The mean over the beam by Gauss's rule of two points, exact of the squares that
                // these are.
                let g = SLIT / 2.0 / 3f64.sqrt();
                let over_beam = 0.5 * (at(-g) + at(g));
                println!(
                    "channel {c}, moment {k}: {mean:.5} +- {error:.5}, expected {over_beam:.5} ({:.5} of a thin beam)",
                    expected[c][k - 1]
                );
                assert!((mean - over_beam).abs() < normal_quantile(FALSE_ALARM) * error + 1e-5);
            }
        }
        let mean = |c: usize| expected[c][0];
        assert!(eta.contains("float") || mean(0) - mean(1) > 0.05 && mean(1) - mean(2) > 0.05);
    }
}

/// Directions of single paths through a prism, wavelength by wavelength.
#[test]
fn directions_follow_the_wavelength() {
    let experiment = Experiment::new(|nm| 1.35 + 35_000.0 / (nm * nm));
    let curve = IndexCurve::of(experiment.n);
    let mut scene = scene(&experiment.text("\"float eta\" 1.5"));
    disperse(&mut scene, &Arc::new(curve));
    let world = World::new(&scene, 3);
    let recorder = Recorder::new(&scene, &world);
    let plan = &world.plan.depths[3];
    let mut random = Random(56);
    let mut seen = 0;
    for _ in 0..60_000 {
        let mut u: Vec<f32> = (0..plan.layout.total).map(|_| random.uniform()).collect();
        u[plan.layout.strategy] = 0.999;
        let walk = recorder.walk(plan, &u);
        let Some(path) = walk.paths().next().filter(|p| p.surface.len() == 3) else {
            continue;
        };
        // From the camera: screen, exit, entry.
        let [screen, exit, entry] = &path.surface[..] else {
            continue;
        };
        let towards = unit(sub(screen.p, exit.p));
        let inside = unit(sub(exit.p, entry.p));
        let nm = f64::from(walk.wavelength.unwrap().single.nm);
        let n = (experiment.n)(nm);
        let sine = |d: V, at: V| length(cross(d, at));
        let into = [1.0, 0.0, 0.0];
        assert!((sine(into, entry.ng) - n * sine(inside, entry.ng)).abs() < 1e-5);
        assert!((sine(towards, exit.ng) - n * sine(inside, exit.ng)).abs() < 1e-5);
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
}

/// What an index that is a spectrum means in a scene file.
#[test]
fn files_of_spectra_disperse() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a.spd"), "# index\n400 1.53\n700 1.51\n").unwrap();
    let material = |eta: &str| {
        let text =
            format!("Film \"rgb\"\nWorldBegin\nMaterial \"dielectric\" {eta}\nShape \"sphere\"\n");
        load_str(&text, "a.pbrt", dir.path()).map(|s| s.materials.last().unwrap().kind.clone())
    };
    let eta = |kind: &MaterialKind| match kind.get() {
        Some(DielectricMaterial {
            eta: phalanx::scene::Param::Constant([n, ..]),
            ..
        }) => *n,
        _ => panic!("{kind:?}"),
    };
    for (text, blue, yellow, red) in [
        ("\"spectrum eta\" \"glass-BK7\"", 1.52668, 1.51680, 1.51432),
        ("\"spectrum eta\" \"glass-F11\"", 1.82533, 1.78472, 1.77596),
        ("\"spectrum eta\" \"glass-SF11\"", 1.82533, 1.78472, 1.77596),
        (
            "\"spectrum eta\" [700 1.51 400 1.53]",
            1.52761,
            1.51750,
            1.51291,
        ),
        ("\"spectrum eta\" \"a.spd\"", 1.52761, 1.51750, 1.51291),
    ] {
        let kind = material(text).unwrap();
        let curve = kind.dispersion().unwrap_or_else(|| panic!("{text}"));
        // Mercury g, helium d, hydrogen C.
        for (nm, n) in [(435.8343, blue), (587.5618, yellow), (656.2725, red)] {
            assert!(
                (curve.at(nm) - n).abs() < 1e-4,
                "{text} {nm}: {}",
                curve.at(nm)
            );
        }
        assert!((eta(&kind) - yellow).abs() < 1e-4, "{text}");
    }
    for (text, n) in [
        ("\"float eta\" 1.4", 1.4),
        ("\"spectrum eta\" [400 1.4 700 1.4]", 1.4),
        ("\"rgb eta\" [1.3 1.4 1.5]", 1.4),
        ("", 1.5),
    ] {
        let kind = material(text).unwrap();
        assert!(kind.dispersion().is_none(), "{text}");
        assert!((eta(&kind) - n).abs() < 1e-6, "{text}");
    }
    for text in [
        "\"spectrum eta\" [400 1.5 700 -1]",
        "\"spectrum eta\" [400 0 700 1]",
        "\"spectrum eta\" [400 1.5 700]",
        "\"spectrum eta\" [0 1.5 700 1.4]",
        "\"spectrum eta\" \"glass-SF12\"",
    ] {
        let error = material(text).unwrap_err().to_string();
        assert!(error.starts_with("a.pbrt:3:"), "{error}");
    }
}

/// Path tracing and the sum over all strategies agree on a picture of a rainbow, by channel.
#[test]
fn integrators_agree_on_dispersed_light() {
    const N: usize = 1 << 14;
    let text = r#"LookAt 0 0 -4  0 0 0  0 1 0
        Camera "perspective" "float fov" 40
        Film "rgb" "integer xresolution" 8 "integer yresolution" 8
        WorldBegin
        AttributeBegin
        AreaLightSource "diffuse" "rgb L" [3 5 8] "bool twosided" true
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1.5 -1 1  -1.2 -1 1  -1.2 1 1  -1.5 1 1]
        AttributeEnd
        Material "diffuse" "rgb reflectance" [0.8 0.7 0.6]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-2 -1.5 2  2 -1.5 2  2 1.5 2  -2 1.5 2]
        Material "dielectric" "spectrum eta" [400 2 700 1.4] ROUGH
        Shape "sphere" "float radius" 1"#;
    let mut random = Random(57);
    for rough in ["", "\"float roughness\" 0.3 \"bool remaproughness\" false"] {
        let scene = scene(&text.replace("ROUGH", rough));
        let world = World::new(&scene, 4);
        let mut paths = Paths::new(&world);
        let mut traced = [Mean::default(); 3];
        let mut joined = [Mean::default(); 3];
        let layout = UnidirectionalLayout::new(&world.plan, 4);
        let mut samples = Samples::new(layout.total(), N);
        for _ in 0..24 {
            fill(&mut samples, &mut random);
            Evaluator::EIGHT.unidirectional(&world, &layout, &samples, N, &mut paths);
            for o in &paths.splats.camera {
                for c in 0..3 {
                    traced[c].add(o.rgb[c].into());
                }
            }
        }
        // A path of each depth makes one sample.
        for _ in 0..24 {
            let mut sum = vec![[0.0; 3]; N];
            for plan in &world.plan.depths {
                let mut samples = Samples::new(plan.layout.total, N);
                fill(&mut samples, &mut random);
                Evaluator::EIGHT.multiplexed(&world, plan, &samples, N, &mut paths);
                for (sum, o) in sum.iter_mut().zip(&paths.splats.camera) {
                    for c in 0..3 {
                        sum[c] += f64::from(o.rgb[c]);
                    }
                }
            }
            for rgb in sum {
                for c in 0..3 {
                    joined[c].add(rgb[c]);
                }
            }
        }
        for c in 0..3 {
            println!(
                "{rough} channel {c}: {} {}",
                traced[c].mean(),
                joined[c].mean()
            );
            assert_agree(
                &traced[c],
                &joined[c],
                FALSE_ALARM,
                &format!("channel {c} {rough}"),
            );
        }
    }
}
