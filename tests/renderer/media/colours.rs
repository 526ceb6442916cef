//! Media whose densities are colours.

use super::{DENSITY, SEEDS, density, expect_agreement, grid_values};
use crate::support::{Runs, scene, settings};

use phalanx::medium::{MediumTable, Passed, Piece};
use phalanx::scene::IntegratorKind;

/// The same medium by numbers and by colours.
#[test]
fn grids_of_colours_are_those_of_numbers() {
    let head = "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"\n\
                Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
                PixelFilter \"box\"\nIntegrator \"volpath\" \"integer maxdepth\" 3\nWorldBegin\n";
    let around = "Material \"interface\" MediumInterface \"smoke\" \"\"\n\
                  Shape \"sphere\" \"float radius\" 2\nMediumInterface \"\" \"\"\n\
                  LightSource \"point\" \"point3 from\" [1 2 -2] \"rgb I\" [9 9 9]\n";
    let colours = |sigma: [f64; 3]| {
        let of = |d: f64| sigma.map(|s| (s * d).to_string()).join(" ");
        DENSITY.map(of).join(" ")
    };
    let size = "\"integer nx\" 2 \"integer ny\" 3 \"integer nz\" 4 \"float g\" .3";
    let numbers = format!(
        "{head}MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" {size} \"float density\" \
         [{}] \"rgb sigma_a\" [.5 1 2] \"rgb sigma_s\" [3 2 1]\n{around}",
        grid_values()
    );
    let of_colours = format!(
        "{head}MakeNamedMedium \"smoke\" \"string type\" \"rgbgrid\" {size} \"rgb sigma_a\" [{}] \
         \"rgb sigma_s\" [{}]\n{around}",
        colours([0.5, 1.0, 2.0]),
        colours([3.0, 2.0, 1.0])
    );
    let [one, other] = [numbers, of_colours].map(|text| {
        let scene = scene(&text);
        Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), SEEDS)
    });
    for c in 0..3 {
        let what = format!("colours, channel {c}");
        assert!(one.whole(c).mean > 0.0);
        one.whole(c).expect_same(&other.whole(c), &what);
    }
}

/// A grid of colours of which one is not given is 1 there, to the very sides, as in pbrt-v4: depths
/// of rays through it, and the same picture by all integrators.
#[test]
fn what_a_grid_of_colours_lacks_is_one() {
    let colours = DENSITY.map(|d| format!("{d} {d} {d}")).join(" ");
    for given in ["sigma_a", "sigma_s"] {
        let text = format!(
            "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"orthographic\"\n\
             Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
             PixelFilter \"box\"\nIntegrator \"volpath\" \"integer maxdepth\" 3\nWorldBegin\n\
             AttributeBegin\nTranslate -1 -1 -1 Scale 2 2 2\n\
             MakeNamedMedium \"smoke\" \"string type\" \"rgbgrid\" \"integer nx\" 2 \
             \"integer ny\" 3 \"integer nz\" 4 \"rgb {given}\" [{colours}] \"float scale\" .5\n\
             AttributeEnd\nAttributeBegin\n\
             AreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\nTranslate 1.5 2 -2\n\
             Shape \"sphere\" \"float radius\" .5\nAttributeEnd\n\
             Material \"interface\" MediumInterface \"smoke\" \"\"\n\
             Shape \"sphere\" \"float radius\" 2\n"
        );
        let scene = scene(&text);
        let space = &scene.space;
        for (x, y) in [(0.1, 0.2), (0.5, 0.9), (0.99, 0.01), (1.1, 0.5)] {
            let at = |z: f64| {
                let p = [2.0 * x - 1.0, 2.0 * y - 1.0, z];
                [0, 1, 2].map(|k| ((p[k] - space.centre[k]) * space.scale) as f32)
            };
            let (from, to) = (at(-3.0), at(3.0));
            let piece = Piece {
                origin: from,
                direction: [0, 1, 2].map(|k| to[k] - from[k]),
                range: [0.0, 1.0],
            };
            let mut passed = Passed::default();
            MediumTable::of(&scene.media, None).pass(0, &piece, &mut passed);
            let found = -f64::from(passed.transmittance()[1]).ln();
            let steps = 4000;
            let inside = x < 1.0;
            let sum: f64 = (0..steps)
                .map(|i| density([x, y, (f64::from(i) + 0.5) / f64::from(steps)]) + 1.0)
                .sum();
            // The cube is 2 wide.
            let truth = if inside { sum / f64::from(steps) } else { 0.0 };
            assert!(
                (found - truth).abs() < 1e-4,
                "{given} {x} {y}: {found} {truth}"
            );
        }
        expect_agreement(&scene, 1, &format!("media-{given}"));
    }
}
