//! Surfaces of revolution, curves, height fields and NURBS: parameters and what is wrong with them.

use super::*;

/// Bounds of a scene in the file's space.
fn bounds(scene: &Scene) -> [Vec3; 2] {
    let corners = (0..scene.triangles.len()).flat_map(|i| corners(scene, i));
    corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| {
        [low.min(p), high.max(p)]
    })
}

fn expect_bounds(scene: &Scene, low: [f32; 3], high: [f32; 3]) {
    let [a, b] = bounds(scene);
    let far = (a - Vec3::from(low))
        .abs()
        .max((b - Vec3::from(high)).abs());
    assert!(far.max_element() < 2e-3, "{a} {b}");
}

#[test]
fn parameters_by_default() {
    for (shape, low, high) in [
        ("cylinder", [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]),
        ("cone", [-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]),
        ("paraboloid", [-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]),
        (
            "hyperboloid",
            [-std::f32::consts::SQRT_2, -std::f32::consts::SQRT_2, 0.0],
            [std::f32::consts::SQRT_2, std::f32::consts::SQRT_2, 1.0],
        ),
    ] {
        let s = v3(&format!("Shape \"{shape}\""));
        expect_bounds(&s, low, high);
        assert_eq!(s.warnings, Vec::<String>::new());
        assert_eq!(s.shapes.len(), 1);
    }
    let s = v4("Shape \"cylinder\" \"float zmin\" 3 \"float zmax\" 2 \"float phimax\" 90");
    expect_bounds(&s, [0.0, 0.0, 2.0], [1.0, 1.0, 3.0]);
    // More than a turn is a turn.
    let s = v4("Shape \"disk\" \"float phimax\" 500");
    expect_bounds(&s, [-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]);
}

#[test]
fn parts_of_spheres_are_triangles() {
    let s = v4("Shape \"sphere\" \"float radius\" 2 \"float zmin\" -9 \"float zmax\" 9");
    assert_eq!((s.spheres.len(), s.triangles.len()), (1, 0));
    let s = v4("Shape \"sphere\" \"float radius\" 2 \"float zmax\" 1 \"float phimax\" 180");
    assert_eq!(s.spheres.len(), 0);
    expect_bounds(&s, [-2.0, 0.0, -2.0], [2.0, 2.0, 1.0]);
    // The front is outside, under a mirror too, and turns round.
    for (place, outside) in [
        ("", 1.0),
        ("Scale 1 -1 1", 1.0),
        ("ReverseOrientation", -1.0),
        ("ReverseOrientation Scale 1 -1 1", -1.0),
    ] {
        let s = v4(&format!("{place} Shape \"sphere\" \"float zmax\" .5"));
        for i in 0..s.triangles.len() {
            let middle = corners(&s, i).iter().sum::<Vec3>() / 3.0;
            assert!(front(&s, i).dot(middle) * outside > 0.9, "{place}");
        }
    }
}

#[test]
fn powers_are_those_of_whole_shapes() {
    let of = |text: &str| {
        let light = "AreaLightSource \"diffuse\" \"float power\" 10";
        let s = v4(&format!("{light} Shape {text}"));
        let LightKind::Triangle { l, .. } = s.lights[0].kind else {
            panic!("{:?}", s.lights[0])
        };
        l[1]
    };
    // Two halves of the area each shine twice as brightly.
    let whole = of("\"cylinder\"");
    assert!((of("\"cylinder\" \"float phimax\" 180") / whole - 2.0).abs() < 1e-3);
}

#[test]
fn shapes_without_area_are_left_out() {
    for text in [
        "\"cylinder\" \"float zmin\" 1",
        "\"cone\" \"float height\" -1",
        "\"paraboloid\" \"float radius\" 0",
        "\"hyperboloid\" \"point p1\" [1 1 1]",
        "\"disk\" \"float innerradius\" 2",
        "\"sphere\" \"float zmin\" 2 \"float zmax\" 3",
        "\"curve\" \"float width\" 0 \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0] \"string type\" \"cylinder\"",
    ] {
        let s = v3(&format!("Shape {text}"));
        assert!(s.shapes.is_empty(), "{text}");
        assert!(
            s.warnings.len() == 1 && s.warnings[0].contains("no area"),
            "{text} {:?}",
            s.warnings
        );
    }
}

#[test]
fn curves() {
    let s = v4(
        "Shape \"curve\" \"string type\" \"ribbon\" \"normal N\" [0 0 1 0 0 1] \"float width0\" .2 \
         \"float width1\" .1 \"integer splitdepth\" 5 \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]",
    );
    assert_eq!((s.triangles.len(), s.warnings.len()), (2, 0));
    expect_bounds(&s, [0.0, -0.1, 0.0], [3.0, 0.1, 0.0]);
    near(front(&s, 0), Vec3::Z);
    // Widths run over all pieces.
    let s = v3(
        "Shape \"curve\" \"string basis\" \"bspline\" \"integer degree\" 2 \"string type\" \"cylinder\" \
         \"float width0\" 0 \"float width1\" .4 \"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]",
    );
    assert_eq!(s.warnings, Vec::<String>::new());
    let [low, high] = bounds(&s);
    assert!((low.x - 0.5).abs() < 1e-5 && (high.x - 2.5).abs() < 1e-5);
    assert!((high.y - 0.2).abs() < 0.01, "{high}");
}

#[test]
fn what_is_wrong_with_curves_is_said() {
    let line = "\"point P\" [0 0 0 1 0 0 2 0 0 3 0 0]";
    for (text, expected) in [
        (
            String::new(),
            "has 0 control points, must have 1 and a multiple of 3",
        ),
        (
            format!("{line} \"integer degree\" 4"),
            "degree 4 must be 2 or 3",
        ),
        (
            format!("{line} \"string basis\" \"linear\""),
            "unknown basis \"linear\"",
        ),
        (
            format!("{line} \"string type\" \"ribbon\""),
            "has 0 normals \"N\", must have 2",
        ),
    ] {
        for s in [
            v3(&format!("Shape \"curve\" {text}")),
            v4(&format!(
                "Shape \"curve\" {}",
                text.replace("point P", "point3 P")
            )),
        ] {
            assert!(s.shapes.is_empty());
            assert!(
                s.warnings.len() == 1 && s.warnings[0].contains(expected),
                "{:?}",
                s.warnings
            );
        }
    }
    let s = v3(&format!(
        "Shape \"curve\" {line} \"string type\" \"round\" \"normal N\" [0 0 1 0 0 1]\n\
         Shape \"curve\" {line}\nShape \"curve\" {line}"
    ));
    assert_eq!(s.shapes.len(), 3);
    let starts = [
        "t.pbrt:3:1: Shape \"curve\": normals \"N\" are of ribbons alone",
        "t.pbrt:3:1: Shape \"curve\": unknown type \"round\"",
        "t.pbrt:4:1: Shape \"curve\": flat curves are drawn as round ones",
    ];
    assert_eq!(s.warnings.len(), 3, "{:?}", s.warnings);
    for (warning, start) in s.warnings.iter().zip(starts) {
        assert!(warning.starts_with(start), "{warning}");
    }
}

#[test]
fn grids_of_v3() {
    let s =
        v3("Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 3 \"float Pz\" [0 1 0 1 0 1]");
    assert_eq!((s.triangles.len(), s.warnings.len()), (4, 0));
    expect_bounds(&s, [0.0; 3], [1.0; 3]);
    let patch = "\"integer nu\" 2 \"integer uorder\" 2 \"float uknots\" [0 0 1 1] \"integer nv\" 2 \"integer vorder\" 2 \
                 \"float vknots\" [0 0 1 1]";
    let s = v3(&format!(
        "Shape \"nurbs\" {patch} \"point P\" [0 0 0 2 0 0 0 2 0 2 2 4]"
    ));
    assert_eq!((s.triangles.len(), s.warnings.len()), (2 * 29 * 29, 0));
    expect_bounds(&s, [0.0; 3], [2.0, 2.0, 4.0]);
    let s = v3(&format!(
        "Shape \"nurbs\" {patch} \"float Pw\" [0 0 0 1 2 0 0 1 0 2 0 1 4 4 8 2]"
    ));
    expect_bounds(&s, [0.0; 3], [2.0, 2.0, 4.0]);
    for (text, expected) in [
        ("heightfield\"".to_owned(), "needs an \"integer nu\""),
        (
            "heightfield\" \"integer nu\" 2 \"integer nv\" 2".to_owned(),
            "has 0 heights \"Pz\", must be 2 times 2",
        ),
        (format!("nurbs\" {patch}"), "needs control points"),
        (
            format!("nurbs\" {patch} \"point P\" [0 0 0]"),
            "has 1 control points",
        ),
        (
            format!("nurbs\" {patch} \"float u1\" 2 \"point P\" [0 0 0 2 0 0 0 2 0 2 2 4]"),
            "beyond its knots",
        ),
    ] {
        let s = v3(&format!("Shape \"{text}"));
        assert!(
            s.shapes.is_empty() && s.warnings.len() == 1 && s.warnings[0].contains(expected),
            "{:?}",
            s.warnings
        );
    }
}
