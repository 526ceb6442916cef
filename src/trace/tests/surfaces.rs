//! Closed meshes do not leak, and rays that leave a surface do not meet it again.

use glam::Vec3;

use super::scenes::*;
use crate::scene::NONE;
use crate::simd::{Row, Vec3 as Lanes3, f32x8};
use crate::trace::offset::{leave_surface, triangle_point};
use crate::trace::{Coherence, Tracer};

/// A closed sphere of `2 * rings * (rings - 1) * 2` triangles.
fn globe(rings: usize) -> Vec<[Vec3; 3]> {
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

#[test]
fn closed_meshes_do_not_leak() {
    let mut random = Random(7);
    let triangles = globe(40);
    let tracer = Tracer::build(&scene(&triangles, vec![]));
    let count = 1 << 15;
    let list: Vec<u32> = (0..count).collect();
    let mut hits = vec![Row::default(); count as usize];
    let mut blocked = vec![0; count as usize];
    for round in 0..32 {
        let rays: Vec<Row> = list
            .iter()
            .map(|_| {
                // Origins of every fourth round are the centre: symmetric, many exact zeros.
                let o = match round % 4 {
                    0 => Vec3::ZERO,
                    _ => random.cube() * 0.5,
                };
                let [a, b, c] = triangles[random.below(triangles.len())];
                let at = match random.below(4) {
                    0 => a,
                    1 => (b + c) * 0.5,
                    2 => a.lerp(b, random.unit()),
                    _ => c.lerp(a, random.unit()),
                };
                let d = at - o;
                Row([o.x, o.y, o.z, f32::INFINITY, d.x, d.y, d.z, 0.0])
            })
            .collect();
        // One method in each half: they agree, and this is enough rays for each.
        let coherence = [Coherence::Coherent, Coherence::Incoherent][round / 16];
        tracer.closest_with::<f32x8>(coherence, &rays, &list, &mut hits);
        tracer.occluded_with::<f32x8>(coherence, &rays, &list, &mut blocked);
        for (i, hit) in hits.iter().enumerate() {
            assert!(hit.0[3].to_bits() != NONE, "{:?}", rays[i]);
            assert!((hit.0[0] - 1.0).abs() < 1e-2, "{hit:?} {:?}", rays[i]);
        }
        assert!(blocked.iter().all(|&b| b == 1));
    }
}

/// From points on triangles into the hemisphere on one side, grazing directions included: the triangle is not met.
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
        let rays: Vec<Row> = (0..64)
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
                Row([o.x, o.y, o.z, f32::INFINITY, d.x, d.y, d.z, 0.0])
            })
            .collect();
        let list: Vec<u32> = (0..64).collect();
        let mut hits = vec![Row::default(); 64];
        tracer.closest::<f32x8>(&rays, &list, &mut hits);
        for (j, hit) in hits.iter().enumerate() {
            if hit.0[3].to_bits() != NONE {
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
