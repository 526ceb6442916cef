//! Glass whose index depends on the wavelength: where light goes, what colour it has, and that
//! nothing else changes.

mod prism;

use crate::common;

use common::stats::{FALSE_ALARM, Mean, Random, assert_agree, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::pbrt::load_str;
use phalanx::plan::DepthPlan;
use phalanx::replay::Recorder;
use phalanx::replay::spectral;
use phalanx::scene::spectrum::IndexCurve;
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
