//! Objects that are kept once look like copies of them.

use crate::support;

use phalanx::integrate::Width;
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, Scene};
use support::{Runs, run, settings};

/// Of 5 120 triangles, with normals.
const BALL: &str = r#"Shape "loopsubdiv" "integer levels" 4
  "point3 P" [0 -.526 .851  .851 0 .526  .851 0 -.526  -.851 0 -.526  -.851 0 .526  -.526 .851 0
    .526 .851 0  .526 -.851 0  -.526 -.851 0  0 -.526 -.851  0 .526 -.851  0 .526 .851]
  "integer indices" [1 2 6  1 7 2  3 4 5  4 3 8  6 5 11  5 6 10  9 10 2  10 9 3  7 8 9  8 7 0
    11 0 1  0 11 4  6 2 10  1 6 11  3 5 10  5 4 11  2 7 9  7 1 0  3 9 8  4 8 0]
"#;

/// Metal with shading normals, a bumpy cloth, a glass ball and a perforated sheet.
fn things() -> String {
    format!(
        r#"
AttributeBegin
Material "conductor" "float uroughness" .2 "float vroughness" .4
{BALL}
AttributeEnd
AttributeBegin
Material "diffuse" "texture reflectance" "cloth" "texture displacement" "waves"
Translate 0 0 1.2
Rotate 50 1 0 0
Shape "bilinearmesh" "point3 P" [-1 -1 0  1 -1 0  -1 1 0  1 1 .3]
AttributeEnd
AttributeBegin
Material "dielectric"
Translate 1.3 0 0
Scale .5 .8 .5
Shape "sphere"
AttributeEnd
AttributeBegin
Material "diffuse" "rgb reflectance" [.2 .7 .3]
Translate -1.5 0 0
Shape "bilinearmesh" "point3 P" [-.8 -1 .5  .2 -1 0  -.8 1 0  .2 1 0] "texture alpha" "holes"
AttributeEnd
"#
    )
}

/// Turned, mirrored and stretched.
const PLACES: [&str; 7] = [
    "Translate -3 0 0 Rotate 30 0 1 0",
    "Translate 0 0 0 Scale 1 1 -1 Rotate 20 1 1 0",
    "Translate 3.2 0 1 Scale .5 1.4 .8 Rotate 70 0 0 1",
    "Translate 0 3 0 Rotate 100 1 .3 0 Scale -.7 .7 .7",
    "Translate -3 2.8 -1 Scale .6 .6 1.5",
    "Translate 3 3 0 Rotate 200 0 1 .2 Scale 1 .3 1",
    "Translate 0 -1.2 3 Scale .2 .2 .2",
];

/// Under a lamp and a sky, on a ground.
fn scene(kept: bool) -> Scene {
    let things = things();
    let place = |what: &str| {
        let placed = PLACES.map(|place| format!("AttributeBegin\n{place}\n{what}\nAttributeEnd\n"));
        placed.concat()
    };
    let objects = if kept {
        format!("ObjectBegin \"o\"\n{things}ObjectEnd\n") + &place("ObjectInstance \"o\"")
    } else {
        place(&things)
    };
    let text = format!(
        r#"LookAt 0 3 12  0 1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "box"
Integrator "path" "integer maxdepth" 4
WorldBegin
LightSource "infinite" "rgb L" [.3 .35 .5]
AttributeBegin
Translate 0 7 3
AreaLightSource "diffuse" "rgb L" [20 18 15]
Shape "sphere" "float radius" .7
AttributeEnd
Texture "cloth" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 6 "rgb tex1" [.8 .2 .1]
  "rgb tex2" [.7 .7 .7]
Texture "waves" "float" "wrinkled"
Texture "holes" "float" "checkerboard" "float uscale" 5 "float vscale" 5 "float tex1" 1 "float tex2" 0
Material "diffuse" "rgb reflectance" [.5 .5 .5]
Shape "bilinearmesh" "point3 P" [-20 -2 -20  20 -2 -20  -20 -2 20  20 -2 20]
{objects}"#
    );
    load_str(&text, "test.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn instances_look_like_copies() {
    let [kept, copied] = [true, false].map(scene);
    assert_eq!(kept.instances.placed.len(), PLACES.len());
    assert!(copied.instances.is_empty());
    assert!(5 * kept.triangles.len() < copied.triangles.len());
    for (integrator, effort, seeds) in [
        (IntegratorKind::Pt, 16, 4),
        (IntegratorKind::Mmlt, 30, 6),
        (IntegratorKind::Bdpt, 4, 4),
    ] {
        let all = [&kept, &copied]
            .map(|scene| Runs::new(scene, &settings(scene, integrator, effort), seeds));
        let tiles = all.each_ref().map(|runs| runs.grid(4, 3));
        for (i, (a, b)) in tiles[0].iter().zip(&tiles[1]).enumerate() {
            a.expect_same_among(108, b, &format!("{integrator:?}, tile {i}"));
        }
        if integrator == IntegratorKind::Pt {
            // The same paths but for roundings: few turn out otherwise.
            let pixels = all[0].pictures[0].iter().zip(&all[1].pictures[0]);
            let differs = |(a, b): &(&[f32; 3], &[f32; 3])| (a[1] - b[1]).abs() > 0.01 * b[1];
            let off = pixels.filter(differs).count();
            println!("{off} of 1200 pixels differ");
            assert!(off < 120);
        }
    }
}

#[test]
fn instances_have_the_same_bits_in_any_lanes_and_threads() {
    let scene = scene(true);
    for integrator in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
        let mut settings = settings(&scene, integrator, 4);
        let expected = run(&scene, &settings).pixels;
        (settings.threads, settings.lanes) = (2, Width::One);
        assert!(run(&scene, &settings).pixels == expected, "{integrator:?}");
    }
}
