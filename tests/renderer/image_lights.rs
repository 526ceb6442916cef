//! Lights that show an image: goniometric and projection lights, area lights. Which texel shines
//! where, by pbrt's source; densities, powers and pictures against quadrature in `f64`; images with
//! nothing in them; parameters that make no sense.

use crate::common;

use common::stats::{FALSE_ALARM, Mean, Random, assert_follows, normal_quantile};
use phalanx::film::output::{Picture, write};
use phalanx::geometry::Geometry;
use phalanx::integrate::{Settings, Silent, render};
use phalanx::light::LightTable;
use phalanx::pbrt::load_str;
use phalanx::replay::vector::*;
use phalanx::scene::{IntegratorKind, LightKind, Scene};
use phalanx::simd::Vec3;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// A folder with `a.pfm`, of these texels from the top row down.
fn folder(width: u32, texels: &[[f32; 3]]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    let height = texels.len() as u32 / width;
    let picture = Picture {
        width,
        height,
        offset: [0, 0],
        full: [width, height],
        pixels: texels.to_vec(),
    };
    write(
        &dir.path().join("a.pfm"),
        &picture,
        &[],
        &phalanx::formats::tone::Display::LINEAR,
    )
    .expect("a written image");
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

#[test]
fn every_texel_shines_where_pbrt_has_it() {
    for (width, height) in SIZES {
        let texels = pattern(width, height);
        let dir = folder(width as u32, &texels);
        for ((name, text, direction), v4) in layouts(width as f64, height as f64) {
            let scene = load(&text, dir.path()).expect("loads");
            let geometry = Geometry::new(&scene);
            let lights = LightTable::new(&scene, &geometry);
            for (i, texel) in texels.iter().enumerate() {
                let u = ((i % width) as f64 + 0.5) / width as f64;
                let v = ((i / width) as f64 + 0.5) / height as f64;
                let (got, _) = sent(&lights, &geometry, direction(u, v).0);
                // v4's goniometric light takes the mean of the channels.
                let mut want = texel.map(f64::from);
                if v4 && name.contains("gonio") {
                    want = [mean3(want); 3];
                }
                for c in 0..3 {
                    // At the centre of a texel both ways of looking it up agree; `f32` directions
                    // are off it by some 1e-6 of the contrast.
                    assert!(
                        (got[c] - want[c]).abs() < 4e-4,
                        "{name} {i}: {got:?} {want:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn transforms_turn_the_image() {
    let dir = folder(7, &pattern(7, 5));
    for ((name, text, direction), _) in layouts(7.0, 5.0) {
        let plain = load(&text, dir.path()).expect("loads");
        let turned = text
            .replace(
                "WorldBegin",
                "WorldBegin AttributeBegin Rotate 50 1 2 3 Scale -2 2 2",
            )
            .replace(BALL, &format!(" AttributeEnd {BALL}"));
        let turned = load(&turned, dir.path()).expect("loads");
        let axis = unit([1.0, 2.0, 3.0]);
        let (sin, cos) = 50f64.to_radians().sin_cos();
        let rotate = |v: V| {
            let side = cross(axis, v);
            add(
                add(scale(v, cos), scale(side, sin)),
                scale(axis, dot(axis, v) * (1.0 - cos)),
            )
        };
        let (ga, gb) = (Geometry::new(&plain), Geometry::new(&turned));
        let (a, b) = (LightTable::new(&plain, &ga), LightTable::new(&turned, &gb));
        for i in 0..40 {
            let (w, _) = direction(0.013 + i as f64 / 41.0, 0.5 + 0.4 * (i as f64).sin());
            let (want, pdf) = sent(&a, &ga, w);
            let (got, other) = sent(&b, &gb, rotate([-w[0], w[1], w[2]]));
            for c in 0..3 {
                assert!((got[c] - want[c]).abs() < 1e-3, "{name}: {got:?} {want:?}");
            }
            assert!((pdf - other).abs() <= 1e-3 * pdf, "{name}: {pdf} {other}");
        }
    }
}

/// Emission follows the density that it reports, the density integrates to one, and the flux is
/// that of the image.
#[test]
fn emission_follows_the_image() {
    let mut random = Random(61);
    for (width, height) in SIZES {
        let dir = folder(width as u32, &pattern(width, height));
        for ((name, text, direction), _) in layouts(width as f64, height as f64) {
            let scene = load(&text, dir.path()).expect("loads");
            let geometry = Geometry::new(&scene);
            let lights = LightTable::new(&scene, &geometry);
            // Sub-texel cells, in which densities are smooth.
            let fine = 16;
            let (columns, rows) = (width * fine, height * fine);
            let mut expected = vec![0.0; width * height];
            let mut flux = 0.0;
            for j in 0..rows {
                for i in 0..columns {
                    let (u, v) = (
                        (i as f64 + 0.5) / columns as f64,
                        (j as f64 + 0.5) / rows as f64,
                    );
                    let (w, solid) = direction(u, v);
                    let (intensity, pdf) = sent(&lights, &geometry, w);
                    let cell = solid / (columns * rows) as f64;
                    expected[i / fine + width * (j / fine)] += pdf * cell;
                    flux += mean3(intensity) * cell;
                }
            }
            let total: f64 = expected.iter().sum();
            assert!((total - 1.0).abs() < 2e-3, "{name}: {total}");
            let n = 20_000;
            let mut observed = vec![0.0; width * height];
            let mut beta = Mean::default();
            for _ in 0..n {
                let u = std::array::from_fn(|_| random.uniform());
                let ray = lights.sample_emission::<f32>(&geometry, &[0], u);
                let w = wide(ray.direction.lane(0));
                let (x, y) = texel_of(w, direction, width, height);
                observed[x + width * y] += 1.0;
                let (intensity, pdf) = sent(&lights, &geometry, w);
                let valid = if ray.valid {
                    mean3(wide(ray.beta.lane(0)))
                } else {
                    0.0
                };
                beta.add(valid);
                // At the border of a texel rounding decides whose density it is.
                if ray.valid
                    && intensity != [0.0; 3]
                    && (f64::from(ray.d_vcm) * pdf - 1.0).abs() < 1e-3
                {
                    let want = mean3(intensity) / pdf;
                    // Towards a black texel little is left of a direction as rounded.
                    let slack = 2e-3 * want + 1e-5 * flux;
                    assert!((valid - want).abs() < slack, "{name}: {valid} {want}");
                }
            }
            let expected: Vec<f64> = (expected.iter())
                .map(|e| e / total * f64::from(n))
                .collect();
            assert_follows(&observed, &expected, FALSE_ALARM / 8.0, name);
            let bound = normal_quantile(FALSE_ALARM) * beta.error() + 2e-3 * flux;
            assert!(
                (beta.mean() - flux).abs() < bound,
                "{name}: {} is {flux} +- {bound}",
                beta.mean()
            );
        }
    }
}

/// The texel whose directions hold `w`, by search: no inverse is trusted.
fn texel_of(
    w: V,
    direction: fn(f64, f64) -> (V, f64),
    width: usize,
    height: usize,
) -> (usize, usize) {
    let (mut best, mut at) = (-2.0, (0.5, 0.5));
    let n = 3;
    for j in 0..height * n {
        for i in 0..width * n {
            let (u, v) = (
                (i as f64 + 0.5) / (width * n) as f64,
                (j as f64 + 0.5) / (height * n) as f64,
            );
            let close = dot(direction(u, v).0, w);
            if close > best {
                (best, at) = (close, (u, v));
            }
        }
    }
    // Downhill from there.
    let mut step = 0.5 / (n * width.min(height)) as f64;
    while step > 1e-9 {
        let mut moved = false;
        for i in 0..9 {
            let (du, dv) = (step * f64::from(i % 3 - 1), step * f64::from(i / 3 - 1));
            let u = (at.0 + du).clamp(0.0, 1.0 - 1e-12);
            let v = (at.1 + dv).clamp(0.0, 1.0 - 1e-12);
            let close = dot(direction(u, v).0, w);
            if close > best {
                (best, at, moved) = (close, (u, v), true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    (
        (at.0 * width as f64) as usize,
        (at.1 * height as f64) as usize,
    )
}

/// v4's `power` is the luminous flux.
#[test]
fn power_is_what_leaves_the_light() {
    let luminance = |c: V| 0.212671 * c[0] + 0.715160 * c[1] + 0.072169 * c[2];
    for (width, height) in SIZES {
        let dir = folder(width as u32, &pattern(width, height));
        for ((name, text, direction), v4) in layouts(width as f64, height as f64) {
            if !v4 {
                continue;
            }
            let text = text.replace("\"a.pfm\"", "\"a.pfm\" \"float power\" 7 \"float scale\" 2");
            let scene = load(&text, dir.path()).expect("loads");
            let geometry = Geometry::new(&scene);
            let lights = LightTable::new(&scene, &geometry);
            let mut flux = 0.0;
            for (i, j) in (0..height).flat_map(|j| (0..width).map(move |i| (i, j))) {
                let (u, v) = (
                    (i as f64 + 0.5) / width as f64,
                    (j as f64 + 0.5) / height as f64,
                );
                let (w, solid) = direction(u, v);
                flux += luminance(sent(&lights, &geometry, w).0) * solid / (width * height) as f64;
            }
            // pbrt weighs texels by the solid angle at their centres, as here.
            assert!((flux / 14.0 - 1.0).abs() < 1e-4, "{name}: {flux}");
        }
    }
}

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

#[test]
fn area_lights_show_their_image() {
    let texels = pattern(7, 5);
    let dir = folder(7, &texels);
    let mut random = Random(62);
    let text = format!("{V4} {LAMP} {BALL}");
    let scene = load(&text, dir.path()).expect("loads");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!(matches!(
        scene.lights[0].kind,
        LightKind::ImageTriangle { .. }
    ));
    let geometry = Geometry::new(&scene);
    let lights = LightTable::new(&scene, &geometry);
    let mut lit = 0;
    for _ in 0..2000 {
        let p = narrow([random.uniform64() - 0.5, -0.4, random.uniform64() - 0.5]);
        let light = [random.below(2) as u32];
        let u = [random.uniform(), random.uniform()];
        let seen = lights.sample_direct::<f32>(&geometry, &light, Vec3::splat(p), u);
        let at = wide(seen.end.lane(0));
        let want = shown(&texels, 7, at[0] / 0.8 + 0.5, at[2] / 0.6 + 0.5);
        let got = wide(seen.radiance.lane(0));
        for c in 0..3 {
            assert!((got[c] - want[c]).abs() < 1e-3, "{at:?}: {got:?} {want:?}");
        }
        lit += usize::from(seen.valid);
        // Chance sees the same, at the place that these barycentric coordinates are.
        let root = u[0].sqrt();
        let cos = -wide(seen.to_light.lane(0))[1].abs();
        let chance = lights.emitted::<f32>(
            &geometry,
            &light,
            seen.end,
            -cos as f32,
            [u[1] * root, 1.0 - root],
        );
        assert_eq!(chance.radiance.lane(0), seen.radiance.lane(0));
    }
    assert!(lit > 1500, "{lit}");

    // A sphere: u with the azimuth, v from the south pole up.
    let text = format!(
        "{V4} AttributeBegin AreaLightSource \"diffuse\" \"string filename\" \"a.pfm\" \"float scale\" 2 {BALL} AttributeEnd"
    );
    let scene = load(&text, dir.path()).expect("loads");
    let geometry = Geometry::new(&scene);
    let lights = LightTable::new(&scene, &geometry);
    for _ in 0..2000 {
        let p = narrow(scale(random.direction(), 3.0));
        let u = [random.uniform(), random.uniform()];
        let seen = lights.sample_direct::<f32>(&geometry, &[0], Vec3::splat(p), u);
        let w = unit(wide(seen.end.lane(0)));
        let v = 1.0 - w[2].acos() / PI;
        let u = w[1].atan2(w[0]).rem_euclid(TAU) / TAU;
        if u.min(1.0 - u) < 1e-4 || 1.0 - w[2].abs() < 1e-3 {
            // The seam and the poles.
            continue;
        }
        let want = scale(shown(&texels, 7, u, v), 2.0);
        let got = wide(seen.radiance.lane(0));
        for c in 0..3 {
            assert!((got[c] - want[c]).abs() < 2e-2, "{w:?}: {got:?} {want:?}");
        }
        let chance = lights.emitted::<f32>(&geometry, &[0], seen.end, 1.0, [0.0; 2]);
        for c in 0..3 {
            let off = f64::from(chance.radiance.lane(0)[c]) - want[c];
            assert!(off.abs() < 2e-2, "{w:?}: {off}");
        }
    }
}

/// The flux of emission and the choice of lights, which goes by power, follow the image over each
/// light's own part of it.
#[test]
fn area_lights_have_the_power_of_their_image() {
    let texels = pattern(7, 5);
    let dir = folder(7, &texels);
    let mut random = Random(63);
    // The two triangles of the quad see different halves of the image.
    let scene = load(&format!("{V4} {LAMP} {BALL}"), dir.path()).expect("loads");
    let geometry = Geometry::new(&scene);
    let half = |light: u32| {
        let LightKind::ImageTriangle { triangle, .. } = scene.lights[light as usize].kind else {
            panic!("an image")
        };
        let [a, b, c] = (scene.triangles[triangle as usize].v)
            .map(|i| scene.vertices[i as usize].uv.map(f64::from));
        let n = 200;
        let mut sum = 0.0;
        for k in 0..n * n {
            let (s, t) = (
                ((k % n) as f64 + 0.5) / n as f64,
                ((k / n) as f64 + 0.5) / n as f64,
            );
            let root = s.sqrt();
            let (b1, b2) = (t * root, 1.0 - root);
            let at = |i: usize| a[i] + b1 * (b[i] - a[i]) + b2 * (c[i] - a[i]);
            sum += mean3(shown(&texels, 7, at(0), at(1))) / (n * n) as f64;
        }
        sum
    };
    let means = [half(0), half(1)];
    assert!((means[0] / means[1] - 1.0).abs() > 0.05, "{means:?}");
    let lights = LightTable::new(&scene, &geometry);
    let chosen = (0..10_000)
        .filter(|i| lights.choose::<f32>((*i as f32 + 0.5) / 1e4, 1)[0] == 0)
        .count();
    let share = means[0] / (means[0] + means[1]);
    assert!(
        (chosen as f64 / 1e4 - share).abs() < 0.01,
        "{chosen} {share}"
    );
    for light in 0..2 {
        let mut alone = scene.clone();
        alone.lights = vec![scene.lights[light].clone()];
        let lights = LightTable::new(&alone, &geometry);
        let mut flux = Mean::default();
        for _ in 0..20_000 {
            let u = std::array::from_fn(|_| random.uniform());
            let ray = lights.sample_emission::<f32>(&geometry, &[0], u);
            flux.add(if ray.valid {
                mean3(wide(ray.beta.lane(0)))
            } else {
                0.0
            });
        }
        let area = 0.24 * scene.space.scale.powi(2);
        let power = means[light] * PI * area;
        let bound = normal_quantile(FALSE_ALARM) * flux.error() + 1e-3 * power;
        assert!(
            (flux.mean() - power).abs() < bound,
            "{} {power}",
            flux.mean()
        );
    }
    // v4's power: of the mean luminance of the whole image, on both sides.
    let text = LAMP.replace(
        "\"a.pfm\" Shape",
        "\"a.pfm\" \"float power\" 3 \"bool twosided\" true Shape",
    );
    let scene = load(&format!("{V4} {text} {BALL}"), dir.path()).expect("loads");
    let y = |c: [f32; 3]| 0.212671 * c[0] + 0.715160 * c[1] + 0.072169 * c[2];
    let mean: f32 = texels.iter().map(|t| y(*t)).sum::<f32>() / texels.len() as f32;
    let LightKind::ImageTriangle {
        scale,
        two_sided: true,
        ..
    } = scene.lights[0].kind
    else {
        panic!("two sides")
    };
    let want = 3.0 / (2.0 * 0.48 * std::f32::consts::PI * mean);
    assert!((scale / want - 1.0).abs() < 1e-5, "{scale} {want}");
}

/// Mean radiance of the floor `y = -0.5`, `|x|, |z| <= 0.5`, that `view` shows, over runs of both
/// integrators.
fn floor_is(text: &str, dir: &Path, truth: V, name: &str) {
    let scene = load(text, dir).expect("loads");
    for integrator in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
        let mut runs = [Mean::default(), Mean::default(), Mean::default()];
        for seed in 0..12 {
            let settings = Settings {
                integrator,
                threads: 1,
                seed,
                samples_per_pixel: 128,
                mutations_per_pixel: 256,
                bootstrap: 4096,
                chains: 64,
                ..Settings::of(&scene)
            };
            let render = render(&scene, &settings, &Silent).expect("renders");
            for (c, run) in runs.iter_mut().enumerate() {
                let sum: f64 = render.pixels.iter().map(|p| f64::from(p[c])).sum();
                run.add(sum / render.pixels.len() as f64);
            }
        }
        for c in 0..3 {
            let (got, want) = (runs[c].mean(), truth[c]);
            // 9.3 standard errors are exceeded in one of a million cases with 11 degrees of freedom
            // (Student's distribution).
            let bound = 9.3 * runs[c].error() + 1e-4 * want;
            assert!(
                (got - want).abs() < bound,
                "{name}, {integrator:?}, channel {c}: {got} is {want} +- {bound}"
            );
        }
    }
}

/// An orthographic camera over the floor; nothing but the floor reflects, so that light is
/// scattered once.
fn view(head: &str) -> String {
    let camera = "LookAt 0 0 0  0 -1 0  0 0 1 Camera \"orthographic\" \"float screenwindow\" [-0.5 0.5 -0.5 0.5] Integrator \"path\" \"integer maxdepth\" 2 ";
    let floor = if head == V3 {
        "AttributeBegin Material \"matte\" \"rgb Kd\" [0.6 0.6 0.6] Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-0.5 -0.5 -0.5 -0.5 -0.5 0.5 0.5 -0.5 0.5 0.5 -0.5 -0.5] AttributeEnd "
    } else {
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.6 0.6 0.6] Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-0.5 -0.5 -0.5 -0.5 -0.5 0.5 0.5 -0.5 0.5 0.5 -0.5 -0.5] AttributeEnd "
    };
    head.replace(
        "Camera \"perspective\" WorldBegin",
        &format!("{camera} WorldBegin {floor}"),
    )
}

/// Pictures of a floor under each light are what quadrature says, by both integrators: all their
/// strategies together.
#[test]
fn floors_are_lit_as_quadrature_says() {
    let n = 240;
    for (width, height) in SIZES {
        let dir = folder(width as u32, &pattern(width, height));
        for ((name, text, _), v4) in layouts(width as f64, height as f64) {
            let head = if v4 { V4 } else { V3 };
            let light = text.replace(head, "").replace(BALL, "");
            // The light at (0.1, 0.3, 0), its z axis down.
            let placed = format!(
                "{} AttributeBegin Translate 0.1 0.3 0 Rotate 80 1 0 0.1 {light} AttributeEnd",
                view(head)
            );
            let scene = load(&placed, dir.path()).expect("loads");
            let geometry = Geometry::new(&scene);
            let lights = LightTable::new(&scene, &geometry);
            let mut truth = [0.0; 3];
            for k in 0..n * n {
                let at = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
                let p = [at(k % n), -0.5, at(k / n)];
                let internal: V =
                    std::array::from_fn(|c| (p[c] - scene.space.centre[c]) * scene.space.scale);
                let seen = lights.sample_direct::<f32>(
                    &geometry,
                    &[0],
                    Vec3::splat(narrow(internal)),
                    [0.5; 2],
                );
                if seen.valid {
                    let cos = f64::from(seen.to_light.lane(0)[1]);
                    let irradiance = scale(wide(seen.radiance.lane(0)), cos / f64::from(seen.pdf));
                    truth = add(truth, scale(irradiance, 0.6 / PI / (n * n) as f64));
                }
            }
            assert!(truth[0] > 0.05, "{name}: {truth:?}");
            floor_is(&placed, dir.path(), truth, name);
        }
    }
    // The lamp, from formulas alone.
    let texels = pattern(7, 5);
    let dir = folder(7, &texels);
    let (n, m) = (24, 40);
    let mut truth = [0.0; 3];
    for k in 0..n * n {
        let at = |i: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        let p = [at(k % n), -0.5, at(k / n)];
        for l in 0..m * m {
            let (u, v) = (
                ((l % m) as f64 + 0.5) / m as f64,
                ((l / m) as f64 + 0.5) / m as f64,
            );
            let q = [0.8 * (u - 0.5), 0.5, 0.6 * (v - 0.5)];
            let d = sub(q, p);
            let d2 = dot(d, d);
            let geometry = (d[1] * d[1] / d2) / d2 * 0.48 / (m * m) as f64;
            truth = add(
                truth,
                scale(
                    shown(&texels, 7, u, v),
                    geometry * 0.6 / PI / (n * n) as f64,
                ),
            );
        }
    }
    let black = LAMP.replace(
        "Shape",
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape",
    );
    floor_is(
        &format!("{} {black}", view(V4)),
        dir.path(),
        truth,
        "image lamp",
    );
}

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

/// Whatever it is made of, an emissive surface shows its own radiance where nothing else shines.
#[test]
fn everything_can_emit() {
    let materials = [
        (V3, "\"matte\""),
        (V3, "\"mirror\""),
        (V3, "\"glass\""),
        (V3, "\"metal\""),
        (V3, "\"none\""),
        (V3, "\"\""),
        (V4, "\"thindielectric\""),
        (V4, "\"diffusetransmission\""),
    ];
    let shapes = [
        "Shape \"sphere\" \"float radius\" 0.4",
        "ReverseOrientation Shape \"disk\" \"float radius\" 2",
        "Shape \"disk\" \"float radius\" 2",
    ];
    for (head, material) in materials {
        for shape in shapes {
            for two_sided in ["true", "false"] {
                let camera = "LookAt 0 0 -3 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 4 Integrator \"path\" \"integer maxdepth\" 0 ";
                let quoted = if head == V3 {
                    format!("\"{two_sided}\"")
                } else {
                    two_sided.into()
                };
                let text = head.replace(
                    "Camera \"perspective\" WorldBegin",
                    &format!("{camera} WorldBegin"),
                ) + &format!(
                    "Material {material} AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"bool twosided\" {quoted} {shape}"
                );
                let scene = load(&text, Path::new(".")).expect("loads");
                assert!(!scene.lights.is_empty());
                let settings = Settings {
                    integrator: IntegratorKind::Pt,
                    threads: 1,
                    samples_per_pixel: 2,
                    ..Settings::of(&scene)
                };
                let render = render(&scene, &settings, &Silent).expect("renders");
                // A disk's normal is +z, away from the camera.
                let front =
                    shape.contains("sphere") || shape.contains("Reverse") || two_sided == "true";
                let want = if front { [1.0, 2.0, 3.0] } else { [0.0; 3] };
                for pixel in &render.pixels {
                    for c in 0..3 {
                        assert!((pixel[c] - want[c]).abs() < 1e-5, "{text}: {pixel:?}");
                    }
                }
            }
        }
    }
}

/// v3's "none": what lies behind an emissive surface is seen through it, and its light is whole.
#[test]
fn emissive_surfaces_of_none_let_rays_through() {
    let camera = "LookAt 0 0 -3 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 4 Integrator \"path\" \"integer maxdepth\" 3 ";
    let text = V3.replace(
        "Camera \"perspective\" WorldBegin",
        &format!("{camera} WorldBegin"),
    ) + "AttributeBegin Material \"none\" AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" \"true\" Shape \"disk\" \"float radius\" 2 AttributeEnd \
           Translate 0 0 1 Material \"matte\" \"rgb Kd\" [0 0 0] AreaLightSource \"diffuse\" \"rgb L\" [4 2 0] \"bool twosided\" \"true\" Shape \"disk\" \"float radius\" 2";
    let scene = load(&text, Path::new(".")).expect("loads");
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    for integrator in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
        let settings = Settings {
            integrator,
            threads: 1,
            samples_per_pixel: 2,
            mutations_per_pixel: 4000,
            ..Settings::of(&scene)
        };
        let render = render(&scene, &settings, &Silent).expect("renders");
        for c in 0..3 {
            let sum: f64 = render.pixels.iter().map(|p| f64::from(p[c])).sum();
            let want = [5.0, 3.0, 1.0][c];
            let got = sum / render.pixels.len() as f64;
            // What both integrators do here has no variance but that of the shares of depths.
            assert!(
                (got / want - 1.0).abs() < 0.03,
                "{integrator:?}: {got} {want}"
            );
        }
    }
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

/// pbrt-v3 repeats maps at the poles, so that half of what lies there is of the other pole; pbrt-v4
/// looks up the nearest texel.
#[test]
fn maps_meet_at_the_poles_in_v3_and_are_not_filtered_in_v4() {
    let rows = [1.0, 3.0, 5.0, 7.0];
    let texels: Vec<[f32; 3]> = (0..16).map(|i| [rows[i / 4]; 3]).collect();
    let dir = folder(4, &texels);
    let table = |text: &str| {
        let scene = load(text, dir.path()).expect("loads");
        LightTable::new(&scene, &Geometry::new(&scene))
    };
    let sky = table(&format!(
        "{V3} LightSource \"infinite\" \"string mapname\" \"a.pfm\" {BALL}"
    ));
    let gonio = table(&format!(
        "{V3} LightSource \"goniometric\" \"string mapname\" \"a.pfm\" {BALL}"
    ));
    let seen = |angle: f64| {
        let w = [angle.sin(), 0.0, angle.cos()];
        f64::from(sky.escaped::<f32>(0, Vec3::splat(narrow(w))).radiance.x)
    };
    // Rows' centres lie at odd eighths of half a turn.
    for (eighths, value) in [
        (0.001, 4.0),
        (0.5, 2.5),
        (1.0, 1.0),
        (2.0, 2.0),
        (7.0, 7.0),
        (7.5, 5.5),
        (7.999, 4.0),
    ] {
        let angle = eighths * PI / 8.0;
        assert!(
            (seen(angle) - value).abs() < 5e-3,
            "{eighths}: {}",
            seen(angle)
        );
        let scene = load(&format!("{V3} {BALL}"), dir.path()).expect("loads");
        let geometry = Geometry::new(&scene);
        // The pole of the map is the light's y.
        let (sent, _) = self::sent(&gonio, &geometry, [angle.sin(), angle.cos(), 0.0]);
        assert!((sent[0] - value).abs() < 5e-3, "{eighths}: {sent:?}");
    }
    let sky = table(&format!(
        "{V4} LightSource \"infinite\" \"string filename\" \"a.pfm\" {BALL}"
    ));
    let mut random = Random(5);
    for _ in 0..1000 {
        let w = narrow(random.direction());
        let value = sky.escaped::<f32>(0, Vec3::splat(w)).radiance.x;
        assert!(rows.contains(&value), "{w:?}: {value}");
    }
}

/// Frusta as narrow as `f32` tells directions apart, along an axis and askew: all that the light
/// has leaves it.
#[test]
fn narrow_projections_keep_their_flux() {
    let dir = folder(5, &pattern(5, 5));
    for (head, name) in [(V3, "mapname"), (V4, "filename")] {
        for turn in ["", "Rotate 37 .3 1 .7"] {
            for fov in [10.0, 0.1, 1e-3, 2e-4] {
                let text = format!(
                    "{head} AttributeBegin {turn} LightSource \"projection\" \"string {name}\" \"a.pfm\" \"float fov\" {fov} AttributeEnd {BALL}"
                );
                let scene = load(&text, dir.path()).expect("loads");
                let geometry = Geometry::new(&scene);
                let lights = LightTable::new(&scene, &geometry);
                // Texels are of one size on the plane, and the plane nearly of one on the sphere.
                let side = 2.0 * f64::to_radians(fov / 2.0).tan();
                let texels = pattern(5, 5);
                let mean = texels.iter().map(|t| f64::from(t[1])).sum::<f64>() / 25.0;
                let (mut flux, mut random) = (Mean::default(), Random(8));
                for _ in 0..20_000 {
                    let u = std::array::from_fn(|_| random.uniform());
                    let ray = lights.sample_emission::<f32>(&geometry, &[0], u);
                    flux.add(if ray.valid {
                        f64::from(ray.beta.y)
                    } else {
                        0.0
                    });
                }
                let off = flux.mean() / (mean * side * side) - 1.0;
                let slack =
                    6.0 * flux.error() / flux.mean() + 0.01 * f64::from(u8::from(fov > 1.0)) + 1e-5;
                assert!(off.abs() < slack, "{text}: off by {off}, {slack} allowed");
            }
        }
    }
}

/// A sun of one texel in the largest maps there are: what is sampled is what there is, sun and sky.
#[test]
fn suns_of_one_texel_keep_their_flux() {
    for (width, height, sun) in [
        (64usize, 32usize, 1e4f32),
        (1024, 512, 1e6),
        (4096, 2048, 3e5),
        (4096, 2048, 1e9),
    ] {
        let mut texels = vec![[1.0f32, 0.0, 0.5]; width * height];
        let (x, y) = (width / 3, height / 5);
        texels[y * width + x] = [0.0, sun, 0.5];
        let dir = folder(width as u32, &texels);
        let scene = load(
            &format!("{V3} LightSource \"infinite\" \"string mapname\" \"a.pfm\" {BALL}"),
            dir.path(),
        )
        .expect("loads");
        let geometry = Geometry::new(&scene);
        let lights = LightTable::new(&scene, &geometry);
        // Rows by the sine of their angle; what a bilinear look-up spreads over the neighbours, the
        // same but for the curve of the sine.
        let solid =
            2.0 * PI * PI / (width * height) as f64 * ((y as f64 + 0.5) / height as f64 * PI).sin();
        let truth = [4.0 * PI - solid, f64::from(sun) * solid];
        let (mut red, mut green, mut random) = (Mean::default(), Mean::default(), Random(3));
        for _ in 0..200_000 {
            let u = [random.uniform(), random.uniform()];
            let seen = lights.sample_direct::<f32>(&geometry, &[0], Vec3::splat([0.0; 3]), u);
            let of = |c: f32| {
                if seen.valid {
                    f64::from(c) / f64::from(seen.pdf)
                } else {
                    0.0
                }
            };
            red.add(of(seen.radiance.x));
            green.add(of(seen.radiance.y));
        }
        let slack = normal_quantile(FALSE_ALARM);
        for (mean, truth) in [(&red, truth[0]), (&green, truth[1])] {
            let off = mean.mean() - truth;
            let allowed = slack * mean.error() + 3e-3 * truth / (height as f64 / 32.0);
            // Where the sun takes nearly every sample, the sky is seen too seldom to be judged.
            assert!(
                off.abs() < allowed || mean.error() > 0.3 * truth,
                "{width}, sun {sun}: {} is not {truth}, allowed {allowed}",
                mean.mean()
            );
        }
    }
}
