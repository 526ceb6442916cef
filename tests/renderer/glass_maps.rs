//! A glass ball under a coarse map: what pixels see of its poles, against an integration in `f64`
//! by the rules of both pbrts.

use crate::support::{Runs, settings, write_pfm};

use phalanx::pbrt::load_str;
use phalanx::replay::vector::{V, add, dot, length, scale, sub, unit};
use phalanx::scene::IntegratorKind;
use std::f64::consts::{PI, TAU};

const SIDE: u32 = 32;
const BALL: f64 = 0.9;
const ETA: f64 = 1.5;
const DEPTH: usize = 6;
const REGIONS: u32 = 4;

/// Bright at the pole `+z` and not at the other, and different all round.
fn texel(x: usize, y: usize, of_v3: bool) -> f64 {
    let (row, rows) = match of_v3 {
        true => (y, 16),
        // From the middle of the square, which is the pole.
        false => ((2 * x).abs_diff(15).max((2 * y).abs_diff(15)) / 2, 8),
    };
    let round = 0.2 + 0.1 * ((x * 7 + y * 3) % 5) as f64;
    match row {
        0 => 9.0 + round,
        _ if row + 1 == rows => 0.02 * round,
        _ => round,
    }
}

/// pbrt-v3's `MIPMap::triangle` at its finest level with `ImageWrap::Repeat`, of 32 by 16 texels.
fn look_up_v3(d: V) -> f64 {
    let u = d[1].atan2(d[0]) / TAU;
    let u = if u < 0.0 { u + 1.0 } else { u };
    let v = d[0].hypot(d[1]).atan2(d[2]) / PI;
    let (s, t) = (u * 32.0 - 0.5, v * 16.0 - 0.5);
    let (s0, t0) = (s.floor(), t.floor());
    let at = |i: i64, j: i64| {
        let (x, y) = (s0 as i64 + i, t0 as i64 + j);
        texel(x.rem_euclid(32) as usize, y.rem_euclid(16) as usize, true)
    };
    let (ds, dt) = (s - s0, t - t0);
    let row = |j| (1.0 - ds) * at(0, j) + ds * at(1, j);
    (1.0 - dt) * row(0) + dt * row(1)
}

/// pbrt-v4's `EqualAreaSphereToSquare` and the nearest of 16 by 16 texels.
fn look_up_v4(d: V) -> f64 {
    let r = (1.0 - d[2].abs()).max(0.0).sqrt();
    let phi = d[1].abs().atan2(d[0].abs()) * 2.0 / PI;
    let (mut u, mut v) = (r - phi * r, phi * r);
    if d[2] < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    let place = |a: f64, sign: f64| ((a.copysign(sign) + 1.0) * 8.0).clamp(0.0, 15.0) as usize;
    texel(place(u, d[0]), place(v, d[1]), false)
}

/// Unpolarised reflectance at a smooth border, `eta` being beyond over this side.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let beyond = (1.0 - sin2).sqrt();
    let parallel = (eta * cos - beyond) / (eta * cos + beyond);
    let perpendicular = (cos - eta * beyond) / (cos + eta * beyond);
    (parallel * parallel + perpendicular * perpendicular) / 2.0
}

fn refract(d: V, n: V, eta: f64) -> V {
    let cos = -dot(d, n);
    let beyond = (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt();
    unit(add(scale(d, 1.0 / eta), scale(n, cos / eta - beyond)))
}

fn reflect(d: V, n: V) -> V {
    sub(d, scale(n, 2.0 * dot(d, n)))
}

/// What an orthographic ray along `z` at `(x, y)` sees of the map, in or beside the ball, by paths
/// of at most [`DEPTH`] scatterings.
fn seen([x, y]: [f64; 2], sky: fn(V) -> f64) -> f64 {
    let ahead = [0.0, 0.0, 1.0];
    let r2 = x * x + y * y;
    if r2 >= BALL * BALL {
        return sky(ahead);
    }
    let n = scale([x, y, -(BALL * BALL - r2).sqrt()], 1.0 / BALL);
    let reflectance = fresnel(-dot(ahead, n), ETA);
    let mut sum = reflectance * sky(reflect(ahead, n));
    let (mut d, mut p, mut carried) = (refract(ahead, n, ETA), n, 1.0 - reflectance);
    for _ in 1..DEPTH {
        // Chords of the unit ball.
        p = add(p, scale(d, -2.0 * dot(d, p)));
        let inwards = scale(unit(p), -1.0);
        let reflectance = fresnel(-dot(d, inwards), 1.0 / ETA);
        if reflectance < 1.0 {
            sum += carried * (1.0 - reflectance) * sky(refract(d, inwards, 1.0 / ETA));
        }
        carried *= reflectance;
        d = reflect(d, inwards);
    }
    assert!((length(d) - 1.0).abs() < 1e-9);
    sum
}

#[test]
fn a_glass_ball_under_a_coarse_map_is_what_the_rules_of_pbrt_say() {
    let dir = tempfile::tempdir().expect("a folder");
    for (of_v3, sky) in [(true, look_up_v3 as fn(V) -> f64), (false, look_up_v4)] {
        let columns: usize = if of_v3 { 32 } else { 16 };
        let texels: Vec<[f32; 3]> = (0..columns * 16)
            .map(|i| [texel(i % columns, i / columns, of_v3) as f32; 3])
            .collect();
        write_pfm(&dir.path().join("a.pfm"), columns as u32, &texels);
        let (film, map, glass) = match of_v3 {
            true => ("image", "mapname", "\"glass\" \"float eta\" 1.5"),
            false => ("rgb", "filename", "\"dielectric\" \"float eta\" 1.5"),
        };
        let text = format!(
            "LookAt 0 0 -5  0 0 0  0 1 0 Camera \"orthographic\"\n\
             Film \"{film}\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\n\
             PixelFilter \"box\" Integrator \"path\" \"integer maxdepth\" {DEPTH} WorldBegin\n\
             LightSource \"infinite\" \"string {map}\" \"a.pfm\"\n\
             Material {glass} Shape \"sphere\" \"float radius\" {BALL}\n"
        );
        let scene = load_str(&text, "ball.pbrt", dir.path()).expect("loads");
        let side = SIDE / REGIONS;
        // Midpoints, so many along a region.
        const FINE: u32 = 256;
        let truth = |region: u32| {
            let corner = [region % REGIONS, region / REGIONS].map(|i| f64::from(i * side));
            let mut sum = 0.0;
            for i in 0..FINE * FINE {
                let at = |axis: usize, k: u32| {
                    let at =
                        corner[axis] + (f64::from(k) + 0.5) * f64::from(side) / f64::from(FINE);
                    2.0 * at / f64::from(SIDE) - 1.0
                };
                sum += seen([at(0, i % FINE), -at(1, i / FINE)], sky);
            }
            sum / f64::from(FINE * FINE)
        };
        let truths: Vec<f64> = (0..REGIONS * REGIONS).map(truth).collect();
        for (kind, effort) in [
            (IntegratorKind::Pt, 128),
            (IntegratorKind::Bdpt, 64),
            (IntegratorKind::Mmlt, 64),
        ] {
            let runs = Runs::new(&scene, &settings(&scene, kind, effort), 8);
            runs.show(&format!("glass-map-{of_v3}-{kind:?}"));
            // Every channel is the same.
            for (i, found) in runs.grid(REGIONS, REGIONS).iter().step_by(3).enumerate() {
                let what = format!("v3 {of_v3}, {kind:?}, region {i}");
                found.expect_among(96, truths[i], &what);
            }
        }
    }
}
