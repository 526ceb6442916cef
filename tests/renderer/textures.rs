//! Textures against the formulas of pbrt-v3 and pbrt-v4 in `f64`, on their own, through the loader,
//! and in pictures.

mod hostile;
mod pbrt;
mod pictures;

use crate::common::stats::Random;
use glam::{DAffine3, DVec3};
use phalanx::pbrt::load_str;
use phalanx::scene::{Mapping, MarbleSpline, Octaves, Param, Texture, UvMapping};
use phalanx::surface::texture::{Place, evaluate, noise, procedural};

/// A rounding of `f32`, relative.
const EPSILON: f64 = 0.5 * f32::EPSILON as f64;

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// Uniform in a cube about the origin.
fn somewhere(random: &mut Random, size: f32) -> [f32; 3] {
    std::array::from_fn(|_| (2.0 * random.uniform() - 1.0) * size)
}

/// The slope of noise along any axis is less: those of two gradients differ by at most 2, over a
/// distance in which weights change at a rate of at most 15 / 8.
const STEEPEST_NOISE: f64 = 2.0 + 2.0 * 15.0 / 8.0;

/// What roundings can make of a sum of octaves at a point.
fn octaves_error(p: [f32; 3], omega: f64, octaves: u32) -> f64 {
    let reach = p.iter().fold(0.0, |m: f64, x| m.max(f64::from(x.abs())));
    (0..octaves)
        .map(|k| {
            let coordinate = reach * 1.99f64.powi(k as i32) * f64::from(k + 1) * EPSILON;
            omega.powi(k as i32) * (3.0 * STEEPEST_NOISE * coordinate + 40.0 * EPSILON)
        })
        .sum()
}

#[test]
fn noise_is_that_of_perlin_and_pbrt() {
    // A value of Perlin's own implementation, at whose corners pbrt has the same gradients.
    let known = f64::from(noise::noise([314.0 / 100.0, 42.0, 7.0]));
    assert!((known - 0.136_919_958_784).abs() < 1e-6, "{known}");
    let mut random = Random(1);
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for i in 0..20_000 {
        let p = somewhere(&mut random, [2.0, 300.0, 1e5][i % 3]);
        let found = f64::from(noise::noise(p));
        let want = pbrt::noise(wide(p));
        // Fractions are exact.
        assert!(
            (found - want).abs() < 40.0 * EPSILON,
            "{p:?}: {found} {want}"
        );
        (low, high) = (low.min(found), high.max(found));
        let corner = p.map(f32::floor);
        assert_eq!(noise::noise(corner), 0.0);
        if i % 3 < 2 {
            let period = [p[0], p[1] + 256.0, p[2] - 512.0];
            let exact = (0..3).all(|c| period[c].fract() == p[c].fract());
            assert!(!exact || noise::noise(period) == noise::noise(p));
        }
    }
    assert!(
        (-1.0..-0.7).contains(&low) && (0.7..1.0).contains(&high),
        "{low} {high}"
    );
    for odd in [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        1e20,
    ] {
        assert_eq!(noise::noise([odd, 0.3, 0.6]).abs().max(1.0), 1.0);
        assert_eq!(noise::noise([odd; 3]), 0.0);
    }
}

#[test]
fn octaves_are_summed_as_in_pbrt() {
    let mut random = Random(2);
    for _ in 0..3000 {
        let p = somewhere(&mut random, 20.0);
        let octaves = Octaves {
            count: random.below(11) as u32,
            roughness: random.uniform(),
        };
        let omega = f64::from(octaves.roughness);
        let bound = octaves_error(p, omega, octaves.count) + 4.0 * EPSILON;
        let found = f64::from(noise::fbm(p, octaves));
        let want = pbrt::fbm(wide(p), omega, octaves.count);
        assert!((found - want).abs() < bound, "{found} {want} {bound}");
        let found = f64::from(noise::turbulence(p, octaves));
        let want = pbrt::turbulence(wide(p), omega, octaves.count);
        assert!((found - want).abs() < bound, "{found} {want} {bound}");
        let found = f64::from(procedural::windy(p));
        let want = pbrt::windy(wide(p));
        // Both factors are below 2.
        let bound = 2.0 * octaves_error(p, 0.5, 6) + 2.0 * octaves_error(p, 0.5, 3);
        assert!((found - want).abs() < bound, "{found} {want} {bound}");
    }
}

#[test]
fn marble_has_the_colours_of_pbrt() {
    let mut random = Random(3);
    for spline in [MarbleSpline::V3, MarbleSpline::V4] {
        for _ in 0..3000 {
            let p = somewhere(&mut random, 8.0);
            let octaves = Octaves {
                count: 5,
                roughness: 0.5,
            };
            let variation = 2.0 * random.uniform();
            let found = procedural::marble(p, octaves, variation, spline).map(f64::from);
            let phase = wide(p).y + f64::from(variation) * pbrt::fbm(wide(p), 0.5, 5);
            let t = 0.5 + 0.5 * phase.sin();
            // Of the phase, and of the sine.
            let error = f64::from(variation) * octaves_error(p, 0.5, 5)
                + 8.0 * phase.abs() * EPSILON
                + 2e-7;
            let steps = (-8..=8).map(|i| (t + error * f64::from(i) / 8.0).clamp(0.0, 1.0));
            let near: Vec<_> = steps.map(|t| pbrt::marble(t, spline)).collect();
            for c in 0..3 {
                let low = near.iter().fold(f64::INFINITY, |m, v| m.min(v[c]));
                let high = near.iter().fold(f64::NEG_INFINITY, |m, v| m.max(v[c]));
                // The extrapolated terms cancel.
                let rounding = 40.0 * EPSILON * 6f64.powi(3);
                assert!(
                    (low - rounding..=high + rounding).contains(&found[c]),
                    "{spline:?} {found:?} {low} {high}"
                );
            }
        }
    }
    // Where the sine is -1, 1/3 and 1.
    let flat = |t: f64| {
        let octaves = Octaves {
            count: 0,
            roughness: 0.0,
        };
        let p = [0.0, (2.0 * t - 1.0).asin() as f32, 0.0];
        procedural::marble(p, octaves, 1.0, MarbleSpline::V4)
    };
    let near = |a: [f32; 3], b: [f64; 3]| {
        for c in 0..3 {
            assert!((f64::from(a[c]) - b[c]).abs() < 1e-4, "{a:?} {b:?}");
        }
    };
    near(flat(0.0), [0.87, 0.87, 0.9]);
    near(flat(1.0), [0.87, 0.87, 0.9]);
}

fn table(textures: Vec<Texture>) -> impl Fn(&Place) -> [f32; 3] {
    let last = Param::Texture(textures.len() as u32 - 1);
    move |place| evaluate(&textures, &[], last, place)
}

fn uv(scale: f32) -> Mapping {
    Mapping::Uv(UvMapping {
        su: scale,
        sv: scale,
        du: 0.0,
        dv: 0.0,
    })
}

fn at(u: f32, v: f32) -> Place {
    Place {
        uv: [u, v],
        ..Place::default()
    }
}

#[test]
fn dots_are_where_pbrt_has_them() {
    let [dot, ground] = [[0.1, 0.2, 0.3], [0.7, 0.8, 0.9]];
    let texture = table(vec![Texture::Dots {
        dot: Param::Constant(dot),
        ground: Param::Constant(ground),
        mapping: uv(10.0),
    }]);
    let mut random = Random(4);
    let (mut inside, mut unclear) = (0, 0);
    let n = 20_000;
    for _ in 0..n {
        let (u, v) = (4.0 * random.uniform() - 2.0, 4.0 * random.uniform() - 2.0);
        let found = texture(&at(u, v));
        let (s, t) = (10.0 * f64::from(u), 10.0 * f64::from(v));
        let want = pbrt::dots(s, t);
        let step = 100.0 * EPSILON;
        let sides = [-step, step].map(|d| [pbrt::dots(s + d, t), pbrt::dots(s, t + d)]);
        if sides.as_flattened().iter().any(|side| *side != want) {
            unclear += 1;
            continue;
        }
        assert_eq!(found, if want { dot } else { ground }, "{s} {t}");
        inside += usize::from(want);
    }
    assert!(unclear < n / 1000, "{unclear}");
    // About half of the cells have a disk of 0.385.
    assert!((n / 8..n / 4).contains(&inside), "{inside}");
}

#[test]
fn bilerp_takes_its_corners() {
    let [v00, v01, v10, v11] = [[0.0, 0.5, 1.0], [0.25; 3], [0.5, 0.0, 4.0], [1.0; 3]];
    let texture = table(vec![Texture::Bilerp {
        v00,
        v01,
        v10,
        v11,
        mapping: uv(1.0),
    }]);
    assert_eq!(texture(&at(0.0, 0.0)), v00);
    assert_eq!(texture(&at(0.0, 1.0)), v01);
    assert_eq!(texture(&at(1.0, 0.0)), v10);
    assert_eq!(texture(&at(1.0, 1.0)), v11);
    assert_eq!(texture(&at(0.5, 0.5)), [0.4375, 0.4375, 1.5625]);
    // Lines go on.
    assert_eq!(texture(&at(-1.0, 0.0)), [-0.5, 1.0, -2.0]);
}

#[test]
fn texture_coordinates_and_directions_as_colours() {
    let texture = table(vec![Texture::Uv { mapping: uv(4.0) }]);
    assert_eq!(texture(&at(0.8125, -0.0625)), [0.25, 0.75, 0.0]);
    let texture = table(vec![Texture::DirectionMix {
        a: Param::Constant([1.0, 0.0, 0.5]),
        b: Param::Constant([0.0, 1.0, 0.5]),
        direction: [0.0, 1.0, 0.0],
    }]);
    for (n, want) in [
        ([0.0, 1.0, 0.0], [1.0, 0.0, 0.5]),
        ([0.0, -1.0, 0.0], [1.0, 0.0, 0.5]),
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.5]),
        ([0.0, -0.25, 0.0], [0.25, 0.75, 0.5]),
    ] {
        let place = Place {
            n,
            ..Place::default()
        };
        assert_eq!(texture(&place), want);
    }
    let blocks = table(vec![Texture::Blocks {
        a: Param::Constant([1.0; 3]),
        b: Param::Constant([0.0; 3]),
        to_texture: [
            [4.0, 0.0, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0],
            [0.0, 0.0, 4.0, 0.0],
        ],
    }]);
    let mut random = Random(5);
    for _ in 0..1000 {
        let p = somewhere(&mut random, 1.0);
        let floors = p.map(|x| (4.0 * x).floor() as i32);
        let even = floors.iter().sum::<i32>().rem_euclid(2) == 0;
        let place = Place {
            p,
            ..Place::default()
        };
        assert_eq!(blocks(&place)[0], if even { 1.0 } else { 0.0 });
    }
}

/// Half a million metres off, turned, stretched, and mapped in each way by textures that say what
/// they see.
#[test]
fn mappings_through_the_loader() {
    let centre = DVec3::new(5e5, -2e5, 1e5);
    let ctm = DAffine3::from_translation(centre + DVec3::new(0.5, 0.25, -0.125))
        * DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 40f64.to_radians())
        * DAffine3::from_scale(DVec3::new(2.0, 3.0, 0.5));
    let placed = "Translate 500000.5 -199999.75 99999.875 Rotate 40 1 2 3 Scale 2 3 .5";
    let coordinate = |mapping: &str| {
        // By default bilinear textures are t.
        format!(
            "Texture \"s\" \"float\" \"bilerp\" {mapping} \"float v01\" 0 \"float v10\" 1 Texture \"t\" \"float\" \"bilerp\" {mapping}\n"
        )
    };
    let plane = "\"string mapping\" \"planar\" \"float udelta\" .5 \"float vdelta\" -3";
    let far = format!(
        "\"float udelta\" {} \"float vdelta\" {}",
        -centre.x - centre.y,
        -3.0 * centre.z
    );
    let load = |head: &str, vector: &str, planar: &str, shape: &str| {
        let planar = format!("{planar} \"{vector} v1\" [1 1 0] \"{vector} v2\" [0 0 3]");
        let text = format!(
            "Film \"{head}\" WorldBegin AttributeBegin {placed} {}{}{} AttributeEnd Translate {} {} {} Shape {shape}",
            coordinate("\"string mapping\" \"spherical\""),
            coordinate("\"string mapping\" \"cylindrical\""),
            coordinate(&planar),
            centre.x,
            centre.y,
            centre.z
        );
        // v3 forgets names at the end of the block; the table stays.
        load_str(&text, "t.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"))
    };
    let v3 = load(
        "image",
        "vector",
        &format!("\"string mapping\" \"planar\" {far}"),
        "\"sphere\" \"float radius\" 3",
    );
    let v4 = load("rgb", "vector3", plane, "\"sphere\" \"float radius\" 3");
    let to_texture = ctm.inverse();
    let mut random = Random(6);
    for (scene, is_v4) in [(v3, false), (v4, true)] {
        assert_eq!(scene.textures.len(), 6);
        for _ in 0..2000 {
            let p = somewhere(&mut random, 0.5);
            let world = wide(p) / scene.space.scale + scene.space.centre;
            let q = to_texture.transform_point3(world);
            let planar = |p: DVec3, ds: f64, dt: f64| [ds + p.x + p.y, dt + 3.0 * p.z];
            let want = if is_v4 {
                [
                    pbrt::spherical(q),
                    pbrt::cylindrical_v4(q),
                    planar(q, 0.5, -3.0),
                ]
            } else {
                let (ds, dt) = (-centre.x - centre.y, -3.0 * centre.z);
                [
                    pbrt::spherical(q),
                    pbrt::cylindrical_v3(q),
                    planar(world, ds, dt),
                ]
            };
            // Angles are as uncertain as the point is, seen from the axis.
            let axis = q.truncate().length();
            if axis < 0.1 || (q.y.abs() < 1e-3 && q.x > 0.0) || (q.y.abs() < 1e-3) {
                continue;
            }
            let place = Place {
                p,
                ..Place::default()
            };
            for (i, want) in want.as_flattened().iter().enumerate() {
                let param = Param::Texture(i as u32);
                let found = f64::from(evaluate(&scene.textures, &scene.images, param, &place)[0]);
                // Coordinates are below 20 in texture space.
                let bound = 20.0 * 16.0 * EPSILON / axis.min(1.0);
                assert!((found - want).abs() < bound, "{i}: {found} {want} at {q}");
            }
        }
    }
}
