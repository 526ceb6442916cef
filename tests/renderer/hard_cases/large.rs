//! Rows 34, 36 and 40: very large surfaces, lamps that lie in other surfaces, primitives that lie
//! in one place.
//!
//! `trace` has the tests of single rays (row 34), `scene` the warnings.

use super::COMPARISONS;
use crate::support::{Estimate, Runs, head, run, scene, settings};
use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::trace::Tracer;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Two triangles over `[x - s, x + s] x [y - s, y + s]` at `z = 0`.
fn ground(s: f64, [x, y]: [f64; 2]) -> String {
    let (x0, x1, y0, y1) = (x - s, x + s, y - s, y + s);
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{x0} {y0} 0 {x1} {y0} 0 {x1} {y1} 0 {x0} {y1} 0]\n"
    )
}

/// Grounds whose surface is the plane `z = 0` where the small things are, of sizes from usual to
/// ten million.
fn grounds() -> Vec<(String, String)> {
    let mut grounds = Vec::new();
    for s in [1e2, 1e3, 1e4, 1e5, 1e6, 1e7] {
        grounds.push((format!("square of {s:e}"), ground(s, [0.0; 2])));
    }
    grounds.push(("off centre".into(), ground(1e6, [7e5, -6e5])));
    grounds.push((
        "disk".into(),
        "Shape \"disk\" \"float radius\" 1e6\n".into(),
    ));
    grounds.push((
        "disk off centre".into(),
        "AttributeBegin\nTranslate 3e5 5e5 0\nShape \"disk\" \"float radius\" 1e6\nAttributeEnd\n"
            .into(),
    ));
    grounds.push((
        "sphere".into(),
        "AttributeBegin\nTranslate 0 0 -1e6\nShape \"sphere\" \"float radius\" 1e6\nAttributeEnd\n"
            .into(),
    ));
    grounds
}

/// Places and turns a world; the camera goes with it.
const POSES: [[&str; 2]; 3] = [
    ["", ""],
    ["Rotate 40 1 2 3\n", "Rotate -40 1 2 3\n"],
    [
        "Translate 30 -50 70\nRotate 100 -3 1 2\n",
        "Rotate -100 -3 1 2\nTranslate -30 50 -70\n",
    ],
];

/// A path-traced picture.
fn pt(scene: &Scene, seed: u64) -> Vec<[f32; 3]> {
    let settings = Settings {
        seed,
        ..settings(scene, IntegratorKind::Pt, 64)
    };
    run(scene, &settings).pixels
}

/// What noise alone may move: a turned world has other tangents, and so other directions. It is
/// measured by another seed, whose noise shares nothing with that of `picture`.
fn bound(scene: &Scene, picture: &[[f32; 3]]) -> f64 {
    1.5 * apart(&pt(scene, 1), picture) + 2e-3
}

/// Part of the light of `b` that is elsewhere in `a`, of the same primary samples.
fn apart(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let values = a.iter().flatten().zip(b.iter().flatten());
    let off: f64 = values.map(|(a, b)| f64::from(a - b).abs()).sum();
    off / b.iter().flatten().map(|v| f64::from(*v)).sum::<f64>()
}

// --- Large surfaces ---

/// Row 34: a ball and a box on the ground, and a wall beside them: every ground and pose gives the
/// same picture.
#[test]
fn shadows_touch_what_casts_them() {
    let world = |ground: &str, [pose, back]: [&str; 2]| {
        let camera = format!(
            "LookAt 3 -2.5 4  0 0 0  0 0 1\n{back}Camera \"perspective\" \"float fov\" [32]"
        );
        scene(
            &(head(32, 32, 2, &camera)
                + pose
                + "LightSource \"distant\" \"rgb L\" [2 2 2] \"point from\" [1 .3 1] \"point to\" [0 0 0]\n\
                   Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
                + ground
                + "AttributeBegin\nTranslate 0 0 .5\nShape \"sphere\" \"float radius\" .5\nAttributeEnd\n\
                   Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-1 .8 0 1 .8 0 1 .8 .3 -1 .8 .3]\n\
                   Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3 4 5 6 4 6 7]\n\
                     \"point P\" [.7 -.7 0 .9 -.7 0 .9 -.7 .2 .7 -.7 .2  .9 -.7 0 .9 -.5 0 .9 -.5 .2 .9 -.7 .2]\n"),
        )
    };
    let plain = world(&ground(20.0, [0.0; 2]), POSES[0]);
    let expected = pt(&plain, 0);
    let bound = bound(&plain, &expected);
    for (name, ground) in grounds() {
        for (i, pose) in POSES.into_iter().enumerate() {
            let scene = world(&ground, pose);
            let off = apart(&pt(&scene, 0), &expected);
            println!("{name}, pose {i}: {off:.2e} of the light is elsewhere");
            assert!(off < bound, "{name}, pose {i}: {off:e}, bound {bound:e}");
        }
    }
    let mmlt = |s: &Scene| Runs::new(s, &settings(s, IntegratorKind::Mmlt, 12), 24).whole(1);
    let far = world(&ground(1e6, [7e5, -6e5]), POSES[2]);
    mmlt(&far).expect_same_among(COMPARISONS, &mmlt(&plain), "ground of 1e6");
}

/// Row 34: no light comes from below a large black ground: a wall sees half the sky down to its
/// foot.
#[test]
fn large_grounds_hold_light_off() {
    let camera = "LookAt 0 -20 .5  0 0 .5  0 0 1\nCamera \"orthographic\" \"float screenwindow\" [-.5 .5 -.5 .5]";
    // Over the edge of the smallest the wall sees more of the sky.
    for (name, ground) in grounds().split_off(1) {
        let scene = scene(
            &(head(4, 16, 1, camera)
                + "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n"
                + &ground
                + "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
                   Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-5 0 0 5 0 0 5 0 10 -5 0 10]\n"),
        );
        let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 128), 24);
        let foot = runs.region([0, 4, 14, 16], 1);
        foot.expect_among(COMPARISONS, 0.25, &format!("{name}, foot"));
        let head = runs.region([0, 4, 0, 14], 1);
        head.expect_among(COMPARISONS, 0.25, &format!("{name}, head"));
    }
}

/// Large grounds of many pieces in one plane, whose seams meet where the camera looks: disks are
/// fans of slivers.
fn pieces() -> Vec<(&'static str, String)> {
    let at = |place: &str, shape: &str| {
        format!("AttributeBegin\n{place}\nShape {shape}\nAttributeEnd\n")
    };
    let quad = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
             \"point P\" [{x0} {y0} 0 {x1} {y0} 0 {x1} {y1} 0 {x0} {y1} 0]\n"
        )
    };
    let (a, x, y, b) = (-1e6, 3.0, -2.9, 1e6);
    let four = [
        [[a, x], [a, y]],
        [[x, b], [a, y]],
        [[x, b], [y, b]],
        [[a, x], [y, b]],
    ];
    let three = [[[a, b], [y, b]], [[a, x], [a, y]], [[x, b], [a, y]]];
    let all = |quads: &[[[f64; 2]; 2]]| quads.iter().map(|&[x, y]| quad(x, y)).collect();
    vec![
        ("disk of 1e5", at("", "\"disk\" \"float radius\" 1e5")),
        ("disk of 1e7", at("", "\"disk\" \"float radius\" 1e7")),
        (
            "disk around the view",
            at("Translate 3 -2.9 0", "\"disk\" \"float radius\" 1e6"),
        ),
        (
            "sector",
            at(
                "Rotate 162 0 0 1",
                "\"disk\" \"float radius\" 1e6 \"float phimax\" 310",
            ),
        ),
        (
            "ring",
            at("", "\"disk\" \"float radius\" 1e6 \"float innerradius\" .5"),
        ),
        ("four squares", all(&four)),
        ("a side of one on the corner of two", all(&three)),
    ]
}

const BOTH: [IntegratorKind; 2] = [IntegratorKind::Pt, IntegratorKind::Mmlt];

/// Row 34: with nothing but a large ground, what is next to the camera is seen.
#[test]
fn large_grounds_are_seen_from_close_by() {
    for (name, ground) in grounds() {
        if !name.starts_with("disk") {
            see_from_close_by(&name, &ground, &BOTH);
        }
    }
}

/// The same of disks, which are fans of slivers: rays that leave one do not meet the next.
#[test]
fn large_disks_are_seen_from_close_by() {
    for (name, ground) in grounds() {
        if name.starts_with("disk") {
            see_from_close_by(&name, &ground, &BOTH);
        }
    }
}

/// The same of other grounds in pieces.
#[test]
fn large_grounds_in_pieces_are_seen_from_close_by() {
    for (name, ground) in pieces() {
        see_from_close_by(name, &ground, &[IntegratorKind::Pt]);
    }
}

fn see_from_close_by(name: &str, ground: &str, kinds: &[IntegratorKind]) {
    for (i, [pose, back]) in POSES.into_iter().enumerate() {
        let camera = format!(
            "LookAt 3.7 -3.5 1.7  3 -2.9 .9  0 0 1\n{back}Camera \"perspective\" \"float fov\" [38]"
        );
        let scene = scene(
            &(head(8, 8, 1, &camera)
                + pose
                + "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
                + ground),
        );
        for &kind in kinds {
            let runs = Runs::new(&scene, &settings(&scene, kind, 8), 24);
            let what = format!("{name}, pose {i}, {kind:?}");
            runs.whole(1).expect_among(COMPARISONS, 0.5, &what);
        }
    }
}

/// Row 34: a room whose walls and ceiling go on for a million, lit by a small lamp, against the
/// same room cut off where it does not matter.
#[test]
fn large_walls_and_ceilings_meet_small_lamps() {
    let quad = |p: [[f64; 3]; 4]| {
        let p = p.map(|p| format!("{} {} {}", p[0], p[1], p[2])).join(" ");
        format!("Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{p}]\n")
    };
    let world = |s: f64, [pose, back]: [&str; 2]| {
        let camera = format!(
            "LookAt 2 -2 1.5  0 0 .5  0 0 1\n{back}Camera \"perspective\" \"float fov\" [60]"
        );
        // Grey near by and black beyond: light from far away must not count.
        scene(
            &(head(24, 24, 3, &camera)
                + pose
                + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n"
                + &quad([
                    [-0.2, -0.6, 1.99],
                    [-0.2, -0.2, 1.99],
                    [0.2, -0.2, 1.99],
                    [0.2, -0.6, 1.99],
                ])
                + "AttributeEnd\nMaterial \"matte\" \"rgb Kd\" [0.6 0.6 0.6]\n"
                + &quad([
                    [-1.0, -1.0, 0.3],
                    [1.0, -1.0, 0.3],
                    [1.0, 1.0, 0.3],
                    [-1.0, 1.0, 0.3],
                ])
                + "Material \"matte\" \"rgb Kd\" [0 0 0]\n"
                + &quad([[-s, -s, 2.0], [s, -s, 2.0], [s, s, 2.0], [-s, s, 2.0]])
                + &quad([[-s, 1.0, -s], [s, 1.0, -s], [s, 1.0, s], [-s, 1.0, s]])
                + &quad([[-1.0, -s, -s], [-1.0, s, -s], [-1.0, s, s], [-1.0, -s, s]])),
        )
    };
    let plain = world(10.0, POSES[0]);
    let expected = pt(&plain, 0);
    let bound = bound(&plain, &expected);
    for pose in POSES {
        let off = apart(&pt(&world(1e6, pose), 0), &expected);
        println!("{off:.2e} of the light is elsewhere");
        assert!(off < bound, "{off:e}, bound {bound:e}");
    }
}

// --- Lamps in other surfaces ---

const ALL: [IntegratorKind; 4] = [
    IntegratorKind::Pt,
    IntegratorKind::Lt,
    IntegratorKind::Bdpt,
    IntegratorKind::Mmlt,
];

/// Means of a scene by all integrators.
fn means(scene: &Scene) -> [Estimate; 4] {
    ALL.map(|kind| Runs::new(scene, &settings(scene, kind, 16), 24).whole(1))
}

/// A room of three walls and a ceiling at `y = 1`; `lamps` are before the walls or after them.
fn room(lamps: &str, first: bool, [pose, back]: [&str; 2]) -> Scene {
    let camera =
        format!("LookAt 0 0 3.2  0 0 0  0 1 0\n{back}Camera \"perspective\" \"float fov\" [45]");
    let walls = "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-1 -1 -1 -1 -1 1 1 -1 1 1 -1 -1]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-1 1 -1 1 1 -1 1 1 1 -1 1 1]\n";
    let parts = if first {
        [lamps, walls]
    } else {
        [walls, lamps]
    };
    scene(&(head(8, 8, 4, &camera) + pose + &parts.concat()))
}

/// A lamp of radiance `l` that shines down from a height, or up.
fn lamp(l: f64, shape: &str) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n{shape}AttributeEnd\n"
    )
}

fn square(y: f64, down: bool) -> String {
    let order = if down { "0 1 2 0 2 3" } else { "0 2 1 0 3 2" };
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [{order}] \"point P\" [-.3 {y} -.3 .3 {y} -.3 .3 {y} .3 -.3 {y} .3]\n"
    )
}

/// Row 36: a lamp in a ceiling shines as one just below it, whatever comes first in the file,
/// however it is turned, by every integrator.
#[test]
fn lamps_in_ceilings_shine() {
    let disk = |y: f64| {
        format!(
            "AttributeBegin\nTranslate 0 {y} 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" .3\nAttributeEnd\n"
        )
    };
    let shapes: [(&str, &dyn Fn(f64) -> String); 2] =
        [("square", &|y| square(y, true)), ("disk", &disk)];
    for (name, shape) in shapes {
        let below = room(&lamp(5.0, &shape(0.9995)), true, POSES[0]);
        assert_eq!(below.warnings, Vec::<String>::new());
        let expected = Runs::new(&below, &settings(&below, IntegratorKind::Pt, 96), 24).whole(1);
        for (i, pose) in POSES.into_iter().enumerate() {
            for first in [true, false] {
                let flush = room(&lamp(5.0, &shape(1.0)), first, pose);
                assert_eq!(flush.warnings.len(), 1, "{:?}", flush.warnings);
                assert!(flush.warnings[0].contains("lies in the surface"));
                for (kind, mean) in ALL.iter().zip(means(&flush)) {
                    let what = format!("{name}, pose {i}, lamp first {first}, {kind:?}");
                    mean.expect_same_among(COMPARISONS, &expected, &what);
                }
            }
        }
    }
}

/// Row 36: of two lamps in one place the brighter counts; two that shine to opposite sides both do;
/// and one that shines away from the room leaves it dark.
#[test]
fn lamps_in_one_place_have_one_winner() {
    let below = room(&lamp(5.0, &square(0.9995, true)), true, POSES[0]);
    let expected = Runs::new(&below, &settings(&below, IntegratorKind::Pt, 96), 24).whole(1);
    let (dim, bright) = (lamp(2.0, &square(1.0, true)), lamp(5.0, &square(1.0, true)));
    let (up, down) = (lamp(7.0, &square(1.0, false)), bright.clone());
    for (name, lamps) in [
        ("dim first", dim.clone() + &bright),
        ("bright first", bright + &dim),
        ("up first", up.clone() + &down),
        ("down first", down + &up),
        (
            "back to back",
            lamp(
                5.0,
                &square(1.0, true).replace("[0 1 2 0 2 3]", "[0 2 1 0 3 2 0 1 2 0 2 3]"),
            ),
        ),
    ] {
        let scene = room(&lamps, false, POSES[1]);
        for (kind, mean) in ALL.iter().zip(means(&scene)) {
            let what = format!("{name}, {kind:?}");
            mean.expect_same_among(COMPARISONS, &expected, &what);
        }
    }
    let dark = room(&up, true, POSES[0]);
    for kind in ALL {
        let mean = Runs::new(&dark, &settings(&dark, kind, 64), 4).whole(1);
        // Past the edge of the ceiling nothing comes back.
        assert_eq!(mean.mean, 0.0, "{kind:?}");
    }
}

/// Row 36: panels that fill holes of a ceiling, or stand on a floor's edge, lie in nothing.
#[test]
fn lamps_beside_surfaces_stay_where_they_are() {
    let hole = "Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 5 0 5 4 1 2 6 1 6 5 2 3 7 2 7 6 3 0 4 3 4 7]\n\
        \"point P\" [-1 1 -1 1 1 -1 1 1 1 -1 1 1 -.3 1 -.3 .3 1 -.3 .3 1 .3 -.3 1 .3]\n";
    let text = head(4, 4, 2, "Camera \"perspective\"") + hole + &lamp(5.0, &square(1.0, true));
    assert_eq!(scene(&text).warnings, Vec::<String>::new());
}

// --- Primitives in one place ---

/// Row 40: trees over equal triangles, nested ones and ones in a growing row take seconds, and rays
/// through them too.
#[test]
fn crowds_are_built_and_traced() {
    let n = 200_000;
    let crowd = |triangle: &dyn Fn(f64) -> String| {
        let (mut points, mut indices) = (String::new(), String::new());
        for i in 0..n {
            write!(points, "{} ", triangle(f64::from(i) / f64::from(n))).unwrap();
            write!(indices, "{} {} {} ", 3 * i, 3 * i + 1, 3 * i + 2).unwrap();
        }
        let view = "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [20]";
        scene(
            &(head(4, 4, 2, view)
                + "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n"
                + &format!(
                    "Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point P\" [{points}]\n"
                )),
        )
    };
    let equal = crowd(&|_| "-1 -1 0 1 -1 0 0 1 0".into());
    let nested = crowd(&|x| {
        let s = 1e-3 + x;
        format!("{} {} 0 {s} {} 0 0 {s} 0", -s, -s, -s)
    });
    let row = crowd(&|x| format!("-1 -1 {x} {} -1 {x} -1 {} {x}", x - 0.5, x - 0.5));
    for (name, scene) in [("equal", &equal), ("nested", &nested), ("row", &row)] {
        let start = Instant::now();
        let tracer = Tracer::build(scene);
        let time = start.elapsed();
        println!("{name}: {time:?}, {:?}", tracer.stats());
        assert!(time < Duration::from_secs(30), "{name}: {time:?}");
    }
    let alone = {
        let view = "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [20]";
        scene(
            &(head(4, 4, 2, view)
                + "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
                   Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1 -1 0 1 -1 0 0 1 0]\n"),
        )
    };
    let [a, b] = [&equal, &alone].map(|s| run(s, &settings(s, IntegratorKind::Pt, 16)));
    assert!(a.pixels == b.pixels);
}
