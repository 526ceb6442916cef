//! What `inspect` says of a scene, as text and as JSON.

use super::Folder;

#[test]
fn inspect_prints_the_scene_and_the_plan() {
    let folder = Folder::with_cornell();
    let text = folder.run("inspect cornell.pbrt").succeeds().stdout();
    assert!(
        !text.contains("left out  ") && text.lines().count() < 45,
        "{text}"
    );
    let text = folder
        .run("inspect cornell.pbrt --plan")
        .succeeds()
        .stdout();
    for part in [
        "triangles     24",
        "spheres       1",
        "lights        2 (2 triangle)",
        "1 smooth dielectric",
        "400 x 400",
        "looking along (0.0000, 0.0000, -1.0000)",
        "bounds        (-1.0000, 0.0000, -1.0000) to (1.0000, 2.0000, 1.0000)",
        "strategies",
        "left out      ",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert_eq!(folder.files(), ["cornell.pbrt"]);
}

#[test]
fn inspect_estimates_what_an_error_takes() {
    let folder = Folder::new();
    let text = folder.run("inspect --estimate").succeeds().stdout();
    let line = text.lines().last().unwrap();
    assert!(line.starts_with("  time          10 % in "), "{line}");
    let text = folder.run("inspect --estimate --json").succeeds().stdout();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let seconds = |i: usize| json["seconds_to_error"][i]["seconds"].as_f64().unwrap();
    assert!(seconds(0) < seconds(1) && seconds(1) < seconds(2));
}

#[test]
fn inspect_speaks_json() {
    let folder = Folder::with_cornell();
    let text = folder
        .run("inspect cornell.pbrt --json --max-depth 3")
        .succeeds()
        .stdout();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["triangles"], 24);
    assert_eq!(json["camera"]["projection"], "perspective");
    let plan = &json["plan"];
    let depths = plan["depths"].as_array().unwrap();
    assert_eq!(depths.len(), 4);
    for (depth, entry) in depths.iter().enumerate() {
        let parts = entry["parts"].as_array().unwrap();
        let last = parts.last().unwrap()["end"].as_u64();
        assert_eq!(entry["primary_samples"].as_u64(), last);
        let strategies = entry["strategies"].as_array().unwrap().len();
        assert_eq!(strategies, if depth == 0 { 1 } else { depth + 2 });
    }
    let glass = plan["effects"].as_array().unwrap().iter();
    let glass: Vec<_> = glass
        .filter(|e| e["effect"] == "smooth dielectric")
        .collect();
    let reason = glass[0]["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("material \"glass\", cornell.pbrt:"),
        "{reason}"
    );

    // Text and JSON are of the same plan.
    let forced = folder
        .run("inspect cornell.pbrt --force-effects all --plan")
        .succeeds()
        .stdout();
    assert!(forced.contains("rough dielectric") && forced.contains("forced"));
    let ran = folder.run("inspect cornell.pbrt --force-effects lenses");
    assert!(ran.stderr().contains("light-choice"), "{}", ran.stderr());
}

/// Media and what scatters light below its surface have names and places.
#[test]
fn inspect_names_media() {
    let folder = Folder::new();
    folder.write(
        "fog.pbrt",
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nMediumInterface \"\" \"fog\"\n\
         Camera \"perspective\"\nWorldBegin\nLightSource \"point\"\n\
         MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \
         \"float density\" [1 2] \"rgb sigma_a\" [0 0 0]\nMediumInterface \"smoke\" \"fog\"\n\
         Material \"interface\" Shape \"sphere\"\n\
         Material \"subsurface\" MediumInterface \"fog\" \"fog\" Translate 4 0 0 Shape \"sphere\"\n",
    );
    let text = folder.run("inspect fog.pbrt").succeeds().stdout();
    for part in [
        "media         2\n",
        "\"fog\" (fog.pbrt:1): homogeneous, scatters, absorbs, around the camera\n",
        "\"smoke\" (fog.pbrt:6): a grid of 2 x 1 x 1, scatters\n",
        "subsurface    in subsurface (fog.pbrt:9)\n",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let text = folder.run("inspect --json fog.pbrt").succeeds().stdout();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let media = json["media"].as_array().unwrap();
    assert_eq!(media.len(), 2);
    for medium in media {
        let is_fog = medium["name"] == "fog";
        assert_eq!(medium["around_camera"], is_fog);
        assert_eq!(medium["grid"].is_null(), is_fog);
    }
    let below = json["materials"].as_array().unwrap().iter();
    assert_eq!(below.filter(|m| m["subsurface"] == true).count(), 1);
}
