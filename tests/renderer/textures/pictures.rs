//! Textures in pictures: what a square shows, pixel by pixel.

use crate::support::{ROUNDING, run, scene, settings};
use glam::DVec3;
use phalanx::scene::{Param, Scene};
use phalanx::surface::texture::{Place, evaluate};

const PIXELS: u32 = 16;

/// The square `[-1, 1]^2` at `z = 0`, seen from above and lit so that it shows its reflectance.
fn square(is_v4: bool, textures: &str, shape: &str) -> Scene {
    let (film, material) = if is_v4 {
        ("rgb", "\"diffuse\" \"texture reflectance\" \"t\"")
    } else {
        ("image", "\"matte\" \"texture Kd\" \"t\"")
    };
    let pi = std::f32::consts::PI;
    let point = if is_v4 { "point3" } else { "point" };
    scene(&format!(
        "LookAt 0 0 5  0 0 0  0 1 0 Camera \"orthographic\" \"float screenwindow\" [-1 1 -1 1]
         Integrator \"path\" \"integer maxdepth\" 1
         PixelFilter \"box\" Film \"{film}\" \"integer xresolution\" {PIXELS} \"integer yresolution\" {PIXELS}
         WorldBegin
         LightSource \"distant\" \"rgb L\" [{pi} {pi} {pi}] \"{point} from\" [0 0 1] \"{point} to\" [0 0 0]
         {textures}
         Material {material}
         {}",
        shape.replace("POINT", point)
    ))
}

const SQUARE: &str = "Shape \"trianglemesh\" \"POINT P\" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] \"integer indices\" [0 1 2 0 2 3]";

/// Every pixel is within what the last texture is on its part of the square at height `z`.
fn shows_its_texture(scene: &Scene, z: f64, what: &str) {
    let picture = run(
        scene,
        &settings(scene, phalanx::scene::IntegratorKind::Pt, 16),
    );
    let texture = Param::Texture(scene.textures.len() as u32 - 1);
    let value = |raster: [f64; 2]| {
        // The image of the world is mirrored: pbrt's camera space is left-handed.
        let [x, y] = raster.map(|r| 1.0 - 2.0 * r / f64::from(PIXELS));
        let p = (DVec3::new(x, y, z) - scene.space.centre) * scene.space.scale;
        let place = Place {
            uv: [0.0; 2],
            p: p.as_vec3().to_array(),
            n: [0.0, 0.0, 1.0],
        };
        evaluate(&scene.textures, &scene.images, texture, &place)
            .map(|v| v.clamp(0.0, scene.brightest))
    };
    const STEPS: usize = 24;
    let (mut darkest, mut brightest) = (f32::INFINITY, f32::NEG_INFINITY);
    for j in 0..PIXELS as usize {
        for i in 0..PIXELS as usize {
            let grid: Vec<Vec<_>> = (0..=STEPS)
                .map(|b| {
                    let at = |k: usize, s: usize| k as f64 + s as f64 / STEPS as f64;
                    (0..=STEPS).map(|a| value([at(i, a), at(j, b)])).collect()
                })
                .collect();
            let pixel = picture.pixels[j * PIXELS as usize + i];
            for c in 0..3 {
                let all = || grid.iter().flatten().map(|v| v[c]);
                let low = all().fold(f32::INFINITY, f32::min);
                let high = all().fold(f32::NEG_INFINITY, f32::max);
                // What may lie between two points of the grid.
                let mut step = 0f32;
                for b in 0..STEPS {
                    for a in 0..STEPS {
                        let right = (grid[b][a + 1][c] - grid[b][a][c]).abs();
                        let down = (grid[b + 1][a][c] - grid[b][a][c]).abs();
                        step = step.max(right).max(down);
                    }
                }
                let slack = 0.5 * step + ROUNDING as f32;
                assert!(
                    (low - slack..=high + slack).contains(&pixel[c]),
                    "{what}, pixel {i} {j}, channel {c}: {} not in {low}..{high}",
                    pixel[c]
                );
                darkest = darkest.min(pixel[c]);
                brightest = brightest.max(pixel[c]);
            }
        }
    }
    assert!(brightest - darkest > 0.15, "{what}: {darkest} {brightest}");
}

#[test]
fn pictures_show_textures() {
    let mix = "Texture \"t\" \"spectrum\" \"mix\" \"texture amount\" \"f\" \"rgb tex1\" [.1 .2 .3] \"rgb tex2\" [.9 .8 .7]";
    for is_v4 in [false, true] {
        // What is larger for v4 is for v3, too.
        let grow = |x: f64| if is_v4 { x } else { 1.0 / x };
        for (kind, parameters) in [
            ("fbm", "\"integer octaves\" 2"),
            ("wrinkled", "\"integer octaves\" 2"),
            ("checkerboard", "\"integer dimension\" 3"),
        ] {
            let s = grow(0.3);
            let text = format!(
                "AttributeBegin Translate .1 .2 .35 Scale {s} {s} {s} Texture \"f\" \"float\" \"{kind}\" {parameters} {mix}"
            );
            // Names of v3 end with their block, so the square is in it.
            let shape = format!("AttributeBegin Identity {SQUARE} AttributeEnd AttributeEnd");
            shows_its_texture(&square(is_v4, &text, &shape), 0.0, kind);
        }
        let s = grow(0.25);
        let marble = format!(
            "TransformBegin Rotate 20 0 0 1 Scale {s} {s} {s} Texture \"t\" \"spectrum\" \"marble\" \"integer octaves\" 3"
        );
        let marble = if is_v4 {
            marble.replace("TransformBegin", "AttributeBegin") + " AttributeEnd"
        } else {
            marble + " TransformEnd"
        };
        shows_its_texture(&square(is_v4, &marble, SQUARE), 0.0, "marble");
        for (mapping, kind) in [
            ("spherical", "dots"),
            ("cylindrical", "bilerp"),
            ("planar", "checkerboard"),
        ] {
            let colors = match kind {
                "bilerp" => "\"rgb v00\" [.1 .2 .3] \"rgb v10\" [.7 .1 .9]",
                "dots" => "\"rgb inside\" [.1 .2 .3]",
                _ => "\"rgb tex1\" [.1 .2 .3]",
            };
            let text = format!(
                "Texture \"t\" \"spectrum\" \"{kind}\" \"string mapping\" \"{mapping}\" {colors} \"float udelta\" .3"
            );
            shows_its_texture(&square(is_v4, &text, SQUARE), 0.0, mapping);
        }
    }
}

/// Textures are where the world has them, not where the object was made.
#[test]
fn instances_move_through_textures() {
    for is_v4 in [false, true] {
        let blocks = "Texture \"t\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3 \"rgb tex1\" [.1 .2 .3]";
        let shape = "Translate 0 0 .5 AttributeBegin Translate 3 0 0 ObjectBegin \"o\" SQUARE ObjectEnd AttributeEnd \
                     Translate -3.25 0 -.5 Scale 1 1 1 ObjectInstance \"o\" Translate .5 0 0 ObjectInstance \"o\""
            .replace("SQUARE", SQUARE);
        let scene = square(is_v4, blocks, &shape);
        assert_eq!(scene.triangles.len(), 4);
        shows_its_texture(&scene, 0.5, "instances");
    }
}
