//! Scenes whose pictures are known in closed form, rendered by PT and MMLT. Truths are compared by
//! [`Estimate::expect`](support::Estimate), which says what counts as chance.

mod furnaces;

use crate::support;
use crate::support::dialect;

use dialect::to_v4;
use phalanx::scene::IntegratorKind;
use std::f64::consts::{FRAC_1_PI, PI};
use support::{BOTH, Runs, head, inward_box, scene, settings};

const SEEDS: u64 = 16;

/// Renders with both integrators and calls `check` with the runs and their name.
fn both(text: &str, effort: u64, name: &str, check: impl Fn(&Runs, &str)) {
    let scene = scene(text);
    for kind in BOTH {
        let runs = Runs::new(&scene, &settings(&scene, kind, effort), SEEDS);
        let name = format!("{name} {kind:?}");
        runs.show(&name.replace(' ', "-"));
        check(&runs, &name);
    }
}

/// Every channel of the whole picture and of a grid of 3 by 3 regions has this value.
#[track_caller]
fn expect_uniform(runs: &Runs, truth: [f64; 3], name: &str) {
    for (c, truth) in truth.into_iter().enumerate() {
        runs.whole(c).expect(truth, &format!("{name} channel {c}"));
    }
    for (i, region) in runs.grid(3, 3).into_iter().enumerate() {
        region.expect(
            truth[i % 3],
            &format!("{name} region {} channel {}", i / 3, i % 3),
        );
    }
}

/// Albedos of three channels, and the radiance of the furnace walls.
const RHO: [f64; 3] = [0.8, 0.5, 0.2];
const L: [f64; 3] = [1.0, 2.0, 4.0];

fn rgb([r, g, b]: [f64; 3]) -> String {
    format!("[{r} {g} {b}]")
}

/// `sum of rho^k` for `k` from `first` to `last`.
fn series(rho: f64, first: u32, last: u32) -> f64 {
    (first..=last).map(|k| rho.powi(k as i32)).sum()
}

/// A camera inside everything, looking askew.
const INSIDE: &str =
    "LookAt 0.2 -0.1 0.3  -0.4 0.5 -0.6  0 1 0\nCamera \"perspective\" \"float fov\" [70]";

/// A closed vessel whose walls emit `L` and reflect `rho` diffusely: radiance of depth `k` is `L
/// rho^k` everywhere.
#[test]
fn closed_furnace() {
    let sphere = "ReverseOrientation\nShape \"sphere\" \"float radius\" [1]\n".to_string();
    let shapes = [
        ("sphere", sphere),
        ("box", inward_box([-1.0, 0.7, -0.8, 1.0, -1.0, 1.2])),
    ];
    for (what, shape) in &shapes {
        for depth in [0, 1, 2, 3, 6] {
            let text = head(12, 9, depth, INSIDE)
                + &format!(
                    "Material \"matte\" \"rgb Kd\" {}\nAreaLightSource \"diffuse\" \"rgb L\" {}\n",
                    rgb(RHO),
                    rgb(L)
                )
                + shape;
            both(
                &text,
                64,
                &format!("furnace {what} depth {depth}"),
                |runs, name| {
                    let truth = std::array::from_fn(|c| L[c] * series(RHO[c], 0, depth));
                    expect_uniform(runs, truth, name);
                },
            );
        }
    }
}

/// A point light in the centre of a diffuse sphere: irradiance `E = I / R^2`, and every
/// interreflection multiplies by `rho`.
#[test]
fn point_light_in_a_sphere() {
    for depth in [1, 2, 5] {
        let text = head(12, 9, depth, INSIDE)
            + &format!(
                "LightSource \"point\" \"rgb I\" [9 9 9]\nMaterial \"matte\" \"rgb Kd\" {}\n\
                 ReverseOrientation\nShape \"sphere\" \"float radius\" [1.5]\n",
                rgb(RHO)
            );
        both(
            &text,
            64,
            &format!("point in sphere depth {depth}"),
            |runs, name| {
                let e = 9.0 / 2.25;
                let truth = RHO.map(|rho| e * FRAC_1_PI * series(rho, 1, depth));
                expect_uniform(runs, truth, name);
            },
        );
    }
}

/// A small black sphere that emits `L` in the centre of a diffuse one: `E = pi L (r / R)^2`, and it
/// takes `(r / R)^2` out of each interreflection.
#[test]
fn sphere_light_in_a_sphere() {
    // Looks past the light.
    let camera = "LookAt 0.6 0 0  1.4 0.1 0.2  0 1 0\nCamera \"perspective\" \"float fov\" [60]";
    let share = 0.1f64.powi(2);
    for depth in [1, 2, 5] {
        let text = head(12, 9, depth, camera)
            + &format!(
                "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [100 100 100]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
                 Shape \"sphere\" \"float radius\" [0.15]\nAttributeEnd\n\
                 Material \"matte\" \"rgb Kd\" {}\nReverseOrientation\nShape \"sphere\" \"float radius\" [1.5]\n",
                rgb(RHO)
            );
        both(
            &text,
            96,
            &format!("light in sphere depth {depth}"),
            |runs, name| {
                let e = PI * 100.0 * share;
                let truth = RHO.map(|rho| {
                    let again: f64 = (0..depth)
                        .map(|k| (rho * (1.0 - share)).powi(k as i32))
                        .sum();
                    e * FRAC_1_PI * rho * again
                });
                expect_uniform(runs, truth, name);
            },
        );
    }
}

/// A large diffuse floor.
fn floor(y: f64) -> String {
    format!(
        "Material \"matte\" \"rgb Kd\" {}\nShape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
         \"point P\" [-9 {y} -9 -9 {y} 9 9 {y} 9 9 {y} -9]\n",
        rgb(RHO)
    )
}

/// A distant light of irradiance `E` on a diffuse plane: radiance `E cos rho / pi`, through every
/// kind of camera.
#[test]
fn distant_light_on_a_plane() {
    let at = "LookAt 1 3 2  0 0 0  0 1 0\n";
    let cameras = [
        ("pinhole", "\"perspective\" \"float fov\" [50]"),
        (
            "lens",
            "\"perspective\" \"float fov\" [50] \"float lensradius\" [.3] \"float focaldistance\" [2]",
        ),
        (
            "orthographic",
            "\"orthographic\" \"float screenwindow\" [-2 2 -1.5 1.5]",
        ),
    ];
    for (what, camera) in cameras {
        let text = head(12, 9, 2, &format!("{at}Camera {camera}"))
            + "LightSource \"distant\" \"rgb L\" [3 3 3] \"point from\" [1 2 2] \"point to\" [0 0 0]\n"
            + &floor(0.0);
        both(
            &text,
            64,
            &format!("distant light, {what}"),
            |runs, name| {
                expect_uniform(
                    runs,
                    RHO.map(|rho| 3.0 * (2.0 / 3.0) * rho * FRAC_1_PI),
                    name,
                );
            },
        );
    }
}

/// Under a sky of constant radiance `L` a convex diffuse object is `rho L`: every point sees one
/// hemisphere of it.
#[test]
fn constant_sky_on_a_convex_object() {
    let camera = "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [10]";
    let shapes = [
        (
            "sphere",
            "Shape \"sphere\" \"float radius\" [1]\n".to_string(),
        ),
        (
            "box",
            format!(
                "Rotate 30 1 2 0\nReverseOrientation\n{}",
                inward_box([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
            ),
        ),
        // Half of the directions are below the ellipsoid's tangent planes, however flat it is.
        (
            "ellipsoid",
            "Scale 1 0.9 0.2\nShape \"sphere\" \"float radius\" [1]\n".to_string(),
        ),
    ];
    for (what, shape) in &shapes {
        let text = head(12, 9, 3, camera)
            + &format!(
                "LightSource \"infinite\" \"rgb L\" {}\nMaterial \"matte\" \"rgb Kd\" {}\n{shape}",
                rgb(L),
                rgb(RHO)
            );
        both(&text, 64, &format!("sky on a {what}"), |runs, name| {
            expect_uniform(runs, std::array::from_fn(|c| L[c] * RHO[c]), name);
        });
    }
}

/// From inside glass the sky is brighter by the square of the index, less what the boundary keeps.
#[test]
fn sky_seen_from_inside_glass() {
    let camera = "LookAt 0 0 0  0.3 0.2 1  0 1 0\nCamera \"perspective\" \"float fov\" [60]";
    for depth in [1, 4] {
        let text = head(10, 10, depth, camera)
            + "LightSource \"infinite\" \"rgb L\" [1 2 3]\nMaterial \"glass\" \"float index\" [1.5]\nShape \"sphere\" \"float radius\" [1]\n";
        both(
            &text,
            64,
            &format!("inside glass depth {depth}"),
            |runs, name| {
                // From the centre, every ray meets the boundary at a right angle.
                let r = 0.04;
                let factor = 2.25 * (1.0 - r) * series(r, 0, depth - 1);
                expect_uniform(runs, [1.0, 2.0, 3.0].map(|l| l * factor), name);
            },
        );
    }
}

/// Straight through a slab of glass onto a wall that emits: `(1 - R)^2` gets through directly,
/// `R^2` of that after two more bounces, and so on. The wall is black: nothing comes back.
#[test]
fn glass_slab_before_an_emitter() {
    let camera = "LookAt 0 0 3  0 0 0  0 1 0\nCamera \"orthographic\"";
    for (depth, bounces) in [(1, 0), (2, 1), (3, 1), (4, 2), (6, 3)] {
        let text = head(10, 10, depth, camera)
            + "AttributeBegin\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-4 -4 -2 4 -4 -2 4 4 -2 -4 4 -2]\nAttributeEnd\n\
               Material \"glass\" \"float index\" [1.5]\nReverseOrientation\n"
            + &inward_box([-4.0, 4.0, -4.0, 4.0, -0.5, 0.5]);
        let scene_text = text;
        if bounces == 0 {
            for kind in BOTH {
                let scene = scene(&scene_text);
                let runs = Runs::new(&scene, &settings(&scene, kind, 8), 2);
                assert_eq!(
                    runs.whole(0).mean,
                    0.0,
                    "one event cannot pass two boundaries"
                );
            }
            continue;
        }
        both(
            &scene_text,
            64,
            &format!("slab depth {depth}"),
            |runs, name| {
                let r: f64 = 0.04;
                let factor: f64 = (0..bounces)
                    .map(|j| (1.0 - r).powi(2) * r.powi(2 * j))
                    .sum();
                expect_uniform(runs, [1.0, 2.0, 3.0].map(|l| l * factor), name);
            },
        );
    }
}

/// A pane makes one event of all that its two sides do: `2 R / (1 + R)` is reflected, the rest goes
/// straight on.
#[test]
fn pane_before_an_emitter() {
    let camera = "LookAt 0 0 3  0 0 0  0 1 0\nCamera \"orthographic\"";
    for depth in [1, 2, 4] {
        let text = head(10, 10, depth, camera)
            + "AttributeBegin\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-4 -4 -2 4 -4 -2 4 4 -2 -4 4 -2]\nAttributeEnd\n\
               Material \"thindielectric\" \"float eta\" [1.5]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-4 -4 0 4 -4 0 4 4 0 -4 4 0]\n";
        let name = format!("pane depth {depth}");
        both(&to_v4(&text), 64, &name, |runs, name| {
            expect_uniform(runs, [1.0, 2.0, 3.0].map(|l| l * 12.0 / 13.0), name);
        });
    }
}

/// An emitter seen directly covers its share of the picture, sharp or blurred by a lens (for every
/// point of the lens the plane of the emitter is mapped to the film with the same magnification),
/// from its front only.
#[test]
fn emitter_seen_directly() {
    let cameras = [
        ("pinhole", "\"perspective\" \"float fov\" [60]", 1.0 / 3.0),
        (
            "lens",
            "\"perspective\" \"float fov\" [60] \"float lensradius\" [.1] \"float focaldistance\" [2.5]",
            1.0 / 3.0,
        ),
        (
            "orthographic",
            "\"orthographic\" \"float screenwindow\" [-2 2 -2 2]",
            4.0,
        ),
    ];
    for (what, camera, screen) in cameras {
        // At distance 4, one and a half by a half.
        let seen = if what == "orthographic" {
            0.75
        } else {
            0.75 / 16.0
        };
        let share = seen / (4.0 * screen);
        let text = |reverse: &str| {
            head(
                16,
                16,
                0,
                &format!("LookAt 0 0 4  0 0 0  0 1 0\nCamera {camera}"),
            ) + &format!(
                "AreaLightSource \"diffuse\" \"rgb L\" [3 2 1]\n{reverse}\n\
                     Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-.5 -.25 0 1 -.25 0 1 .25 0 -.5 .25 0]\n"
            )
        };
        both(
            &text(""),
            256,
            &format!("emitter seen, {what}"),
            |runs, name| {
                for (c, l) in [3.0, 2.0, 1.0].into_iter().enumerate() {
                    runs.whole(c)
                        .expect(l * share, &format!("{name} channel {c}"));
                }
                // pbrt's space is left-handed: looking along -z, the larger part (x > 0) lies to
                // the left.
                let (left, right) = (
                    runs.region([0, 8, 0, 16], 0),
                    runs.region([8, 16, 0, 16], 0),
                );
                left.expect(3.0 * share * 4.0 / 3.0, &format!("{name} left half"));
                right.expect(3.0 * share * 2.0 / 3.0, &format!("{name} right half"));
            },
        );
        for kind in BOTH {
            let scene = scene(&text("ReverseOrientation"));
            let runs = Runs::new(&scene, &settings(&scene, kind, 16), 2);
            assert_eq!(runs.whole(0).mean, 0.0, "{what} {kind:?}: the back emits");
        }
    }
}

/// Depth 0 is all a largest depth of 0 shows, also where more light would be.
#[test]
fn depth_zero_is_emission_alone() {
    let text = head(10, 10, 0, INSIDE) + "LightSource \"point\" \"rgb I\" [9 9 9]\n" + &floor(-1.0);
    for kind in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
        let scene = scene(&text);
        let runs = Runs::new(&scene, &settings(&scene, kind, 8), 2);
        assert_eq!(runs.whole(0).mean, 0.0);
    }
}
