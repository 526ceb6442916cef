//! Lights that show an image: goniometric and projection lights, area lights. Which texel shines
//! where, by pbrt's source; densities, powers and pictures against quadrature in `f64`; images with
//! nothing in them; parameters that make no sense.

mod areas;
mod directions;
mod floors;

use crate::common;

use crate::support::write_pfm;
use common::stats::Random;
use phalanx::geometry::Geometry;
use phalanx::light::LightTable;
use phalanx::pbrt::load_str;
use phalanx::replay::vector::*;
use phalanx::scene::{LightKind, Scene};
use phalanx::simd::Vec3;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// A folder with `a.pfm`, of these texels from the top row down.
fn folder(width: u32, texels: &[[f32; 3]]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    write_pfm(&dir.path().join("a.pfm"), width, texels);
    dir
}

/// Texels that differ, some of them black.
fn pattern(width: usize, height: usize) -> Vec<[f32; 3]> {
    (0..width * height)
        .map(|i| {
            if i % 5 == 3 {
                [0.0; 3]
            } else {
                let x = i as f32;
                [1.0 + x, 0.5 + (x * 0.7).sin().abs() * 4.0, 2.0]
            }
        })
        .collect()
}

const V3: &str = "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4 PixelFilter \"box\" Camera \"perspective\" WorldBegin ";
const V4: &str = "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4 PixelFilter \"box\" Camera \"perspective\" WorldBegin ";
/// Keeps internal space that of the file: a ball about the origin whose bounds have a radius
/// between one half and one.
const BALL: &str = " Shape \"sphere\" \"float radius\" 0.5 ";

fn load(text: &str, dir: &Path) -> Result<Scene, String> {
    let scene = load_str(text, "t.pbrt", dir).map_err(|e| e.to_string())?;
    if text.contains(BALL) {
        assert_eq!(scene.space.scale, 1.0, "{text}");
        assert!(scene.space.centre.length() < 1e-9, "{text}");
    }
    Ok(scene)
}

/// What the first light sends from the origin towards unit `w`, and the density over solid angle
/// with which emission does so.
fn sent(lights: &LightTable, geometry: &Geometry, w: V) -> (V, f64) {
    let seen = lights.sample_direct::<f32>(geometry, &[0], Vec3::splat(narrow(w)), [0.5; 2]);
    assert!(seen.delta);
    let d2 = f64::from(seen.pdf);
    assert!((d2 - 1.0).abs() < 1e-5, "{d2}");
    let intensity = if seen.valid {
        wide(seen.radiance.lane(0))
    } else {
        [0.0; 3]
    };
    (intensity, f64::from(seen.emission_ratio) * d2)
}

fn mean3(c: V) -> f64 {
    (c[0] + c[1] + c[2]) / 3.0
}

/// Lights at the origin, as text, and how texel coordinates in `[0, 1]^2`, row 0 at `v = 0`, become
/// directions by pbrt's source. Each with the solid angle that the unit square has at `(u, v)`.
type Layout = (&'static str, String, fn(f64, f64) -> (V, f64));

fn layouts(width: f64, height: f64) -> Vec<(Layout, bool)> {
    // pbrt-v3: phi and theta about the light's y, phi from x to z.
    fn lat_long(u: f64, v: f64) -> (V, f64) {
        let ((sin, cos), (s, c)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
        ([sin * c, cos, sin * s], TAU * PI * sin)
    }
    // pbrt-v4: Clarberg's map about the light's y.
    fn equal_area(u: f64, v: f64) -> (V, f64) {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let inside = 1.0 - x.abs() - y.abs();
        let r = 1.0 - inside.abs();
        let phi = ((y.abs() - x.abs()) / r + 1.0) * PI / 4.0;
        let z = (1.0 - r * r) * inside.signum();
        let s = r * (2.0 - r * r).sqrt();
        let (a, b) = (phi.cos() * s * x.signum(), phi.sin() * s * y.signum());
        ([a, z, b], 4.0 * PI)
    }
    // Both: `x` and `y` over `z` within the tangents; v3 has row 0 below, v4 above. Here 7 x 5 and
    // a tangent of 0.5 for the shorter side.
    fn plane(u: f64, v: f64) -> (V, f64) {
        let (x, y) = ((2.0 * u - 1.0) * 0.7, (2.0 * v - 1.0) * 0.5);
        let d = [x, y, 1.0];
        (unit(d), 4.0 * 0.7 * 0.5 / length(d).powi(3))
    }
    fn upright(u: f64, v: f64) -> (V, f64) {
        let (w, solid) = plane(u, v);
        ([w[0], -w[1], w[2]], solid)
    }
    let fov = 2.0 * 0.5_f64.atan().to_degrees();
    let all: Vec<(Layout, bool)> = vec![
        (
            (
                "v3 goniometric",
                format!("{V3} LightSource \"goniometric\" \"string mapname\" \"a.pfm\" {BALL}"),
                lat_long,
            ),
            false,
        ),
        (
            (
                "v3 projection",
                format!(
                    "{V3} LightSource \"projection\" \"string mapname\" \"a.pfm\" \"float fov\" {fov} {BALL}"
                ),
                plane,
            ),
            false,
        ),
        (
            (
                "v4 projection",
                format!(
                    "{V4} LightSource \"projection\" \"string filename\" \"a.pfm\" \"float fov\" {fov} {BALL}"
                ),
                upright,
            ),
            true,
        ),
        (
            (
                "v4 goniometric",
                format!("{V4} LightSource \"goniometric\" \"string filename\" \"a.pfm\" {BALL}"),
                equal_area,
            ),
            true,
        ),
    ];
    let square = width == height;
    (all.into_iter())
        .filter(|((name, ..), _)| {
            name.ends_with("projection") != square || *name == "v3 goniometric"
        })
        .collect()
}

const SIZES: [(usize, usize); 2] = [(7, 5), (6, 6)];

/// Radiance of a quad and of a sphere at a texture coordinate, as pbrt-v4 looks it up: bilinear,
/// clamped, upside up.
fn shown(texels: &[[f32; 3]], width: usize, u: f64, v: f64) -> V {
    let height = texels.len() / width;
    let (x, y) = (u * width as f64 - 0.5, (1.0 - v) * height as f64 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let mut sum = [0.0; 3];
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let weight = (1.0 - (x0 + dx - x).abs()) * (1.0 - (y0 + dy - y).abs());
        let i = (x0 + dx).clamp(0.0, width as f64 - 1.0) as usize;
        let j = (y0 + dy).clamp(0.0, height as f64 - 1.0) as usize;
        sum = add(sum, scale(wide(texels[i + width * j]), weight));
    }
    sum
}

/// A lamp in the plane `y = 0.5`, whose front faces down; u runs along x, v along z.
const LAMP: &str = "AttributeBegin AreaLightSource \"diffuse\" \"string filename\" \"a.pfm\" \
    Shape \"bilinearmesh\" \"point3 P\" [-0.4 0.5 -0.3  0.4 0.5 -0.3  -0.4 0.5 0.3  0.4 0.5 0.3] \"string emissionfilename\" \"a.pfm\" AttributeEnd ";

/// Images of nothing, of one texel, with one lit texel, with values below zero: no panic, no value
/// that is no number, no light without density.
#[test]
fn odd_images_do_no_harm() {
    let mut one = vec![[0.0; 3]; 36];
    one[13] = [0.0, 2.0, 0.0];
    let mut below = pattern(6, 6);
    for t in below.iter_mut().step_by(3) {
        t[0] = -9.0;
    }
    let images: [(u32, Vec<[f32; 3]>, bool); 5] = [
        (1, vec![[0.0; 3]], false),
        (6, vec![[0.0; 3]; 36], false),
        (1, vec![[1.0, 2.0, 3.0]], true),
        (6, one, true),
        (6, below, true),
    ];
    let mut random = Random(64);
    for (width, texels, lit) in images {
        let dir = folder(width, &texels);
        let mut texts: Vec<String> = (layouts(1.0, 1.0).into_iter())
            .chain(layouts(7.0, 5.0))
            .map(|((_, text, _), _)| text)
            .collect();
        texts.push(format!("{V4} {LAMP} {BALL}"));
        texts.push(format!("{V4} AttributeBegin AreaLightSource \"diffuse\" \"string filename\" \"a.pfm\" {BALL} AttributeEnd"));
        texts.extend(
            (texts.clone().iter())
                .filter(|t| t.starts_with(V4))
                .map(|t| t.replacen("\"a.pfm\"", "\"a.pfm\" \"float power\" 3", 1)),
        );
        for text in texts {
            let scene = load(&text, dir.path()).expect("loads");
            assert_eq!(!scene.lights.is_empty(), lit, "{text}");
            if !lit {
                continue;
            }
            let geometry = Geometry::new(&scene);
            let lights = LightTable::new(&scene, &geometry);
            let mut sum = 0.0;
            for i in 0..400 {
                let u: [f32; 4] = if i == 0 {
                    [0.0; 4]
                } else if i == 1 {
                    [0.999_999_94; 4]
                } else {
                    std::array::from_fn(|_| random.uniform())
                };
                let light = [i % scene.lights.len() as u32];
                let ray = lights.sample_emission::<f32>(&geometry, &light, u);
                if ray.valid {
                    let beta = ray.beta.lane(0);
                    assert!(
                        beta.iter().all(|b| b.is_finite() && *b >= 0.0),
                        "{text}: {beta:?}"
                    );
                    assert!(ray.d_vcm.is_finite() && ray.d_vc.is_finite(), "{text}");
                    sum += beta[1];
                }
                let p = Vec3::splat(narrow(scale(random.direction(), 0.4)));
                let seen = lights.sample_direct::<f32>(&geometry, &light, p, [u[0], u[1]]);
                if seen.valid {
                    assert!(
                        seen.radiance
                            .lane(0)
                            .iter()
                            .all(|r| r.is_finite() && *r >= 0.0)
                    );
                    assert!(seen.pdf > 0.0 && seen.emission_ratio.is_finite(), "{text}");
                }
            }
            assert!(sum > 0.0, "{text}");
        }
    }
}

#[test]
fn parameters_without_sense_are_refused() {
    let dir = folder(7, &pattern(7, 5));
    let cases = [
        (
            V4,
            "LightSource \"projection\"",
            "LightSource \"projection\": needs an image",
            "\"string filename\"",
        ),
        (
            V4,
            "LightSource \"goniometric\"",
            "LightSource \"goniometric\": needs an image",
            "point light",
        ),
        (
            V4,
            "LightSource \"goniometric\" \"string filename\" \"a.pfm\"",
            "7x5",
            "square",
        ),
        (
            V3,
            "LightSource \"projection\" \"string mapname\" \"none.pfm\"",
            "none.pfm",
            "",
        ),
        (
            V3,
            "LightSource \"projection\" \"string mapname\" \"a.pfm\" \"float fov\" 180",
            "fov",
            "",
        ),
        (
            V4,
            "LightSource \"projection\" \"string filename\" \"a.pfm\" \"float fov\" 0",
            "fov",
            "between",
        ),
        (
            V3,
            "Scale 1 2 1 LightSource \"projection\" \"string mapname\" \"a.pfm\"",
            "sheared",
            "",
        ),
        (
            V3,
            "Scale 1 2 1 LightSource \"goniometric\" \"string mapname\" \"a.pfm\"",
            "sheared",
            "",
        ),
        (
            V3,
            "AreaLightSource \"diffuse\" \"string filename\" \"a.pfm\"",
            "no image",
            "v4",
        ),
        (
            V4,
            "AreaLightSource \"diffuse\" \"string filename\" \"a.pfm\" \"rgb L\" [1 1 1]",
            "exclude",
            "scale",
        ),
        (
            V4,
            "LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]",
            "portal",
            "remove it",
        ),
        (V4, "LightSource \"exinfinite\"", "unknown", "infinite"),
        (V3, "LightSource \"laser\"", "unknown", "goniometric"),
    ];
    for (head, text, what, more) in cases {
        let error = match load(&format!("{head}{text}{BALL}"), dir.path()) {
            // pbrt-v3 leaves such lights out.
            Ok(scene) if head == V3 => {
                assert_eq!(scene.warnings.len(), 1, "{text}: {:?}", scene.warnings);
                continue;
            }
            other => other.expect_err(text),
        };
        assert!(
            error.starts_with("t.pbrt:1:") && error.lines().count() == 1,
            "{error}"
        );
        assert!(
            error.contains(what) && error.contains(more),
            "{text}: {error}"
        );
    }
    // What pbrt does without an image, or under another name.
    let scene = load(
        &format!("{V3} LightSource \"goniometric\" \"rgb I\" [1 2 3] {BALL}"),
        dir.path(),
    );
    assert!(matches!(
        scene.expect("loads").lights[0].kind,
        LightKind::Point { .. }
    ));
    let scene = load(
        &format!("{V3} LightSource \"exinfinite\" {BALL}"),
        dir.path(),
    );
    assert!(matches!(
        scene.expect("loads").lights[0].kind,
        LightKind::InfiniteConstant { .. }
    ));
}

/// pbrt-v3 takes the codes of 8-bit images for linear values where lights show them, pbrt-v4
/// decodes them.
#[test]
fn codes_of_images_are_linear_in_v3_and_decoded_in_v4() {
    let dir = tempfile::tempdir().expect("a folder");
    for file in ["a.png", "a.tga", "a.bmp", "a.jpg"] {
        let grey = image::GrayImage::from_pixel(8, 8, image::Luma([128]));
        grey.save(dir.path().join(file)).expect("written");
        for light in ["infinite", "goniometric", "projection"] {
            for (head, name, truth) in [(V3, "mapname", 128.0 / 255.0), (V4, "filename", 0.215_86)]
            {
                let text =
                    format!("{head} LightSource \"{light}\" \"string {name}\" \"{file}\" {BALL}");
                let scene = load(&text, dir.path()).expect("loads");
                let texel = scene.images[0].texels[27][0];
                assert!(
                    (texel - truth).abs() < 5e-3,
                    "{file}, {head} {light}: {texel}"
                );
            }
        }
    }
}
