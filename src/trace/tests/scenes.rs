//! Small scenes and rays for the tests.

use glam::{DVec3, Vec2, Vec3};

use crate::scene::*;
use crate::trace::Ray;

/// xorshift64*: plain numbers for test data.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / 16_777_216.0
    }
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() as f64 * n as f64) as usize).min(n - 1)
    }
    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if v.length_squared() > 1e-3 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }
}

/// A scene of one diffuse material; shape 1 has an interface material.
pub fn scene(triangles: &[[Vec3; 3]], spheres: Vec<Sphere>) -> Scene {
    let vertices = triangles.iter().flatten().map(|p| Vertex {
        p: p.to_array(),
        n: [0.0; 3],
        uv: [0.0; 2],
    });
    let indices = (0..triangles.len() as u32).map(|i| Triangle {
        v: [3 * i, 3 * i + 1, 3 * i + 2],
        shape: 0,
    });
    let black = Param::Constant([0.0; 3]);
    let material = |kind| Material {
        name: String::new(),
        origin: String::new(),
        kind,
        bump: None,
    };
    let shape = |material| Shape {
        material,
        light: NONE,
        first: 0,
        alpha: NONE,
        boundary: NONE,
    };
    Scene {
        vertices: vertices.collect(),
        tangents: vec![],
        triangles: indices.collect(),
        spheres,
        shapes: vec![shape(0), shape(1)],
        alphas: vec![],
        media: Default::default(),
        materials: vec![
            material(MaterialKind::from(crate::surface::DiffuseMaterial {
                reflectance: black,
                sigma: black,
            })),
            material(MaterialKind::Interface),
        ],
        textures: vec![],
        images: vec![],
        lights: vec![],
        camera: Camera {
            projection: Projection::Perspective,
            to_world: [[0.0; 4]; 3],
            screen: [0.0; 4],
            lens_radius: 0.0,
            focal_distance: 1.0,
        },
        film: Film {
            width: 1,
            height: 1,
            crop: [0, 1, 0, 1],
            filename: None,
            filter: Filter {
                radius: Vec2::ONE,
                kind: FilterKind::Box,
            },
            scale: 1.0,
            colour: None,
            chromaticities: None,
            clamp: None,
        },
        integrator: IntegratorSettings::default(),
        sides: Sides::Geometric,
        brightest: 1.0,
        space: Space {
            centre: DVec3::ZERO,
            scale: 1.0,
        },
        large: Large::default(),
        instances: Instances::default(),
        bounds: [-Vec3::ONE, Vec3::ONE],
        files: vec![],
        warnings: vec![],
    }
}

/// An ellipsoid with the given axes (columns) and centre.
pub fn ellipsoid(axes: glam::Mat3, centre: Vec3) -> Sphere {
    let rows = |m: glam::DMat3, t: DVec3| {
        [0, 1, 2].map(|k| {
            let r = m.row(k);
            [r.x as f32, r.y as f32, r.z as f32, t[k] as f32]
        })
    };
    let (m, c) = (axes.as_dmat3(), centre.as_dvec3());
    let inverse = m.inverse();
    Sphere {
        to_world: rows(m, c),
        to_unit: rows(inverse, -(inverse * c)),
        facing: 1.0,
        shape: 0,
    }
}

pub fn random_sphere(random: &mut Random) -> Sphere {
    let turn = glam::Mat3::from_axis_angle(random.direction(), 6.0 * random.unit());
    let size = 0.2 * random.unit() + 0.01;
    let stretch = if random.unit() < 0.5 {
        Vec3::ONE
    } else {
        Vec3::new(random.unit(), random.unit(), random.unit()) + 0.1
    };
    let axes = turn * glam::Mat3::from_diagonal(stretch * size);
    ellipsoid(axes, random.cube() * 0.5)
}

/// Triangles of all sizes and shapes: large, small, needles, degenerate ones and exact copies.
pub fn soup(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let mut triangles: Vec<[Vec3; 3]> = Vec::with_capacity(count);
    for i in 0..count {
        let at = random.cube() * 0.5;
        let size = 0.5 * 10.0f32.powf(-4.0 * random.unit());
        let (a, b) = (random.cube() * size, random.cube() * size);
        triangles.push(match i % 12 {
            // A needle.
            0 => [at, at + a, at + a + b * 1e-4],
            // No area.
            1 => [at, at + a, at + a * 0.5],
            2 => [at, at, at + b],
            3 => [at; 3],
            // In a plane of two axes.
            4 => [
                at,
                at + a * Vec3::new(1.0, 1.0, 0.0),
                at + b * Vec3::new(1.0, 1.0, 0.0),
            ],
            5 => [
                at,
                at + a * Vec3::new(0.0, 1.0, 1.0),
                at + b * Vec3::new(0.0, 1.0, 1.0),
            ],
            // A copy.
            6 if i > 12 => triangles[random.below(i)],
            _ => [at, at + a, at + b],
        });
    }
    triangles
}

/// Rays of all sorts: random, along axes (with zeros of both signs), at vertices and edges, from
/// surfaces, of many lengths.
pub fn rays(random: &mut Random, triangles: &[[Vec3; 3]], count: usize) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let mut o = random.cube();
            let mut d = random.direction();
            let mut t_max = f32::INFINITY;
            let corner = |random: &mut Random| {
                if triangles.is_empty() {
                    return [random.cube(), random.cube(), random.cube()];
                }
                triangles[random.below(triangles.len())]
            };
            match i % 16 {
                0 => d = Vec3::new(1.0, 0.0, -0.0),
                1 => d = Vec3::new(-0.0, -1.0, 0.0),
                2 => d = Vec3::new(0.0, d.y, d.z),
                3 => d = corner(random)[0] - o,
                4 => {
                    let [a, b, _] = corner(random);
                    d = (a + b) * 0.5 - o;
                }
                // From a surface, and towards one: visibility between two points.
                5..=8 => {
                    let [a, b, c] = corner(random);
                    o = a * 0.3 + b * 0.3 + c * 0.4;
                    if i % 2 == 0 {
                        let [a, b, c] = corner(random);
                        d = a * 0.1 + b * 0.2 + c * 0.7 - o;
                        t_max = 1.0;
                    }
                }
                // Along an axis from a vertex: the slabs meet 0 * inf.
                9 => {
                    o = corner(random)[1];
                    d = Vec3::new(0.0, 0.0, -1.0);
                }
                10 => t_max = random.unit(),
                11 => d *= 1e-30,
                12 => d *= 1e30,
                13 => {
                    o = random.direction() * 1000.0;
                    d = random.cube() * 0.5 - o;
                }
                // In the plane of a triangle.
                14 => {
                    let [a, b, c] = corner(random);
                    o = a + (b - a) * 3.0;
                    d = (a + c) * 0.5 - o;
                }
                _ => {}
            }
            Ray::new(o, t_max, d)
        })
        .collect()
}
