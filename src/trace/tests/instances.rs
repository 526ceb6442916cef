//! Instances: the best hit whatever the order, and no gaps between them.

use glam::{DAffine3, DMat3, DQuat, DVec3, Mat3, Vec3};

use super::scenes::*;
use super::surfaces::{globe, ray_to_seam};
use crate::scene::{Instance, NONE, Object, Scene, Sphere};
use crate::simd::f32x8;
use crate::trace::{Coherence, Hit, Ray, Size, Tracer};

/// A scene of triangles in their place and of objects.
fn instanced(
    own: &[[Vec3; 3]],
    objects: &[(Vec<[Vec3; 3]>, Vec<Sphere>)],
    placed: Vec<Instance>,
) -> Scene {
    let (mut triangles, mut spheres) = (own.to_vec(), Vec::new());
    let mut list = Vec::new();
    for (more, round) in objects {
        let first = [triangles.len() as u32, spheres.len() as u32];
        triangles.extend(more);
        spheres.extend(round);
        list.push(Object {
            triangles: first[0]..triangles.len() as u32,
            spheres: first[1]..spheres.len() as u32,
            bounds: [-Vec3::ONE, Vec3::ONE],
        });
    }
    let mut scene = scene(&triangles, spheres);
    scene.instances.objects = list;
    scene.instances.placed = placed;
    scene
}

fn turn(random: &mut Random) -> DMat3 {
    let axis = random.direction().as_dvec3();
    DMat3::from_quat(DQuat::from_axis_angle(axis, 6.0 * f64::from(random.unit())))
}

fn bits(hit: &Hit) -> [u32; 8] {
    bytemuck::cast(*hit)
}

#[test]
fn no_order_of_instances_changes_a_hit() {
    let mut random = Random(3);
    let triangle = |random: &mut Random, size: f32| {
        let at = random.cube() * (0.9 - size);
        [0; 3].map(|_| at + random.cube() * size)
    };
    let own: Vec<_> = (0..40).map(|_| triangle(&mut random, 0.3)).collect();
    let axes = Mat3::from_diagonal(Vec3::new(0.5, 0.3, 0.4));
    let ball = ellipsoid(axes, Vec3::new(0.2, 0.1, 0.0));
    let objects: Vec<_> = (0..3)
        .map(|i| {
            let triangles = (0..60).map(|_| triangle(&mut random, 0.4)).collect();
            (triangles, vec![ball; i])
        })
        .collect();
    let mut placed: Vec<Instance> = (0..60)
        .map(|i| {
            let size = f64::from(0.02 + 0.4 * random.unit());
            let mirror = if i % 3 == 0 { -1.0 } else { 1.0 };
            let scale = DMat3::from_diagonal(DVec3::new(size * mirror, size, 0.5 * size));
            Instance {
                to_world: DAffine3 {
                    matrix3: turn(&mut random) * scale * turn(&mut random),
                    translation: random.cube().as_dvec3() * 0.5,
                },
                object: i % 3,
            }
        })
        .collect();
    // The first of equal ones is met.
    placed.extend_from_within(20..30);
    let scene = instanced(&own, &objects, placed);
    let mut tracer = Tracer::build(&scene);
    let rays: Vec<Ray> = (0..4000)
        .map(|i| {
            // From inside, from around, and from far away.
            let o = random.cube() * [0.5, 2.0, 40.0][i % 3];
            let d = random.cube() * 0.7 - o;
            let end = [f32::INFINITY, 0.9][i % 2];
            Ray::new(o, end, d * [1.0, 0.01, 30.0][i / 4 % 3])
        })
        .collect();
    let list: Vec<u32> = (0..rays.len() as u32).collect();
    let mut expected = vec![Hit::default(); rays.len()];
    let instances = tracer.instances.take();
    tracer.closest::<f32>(&rays, &list, &mut expected);
    let mut backwards = expected.clone();
    tracer.instances = instances;
    for (i, ray) in rays.iter().enumerate() {
        let all = tracer.instances.as_ref().unwrap();
        all.closest_of_all(ray, &mut expected[i], &tracer.extent, false);
        all.closest_of_all(ray, &mut backwards[i], &tracer.extent, true);
        assert_eq!(bits(&expected[i]), bits(&backwards[i]), "{ray:?}");
    }
    let on_instances = expected.iter().filter(|h| h.instance != NONE).count();
    assert!(on_instances > 1000, "{on_instances}");
    assert!(
        expected
            .iter()
            .all(|h| h.instance == NONE || h.instance < 60)
    );
    let mut hits = vec![Hit::default(); rays.len()];
    let mut blocked = [vec![7; rays.len()], vec![7; rays.len()]];
    tracer.closest::<f32>(&rays, &list, &mut hits);
    tracer.occluded::<f32>(&rays, &list, &mut blocked[0]);
    for (hit, expected) in hits.iter().zip(&expected) {
        assert_eq!(bits(hit), bits(expected));
    }
    for size in [Size::Tiny, Size::Small, Size::Large] {
        tracer.size = size;
        for coherence in [Coherence::Coherent, Coherence::Incoherent] {
            tracer.closest_with::<f32x8>(coherence, &rays, &list, &mut hits);
            tracer.occluded_with::<f32x8>(coherence, &rays, &list, &mut blocked[1]);
            for (hit, expected) in hits.iter().zip(&expected) {
                assert_eq!(bits(hit), bits(expected));
            }
            assert_eq!(blocked[0], blocked[1]);
        }
    }
    for (i, hit) in hits.iter().enumerate().filter(|(i, _)| i % 2 == 0) {
        assert_eq!(blocked[0][i] == 1, !hit.is_none(), "{:?} {hit:?}", rays[i]);
    }
}

#[test]
fn instances_meet_without_gaps() {
    let mut random = Random(11);
    let whole = globe(24);
    for spread in [1.0, 0.02] {
        let placed: Vec<Instance> = (0..7)
            .map(|object| Instance {
                to_world: DAffine3 {
                    matrix3: turn(&mut random) * spread * f64::from(0.7 + random.unit()),
                    translation: random.cube().as_dvec3() * 0.3,
                },
                object,
            })
            .collect();
        let centre = random.cube() * 0.5;
        let shift = centre.as_dvec3();
        // What the file says in world space, as the loader rounds it in the objects' spaces.
        let in_place = |p: Vec3| p.as_dvec3() * (0.4 * spread) + shift;
        let objects: Vec<_> = placed
            .iter()
            .enumerate()
            .map(|(i, instance)| {
                let back = instance.to_world.inverse();
                let own = whole.iter().skip(i).step_by(7);
                let corners =
                    |t: &[Vec3; 3]| t.map(|p| back.transform_point3(in_place(p)).as_vec3());
                (own.map(corners).collect(), vec![])
            })
            .collect();
        let tracer = Tracer::build(&instanced(&[], &objects, placed));
        let count = 1 << 14;
        let list: Vec<u32> = (0..count).collect();
        let rays: Vec<Ray> = list
            .iter()
            .map(|_| {
                let ray = ray_to_seam(random.cube() * 0.5, &whole, &mut random);
                let origin = in_place(Vec3::from(ray.origin)).as_vec3();
                let direction = Vec3::from(ray.direction) * (0.4 * spread) as f32;
                Ray::endless(origin, direction)
            })
            .collect();
        let mut hits = vec![Hit::default(); count as usize];
        let mut blocked = vec![0; count as usize];
        tracer.closest::<f32x8>(&rays, &list, &mut hits);
        tracer.occluded::<f32x8>(&rays, &list, &mut blocked);
        let leaks = hits.iter().filter(|hit| hit.is_none()).count();
        assert_eq!(leaks, 0);
        assert!(blocked.iter().all(|b| *b == 1));
        assert!(hits.iter().all(|hit| (hit.t - 1.0).abs() < 0.05));
    }
}
