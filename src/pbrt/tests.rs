//! Whole scenes, from text to tables.

mod coats;
mod files;
mod framing;
mod generated;
mod geometry;
mod lenience;
mod lights;
mod names;
mod quads;
mod shapes;
mod space;
mod tolerance;
mod unsupported;
mod view;

use crate::surface::{
    ConductorFresnel, ConductorMaterial, DielectricMaterial, DiffuseMaterial,
    DiffuseTransmissionMaterial, MirrorMaterial, PlasticMaterial, SubstrateMaterial,
    ThinDielectricMaterial,
};
use std::f32::consts::FRAC_PI_4;
use std::path::Path;

use glam::{Vec2, Vec3};
use proptest::prelude::*;

use super::load_str;
use crate::scene::*;

fn try_load(text: &str) -> Result<Scene, String> {
    load_str(text, "t.pbrt", Path::new("/nonexistent")).map_err(|e| e.to_string())
}

fn loaded(text: &str) -> Scene {
    match try_load(text) {
        Ok(scene) => scene,
        Err(e) => panic!("{e}\nin\n{text}"),
    }
}

fn v3(world: &str) -> Scene {
    loaded(&format!("Film \"image\"\nWorldBegin\n{world}\nWorldEnd\n"))
}

fn v4(world: &str) -> Scene {
    loaded(&format!("Film \"rgb\"\nWorldBegin\n{world}\n"))
}

/// The message for a v4 world, whose first line is line 3.
fn v4_error(world: &str) -> String {
    try_load(&format!("Film \"rgb\"\nWorldBegin\n{world}\n")).expect_err("an error")
}

fn v3_error(world: &str) -> String {
    try_load(&format!("Film \"image\"\nWorldBegin\n{world}\nWorldEnd\n")).expect_err("an error")
}

/// A triangle in the plane z = 0 whose front is +z.
const V4_TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0  1 0 0  0 1 0]";

const V3_TRIANGLE: &str =
    "Shape \"trianglemesh\" \"point P\" [0 0 0  1 0 0  0 1 0] \"integer indices\" [0 1 2]";

/// World-space corners of a triangle.
fn corners(scene: &Scene, triangle: usize) -> [Vec3; 3] {
    scene.triangles[triangle].v.map(|i| {
        let p = Vec3::from(scene.vertices[i as usize].p).as_dvec3();
        (p / scene.space.scale + scene.space.centre).as_vec3()
    })
}

fn front(scene: &Scene, triangle: usize) -> Vec3 {
    let [a, b, c] = corners(scene, triangle);
    (b - a).cross(c - a).normalize()
}

fn near(a: Vec3, b: Vec3) {
    assert!(
        (a - b).length() < 1e-5 * b.length().max(1.0),
        "{a} is not {b}"
    );
}

fn material(scene: &Scene) -> &MaterialKind {
    &scene.materials[scene.shapes[0].material as usize].kind
}

// Materials and textures.

#[test]
fn materials_of_v3() {
    let grey = |x: f32| Param::Constant([x; 3]);
    let kind = |text: &str| material(&v3(&format!("{text} {V3_TRIANGLE}"))).clone();
    assert_eq!(
        kind(""),
        MaterialKind::from(DiffuseMaterial {
            reflectance: grey(0.5),
            sigma: grey(0.0)
        })
    );
    assert_eq!(
        kind("Material \"matte\" \"color Kd\" [.1 .2 .3] \"float sigma\" 20"),
        MaterialKind::from(DiffuseMaterial {
            reflectance: Param::Constant([0.1, 0.2, 0.3]),
            sigma: grey(20.0)
        })
    );
    assert_eq!(
        kind("Material \"mirror\""),
        MaterialKind::from(MirrorMaterial {
            reflectance: grey(0.9)
        })
    );
    assert_eq!(
        kind("Material \"plastic\" \"float roughness\" [.3]"),
        MaterialKind::from(PlasticMaterial {
            diffuse: grey(0.25),
            specular: grey(0.25),
            roughness: Roughness {
                u: grey(0.3),
                v: grey(0.3),
                remap: Remap::V3
            }
        })
    );
    assert_eq!(
        kind("Material \"glass\" \"float index\" 1.3"),
        MaterialKind::from(DielectricMaterial {
            reflectance: grey(1.0),
            transmittance: grey(1.0),
            eta: grey(1.3),
            dispersion: None,
            roughness: Roughness {
                u: grey(0.0),
                v: grey(0.0),
                remap: Remap::V3
            }
        })
    );
    let metal =
        kind("Material \"metal\" \"float uroughness\" .2 \"bool remaproughness\" \"false\"");
    let metal: &ConductorMaterial = metal.get().expect("a conductor");
    assert_eq!(
        metal.roughness,
        Roughness {
            u: grey(0.2),
            v: grey(0.01),
            remap: Remap::None
        }
    );
    for (given, u, remap) in [
        ("", 0.1, Remap::V3),
        (
            "\"float uroughness\" .2 \"bool remaproughness\" \"false\"",
            0.2,
            Remap::None,
        ),
    ] {
        assert_eq!(
            kind(&format!("Material \"substrate\" {given}")),
            MaterialKind::from(SubstrateMaterial {
                diffuse: grey(0.5),
                specular: grey(0.5),
                roughness: Roughness {
                    u: grey(u),
                    v: grey(0.1),
                    remap
                }
            })
        );
    }
    let s = v3(&format!(
        "Material \"substrate\" \"float roughness\" .1 {V3_TRIANGLE}"
    ));
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
    assert_eq!(
        kind(
            "Material \"translucent\" \"rgb Ks\" [0 0 0] \"rgb transmit\" [.1 .2 .3] \"float roughness\" .2"
        ),
        MaterialKind::from(DiffuseTransmissionMaterial {
            reflectance: [grey(0.25), grey(0.5)],
            transmittance: [grey(0.25), Param::Constant([0.1, 0.2, 0.3])],
            scale: 1.0
        })
    );
    assert_eq!(kind("Material \"\""), MaterialKind::Interface);
    assert_eq!(kind("Material \"none\""), MaterialKind::Interface);
}

/// The components of the material of the only shape, with their weights.
fn components(scene: &Scene) -> Vec<(MaterialKind, Weight)> {
    let MaterialKind::Mixture { components } = material(scene) else {
        panic!("{:?}", material(scene));
    };
    let kind = |c: &Component| scene.materials[c.material as usize].kind.clone();
    components.iter().map(|c| (kind(c), c.weight)).collect()
}

#[test]
fn mixtures_of_both_dialects() {
    let matte = |x: f32| {
        MaterialKind::from(DiffuseMaterial {
            reflectance: Param::Constant([x; 3]),
            sigma: Param::Constant([0.0; 3]),
        })
    };
    let amount = Param::Constant([0.1, 0.2, 0.3]);
    let v3_mix = "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 1 1]
        MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0]
        Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\"";
    let s = v3(&format!("{v3_mix} \"rgb amount\" [.1 .2 .3] {V3_TRIANGLE}"));
    assert_eq!(
        components(&s),
        [
            (matte(1.0), Weight::Amount(amount)),
            (matte(0.0), Weight::Rest(amount))
        ]
    );
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    // A shape's own amount comes first; components are shared.
    let s = v3(&format!(
        "{v3_mix} {V3_TRIANGLE} {V3_TRIANGLE} \"rgb amount\" [.1 .2 .3] {V3_TRIANGLE}"
    ));
    assert_eq!(s.materials.len(), 4);
    let half = Param::Constant([0.5; 3]);
    let s = v4(&format!(
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [1 1 1]
         MakeNamedMaterial \"b\" \"string type\" \"diffuse\" \"rgb reflectance\" [0 0 0]
         Material \"mix\" \"string materials\" [ \"a\" \"b\" ] {V4_TRIANGLE}"
    ));
    assert_eq!(
        components(&s),
        [
            (matte(1.0), Weight::Rest(half)),
            (matte(0.0), Weight::Amount(half))
        ]
    );
}

#[test]
fn mixtures_that_cannot_be_made() {
    let a = "MakeNamedMaterial \"a\" \"string type\" \"matte\"\n";
    let error = v3_error(&format!(
        "{a}MakeNamedMaterial \"b\" \"string type\" \"none\"\nMaterial \"mix\" \"string namedmaterial1\" \"b\" \"string namedmaterial2\" \"a\"\n{V3_TRIANGLE}"
    ));
    let expected =
        "t.pbrt:5:16: Material \"mix\": parameter \"namedmaterial1\": \"b\" lets rays pass";
    assert!(error.starts_with(expected), "{error}");
    let error = v4_error(&format!(
        "Material \"mix\" \"string materials\" \"a\" {V4_TRIANGLE}"
    ));
    let expected =
        "t.pbrt:3:16: Material \"mix\": parameter \"materials\": expected the names of 2";
    assert!(error.starts_with(expected), "{error}");
    // Nested once too often.
    let nested = |n: usize| {
        let mut text = format!("{a}MakeNamedMaterial \"m0\" \"string type\" \"matte\"\n");
        for i in 1..=n {
            text += &format!(
                "MakeNamedMaterial \"m{i}\" \"string type\" \"mix\" \"string namedmaterial1\" \"m{}\" \"string namedmaterial2\" \"a\"\n",
                i - 1
            );
        }
        format!("{text}NamedMaterial \"m{n}\" {V3_TRIANGLE}")
    };
    v3(&nested(MAX_NESTING));
    let error = v3_error(&nested(MAX_NESTING + 1));
    assert!(error.contains("nested more than"), "{error}");
}

#[test]
fn uber_and_translucent_are_mixtures() {
    let grey = |x: f32| Param::Constant([x; 3]);
    let of = |text: &str| v3(&format!("Material {text} {V3_TRIANGLE}"));
    let diffuse = MaterialKind::from(DiffuseMaterial {
        reflectance: grey(0.25),
        sigma: grey(0.0),
    });
    let s = of("\"uber\"");
    let parts = components(&s);
    assert_eq!(parts.len(), 2);
    assert_eq!(parts[0], (diffuse.clone(), Weight::Amount(grey(1.0))));
    let Some(DielectricMaterial {
        reflectance,
        transmittance,
        eta,
        dispersion: None,
        roughness,
    }) = parts[1].0.get().cloned()
    else {
        panic!("{parts:?}");
    };
    assert_eq!(
        [reflectance, transmittance, eta, roughness.u, roughness.v],
        [grey(0.25), grey(0.0), grey(1.5), grey(0.1), grey(0.1)]
    );
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    // Black lobes are left out, and what is left alone is no mixture.
    assert_eq!(*material(&of("\"uber\" \"rgb Ks\" [0 0 0]")), diffuse);
    let s = of(
        "\"uber\" \"rgb Kr\" [.1 .1 .1] \"rgb Kt\" [.2 .2 .2] \"float index\" 1.3 \"rgb opacity\" [.5 .6 .7]",
    );
    let parts = components(&s);
    assert_eq!(parts.len(), 4);
    let opacity = Param::Constant([0.5, 0.6, 0.7]);
    assert_eq!(parts[0].1, Weight::Rest(opacity));
    assert!(parts[1..].iter().all(|p| p.1 == Weight::Amount(opacity)));
    let glass = parts[3].0.get::<DielectricMaterial>();
    assert!(glass.is_some_and(|glass| glass.eta == grey(1.3)));
    let parts = components(&of("\"translucent\" \"rgb Ks\" [.1 .2 .3]"));
    assert_eq!(parts[0].1, Weight::ONE);
    assert_eq!(parts[1].1, Weight::Amount(Param::Constant([0.1, 0.2, 0.3])));
}

#[test]
fn materials_of_v4() {
    let grey = |x: f32| Param::Constant([x; 3]);
    let kind = |text: &str| material(&v4(&format!("{text} {V4_TRIANGLE}"))).clone();
    assert_eq!(
        kind(""),
        MaterialKind::from(DiffuseMaterial {
            reflectance: grey(0.5),
            sigma: grey(0.0)
        })
    );
    assert_eq!(
        kind(
            "MakeNamedMaterial \"m\" \"string type\" \"conductor\" \"rgb reflectance\" [.8 .8 .8] NamedMaterial \"m\""
        ),
        MaterialKind::from(ConductorMaterial {
            fresnel: ConductorFresnel::Reflectance(grey(0.8)),
            roughness: Roughness {
                u: grey(0.0),
                v: grey(0.0),
                remap: Remap::V4
            }
        })
    );
    assert_eq!(
        kind("Material \"dielectric\" \"float eta\" 1.7"),
        MaterialKind::from(DielectricMaterial {
            reflectance: grey(1.0),
            transmittance: grey(1.0),
            eta: grey(1.7),
            dispersion: None,
            roughness: Roughness {
                u: grey(0.0),
                v: grey(0.0),
                remap: Remap::V4
            }
        })
    );
    assert_eq!(kind("Material \"interface\""), MaterialKind::Interface);
    for (eta, index) in [
        ("", 1.5),
        ("\"float eta\" 1.3", 1.3),
        ("\"float eta\" 0", 1.0),
    ] {
        assert_eq!(
            kind(&format!("Material \"thindielectric\" {eta}")),
            MaterialKind::from(ThinDielectricMaterial {
                eta: grey(index),
                dispersion: None
            })
        );
    }
    assert_eq!(
        kind("Material \"diffusetransmission\" \"rgb transmittance\" [.1 .2 .3] \"float scale\" 2"),
        MaterialKind::from(DiffuseTransmissionMaterial {
            reflectance: [grey(0.25), grey(1.0)],
            transmittance: [Param::Constant([0.1, 0.2, 0.3]), grey(1.0)],
            scale: 2.0
        })
    );
    // Sheets have no roughness.
    let s = v4(&format!(
        "Material \"thindielectric\" \"float roughness\" .1 {V4_TRIANGLE}"
    ));
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
}

/// v3's glass has a roughness per axis only, v4's one for both as well.
#[test]
fn rough_glass_of_both_dialects() {
    let grey = |x: f32| Param::Constant([x; 3]);
    let roughness = |scene: &Scene| {
        let glass: Option<&DielectricMaterial> = material(scene).get();
        glass.expect("glass").roughness
    };
    let of_v3 = |text: &str| v3(&format!("Material \"glass\" {text} {V3_TRIANGLE}"));
    let of_v4 = |text: &str| v4(&format!("Material \"dielectric\" {text} {V4_TRIANGLE}"));
    let expected = |u: f32, v: f32, remap: Remap| Roughness {
        u: grey(u),
        v: grey(v),
        remap,
    };
    let both = "\"float uroughness\" .2 \"float vroughness\" [.3]";
    assert_eq!(roughness(&of_v3(both)), expected(0.2, 0.3, Remap::V3));
    assert_eq!(roughness(&of_v4(both)), expected(0.2, 0.3, Remap::V4));
    let one = "\"float vroughness\" .2 \"bool remaproughness\" \"false\"";
    assert_eq!(roughness(&of_v3(one)), expected(0.0, 0.2, Remap::None));
    assert_eq!(
        roughness(&of_v4(
            "\"float roughness\" .1 \"float vroughness\" .2 \"bool remaproughness\" false"
        )),
        expected(0.1, 0.2, Remap::None)
    );
    let s = of_v3("\"float roughness\" .2");
    assert_eq!(roughness(&s), expected(0.0, 0.0, Remap::V3));
    assert_eq!(
        s.warnings,
        ["t.pbrt:3:18: Material \"glass\": unknown parameter \"roughness\" ignored"]
    );
    let s = v4(&format!(
        "Texture \"r\" \"float\" \"checkerboard\" Material \"dielectric\" \"texture roughness\" \"r\" {V4_TRIANGLE}"
    ));
    assert_eq!(roughness(&s).u, Param::Texture(0));
    assert_eq!(roughness(&s).v, Param::Texture(0));
}

#[test]
fn shapes_of_v3_override_material_parameters() {
    let s = v3(&format!(
        "Material \"matte\" \"rgb Kd\" [.1 .1 .1] \"float sigma\" 5 {V3_TRIANGLE} \"rgb Kd\" [.9 .9 .9] {V3_TRIANGLE}"
    ));
    let grey = |x: f32| Param::Constant([x; 3]);
    let kind = |shape: usize| s.materials[s.shapes[shape].material as usize].kind.clone();
    assert_eq!(
        kind(0),
        MaterialKind::from(DiffuseMaterial {
            reflectance: grey(0.9),
            sigma: grey(5.0)
        })
    );
    assert_eq!(
        kind(1),
        MaterialKind::from(DiffuseMaterial {
            reflectance: grey(0.1),
            sigma: grey(5.0)
        })
    );
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    // In v4 it is a parameter nobody knows.
    assert_eq!(
        v4(&format!("{V4_TRIANGLE} \"rgb Kd\" [1 1 1]"))
            .warnings
            .len(),
        1
    );
}
