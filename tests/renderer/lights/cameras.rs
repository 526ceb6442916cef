//! Cameras: where points are in the picture, and densities of rays.

use crate::common::scenes;
use crate::common::stats::Random;
use phalanx::camera::Camera;
use phalanx::replay::vector::*;
use phalanx::simd::Vec3;
use std::f64::consts::TAU;

#[test]
fn cameras_find_the_points_of_their_rays() {
    let mut random = Random(46);
    for (name, scene) in scenes::all() {
        let camera = Camera::new(&scene.camera, &scene.film);
        // Those that see every direction may show it in several places: tests/renderer/cameras.rs.
        if camera.sphere_map().is_some() {
            continue;
        }
        for _ in 0..5000 {
            let (x, y) = camera.region.place(random.uniform(), random.uniform());
            let lens = (random.uniform(), random.uniform());
            let ray = camera.ray::<f32, false>(x, y, lens);
            assert!((length(wide(ray.direction.lane(0))) - 1.0).abs() < 1e-6);
            let t = 0.3 + 2.0 * random.uniform();
            let p = ray.direction.mul_add(t, ray.origin);
            let link = camera.connect::<f32, false>(p, lens);
            // A few ulps of positions, over the size of a pixel at unit distance.
            let pixel = f64::from(camera.region.width.max(camera.region.height));
            let slack = 4e-6 * pixel / f64::from(t).min(1.0) + 1e-5;
            let edge = f64::from(x - camera.region.x0)
                .min(f64::from(y - camera.region.y0))
                .min(f64::from(camera.region.x0 + camera.region.width - x))
                .min(f64::from(camera.region.y0 + camera.region.height - y));
            if edge < slack {
                continue;
            }
            assert!(link.valid, "{name}");
            let (dx, dy) = (f64::from(link.raster.0 - x), f64::from(link.raster.1 - y));
            assert!(
                dx.abs() < slack && dy.abs() < slack,
                "{name}: off by {dx} {dy} of {slack}"
            );
            let back = add(wide(link.to_camera.lane(0)), wide(ray.direction.lane(0)));
            assert!(length(back) < 1e-5, "{name}: {back:?}");
            let away = length(sub(wide(link.origin.lane(0)), wide(ray.origin.lane(0))));
            assert!(away < 1e-6, "{name}: {away}");
            let d2 = if camera.is_parallel() {
                1.0
            } else {
                f64::from(t) * f64::from(t)
            };
            let density = f64::from(link.pdf) * d2 / f64::from(ray.pdf);
            assert!((density - 1.0).abs() < 1e-4, "{name}: {density}");
        }
        // Behind it there is nothing.
        let ray = camera.ray::<f32, false>(camera.region.x0, camera.region.y0, (0.5, 0.5));
        let p = ray.direction.mul_add(-1.0, ray.origin);
        assert!(!camera.connect::<f32, false>(p, (0.5, 0.5)).valid, "{name}");
    }
}

#[test]
fn densities_of_camera_rays_integrate_to_one() {
    for (name, scene) in scenes::all() {
        let camera = Camera::new(&scene.camera, &scene.film);
        if camera.is_parallel() || camera.has_lens() {
            continue;
        }
        let position = camera.position();
        let m = scene.camera.to_world;
        let n = 1500;
        let mut sum = 0.0;
        // Behind, too, if the camera has no back.
        let range = if camera.sphere_map().is_some() {
            2.0
        } else {
            1.0
        };
        for i in 0..n * n {
            let z = 1.0 - ((i % n) as f64 + 0.5) / n as f64 * range;
            let phi = ((i / n) as f64 + 0.5) / n as f64 * TAU;
            let r = (1.0 - z * z).sqrt();
            let w = [r * phi.cos(), r * phi.sin(), z];
            let w: V =
                std::array::from_fn(|c| (0..3).map(|k| f64::from(m[c][k]) * w[k]).sum::<f64>());
            let p = add(wide(position), w);
            let link = camera.connect::<f32, false>(Vec3::splat(narrow(p)), (0.0, 0.0));
            if link.valid {
                sum += f64::from(link.pdf) * range * TAU / (n * n) as f64;
            }
        }
        // Cells at the border of the region are counted whole or not at all.
        assert!((sum - 1.0).abs() < 4e-3, "{name}: {sum}");
    }
}
