//! Surfaces that are tested in `f64`: they fit their neighbours, every method agrees, and what is
//! near them is told from them.

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use super::scenes::*;
use super::surfaces::{globe, ray_to_seam};
use crate::scene::Scene;
use crate::scene::large::{LargeSphere, LargeTriangle};
use crate::simd::f32x8;
use crate::trace::{Coherence, Hit, Ray, Size, Tracer};

fn wide(p: Vec3) -> DVec3 {
    p.as_dvec3()
}

/// Makes triangles large, and what shares corners with them their seam.
fn enlarge(scene: &mut Scene, triangles: &[[Vec3; 3]], is_large: impl Fn(usize) -> bool) {
    let place = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let large: Vec<usize> = (0..triangles.len()).filter(|&i| is_large(i)).collect();
    let places: HashSet<_> = large
        .iter()
        .flat_map(|&i| triangles[i].map(place))
        .collect();
    for (i, p) in triangles.iter().enumerate() {
        let seam = !is_large(i);
        if !seam || p.iter().any(|p| places.contains(&place(*p))) {
            scene.large.triangles.push(LargeTriangle {
                triangle: i as u32,
                p: p.map(wide),
                seam,
                off: LargeTriangle::OFF,
            });
        }
    }
}

/// All ways to trace rays; fails where they differ.
fn trace_all(tracer: &mut Tracer, rays: &[Ray]) -> (Vec<Hit>, Vec<u32>) {
    let list: Vec<u32> = (0..rays.len() as u32).collect();
    let mut hits = vec![Hit::default(); rays.len()];
    let mut blocked = vec![7; rays.len()];
    tracer.closest::<f32>(rays, &list, &mut hits);
    tracer.occluded::<f32>(rays, &list, &mut blocked);
    for size in [Size::Tiny, Size::Small, Size::Large] {
        tracer.size = size;
        for coherence in [
            Coherence::Coherent,
            Coherence::Incoherent,
            Coherence::Unknown,
        ] {
            let mut other = vec![Hit::default(); rays.len()];
            let mut also = vec![7; rays.len()];
            tracer.closest_with::<f32x8>(coherence, rays, &list, &mut other);
            tracer.occluded_with::<f32x8>(coherence, rays, &list, &mut also);
            for i in 0..rays.len() {
                let bits = |hit: &Hit| bytemuck::cast::<Hit, [u32; 8]>(*hit);
                assert_eq!(bits(&hits[i]), bits(&other[i]), "{:?}", rays[i]);
                assert_eq!(blocked[i], also[i], "{:?}", rays[i]);
            }
        }
    }
    (hits, blocked)
}

#[test]
fn meshes_of_both_sorts_do_not_leak() {
    let mut random = Random(31);
    let triangles = globe(24);
    for part in [1, 3, 40] {
        let mut scene = scene(&triangles, vec![]);
        enlarge(&mut scene, &triangles, |i| {
            i % part == 0 && i / 100 % 2 == 0
        });
        let mut tracer = Tracer::build(&scene);
        let rays: Vec<Ray> = (0..1 << 15)
            .map(|i| {
                let o = match i % 4 {
                    0 => Vec3::ZERO,
                    _ => random.cube() * 0.5,
                };
                ray_to_seam(o, &triangles, &mut random)
            })
            .collect();
        let (hits, blocked) = trace_all(&mut tracer, &rays);
        for (hit, ray) in hits.iter().zip(&rays) {
            assert!(!hit.is_none(), "{ray:?}");
            assert!((hit.t - 1.0).abs() < 1e-2, "{hit:?} {ray:?}");
        }
        assert!(blocked.iter().all(|&b| b == 1));
    }
}

/// A ray finds the large surface it is a millionth of its size above, and none that starts as far
/// below or ends as far above.
#[test]
fn small_distances_are_seen() {
    let ground = [
        [
            Vec3::new(-0.7, -0.7, 0.0),
            Vec3::new(0.7, -0.7, 0.0),
            Vec3::new(0.7, 0.7, 0.0),
        ],
        [
            Vec3::new(-0.7, -0.7, 0.0),
            Vec3::new(0.7, 0.7, 0.0),
            Vec3::new(-0.7, 0.7, 0.0),
        ],
    ];
    let mut of_triangles = scene(&ground, vec![]);
    enlarge(&mut of_triangles, &ground, |_| true);
    let half = glam::DMat3::from_diagonal(DVec3::splat(0.5));
    let to_world = glam::DAffine3::from_mat3_translation(half, DVec3::new(0.0, 0.0, -0.5));
    let ball = ellipsoid(half.as_mat3(), Vec3::new(0.0, 0.0, -0.5));
    let mut of_sphere = scene(&[], vec![ball]);
    of_sphere.large.spheres.push(LargeSphere {
        sphere: 0,
        to_world,
        to_unit: to_world.inverse(),
    });
    let mut random = Random(32);
    for scene in [of_triangles, of_sphere] {
        let mut tracer = Tracer::build(&scene);
        for height in [1e-5f32, 1e-7, 1e-9, 1e-12] {
            let (mut rays, mut expected) = (vec![], vec![]);
            for _ in 0..64 {
                // Within the radius where a sphere falls off less than that.
                let (x, y) = (
                    random.signed() * 0.1 * height,
                    random.signed() * 0.1 * height,
                );
                let (dx, dy) = (random.signed(), random.signed());
                // From above through it; away from it; from above and not as far as it; from below,
                // away.
                for (z, dz, t_max, meets) in [
                    (height, -1.0, f32::INFINITY, true),
                    (height, 1.0, f32::INFINITY, false),
                    (height, -1.0, 0.5 * height, false),
                ] {
                    rays.push(Ray::new([x, y, z], t_max, [dx, dy, dz]));
                    expected.push(meets);
                }
            }
            let (hits, blocked) = trace_all(&mut tracer, &rays);
            for i in 0..rays.len() {
                let is_hit = !hits[i].is_none();
                assert_eq!(is_hit, expected[i], "{:?} {:?}", rays[i], hits[i]);
                assert_eq!(blocked[i] == 1, expected[i], "{:?}", rays[i]);
                if is_hit {
                    let t = hits[i].t;
                    assert!((t / height - 1.0).abs() < 0.1, "{t} {:?}", rays[i]);
                }
            }
        }
    }
}
