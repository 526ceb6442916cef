//! What is wrong with a texture says what to use instead.

use super::*;

#[test]
fn errors_say_what_to_use() {
    let error = |head: &str, class: &str, rest: &str| {
        let text = format!("Texture \"t\" \"{class}\" {rest}");
        match world(head, &text, class) {
            // pbrt goes on, and so do we, with a word.
            Ok(scene) if !scene.warnings.is_empty() => scene.warnings[0].clone(),
            other => other.expect_err(rest),
        }
    };
    for (head, class, rest, want) in [
        (
            "rgb",
            "spectrum",
            "\"fbm\"",
            "Texture \"fbm\": is a number in pbrt-v4; declare it \"float\"",
        ),
        ("rgb", "spectrum", "\"windy\"", "is a number in pbrt-v4"),
        (
            "rgb",
            "float",
            "\"marble\"",
            "is a colour; declare it \"spectrum\"",
        ),
        (
            "image",
            "float",
            "\"uv\"",
            "left out: pbrt-v3 has no such texture",
        ),
        ("rgb", "spectrum", "\"uv\"", "is of pbrt-v3; use bilerp"),
        (
            "image",
            "spectrum",
            "\"directionmix\"",
            "left out: pbrt-v3 has no such texture",
        ),
        (
            "rgb",
            "spectrum",
            "\"ptex\" \"string filename\" \"a.ptx\"",
            "Ptex is not supported; bake it into an image",
        ),
        (
            "rgb",
            "spectrum",
            "\"wood\"",
            "texture \"wood\" is unknown; use constant, scale, mix, directionmix, checkerboard",
        ),
        (
            "image",
            "spectrum",
            "\"wood\"",
            "left out: pbrt-v3 has no such texture",
        ),
        (
            "rgb",
            "spectrum",
            "\"dots\" \"string mapping\" \"conical\"",
            "texture mapping \"conical\" is unknown; uv is used",
        ),
        (
            "rgb",
            "float",
            "\"wrinkled\" \"integer octaves\" 65",
            "parameter \"octaves\": is 65, must be between 0 and 64",
        ),
        (
            "rgb",
            "spectrum",
            "\"checkerboard\" \"integer dimension\" 4",
            "parameter \"dimension\": is 4, must be between 2 and 3",
        ),
        (
            "rgb",
            "spectrum",
            "\"directionmix\" \"vector3 dir\" [0 0 0]",
            "its \"dir\" has no direction",
        ),
        (
            "rgb",
            "spectrum",
            "\"bilerp\" \"string mapping\" \"planar\" \"vector3 v1\" [1 0]",
            "parameter \"v1\": expected 3 values",
        ),
        (
            "rgb",
            "spectrum",
            "\"bilerp\" \"texture v00\" \"t\"",
            "parameter \"v00\": is no colour",
        ),
        (
            "rgb",
            "spectrum",
            "\"imagemap\" \"string filename\" \"a.png\" \"string wrap\" \"mirror\"",
            "wrap mode \"mirror\" is unknown; use repeat, black, clamp or octahedralsphere",
        ),
    ] {
        let found = error(head, class, rest);
        assert!(found.starts_with("t.pbrt:3:"), "{found}");
        assert!(found.contains(want), "{found}");
    }
    // Nothing is mapped by a transform that has no inverse, and nothing moves.
    let flat = "Scale 1 0 1 Texture \"t\" \"spectrum\" \"marble\"";
    let found = textures("rgb", flat, "spectrum").expect_err("flat");
    assert!(
        found.contains("the current transform has no inverse"),
        "{found}"
    );
    assert!(textures("image", flat, "spectrum").is_ok());
    let moved = |kind: &str| {
        let text = format!(
            "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Texture \"t\" \"spectrum\" \"{kind}\" \
             ActiveTransform EndTime Translate -1 0 0 ActiveTransform All"
        );
        match world("rgb", &text, "spectrum") {
            Ok(scene) => scene.warnings.join("\n"),
            Err(error) => error,
        }
    };
    for kind in ["checkerboard", "marble"] {
        let found = moved(kind);
        let said = ["does not move", "motion blur is not supported"];
        assert!(said.iter().any(|s| found.contains(s)), "{found}");
    }
}
