//! `Texture` directives, from text to tables: defaults of both dialects, transforms, errors.

mod errors;

use crate::pbrt::load_str;
use crate::scene::*;
use crate::surface::PlasticMaterial;
use std::path::Path;

fn try_load(head: &str, world: &str) -> Result<Scene, String> {
    let text = format!(
        "LookAt 0 0 9  0 0 0  0 1 0 Camera \"perspective\" Film \"{head}\"\nWorldBegin\n{world}\n"
    );
    load_str(&text, "t.pbrt", Path::new("/nonexistent")).map_err(|e| e.to_string())
}

/// The textures of a world that has none but the one used by its material.
fn textures(head: &str, directives: &str, class: &str) -> Result<Vec<Texture>, String> {
    world(head, directives, class).map(|s| {
        assert_eq!(s.warnings, [""; 0]);
        s.textures
    })
}

/// The world of [`textures`].
fn world(head: &str, directives: &str, class: &str) -> Result<Scene, String> {
    let (material, shape) = if head == "image" {
        let parameter = if class == "float" { "sigma" } else { "Kd" };
        (
            format!("\"matte\" \"texture {parameter}\" \"t\""),
            "point P",
        )
    } else if class == "float" {
        (
            "\"conductor\" \"texture roughness\" \"t\"".to_owned(),
            "point3 P",
        )
    } else {
        (
            "\"diffuse\" \"texture reflectance\" \"t\"".to_owned(),
            "point3 P",
        )
    };
    let world = format!(
        "{directives} AttributeBegin Identity Material {material} \
         Shape \"trianglemesh\" \"{shape}\" [0 0 0  1 0 0  0 1 0] \"integer indices\" [0 1 2] AttributeEnd"
    );
    try_load(head, &world)
}

fn one(head: &str, class: &str, rest: &str) -> Texture {
    let directive = format!("Texture \"t\" \"{class}\" {rest}");
    let list = textures(head, &directive, class).unwrap_or_else(|e| panic!("{e}"));
    let [texture] = list.try_into().expect("one texture");
    texture
}

fn both(class: &str, rest: &str) -> [Texture; 2] {
    ["image", "rgb"].map(|head| one(head, class, rest))
}

/// Internal to world space of the triangle of [`textures`]: its bounds' centre, and the power of
/// two that its size asks for.
const WORLD: ToTexture = [
    [1.0, 0.0, 0.0, 0.5],
    [0.0, 1.0, 0.0, 0.5],
    [0.0, 0.0, 1.0, 0.0],
];

const EIGHT: Octaves = Octaves {
    count: 8,
    roughness: 0.5,
};

#[test]
fn defaults_are_those_of_pbrt() {
    let zero = Param::Constant([0.0; 3]);
    let one = Param::Constant([1.0; 3]);
    let uv = Mapping::Uv(UvMapping {
        su: 1.0,
        sv: 1.0,
        du: 0.0,
        dv: 0.0,
    });
    for class in ["float", "spectrum"] {
        for texture in both(class, "\"checkerboard\"") {
            let want = Texture::Checkerboard {
                a: one,
                b: zero,
                mapping: uv,
            };
            assert_eq!(texture, want);
        }
        for texture in both(class, "\"checkerboard\" \"integer dimension\" 3") {
            let want = Texture::Blocks {
                a: one,
                b: zero,
                to_texture: WORLD,
            };
            assert_eq!(texture, want);
        }
        // "inside" is 1 by default, and outside.
        for texture in both(class, "\"dots\"") {
            let want = Texture::Dots {
                dot: zero,
                ground: one,
                mapping: uv,
            };
            assert_eq!(texture, want);
        }
        for texture in both(class, "\"bilerp\"") {
            let want = Texture::Bilerp {
                v00: [0.0; 3],
                v01: [1.0; 3],
                v10: [0.0; 3],
                v11: [1.0; 3],
                mapping: uv,
            };
            assert_eq!(texture, want);
        }
    }
    let noises = [
        (
            "fbm",
            Texture::Fbm {
                octaves: EIGHT,
                to_texture: WORLD,
            },
        ),
        (
            "wrinkled",
            Texture::Wrinkled {
                octaves: EIGHT,
                to_texture: WORLD,
            },
        ),
        ("windy", Texture::Windy { to_texture: WORLD }),
    ];
    for (kind, want) in noises {
        let kind = format!("\"{kind}\"");
        assert_eq!(both("float", &kind), [want.clone(), want.clone()]);
        assert_eq!(self::one("image", "color", &kind), want);
    }
    let marble = |spline| Texture::Marble {
        octaves: EIGHT,
        scale: 1.0,
        variation: 0.2,
        spline,
        to_texture: WORLD,
    };
    assert_eq!(
        both("spectrum", "\"marble\""),
        [marble(MarbleSpline::V3), marble(MarbleSpline::V4)]
    );
    assert_eq!(
        self::one("image", "spectrum", "\"uv\""),
        Texture::Uv { mapping: uv }
    );
    for class in ["float", "spectrum"] {
        let want = Texture::DirectionMix {
            a: zero,
            b: one,
            direction: [0.0, 1.0, 0.0],
        };
        assert_eq!(self::one("rgb", class, "\"directionmix\""), want);
    }
}

#[test]
fn parameters_are_read() {
    for texture in both(
        "spectrum",
        "\"marble\" \"integer octaves\" 3 \"float roughness\" .25 \"float scale\" 4 \"float variation\" 1",
    ) {
        let Texture::Marble {
            octaves,
            scale,
            variation,
            ..
        } = texture
        else {
            panic!("marble")
        };
        assert_eq!((octaves.count, octaves.roughness), (3, 0.25));
        assert_eq!((scale, variation), (4.0, 1.0));
    }
    for texture in both(
        "spectrum",
        "\"bilerp\" \"rgb v00\" [.1 .2 .3] \"rgb v01\" [.2 .3 .4] \"rgb v10\" [.3 .4 .5] \"rgb v11\" [.4 .5 .6] \"float udelta\" 7",
    ) {
        let Texture::Bilerp {
            v00,
            v01,
            v10,
            v11,
            mapping: Mapping::Uv(UvMapping { du, .. }),
        } = texture
        else {
            panic!("bilerp")
        };
        assert_eq!(
            [v00[0], v01[0], v10[0], v11[0], du],
            [0.1, 0.2, 0.3, 0.4, 7.0]
        );
    }
    for texture in both(
        "float",
        "\"dots\" \"float inside\" .25 \"float outside\" .75",
    ) {
        let Texture::Dots { dot, ground, .. } = texture else {
            panic!("dots")
        };
        assert_eq!(dot, Param::Constant([0.75; 3]));
        assert_eq!(ground, Param::Constant([0.25; 3]));
    }
    // The direction turns with the transform.
    let texture = textures(
        "rgb",
        "Rotate 90 1 0 0 Scale 1 5 1 Texture \"t\" \"spectrum\" \"directionmix\" \"vector3 dir\" [0 2 0]",
        "spectrum",
    );
    let Texture::DirectionMix { direction, .. } = texture.expect("loads")[0] else {
        panic!("directionmix")
    };
    assert!(
        direction[2] == 1.0 && direction[1].abs() < 1e-15,
        "{direction:?}"
    );
}

/// Children may be textures wherever pbrt looks for textures, and shared.
#[test]
fn textures_of_textures() {
    let child = "Texture \"c\" \"float\" \"wrinkled\" Texture \"k\" \"spectrum\" \"marble\" ";
    for (head, class, rest, count) in [
        (
            "rgb",
            "spectrum",
            "\"dots\" \"texture inside\" \"k\" \"texture outside\" \"k\"",
            1,
        ),
        ("rgb", "spectrum", "\"dots\" \"texture inside\" \"k\"", 2),
        ("image", "float", "\"dots\" \"texture outside\" \"c\"", 2),
        ("rgb", "float", "\"directionmix\" \"texture tex1\" \"c\"", 2),
        (
            "rgb",
            "spectrum",
            "\"scale\" \"texture tex\" \"k\" \"texture scale\" \"c\"",
            3,
        ),
        (
            "image",
            "spectrum",
            "\"scale\" \"texture tex1\" \"k\" \"texture tex2\" \"k\"",
            2,
        ),
        (
            "image",
            "spectrum",
            "\"mix\" \"texture tex1\" \"k\" \"texture amount\" \"c\"",
            3,
        ),
        (
            "rgb",
            "spectrum",
            "\"checkerboard\" \"texture tex2\" \"k\" \"integer dimension\" 3",
            2,
        ),
    ] {
        let text = format!("{child} Texture \"t\" \"{class}\" {rest}");
        let list = textures(head, &text, class).unwrap_or_else(|e| panic!("{e}"));
        let mut used = Vec::new();
        // The last one is that of the material, or it is the child itself.
        let last = if rest.contains("inside\" \"k\" \"texture outside\" \"k\"") {
            1
        } else {
            list.len() as u32 - 1
        };
        Param::Texture(last).visit(&list, &mut |i, _| used.push(i));
        used.sort();
        used.dedup();
        assert_eq!(used.len(), count, "{rest}");
    }
}

#[test]
fn transforms_of_the_directive_and_no_other() {
    let placed = "Translate 1 0 0 Scale 2 4 8";
    let to_texture = |head: &str, class: &str, rest: &str| {
        let text = format!("{placed} Texture \"t\" \"{class}\" {rest}");
        let mut list = textures(head, &text, class).unwrap_or_else(|e| panic!("{e}"));
        *list[0].to_texture_mut().expect("a map")
    };
    let inverse = [
        [0.5, 0.0, 0.0, -0.25],
        [0.0, 0.25, 0.0, 0.125],
        [0.0, 0.0, 0.125, 0.0],
    ];
    // pbrt-v3 looks points up in the image of the world under the transform, not under its inverse.
    let forward = [
        [2.0, 0.0, 0.0, 2.0],
        [0.0, 4.0, 0.0, 2.0],
        [0.0, 0.0, 8.0, 0.0],
    ];
    for kind in [
        "\"fbm\"",
        "\"wrinkled\"",
        "\"windy\"",
        "\"checkerboard\" \"integer dimension\" 3",
    ] {
        assert_eq!(to_texture("rgb", "float", kind), inverse, "{kind}");
        assert_eq!(to_texture("image", "float", kind), forward, "{kind}");
    }
    for head in ["rgb", "image"] {
        for mapping in ["spherical", "cylindrical"] {
            for kind in ["checkerboard", "dots", "bilerp"] {
                let rest = format!("\"{kind}\" \"string mapping\" \"{mapping}\"");
                assert_eq!(to_texture(head, "float", &rest), inverse, "{rest}");
            }
        }
    }
    let plane = |head: &str, ty: &str| {
        to_texture(
            head,
            "float",
            &format!(
                "\"bilerp\" \"string mapping\" \"planar\" \"{ty} v1\" [4 0 0] \"{ty} v2\" [0 0 8] \"float udelta\" 3 \"float vdelta\" 5"
            ),
        )
    };
    let zero = [0.0; 4];
    assert_eq!(
        plane("rgb", "vector3"),
        [[2.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 5.0], zero]
    );
    // In v3 planes are in world space.
    assert_eq!(
        plane("image", "vector"),
        [[4.0, 0.0, 0.0, 5.0], [0.0, 0.0, 8.0, 5.0], zero]
    );
    // Cylinders of v3 look at directions.
    for (head, want) in [("image", true), ("rgb", false)] {
        let texture = one(head, "float", "\"dots\" \"string mapping\" \"cylindrical\"");
        let Some(&Mapping::Cylindrical { unit, .. }) = texture.mapping() else {
            panic!("cylindrical")
        };
        assert_eq!(unit, want);
    }
}

/// Meshes without texture coordinates get their own for each triangle only where a texture looks at
/// them.
#[test]
fn points_need_no_texture_coordinates() {
    let vertices = |texture: &str| {
        let world = format!(
            "Texture \"t\" \"spectrum\" {texture} Material \"diffuse\" \"texture reflectance\" \"t\" \
             Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0  1 1 0] \"integer indices\" [0 1 2 1 3 2]"
        );
        try_load("rgb", &world).expect("loads").vertices.len()
    };
    assert_eq!(vertices("\"marble\""), 4);
    assert_eq!(vertices("\"dots\" \"string mapping\" \"planar\""), 4);
    assert_eq!(vertices("\"directionmix\""), 4);
    assert_eq!(vertices("\"dots\""), 6);
    let child = "\"checkerboard\" \"integer dimension\" 3 \"texture tex1\" \"c\"";
    let inner = format!("\"bilerp\" Texture \"t\" \"spectrum\" {child}").replace("\"c\"", "\"t\"");
    assert_eq!(vertices(&inner), 6);
}

/// What a shape of v3 says about its material may be a texture.
#[test]
fn shapes_override_with_textures() {
    let s = try_load(
        "image",
        "Texture \"a\" \"spectrum\" \"marble\" Texture \"r\" \"float\" \"wrinkled\" \
         Material \"plastic\" \"rgb Kd\" [.1 .2 .3] \
         Shape \"sphere\" \"texture Kd\" \"a\" \"texture roughness\" \"r\" Shape \"sphere\"",
    )
    .expect("loads");
    assert_eq!(s.warnings, [""; 0]);
    let plastic = |shape: usize| {
        let kind = &s.materials[s.shapes[shape].material as usize].kind;
        let plastic: &PlasticMaterial = kind.get().expect("plastic");
        (plastic.diffuse, plastic.roughness.u)
    };
    assert_eq!(plastic(0), (Param::Texture(0), Param::Texture(1)));
    assert_eq!(
        plastic(1),
        (Param::Constant([0.1, 0.2, 0.3]), Param::Constant([0.1; 3]))
    );
}

/// Every parameter of a material that pbrt looks up as a texture.
#[test]
fn every_parameter_may_be_a_texture() {
    let v3 = [
        ("matte", &["Kd:s", "sigma:f"][..]),
        ("mirror", &["Kr:s"]),
        (
            "metal",
            &[
                "eta:s",
                "k:s",
                "roughness:f",
                "uroughness:f",
                "vroughness:f",
            ],
        ),
        ("plastic", &["Kd:s", "Ks:s", "roughness:f"]),
        (
            "glass",
            &[
                "Kr:s",
                "Kt:s",
                "eta:f",
                "index:f",
                "uroughness:f",
                "vroughness:f",
            ],
        ),
        (
            "substrate",
            &["Kd:s", "Ks:s", "uroughness:f", "vroughness:f"],
        ),
        ("translucent", &["Kd:s", "reflect:s", "transmit:s"]),
    ];
    let v4 = [
        ("diffuse", &["reflectance:s"][..]),
        (
            "conductor",
            &[
                "eta:s",
                "k:s",
                "roughness:f",
                "uroughness:f",
                "vroughness:f",
            ],
        ),
        ("conductor", &["reflectance:s"]),
        (
            "dielectric",
            &["roughness:f", "uroughness:f", "vroughness:f"],
        ),
        ("diffusetransmission", &["reflectance:s", "transmittance:s"]),
    ];
    for (head, list) in [("image", &v3[..]), ("rgb", &v4[..])] {
        for (material, parameters) in list {
            for parameter in *parameters {
                let (name, class) = parameter.split_once(':').expect("a class");
                let extra = match (*material, name) {
                    ("translucent", _) => "\"rgb Ks\" [0 0 0]",
                    _ => "",
                };
                let world = format!(
                    "Texture \"s\" \"spectrum\" \"bilerp\" Texture \"f\" \"float\" \"bilerp\" \
                     Material \"{material}\" \"texture {name}\" \"{class}\" {extra} Shape \"sphere\""
                );
                let s = try_load(head, &world).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(s.warnings, [""; 0], "{material} {name}");
                let used = format!("Texture({})", if class == "s" { 0 } else { 1 });
                let kind = format!("{:?}", s.materials[0].kind);
                assert!(kind.contains(&used), "{material} {name}: {kind}");
                let world = crate::transport::World::new(&s, 2);
                assert!(world.materials.entries[0].textured && world.wanted.uv);
            }
        }
    }
}
