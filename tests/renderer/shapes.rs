//! Shapes that become triangles: surfaces of revolution, curves, height fields, NURBS. As walls of
//! a furnace, by their outline, and as surfaces and lamps that all integrators agree on.

use crate::support;

use phalanx::scene::IntegratorKind;
use std::f64::consts::PI;
use support::{BOTH, Runs, expect_integrators_agree, head, run, scene, settings};

const SEEDS: u64 = 8;

/// Vessels around the origin whose fronts are inside.
fn vessels() -> [(&'static str, String); 5] {
    let lid = |z: f64, radius: f64, up: bool| {
        // The front of a disk is above it.
        let turn = if up { "" } else { "ReverseOrientation\n" };
        format!(
            "AttributeBegin\n{turn}Shape \"disk\" \"float height\" {z} \"float radius\" {radius}\nAttributeEnd\n"
        )
    };
    let wall =
        |shape: &str| format!("AttributeBegin\nReverseOrientation\nShape {shape}\nAttributeEnd\n");
    [
        (
            "cylinder",
            wall("\"cylinder\"") + &lid(-1.0, 1.0, true) + &lid(1.0, 1.0, false),
        ),
        (
            "halves of a sphere",
            wall("\"sphere\" \"float zmin\" .2") + &wall("\"sphere\" \"float zmax\" .2"),
        ),
        (
            "cone",
            format!(
                "Translate 0 0 -.5\n{}{}",
                wall("\"cone\" \"float height\" 2 \"float radius\" 1.5"),
                lid(0.0, 1.5, true)
            ),
        ),
        (
            "paraboloid",
            format!(
                "Translate 0 0 -.8\n{}{}",
                wall("\"paraboloid\" \"float zmax\" 1.5 \"float radius\" 1.2"),
                lid(1.5, 1.2, false)
            ),
        ),
        (
            "hyperboloid",
            wall("\"hyperboloid\" \"point p1\" [1 .5 -1] \"point p2\" [1 -.5 1]")
                + &lid(-1.0, 1.25f64.sqrt(), true)
                + &lid(1.0, 1.25f64.sqrt(), false),
        ),
    ]
}

/// Walls that emit 1 and reflect 0.6: each depth adds a power of it, everywhere.
#[test]
fn vessels_are_furnaces() {
    let camera =
        "LookAt 0.2 -0.1 0.1  -0.4 0.5 -0.6  0 1 0\nCamera \"perspective\" \"float fov\" [70]";
    let depth = 3;
    let truth: f64 = (0..=depth).map(|k| 0.6f64.powi(k)).sum();
    for (name, vessel) in vessels() {
        let text = head(8, 6, depth as u32, camera)
            + "Material \"matte\" \"rgb Kd\" [.6 .6 .6]\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
            + &vessel
            + "WorldEnd\n";
        let scene = scene(&text);
        for kind in BOTH {
            let runs = Runs::new(&scene, &settings(&scene, kind, 16), SEEDS);
            runs.whole(0).expect(truth, &format!("{name} {kind:?}"));
            for region in runs.grid(2, 2) {
                region.expect(truth, &format!("{name} {kind:?}"));
            }
        }
    }
}

/// Seen from the side, from afar, a lamp of radiance 1 shows the area of its outline.
#[test]
fn outlines_are_those_of_the_surfaces() {
    // 4 by 4, the z axis upwards.
    let camera =
        "LookAt 0 -9 0  0 0 0  0 0 1\nCamera \"orthographic\" \"float screenwindow\" [-2 2 -2 2]";
    // What passes from (1, 1) to (1, -1) over a height of 2.
    let n = 10_000;
    let of_waist: f64 = (0..n)
        .map(|i| 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0)
        .map(|z| 2.0 * (1.0 + z * z).sqrt() * 2.0 / f64::from(n))
        .sum();
    // Thin tubes have few sides: turned by all angles, their widths are right in the mean.
    let tubes: String = (0..12)
        .map(|i| {
            let (x, turn) = (0.2 * f64::from(i) - 1.1, 5 * i);
            format!(
                "AttributeBegin\nTranslate {x} 0 0\nRotate {turn} 0 0 1\n\
                 Shape \"curve\" \"string type\" \"cylinder\" \"float width\" .015 \
                 \"point P\" [0 0 -1  0 0 -.3  0 0 .3  0 0 1]\nAttributeEnd\n"
            )
        })
        .collect();
    let shape = |text: &str| format!("Shape {text}\n");
    for (shapes, area) in [
        (
            shape("\"cylinder\" \"float radius\" .7 \"float zmax\" 1.5"),
            1.4 * 2.5,
        ),
        (
            shape("\"sphere\" \"float radius\" 1.5 \"float zmin\" 0"),
            PI * 1.125,
        ),
        (
            shape("\"cone\" \"float height\" 1.8 \"float radius\" 1.2"),
            1.8 * 1.2,
        ),
        (
            shape("\"paraboloid\" \"float zmax\" 1.5 \"float radius\" .9"),
            4.0 / 3.0 * 1.5 * 0.9,
        ),
        (
            shape("\"hyperboloid\" \"point p1\" [1 1 -1] \"point p2\" [1 -1 1]"),
            of_waist,
        ),
        (
            shape(
                "\"curve\" \"string type\" \"ribbon\" \"normal N\" [0 -1 0 0 -1 0] \"float width\" .5 \
                 \"point P\" [0 0 -1  0 0 -.3  0 0 .3  0 0 1]",
            ),
            1.0,
        ),
        (tubes, 12.0 * 2.0 * 0.015),
    ] {
        let text = head(16, 16, 0, camera)
            + "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" \"true\"\n"
            + &shapes
            + "WorldEnd\n";
        let scene = scene(&text);
        let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 128), SEEDS);
        runs.whole(0).expect(area / 16.0, &shapes);
    }
}

/// One of each kind, side by side above a floor.
fn collection() -> String {
    let grid = "\"nurbs\" \"integer nu\" 4 \"integer uorder\" 4 \"float uknots\" [0 0 0 0 1 1 1 1] \
                \"integer nv\" 2 \"integer vorder\" 2 \"float vknots\" [0 0 1 1] \
                \"point P\" [0 0 0 .3 0 .8 .7 0 -.4 1 0 .4  0 1 0 .3 1 .8 .7 1 -.4 1 1 .4]";
    let shapes = [
        "\"cylinder\" \"float radius\" .3 \"float zmin\" .1 \"float zmax\" .9 \"float phimax\" 300",
        "\"cone\" \"float radius\" .4 \"float height\" .9",
        "\"paraboloid\" \"float radius\" .4 \"float zmin\" .1 \"float zmax\" .8",
        "\"hyperboloid\" \"point p1\" [.4 0 .1] \"point p2\" [.1 .3 .9]",
        "\"sphere\" \"float radius\" .4 \"float zmax\" .2 \"float phimax\" 250",
        "\"disk\" \"float radius\" .4 \"float innerradius\" .2 \"float height\" .5 \"float phimax\" 270",
        "\"curve\" \"float width0\" .2 \"float width1\" .05 \"point P\" [-.3 0 .2 0 .5 .3 0 -.5 .6 .3 0 .8]",
        "\"curve\" \"string type\" \"ribbon\" \"normal N\" [0 -1 0 .6 -.8 0] \"float width\" .2 \
         \"point P\" [-.3 0 .2 0 .3 .3 0 -.3 .6 .3 0 .8]",
        "\"heightfield\" \"integer nu\" 3 \"integer nv\" 2 \"float Pz\" [.1 .4 .1 .1 .8 .3]",
        grid,
    ];
    let place = |(i, shape): (usize, &&str)| {
        let (x, y) = (i as f64 % 5.0 - 2.2, (i / 5) as f64 * 1.4 - 0.7);
        format!("AttributeBegin\nTranslate {x} {y} .5\nShape {shape}\nAttributeEnd\n")
    };
    shapes.iter().enumerate().map(place).collect()
}

const ABOVE: &str = "LookAt 0 -6 4  0 0 .6  0 0 1\nCamera \"perspective\" \"float fov\" [36]";
const FLOOR: &str = "Material \"matte\" \"rgb Kd\" [.6 .5 .4]\n\
    Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]\n";

#[test]
fn integrators_agree_on_surfaces_of_all_shapes() {
    let text = head(24, 14, 3, ABOVE)
        + FLOOR
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [30 30 30]\nTranslate 2 -3 4\n\
           Shape \"sphere\" \"float radius\" .5\nAttributeEnd\n"
        + &collection()
        + "WorldEnd\n";
    expect_integrators_agree(&scene(&text), 64, 12, [3, 2], "surfaces of all shapes");
}

#[test]
fn integrators_agree_on_lamps_of_all_shapes() {
    let text = head(24, 14, 2, ABOVE)
        + FLOOR
        + "AreaLightSource \"diffuse\" \"rgb L\" [2 2 3]\n"
        + &collection()
        + "WorldEnd\n";
    expect_integrators_agree(&scene(&text), 64, 8, [3, 2], "lamps of all shapes");
}

/// v3: a sheet that is seen and casts no shadow, under a sun, over a floor.
#[test]
fn shadows_apart_from_what_is_seen() {
    let sheet = |alpha: &str| {
        format!(
            "Material \"matte\" \"rgb Kd\" [0 0 0]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"float uv\" [0 0 1 0 1 1 0 1] {alpha} \
             \"point P\" [-9 -9 1  9 -9 1  9 9 1  -9 9 1]\n"
        )
    };
    let of = |from: f64, alpha: &str| {
        let camera =
            format!("LookAt 0 0 {from}  0 .1 0  0 0 1\nCamera \"perspective\" \"float fov\" [20]");
        let text = head(8, 8, 1, &camera)
            + "Texture \"half\" \"float\" \"checkerboard\" \"float uscale\" 90 \"float vscale\" 90 \
               \"float tex1\" 0 \"float tex2\" 1\n\
               LightSource \"distant\" \"rgb L\" [2 2 2] \"point from\" [0 0 1] \"point to\" [0 0 0]\n"
            + &sheet(alpha)
            + FLOOR
            + "WorldEnd\n";
        let scene = scene(&text);
        let picture = run(&scene, &settings(&scene, IntegratorKind::Pt, 256));
        picture.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 64.0
    };
    let lit = 2.0 * 0.6 / PI;
    let near = |a: f64, b: f64| assert!((a - b).abs() <= 1e-5 * b, "{a} {b}");
    // From below the sheet, and from above it.
    near(of(0.9, "\"float shadowalpha\" 0"), lit);
    near(of(5.0, "\"float shadowalpha\" 0"), 0.0);
    near(of(0.9, ""), 0.0);
    near(of(0.9, "\"float shadowalpha\" 1"), 0.0);
    // What is not there casts no shadow either.
    near(of(0.9, "\"float alpha\" 0 \"float shadowalpha\" 1"), lit);
    let half = of(0.9, "\"texture shadowalpha\" \"half\"") / lit;
    assert!((half - 0.5).abs() < 0.1, "{half}");
    near(of(5.0, "\"texture shadowalpha\" \"half\""), 0.0);
}
