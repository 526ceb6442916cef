//! Images that say how much a light sends in which direction.

use super::{BALL, SIZES, V3, V4, folder, layouts, load, mean3, pattern, sent};
use crate::common::stats::{FALSE_ALARM, Mean, Random, assert_follows, normal_quantile};
use phalanx::geometry::Geometry;
use phalanx::light::LightTable;
use phalanx::replay::vector::*;
use phalanx::simd::Vec3;
use std::f64::consts::PI;

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
