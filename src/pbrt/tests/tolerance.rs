//! What pbrt says about a file and then goes on: a table of it, each with a warning and the picture
//! that pbrt makes. What pbrt refuses stays refused.

use super::*;
use crate::surface::DiffuseMaterial;

/// A scene of `dialect` with this before the world and this in it. The world begins on line 3.
pub(super) fn load(dialect: &str, options: &str, world: &str) -> Result<Scene, String> {
    let film = if dialect == "v3" { "image" } else { "rgb" };
    let end = if dialect == "v3" { "WorldEnd" } else { "" };
    try_load(&format!(
        "Film \"{film}\" {options}\nWorldBegin\n{world}\n{end}\n"
    ))
}

/// One row: it loads with just one warning, which holds `warning`, and the same tables as `meant`
/// but for where things were made.
pub(super) fn check(
    dialect: &str,
    (options, world): (&str, &str),
    warning: &str,
    meant: (&str, &str),
) {
    let row = format!("{dialect}: {options} | {world}");
    let given = load(dialect, options, world).unwrap_or_else(|e| panic!("{row}: {e}"));
    let plain = load(dialect, meant.0, meant.1).unwrap_or_else(|e| panic!("{row}: {e}"));
    assert_eq!(given.warnings.len(), 1, "{row}: {:?}", given.warnings);
    let told = &given.warnings[0];
    assert!(
        told.starts_with("t.pbrt:") && told.contains(warning),
        "{row}: {told}"
    );
    assert_eq!(picture(&given), picture(&plain), "{row}");
}

/// What a picture is made of, without names and places in the text.
pub(super) fn picture(scene: &Scene) -> String {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        material.name.clear();
        material.origin.clear();
    }
    scene.lights.iter_mut().for_each(|l| l.origin.clear());
    scene.warnings.clear();
    format!("{scene:?}")
}

pub(super) const BALL: &str = "Shape \"sphere\"";

pub(super) const MESH: &str =
    "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]";
const MESH_V4: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";

/// World text of v3, the warning, and the world that it comes to.
#[test]
fn directives_that_v3_ignores() {
    let green = "Material \"matte\" \"rgb Kd\" [.2 .8 .2]";
    for (world, warning, meant) in [
        (
            format!("{green} NamedMaterial \"a\" {BALL}"),
            "there is no material named \"a\"",
            format!("{green} {BALL}"),
        ),
        (
            format!("Material \"wood\" \"rgb Kd\" [1 0 0] {BALL}"),
            "material \"wood\" is unknown",
            format!("Material \"matte\" \"rgb Kd\" [1 0 0] {BALL}"),
        ),
        (
            format!("Material \"diffuse\" {BALL}"),
            "is unknown",
            format!("Material \"matte\" {BALL}"),
        ),
        (
            format!("MakeNamedMaterial \"a\" NamedMaterial \"a\" {BALL}"),
            "has no \"string type\"",
            format!("Material \"none\" {BALL}"),
        ),
        (
            format!("{BALL} Shape \"blob\" \"float size\" 2 {MESH}"),
            "no such shape",
            format!("{BALL} {MESH}"),
        ),
        (
            format!("LightSource \"sun\" \"rgb L\" [1 1 1] {BALL}"),
            "no such light",
            BALL.into(),
        ),
        (
            format!("AreaLightSource \"glow\" \"rgb L\" [1 1 1] {BALL}"),
            "no such light",
            BALL.into(),
        ),
        (
            format!("ObjectInstance \"o\" {BALL}"),
            "there is no object named \"o\"",
            BALL.into(),
        ),
        (
            format!("Texture \"t\" \"vector\" \"constant\" {BALL}"),
            "texture type \"vector\" is unknown",
            BALL.into(),
        ),
        (
            format!("Texture \"t\" \"float\" \"noise\" \"float scale\" 3 {BALL}"),
            "no such texture",
            BALL.into(),
        ),
        (
            format!("Texture \"t\" \"float\" \"marble\" {BALL}"),
            "no such texture",
            BALL.into(),
        ),
        (
            format!("CoordSysTransform \"here\" {BALL}"),
            "no coordinate system named \"here\"",
            BALL.into(),
        ),
        (
            format!("LookAt 0 0 1 0 0 0 0 0 2 {BALL}"),
            "up vector",
            BALL.into(),
        ),
        (
            format!("AttributeEnd {BALL}"),
            "there is no AttributeBegin",
            BALL.into(),
        ),
        (
            format!("TransformEnd {BALL}"),
            "there is no TransformBegin",
            BALL.into(),
        ),
        (
            format!("MediumInterface \"fog\" {BALL}"),
            "there is no medium named \"fog\"",
            BALL.into(),
        ),
        (
            format!("Include \"none.pbrt\" {BALL}"),
            "there is no file",
            BALL.into(),
        ),
        (
            format!("Shape \"plymesh\" \"string filename\" \"none.ply\" {BALL}"),
            "none.ply",
            BALL.into(),
        ),
        (
            format!("Camera \"perspective\" \"float fov\" [30] {BALL}"),
            "belongs before WorldBegin",
            BALL.into(),
        ),
        (
            format!("WorldBegin {BALL}"),
            "belongs before WorldBegin",
            BALL.into(),
        ),
        (
            format!("ObjectBegin \"a\" {BALL} ObjectInstance \"a\" ObjectEnd {MESH}"),
            "cannot hold instances",
            MESH.into(),
        ),
        (
            format!(
                "ActiveTransform EndTime Translate 1 0 0 LightSource \"point\" Identity ActiveTransform All {BALL}"
            ),
            "StartTime is used",
            format!("LightSource \"point\" {BALL}"),
        ),
        (
            format!(
                "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"none.png\" Material \"matte\" \"texture Kd\" \"t\" {BALL}"
            ),
            "it is grey",
            format!("Material \"matte\" \"rgb Kd\" [.21404114 .21404114 .21404114] {BALL}"),
        ),
        (
            format!(
                "Texture \"t\" \"spectrum\" \"uv\" \"string mapping\" \"odd\" \"float uscale\" 3 Material \"matte\" \"texture Kd\" \"t\" {MESH}"
            ),
            "mapping \"odd\" is unknown",
            format!(
                "Texture \"t\" \"spectrum\" \"uv\" Material \"matte\" \"texture Kd\" \"t\" {MESH}"
            ),
        ),
    ] {
        check("v3", ("", &world), warning, ("", &meant));
    }
    for (options, warning) in [
        (
            "Material \"mirror\" \"rgb Kr\" [1 1 1]",
            "belongs after WorldBegin",
        ),
        ("AttributeBegin", "belongs after WorldBegin"),
        ("WorldEnd", "belongs after WorldBegin"),
    ] {
        check("v3", (options, BALL), warning, ("", BALL));
    }
}

/// A parameter that is given wrongly, and what it comes to.
#[test]
fn parameters_that_v3_ignores() {
    let spd = "[400 .2 700 .4]";
    for (world, warning, meant) in [
        (
            "Shape \"sphere\" \"integer radius\" 2",
            "has type integer",
            "Shape \"sphere\"",
        ),
        (
            "Shape \"sphere\" \"float radius\" [2 3]",
            "expected 1 value",
            "Shape \"sphere\"",
        ),
        (
            "Shape \"sphere\" \"float radius\" \"2\"",
            "expected numbers",
            "Shape \"sphere\"",
        ),
        (
            "Shape \"sphere\" \"float\" 2",
            "left out",
            "Shape \"sphere\"",
        ),
        (
            "Shape \"sphere\" \"double radius\" 2",
            "unknown type \"double\"",
            "Shape \"sphere\"",
        ),
        (
            "Shape \"sphere\" \"double radius\" [\"2\" \"3\"]",
            "unknown type \"double\"",
            "Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\"",
            "no spectrum texture named \"t\"",
            "Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"texture sigma\" \"t\" Shape \"sphere\"",
            "no float texture named \"t\"",
            "Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"texture Kd\" [\"t\" \"u\"] Shape \"sphere\"",
            "name of one texture",
            "Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"float Kd\" .3 Shape \"sphere\"",
            "is no colour",
            "Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"rgb Kd\" [1 0 0 1] Shape \"sphere\"",
            "not a multiple of 3",
            "Material \"matte\" \"rgb Kd\" [1 0 0] Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"rgb Kd\" [1 0 0 0 1 0] Shape \"sphere\"",
            "the first of its values",
            "Material \"matte\" \"rgb Kd\" [1 0 0] Shape \"sphere\"",
        ),
        (
            "Material \"matte\" \"float sigma\" [20 30] Shape \"sphere\"",
            "the first of its values",
            "Material \"matte\" \"float sigma\" 20 Shape \"sphere\"",
        ),
        (
            "LightSource \"point\" \"rgb I\" [1 0 0 0 1 0] Shape \"sphere\"",
            "6 numbers where 3",
            "LightSource \"point\" Shape \"sphere\"",
        ),
        (
            "LightSource \"point\" \"blackbody I\" [6500 2 9] Shape \"sphere\"",
            "not a multiple of 2",
            "LightSource \"point\" \"blackbody I\" [6500 2] Shape \"sphere\"",
        ),
        (
            "LightSource \"point\" \"spectrum I\" \"none.spd\" LightSource \"infinite\" Shape \"sphere\"",
            "it is black",
            "LightSource \"infinite\" Shape \"sphere\"",
        ),
        (
            "LightSource \"infinite\" \"string mapname\" \"none.exr\" Shape \"sphere\"",
            "without an image",
            "LightSource \"infinite\" Shape \"sphere\"",
        ),
        (
            "LightSource \"goniometric\" \"string mapname\" \"none.exr\" Shape \"sphere\"",
            "without an image",
            "LightSource \"goniometric\" Shape \"sphere\"",
        ),
        (
            "Material \"glass\" \"bool remaproughness\" \"yes\" Shape \"sphere\"",
            "neither true nor false",
            "Material \"glass\" \"bool remaproughness\" \"false\" Shape \"sphere\"",
        ),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"mirror\" Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" Shape \"sphere\"",
            "no material named \"b\"",
            "MakeNamedMaterial \"a\" \"string type\" \"mirror\" MakeNamedMaterial \"b\" \"string type\" \"matte\" Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" Shape \"sphere\"",
        ),
    ] {
        check("v3", ("", world), warning, ("", meant));
    }
    let matte = |samples: &str| format!("Material \"matte\" \"spectrum Kd\" {samples} {BALL}");
    check(
        "v3",
        ("", &matte("[400 .2 700 .4 800]")),
        "not a multiple of 2",
        ("", &matte(spd)),
    );
    for (options, warning) in [
        (
            "Camera \"perspective\" \"float screenwindow\" [-1 1]",
            "\"screenwindow\" is ignored",
        ),
        (
            "Camera \"perspective\" \"integer fov\" 30",
            "has type integer",
        ),
    ] {
        let camera = ("Camera \"perspective\"", BALL);
        check("v3", (options, BALL), warning, camera);
    }
    check(
        "v3",
        ("Sampler \"random\" \"integer pixelsamples\" 7.9", BALL),
        "fractions",
        ("Sampler \"random\" \"integer pixelsamples\" 7", BALL),
    );
}

#[test]
fn arrays_of_the_wrong_length_are_left_out() {
    for (extra, warning) in [
        ("\"float uv\" []", "has 0 \"uv\" for 3 vertices"),
        ("\"float uv\" [0 0 1 0]", "has 2 \"uv\" for 3"),
        ("\"float st\" [0 0 1 0]", "has 2 \"st\" for 3"),
        ("\"normal N\" [0 0 1]", "has 1 \"N\" for 3"),
        ("\"normal N\" []", "has 0 \"N\" for 3"),
    ] {
        check("v3", ("", &format!("{MESH} {extra}")), warning, ("", MESH));
    }
    for (extra, warning) in [
        ("\"point2 uv\" [0 0 1 0]", "has 2 \"uv\" for 3 vertices"),
        ("\"point2 uv\" [0 0 1 0 0 1 1 1]", "has 4 \"uv\" for 3"),
        ("\"normal N\" [0 0 1]", "has 1 \"N\" for 3"),
        ("\"integer indices\" [0 1 2 0]", "has 4 indices"),
    ] {
        check(
            "v4",
            ("", &format!("{MESH_V4} {extra}")),
            warning,
            ("", MESH_V4),
        );
    }
    let uv = "\"float uv\" [0 0 1 0 0 1";
    check(
        "v3",
        ("", &format!("{MESH} {uv} 1 1]")),
        "the last are not used",
        ("", &format!("{MESH} {uv}]")),
    );
    let four = "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0]";
    check(
        "v4",
        ("", &format!("{four} \"normal N\" [0 0 1]")),
        "has 1 \"N\"",
        ("", four),
    );
    // Without indices or vertices v3 has no mesh, and goes on.
    let ball = ("", BALL);
    for broken in [
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2]",
        "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0]",
        "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
        "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" []",
        "Shape \"loopsubdiv\" \"integer indices\" [0 1 2]",
        "Shape \"plymesh\"",
    ] {
        check(
            "v3",
            ("", &format!("{broken} {BALL}")),
            "it is left out",
            ball,
        );
    }
}

#[test]
fn what_v4_ignores() {
    for (world, warning, meant) in [
        (
            format!("AttributeEnd {BALL}"),
            "there is no AttributeBegin",
            BALL.to_string(),
        ),
        (
            format!("{BALL} AttributeEnd"),
            "there is no AttributeBegin",
            BALL.into(),
        ),
        (
            format!("TransformEnd {BALL}"),
            "there is no TransformBegin",
            BALL.into(),
        ),
        (
            format!("CoordSysTransform \"here\" {BALL}"),
            "no coordinate system",
            BALL.into(),
        ),
        (
            format!("ColorSpace \"bt1886\" {BALL}"),
            "\"bt1886\" is unknown",
            BALL.into(),
        ),
        (
            format!("Texture \"t\" \"float\" \"bilerp\" \"string mapping\" \"odd\" {BALL}"),
            "mapping \"odd\"",
            format!("Texture \"t\" \"float\" \"bilerp\" {BALL}"),
        ),
    ] {
        check("v4", ("", &world), warning, ("", &meant));
    }
    check(
        "v4",
        ("Camera \"perspective\" \"float screenwindow\" [1]", BALL),
        "\"screenwindow\"",
        ("Camera \"perspective\"", BALL),
    );
    for (film, warning, meant) in [
        (
            "\"float cropwindow\" [0 1]",
            "\"cropwindow\" is ignored",
            "",
        ),
        (
            "\"integer pixelbounds\" [0 1]",
            "\"pixelbounds\" is ignored",
            "",
        ),
        (
            "\"float cropwindow\" [0 .5 0 1] \"integer pixelbounds\" [0 9 0 9]",
            "beside \"cropwindow\"",
            "\"float cropwindow\" [0 .5 0 1]",
        ),
    ] {
        let of = |film: &str| format!("Film \"rgb\" {film}");
        check("v4", (&of(film), BALL), warning, (&of(meant), BALL));
    }
    // A transform block is an attribute block.
    let s = v4(&format!(
        "TransformBegin Material \"conductor\" {V4_TRIANGLE} AttributeEnd {V4_TRIANGLE}"
    ));
    assert!(s.materials[1].kind.get::<DiffuseMaterial>().is_some());
    assert!(s.warnings.is_empty());
}
