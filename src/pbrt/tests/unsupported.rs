//! What is not supported says so where it stands.

use super::*;

#[test]
fn what_is_not_supported_says_so_where_it_stands() {
    for (text, expected) in [
        (
            format!("Material \"coateddiffuse\" \"rgb albedo\" [.5 .5 .5] {V4_TRIANGLE}"),
            "t.pbrt:3:1: Material \"coateddiffuse\": a coat that scatters",
        ),
        (
            format!(
                "MakeNamedMaterial \"a\" \"string type\" \"subsurface\" \"rgb sigma_a\" [1 1 1] NamedMaterial \"a\" {V4_TRIANGLE}"
            ),
            "t.pbrt:3:1: MakeNamedMaterial \"a\" of type \"subsurface\": needs both ",
        ),
        (
            format!("{V4_TRIANGLE} \"float shadowalpha\" 0.5"),
            "t.pbrt:3:55: Shape \"trianglemesh\": parameter \"shadowalpha\": is of pbrt-v3; use \"alpha\"",
        ),
        (
            format!("{V4_TRIANGLE} \"texture alpha\" \"a\""),
            "t.pbrt:3:55: Shape \"trianglemesh\": parameter \"alpha\": there is no float texture named \"a\"",
        ),
        (
            format!("Material \"diffuse\" \"texture bumpmap\" \"b\" {V4_TRIANGLE}"),
            "t.pbrt:3:20: Material \"diffuse\": parameter \"bumpmap\": is of pbrt-v3; use \"displacement\"",
        ),
        (
            format!("Material \"diffuse\" \"texture displacement\" \"b\" {V4_TRIANGLE}"),
            "t.pbrt:3:20: Material \"diffuse\": parameter \"displacement\": there is no float texture named \"b\"",
        ),
        (
            format!("Material \"diffuse\" \"string normalmap\" \"none.png\" {V4_TRIANGLE}"),
            "t.pbrt:3:1: Material \"diffuse\": ",
        ),
        (
            format!("MediumInterface \"fog\" \"\" {V4_TRIANGLE}"),
            "t.pbrt:3:26: Shape \"trianglemesh\": there is no medium named \"fog\"",
        ),
        (
            format!(
                "MakeNamedMedium \"fog\" \"string type\" \"nanovdb\" MediumInterface \"fog\" \"\" {V4_TRIANGLE}"
            ),
            "t.pbrt:3:1: MakeNamedMedium \"fog\": a nanovdb medium needs a \"string filename\"",
        ),
        (
            "LightSource \"projection\"".into(),
            "t.pbrt:3:1: LightSource \"projection\": needs an image, \"string ",
        ),
        (
            "Shape \"cone\"".into(),
            "t.pbrt:3:1: Shape \"cone\": this shape is unknown; use",
        ),
        (
            format!("ActiveTransform EndTime Translate 1 0 0 {V4_TRIANGLE}"),
            "t.pbrt:3:41: Shape \"trianglemesh\": motion blur is not supported",
        ),
        ("Fog".into(), "t.pbrt:3:1: unknown directive 'Fog'"),
        (
            "Shape \"sphere\" \"float radius\" [1 nan]".into(),
            "t.pbrt:3:34: Shape \"sphere\": parameter \"radius\": 'nan'",
        ),
        (
            "Shape \"sphere\" \"float radius\" [1 2]".into(),
            "t.pbrt:3:16: Shape \"sphere\": parameter \"radius\": expected 1",
        ),
        (
            "Shape \"sphere\" \"integer radius\" 1".into(),
            "t.pbrt:3:16: Shape \"sphere\": parameter \"radius\": has type",
        ),
        (
            "Shape \"sphere\" \"float radius\" [1".into(),
            "t.pbrt:3:16: Shape \"sphere\": parameter \"radius\" has no closing",
        ),
        (
            "Translate 1 2 inf".into(),
            "t.pbrt:3:15: Translate: expected 3 numbers, found 'inf'",
        ),
        (
            "NamedMaterial \"m\" Shape \"sphere\"".into(),
            "t.pbrt:3:1: NamedMaterial: there is no material named \"m\"",
        ),
    ] {
        let error = v4_error(&text);
        assert!(error.starts_with(expected), "{error}\nexpected\n{expected}");
    }
    let error = v3_error(&format!(
        "Material \"disney\" \"rgb scatterdistance\" [.1 .2 0] {V3_TRIANGLE}"
    ));
    assert!(
        error.starts_with("t.pbrt:3:1: Material \"disney\": its \"scatterdistance\" is not"),
        "{error}"
    );
    for (text, expected) in [
        (
            format!("Material \"matte\" \"texture displacement\" \"b\" {V3_TRIANGLE}"),
            "t.pbrt:3:18: Material \"matte\": parameter \"displacement\": is of pbrt-v4; use \"bumpmap\"",
        ),
        (
            format!("Material \"matte\" \"string normalmap\" \"b\" {V3_TRIANGLE}"),
            "t.pbrt:3:18: Material \"matte\": parameter \"normalmap\": is of pbrt-v4; use \"bumpmap\"",
        ),
    ] {
        let error = v3_error(&text);
        assert!(error.starts_with(expected), "{error}\nexpected\n{expected}");
    }
}

#[test]
fn what_is_never_used_need_not_be_supported() {
    let s = v4(&format!(
        "Material \"subsurface\" \"string name\" \"Wax\" Material \"diffuse\" {V4_TRIANGLE}"
    ));
    assert_eq!(s.materials.len(), 1);
    assert!(
        s.warnings[0].starts_with("t.pbrt:3:1: Material \"subsurface\""),
        "{:?}",
        s.warnings
    );
    let s = v4("Shape \"sphere\" \"float foo\" 1");
    assert_eq!(
        s.warnings,
        ["t.pbrt:3:16: Shape \"sphere\": unknown parameter \"foo\" ignored"]
    );
}
