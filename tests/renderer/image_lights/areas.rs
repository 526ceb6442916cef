//! Area lights that show an image, and what else can emit.

use super::{BALL, LAMP, V3, V4, folder, load, mean3, pattern, shown};
use crate::common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::geometry::Geometry;
use phalanx::integrate::{Settings, Silent, render};
use phalanx::light::LightTable;
use phalanx::replay::vector::*;
use phalanx::scene::{IntegratorKind, LightKind};
use phalanx::simd::Vec3;
use std::f64::consts::{PI, TAU};
use std::path::Path;

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
