//! Cut-outs: what is not there lets light through, the same for every strategy.

use crate::support;
use crate::support::dialect;

use dialect::to_v4;
use phalanx::chain::evaluator::Evaluator;
use phalanx::scene::{IntegratorKind, NONE, Scene};
use phalanx::trace::{Hit, Ray};
use phalanx::transport::World;
use phalanx::transport::alpha_mask::Through;
use support::{BOTH, Runs, expect_integrators_agree, head, inward_box, run, scene, settings};

const SEEDS: u64 = 16;
const AHEAD: &str = "LookAt 0 0 0  0 0 -1  0 1 0\nCamera \"perspective\" \"float fov\" [40]";

/// A square `[-size, size]^2` at `z`, its front towards the camera.
fn sheet(size: f64, z: f64, alpha: &str) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"float uv\" [0 0 1 0 1 1 0 1] {alpha} \
         \"point P\" [-{size} -{size} {z}  {size} -{size} {z}  {size} {size} {z}  -{size} {size} {z}]\n"
    )
}

fn v4(depth: u32, camera: &str, world: &str) -> Scene {
    scene(&to_v4(&(head(12, 12, depth, camera) + world)))
}

/// Every channel of the whole picture and of a grid of regions has this value.
#[track_caller]
fn expect_uniform(scene: &Scene, effort: u64, truth: f64, name: &str) {
    for kind in BOTH {
        let runs = Runs::new(scene, &settings(scene, kind, effort), SEEDS);
        runs.show(&format!("{name}-{kind:?}"));
        runs.whole(1).expect(truth, &format!("{name} {kind:?}"));
        for (i, region) in runs.grid(2, 2).into_iter().enumerate() {
            region.expect(truth, &format!("{name} {kind:?} region {i}"));
        }
    }
}

const BLACK: &str = "Material \"matte\" \"rgb Kd\" [0 0 0]\n";
const LIT: &str = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n";

#[test]
fn a_half_there_sheet_halves_what_is_seen() {
    for (alpha, truth) in [(0.5, 0.5), (0.25, 0.75)] {
        let world = format!(
            "{BLACK}{}AttributeBegin\n{LIT}{}AttributeEnd\n",
            sheet(9.0, -1.0, &format!("\"float alpha\" [{alpha}]")),
            sheet(9.0, -2.0, "")
        );
        let scene = v4(0, AHEAD, &world);
        expect_uniform(&scene, 64, truth, &format!("sheet of alpha {alpha}"));
    }
}

/// Light subpaths and visibility rays: a floor under a sheet, lit from above, seen from below the
/// sheet.
#[test]
fn a_half_there_sheet_halves_what_lights() {
    let sheets = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"float alpha\" [.5] \
                  \"point P\" [-90 1 90  90 1 90  90 1 -90  -90 1 -90]\n";
    let floor = "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
                 \"point P\" [-9 0 9  9 0 9  9 0 -9  -9 0 -9]\n";
    let view = "LookAt 0 .8 0  0 0 -.2  0 1 0\nCamera \"perspective\" \"float fov\" [60]";
    let sun =
        "LightSource \"distant\" \"rgb L\" [2 2 2] \"point from\" [0 1 0] \"point to\" [0 0 0]\n";
    let scene = v4(1, view, &format!("{sun}{BLACK}{sheets}{floor}"));
    let truth = 0.5 * 2.0 * 0.5 / std::f64::consts::PI;
    expect_uniform(&scene, 256, truth, "sun through a sheet");
}

/// A vessel of which the part `a` is there, emits 1 inwards and reflects `rho`, in a sky of 2: `a +
/// 2 (1 - a)` from everywhere, and that times `(a rho)^k` after `k` reflections.
#[test]
fn a_furnace_with_holes() {
    let (a, rho, depth) = (0.6, 0.7, 3);
    let truth: f64 =
        (a + 2.0 * (1.0 - a)) * (0..=depth).map(|k| f64::powi(a * rho, k)).sum::<f64>();
    let alpha = format!("\"float alpha\" [{a}]");
    let sky = "LightSource \"infinite\" \"rgb L\" [2 2 2]\n";
    let wall = format!("{sky}{LIT}Material \"matte\" \"rgb Kd\" [{rho} {rho} {rho}]\n");
    let sphere = format!("ReverseOrientation\nShape \"sphere\" \"float radius\" [1] {alpha}\n");
    let cube = inward_box([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]);
    let cube = cube.replace("\"point P\"", &format!("{alpha} \"point P\""));
    let view =
        "LookAt 0.2 -0.1 0.3  -0.4 0.5 -0.6  0 1 0\nCamera \"perspective\" \"float fov\" [70]";
    for (name, shape) in [("sphere", sphere), ("cube", cube)] {
        let scene = v4(depth as u32, view, &format!("{wall}{shape}"));
        expect_uniform(&scene, 128, truth, &format!("{name} with holes"));
    }
}

/// A lamp of which a checkerboard is left: half of what lights, and dark squares where it is looked
/// at.
#[test]
fn a_lamp_with_holes_lights_by_what_is_left() {
    let check = "Texture \"c\" \"float\" \"checkerboard\" \"float uscale\" [16] \"float vscale\" [16] \"float tex1\" [0] \"float tex2\" [1]\n";
    let lamp = |alpha: &str, l: f64| {
        format!(
            "{check}AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\n{BLACK}\
             Translate 0 0 -6\n{}AttributeEnd\n",
            sheet(1.0, 0.0, alpha)
        )
    };
    let wall = "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\nTranslate 0 0 1\nRotate 180 0 1 0\n"
        .to_string()
        + &sheet(1.0, 0.0, "");
    // From beside the lamp, at the wall behind the camera's back.
    let view = "LookAt 0 0 -4  0 0 1  0 1 0\nCamera \"perspective\" \"float fov\" [16]";
    let cut = v4(1, view, &(lamp("\"texture alpha\" \"c\"", 2.0) + &wall));
    let whole = v4(1, view, &(lamp("", 1.0) + &wall));
    for kind in BOTH {
        let of = |scene: &Scene| Runs::new(scene, &settings(scene, kind, 256), SEEDS);
        let (cut, whole) = (of(&cut), of(&whole));
        cut.show(&format!("lamp-with-holes-{kind:?}"));
        // Squares are a sixteenth of a metre, seven metres away: the moments of the pattern are
        // below what can be measured.
        (cut.whole(0)).expect_same(&whole.whole(0), &format!("lamp with holes {kind:?}"));
    }
}

#[test]
fn alpha_0_is_absent_and_alpha_1_opaque_to_the_bit() {
    let room = |extra: &str| {
        let view = "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]";
        let world = format!(
            "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\nShape \"sphere\"\n{extra}"
        );
        v4(3, view, &world)
    };
    let ball = |alpha: &str| {
        room(&format!(
            "Translate .5 .5 -1\nShape \"sphere\" \"float radius\" [.4] {alpha}\n"
        ))
    };
    let named = |value: f64| {
        room(&format!(
            "Texture \"t\" \"float\" \"constant\" \"float value\" [{value}]\nTranslate .5 .5 -1\n\
             Shape \"sphere\" \"float radius\" [.4] \"texture alpha\" \"t\"\n"
        ))
    };
    for kind in BOTH {
        let pixels = |scene: &Scene| run(scene, &settings(scene, kind, 4)).pixels;
        let (absent, opaque) = (pixels(&room("")), pixels(&ball("")));
        assert_ne!(absent, opaque);
        for value in [0.0, -1.0] {
            assert_eq!(pixels(&ball(&format!("\"float alpha\" [{value}]"))), absent);
            assert_eq!(pixels(&named(value)), absent);
        }
        for value in [1.0, 3.0] {
            assert_eq!(pixels(&ball(&format!("\"float alpha\" [{value}]"))), opaque);
            assert_eq!(pixels(&named(value)), opaque);
        }
    }
}

/// One square of a checkerboard covers each sheet: nothing is there, and every ray has to find that
/// out a hundred times.
#[test]
fn a_hundred_sheets_that_are_not_there() {
    let nothing = "Texture \"c\" \"float\" \"checkerboard\" \"float uscale\" [.1] \"float vscale\" [.1] \"float tex1\" [0] \"float tex2\" [1]\n";
    let sheets: String = (0..100)
        .map(|i| sheet(9.0, -1.0 - 0.01 * f64::from(i), "\"texture alpha\" \"c\""))
        .collect();
    // Two that coincide, a ball to go in and out of, and one sheet edge on.
    let more = sheet(9.0, -1.5, "\"texture alpha\" \"c\"")
        + "Shape \"sphere\" \"float radius\" [.3] \"texture alpha\" \"c\"\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"texture alpha\" \"c\" \"point P\" [0 -9 0  0 9 0  0 0 -9]\n";
    let world = format!(
        "{nothing}{BLACK}{sheets}{more}AttributeBegin\n{LIT}{}AttributeEnd\n",
        sheet(9.0, -3.0, "")
    );
    let scene = v4(0, AHEAD, &world);
    for kind in BOTH {
        let picture = run(&scene, &settings(&scene, kind, 16));
        if kind == IntegratorKind::Pt {
            assert!(picture.pixels.iter().flatten().all(|v| *v == 1.0));
        } else {
            assert!((picture.stats.b - 1.0).abs() < 1e-6);
        }
    }
    // Distances are those from where the ray began.
    let world = World::new(&scene, 0);
    let n = 64;
    let rays: Vec<Ray> = (0..n)
        .map(|i| {
            let (x, y) = ((i % 8) as f32 * 0.1 - 0.35, (i / 8) as f32 * 0.1 - 0.35);
            let length = (x * x + y * y + 1.0).sqrt();
            let [ox, oy, oz] = [[0, 3], [1, 3], [2, 3]].map(|[r, c]| scene.camera.to_world[r][c]);
            Ray::endless([ox, oy, oz], [x / length, y / length, -1.0 / length])
        })
        .collect();
    let list: Vec<u32> = (0..n).collect();
    let mut hits = [
        vec![Hit::default(); n as usize],
        vec![Hit::default(); n as usize],
    ];
    let mut through = Through::default();
    let more = Evaluator::EIGHT.closest(&world, &rays, &list, &mut hits[0], &mut through);
    assert!(more >= 100 * u64::from(n), "{more}");
    Evaluator::ONE.closest(&world, &rays, &list, &mut hits[1], &mut through);
    assert_eq!(hits[0], hits[1]);
    for (ray, hit) in rays.iter().zip(&hits[0]) {
        assert_ne!(hit.primitive, NONE);
        let z = ray.origin[2] + hit.t * ray.direction[2];
        let expected = ((-3.0 - scene.space.centre.z) * scene.space.scale) as f32;
        // Every crossing is known to the error bound of its point.
        let bound = 100.0 * phalanx::trace::offset::gamma(7);
        assert!((z - expected).abs() < bound, "{z} {expected}");
    }
    // And the same for what only asks whether anything is in the way: up to the light, and beyond
    // it.
    let to_light = |far: f32| -> Vec<Ray> {
        rays.iter()
            .zip(&hits[0])
            .map(|(ray, hit)| {
                let t = hit.t * far;
                Ray::new(ray.origin, 1.0, ray.direction.map(|d| d * t))
            })
            .collect()
    };
    for (far, expected) in [(0.9999, 0), (1.0001, 1)] {
        let mut blocked = vec![7; n as usize];
        let mut scratch = vec![Hit::default(); n as usize];
        let rays = to_light(far);
        Evaluator::EIGHT.occluded(
            &world,
            &rays,
            &list,
            &mut blocked,
            &mut scratch,
            &mut through,
        );
        assert!(blocked.iter().all(|b| *b == expected), "{far}: {blocked:?}");
    }
}

/// v3 cuts out where a texture is exactly 0, and a number cuts out all or nothing.
#[test]
fn v3_cuts_out_where_alpha_is_0() {
    let of = |texture: &str, alpha: &str| {
        let world = format!(
            "{texture}{BLACK}{}AttributeBegin\n{LIT}{}AttributeEnd\nWorldEnd\n",
            sheet(9.0, -1.0, alpha),
            sheet(9.0, -2.0, "")
        );
        let scene = scene(&(head(8, 8, 0, AHEAD) + &world));
        let picture = run(&scene, &settings(&scene, IntegratorKind::Pt, 4));
        let sum: f32 = picture.pixels.iter().map(|p| p[0]).sum();
        sum / 64.0
    };
    let checks = |a: f64, b: f64| {
        // The corner of four squares is in the middle of the view.
        format!(
            "Texture \"c\" \"float\" \"checkerboard\" \"float uscale\" [2] \"float vscale\" [2] \"float tex1\" [{a}] \"float tex2\" [{b}]\n"
        )
    };
    let textured = "\"texture alpha\" \"c\"";
    assert_eq!(of("", "\"float alpha\" [0.5]"), 0.0);
    assert_eq!(of("", "\"float alpha\" [0]"), 1.0);
    assert_eq!(of(&checks(0.0, 0.01), textured), 0.5);
    assert_eq!(of(&checks(0.5, 0.01), textured), 0.0);
    // Shadows like the shape's own say nothing new.
    assert_eq!(
        of(
            &checks(0.0, 1.0),
            "\"texture alpha\" \"c\" \"texture shadowalpha\" \"c\""
        ),
        0.5
    );
    assert_eq!(
        of(
            &checks(0.0, 1.0),
            "\"texture alpha\" \"c\" \"float shadowalpha\" [1]"
        ),
        0.5
    );
}

#[test]
fn integrators_agree_on_the_scene_of_leaves() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cutouts.pbrt");
    let mut scene = phalanx::pbrt::load(&path).unwrap_or_else(|e| panic!("{e}"));
    scene.film.width = 24;
    scene.film.height = 18;
    scene.film.crop = [0, 24, 0, 18];
    scene.integrator.max_depth = 3;
    expect_integrators_agree(&scene, 32, 40, [3, 3], "leaves");
}
