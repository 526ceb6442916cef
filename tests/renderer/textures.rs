//! Textures against the formulas of pbrt-v3 and pbrt-v4 in `f64`, on their own, through the loader,
//! and in pictures.

use crate::property;
#[path = "common/stats.rs"]
#[allow(dead_code)]
mod stats;
use crate::support;

use glam::{DAffine3, DVec3};
use phalanx::pbrt::load_str;
use phalanx::scene::{
    Image, Mapping, MarbleSpline, Octaves, Param, Scene, Texture, ToTexture, UvMapping, Wrap,
};
use phalanx::surface::texture::{Place, evaluate, noise, prefetch_texels, procedural};
use proptest::prelude::*;
use stats::Random;
use std::f64::consts::{PI, TAU};
use support::{run, settings};

/// A rounding of `f32`, relative.
const EPSILON: f64 = 0.5 * f32::EPSILON as f64;

/// pbrt's formulas, one for one.
mod pbrt {
    use super::*;

    const PERM: [usize; 256] = [
        151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30,
        69, 142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94,
        252, 219, 203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171,
        168, 68, 175, 74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60,
        211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1,
        216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86,
        164, 100, 109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118,
        126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170,
        213, 119, 248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39,
        253, 19, 98, 108, 110, 79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34,
        242, 193, 238, 210, 144, 12, 191, 179, 162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49,
        192, 214, 31, 181, 199, 106, 157, 184, 84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254,
        138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78, 66, 215, 61, 156, 180,
    ];

    fn grad(x: usize, y: usize, z: usize, dx: f64, dy: f64, dz: f64) -> f64 {
        let perm = |i: usize| PERM[i % 256];
        let h = perm(perm(perm(x) + y) + z) & 15;
        let u = if h < 8 || h == 12 || h == 13 { dx } else { dy };
        let v = if h < 4 || h == 12 || h == 13 { dy } else { dz };
        (if h & 1 != 0 { -u } else { u }) + (if h & 2 != 0 { -v } else { v })
    }

    pub fn noise(p: DVec3) -> f64 {
        let [ix, iy, iz] = p.floor().to_array().map(|x| (x as i64 & 255) as usize);
        let d = p - p.floor();
        let w = |i: usize, j: usize, k: usize| {
            let (x, y, z) = (d.x - i as f64, d.y - j as f64, d.z - k as f64);
            grad(ix + i, iy + j, iz + k, x, y, z)
        };
        let weight = |t: f64| 6.0 * t.powi(5) - 15.0 * t.powi(4) + 10.0 * t.powi(3);
        let lerp = |t: f64, a: f64, b: f64| (1.0 - t) * a + t * b;
        let x00 = lerp(weight(d.x), w(0, 0, 0), w(1, 0, 0));
        let x10 = lerp(weight(d.x), w(0, 1, 0), w(1, 1, 0));
        let x01 = lerp(weight(d.x), w(0, 0, 1), w(1, 0, 1));
        let x11 = lerp(weight(d.x), w(0, 1, 1), w(1, 1, 1));
        let y0 = lerp(weight(d.y), x00, x10);
        let y1 = lerp(weight(d.y), x01, x11);
        lerp(weight(d.z), y0, y1)
    }

    /// With a footprint of size 0.
    pub fn fbm(p: DVec3, omega: f64, octaves: u32) -> f64 {
        let (mut sum, mut lambda, mut o) = (0.0, 1.0, 1.0);
        for _ in 0..octaves {
            sum += o * noise(lambda * p);
            lambda *= 1.99;
            o *= omega;
        }
        sum
    }

    pub fn turbulence(p: DVec3, omega: f64, octaves: u32) -> f64 {
        let (mut sum, mut lambda, mut o) = (0.0, 1.0, 1.0);
        for _ in 0..octaves {
            sum += o * noise(lambda * p).abs();
            lambda *= 1.99;
            o *= omega;
        }
        sum + o * 0.2
    }

    pub fn windy(p: DVec3) -> f64 {
        fbm(0.1 * p, 0.5, 3).abs() * fbm(p, 0.5, 6)
    }

    /// The colour of marble where its sine is `2 t - 1`.
    pub fn marble(t: f64, spline: MarbleSpline) -> [f64; 3] {
        let colors = [
            [0.58, 0.58, 0.6],
            [0.58, 0.58, 0.6],
            [0.58, 0.58, 0.6],
            [0.5, 0.5, 0.5],
            [0.6, 0.59, 0.58],
            [0.58, 0.58, 0.6],
            [0.58, 0.58, 0.6],
            [0.2, 0.2, 0.33],
            [0.58, 0.58, 0.6],
        ];
        let segments = 6.0;
        let first = match spline {
            MarbleSpline::V3 => ((t * segments).floor() as usize).min(1),
            MarbleSpline::V4 => ((t * segments).floor() as usize).min(5),
        };
        let t = t * segments - first as f64;
        // Bernstein's form; pbrt has de Casteljau's.
        std::array::from_fn(|c| {
            let k = |i: usize| colors[first + i][c];
            let s = 1.0 - t;
            1.5 * (s * s * s * k(0)
                + 3.0 * s * s * t * k(1)
                + 3.0 * s * t * t * k(2)
                + t * t * t * k(3))
        })
    }

    pub fn dots(s: f64, t: f64) -> bool {
        let noise = |x: f64, y: f64| noise(DVec3::new(x, y, 0.5));
        let (cell_s, cell_t) = ((s + 0.5).floor(), (t + 0.5).floor());
        if noise(cell_s + 0.5, cell_t + 0.5) > 0.0 {
            let (radius, max_shift) = (0.35, 0.15);
            let centre_s = cell_s + max_shift * noise(cell_s + 1.5, cell_t + 2.8);
            let centre_t = cell_t + max_shift * noise(cell_s + 4.5, cell_t + 9.8);
            return (s - centre_s).powi(2) + (t - centre_t).powi(2) < radius * radius;
        }
        false
    }

    pub fn spherical(p: DVec3) -> [f64; 2] {
        let v = p.normalize();
        let phi = v.y.atan2(v.x);
        let phi = if phi < 0.0 { phi + TAU } else { phi };
        [v.z.clamp(-1.0, 1.0).acos() / PI, phi / TAU]
    }

    pub fn cylindrical_v3(p: DVec3) -> [f64; 2] {
        let v = p.normalize();
        [(PI + v.y.atan2(v.x)) / TAU, v.z]
    }

    pub fn cylindrical_v4(p: DVec3) -> [f64; 2] {
        [(PI + p.y.atan2(p.x)) / TAU, p.z]
    }
}

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

/// Any bits in any parameter and place.
fn any_texture() -> impl Strategy<Value = Vec<Texture>> {
    let number = || {
        prop_oneof![
            3 => -10f32..10.0,
            1 => prop::num::f32::ANY,
            1 => prop::sample::select(vec![
                0.0, -0.0, f32::MAX, f32::MIN, f32::INFINITY, f32::NAN, 1e-40,
            ]),
        ]
    };
    let numbers = prop::collection::vec(number(), 40);
    (prop::collection::vec(0..20u32, 4), numbers, 0..=64u32).prop_map(|(kinds, n, count)| {
        let matrix = |i: usize| -> ToTexture {
            std::array::from_fn(|r| std::array::from_fn(|c| n[(i + 4 * r + c) % n.len()]))
        };
        let rgb = |i: usize| [n[i], n[i + 1], n[i + 2]];
        let octaves = Octaves {
            count,
            roughness: n[7],
        };
        let mut list = vec![Texture::Constant(rgb(0))];
        for kind in kinds {
            let a = Param::Texture(list.len() as u32 - 1);
            let b = Param::Texture(0);
            let mapping = match kind % 5 {
                0 => Mapping::Uv(UvMapping {
                    su: n[0],
                    sv: n[1],
                    du: n[2],
                    dv: n[3],
                }),
                1 => Mapping::Spherical(matrix(4)),
                2 => Mapping::Planar(matrix(4)),
                _ => Mapping::Cylindrical {
                    to_texture: matrix(4),
                    unit: kind % 5 == 3,
                },
            };
            let to_texture = matrix(9);
            list.push(match kind {
                0 => Texture::Scale { a, b },
                1 => Texture::Mix { a, b, amount: a },
                2 => Texture::DirectionMix {
                    a,
                    b,
                    direction: rgb(5),
                },
                3 | 4 => Texture::Checkerboard { a, b, mapping },
                5 => Texture::Blocks { a, b, to_texture },
                6 | 7 => Texture::Dots {
                    dot: a,
                    ground: b,
                    mapping,
                },
                8 => Texture::Bilerp {
                    v00: rgb(0),
                    v01: rgb(1),
                    v10: rgb(2),
                    v11: rgb(3),
                    mapping,
                },
                9..=11 => Texture::Uv { mapping },
                12 => Texture::Fbm {
                    octaves,
                    to_texture,
                },
                13 => Texture::Wrinkled {
                    octaves,
                    to_texture,
                },
                14 => Texture::Windy { to_texture },
                15 | 16 => Texture::Marble {
                    octaves,
                    scale: n[8],
                    variation: n[9],
                    spline: if kind == 15 {
                        MarbleSpline::V3
                    } else {
                        MarbleSpline::V4
                    },
                    to_texture,
                },
                _ => Texture::Image {
                    image: 0,
                    mapping,
                    wrap: [Wrap::Repeat, Wrap::Black, Wrap::Clamp][kind as usize % 3],
                    scale: n[10],
                    invert: n[11] > 0.0,
                },
            });
        }
        list
    })
}

proptest! {
    #![proptest_config(property::cases(20_000))]

    #[test]
    fn values_are_finite_whatever_is_put_in(
        textures in any_texture(),
        place in prop::array::uniform8(
            prop_oneof![2 => -2f32..2.0, 1 => prop::num::f32::ANY, 1 => Just(0.0)],
        ),
    ) {
        let image = Image {
            name: String::new(),
            width: 3,
            height: 2,
            texels: vec![[1.0, 0.5, 0.25]; 6],
        };
        let [u, v, x, y, z, nx, ny, nz] = place;
        let place = Place { uv: [u, v], p: [x, y, z], n: [nx, ny, nz] };
        for i in 0..textures.len() as u32 {
            prefetch_texels(&textures, std::slice::from_ref(&image), i, &place);
            let images = std::slice::from_ref(&image);
            let value = evaluate(&textures, images, Param::Texture(i), &place);
            prop_assert!(value.iter().all(|v| v.is_finite()), "{:?} {:?}", value, textures[i as usize]);
        }
    }
}

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
    support::scene(&format!(
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
        evaluate(&scene.textures, &scene.images, texture, &place).map(|v| v.clamp(0.0, 1.0))
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
                let slack = 0.5 * step + support::ROUNDING as f32;
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
