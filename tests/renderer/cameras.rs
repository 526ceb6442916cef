//! Cameras that see every direction, and lenses: rays follow the density they report, points find
//! their places on the film, and pictures of a constant sky are constant.

use crate::common;
use crate::support;

use common::stats::{FALSE_ALARM, Random, assert_follows};
use phalanx::camera::Camera;
use phalanx::pbrt::load_str;
use phalanx::replay::vector::*;
use phalanx::scene::{Projection, Scene, SphereMap};
use phalanx::simd::Vec3;
use std::f64::consts::{PI, TAU};
use support::{BOTH, Runs, head, scene, settings};

/// Names, and cameras with films: whole frames, frames that a filter reaches out of, a film smaller
/// than its filter, and parts of one.
fn panoramas() -> Vec<(String, Scene)> {
    let maps = [
        ("environment", "Camera \"environment\""),
        ("spherical", "Camera \"spherical\""),
        (
            "equirectangular",
            "Camera \"spherical\" \"string mapping\" \"equirectangular\"",
        ),
    ];
    let films = [
        ("whole", 32, 16, "", 0.5),
        ("filtered", 24, 16, "", 2.5),
        ("tiny", 4, 3, "", 7.0),
        ("corner", 20, 20, "[0.5 1 0.6 1]", 3.0),
        ("middle", 20, 20, "[0.3 0.8 0.2 0.6]", 1.0),
    ];
    let mut all = Vec::new();
    for (map, camera) in maps {
        for (film, w, h, crop, radius) in films {
            let crop = if crop.is_empty() {
                String::new()
            } else {
                format!("\"float cropwindow\" {crop}")
            };
            let text = format!(
                "LookAt 0.3 -0.2 0.1  -0.4 0.5 0.9  0.2 1 0\n{camera}\n\
                 Film \"image\" \"integer xresolution\" {w} \"integer yresolution\" {h} {crop}\n\
                 PixelFilter \"triangle\" \"float xwidth\" {radius} \"float ywidth\" {radius}\n\
                 WorldBegin\nLightSource \"infinite\" \"rgb L\" [1 1 1]\nShape \"sphere\" \"float radius\" 0.1\nWorldEnd\n"
            );
            let scene = load_str(&text, "t.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"));
            all.push((format!("{map}, {film}"), scene));
        }
    }
    all
}

fn towards(camera: &Camera, w: V, choice: f32) -> phalanx::camera::CameraConnection<f32> {
    let p = add(wide(camera.position()), scale(w, 0.7));
    camera.connect::<f32, false>(Vec3::splat(narrow(p)), (choice, 0.0))
}

/// Directions in cells of equal solid angle, in internal space.
const ROWS: usize = 12;
const COLUMNS: usize = 18;

fn cell(w: V) -> usize {
    let row = ((w[2] + 1.0) * 0.5 * ROWS as f64) as usize;
    let column = (w[1].atan2(w[0]) / TAU).rem_euclid(1.0) * COLUMNS as f64;
    row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1)
}

#[test]
fn rays_have_the_density_that_connections_report() {
    let mut random = Random(61);
    for (name, scene) in panoramas() {
        let camera = Camera::new(&scene.camera, &scene.film);
        let n = 100_000;
        let mut observed = vec![0.0; ROWS * COLUMNS];
        for _ in 0..n {
            let (x, y) = camera.region.place(random.uniform(), random.uniform());
            let ray = camera.ray::<f32, false>(x, y, (0.0, 0.0));
            let w = wide(ray.direction.lane(0));
            assert!((length(w) - 1.0).abs() < 1e-6);
            observed[cell(w)] += 1.0;
        }
        // Expectations by the density at many directions, jittered in strata so that edges of the
        // region average out.
        let fine = 60;
        let mut expected = vec![0.0; ROWS * COLUMNS];
        let each = 4.0 * PI / (ROWS * COLUMNS * fine * fine) as f64;
        for i in 0..ROWS * fine {
            for j in 0..COLUMNS * fine {
                let z = (i as f64 + random.uniform64()) / (ROWS * fine) as f64 * 2.0 - 1.0;
                let phi = (j as f64 + random.uniform64()) / (COLUMNS * fine) as f64 * TAU;
                let r = (1.0 - z * z).sqrt();
                let w = [r * phi.cos(), r * phi.sin(), z];
                let link = towards(&camera, w, random.uniform());
                if link.valid {
                    expected[cell(w)] += f64::from(link.pdf) * 0.49 * each * n as f64;
                }
            }
        }
        let sum: f64 = expected.iter().sum::<f64>() / n as f64;
        assert!((sum - 1.0).abs() < 5e-3, "{name}: {sum}");
        let expected: Vec<f64> = expected.iter().map(|e| e / sum).collect();
        assert_follows(&observed, &expected, FALSE_ALARM / 20.0, &name);
    }
}

#[test]
fn points_find_every_place_that_shows_them() {
    let mut random = Random(62);
    for (name, scene) in panoramas() {
        let camera = Camera::new(&scene.camera, &scene.film);
        let r = camera.region;
        let (rows, columns) = (7, 9);
        let n = 60_000;
        let mut found = vec![0.0; rows * columns];
        let mut lost = 0;
        for _ in 0..n {
            let (x, y) = r.place(random.uniform(), random.uniform());
            let ray = camera.ray::<f32, false>(x, y, (0.0, 0.0));
            let w = wide(ray.direction.lane(0));
            let link = towards(&camera, w, random.uniform());
            if !link.valid {
                // Rounded over the border.
                lost += 1;
                continue;
            }
            // The same direction and density, wherever it is seen.
            let (a, b) = link.raster;
            let again = camera.ray::<f32, false>(a, b, (0.0, 0.0));
            let apart = length(sub(wide(again.direction.lane(0)), w));
            assert!(apart < 2e-5, "{name}: {apart}");
            let back = length(add(wide(link.to_camera.lane(0)), w));
            assert!(back < 1e-6, "{name}: {back}");
            let (p, q) = (f64::from(ray.pdf), f64::from(link.pdf) * 0.49);
            // Beside a pole the density is as uncertain as the sine.
            let up = scene.camera.to_world.map(|row| f64::from(row[1]));
            let sine = length(cross(w, up));
            assert!((q / p - 1.0).abs() < 1e-5 + 2e-6 / sine, "{name}: {q} {p}");
            let slack = 1e-3;
            assert!(
                a > r.x0 - slack && a < r.x0 + r.width + slack,
                "{name}: {a}"
            );
            assert!(
                b > r.y0 - slack && b < r.y0 + r.height + slack,
                "{name}: {b}"
            );
            let at = |v: f32, start: f32, size: f32, n: usize| {
                (((v - start) / size * n as f32) as usize).min(n - 1)
            };
            found[at(b, r.y0, r.height, rows) * columns + at(a, r.x0, r.width, columns)] += 1.0;
        }
        assert!(lost < n / 10_000, "{name}: {lost} lost");
        let total: f64 = found.iter().sum();
        let expected = vec![total / (rows * columns) as f64; rows * columns];
        assert_follows(&found, &expected, FALSE_ALARM / 20.0, &name);
    }
}

/// pbrt's maps, by hand: axes of the camera at known places of the film.
#[test]
fn axes_lie_where_pbrt_has_them() {
    let at = |map: &str, place: [f32; 2], axis: V| {
        let text = format!(
            "{map}\nFilm \"image\" \"integer xresolution\" 16 \"integer yresolution\" 8\nWorldBegin\nShape \"sphere\"\nWorldEnd\n"
        );
        let scene = load_str(&text, "t.pbrt", ".".as_ref()).unwrap();
        let camera = Camera::new(&scene.camera, &scene.film);
        let ray = camera.ray::<f32, false>(place[0] * 16.0, place[1] * 8.0, (0.0, 0.0));
        let apart = length(sub(wide(ray.direction.lane(0)), axis));
        assert!(apart < 1e-6, "{map} {place:?}: {:?}", ray.direction);
    };
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let round = "Camera \"environment\"";
    at(round, [0.0, 0.5], x);
    at(round, [0.25, 0.5], z);
    at(round, [0.5, 0.5], scale(x, -1.0));
    at(round, [0.75, 0.5], scale(z, -1.0));
    at(round, [0.3, 0.0], y);
    at(round, [0.3, 1.0], scale(y, -1.0));
    // Over the pole, and round.
    at(round, [0.25, -0.5], scale(z, -1.0));
    at(round, [1.25, 0.5], z);
    let square = "Camera \"spherical\"";
    at(square, [0.5, 0.5], y);
    at(square, [1.0, 0.5], x);
    at(square, [0.5, 1.0], z);
    at(square, [0.0, 0.5], scale(x, -1.0));
    at(square, [0.5, 0.0], scale(z, -1.0));
    at(square, [0.0, 0.0], scale(y, -1.0));
    at(square, [1.0, 1.0], scale(y, -1.0));
}

/// Where every direction brings radiance 1, so does every pixel: seams, poles, corners and filters
/// included.
#[test]
fn a_constant_sky_is_constant() {
    // A white ball in it is not to be seen.
    let ball = "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [1 1 1]\n\
                Translate 0.5 1.5 1.0 Shape \"sphere\" \"float radius\" 0.5\n";
    let cameras = [
        ("environment", "Camera \"environment\""),
        ("spherical", "Camera \"spherical\""),
    ];
    let filters = [
        ("box", "PixelFilter \"box\""),
        (
            "gaussian",
            "PixelFilter \"gaussian\" \"float xwidth\" 2.0 \"float ywidth\" 2.0",
        ),
    ];
    for (map, camera) in cameras {
        for (filter, directive) in filters {
            // Depths up to 1 are whole on a convex ball.
            let text = head(12, 9, 1, camera).replace("PixelFilter \"box\"", directive) + ball;
            let scene = scene(&text);
            for kind in BOTH {
                let runs = Runs::new(&scene, &settings(&scene, kind, 48), 12);
                let name = format!("sky, {map}, {filter} {kind:?}");
                runs.show(&name.replace([' ', ','], "-"));
                let regions = runs.grid(6, 9);
                for (i, region) in regions.iter().enumerate() {
                    region.expect_among(regions.len(), 1.0, &format!("{name} region {i}"));
                }
            }
        }
    }
}

/// pbrt's orthographic camera with a lens: from a disk at the origin through a point of the window
/// in the plane in focus. An edge behind that plane is blurred as the disk is cut by the lines
/// through a point in focus.
#[test]
fn an_orthographic_lens_blurs_as_its_disk() {
    let (radius, focus, edge) = (0.6, 3.0, 5.0);
    let camera = format!(
        "LookAt 0 0 0  0 0 1  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1 1 -1 1] \"float lensradius\" {radius} \"float focaldistance\" {focus}"
    );
    let text = head(16, 4, 0, &camera)
        + &format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2] \"bool twosided\" \"true\"\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [0.1 -9 {edge} 9 -9 {edge} 9 9 {edge} 0.1 9 {edge}]\n"
        );
    let scene = scene(&text);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    // Share of the disk from which the line through (x, y, focus) is beyond 0.1 at the edge's
    // distance.
    let seen = |x: f64| {
        let n = 4000;
        let mut sum = 0.0;
        for i in 0..n {
            let l = ((i as f64 + 0.5) / n as f64 * 2.0 - 1.0) * radius;
            let chord = 2.0 * (radius * radius - l * l).sqrt();
            if l + (x - l) * edge / focus > 0.1 {
                sum += chord * 2.0 * radius / n as f64;
            }
        }
        2.0 * sum / (PI * radius * radius)
    };
    for kind in BOTH {
        let runs = Runs::new(&scene, &settings(&scene, kind, 512), 16);
        for i in 0..16 {
            let column = runs.region([i, i + 1, 0, 4], 0);
            let steps = 200;
            let truth: f64 = (0..steps)
                .map(|k| seen((f64::from(i) + (k as f64 + 0.5) / steps as f64) / 8.0 - 1.0))
                .sum::<f64>()
                / steps as f64;
            let name = format!("orthographic lens {kind:?} column {i}");
            if truth == 0.0 {
                assert_eq!(column.mean, 0.0, "{name}");
            } else {
                column.expect_among(16, truth, &name);
            }
        }
    }
}

#[test]
fn cameras_in_the_words_of_both_dialects() {
    let load = |camera: &str, film: &str| {
        let text = format!("{camera}\n{film}\nWorldBegin\nShape \"sphere\"\n");
        load_str(&text, "t.pbrt", ".".as_ref())
    };
    let (v3, v4) = ("Film \"image\"", "Film \"rgb\"");
    let map = |camera: &str, film: &str| load(camera, film).unwrap().camera.projection;
    let round = Projection::Sphere(SphereMap::Equirectangular);
    let square = Projection::Sphere(SphereMap::EqualArea);
    assert_eq!(map("Camera \"environment\"", v3), round);
    assert_eq!(map("Camera \"environment\"", v4), round);
    assert_eq!(map("Camera \"spherical\"", v4), square);
    let named = |m: &str| format!("Camera \"spherical\" \"string mapping\" \"{m}\"");
    assert_eq!(map(&named("equalarea"), v4), square);
    assert_eq!(map(&named("equirectangular"), v4), round);
    let idle = "Camera \"environment\" \"float lensradius\" 2 \"float screenwindow\" [0 0 0 0] \"float shutteropen\" 0.2";
    let scene = load(idle, v3).unwrap();
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert_eq!(scene.camera.lens_radius, 0.0);
    for (camera, message) in [
        (
            named("mercator"),
            "t.pbrt:1:1: Camera \"spherical\": mapping \"mercator\" is unknown; use equalarea or equirectangular",
        ),
        (
            "Camera \"fisheye\"".into(),
            "t.pbrt:1:1: Camera \"fisheye\": this camera is unknown; use perspective, orthographic, spherical",
        ),
    ] {
        let error = load(&camera, v4).expect_err("an error").to_string();
        assert!(error.starts_with(message), "{error}");
    }
}
