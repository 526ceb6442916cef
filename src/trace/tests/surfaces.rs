//! Closed meshes do not leak, and rays that leave a surface do not meet it again.

use glam::Vec3;

use super::scenes::*;
use crate::simd::{Vec3 as Lanes3, f32x8};
use crate::trace::offset::{leave_surface, triangle_point};
use crate::trace::{Coherence, Hit, Ray, Tracer};

/// A closed sphere of `2 * rings * (rings - 1) * 2` triangles.
pub fn globe(rings: usize) -> Vec<[Vec3; 3]> {
    let point = |i: usize, j: usize| {
        if i == 0 || i == rings {
            return Vec3::Y * if i == 0 { 0.9 } else { -0.9 };
        }
        let theta = std::f64::consts::PI * i as f64 / rings as f64;
        let phi = std::f64::consts::PI * (j % (2 * rings)) as f64 / rings as f64;
        let (s, c) = theta.sin_cos();
        (glam::DVec3::new(s * phi.cos(), c, s * phi.sin()) * 0.9).as_vec3()
    };
    let mut triangles = vec![];
    for i in 0..rings {
        for j in 0..2 * rings {
            let [a, b, c, d] = [
                point(i, j),
                point(i + 1, j),
                point(i + 1, j + 1),
                point(i, j + 1),
            ];
            triangles.extend(
                [[a, b, c], [a, c, d]]
                    .iter()
                    .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
            );
        }
    }
    triangles
}

/// A ray to a corner or an edge of some triangle, where meshes leak if they do.
pub fn ray_to_seam(o: Vec3, triangles: &[[Vec3; 3]], random: &mut Random) -> Ray {
    let [a, b, c] = triangles[random.below(triangles.len())];
    let at = match random.below(4) {
        0 => a,
        1 => (b + c) * 0.5,
        2 => a.lerp(b, random.unit()),
        _ => c.lerp(a, random.unit()),
    };
    Ray::endless(o, at - o)
}

#[test]
fn closed_meshes_do_not_leak() {
    let mut random = Random(7);
    let triangles = globe(40);
    let tracer = Tracer::build(&scene(&triangles, vec![]));
    let count = 1 << 15;
    let list: Vec<u32> = (0..count).collect();
    let mut hits = vec![Hit::default(); count as usize];
    let mut blocked = vec![0; count as usize];
    for round in 0..32 {
        let rays: Vec<Ray> = list
            .iter()
            .map(|_| {
                // Origins of every fourth round are the centre: symmetric, many exact zeros.
                let o = match round % 4 {
                    0 => Vec3::ZERO,
                    _ => random.cube() * 0.5,
                };
                ray_to_seam(o, &triangles, &mut random)
            })
            .collect();
        // One method in each half: they agree, and this is enough rays for each.
        let coherence = [Coherence::Coherent, Coherence::Incoherent][round / 16];
        tracer.closest_with::<f32x8>(coherence, &rays, &list, &mut hits);
        tracer.occluded_with::<f32x8>(coherence, &rays, &list, &mut blocked);
        for (i, hit) in hits.iter().enumerate() {
            assert!(!hit.is_none(), "{:?}", rays[i]);
            assert!((hit.t - 1.0).abs() < 1e-2, "{hit:?} {:?}", rays[i]);
        }
        assert!(blocked.iter().all(|&b| b == 1));
    }
}

/// From points on triangles into the hemisphere on one side, grazing directions included: the
/// triangle is not met.
#[test]
fn rays_leaving_a_surface_do_not_meet_it() {
    let mut random = Random(8);
    let triangles: Vec<[Vec3; 3]> = soup(&mut random, 4000)
        .into_iter()
        .filter(|p| (p[1] - p[0]).cross(p[2] - p[0]).length() > 0.0)
        .collect();
    let mut met = 0;
    let mut grazing_met = 0;
    for (i, p) in triangles.iter().enumerate() {
        // Alone in the world, so that nothing else is nearer.
        let tracer = Tracer::build(&scene(&[*p], vec![]));
        let n = (p[1] - p[0]).cross(p[2] - p[0]);
        let rays: Vec<Ray> = (0..64)
            .map(|j| {
                let (mut u, mut v) = (random.unit(), random.unit());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let lift = |p: Vec3| Lanes3::<f32>::new(p.x, p.y, p.z);
                let (point, error) = triangle_point(p.map(lift), u, v);
                let mut d = random.direction();
                if j % 4 == 0 {
                    // Nearly in the plane.
                    let unit = n.normalize();
                    d = (d - unit * d.dot(unit)).normalize() + unit * 1e-4 * random.unit();
                }
                let o = leave_surface(point, error, lift(n), lift(d));
                Ray::endless(o, d)
            })
            .collect();
        let list: Vec<u32> = (0..64).collect();
        let mut hits = vec![Hit::default(); 64];
        tracer.closest::<f32x8>(&rays, &list, &mut hits);
        for (j, hit) in hits.iter().enumerate() {
            if !hit.is_none() {
                if j % 4 == 0 {
                    grazing_met += 1;
                } else {
                    met += 1;
                }
                if met + grazing_met < 10 {
                    println!("{i} {p:?} {:?} {hit:?}", rays[j]);
                }
            }
        }
    }
    assert_eq!((met, grazing_met), (0, 0));
}

/// A segment between points on two triangles is not blocked by them: neither end counts.
#[test]
fn the_ends_of_a_segment_do_not_block_it() {
    let mut random = Random(10);
    let triangles: Vec<[Vec3; 3]> = soup(&mut random, 6000)
        .into_iter()
        .filter(|p| (p[1] - p[0]).cross(p[2] - p[0]).length() > 0.0)
        .collect();
    // Copies share a plane; a segment within it may well be blocked.
    for pair in triangles.chunks_exact(2).filter(|p| p[0] != p[1]) {
        let tracer = Tracer::build(&scene(pair, vec![]));
        let lift = |p: Vec3| Lanes3::<f32>::new(p.x, p.y, p.z);
        let normal = |p: &[Vec3; 3]| (p[1] - p[0]).cross(p[2] - p[0]);
        let rays: Vec<Ray> = (0..16)
            .map(|_| {
                let mut on = |p: &[Vec3; 3]| {
                    let u = random.unit();
                    triangle_point(p.map(lift), u, (1.0 - u) * random.unit())
                };
                let ((a, error_a), (b, error_b)) = (on(&pair[0]), on(&pair[1]));
                let o = leave_surface(a, error_a, lift(normal(&pair[0])), b - a);
                let e = leave_surface(b, error_b, lift(normal(&pair[1])), a - b);
                let d = e - o;
                Ray::new(o, 1.0, d)
            })
            .collect();
        let list: Vec<u32> = (0..16).collect();
        let mut blocked = vec![7; 16];
        tracer.occluded::<f32x8>(&rays, &list, &mut blocked);
        for (ray, blocked) in rays.iter().zip(&blocked) {
            assert_eq!(*blocked, 0, "{ray:?} {pair:?}");
        }
    }
}

/// The same for spheres, which also must not meet what leaves them.
#[test]
fn spheres_do_not_block_what_leaves_or_reaches_them() {
    let mut random = Random(11);
    let mut wrong = 0;
    for _ in 0..300 {
        let pair = [random_sphere(&mut random), random_sphere(&mut random)];
        let row = |m: &[[f32; 4]; 3], p: Vec3| {
            Vec3::from_array(
                [0, 1, 2].map(|k| m[k][0] * p.x + m[k][1] * p.y + m[k][2] * p.z + m[k][3]),
            )
        };
        let tracer = Tracer::build(&scene(&[], vec![pair[0]]));
        let lift = |p: Vec3| Lanes3::<f32>::new(p.x, p.y, p.z);
        let rays: Vec<Ray> = (0..64)
            .map(|i| {
                let unit = random.direction();
                let p = row(&pair[0].to_world, unit);
                let m = pair[0].to_unit;
                let n = Vec3::from_array(
                    [0, 1, 2].map(|k| m[0][k] * unit.x + m[1][k] * unit.y + m[2][k] * unit.z),
                );
                let error = Lanes3::splat([2e-6; 3]);
                let mut d = random.direction();
                if d.dot(n) < 0.0 {
                    d = -d;
                }
                let o = leave_surface(lift(p), error, lift(n), lift(d));
                // Away from the sphere, and from outside to a point just above it.
                if i % 2 == 0 {
                    Ray::new(o, 9.0, d)
                } else {
                    let from = lift(p + d);
                    let d = o - from;
                    Ray::new(from, 1.0, d)
                }
            })
            .collect();
        let list: Vec<u32> = (0..64).collect();
        let mut blocked = vec![7; 64];
        tracer.occluded::<f32x8>(&rays, &list, &mut blocked);
        wrong += blocked.iter().filter(|b| **b != 0).count();
    }
    assert_eq!(wrong, 0);
}

/// No absolute length anywhere: scaled by a power of two, everything keeps its bits.
#[test]
fn scale_changes_nothing() {
    let mut random = Random(12);
    let triangles = soup(&mut random, 400);
    let rays = rays(&mut random, &triangles, 1600);
    let list: Vec<u32> = (0..1600).collect();
    let trace = |scale: f32| {
        let scaled: Vec<_> = triangles.iter().map(|t| t.map(|p| p * scale)).collect();
        let rays: Vec<Ray> = rays
            .iter()
            .map(|r| {
                let origin = r.origin.map(|x| x * scale);
                Ray::new(origin, r.t_max * scale, r.direction)
            })
            .collect();
        let mut hits = vec![Hit::default(); rays.len()];
        let mut blocked = vec![0; rays.len()];
        let tracer = Tracer::build(&scene(&scaled, vec![]));
        tracer.closest::<f32x8>(&rays, &list, &mut hits);
        tracer.occluded::<f32x8>(&rays, &list, &mut blocked);
        for hit in &mut hits {
            hit.t /= scale;
        }
        (
            hits.iter()
                .map(|h| bytemuck::cast::<Hit, [u32; 8]>(*h))
                .collect::<Vec<_>>(),
            blocked,
        )
    };
    let one = trace(1.0);
    for exponent in [-14, -3, 5, 20] {
        assert!(one == trace(2.0f32.powi(exponent)), "2^{exponent}");
    }
}
