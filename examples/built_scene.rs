//! A scene made in code becomes a picture: cargo run --release --example built_scene -- PICTURE

use std::error::Error;

use phalanx::integrate::{Settings, Silent, render};
use phalanx::pbrt::{Material, SceneBuilder};

fn main() -> Result<(), Box<dyn Error>> {
    let picture = std::env::args().nth(1).unwrap_or("built.png".into());
    let square = |y: f32, half: f32| {
        [[-half, -half], [-half, half], [half, half], [half, -half]].map(|[x, z]| [x, y, z])
    };
    let mut builder = SceneBuilder::new(480, 320)
        .camera([0.0, 1.6, 5.0], [0.0, 0.5, 0.0], 32.0)
        .material(Material::Diffuse([0.6, 0.58, 0.55]))
        .mesh(&square(0.0, 20.0), &[[0, 1, 2], [0, 2, 3]])
        .emission([9.0, 8.0, 7.0])
        // Seen from below, so that the light faces down.
        .mesh(&square(3.5, 1.0), &[[0, 2, 1], [0, 3, 2]])
        .emission([0.0; 3])
        .material(Material::Dielectric {
            eta: 1.5,
            roughness: 0.0,
        })
        .sphere([0.0, 0.6, 0.6], 0.6);
    // A row of lacquered spheres behind, from blue to red.
    for i in 0..5u8 {
        let part = f32::from(i) / 4.0;
        builder = builder
            .material(Material::Coated {
                reflectance: [0.1 + 0.6 * part, 0.1, 0.7 - 0.6 * part],
                roughness: 0.05,
            })
            .sphere([1.1 * (f32::from(i) - 2.0), 0.45, -1.2], 0.45);
    }
    let scene = builder.build()?;
    let settings = Settings {
        target_error: Some(0.05),
        ..Settings::of(&scene)
    };
    render(&scene, &settings, &Silent)?.write(&picture)?;
    Ok(())
}
