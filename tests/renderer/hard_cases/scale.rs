//! Rows 18 and 19: far from the origin, and of any size.

use super::COMPARISONS;
use crate::support::stage::{GREY, lamp, stage};
use crate::support::{BOTH, Runs, head, run, scene, settings};
use phalanx::scene::{IntegratorKind, Scene};

/// The stage with everything in it moved by `d` and scaled by `s`: the picture must be the same.
fn moved(d: f64, s: f64) -> Scene {
    let camera = format!(
        "LookAt {} {} {}  {} {} {}  0 1 0\nCamera \"perspective\" \"float fov\" [40] \"float lensradius\" [{}] \"float focaldistance\" [{}]",
        d,
        d + 1.5 * s,
        d + 5.0 * s,
        d,
        d + 0.8 * s,
        d,
        0.05 * s,
        5.0 * s
    );
    // Intensity is per solid angle: irradiance falls with the square of the scale.
    let i = 4.0 * s * s;
    scene(
        &(head(24, 18, 4, &camera)
            + &format!("Translate {d} {d} {d}\nScale {s} {s} {s}\n")
            + &lamp("[8 8 8]")
            + &format!(
                "AttributeBegin\nTranslate 1 2 1\nLightSource \"point\" \"rgb I\" [{i} {i} {i}]\nAttributeEnd\n"
            )
            + "AttributeBegin\nMaterial \"glass\"\nTranslate -1 .5 1\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n"
            + &stage(GREY)),
    )
}

/// Rows 18 and 19: scenes far from the origin, of any size, and both. Scenes are centred and scaled
/// at load, and no length is absolute.
#[test]
fn scenes_far_away_and_of_any_size() {
    let plain = moved(0.0, 1.0);
    let one = |scene: &Scene| run(scene, &settings(scene, IntegratorKind::Pt, 64)).pixels;
    let mmlt = |scene: &Scene| Runs::new(scene, &settings(scene, IntegratorKind::Mmlt, 64), 12);
    let (pt_plain, mmlt_plain) = (one(&plain), mmlt(&plain));
    let mean: f64 = pt_plain.iter().flatten().map(|v| f64::from(*v)).sum();
    let places = [
        (1e3, 1.0),
        (1e5, 1.0),
        (1e6, 1.0),
        (0.0, 1e-4),
        (0.0, 0.03),
        (0.0, 1e3),
        (0.0, 1e6),
        // Squares and cubes of these lengths leave `f32`.
        (0.0, 1e-16),
        (0.0, 1e16),
        (1e6, 100.0),
    ];
    for (d, s) in places {
        let scene = moved(d, s);
        // The same primary samples make the same paths, but for roundings that send one in some
        // thousands the other way at an edge.
        let other = one(&scene);
        let off: f64 = (other.iter().flatten().zip(pt_plain.iter().flatten()))
            .map(|(a, b)| f64::from(a - b).abs())
            .sum();
        println!(
            "moved by {d}, scaled by {s}: {:.2e} of the light is elsewhere",
            off / mean
        );
        assert!(
            off / mean < 2e-3,
            "moved by {d}, scaled by {s}: {}",
            off / mean
        );
        let what = format!("moved by {d}, scaled by {s}");
        mmlt(&scene)
            .whole(1)
            .expect_same_among(COMPARISONS, &mmlt_plain.whole(1), &what);
    }
}

/// Row 18: rays leave the surfaces they come from. A plain under a constant sky has its albedo's
/// radiance, however it lies: points on it are rounded to one side or the other, and a path that
/// met the plain again would darken it.
#[test]
fn plains_do_not_shade_themselves() {
    for axis in ["1 2 3", "3 -1 1", "-1 1 5"] {
        let view = format!(
            "LookAt 0 2 3  0 0 0  0 1 0\nRotate 35 {axis}\nTranslate 70 -50 90\nCamera \"perspective\" \"float fov\" [20]"
        );
        let plain = format!(
            "LightSource \"infinite\" \"rgb L\" [1 1 1]\nTranslate -70 50 -90\nRotate -35 {axis}\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -3 -3 0 3 3 0 3 3 0 -3]\n"
        );
        let scene = scene(&(head(8, 8, 3, &view) + &plain));
        for kind in BOTH {
            let runs = Runs::new(&scene, &settings(&scene, kind, 256), 24);
            runs.whole(1)
                .expect_among(COMPARISONS, 0.5, &format!("{axis}, {kind:?}"));
        }
    }
}
