//! Reflectances above 1: pbrt-v3 takes them as they are, pbrt-v4 as 1.

use crate::support;

use phalanx::scene::{IntegratorKind, Scene};
use support::{Runs, head, scene, settings};

/// A square that fills the view, under an even sky of 1: nothing is reflected twice.
fn square(material: &str) -> Scene {
    let view = "LookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [25]";
    scene(
        &(head(4, 3, 3, view)
            + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
            + material
            + "\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
               \"point P\" [-2 -2 0 2 -2 0 2 2 0 -2 2 0]\nWorldEnd\n"),
    )
}

#[test]
fn surfaces_of_v3_may_make_light() {
    let red = "MakeNamedMaterial \"red\" \"string type\" \"matte\" \"rgb Kd\" [.75 .5 0]\n";
    let blue = "MakeNamedMaterial \"blue\" \"string type\" \"matte\" \"rgb Kd\" [0 .5 1]\n";
    for (material, colour) in [
        (
            "Material \"matte\" \"rgb Kd\" [2 .5 0]".into(),
            [2.0, 0.5, 0.0],
        ),
        (
            "Material \"mirror\" \"rgb Kr\" [3 1 .5]".into(),
            [3.0, 1.0, 0.5],
        ),
        (
            "Texture \"t\" \"spectrum\" \"scale\" \"rgb tex1\" [4 4 4] \"rgb tex2\" [.5 .25 0]
             Material \"matte\" \"texture Kd\" \"t\""
                .into(),
            [2.0, 1.0, 0.0],
        ),
        (
            "Material \"translucent\" \"rgb Kd\" [4 1 2] \"rgb Ks\" [0 0 0] \
             \"rgb reflect\" [.5 .5 2] \"rgb transmit\" [0 0 0]"
                .into(),
            [2.0, 0.5, 4.0],
        ),
        // What is left of 1 is nothing (`MixMaterial`).
        (
            format!(
                "{red}{blue}Material \"mix\" \"string namedmaterial1\" \"red\" \
                 \"string namedmaterial2\" \"blue\" \"rgb amount\" [2 .5 4]"
            ),
            [1.5, 0.5, 0.0],
        ),
    ] {
        let scene = square(&material);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        for kind in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
            let runs = Runs::new(&scene, &settings(&scene, kind, 64), 8);
            for (c, expected) in colour.into_iter().enumerate() {
                let what = format!("{material}, {kind:?}, channel {c}");
                runs.whole(c).expect(expected, &what);
            }
        }
    }
}

#[test]
fn surfaces_of_v4_reflect_no_more_than_there_is() {
    let text = "LookAt 0 0 4 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 25
        Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 3 PixelFilter \"box\"
        Integrator \"path\" \"integer maxdepth\" 3
        WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1]
        Material \"diffuse\" \"rgb reflectance\" [2 .5 3]
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
        \"point3 P\" [-2 -2 0 2 -2 0 2 2 0 -2 2 0]";
    let scene = scene(text);
    let [warning] = &scene.warnings[..] else {
        panic!("{:?}", scene.warnings);
    };
    assert!(
        warning.contains("is more than 1, and counts as 1"),
        "{warning}"
    );
    let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), 8);
    for (c, expected) in [1.0, 0.5, 1.0].into_iter().enumerate() {
        runs.whole(c).expect(expected, &format!("channel {c}"));
    }
}
