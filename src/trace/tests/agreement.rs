//! Every width and packet gives the bits of the brute-force oracle, and these are right by double
//! precision.

use std::time::Instant;

use glam::{DMat3, DVec3, Vec3};

use super::scenes::*;
use crate::scene::{NONE, Scene, Sphere};
use crate::simd::{Lanes, Mask, UintLanes, f32x8};
use crate::trace::best::Best;
use crate::trace::build::Part;
use crate::trace::ray;
use crate::trace::sphere::LeafSphere;
use crate::trace::store::{Builder, WIDTH, permuted};
use crate::trace::triangle::{Watertight, barycentrics, covers, hit, is_degenerate};
use crate::trace::{Coherence, Hit, Ray, Size, Tracer};
use crate::trace::{build, bvh8, packet, single};

/// Every primitive against one ray, by the same arithmetic but without a tree.
fn brute_force(tracer: &Tracer, scene: &Scene, rays: &[Ray], i: u32) -> (Hit, u32) {
    let ray = ray::Ray::<f32>::load(rays, &[i], &tracer.extent);
    let start = Best::new(&ray);
    let (mut best, mut any) = (start, false);
    let mut record = |mask: bool, t: f32, prim: u32, b: [f32; 2]| {
        if mask && (t < best.t || (t == best.t && prim < best.prim)) {
            best = Best {
                t,
                b1: b[0],
                b2: b[1],
                prim,
            };
        }
    };
    for (index, triangle) in scene.triangles.iter().enumerate() {
        let p = triangle.v.map(|v| scene.vertices[v as usize].p);
        let mut alone = Builder::default();
        alone.push(&[0], |_, vertex| p[vertex]);
        let alone = alone.finish();
        let p = permuted(alone.view().group(0, 1).ordered([0, 1, 2]).one(0), &ray);
        let (mask, weights) = covers(&ray.own, &p);
        let found = hit::<f32, false, false>(&ray.own, &p, mask, start.t, ray.pad);
        record(found.mask, found.t, index as u32, barycentrics(weights));
        any |= hit::<f32, true, false>(&ray.own, &p, mask, start.t, ray.pad).mask;
    }
    for (index, sphere) in scene.spheres.iter().enumerate() {
        let prim = (scene.triangles.len() + index) as u32;
        let sphere = LeafSphere::new(sphere, prim);
        let found = sphere.hit::<f32, false, false>(&ray, start.t);
        record(found.mask, found.t, prim, [0.0; 2]);
        any |= sphere.hit::<f32, true, false>(&ray, start.t).mask;
    }
    let mut hits = [Hit::default()];
    best.store(&ray, &rays[i as usize..], &[0], &mut hits);
    (hits[0], (any && ray.live()) as u32)
}

fn bits(hit: &Hit) -> [u32; 8] {
    bytemuck::cast(*hit)
}

/// All methods against the oracle, and in shuffled packets.
fn check(triangles: &[[Vec3; 3]], spheres: Vec<Sphere>, rays: &[Ray], random: &mut Random) {
    let scene = scene(triangles, spheres);
    let tracer = Tracer::build(&scene);
    let mut list: Vec<u32> = (0..rays.len() as u32).collect();
    let oracle: Vec<(Hit, u32)> = list
        .iter()
        .map(|&i| brute_force(&tracer, &scene, rays, i))
        .collect();
    let halves = build::halve(&Part::own(&scene, None));
    let wide = bvh8::collapse(&halves, WIDTH);
    let halves = Tracer::assemble(&scene, halves, wide, Instant::now());
    for (round, mut tracer) in [tracer, halves].into_iter().enumerate() {
        let unset: Hit = bytemuck::cast([7.0f32; 8]);
        let mut hits = vec![unset; rays.len()];
        let mut blocked = vec![7; rays.len()];
        let mut compare = |name: &str, trace: &dyn Fn(&mut [Hit], &mut [u32])| {
            hits.fill(unset);
            blocked.fill(7);
            trace(&mut hits, &mut blocked);
            for (i, (hit, block)) in oracle.iter().enumerate() {
                assert_eq!(
                    bits(&hits[i]),
                    bits(hit),
                    "{name}, round {round}, ray {i} {:?}: {:?} for {hit:?}",
                    rays[i],
                    hits[i]
                );
                assert_eq!(blocked[i], *block, "{name}, ray {i} {:?}", rays[i]);
            }
        };
        compare("scalar", &|hits, blocked| {
            tracer.closest::<f32>(rays, &list, hits);
            tracer.occluded::<f32>(rays, &list, blocked);
        });
        for (size, coherence) in [
            (Size::Small, Coherence::Coherent),
            (Size::Small, Coherence::Incoherent),
            (Size::Large, Coherence::Incoherent),
            (Size::Small, Coherence::Unknown),
            (Size::Large, Coherence::Unknown),
            (Size::Tiny, Coherence::Unknown),
        ] {
            tracer.size = size;
            let trace = |hits: &mut [Hit], blocked: &mut [u32]| {
                tracer.closest_with::<f32x8>(coherence, rays, &list, hits);
                tracer.occluded_with::<f32x8>(coherence, rays, &list, blocked);
            };
            compare(&format!("{size:?}, {coherence:?}"), &trace);
        }
        for few in [1, 4, 7] {
            compare(&format!("apart at {few}"), &|hits, blocked| {
                let mut walks = single::Walks::new();
                let mut stack = packet::Stack::new();
                for packet in list.chunks(8) {
                    let ray = ray::Ray::<f32x8>::load(rays, packet, &tracer.extent);
                    let trees = tracer.trees();
                    let mut best = Best::new(&ray);
                    packet::traverse::<f32x8, Watertight, false, false>(
                        &trees, &ray, &mut best, &mut stack, &mut walks, few,
                    );
                    best.store(&ray, rays, packet, hits);
                    let mut best = Best::new(&ray);
                    packet::traverse::<f32x8, Watertight, true, false>(
                        &trees, &ray, &mut best, &mut stack, &mut walks, few,
                    );
                    for (lane, &i) in packet.iter().enumerate() {
                        blocked[i as usize] = best.blocked(&ray) >> lane & 1;
                    }
                }
            });
        }
        for i in (1..list.len()).rev() {
            list.swap(i, random.below(i + 1));
        }
    }
}

#[test]
fn all_methods_agree_with_brute_force() {
    let mut random = Random(1);
    for round in 0..40 {
        let count = [0, 1, 2, 3, 8, 60, 300, 1000][round % 8];
        let triangles = soup(&mut random, count);
        let spheres = match round % 3 {
            0 => vec![],
            1 => (0..3).map(|_| random_sphere(&mut random)).collect(),
            _ => (0..40).map(|_| random_sphere(&mut random)).collect(),
        };
        let rays = rays(&mut random, &triangles, 1003);
        check(&triangles, spheres, &rays, &mut random);
    }
}

/// Sizes that shrink with every primitive make the deepest trees.
#[test]
fn nests_of_primitives_are_traced() {
    let mut random = Random(9);
    let triangles: Vec<[Vec3; 3]> = (0..900)
        .map(|i| {
            let size = 0.9f32.powi(i);
            let at = Vec3::splat(size);
            [
                at,
                at + random.cube() * size * 0.1,
                at + random.cube() * size * 0.1,
            ]
        })
        .collect();
    let rays = rays(&mut random, &triangles, 512);
    check(&triangles, vec![], &rays, &mut random);
}

#[test]
fn coincident_primitives_go_to_the_smaller_index() {
    let mut random = Random(2);
    let one = [
        Vec3::ZERO,
        Vec3::new(0.5, 0.1, 0.0),
        Vec3::new(0.0, 0.5, 0.2),
    ];
    let triangles = vec![one; 200];
    let rays = rays(&mut random, &triangles, 512);
    check(&triangles, vec![], &rays, &mut random);
    let tracer = Tracer::build(&scene(&triangles, vec![]));
    let d = (one[0] + one[1] + one[2]) / 3.0 - Vec3::splat(0.9);
    let ray = [Ray::new([0.9; 3], 9.0, d)];
    let mut hits = [Hit::default()];
    tracer.closest::<f32x8>(&ray, &[0], &mut hits);
    assert_eq!(hits[0].primitive, 0);
}

#[test]
fn nonsense_rays_hit_nothing() {
    let mut random = Random(3);
    let triangles = soup(&mut random, 300);
    let odd = [
        0.0,
        -0.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        1e-45,
        3e38,
        -3e38,
        1.0,
    ];
    let rays: Vec<Ray> = (0..4000)
        .map(|_| {
            let [ox, oy, oz, t_max, dx, dy, dz, _]: [f32; 8] =
                std::array::from_fn(|_| odd[random.below(odd.len())]);
            Ray::new([ox, oy, oz], t_max, [dx, dy, dz])
        })
        .collect();
    let spheres = (0..5).map(|_| random_sphere(&mut random)).collect();
    check(&triangles, spheres, &rays, &mut random);
    let tracer = Tracer::build(&scene(&triangles, vec![]));
    let d = [[0.0; 3], [f32::NAN, 1.0, 1.0], [f32::INFINITY, 0.0, 0.0]];
    let rays = d.map(|d| Ray::new([0.0; 3], 9.0, d));
    let mut hits = [Hit::default(); 3];
    tracer.closest::<f32x8>(&rays, &[0, 1, 2], &mut hits);
    assert!(hits.iter().all(|h| h.is_none()));
}

#[test]
fn broken_geometry_and_interfaces_are_left_out() {
    let mut random = Random(4);
    let mut triangles = soup(&mut random, 50);
    triangles.push([Vec3::splat(f32::NAN), Vec3::ONE, Vec3::ZERO]);
    triangles.push([Vec3::new(0.0, f32::INFINITY, 0.0), Vec3::ONE, Vec3::ZERO]);
    let mut scene = scene(&triangles, vec![random_sphere(&mut random)]);
    scene.triangles[3].shape = 1;
    scene.triangles[7].shape = 1;
    scene.spheres[0].shape = 1;
    let tracer = Tracer::build(&scene);
    let usable =
        |i: &usize| *i != 3 && *i != 7 && !is_degenerate(triangles[*i].map(|p| p.to_array()));
    assert_eq!(tracer.stats().triangles, (0..50).filter(usable).count());
    assert_eq!(tracer.stats().spheres, 0);
    let rays = rays(&mut random, &triangles, 1000);
    let list: Vec<u32> = (0..1000).filter(|i| i % 16 != 15).collect();
    let mut hits = vec![Hit::default(); 1000];
    tracer.closest::<f32x8>(&rays, &list, &mut hits);
    for &i in &list {
        let prim = hits[i as usize].primitive;
        assert!(prim == NONE || (prim < 50 && prim != 3 && prim != 7));
    }
}

/// The closest hit in double precision, and the runner-up's distance.
fn double_precision(triangles: &[[Vec3; 3]], spheres: &[Sphere], ray: &Ray) -> [(f64, u32); 2] {
    let [o, d] = [ray.origin, ray.direction].map(|v| DVec3::from(v.map(f64::from)));
    let mut all = vec![(f64::INFINITY, NONE); 2];
    for (i, p) in triangles.iter().enumerate() {
        let p = p.map(|p| p.as_dvec3());
        let m = DMat3::from_cols(-d, p[1] - p[0], p[2] - p[0]);
        let x = m.inverse() * (o - p[0]);
        if x.is_finite() && x.y >= 0.0 && x.z >= 0.0 && x.y + x.z <= 1.0 {
            all.push((x.x, i as u32));
        }
    }
    for (i, s) in spheres.iter().enumerate() {
        let row = |k: usize| DVec3::from_array([0, 1, 2].map(|j| s.to_unit[k][j] as f64));
        let m = [row(0), row(1), row(2)];
        let o = DVec3::from_array([0, 1, 2].map(|k| m[k].dot(o) + s.to_unit[k][3] as f64));
        let d = DVec3::from_array([0, 1, 2].map(|k| m[k].dot(d)));
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
        let root = (b * b - a * c).sqrt();
        for t in [(-b - root) / a, (-b + root) / a] {
            all.push((t, (triangles.len() + i) as u32));
        }
    }
    all.retain(|h| h.0 > 0.0 && (h.0 < f64::from(ray.t_max) || h.1 == NONE));
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    [all[0], all[1]]
}

#[test]
fn hits_are_right_by_double_precision() {
    let mut random = Random(5);
    let mut clear = 0;
    for _ in 0..10 {
        let triangles: Vec<[Vec3; 3]> = (0..100)
            .map(|_| {
                let at = random.cube() * 0.5;
                [at, at + random.cube() * 0.3, at + random.cube() * 0.3]
            })
            .collect();
        let spheres: Vec<Sphere> = (0..10).map(|_| random_sphere(&mut random)).collect();
        let rays: Vec<Ray> = (0..2000)
            .map(|_| {
                let (o, d) = (random.cube(), random.direction());
                Ray::new(o, 10.0, d)
            })
            .collect();
        let list: Vec<u32> = (0..2000).collect();
        let tracer = Tracer::build(&scene(&triangles, spheres.clone()));
        let mut hits = vec![Hit::default(); rays.len()];
        let mut blocked = vec![0; rays.len()];
        tracer.closest::<f32x8>(&rays, &list, &mut hits);
        tracer.occluded::<f32x8>(&rays, &list, &mut blocked);
        for (ray, (hit, blocked)) in rays.iter().zip(hits.iter().zip(&blocked)) {
            let [(t, prim), next] = double_precision(&triangles, &spheres, ray);
            let found = hit.primitive;
            assert_eq!(*blocked, (found != NONE) as u32);
            // Rounding may decide at edges and where two hits are close.
            if prim != found {
                continue;
            }
            clear += 1;
            if prim != NONE && next.0 - t > 1e-4 {
                assert!((f64::from(hit.t) - t).abs() < 2e-5, "{t} {hit:?} {ray:?}");
            }
            if (prim as usize) < triangles.len() {
                let [a, b, c] = triangles[prim as usize].map(|p| p.as_dvec3());
                let [b1, b2] = hit.b.map(f64::from);
                let p = a * (1.0 - b1 - b2) + b * b1 + c * b2;
                let [o, d] = [ray.origin, ray.direction].map(|v| DVec3::from(v.map(f64::from)));
                let q = o + d * t;
                assert!((p - q).length() < 2e-5, "{p} {q}");
            }
        }
    }
    assert!(clear >= 19_990, "{clear}");
}

#[test]
fn widths_share_every_lane_of_setup() {
    let mut random = Random(6);
    let triangles = soup(&mut random, 30);
    let rays = rays(&mut random, &triangles, 64);
    let tracer = Tracer::build(&scene(&triangles, vec![]));
    for chunk in (0..64u32).collect::<Vec<_>>().chunks(8) {
        let wide = ray::Ray::<f32x8>::load(&rays, chunk, &tracer.extent);
        for (lane, i) in chunk.iter().enumerate() {
            let one = ray::Ray::<f32>::load(&rays, &[*i], &tracer.extent);
            assert_eq!(wide.t_max.lane(lane).to_bits(), one.t_max.to_bits());
            assert_eq!(wide.swap_x.bits() >> lane & 1 == 1, one.swap_x);
            for k in 0..3 {
                let same = |a: f32x8, b: f32| assert_eq!(a.to_bits().lane(lane), b.to_bits());
                same(wide.own.o[k], one.own.o[k]);
                same(wide.own.d[k], one.own.d[k]);
                same(wide.ord[k], one.ord[k]);
            }
        }
    }
}
