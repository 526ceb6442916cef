//! The room of `benches/rays`, with a light under its ceiling, grey walls and a camera: a scene
//! that chains can run in, of any number of triangles.

// The waves of rays are not used here.
#[allow(dead_code)]
#[path = "../rays/scenes.rs"]
mod scenes;

use phalanx::scene::*;

/// About `64 * detail^2` triangles.
pub fn lit(detail: usize) -> Scene {
    let mut scene = scenes::room(detail);
    let grey = Param::Constant([0.6; 3]);
    scene.materials[0].kind = MaterialKind::from(phalanx::surface::DiffuseMaterial {
        reflectance: grey,
        sigma: Param::Constant([0.0; 3]),
    });
    light(&mut scene);
    // At the back wall, looking in. The field of view is that of the rays bench.
    scene.camera.to_world = [
        [1.0, 0.0, 0.0, 0.02],
        [0.0, 1.0, 0.0, 0.05],
        [0.0, 0.0, 1.0, -0.53],
    ];
    scene.camera.screen = [-0.65, 0.65, -0.65, 0.65];
    scene.film.width = 400;
    scene.film.height = 400;
    scene.film.crop = [0, 400, 0, 400];
    scene.film.filter.radius = glam::Vec2::splat(0.5);
    scene
}

/// A square under the ceiling, facing down.
fn light(scene: &mut Scene) {
    let first = scene.triangles.len() as u32;
    let corner = scene.vertices.len() as u32;
    for [x, z] in [[-0.15, -0.15], [0.15, -0.15], [0.15, 0.15], [-0.15, 0.15]] {
        scene.vertices.push(Vertex {
            p: [x, 0.53, z],
            n: [0.0; 3],
            uv: [0.0; 2],
        });
    }
    let shape = scene.shapes.len() as u32;
    scene.shapes.push(Shape {
        material: 0,
        light: 0,
        first,
        alpha: NONE,
        boundary: NONE,
    });
    for (i, [a, b, c]) in [[0, 1, 2], [0, 2, 3]].into_iter().enumerate() {
        scene.triangles.push(Triangle {
            v: [corner + a, corner + b, corner + c],
            shape,
        });
        scene.lights.push(Light {
            origin: String::new(),
            kind: LightKind::Triangle {
                triangle: first + i as u32,
                l: [10.0; 3],
                two_sided: false,
            },
        });
    }
}
