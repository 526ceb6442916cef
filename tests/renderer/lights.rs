//! Lights and cameras: what they sample has the density they report.

mod cameras;

use crate::common;

use common::scenes;
use common::stats::{FALSE_ALARM, Mean, Random, assert_follows, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::light::LightTable;
use phalanx::replay::vector::*;
use phalanx::scene::{LightKind, Scene};
use phalanx::simd::{Vec3, f32x8};
use phalanx::trace::{Coherence, Hit, Ray};
use phalanx::transport::World;
use std::f64::consts::{PI, TAU};

fn is_area(scene: &Scene, light: usize) -> bool {
    matches!(
        scene.lights[light].kind,
        LightKind::Triangle { .. }
            | LightKind::Sphere { .. }
            | LightKind::ImageTriangle { .. }
            | LightKind::ImageSphere { .. }
    )
}

fn is_sky(scene: &Scene, light: usize) -> bool {
    matches!(
        scene.lights[light].kind,
        LightKind::InfiniteConstant { .. } | LightKind::InfiniteImage { .. }
    )
}

#[test]
fn sampled_points_have_the_density_that_chance_reports() {
    let mut random = Random(41);
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 1);
        for light in 0..scene.lights.len() {
            for _ in 0..500 {
                let p = narrow(scale(random.direction(), 0.4 * random.uniform64()));
                let u = [random.uniform(), random.uniform()];
                let index = [light as u32];
                let seen =
                    (world.lights).sample_direct::<f32>(&world.geometry, &index, Vec3::splat(p), u);
                if !seen.valid {
                    continue;
                }
                let w = wide(seen.to_light.lane(0));
                assert!((length(w) - 1.0).abs() < 1e-6);
                let pdf = f64::from(seen.pdf);
                let what = format!("{name}, light {light}: {:?}", scene.lights[light].kind);
                if is_sky(&scene, light) {
                    let chance = (world.lights).escaped::<f32>(light as u32, seen.to_light);
                    // The sample knows its place in an image, chance only a direction as rounded.
                    assert!(
                        (f64::from(chance.direct_pdf) / pdf - 1.0).abs() < 1e-5,
                        "{what}"
                    );
                    let [a, b] = [chance.radiance, seen.radiance].map(|c| wide(c.lane(0)));
                    assert!(length(sub(a, b)) < 1e-5 * length(b) + 1e-6, "{what}");
                    let ratio = f64::from(chance.emission_pdf) / f64::from(chance.direct_pdf);
                    assert!((f64::from(seen.emission_ratio) / ratio - 1.0).abs() < 1e-6);
                    assert!(!seen.delta);
                } else if is_area(&scene, light) {
                    // Follow the ray: it meets the light itself, or something before it.
                    let d = seen.to_light.lane(0);
                    let ray = [Ray::endless(p, d)];
                    let mut hit = [Hit::default()];
                    Evaluator::ONE.trace(&world.tracer, Coherence::Unknown, &ray, &[0], &mut hit);
                    let target = wide(seen.end.lane(0));
                    let distance = length(sub(target, wide(p)));
                    let t = f64::from(hit[0].t);
                    let prim = hit[0].primitive;
                    if (t - distance).abs() > 1e-4 || world.geometry.shape_of(prim).1 != index[0] {
                        continue;
                    }
                    let point = world.geometry.surface_point::<f32>(
                        (&[prim], &[hit[0].instance]),
                        Vec3::splat(p),
                        seen.to_light,
                        [hit[0].t, hit[0].b[0], hit[0].b[1]],
                        world.wanted,
                    );
                    let cos = -dot(w, wide(point.ng.lane(0)));
                    let chance = (world.lights).emitted::<f32>(
                        &world.geometry,
                        &index,
                        point.p,
                        cos as f32,
                        hit[0].b,
                    );
                    // Over area to over solid angle; positions are off by their error bounds, which
                    // the cosine and the distance divide,
                    let solid = f64::from(chance.direct_pdf) * t * t / cos.abs();
                    // the radius of curvature likewise.
                    let size = match scene.lights[light].kind {
                        LightKind::Sphere { sphere, .. }
                        | LightKind::ImageSphere { sphere, .. } => {
                            let m = scene.spheres[sphere as usize].to_world;
                            let axis =
                                |c: usize| length([m[0][c], m[1][c], m[2][c]].map(f64::from));
                            let least = axis(0).min(axis(1)).min(axis(2));
                            let most = axis(0).max(axis(1)).max(axis(2));
                            least * least / most
                        }
                        _ => 1.0,
                    };
                    if cos.abs() * size < 1e-4 {
                        // At the silhouette rounding decides which side is met.
                        continue;
                    }
                    let slack = 1e-5 + 4e-6 / (cos.abs() * size).min(t);
                    assert!(
                        (solid / pdf - 1.0).abs() < slack,
                        "{what}: {solid} {pdf}, cos {cos}"
                    );
                    let ratio =
                        f64::from(chance.emission_pdf) / f64::from(chance.direct_pdf) / (t * t);
                    let off = f64::from(seen.emission_ratio) / ratio - 1.0;
                    assert!(off.abs() < slack, "{what}: ratio off by {off}");
                } else {
                    assert!(seen.delta, "{what}");
                }
            }
        }
    }
}

/// Unit-area cells of directions: height and azimuth.
const CELLS: usize = 16;

fn cell_of(w: V) -> usize {
    let index = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
    index((w[2] + 1.0) / 2.0) + CELLS * index(w[1].atan2(w[0]).rem_euclid(TAU) / TAU)
}

/// Integrals of a density over the cells by the midpoint rule.
fn integrate(fine: usize, density: impl Fn(V) -> f64) -> Vec<f64> {
    let mut cells = vec![0.0; CELLS * CELLS];
    let n = CELLS * fine;
    for i in 0..n * n {
        let z = ((i % n) as f64 + 0.5) / n as f64 * 2.0 - 1.0;
        let phi = ((i / n) as f64 + 0.5) / n as f64 * TAU;
        let r = (1.0 - z * z).sqrt();
        let w = [r * phi.cos(), r * phi.sin(), z];
        cells[cell_of(w)] += density(w) * 4.0 * PI / (n * n) as f64;
    }
    cells
}

#[test]
fn environments_are_sampled_by_their_density() {
    let mut random = Random(42);
    for scene in skies() {
        let geometry = phalanx::geometry::Geometry::new(&scene);
        let lights = LightTable::new(&scene, &geometry);
        let pdf = |w: V| {
            let seen = lights.escaped::<f32>(0, Vec3::splat(narrow(w)));
            f64::from(seen.direct_pdf)
        };
        // 48 points a side: the density is constant over texels, so that their edges are what the
        // rule misses.
        let expected = integrate(48, pdf);
        let total: f64 = expected.iter().sum();
        assert!((total - 1.0).abs() < 2e-3, "{total}");
        let n = 60_000;
        let mut observed = vec![0.0; CELLS * CELLS];
        for _ in 0..n {
            let u = [random.uniform(), random.uniform()];
            let seen = lights.sample_direct::<f32>(&geometry, &[0], Vec3::zero(), u);
            assert!(seen.valid && seen.pdf > 0.0, "{u:?}");
            observed[cell_of(wide(seen.to_light.lane(0)))] += 1.0;
        }
        let expected: Vec<f64> = expected.iter().map(|e| e / total * f64::from(n)).collect();
        let what = format!("{:?}", scene.lights[0].kind);
        assert_follows(&observed, &expected, FALSE_ALARM / 2.0, &what);
    }
}

/// Scenes under an image, in both layouts.
fn skies() -> Vec<Scene> {
    use phalanx::scene::{EnvLayout, Image};
    let (_, scene) = scenes::all()
        .into_iter()
        .find(|(_, s)| (s.lights.iter()).any(|l| matches!(l.kind, LightKind::InfiniteImage { .. })))
        .expect("a scene with an image sky");
    let mut square = scene.clone();
    let picture = scenes::sky(12, 12);
    square.images = vec![Image {
        name: "sky".into(),
        width: 12,
        height: 12,
        texels: picture.pixels,
    }];
    for l in &mut square.lights {
        if let LightKind::InfiniteImage { image, layout, .. } = &mut l.kind {
            (*image, *layout) = (0, EnvLayout::EqualArea);
        }
    }
    vec![scene, square]
}

#[test]
fn environments_have_no_dark_density() {
    // Wherever there is radiance there is density.
    let mut random = Random(43);
    for scene in skies() {
        let geometry = phalanx::geometry::Geometry::new(&scene);
        let lights = LightTable::new(&scene, &geometry);
        for _ in 0..20_000 {
            let w = narrow(random.direction());
            let seen = lights.escaped::<f32>(0, Vec3::splat(w));
            let r = seen.radiance.lane(0);
            assert!(r == [0.0; 3] || seen.direct_pdf > 0.0, "{w:?} {r:?}");
        }
    }
}

#[test]
fn emission_carries_the_power_of_the_light() {
    // The mean of beta over emitted rays is the flux that leaves, by whatever density it is
    // sampled.
    let mut random = Random(44);
    let n = 20_000;
    for (name, scene) in scenes::all() {
        let geometry = phalanx::geometry::Geometry::new(&scene);
        for (i, light) in scene.lights.iter().enumerate() {
            // Alone, so that the choice of light does not enter.
            let mut alone = scene.clone();
            alone.lights = vec![light.clone()];
            let lights = LightTable::new(&alone, &geometry);
            let mean3 = |c: [f32; 3]| c.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
            let disk = PI * f64::from(geometry.radius).powi(2);
            let sides = |two: bool| if two { 2.0 } else { 1.0 };
            let power = match light.kind {
                LightKind::Triangle {
                    triangle,
                    l,
                    two_sided,
                } => mean3(l) * PI * sides(two_sided) * f64::from(geometry.triangle_area(triangle)),
                LightKind::Sphere {
                    sphere,
                    l,
                    two_sided,
                } => mean3(l) * PI * sides(two_sided) * f64::from(geometry.sphere_area(sphere)),
                // These have tests of their own, in `image_lights.rs`.
                LightKind::ImageTriangle { .. }
                | LightKind::ImageSphere { .. }
                | LightKind::Goniometric { .. }
                | LightKind::Projection { .. } => continue,
                LightKind::Point { i, .. } => mean3(i) * 4.0 * PI,
                // x^4 between the two cosines.
                LightKind::Spot {
                    i,
                    versine_total,
                    versine_full,
                    ..
                } => {
                    let (a, b) = (f64::from(versine_total), f64::from(versine_full));
                    mean3(i) * TAU * (b + (a - b) / 5.0)
                }
                LightKind::Distant { l, .. } => mean3(l) * disk,
                LightKind::InfiniteConstant { l } => mean3(l) * disk * 4.0 * PI,
                LightKind::InfiniteImage { .. } => {
                    let cells = integrate(16, |w| {
                        mean3(
                            lights
                                .escaped::<f32>(0, Vec3::splat(narrow(w)))
                                .radiance
                                .lane(0),
                        )
                    });
                    cells.iter().sum::<f64>() * disk
                }
            };
            let mut flux = Mean::default();
            for _ in 0..n {
                let u = std::array::from_fn(|_| random.uniform());
                let ray = lights.sample_emission::<f32>(&geometry, &[0], u);
                let b = if ray.valid {
                    mean3(ray.beta.lane(0))
                } else {
                    0.0
                };
                flux.add(b);
            }
            let bound = normal_quantile(FALSE_ALARM) * flux.error() + 2e-3 * power;
            assert!(
                (flux.mean() - power).abs() < bound,
                "{name}, light {i}: {} is {power} +- {bound}",
                flux.mean()
            );
        }
    }
}

#[test]
fn area_lights_emit_by_the_cosine() {
    let mut random = Random(45);
    for (name, scene) in scenes::all() {
        let geometry = phalanx::geometry::Geometry::new(&scene);
        for (i, light) in scene.lights.iter().enumerate() {
            let LightKind::Triangle {
                triangle,
                two_sided,
                ..
            } = light.kind
            else {
                continue;
            };
            let mut alone = scene.clone();
            alone.lights = vec![light.clone()];
            let lights = LightTable::new(&alone, &geometry);
            let [a, b, c] = scene.triangles[triangle as usize]
                .v
                .map(|v| wide(scene.vertices[v as usize].p));
            let n = unit(cross(sub(b, a), sub(c, a)));
            let (s, total) = (unit(sub(b, a)), 40_000);
            let t = cross(n, s);
            // Squared cosines and azimuths are uniform; so are the barycentric square's cells.
            let mut observed = vec![0.0; 2 * 64];
            let mut places = vec![0.0; 4];
            for _ in 0..total {
                let u = std::array::from_fn(|_| random.uniform());
                let ray = lights.sample_emission::<f32>(&geometry, &[0], u);
                let w = wide(ray.direction.lane(0));
                let z = dot(w, n);
                let index = |x: f64| ((x * 8.0) as usize).min(7);
                let azimuth = dot(w, t).atan2(dot(w, s)).rem_euclid(TAU) / TAU;
                let side = usize::from(z < 0.0);
                observed[64 * side + index(z * z) + 8 * index(azimuth)] += 1.0;
                // The four similar quarters of a triangle have equal areas.
                let p = sub(wide(ray.origin.lane(0)), a);
                let (e1, e2) = (sub(b, a), sub(c, a));
                let (d11, d12, d22) = (dot(e1, e1), dot(e1, e2), dot(e2, e2));
                let det = d11 * d22 - d12 * d12;
                let b1 = (dot(p, e1) * d22 - dot(p, e2) * d12) / det;
                let b2 = (dot(p, e2) * d11 - dot(p, e1) * d12) / det;
                let quarter = match (b1 > 0.5, b2 > 0.5, b1 + b2 < 0.5) {
                    (true, ..) => 0,
                    (_, true, _) => 1,
                    (.., true) => 2,
                    _ => 3,
                };
                places[quarter] += 1.0;
            }
            let sides = if two_sided { 2.0 } else { 1.0 };
            let expected: Vec<f64> = (0..128)
                .map(|j| {
                    if j < 64 || two_sided {
                        f64::from(total) / 64.0 / sides
                    } else {
                        0.0
                    }
                })
                .collect();
            let what = format!("{name}, light {i}");
            assert_follows(&observed, &expected, FALSE_ALARM / 20.0, &what);
            let quarters = [f64::from(total) / 4.0; 4];
            assert_follows(&places, &quarters, FALSE_ALARM / 20.0, &what);
        }
    }
}

#[test]
fn ellipsoids_have_their_area() {
    // Knud Thomsen's formula is good to 1.1 percent only; a spheroid's area is known exactly.
    let scene = scenes::all()
        .into_iter()
        .find(|(name, _)| name.starts_with("ellipsoid"));
    let (_, scene) = scene.expect("a scene");
    let geometry = phalanx::geometry::Geometry::new(&scene);
    let m = scene.spheres[0]
        .to_world
        .map(|r| [r[0], r[1], r[2]].map(f64::from));
    let axes: Vec<f64> = (0..3)
        .map(|c| length([m[0][c], m[1][c], m[2][c]]))
        .collect();
    // By quadrature over the unit sphere: |det M| |M^-T w|, for axes along the coordinates.
    let det = axes[0] * axes[1] * axes[2];
    let n = 1000;
    let mut area = 0.0;
    for i in 0..n * n {
        let z = ((i % n) as f64 + 0.5) / n as f64 * 2.0 - 1.0;
        let phi = ((i / n) as f64 + 0.5) / n as f64 * TAU;
        let r = (1.0 - z * z).sqrt();
        let w = [
            r * phi.cos() / axes[0],
            r * phi.sin() / axes[1],
            z / axes[2],
        ];
        area += det * length(w) * 4.0 * PI / (n * n) as f64;
    }
    let got = f64::from(geometry.sphere_area(0));
    assert!((got / area - 1.0).abs() < 1e-3, "{got} {area}");
}

#[test]
fn lights_and_cameras_agree_in_both_widths() {
    let mut random = Random(47);
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 1);
        let n = scene.lights.len();
        for _ in 0..200 {
            let index: [u32; 8] = std::array::from_fn(|_| random.below(n.max(1)) as u32);
            let u: [[f32; 8]; 4] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.uniform()));
            let p: [[f32; 3]; 8] = std::array::from_fn(|_| narrow(scale(random.direction(), 0.5)));
            let lanes = u.map(f32x8::new);
            let p8 = Vec3::new(
                f32x8::new(p.map(|p| p[0])),
                f32x8::new(p.map(|p| p[1])),
                f32x8::new(p.map(|p| p[2])),
            );
            let direct = (world.lights).sample_direct::<f32x8>(
                &world.geometry,
                &index,
                p8,
                [lanes[0], lanes[1]],
            );
            let emission = (world.lights).sample_emission::<f32x8>(&world.geometry, &index, lanes);
            for i in 0..8 {
                let at = &index[i..=i];
                let one = (world.lights).sample_direct::<f32>(
                    &world.geometry,
                    at,
                    Vec3::splat(p[i]),
                    [u[0][i], u[1][i]],
                );
                let bits = |v: [f32; 3]| v.map(f32::to_bits);
                assert_eq!(bits(one.end.lane(0)), bits(direct.end.lane(i)), "{name}");
                let pdf8 = phalanx::simd::Lanes::lane(direct.pdf, i);
                assert_eq!(one.pdf.to_bits(), pdf8.to_bits(), "{name}");
                let one = (world.lights).sample_emission::<f32>(
                    &world.geometry,
                    at,
                    std::array::from_fn(|c| u[c][i]),
                );
                assert_eq!(
                    bits(one.origin.lane(0)),
                    bits(emission.origin.lane(i)),
                    "{name}"
                );
                assert_eq!(
                    bits(one.beta.lane(0)),
                    bits(emission.beta.lane(i)),
                    "{name}"
                );
            }
        }
    }
}
