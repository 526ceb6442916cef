//! Scenes made in code are those of the same words in a file.

use crate::support::run;
use phalanx::integrate::Settings;
use phalanx::pbrt::{Light, Material, SceneBuilder, load_str};
use phalanx::scene::{IntegratorKind, Scene};
use std::path::Path;

const FLOOR: [[f32; 3]; 4] = [
    [-2.0, 0.0, -2.0],
    [-2.0, 0.0, 2.0],
    [2.0, 0.0, 2.0],
    [2.0, 0.0, -2.0],
];

fn built() -> SceneBuilder {
    SceneBuilder::new(24, 16)
        .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0)
        .max_depth(4)
        .material(Material::Diffuse([0.6, 0.5, 0.1]))
        .mesh(&FLOOR, &[[0, 1, 2], [0, 2, 3]])
        .emission([5.0, 4.0, 3.0])
        .sphere([1.0, 2.0, 0.3], 0.25)
        .emission([0.0; 3])
        .material(Material::Dielectric {
            eta: 1.5,
            roughness: 0.0,
        })
        .sphere([0.1, 0.5, 0.0], 0.5)
        .material(Material::Conductor {
            eta: [0.2, 0.9, 1.1],
            k: [3.9, 2.4, 2.2],
            roughness: 0.1,
        })
        .sphere([-0.9, 0.4, 0.1], 0.4)
        .light(Light::Point {
            from: [0.0, 3.0, 1.0],
            intensity: [1.0, 2.0, 3.0],
        })
}

const TEXT: &str = r#"
Film "rgb" "integer xresolution" 24 "integer yresolution" 16
Integrator "mlt" "integer maxdepth" 4
Scale -1 1 1
LookAt 0 1 4  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
Material "diffuse" "rgb reflectance" [0.6 0.5 0.1]
Shape "trianglemesh" "point3 P" [-2 0 -2  -2 0 2  2 0 2  2 0 -2] "integer indices" [0 1 2 0 2 3]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 4 3]
  Translate 1 2 0.3
  Shape "sphere" "float radius" 0.25
AttributeEnd
AttributeBegin
  Material "dielectric" "float eta" 1.5
  Translate 0.1 0.5 0
  Shape "sphere" "float radius" 0.5
AttributeEnd
AttributeBegin
  Material "conductor" "rgb eta" [0.2 0.9 1.1] "rgb k" [3.9 2.4 2.2] "float roughness" 0.1
    "bool remaproughness" false
  Translate -0.9 0.4 0.1
  Shape "sphere" "float radius" 0.4
AttributeEnd
LightSource "point" "point3 from" [0 3 1] "rgb I" [1 2 3]
"#;

#[test]
fn they_make_the_same_picture() {
    let picture = |scene: &Scene| {
        let settings = Settings {
            integrator: IntegratorKind::Bdpt,
            samples_per_pixel: 4,
            ..Settings::of(scene)
        };
        let render = run(scene, &settings);
        assert!(render.stats.b > 0.0);
        render.pixels
    };
    let written = load_str(TEXT, "written.pbrt", Path::new("")).unwrap();
    assert!(picture(&built().build().unwrap()) == picture(&written));
}

#[test]
fn the_floor_is_lit_from_above_and_x_is_to_the_right() {
    let floor = SceneBuilder::new(16, 16)
        .camera([0.0, 2.0, 0.01], [0.0, 0.0, 0.0], 60.0)
        .emission([1.0, 0.5, 0.25])
        .mesh(
            &FLOOR.map(|[x, y, z]| [x + 2.0, y, z]),
            &[[0, 1, 2], [0, 2, 3]],
        );
    let scene = floor.build().unwrap();
    let settings = Settings {
        integrator: IntegratorKind::Pt,
        samples_per_pixel: 4,
        ..Settings::of(&scene)
    };
    let pixels = run(&scene, &settings).pixels;
    assert_eq!(pixels[8 * 16 + 3], [0.0; 3]);
    let seen = pixels[8 * 16 + 13];
    assert!(
        (seen[0] - 1.0).abs() < 1e-3 && (seen[2] - 0.25).abs() < 1e-3,
        "{seen:?}"
    );
}

#[test]
fn what_cannot_be_is_an_error() {
    let none = SceneBuilder::new(0, 16).build();
    let nan = built().sphere([0.0; 3], f32::NAN).build();
    let beyond = built().mesh(&FLOOR, &[[0, 1, 9]]).build();
    for (error, word) in [(none, "resolution"), (nan, "NaN"), (beyond, "indices")] {
        let message = error.err().map(|e| e.to_string()).unwrap_or_default();
        assert!(message.contains("built scene:"), "{message}");
        assert!(message.contains(word), "{word}: {message}");
    }
}
