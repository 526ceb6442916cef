//! Floors lit by images, against quadrature.

use super::{BALL, LAMP, SIZES, V3, V4, folder, layouts, load, pattern, shown};
use crate::common::stats::Mean;
use phalanx::geometry::Geometry;
use phalanx::integrate::{Settings, Silent, render};
use phalanx::light::LightTable;
use phalanx::replay::vector::*;
use phalanx::scene::IntegratorKind;
use phalanx::simd::Vec3;
use std::f64::consts::PI;
use std::path::Path;

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
