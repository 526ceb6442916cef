//! Generated and damaged texts: all of them load, or tell why not.

use super::*;

/// Pieces of scenes, in any order.
fn soup() -> impl Strategy<Value = String> {
    let pieces = [
        "WorldBegin",
        "WorldEnd",
        "AttributeBegin",
        "AttributeEnd",
        "TransformBegin",
        "TransformEnd",
        "Film",
        "Camera",
        "Shape",
        "Material",
        "MakeNamedMaterial",
        "NamedMaterial",
        "Texture",
        "LightSource",
        "AreaLightSource",
        "ObjectBegin",
        "ObjectEnd",
        "ObjectInstance",
        "Include",
        "Import",
        "Translate",
        "Scale",
        "Rotate",
        "LookAt",
        "Identity",
        "Transform",
        "ReverseOrientation",
        "CoordSysTransform",
        "ActiveTransform",
        "Attribute",
        "Option",
        "ColorSpace",
        "Integrator",
        "Sampler",
        "PixelFilter",
        "MediumInterface",
        "true",
        "false",
        "[",
        "]",
        "\"sphere\"",
        "\"trianglemesh\"",
        "\"loopsubdiv\"",
        "\"bilinearmesh\"",
        "\"disk\"",
        "\"matte\"",
        "\"diffuse\"",
        "\"metal\"",
        "\"conductor\"",
        "\"dielectric\"",
        "\"spectrum\"",
        "\"float\"",
        "\"checkerboard\"",
        "\"imagemap\"",
        "\"scale\"",
        "\"perspective\"",
        "\"orthographic\"",
        "\"rgb\"",
        "\"image\"",
        "\"mlt\"",
        "\"path\"",
        "\"infinite\"",
        "\"point\"",
        "\"spot\"",
        "\"distant\"",
        "\"rgb L\"",
        "\"float radius\"",
        "\"point3 P\"",
        "\"integer indices\"",
        "\"normal N\"",
        "\"float fov\"",
        "\"rgb reflectance\"",
        "\"texture Kd\"",
        "\"blackbody L\"",
        "\"spectrum eta\"",
        "\"bool twosided\"",
        "\"string filename\"",
        "\"float scale\"",
        "\"float\"",
        "\"x y z\"",
        "\"",
        "#",
        "\n",
        "0",
        "1",
        "-1",
        "2",
        "1e300",
        "1e-300",
        "-1e308",
        "3.5",
        "nan",
        "inf",
        "99999999999999999999",
        "é",
        "\u{0}",
    ];
    prop::collection::vec(prop::sample::select(pieces.to_vec()), 0..60).prop_map(|p| p.join(" "))
}

/// Well-formed enough to reach the builders with odd numbers.
fn odd_numbers() -> impl Strategy<Value = String> {
    let number = prop::sample::select(vec![
        "0", "1", "-1", "2", "0.5", "1e30", "1e-30", "1e200", "-1e308", "1e-320", "7", "1e38",
        "3e38",
    ]);
    (prop::collection::vec(number, 40), 0..8usize).prop_map(|(n, shape)| {
        let shape = [
            "Shape \"sphere\" \"float radius\" A",
            "Shape \"disk\" \"float radius\" A \"float height\" B",
            "Shape \"trianglemesh\" \"point3 P\" [A B C A A C B B C]",
            "Shape \"bilinearmesh\" \"point3 P\" [A B C A A C B B C C C C]",
            "LightSource \"point\" \"point3 from\" [A B C] \"float power\" B",
            "LightSource \"spot\" \"point3 to\" [A B C] \"float coneangle\" C",
            "LightSource \"distant\" \"point3 to\" [A B C] \"blackbody L\" A",
            "ObjectBegin \"o\" Shape \"sphere\" Scale A B C ObjectEnd ObjectInstance \"o\"",
        ][shape];
        let shape = shape.replace('A', n[30]).replace('B', n[31]).replace('C', n[32]);
        format!(
            "Film \"rgb\" \"float iso\" {} LookAt {} {} {} {} {} {} {} {} {} Scale {} {} {} Camera \"perspective\" \
             \"float fov\" {} \"float lensradius\" {} WorldBegin AreaLightSource \"diffuse\" \"float power\" {} \
             Translate {} {} {} Rotate {} {} {} {} Scale {} {} {} {shape}",
            n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9],
            "1", "1", "1", n[13], n[14], n[15], n[16], n[17],
            n[18], n[19], n[20], n[21], n[22], n[23], n[24], n[25]
        )
    })
}

/// A scene, or a message of one line that begins with a place in the text (or just behind it).
fn loads_or_tells(text: &str) -> Option<Scene> {
    let message = match try_load(text) {
        Ok(scene) => return Some(scene),
        Err(message) => message,
    };
    let mut parts = message.splitn(4, ':');
    assert_eq!(parts.next(), Some("t.pbrt"), "{message:?}");
    let [line, column] =
        [(); 2].map(|_| parts.next().and_then(|n| n.parse().ok()).unwrap_or(0usize));
    let width = text
        .split('\n')
        .nth(line.wrapping_sub(1))
        .map(|l| l.chars().count());
    assert!(
        width.is_some_and(|w| (1..=w + 1).contains(&column)),
        "{message:?} in {text:?}"
    );
    assert!(!message.contains('\n'), "{message:?}");
    None
}

/// A scene of both dialects' common parts with some of its words dropped, doubled, exchanged or
/// replaced.
fn mutated() -> impl Strategy<Value = String> {
    let scene = include_str!("../../../tests/reference/cornell.pbrt");
    let words: Vec<&str> = scene.split_inclusive([' ', '\n']).collect();
    let odd = prop::sample::select(vec![
        "\"",
        "[",
        "]",
        "1e39 ",
        "-1 ",
        "nan ",
        "#",
        "\n",
        "WorldEnd ",
        "AttributeEnd ",
        "\"\" ",
        "é ",
    ]);
    let change = (
        any::<prop::sample::Index>(),
        any::<prop::sample::Index>(),
        0..4,
        odd,
    );
    prop::collection::vec(change, 1..5).prop_map(move |changes| {
        let mut words = words.clone();
        for (at, other, kind, odd) in changes {
            let (at, other) = (at.index(words.len()), other.index(words.len()));
            match kind {
                0 => drop(words.remove(at)),
                1 => words.insert(at, words[other]),
                2 => words.swap(at, other),
                _ => words[at] = odd,
            }
        }
        words.concat()
    })
}

/// Loads the scenes named in `PHALANX_SCENES` (separated by colons) and prints what they hold.
#[test]
#[ignore = "needs scenes that are no part of the repository"]
fn scenes_from_the_environment_load() {
    for path in std::env::var("PHALANX_SCENES")
        .unwrap_or_default()
        .split(':')
        .filter(|p| !p.is_empty())
    {
        let s = crate::pbrt::load(Path::new(path)).unwrap_or_else(|e| panic!("{e}"));
        println!(
            "{path}: {} triangles, {} spheres, {} shapes, {} materials, {} textures, {} lights, {:?}\n{:?}\n{:#?}",
            s.triangles.len(),
            s.spheres.len(),
            s.shapes.len(),
            s.materials.len(),
            s.textures.len(),
            s.lights.len(),
            s.integrator,
            s.film,
            s.warnings
        );
    }
}

proptest! {
    #![proptest_config(crate::property::cases(400))]

    #[test]
    fn mutated_scenes_load_or_tell_where(text in mutated()) {
        loads_or_tells(&text);
    }

    #[test]
    fn token_soup_loads_or_tells_where(text in soup()) {
        loads_or_tells(&text);
        loads_or_tells(&format!("WorldBegin {text}"));
    }

    #[test]
    fn odd_numbers_stay_in_bounds(text in odd_numbers()) {
        if let Some(s) = loads_or_tells(&text) {
            prop_assert!(s.vertices.iter().all(|v| Vec3::from(v.p).is_finite()));
            prop_assert!(s.bounds.iter().all(|b| b.is_finite() && b.length() <= 1.001));
            let camera = s.camera.to_world.iter().flatten().chain(&s.camera.screen);
            prop_assert!(camera.into_iter().all(|x| x.is_finite()));
            prop_assert!(s.film.scale.is_finite());
            for light in &s.lights {
                let (LightKind::Point { p, i } | LightKind::Spot { p, i, .. }) = light.kind else {
                    continue;
                };
                prop_assert!(p.is_finite() && i.iter().all(|c| c.is_finite()));
            }
        }
    }

    #[test]
    fn bytes_load_or_tell_where(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        loads_or_tells(&String::from_utf8_lossy(&bytes));
    }
}
