//! Scenes and waves of rays, all from fixed seeds.

use glam::{DVec3, Quat, Vec2, Vec3};
use phalanx::chain::evaluator::Evaluator;
use phalanx::scene::*;
use phalanx::trace::{Coherence, Hit, Ray, Tracer};

/// xorshift64*.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / 16_777_216.0
    }
    fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (s, c) = (std::f32::consts::TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * c, r * s, z)
    }
}

/// A closed room with two blocks in it: 36 triangles, as many as the Cornell box.
fn small_room() -> Scene {
    let mut triangles = Vec::new();
    let mut cuboid = |centre: Vec3, half: Vec3, turn: f32| {
        let corner = |i: usize| {
            let pick = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            centre + Quat::from_rotation_y(turn) * (Vec3::new(pick(0), pick(1), pick(2)) * half)
        };
        for [a, b, c, d] in [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
            [2, 3, 7, 6],
            [0, 1, 5, 4],
        ] {
            let [a, b, c, d] = [a, b, c, d].map(corner);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    };
    cuboid(Vec3::ZERO, Vec3::splat(0.55), 0.0);
    cuboid(
        Vec3::new(-0.2, -0.2, 0.15),
        Vec3::new(0.15, 0.34, 0.15),
        0.3,
    );
    cuboid(
        Vec3::new(0.2, -0.38, -0.1),
        Vec3::new(0.15, 0.16, 0.15),
        -0.3,
    );
    scene(&triangles)
}

/// A closed room whose floor is a terrain, with bumpy spheres standing in it: `detail` is the
/// number of rings of a sphere. About `14 * 2 * detail^2 * 2 + 8 * detail^2` triangles; 36 for 0.
pub fn room(detail: usize) -> Scene {
    if detail == 0 {
        return small_room();
    }
    let mut triangles = Vec::new();
    let mut random = Random(0x5eed);
    // Walls, seen from inside; a box of half size 0.55.
    let h = 0.55f32;
    let corner = |i: usize| {
        let pick = |bit: usize| if i >> bit & 1 == 1 { h } else { -h };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    for [a, b, c, d] in [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
        [2, 3, 7, 6],
    ] {
        let [a, b, c, d] = [a, b, c, d].map(corner);
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let cells = 2 * detail;
    let height = |i: usize, j: usize| {
        let (x, z) = (i as f32 / cells as f32, j as f32 / cells as f32);
        let y = (9.0 * x).sin() * (7.0 * z).cos() + 0.3 * (31.0 * x + 3.0 * z).sin();
        Vec3::new((2.0 * x - 1.0) * h, -0.5 + 0.03 * y, (2.0 * z - 1.0) * h)
    };
    for i in 0..cells {
        for j in 0..cells {
            let [a, b] = [height(i, j), height(i + 1, j)];
            let [c, d] = [height(i + 1, j + 1), height(i, j + 1)];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    for _ in 0..14 {
        let centre = Vec3::new(
            random.unit() - 0.5,
            random.unit() - 0.6,
            random.unit() - 0.5,
        ) * 0.8;
        let radius = 0.05 + 0.1 * random.unit();
        let phase = 6.0 * random.unit();
        let point = |i: usize, j: usize| {
            let theta = std::f32::consts::PI * i as f32 / detail as f32;
            let phi = std::f32::consts::PI * (j % (2 * detail)) as f32 / detail as f32;
            let (s, c) = theta.sin_cos();
            let bump = 1.0 + 0.1 * (8.0 * phi + phase).sin() * (9.0 * theta).sin();
            centre + Vec3::new(s * phi.cos(), c, s * phi.sin()) * radius * bump
        };
        for i in 0..detail {
            for j in 0..2 * detail {
                let [a, b] = [point(i, j), point(i + 1, j)];
                let [c, d] = [point(i + 1, j + 1), point(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    scene(&triangles)
}

fn scene(triangles: &[[Vec3; 3]]) -> Scene {
    let black = Param::Constant([0.0; 3]);
    Scene {
        vertices: triangles
            .iter()
            .flatten()
            .map(|p| Vertex {
                p: p.to_array(),
                n: [0.0; 3],
                uv: [0.0; 2],
            })
            .collect(),
        tangents: vec![],
        triangles: (0..triangles.len() as u32)
            .map(|i| Triangle {
                v: [3 * i, 3 * i + 1, 3 * i + 2],
                shape: 0,
            })
            .collect(),
        spheres: vec![],
        shapes: vec![Shape {
            material: 0,
            light: NONE,
            first: 0,
            alpha: NONE,
            boundary: NONE,
        }],
        alphas: vec![],
        media: Default::default(),
        materials: vec![Material {
            name: String::new(),
            origin: String::new(),
            kind: MaterialKind::from(phalanx::surface::DiffuseMaterial {
                reflectance: black,
                sigma: black,
            }),
            bump: None,
        }],
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

/// Rays and the order in which they are traced.
pub struct Wave {
    pub name: &'static str,
    pub rays: Vec<Ray>,
    pub list: Vec<u32>,
    /// Only visibility is asked.
    pub shadow: bool,
}

/// Main axis and signs of the direction: what the renderer sorts its waves by.
fn bucket(ray: &Ray) -> usize {
    let d = ray.direction;
    let axis = (0..3).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs()));
    let sign = |k: usize| usize::from(d[k] < 0.0) << k;
    8 * axis.unwrap_or(0) + sign(0) + sign(1) + sign(2)
}

/// Waves of `side * side` rays, as a renderer makes them.
pub fn waves(scene: &Scene, tracer: &Tracer, side: usize) -> Vec<Wave> {
    let count = side * side;
    let mut random = Random(0xca5e);
    // Pixels in tiles of 4x2, tiles row by row.
    let pixels = (0..count).map(|i| {
        let (tile, within) = (i / 8, i % 8);
        let (tx, ty) = (tile % (side / 4), tile / (side / 4));
        (4 * tx + within % 4, 2 * ty + within / 4)
    });
    let eye = Vec3::new(0.02, 0.05, -0.53);
    let camera: Vec<Ray> = pixels
        .map(|(x, y)| {
            let u = (x as f32 + random.unit()) / side as f32 - 0.5;
            let v = 0.5 - (y as f32 + random.unit()) / side as f32;
            Ray::new(
                eye,
                f32::INFINITY,
                Vec3::new(1.3 * u, 1.3 * v, 1.0).normalize(),
            )
        })
        .collect();
    let all: Vec<u32> = (0..count as u32).collect();
    let mut hits = vec![Hit::default(); count];
    Evaluator::EIGHT.trace(tracer, Coherence::Coherent, &camera, &all, &mut hits);
    let light = Vec3::new(0.1, 0.5, 0.0);
    let (mut bounces, mut copies, mut shadows) = (vec![], vec![], vec![]);
    for (ray, hit) in camera.iter().zip(&hits) {
        let prim = hit.primitive;
        assert!(prim != NONE, "the room is closed");
        let p = scene.triangles[prim as usize]
            .v
            .map(|v| Vec3::from_array(scene.vertices[v as usize].p));
        let d = Vec3::from(ray.direction);
        let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        let n = if n.dot(d) < 0.0 { n } else { -n };
        let o = Vec3::from(ray.origin) + d * hit.t + n * 1e-5;
        bounces.push(Ray::new(
            o,
            f32::INFINITY,
            (n + random.direction()).normalize(),
        ));
        let towards = light + 0.05 * Vec3::new(random.unit(), 0.0, random.unit()) - o;
        shadows.push(Ray::new(o, 1.0, towards));
    }
    // Eight states of one chain, each a small step away.
    for i in 0..count {
        let ray = bounces[i / 8 * 8];
        let d = (Vec3::from(ray.direction) + 0.02 * random.direction()).normalize();
        copies.push(Ray::new(ray.origin, ray.t_max, d));
    }
    let mut shuffled = all.clone();
    for i in (1..count).rev() {
        shuffled.swap(i, ((random.unit() as f64 * (i + 1) as f64) as usize).min(i));
    }
    let sorted = |rays: &[Ray]| {
        let mut order = shuffled.clone();
        for batch in order.chunks_mut(1024) {
            batch.sort_by_key(|&i| bucket(&rays[i as usize]));
        }
        order
    };
    // Rays lie in memory in the order they are traced, as in a renderer's batches: what is measured
    // is the tree.
    let wave = |name, rays: &[Ray], order: &[u32], shadow| Wave {
        name,
        rays: order.iter().map(|&i| rays[i as usize]).collect(),
        list: all.clone(),
        shadow,
    };
    vec![
        wave("camera tiles", &camera, &all, false),
        wave("small steps", &copies, &all, false),
        wave("bounce pixel order", &bounces, &all, false),
        wave("bounce random order", &bounces, &shuffled, false),
        wave("bounce sorted", &bounces, &sorted(&bounces), false),
        wave("shadow pixel order", &shadows, &all, true),
        wave("shadow random order", &shadows, &shuffled, true),
        wave("shadow sorted", &shadows, &sorted(&shadows), true),
    ]
}
