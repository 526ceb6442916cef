//! Blocks, matrices and values that pbrt takes as they are, and what it refuses.

use super::tolerance::*;
use super::*;
use crate::surface::DiffuseMaterial;

#[test]
fn what_pbrt_refuses_is_refused() {
    for world in [
        "Translate 1 2 x",
        "Shape \"sphere\" \"float radius\" [1 \"a\"]",
        "Shape \"sphere\" \"string a\" [\"b\" 1]",
        "Shape \"sphere\" \"float radius\" [1",
        "Fog",
        "Shape sphere",
    ] {
        assert!(load("v3", "", world).is_err(), "{world}");
        assert!(load("v4", "", world).is_err(), "{world}");
    }
    for options in [
        "Film \"tiff\"",
        "Camera \"fisheye\"",
        "Integrator \"magic\"",
        "PixelFilter \"tent\"",
    ] {
        for dialect in ["v3", "v4"] {
            assert!(load(dialect, options, BALL).is_err(), "{dialect} {options}");
        }
    }
    for world in [
        "NamedMaterial \"a\" Shape \"sphere\"",
        "Material \"wood\" Shape \"sphere\"",
        "Shape \"blob\"",
        "LightSource \"sun\"",
        "ObjectEnd",
        "ObjectInstance \"o\"",
        "AttributeBegin ObjectBegin \"a\" AttributeEnd",
        "ObjectBegin \"a\" AttributeBegin ObjectEnd",
        "Include \"none.pbrt\"",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1]",
        "Shape \"plymesh\" \"string filename\" \"none.ply\"",
        "Shape \"sphere\" \"double radius\" 2",
        "Shape \"sphere\" \"float radius\" [1 2]",
        "Material \"diffuse\" \"spectrum reflectance\" [400 1 700] Shape \"sphere\"",
    ] {
        assert!(load("v4", "", world).is_err(), "{world}");
    }
}

#[test]
fn blocks_of_v3_may_cross() {
    let s = v3(&format!(
        "AttributeBegin ObjectBegin \"o\" AttributeBegin {BALL} AttributeEnd AttributeEnd ObjectEnd ObjectInstance \"o\""
    ));
    assert_eq!((s.spheres.len(), s.warnings.len()), (1, 1));
    assert!(
        s.warnings[0].contains("AttributeEnd: closes the ObjectBegin"),
        "{:?}",
        s.warnings
    );
    // Transforms have a stack of their own: the end of the outer block takes what the inner one
    // left.
    let s = v3(&format!(
        "AttributeBegin Material \"mirror\" Translate 1 0 0 TransformBegin Translate 1 0 0 AttributeEnd {V3_TRIANGLE} TransformEnd {V3_TRIANGLE}"
    ));
    near(corners(&s, 0)[0], Vec3::X);
    near(corners(&s, 1)[0], Vec3::ZERO);
    assert!(material(&s).get::<DiffuseMaterial>().is_some());
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
    // An object within another ends it; shapes after the first end are of the world.
    let s = v3(&format!(
        "ObjectBegin \"a\" {BALL} ObjectBegin \"b\" {MESH} ObjectEnd {MESH} ObjectEnd ObjectInstance \"a\" ObjectInstance \"b\""
    ));
    assert_eq!((s.spheres.len(), s.triangles.len()), (1, 2));
}

#[test]
fn matrices_may_have_a_fourth_row() {
    // Points are divided by 1 + z / 2.
    let m = "[1 0 0 0  0 1 0 0  0 0 1 .5  0 0 0 1]";
    let mesh =
        "Shape \"trianglemesh\" \"point P\" [0 0 2  4 0 2  0 4 0] \"integer indices\" [0 1 2]";
    for directive in ["Transform", "ConcatTransform"] {
        let s = v3(&format!("{directive} {m} {mesh}"));
        let [a, b, c] = corners(&s, 0);
        near(a, Vec3::new(0.0, 0.0, 1.0));
        near(b, Vec3::new(2.0, 0.0, 1.0));
        near(c, Vec3::new(0.0, 4.0, 0.0));
    }
    // To a constant light it is all one; the map of another is turned by the inverse's directions,
    // here the matrix' own.
    let turned =
        "ConcatTransform [0 0 -1 0  -1 0 0 0  0 1 0 2.5  0 0 0 1] LightSource \"infinite\"";
    let s = v3(&format!("AttributeBegin {turned} AttributeEnd {BALL}"));
    assert!(matches!(
        s.lights[0].kind,
        LightKind::InfiniteConstant { .. }
    ));
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    // A point light is where the origin is.
    let s = v3(&format!(
        "Translate 0 0 2 ConcatTransform {m} LightSource \"point\" Identity {BALL}"
    ));
    let LightKind::Point { p, .. } = s.lights[0].kind else {
        panic!("a point")
    };
    near(
        (p.as_dvec3() / s.space.scale + s.space.centre).as_vec3(),
        Vec3::new(0.0, 0.0, 2.0),
    );
    // Rays through a sphere do not stay straight: pbrt's picture of it is none.
    assert!(v3_error(&format!("ConcatTransform {m} {BALL}")).contains("projective"));
    // Where the fourth coordinate is 0 nothing is.
    let s = v3(&format!(
        "ConcatTransform {m} Shape \"trianglemesh\" \"point P\" [0 0 -2  1 0 0  0 1 0] \"integer indices\" [0 1 2]"
    ));
    assert!(
        s.triangles.is_empty() && s.warnings[0].contains("not finite"),
        "{:?}",
        s.warnings
    );
}

#[test]
fn clamped_values_are_told() {
    for (dialect, world, warning) in [
        (
            "v4",
            "Material \"diffuse\" \"rgb reflectance\" [2 .5 .5] Shape \"sphere\"",
            "parameter \"reflectance\": is more than 1",
        ),
        (
            "v3",
            "LightSource \"infinite\" \"rgb L\" [1 -1 1] Shape \"sphere\"",
            "parameter \"L\": is negative",
        ),
        (
            "v4",
            "AreaLightSource \"diffuse\" \"rgb L\" [1 -1 1] Shape \"sphere\"",
            "parameter \"L\": is negative",
        ),
    ] {
        let s = load(dialect, "", world).expect("loads");
        assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
        assert!(s.warnings[0].contains(warning), "{:?}", s.warnings);
    }
}

/// `S` turns highlights that are longer one way, and bumps; on anything else it changes nothing,
/// and is not kept.
#[test]
fn tangents_are_kept_where_they_matter() {
    let mesh = format!("{V3_TRIANGLE} \"vector S\" [1 1 0 1 1 0 1 1 0]");
    for (material, kept) in [
        ("Material \"matte\"", 0),
        ("Material \"metal\" \"float roughness\" .1", 0),
        (
            "Material \"metal\" \"float uroughness\" .1 \"float vroughness\" .3",
            3,
        ),
        (
            "Texture \"c\" \"float\" \"checkerboard\" Material \"matte\" \"texture bumpmap\" \"c\"",
            3,
        ),
    ] {
        let s = v3(&format!("{material} {mesh}"));
        assert_eq!(s.tangents.len(), kept, "{material}");
        assert_eq!(s.warnings, [""; 0], "{material}");
    }
    let metal = "Material \"metal\" \"float uroughness\" .1 \"float vroughness\" .3";
    // An instance that swaps x and y, and meshes without tangents before and after.
    let s = v3(&format!(
        "ObjectBegin \"o\" {metal} {mesh} ObjectEnd {V3_TRIANGLE}
         Transform [0 1 0 0  1 0 0 0  0 0 1 0  0 0 0 1] ObjectInstance \"o\" {V3_TRIANGLE}"
    ));
    assert_eq!(s.vertices.len(), 9);
    let given: Vec<_> = s.tangents.iter().filter(|t| **t != [0.0; 3]).collect();
    let right = |[x, y, z]: [f32; 3]| x > 0.0 && (x, z) == (y, 0.0);
    assert!(
        given.len() == 3 && given.iter().all(|t| right(**t)),
        "{:?}",
        s.tangents
    );
    let wrong = v3(&format!("{metal} {V3_TRIANGLE} \"vector S\" [1 1 0 1 1 0]"));
    assert!(
        wrong.warnings[0].contains("2 \"S\" for 3 vertices"),
        "{:?}",
        wrong.warnings
    );
}
