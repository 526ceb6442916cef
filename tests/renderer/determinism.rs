//! The same seed gives the same bits: on any number of threads, at any width of SIMD, in batches of
//! any size.

use crate::support;

use phalanx::chain::mutate::Mutation;
use phalanx::chain::tune::Tune;
use phalanx::integrate::{Settings, Width};
use phalanx::pbrt::{load, load_str};
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use std::path::Path;
use support::{run, write_pfm};

/// Every kind of light, material, shape and texture at once, through an open lens, a wide filter
/// and a crop window.
fn everything() -> Scene {
    let dir = tempfile::tempdir().unwrap();
    let sky: [[f32; 3]; 32] = std::array::from_fn(|i| [0.1 * i as f32, 0.5, 3.0 / (i + 1) as f32]);
    write_pfm(&dir.path().join("sky.pfm"), 8, &sky);
    let text = r#"
LookAt 0 2 7  0 0.8 0  0 1 0
Camera "perspective" "float fov" [45] "float lensradius" [0.1] "float focaldistance" [7]
Film "image" "integer xresolution" [40] "integer yresolution" [30] "float cropwindow" [0.1 0.9 0.05 1]
PixelFilter "mitchell"
Integrator "mlt" "integer maxdepth" [6]
WorldBegin
Texture "checks" "spectrum" "checkerboard" "float uscale" [4] "float vscale" [4] "rgb tex1" [.2 .2 .1] "rgb tex2" [.7 .8 .6]
Texture "sky" "spectrum" "imagemap" "string filename" "sky.pfm"
Texture "dim" "spectrum" "scale" "texture tex1" "sky" "rgb tex2" [.3 .3 .3]
Texture "marble" "spectrum" "marble" "float variation" [2]
Texture "creases" "float" "wrinkled"
Texture "waves" "float" "windy"
Texture "mottle" "float" "fbm"
Texture "blocks" "float" "checkerboard" "integer dimension" [3] "texture tex1" "creases" "texture tex2" "mottle"
Texture "round" "spectrum" "uv" "string mapping" "spherical"
Texture "dots" "spectrum" "dots" "string mapping" "cylindrical" "texture inside" "marble" "texture outside" "round"
Texture "plane" "spectrum" "bilerp" "string mapping" "planar"
Texture "all" "spectrum" "mix" "texture tex1" "dots" "texture tex2" "plane" "texture amount" "waves"
LightSource "infinite" "string mapname" "sky.pfm" "rgb scale" [.2 .2 .2]
LightSource "infinite" "rgb L" [.05 .05 .1]
LightSource "distant" "rgb L" [.4 .4 .3] "point from" [1 2 1] "point to" [0 0 0]
LightSource "point" "rgb I" [3 2 1] "point from" [-2 3 1]
LightSource "spot" "rgb I" [9 9 12] "point from" [2 3 2] "point to" [0 0 0] "float coneangle" [30]
Material "matte" "texture Kd" "checks" "float sigma" [20]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-5 0 -5 -5 0 5 5 0 5 5 0 -5] "float uv" [0 0 0 1 1 1 1 0]
Material "matte" "texture Kd" "dim"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-5 0 -5 5 0 -5 5 4 -5 -5 4 -5] "float uv" [0 0 1 0 1 1 0 1]
  "normal N" [.2 0 1 -.2 0 1 -.2 0 1 .2 0 1]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 4 3] "bool twosided" "true"
  Translate 0 3 -1  Rotate 80 1 0 0
  Shape "disk" "float radius" [0.6]
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [2 3 4]
  Translate -2.4 0.5 1  Scale 0.3 0.5 -0.2
  Shape "sphere" "float radius" [1]
AttributeEnd
AttributeBegin
  Material "glass" "float index" [1.5]
  Translate 0.8 0.7 1.2
  Shape "sphere" "float radius" [0.7]
AttributeEnd
AttributeBegin
  Material "plastic" "texture Kd" "all" "rgb Ks" [.4 .4 .4] "texture roughness" "blocks"
  Translate -0.8 0.7 -1
  Shape "sphere" "float radius" [0.7]
AttributeEnd
AttributeBegin
  Material "metal" "float uroughness" [.05] "float vroughness" [.3]
  Translate 2.2 0.7 -0.5
  Shape "sphere" "float radius" [0.7]
AttributeEnd
AttributeBegin
  Material "mirror"
  Translate -2.5 0.9 -1.5
  Shape "loopsubdiv" "integer nlevels" [2] "integer indices" [0 1 2 0 3 1 0 2 3 1 3 2] "point P" [0 1 0 .9 -.5 0 -.5 -.5 .8 -.5 -.5 -.8]
AttributeEnd
WorldEnd
"#;
    load_str(text, "everything.pbrt", dir.path()).unwrap_or_else(|e| panic!("{e}"))
}

fn reference(name: &str) -> Scene {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    load(&dir.join(name)).unwrap()
}

/// Threads, lanes and batch of a render that differs from the first one, which has one thread,
/// eight lanes and a batch of the renderer's choice.
type Schedule = (usize, Width, Option<usize>);

/// Every axis, apart and together.
const ALL: &[Schedule] = &[
    (1, Width::One, None),
    (2, Width::Eight, None),
    (2, Width::One, None),
    (2, Width::Eight, Some(8)),
    (2, Width::Eight, Some(24)),
    (2, Width::Eight, Some(64)),
    (2, Width::Eight, Some(512)),
    // A batch of samples may hold any number.
    (1, Width::One, Some(8)),
    (1, Width::Eight, Some(13)),
];

/// Every axis once: for what adds nothing to how schedules differ.
const FEW: &[Schedule] = &[(2, Width::One, Some(24)), (2, Width::Eight, Some(512))];

/// Renders with schedules of a list and expects the bits of the first.
fn expect_one_picture(scene: &Scene, effort: [u64; 2], schedules: &[Schedule]) {
    let [samples, mutations] = effort;
    for integrator in IntegratorKind::ALL {
        let effort = match integrator {
            IntegratorKind::Mmlt => mutations,
            IntegratorKind::Pt => samples,
            IntegratorKind::Pssmlt(_) => samples.div_ceil(2).max(2),
            _ => samples.div_ceil(8),
        };
        expect_one_picture_of(scene, integrator, effort, schedules, |_| {});
    }
}

/// The same for one integrator, with changed settings.
fn expect_one_picture_of(
    scene: &Scene,
    integrator: IntegratorKind,
    effort: u64,
    schedules: &[Schedule],
    change: impl Fn(&mut Settings),
) {
    let mut plain = Settings {
        integrator,
        seed: 3,
        threads: 1,
        samples_per_pixel: effort,
        mutations_per_pixel: effort,
        // Neither of them a multiple of any batch.
        bootstrap: 3001,
        chains: 700,
        error_layers: true,
        strategies: true,
        ..Settings::of(scene)
    };
    change(&mut plain);
    let plain = plain;
    let first = run(scene, &plain);
    assert!(first.pixels.iter().flatten().any(|v| *v > 0.0));
    for &(threads, lanes, batch) in schedules {
        let settings = Settings {
            threads,
            lanes,
            batch,
            ..plain.clone()
        };
        let other = run(scene, &settings);
        let differ = (first.pixels.iter().flatten())
            .zip(other.pixels.iter().flatten())
            .filter(|(a, b)| a.to_bits() != b.to_bits())
            .count();
        assert_eq!(
            differ, 0,
            "{integrator:?}: values differ with {threads} threads, {lanes:?}, batch {batch:?}"
        );
        assert_eq!(
            first.deviation, other.deviation,
            "{integrator:?} {threads} {lanes:?} {batch:?}"
        );
        for (a, b) in first.strategies.iter().zip(&other.strategies) {
            let same = a.weighted == b.weighted && a.unweighted == b.unweighted;
            assert!(same, "{:?} {threads} {lanes:?} {batch:?}", a.strategy);
        }
        let figures = |r: &phalanx::integrate::Render| {
            let s = &r.stats;
            (
                s.mutations,
                s.samples,
                s.rays,
                s.b,
                s.b_stderr,
                s.acceptance_large,
                s.acceptance_small,
                s.relmse,
                s.tiles.clone(),
                s.depths.clone(),
            )
        };
        assert_eq!(
            figures(&first),
            figures(&other),
            "{integrator:?} {threads} {lanes:?} {batch:?}"
        );
    }
    let other_seed = run(scene, &Settings { seed: 4, ..plain });
    assert_ne!(
        first.pixels, other_seed.pixels,
        "{integrator:?} ignores the seed"
    );
}

#[test]
fn every_feature_at_once() {
    expect_one_picture(&everything(), [16, 64], ALL);
}

/// Smooth, rough and thin glass that disperses light.
#[test]
fn dispersion() {
    let text = r#"
LookAt 0 1 6  0 0.6 0  0 1 0
Camera "perspective" "float fov" [40]
Film "rgb" "integer xresolution" [30] "integer yresolution" [24]
Integrator "mlt" "integer maxdepth" [5]
WorldBegin
LightSource "infinite" "rgb L" [.2 .2 .3]
LightSource "spot" "rgb I" [30 30 30] "point3 from" [-4 3 0] "point3 to" [0 0.5 0] "float coneangle" [15]
Material "diffuse"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-5 0 -5 -5 0 5 5 0 5 5 0 -5]
AttributeBegin
  Material "dielectric" "spectrum eta" "glass-F11"
  Translate -0.8 0.7 0
  Shape "sphere" "float radius" [0.7]
AttributeEnd
AttributeBegin
  Material "dielectric" "spectrum eta" [400 1.7 700 1.4] "float roughness" [.1]
  Translate 0.8 0.7 0
  Shape "sphere" "float radius" [0.7]
AttributeEnd
Material "thindielectric" "spectrum eta" "glass-BK7"
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 0 1.5 1 0 1.5 1 1 1.5 -1 1 1.5]
"#;
    let scene = load_str(text, "glass.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"));
    expect_one_picture(&scene, [8, 32], FEW);
}

/// Other distributions of mutations, tuned by chains of their own.
#[test]
fn mutations() {
    let scene = reference("cornell-glass.pbrt");
    let whole = IntegratorKind::Pssmlt(PathSamplerKind::Bdpt);
    for (integrator, mutation, sigma, large_step) in [
        (IntegratorKind::Mmlt, Mutation::Kelemen, false, false),
        (IntegratorKind::Mmlt, Mutation::Cauchy, true, false),
        (IntegratorKind::Mmlt, Mutation::Gaussian, true, true),
        (whole, Mutation::Kelemen, true, true),
    ] {
        expect_one_picture_of(&scene, integrator, 2, FEW, |s| {
            s.mutation = mutation;
            s.tune = Tune { sigma, large_step };
        });
    }
}

/// The reference scenes, of which the path tracer's and the bootstrap's work is the larger part
/// here.
#[test]
fn reference_scenes() {
    for name in [
        "cornell-glass.pbrt",
        "env-lens.pbrt",
        "deltas.pbrt",
        "room-v4.pbrt",
    ] {
        let mut scene = reference(name);
        // A fifth of the side: bits of pixels do not depend on how many there are.
        let film = [scene.film.width, scene.film.height].map(|side| side.div_ceil(5));
        scene.set_resolution(film[0], film[1]).unwrap();
        expect_one_picture(&scene, [2, 4], FEW);
    }
}
