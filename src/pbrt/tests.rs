//! Whole scenes, from text to tables.

mod framing;
mod quads;
mod tolerance;

use std::f32::consts::FRAC_PI_4;
use std::path::Path;

use glam::{Vec2, Vec3};
use proptest::prelude::*;

use super::load_str;
use crate::scene::*;
use crate::surface::{
    CoatLayer, CoatMaterial, CoatedConductorMaterial, CoatedDiffuseMaterial, ConductorFresnel,
    ConductorMaterial, DielectricMaterial, DiffuseMaterial, DiffuseTransmissionMaterial,
    MirrorMaterial, PlasticMaterial, SubstrateMaterial, ThinDielectricMaterial,
};

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

// Space and geometry.

#[test]
fn internal_space_is_centred_and_of_unit_size() {
    for shift in [0.0, 1e3, 1e6] {
        for size in [1e-4, 1.0, 1e6] {
            let s = v4(&format!(
                "Translate {shift} 0 0 Scale {size} {size} {size} {V4_TRIANGLE} Shape \"sphere\" \"float radius\" 2"
            ));
            let radius = (s.bounds[1] - s.bounds[0]).length() / 2.0;
            assert!((0.49..=1.01).contains(&radius), "{radius}");
            assert!((s.bounds[0] + s.bounds[1]).length() < 1e-6);
            assert_eq!(s.space.scale.log2().fract(), 0.0);
            near(
                corners(&s, 0)[1],
                Vec3::new(shift as f32 + size as f32, 0.0, 0.0),
            );
        }
    }
}

/// Neither the window in units of the scene nor its area is one that `f32` holds.
#[test]
fn windows_out_of_proportion_are_refused() {
    for (window, radius, good) in [
        ("-1 1e30 2 1", "1e-30", false),
        ("-1 1 -1 1", "1e-6", true),
        ("0 1e-20 0 1", "1", false),
    ] {
        let text = format!(
            "Film \"rgb\" Camera \"orthographic\" \"float screenwindow\" [{window}] WorldBegin Shape \"sphere\" \"float radius\" {radius}"
        );
        assert_eq!(try_load(&text).is_ok(), good, "{window}");
    }
}

#[test]
fn texture_coordinates_beyond_f32_are_left_out() {
    let s = v4(&format!("{V4_TRIANGLE} \"point2 uv\" [1e100 0 .5 .5 1 1]"));
    assert_eq!([s.vertices[0].uv, s.vertices[1].uv], [[0.0; 2], [0.5; 2]]);
}

/// The sphere's size is less than the distance of neighbouring `f64` where it is.
#[test]
fn spheres_beyond_the_digits_of_f64_fit_into_the_space() {
    for place in [
        "Translate 0 -3e38 -1e10 Scale 1 1e10 -2",
        "Translate 1e-20 1e-6 0 Scale 1e-30 1e-30 1e-30",
    ] {
        let s = v4(&format!("{place} Shape \"sphere\""));
        assert!(
            s.bounds.iter().all(|b| b.length() <= 1.001),
            "{:?}",
            s.bounds
        );
        assert!(s.bounds[1].length() >= 0.5);
    }
}

#[test]
fn far_scenes_keep_the_digits_of_the_text() {
    // Neighbouring vertices that f32 could not tell apart at this distance.
    let s = v4(
        "Shape \"trianglemesh\" \"point3 P\" [1000000.001 0 0  1000000.002 0 0  1000000.001 0.001 0]",
    );
    let [a, b, _] = s.triangles[0]
        .v
        .map(|i| Vec3::from(s.vertices[i as usize].p));
    let edge = f64::from((b - a).length()) / s.space.scale;
    assert!((edge - 0.001).abs() < 1e-9, "{edge}");
}

#[test]
fn transforms_apply_in_reading_order() {
    let s = v4(&format!(
        "Translate 1 2 3 Rotate 90 0 0 1 Scale 2 1 1 {V4_TRIANGLE}"
    ));
    let [a, b, c] = corners(&s, 0);
    near(a, Vec3::new(1.0, 2.0, 3.0));
    near(b, Vec3::new(1.0, 4.0, 3.0));
    near(c, Vec3::new(0.0, 2.0, 3.0));
    let s = v4(&format!(
        "Translate 9 9 9 CoordinateSystem \"here\" Transform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1] ConcatTransform 1 0 0 0 0 1 0 0 0 0 1 0 1 0 0 1 {V4_TRIANGLE} CoordSysTransform \"here\" {V4_TRIANGLE} Identity {V4_TRIANGLE}"
    ));
    near(corners(&s, 0)[0], Vec3::new(6.0, 6.0, 7.0));
    near(corners(&s, 1)[0], Vec3::splat(9.0));
    near(corners(&s, 2)[0], Vec3::ZERO);
}

#[test]
fn blocks_restore_what_they_save() {
    let s = v3(&format!(
        "Material \"mirror\" AttributeBegin Material \"glass\" Translate 1 0 0 TransformBegin Translate 1 0 0 ReverseOrientation {V3_TRIANGLE} TransformEnd {V3_TRIANGLE} AttributeEnd {V3_TRIANGLE}"
    ));
    near(corners(&s, 0)[0], Vec3::new(2.0, 0.0, 0.0));
    near(corners(&s, 1)[0], Vec3::new(1.0, 0.0, 0.0));
    near(corners(&s, 2)[0], Vec3::ZERO);
    // A transform block saves the transform only.
    near(front(&s, 1), Vec3::NEG_Z);
    near(front(&s, 2), Vec3::Z);
    let kind = |shape: usize| &s.materials[s.shapes[shape].material as usize].kind;
    assert!(kind(1).get::<DielectricMaterial>().is_some());
    assert!(kind(2).get::<MirrorMaterial>().is_some());
}

#[test]
fn orientation_without_normals() {
    // The front is the image of the front, turned round by ReverseOrientation.
    for (set, expected) in [
        ("", Vec3::Z),
        ("Scale -1 1 1", Vec3::Z),
        ("Scale 1 1 -1", Vec3::NEG_Z),
        ("ReverseOrientation", Vec3::NEG_Z),
        ("ReverseOrientation ReverseOrientation", Vec3::Z),
        ("Scale -1 1 1 ReverseOrientation", Vec3::NEG_Z),
        ("Rotate 180 0 1 0", Vec3::NEG_Z),
    ] {
        near(front(&v4(&format!("{set} {V4_TRIANGLE}")), 0), expected);
        near(front(&v3(&format!("{set} {V3_TRIANGLE}")), 0), expected);
    }
}

#[test]
fn orientation_follows_given_normals() {
    let mesh = |n: &str| format!("{V4_TRIANGLE} \"normal N\" [{n} {n} {n}]");
    for (set, n, expected) in [
        ("", "0 0 1", Vec3::Z),
        ("", "0 0 -1", Vec3::NEG_Z),
        ("ReverseOrientation", "0 0 1", Vec3::NEG_Z),
        ("Scale -1 1 1", "0 0 1", Vec3::Z),
        ("Scale 1 1 -1", "0 0 1", Vec3::NEG_Z),
        // No normals to follow: the rule without them.
        ("Scale 1 1 -1 ReverseOrientation", "0 0 0", Vec3::Z),
    ] {
        let s = v4(&format!("{set} {}", mesh(n)));
        near(front(&s, 0), expected);
        if n != "0 0 0" {
            near(Vec3::from(s.vertices[0].n), expected);
        }
    }
}

#[test]
fn normals_transform_by_the_inverse_transpose() {
    let s = v4(&format!(
        "Scale 1 1 2 {V4_TRIANGLE} \"normal N\" [0 1 1 0 1 1 0 1 1]"
    ));
    near(
        Vec3::from(s.vertices[0].n).normalize(),
        Vec3::new(0.0, 1.0, 0.5).normalize(),
    );
}

#[test]
fn spheres() {
    let s = v4(
        "Translate 1 2 3 Scale -1 2 1 Shape \"sphere\" \"float radius\" 3 ReverseOrientation Shape \"sphere\"",
    );
    assert_eq!(s.spheres.len(), 2);
    // Under a mirror the outside is still the front.
    assert_eq!(s.spheres[0].facing, 1.0);
    assert_eq!(s.spheres[1].facing, -1.0);
    let m = s.spheres[0].to_world;
    assert!((f64::from(m[1][1]) / s.space.scale - 6.0).abs() < 1e-5);
    for sphere in &s.spheres {
        for i in 0..3 {
            for j in 0..3 {
                let product: f32 = (0..3)
                    .map(|k| sphere.to_world[i][k] * sphere.to_unit[k][j])
                    .sum();
                assert!((product - f32::from(i == j)).abs() < 1e-6);
            }
        }
    }
    let error = v4_error("Shape \"sphere\" \"float zmax\" 0.5");
    assert!(
        error.starts_with("t.pbrt:3:1: Shape \"sphere\": partial spheres"),
        "{error}"
    );
}

#[test]
fn texture_coordinates_by_default() {
    // Shared vertices cannot have the coordinates (0,0) (1,0) (1,1) of each triangle; only what looks at them pays.
    let quad = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 1 1 0 0 1 0] \"integer indices\" [0 1 2 0 2 3]";
    assert_eq!(v4(quad).vertices.len(), 4);
    let s = v4(&format!(
        "Texture \"c\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"c\" {quad}"
    ));
    assert_eq!(s.vertices.len(), 6);
    let uvs: Vec<_> = s.vertices[3..].iter().map(|v| Vec2::from(v.uv)).collect();
    assert_eq!(uvs, [Vec2::ZERO, Vec2::X, Vec2::ONE]);
}

#[test]
fn degenerate_triangles_are_dropped_and_counted() {
    let s = v4(
        "AreaLightSource \"diffuse\" Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 2 0 0] \"integer indices\" [0 1 3 0 1 1 0 1 2]",
    );
    assert_eq!((s.triangles.len(), s.lights.len()), (1, 1));
    assert_eq!(
        s.warnings,
        ["t.pbrt:3:27: Shape \"trianglemesh\": 2 triangles without area dropped"]
    );
    let s = v4("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 2 0 0]");
    assert!(s.triangles.is_empty() && s.shapes.is_empty());
}

#[test]
fn instances() {
    let s = v3(&format!(
        "Translate 0 0 1 ObjectBegin \"o\" Translate 1 0 0 {V3_TRIANGLE} Shape \"sphere\" ObjectEnd \
         ObjectInstance \"o\" Scale -1 1 1 ObjectInstance \"o\" {V3_TRIANGLE}"
    ));
    assert_eq!(
        (s.triangles.len(), s.spheres.len(), s.shapes.len()),
        (3, 2, 5)
    );
    // The transform at the instance after the one at the definition.
    near(corners(&s, 0)[0], Vec3::new(1.0, 0.0, 2.0));
    near(corners(&s, 1)[0], Vec3::new(-1.0, 0.0, 2.0));
    for i in 0..3 {
        near(front(&s, i), Vec3::Z);
    }
    for (i, t) in s.triangles.iter().enumerate() {
        assert_eq!(s.shapes[t.shape as usize].first as usize, i);
    }
    assert!(s.spheres.iter().all(|x| x.facing == 1.0));
}

#[test]
fn lights_in_objects_are_dropped_with_a_warning() {
    let s = v4(&format!(
        "ObjectBegin \"o\" AreaLightSource \"diffuse\" {V4_TRIANGLE} {V4_TRIANGLE} ObjectEnd ObjectInstance \"o\""
    ));
    assert!(s.lights.is_empty() && s.shapes.iter().all(|x| x.light == NONE));
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
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

#[test]
fn what_is_not_supported_says_so_where_it_stands() {
    for (text, expected) in [
        (
            format!("Material \"coateddiffuse\" \"rgb albedo\" [.5 .5 .5] {V4_TRIANGLE}"),
            "t.pbrt:3:1: Material \"coateddiffuse\": a coat that scatters",
        ),
        (
            format!(
                "MakeNamedMaterial \"a\" \"string type\" \"hair\" NamedMaterial \"a\" {V4_TRIANGLE}"
            ),
            "t.pbrt:3:1: MakeNamedMaterial \"a\" of type \"hair\": this material is not supported; use ",
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
            "MediumInterface \"fog\" \"\"".into(),
            "t.pbrt:3:1: MediumInterface: participating media are not supported",
        ),
        (
            "LightSource \"projection\"".into(),
            "t.pbrt:3:1: LightSource \"projection\": needs an image, \"string ",
        ),
        (
            "Shape \"curve\"".into(),
            "t.pbrt:3:1: Shape \"curve\": this shape is not supported; use",
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
    let error = v3_error(&format!("Material \"disney\" {V3_TRIANGLE}"));
    assert!(
        error.starts_with(
            "t.pbrt:3:1: Material \"disney\": this material is not supported; use uber"
        ),
        "{error}"
    );
    let checks = "Texture \"c\" \"float\" \"checkerboard\"";
    for (text, expected) in [
        (
            format!("Material \"matte\" \"texture displacement\" \"b\" {V3_TRIANGLE}"),
            "t.pbrt:3:18: Material \"matte\": parameter \"displacement\": is of pbrt-v4; use \"bumpmap\"",
        ),
        (
            format!("Material \"matte\" \"string normalmap\" \"b\" {V3_TRIANGLE}"),
            "t.pbrt:3:18: Material \"matte\": parameter \"normalmap\": is of pbrt-v4; use \"bumpmap\"",
        ),
        (
            format!("{checks}\n{V3_TRIANGLE} \"texture shadowalpha\" \"c\""),
            "t.pbrt:4:80: Shape \"trianglemesh\": parameter \"shadowalpha\": shadows other than",
        ),
        (
            format!("{V3_TRIANGLE} \"float shadowalpha\" 0"),
            "t.pbrt:3:80: Shape \"trianglemesh\": parameter \"shadowalpha\": shadows other than",
        ),
    ] {
        let error = v3_error(&text);
        assert!(error.starts_with(expected), "{error}\nexpected\n{expected}");
    }
}

#[test]
fn cut_outs() {
    let checks = "Texture \"c\" \"float\" \"checkerboard\"";
    let s = v4(&format!(
        "{checks}\n{V4_TRIANGLE} \"texture alpha\" \"c\"\n{V4_TRIANGLE} \"float alpha\" 0.5\n{V4_TRIANGLE} \"float alpha\" 1\n\
         {V4_TRIANGLE} \"float alpha\" 0\nShape \"sphere\" \"float alpha\" 0.5"
    ));
    let alphas: Vec<u32> = s.shapes.iter().map(|s| s.alpha).collect();
    assert_eq!(alphas, [0, 1, NONE, 1]);
    assert_eq!(s.alphas[0].value, Param::Texture(0));
    assert!(s.alphas.iter().all(|a| a.test == AlphaTest::Fraction));
    // Textures of cut-outs have texture coordinates to go by.
    assert_eq!(s.vertices[s.triangles[0].v[2] as usize].uv, [1.0, 1.0]);
    let s = v3(&format!(
        "{checks}\n{V3_TRIANGLE} \"texture alpha\" \"c\" \"texture shadowalpha\" \"c\"\n{V3_TRIANGLE} \"float alpha\" 0.5\n\
         {V3_TRIANGLE} \"float alpha\" 0 \"float shadowalpha\" 0"
    ));
    assert_eq!(s.shapes.len(), 2);
    assert_eq!(s.shapes[1].alpha, NONE);
    assert_eq!(s.alphas[0].test, AlphaTest::NotZero);
    // Only meshes have it in v3.
    let s = v3("Shape \"sphere\" \"float alpha\" 0");
    assert_eq!((s.spheres.len(), s.warnings.len()), (1, 1));
}

#[test]
fn bump_maps() {
    let checks = "Texture \"c\" \"float\" \"checkerboard\" Texture \"k\" \"float\" \"constant\"\n";
    let of = |s: &Scene| s.materials.iter().map(|m| m.bump).collect::<Vec<_>>();
    let height = |tangents| {
        let height = Param::Texture(0);
        Some(Bump::Height { height, tangents })
    };
    let s = v3(&format!(
        "{checks}Material \"matte\" \"texture bumpmap\" \"c\"\n{V3_TRIANGLE}\nMaterial \"matte\"\n{V3_TRIANGLE}\n\
         {V3_TRIANGLE} \"texture bumpmap\" \"c\"\nMaterial \"none\"\n{V3_TRIANGLE}"
    ));
    let unit = height(Tangents::Unit);
    assert_eq!(of(&s), [unit, None, unit, None]);
    assert_eq!(s.vertices[s.triangles[0].v[2] as usize].uv, [1.0, 1.0]);
    let s = v4(&format!(
        "{checks}Material \"diffuse\" \"texture displacement\" \"c\"\n{V4_TRIANGLE}\n\
         Material \"conductor\" \"texture displacement\" \"k\"\n{V4_TRIANGLE}\n\
         Material \"conductor\" \"float displacement\" 2\n{V4_TRIANGLE}"
    ));
    assert_eq!(of(&s), [height(Tangents::LikeU), None, None]);
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
}

#[test]
fn what_is_never_used_need_not_be_supported() {
    let s = v4(&format!(
        "Material \"hair\" Material \"diffuse\" {V4_TRIANGLE}"
    ));
    assert_eq!(s.materials.len(), 1);
    assert!(
        s.warnings[0].starts_with("t.pbrt:3:1: Material \"hair\""),
        "{:?}",
        s.warnings
    );
    let s = v4("Shape \"sphere\" \"float foo\" 1");
    assert_eq!(
        s.warnings,
        ["t.pbrt:3:16: Shape \"sphere\": unknown parameter \"foo\" ignored"]
    );
}

#[test]
fn textures_fold_and_nest() {
    let s = v3(&format!(
        "Texture \"a\" \"color\" \"constant\" \"color value\" [.5 .5 .5] \
         Texture \"b\" \"spectrum\" \"scale\" \"texture tex1\" \"a\" \"rgb tex2\" [.5 1 1] \
         Texture \"a\" \"float\" \"constant\" \"float value\" 7 \
         Texture \"c\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"b\" \"float uscale\" 4 \
         Texture \"d\" \"spectrum\" \"mix\" \"texture tex1\" \"c\" \"float amount\" .25 \
         Material \"matte\" \"texture Kd\" \"d\" \"texture sigma\" \"a\" {V3_TRIANGLE}"
    ));
    let Some(&DiffuseMaterial {
        reflectance: Param::Texture(d),
        sigma,
    }) = material(&s).get()
    else {
        panic!("textured")
    };
    assert_eq!(sigma, Param::Constant([7.0; 3]));
    let Texture::Mix {
        a: Param::Texture(c),
        b,
        amount,
    } = s.textures[d as usize]
    else {
        panic!("a mix")
    };
    assert_eq!(
        (b, amount),
        (Param::Constant([1.0; 3]), Param::Constant([0.25; 3]))
    );
    let mapping = UvMapping {
        su: 4.0,
        sv: 1.0,
        du: 0.0,
        dv: 0.0,
    };
    let folded = Param::Constant([0.25, 0.5, 0.5]);
    assert_eq!(
        s.textures[c as usize],
        Texture::Checkerboard {
            a: folded,
            b: Param::Constant([0.0; 3]),
            mapping: Mapping::Uv(mapping)
        }
    );
}

#[test]
fn names_end_with_their_block_in_v3_only() {
    let world = |triangle: &str| {
        format!(
            "Texture \"t\" \"float\" \"constant\" \"float value\" 1 AttributeBegin Texture \"t\" \"float\" \"constant\" \"float value\" 2 AttributeEnd Material \"M\" {triangle}"
        )
    };
    let s = v3(&world(V3_TRIANGLE).replace("\"M\"", "\"matte\" \"texture sigma\" \"t\""));
    let Some(DiffuseMaterial { sigma, .. }) = material(&s).get() else {
        panic!("matte")
    };
    assert_eq!(*sigma, Param::Constant([1.0; 3]));
    let s = v4(&world(V4_TRIANGLE)
        .replace("\"M\"", "\"dielectric\" \"texture eta\" \"t\"")
        .replace("float\"", "spectrum\"")
        .replace("float value\" 1", "rgb value\" [1 1 1]")
        .replace("float value\" 2", "rgb value\" [2 2 2]"));
    let Some(DielectricMaterial { eta, .. }) = material(&s).get() else {
        panic!("dielectric")
    };
    assert_eq!(*eta, Param::Constant([2.0; 3]));
}

// Lights.

#[test]
fn area_lights() {
    let s = v3(&format!(
        "{V3_TRIANGLE} AreaLightSource \"area\" \"color L\" [1 2 3] \"color scale\" [2 2 2] \"integer nsamples\" 4 Shape \"sphere\" Translate 0 0 3 {V3_TRIANGLE}"
    ));
    assert_eq!(
        s.shapes.iter().map(|x| x.light).collect::<Vec<_>>(),
        [NONE, 0, 1]
    );
    assert_eq!(
        s.lights[0].kind,
        LightKind::Sphere {
            sphere: 0,
            l: [2.0, 4.0, 6.0],
            two_sided: false
        }
    );
    assert_eq!(
        s.lights[1].kind,
        LightKind::Triangle {
            triangle: 1,
            l: [2.0, 4.0, 6.0],
            two_sided: false
        }
    );
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
}

#[test]
fn power_of_area_lights() {
    // Half the unit square in area, both sides: L = power / (2 area pi).
    let s = v4(&format!(
        "AreaLightSource \"diffuse\" \"float power\" 10 \"bool twosided\" true {V4_TRIANGLE}"
    ));
    let LightKind::Triangle {
        l, two_sided: true, ..
    } = s.lights[0].kind
    else {
        panic!("two-sided")
    };
    assert!((l[0] - 10.0 / std::f32::consts::PI).abs() < 1e-5);
    let s = v4("AreaLightSource \"diffuse\" \"float power\" 10 Scale 2 2 2 Shape \"sphere\"");
    let LightKind::Sphere { l, .. } = s.lights[0].kind else {
        panic!("a sphere")
    };
    assert!(
        (l[0] / (10.0 / (16.0 * std::f32::consts::PI.powi(2))) - 1.0).abs() < 1e-3,
        "{l:?}"
    );
}

#[test]
fn point_lights_scale_with_space() {
    let s = v4(
        "Translate 1 0 0 LightSource \"point\" \"rgb I\" [8 8 8] \"point3 from\" [0 2 0] Shape \"sphere\" \"float radius\" 100",
    );
    let LightKind::Point { p, i } = s.lights[0].kind else {
        panic!("a point light")
    };
    near(
        (p.as_dvec3() / s.space.scale + s.space.centre).as_vec3(),
        Vec3::new(1.0, 2.0, 0.0),
    );
    assert!((f64::from(i[0]) - 8.0 * s.space.scale * s.space.scale).abs() < 1e-9);
    // v3 moves by `from` after the transform.
    let s = v3(
        "Scale 2 2 2 Translate 1 0 0 LightSource \"point\" \"point from\" [0 2 0] Shape \"sphere\"",
    );
    let LightKind::Point { p, .. } = s.lights[0].kind else {
        panic!("a point light")
    };
    near(
        (p.as_dvec3() / s.space.scale + s.space.centre).as_vec3(),
        Vec3::new(2.0, 2.0, 0.0),
    );
}

#[test]
fn directional_lights() {
    let s = v4(
        "Rotate 90 0 0 1 LightSource \"distant\" \"rgb L\" [1 2 3] \"float scale\" 2 \"point3 from\" [0 0 0] \"point3 to\" [5 0 0] \
         LightSource \"spot\" \"point3 to\" [1 0 0] \"float coneangle\" 60 \"float conedeltaangle\" 15 LightSource \"infinite\" \"rgb L\" [1 1 2]",
    );
    let LightKind::Distant { direction, l } = s.lights[0].kind else {
        panic!("distant")
    };
    near(direction, Vec3::Y);
    assert_eq!(l, [2.0, 4.0, 6.0]);
    let LightKind::Spot {
        axis,
        versine_total,
        versine_full,
        falloff,
        ..
    } = s.lights[1].kind
    else {
        panic!("spot")
    };
    near(axis, Vec3::Y);
    assert!((versine_total - 0.5).abs() < 1e-6);
    assert!((versine_full - (1.0 - 0.5_f32.sqrt())).abs() < 1e-6);
    assert_eq!(falloff, SpotFalloff::V4);
    assert_eq!(
        s.lights[2].kind,
        LightKind::InfiniteConstant { l: [1.0, 1.0, 2.0] }
    );
    let s = v4("LightSource \"infinite\" \"float illuminance\" 3");
    let LightKind::InfiniteConstant { l } = s.lights[0].kind else {
        panic!("infinite")
    };
    assert!((l[0] - 3.0 / std::f32::consts::PI).abs() < 1e-6);
}

/// A folder with a PFM picture of this size, every texel `(1, 2, 3)`.
fn folder_with_picture(width: u32, height: u32) -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for _ in 0..width * height {
        bytes.extend([1.0f32, 2.0, 3.0].iter().flat_map(|x| x.to_le_bytes()));
    }
    std::fs::write(dir.path().join("a.pfm"), bytes).expect("written");
    dir
}

#[test]
fn environments() {
    let load = |size: (u32, u32), text: &str| {
        let dir = folder_with_picture(size.0, size.1);
        load_str(text, "t.pbrt", dir.path()).map_err(|e| e.to_string())
    };
    let s = load(
        (4, 2),
        "Film \"image\" WorldBegin Rotate 90 0 0 1 LightSource \"infinite\" \"string mapname\" \"a.pfm\" \"rgb L\" [2 1 1] WorldEnd",
    )
    .expect("loads");
    let LightKind::InfiniteImage {
        image,
        scale,
        to_light,
        layout,
    } = s.lights[0].kind
    else {
        panic!("an image")
    };
    assert_eq!(
        (scale, layout, s.images[image as usize].width),
        ([2.0, 1.0, 1.0], EnvLayout::LatLong, 4)
    );
    // The light's x is the world's y.
    let along = |v: Vec3| Vec3::from(to_light.map(|row| Vec3::from(row).dot(v)));
    near(along(Vec3::Y), Vec3::X);
    near(along(Vec3::X), Vec3::NEG_Y);

    let v4 = "Film \"rgb\" WorldBegin LightSource \"infinite\" \"string filename\" \"a.pfm\" \"float scale\" 3";
    let s = load((2, 2), v4).expect("loads");
    let LightKind::InfiniteImage { scale, layout, .. } = s.lights[0].kind else {
        panic!("an image")
    };
    assert_eq!((scale, layout), ([3.0; 3], EnvLayout::EqualArea));
    let error = load((4, 2), v4).expect_err("not square");
    assert!(
        error.starts_with("t.pbrt:1:23: LightSource \"infinite\": ") && error.contains("imgtool"),
        "{error}"
    );
}

#[test]
fn image_textures() {
    let dir = folder_with_picture(1, 1);
    let load = |text: &str| load_str(text, "t.pbrt", dir.path()).map_err(|e| e.to_string());
    let map = "\"imagemap\" \"string filename\" \"a.pfm\"";
    let s = load(&format!(
        "Film \"image\" WorldBegin Texture \"a\" \"color\" {map} \"float scale\" 2 \"string wrap\" \"clamp\" \
         Texture \"b\" \"float\" {map} Texture \"c\" \"float\" {map} WorldEnd"
    ))
    .expect("loads");
    // One picture for colours, one for the two uses as a number.
    assert_eq!(s.images.len(), 2);
    assert!(matches!(
        s.textures[0],
        Texture::Image {
            image: 0,
            wrap: Wrap::Clamp,
            scale: 2.0,
            invert: false,
            ..
        }
    ));
    let y = 0.212671 + 2.0 * 0.715160 + 3.0 * 0.072169;
    assert!((s.images[1].texels[0][2] - y).abs() < 1e-5);
    let s = load(&format!(
        "Film \"rgb\" WorldBegin Texture \"b\" \"float\" {map} \"bool invert\" true"
    ))
    .expect("loads");
    assert_eq!(s.images[0].texels[0], [2.0; 3]);
    assert!(matches!(s.textures[0], Texture::Image { invert: true, .. }));
}

#[test]
fn emission_by_other_spectra() {
    // Lights of v4 have luminance 1 whatever the magnitude of a spectrum; v3 takes it as it is.
    let luminance = |s: &Scene| match s.lights[0].kind {
        LightKind::InfiniteConstant { l } => crate::scene::spectrum::luminance(l),
        _ => panic!("constant"),
    };
    for text in [
        "\"blackbody L\" 3000",
        "\"spectrum L\" [400 7 700 7]",
        "\"spectrum L\" \"stdillum-D65\"",
    ] {
        let s = v4(&format!(
            "LightSource \"infinite\" {text} \"float scale\" 2"
        ));
        assert!((luminance(&s) - 2.0).abs() < 1e-4, "{text}");
    }
    let s = v3("LightSource \"infinite\" \"spectrum L\" [400 7 700 7]");
    assert!((luminance(&s) - 7.0).abs() < 1e-3);
    let s = v3("LightSource \"infinite\" \"blackbody L\" [3000 2]");
    assert!((0.01..1.99).contains(&luminance(&s)));
}

// Camera, film, integrator.

fn header(header: &str) -> Scene {
    loaded(&format!("{header}\nWorldBegin\nShape \"sphere\"\n"))
}

#[test]
fn cameras() {
    let s = header(
        "Film \"rgb\" \"integer xresolution\" 200 \"integer yresolution\" 100\nScale -2 2 2 LookAt 0 0 -5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 90 \"float lensradius\" 4 \"float focaldistance\" 10",
    );
    let c = s.camera;
    let scale = s.space.scale as f32;
    // World units are halves of camera units.
    assert!(
        (c.lens_radius / scale - 2.0).abs() < 1e-6 && (c.focal_distance / scale - 5.0).abs() < 1e-6
    );
    for (a, b) in c.screen.iter().zip([-2.0, 2.0, -1.0, 1.0]) {
        assert!((a - b).abs() < 1e-6);
    }
    let column = |j: usize| Vec3::from(c.to_world.map(|row| row[j]));
    near(column(2), Vec3::Z);
    near(column(1), Vec3::Y);
    near(column(0), Vec3::NEG_X);
    near(column(3) / scale, Vec3::new(0.0, 0.0, -5.0));

    let s = header(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 200\nCamera \"perspective\" \"float fov\" 60",
    );
    assert!((s.camera.screen[3] - 2.0 * 30f32.to_radians().tan()).abs() < 1e-6);
    assert_eq!(s.camera.lens_radius, 0.0);
    let s = header("Film \"rgb\"\nCamera \"orthographic\" \"float screenwindow\" [-3 3 -2 2]");
    assert!((s.camera.screen[1] / s.space.scale as f32 - 3.0).abs() < 1e-6);

    for (text, message) in [
        (
            "Scale 1 2 1 Camera \"perspective\"",
            "t.pbrt:1:13: Camera \"perspective\": its transform shears",
        ),
        (
            "Camera \"perspective\" \"float fov\" 180",
            "t.pbrt:1:1: Camera \"perspective\": field of view 180",
        ),
        (
            "Camera \"realistic\"",
            "t.pbrt:1:1: Camera \"realistic\": this camera is not supported; use",
        ),
        (
            "Camera \"perspective\" \"float screenwindow\" [-1 3e38 -1 1]",
            "t.pbrt:1:1: Camera \"perspective\": its screen window is out of all proportion",
        ),
        (
            "Scale 0 1 1 Camera \"perspective\"",
            "t.pbrt:1:13: Camera \"perspective\": the current transform",
        ),
    ] {
        let error = try_load(&format!("{text} WorldBegin")).expect_err("an error");
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn films_and_filters() {
    let s = header(
        "Film \"image\" \"integer xresolution\" [10] \"integer yresolution\" 20 \"float cropwindow\" [.25 .5 0 1] \"float scale\" 2 \"string filename\" [\"a.exr\"]\nPixelFilter \"gaussian\" \"float xwidth\" 3",
    );
    assert_eq!(
        (s.film.width, s.film.height, s.film.crop, s.film.scale),
        (10, 20, [3, 5, 0, 20], 2.0)
    );
    assert_eq!(s.film.filename.as_deref(), Some("a.exr"));
    assert_eq!(
        s.film.filter,
        Filter {
            radius: Vec2::new(3.0, 2.0),
            kind: FilterKind::Gaussian { alpha: 2.0 }
        }
    );
    let s = header(
        "Film \"rgb\" \"integer pixelbounds\" [1 2 3 4] \"float iso\" 200 \"float exposuretime\" .25",
    );
    assert_eq!(
        (s.film.width, s.film.height, s.film.crop, s.film.scale),
        (1280, 720, [1, 2, 3, 4], 0.5)
    );
    assert_eq!(
        s.film.filter,
        Filter {
            radius: Vec2::splat(1.5),
            kind: FilterKind::Gaussian { alpha: 2.0 }
        }
    );
    assert_eq!(
        v3("").film.filter,
        Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box
        }
    );
    for bad in [
        "\"integer xresolution\" 0",
        "\"float cropwindow\" [.5 .5 0 1]",
        "\"integer xresolution\" 99999999999",
    ] {
        assert!(
            try_load(&format!("Film \"rgb\" {bad} WorldBegin")).is_err(),
            "{bad}"
        );
    }
}

#[test]
fn integrators() {
    let s = header(
        "Film \"rgb\" Sampler \"independent\" \"integer pixelsamples\" 7 Integrator \"mlt\" \"integer maxdepth\" 9 \"integer chains\" 3 \"float sigma\" .1",
    );
    let expected = IntegratorSettings {
        max_depth: 9,
        chains: 3,
        sigma: 0.1,
        pixel_samples: 7,
        ..Default::default()
    };
    assert_eq!(s.integrator, expected);
    let s = header("Film \"rgb\" Integrator \"path\" \"float rrthreshold\" 1");
    assert_eq!(
        (s.integrator.kind, s.integrator.max_depth, s.warnings.len()),
        (IntegratorKind::Pt, 5, 0)
    );
    let s = header("Film \"rgb\" Integrator \"bdpt\"");
    assert_eq!(
        (s.integrator.kind, s.warnings.len()),
        (IntegratorKind::Bdpt, 0)
    );
    assert!(!s.integrator.strategies);
    for flag in ["visualizestrategies", "visualizeweights"] {
        let text = format!("Integrator \"bdpt\" \"integer maxdepth\" 3 \"bool {flag}\" true");
        let s = header(&format!("Film \"rgb\" {text}"));
        assert!(s.integrator.strategies && s.warnings.is_empty());
        assert_eq!(s.integrator.max_depth, 3);
    }
    let s = header("Film \"rgb\" Integrator \"lightpath\" \"integer maxdepth\" 4");
    assert_eq!(
        (s.integrator.kind, s.integrator.max_depth, s.warnings.len()),
        (IntegratorKind::Lt, 4, 0)
    );
    let s = header("Film \"rgb\" Integrator \"sppm\"");
    assert_eq!(
        (s.integrator.kind, s.warnings.len()),
        (IntegratorKind::Mmlt, 1)
    );
}

// Files.

#[test]
fn includes() {
    let dir = tempfile::tempdir().expect("a folder");
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("written");
    std::fs::create_dir(dir.path().join("sub")).expect("a folder");
    // Names are relative to the main file's folder everywhere.
    write(
        "main.pbrt",
        "Film \"rgb\" WorldBegin Include \"sub/a.pbrt\" Shape \"sphere\"",
    );
    write("sub/a.pbrt", "Translate 1 0 0 Import \"sub/b.pbrt\"");
    write(
        "sub/b.pbrt",
        "Translate 5 0 0 Shape \"sphere\" \"float radius\" 2",
    );
    let s = super::load(&dir.path().join("main.pbrt")).expect("loads");
    assert_eq!(s.spheres.len(), 2);
    let distance =
        (s.spheres[0].to_world[0][3] - s.spheres[1].to_world[0][3]) / s.space.scale as f32;
    assert!((distance - 5.0).abs() < 1e-5);

    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut gz, b"Film \"rgb\" WorldBegin Shape \"sphere\"")
        .expect("compressed");
    std::fs::write(
        dir.path().join("z.pbrt.gz"),
        gz.finish().expect("compressed"),
    )
    .expect("written");
    assert_eq!(
        super::load(&dir.path().join("z.pbrt.gz"))
            .expect("loads")
            .spheres
            .len(),
        1
    );

    write(
        "cycle.pbrt",
        "Film \"rgb\" WorldBegin\n Include \"sub/c.pbrt\"",
    );
    write("sub/c.pbrt", "\nInclude \"cycle.pbrt\"");
    let error = super::load(&dir.path().join("cycle.pbrt"))
        .expect_err("a cycle")
        .to_string();
    assert!(
        error.contains("sub/c.pbrt:2:1: Include: ") && error.contains("includes itself"),
        "{error}"
    );

    let error = super::load(&dir.path().join("none.pbrt"))
        .expect_err("no file")
        .to_string();
    assert!(error.contains("none.pbrt"), "{error}");
}

#[test]
fn files_that_multiply_are_stopped() {
    let dir = tempfile::tempdir().expect("a folder");
    for i in 0..40 {
        let next = format!("Include \"{}.pbrt\" ", i + 1);
        let text = if i == 39 {
            String::new()
        } else {
            next.repeat(2)
        };
        std::fs::write(dir.path().join(format!("{i}.pbrt")), text).expect("written");
    }
    let main = "Film \"rgb\" WorldBegin Include \"0.pbrt\"";
    let error = load_str(main, "t", dir.path())
        .expect_err("too many")
        .to_string();
    assert!(error.contains("too many included files"), "{error}");
}

#[test]
fn deep_nesting_does_not_recurse() {
    let n = 10_000;
    let s = v4(&format!(
        "{}{}",
        "AttributeBegin ".repeat(n),
        "AttributeEnd ".repeat(n)
    ));
    assert!(s.warnings.is_empty());
    assert!(v4_error(&"AttributeBegin ".repeat(100_000)).contains("blocks are open"));
}

#[test]
fn hostile_sizes_fail_before_allocation() {
    for text in [
        "Shape \"loopsubdiv\" \"integer levels\" 13 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2 0 1 2]",
        "Shape \"loopsubdiv\" \"integer levels\" 1000000 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 -1]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 4294967296]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1] \"integer indices\" [0 1 1]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]",
    ] {
        v4_error(text);
    }
}

/// Textures that each name another twice would take 2^40 steps; those that each name another once, a stack of 100 000 frames.
#[test]
fn textures_that_multiply_are_stopped() {
    let first = "Texture \"t\" \"spectrum\" \"checkerboard\"\n";
    for (kind, count) in [
        ("mix\" \"texture tex1\" \"t\" \"texture tex2\" \"t", 40),
        (
            "checkerboard\" \"float uscale\" 2 \"texture tex1\" \"t",
            100_000,
        ),
    ] {
        let next = format!("Texture \"t\" \"spectrum\" \"{kind}\"\n");
        let used = format!("Material \"diffuse\" \"texture reflectance\" \"t\" {V4_TRIANGLE}");
        let error = v4_error(&(first.to_owned() + &next.repeat(count) + &used));
        assert!(
            error.contains(": is made of more than 1000 textures; bake it into an image"),
            "{error}"
        );
        v4(&(first.to_owned() + &next.repeat(8) + &used));
    }
}

#[test]
fn names_with_line_ends_make_messages_of_one_line() {
    let error = v4_error("Shape \"a\\nb\u{1b}\"");
    assert!(
        error.starts_with("t.pbrt:3:1: Shape \"a\\nb\\u{1b}\": this shape"),
        "{error}"
    );
    let error = v4_error("Shape \"sphere\" \"float r\\nx\" y");
    assert!(!error.contains(char::is_control), "{error}");
}

#[test]
fn parameters_are_counted() {
    let many = |n: usize| {
        (0..n)
            .map(|i| format!(" \"float a{i}\" 1"))
            .collect::<String>()
    };
    assert_eq!(
        v4(&format!("Shape \"sphere\"{}", many(1000))).spheres.len(),
        1
    );
    let error = v4_error(&format!("Shape \"sphere\"{}", many(1001)));
    assert!(
        error.contains("parameter \"a1000\": is one of too many"),
        "{error}"
    );
}

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
            n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9], "1", "1", "1", n[13], n[14], n[15], n[16], n[17],
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

/// A scene of both dialects' common parts with some of its words dropped, doubled, exchanged or replaced.
fn mutated() -> impl Strategy<Value = String> {
    let scene = include_str!("../../tests/reference/cornell.pbrt");
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
            prop_assert!(s.camera.to_world.iter().flatten().chain(&s.camera.screen).all(|x| x.is_finite()));
            prop_assert!(s.film.scale.is_finite());
            for light in &s.lights {
                let (LightKind::Point { p, i } | LightKind::Spot { p, i, .. }) = light.kind else { continue };
                prop_assert!(p.is_finite() && i.iter().all(|c| c.is_finite()));
            }
        }
    }

    #[test]
    fn bytes_load_or_tell_where(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        loads_or_tells(&String::from_utf8_lossy(&bytes));
    }
}

#[test]
fn geometry_beyond_all_measure_is_left_out() {
    let text =
        "Film \"rgb\" WorldBegin Rotate 1 0 0 1 Scale 0 -1e308 0 Shape \"disk\" \"float radius\" 2";
    let s = try_load(text).expect("a scene without the disk");
    assert!(s.triangles.is_empty() && s.vertices.iter().all(|v| Vec3::from(v.p).is_finite()));
    assert!(s.bounds.iter().all(|b| b.length() <= 1.001));
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
        let s = super::load(Path::new(path)).unwrap_or_else(|e| panic!("{e}"));
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

#[test]
fn coats_have_the_parameters_of_v4() {
    let grey = |x: f32| Param::Constant([x; 3]);
    let scene = |text: &str| v4(&format!("{text} {V4_TRIANGLE}"));
    let kinds = |text: &str| -> Vec<MaterialKind> {
        let all = scene(text).materials;
        all.into_iter().map(|m| m.kind).collect()
    };
    let coat = CoatLayer {
        alphas: [0.0; 2],
        eta: 1.5,
        thickness: 0.01,
        max_depth: 10,
    };
    let diffuse = |coat| {
        MaterialKind::from(CoatedDiffuseMaterial {
            reflectance: grey(0.5),
            coat,
        })
    };
    // Smooth by default: what the coat reflects, and the base.
    let parts = kinds("Material \"coateddiffuse\"");
    assert_eq!(
        parts[..2],
        [MaterialKind::from(CoatMaterial { eta: 1.5 }), diffuse(coat)]
    );
    assert!(matches!(&parts[2], MaterialKind::Mixture { components } if components.len() == 2));
    // Roughness is remapped by its root.
    let alphas = [0.5, 0.3];
    let given = "\"float roughness\" .25 \"float vroughness\" .09 \"float eta\" 1.3 \"float thickness\" .1 \"integer maxdepth\" 5 \"integer nsamples\" 4 \"float g\" .5";
    let expected = CoatLayer {
        alphas,
        eta: 1.3,
        thickness: 0.1,
        max_depth: 5,
    };
    let s = scene(&format!("Material \"coateddiffuse\" {given}"));
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    assert_eq!(*material(&s), diffuse(expected));
    // Glass that would disperse light is said not to.
    for (name, given) in [
        ("coateddiffuse", "\"spectrum eta\" \"glass-BK7\""),
        (
            "coatedconductor",
            "\"spectrum interface.eta\" \"glass-SF11\"",
        ),
    ] {
        let s = scene(&format!("Material \"{name}\" {given}"));
        assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
        assert!(
            s.warnings[0].contains("do not disperse"),
            "{}",
            s.warnings[0]
        );
    }
    // Nothing reflects where nothing changes.
    let none = CoatLayer { eta: 1.0, ..coat };
    let still = kinds("Material \"coateddiffuse\" \"float eta\" 1 \"float roughness\" .3");
    assert_eq!(still, [diffuse(none)]);

    let conductor = |eta: f32, k: f32, alphas, coat| {
        MaterialKind::from(CoatedConductorMaterial {
            eta: [eta; 3],
            k: [k; 3],
            alphas,
            coat,
        })
    };
    let copper = kinds("Material \"coatedconductor\"");
    let Some(CoatedConductorMaterial { eta, k, .. }) = copper[0].get() else {
        panic!("{copper:?}");
    };
    let relative = |name: &str| {
        crate::pbrt::spectrum::named(name)
            .expect("copper")
            .map(|x| x / 1.5)
    };
    assert_eq!(
        (*eta, *k),
        (relative("metal-Cu-eta"), relative("metal-Cu-k"))
    );
    let given = "\"rgb conductor.eta\" [3 3 3] \"rgb conductor.k\" [6 6 6] \"float conductor.roughness\" .25 \"float interface.eta\" 2 \"float interface.uroughness\" .04";
    let expected = CoatLayer {
        alphas: [0.2, 0.0],
        eta: 2.0,
        ..coat
    };
    assert_eq!(
        kinds(&format!("Material \"coatedconductor\" {given}")),
        [conductor(1.5, 3.0, [0.5; 2], expected)]
    );
    let k = 2.0 * 0.5f32.sqrt() / 0.5f32.sqrt() / 1.5;
    assert_eq!(
        kinds("Material \"coatedconductor\" \"rgb reflectance\" [.5 .5 .5]"),
        [conductor(1.0 / 1.5, k, [0.0; 2], coat)]
    );
    for (given, what) in [
        ("\"float thickness\" -1", "thickness -1 is negative"),
        (
            "\"float interface.roughness\" -1",
            "roughness -1 is negative",
        ),
        (
            "\"rgb reflectance\" [.5 .5 .5] \"rgb conductor.k\" [1 1 1]",
            "exclude each other",
        ),
    ] {
        let error = v4_error(&format!(
            "Material \"coatedconductor\" {given} {V4_TRIANGLE}"
        ));
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn options_have_a_name_and_a_value() {
    let seed = |option: &str, sampler: &str| {
        header(&format!("{option} Film \"rgb\" {sampler}"))
            .integrator
            .seed
    };
    for option in [
        "Option \"seed\" 3",
        "Option \"integer seed\" 3",
        "Option \"Seed\" [ 3 ]",
    ] {
        assert_eq!(seed(option, ""), 3, "{option}");
        assert_eq!(seed(option, "Sampler \"halton\" \"integer seed\" 7"), 7);
        assert_eq!(seed(option, "Sampler \"halton\""), 3);
    }
    for option in [
        "\"disablepixeljitter\" false",
        "\"disable-texture_filtering\" true",
        "\"disablewavelengthjitter\" true",
        "\"bool disablewavelengthjitter\" [true]",
        "\"displacementedgescale\" 2.5",
        "\"msereferenceimage\" \"a.exr\"",
        "\"msereferenceout\" \"a.txt\"",
        "\"rendercoordsys\" \"world\"",
        "\"forcediffuse\" false",
        "\"pixelstats\" true",
        "\"wavefront\" true",
    ] {
        let s = header(&format!("Option {option} Film \"rgb\""));
        assert!(s.warnings.is_empty(), "{option}: {:?}", s.warnings);
    }
    for (option, what) in [
        ("\"forcediffuse\" true", "would make all surfaces diffuse"),
        ("\"disablepixeljitter\" true", "would look at the centres"),
        ("\"wavefront\" 1", "must be true or false"),
        ("\"seed\" \"x\"", "must be a whole number"),
        (
            "\"rendercoordsys\" \"moon\"",
            "must be camera, cameraworld or world",
        ),
        ("\"msereferenceout\" 3", "must be a string in quotes"),
        ("\"seed\"", "expected the value"),
        ("seed 3", "expected the name of an option"),
    ] {
        let error = try_load(&format!("Option {option}")).expect_err(option);
        assert!(
            error.contains(what) || error.contains("the file ends"),
            "{error}"
        );
    }
    let s = header("Option \"nosuch\" 1 Film \"rgb\"");
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
}

#[test]
fn exposures_are_as_long_as_the_shutter_is_open() {
    let scale = |camera: &str, film: &str| {
        header(&format!(
            "Camera \"perspective\" {camera} Film \"rgb\" {film}"
        ))
        .film
        .scale
    };
    let shutter = "\"float shutteropen\" .25 \"float shutterclose\" .5";
    assert_eq!(scale(shutter, ""), 0.25);
    assert_eq!(scale(shutter, "\"float iso\" 400"), 1.0);
    assert_eq!(scale("", "\"float iso\" 50"), 0.5);
    assert_eq!(scale("\"float shutterclose\" 2", ""), 2.0);
    assert_eq!(v3("").film.scale, 1.0);
    let error = try_load("Film \"rgb\" Camera \"perspective\" \"float shutterclose\" 0 WorldBegin");
    assert!(
        error
            .expect_err("closed")
            .contains("no light reaches the film")
    );
}

#[test]
fn films_have_a_sensor_and_a_colour_space() {
    let film = |text: &str| header(text).film;
    let plain = film("Film \"rgb\" \"string sensor\" \"cie1931\"");
    assert_eq!(
        (plain.colour, plain.chromaticities, plain.clamp),
        (None, None, None)
    );
    // Light of the colour that the film is balanced for is grey.
    let warm = film("Film \"rgb\" \"float whitebalance\" 3000")
        .colour
        .expect("a matrix");
    let rgb = crate::pbrt::spectrum::blackbody(3000.0 * 1.4388 / 1.4380);
    let seen = warm.map(|r| r[0] * rgb[0] + r[1] * rgb[1] + r[2] * rgb[2]);
    assert!(seen.iter().all(|c| (c - 1.0).abs() < 2e-3), "{seen:?}");
    let camera = "Film \"rgb\" \"string sensor\" \"canon_eos_5d_mkiv\"";
    let s = header(camera);
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
    assert_eq!(
        s.film.colour,
        film("Film \"rgb\" \"float whitebalance\" 6500").colour
    );
    assert!(try_load("Film \"rgb\" \"string sensor\" \"nokia\" WorldBegin").is_err());
    // Linear sRGB red in the primaries of BT.2020 (BT.2087).
    let wide = film("ColorSpace \"rec2020\" Film \"rgb\"");
    let red = wide.colour.expect("a matrix").map(|r| r[0]);
    for (a, b) in red.iter().zip([0.6274, 0.0691, 0.0164]) {
        assert!((a - b).abs() < 1e-3, "{red:?}");
    }
    assert_eq!(wide.chromaticities.expect("primaries")[..2], [0.708, 0.292]);
    let clamp = film("Film \"rgb\" \"float maxcomponentvalue\" 8 \"float iso\" 200").clamp;
    assert_eq!(clamp, Some(Clamp::Xyz(4.0)));
    let cut = Clamp::Xyz(4.0).of([10.0; 3]);
    // The Z of white is 1.0888.
    assert!(
        cut.iter().all(|c| (c - 4.0 / 1.0888).abs() < 1e-3),
        "{cut:?}"
    );
    assert_eq!(Clamp::Xyz(4.0).of([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    assert_eq!(
        Clamp::Luminance(1.0)
            .of([4.0; 3])
            .map(|c| (c * 1e4).round()),
        [1e4; 3]
    );
}

/// Against pbrt-v4's pictures of a flat patch, to their noise.
#[test]
fn v4_colours_of_lights_and_reflectances() {
    let light = |text: &str| match v4(&format!("{text} Shape \"sphere\"")).lights[0].kind {
        LightKind::InfiniteConstant { l } => l,
        _ => panic!("{text}"),
    };
    let near = |a: Rgb, b: Rgb, slack: f32| {
        let same = a.iter().zip(b).all(|(x, y)| (x - y).abs() < slack);
        assert!(same, "{a:?} is not {b:?}");
    };
    // Nothing beyond the samples; blue is out of gamut. The picture of the case is 0.6073 of its light.
    let l = light("LightSource \"infinite\" \"spectrum L\" [500 1 600 1]");
    near(l.map(|c| c * 0.6073), [0.2208, 0.7901, 0.0], 2e-3);
    let dark = light("LightSource \"infinite\" \"spectrum L\" [360 1 830 1]");
    near(dark, [1.2048, 0.9483, 0.9087], 2e-3);
    // Lights have the white of their space.
    let white = [1.0463, 0.9942, 0.9156];
    for text in [
        "ColorSpace \"aces2065-1\" LightSource \"infinite\" \"rgb L\" [1 1 1]",
        "ColorSpace \"aces2065-1\" LightSource \"infinite\"",
    ] {
        near(light(text), white, 2e-3);
    }
    for space in ["dci-p3", "rec2020", "srgb"] {
        let text = format!("ColorSpace \"{space}\" LightSource \"infinite\" \"rgb L\" [1 1 1]");
        near(light(&text), [1.0; 3], 1e-4);
    }
    let albedo = |text: &str| {
        let s = v4(&format!("Material \"diffuse\" {text} Shape \"sphere\""));
        match s.materials[0].kind.get() {
            Some(DiffuseMaterial {
                reflectance: Param::Constant(c),
                ..
            }) => *c,
            _ => panic!("{text}"),
        }
    };
    // A ball before a sky of 1 fills pi / 4 of the case's picture.
    let seen = albedo("\"blackbody reflectance\" 3000").map(|c| 1.0 - (1.0 - c) * FRAC_PI_4);
    near(seen, [0.7094, 0.5040, 0.3179], 3e-3);
    let half = albedo("\"spectrum reflectance\" [500 .5 600 .5]");
    assert!(half[0] < 0.2 && half[2] < 0.1, "{half:?}");
    let whole = albedo("\"spectrum reflectance\" [300 .5 900 .5]");
    near(whole, [0.5; 3], 1e-5);
}

#[test]
fn lights_cut_out_entirely_shine_unseen() {
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2]";
    let mesh = "Shape \"trianglemesh\" \"integer indices\" [0 1 2]";
    for s in [
        v4(&format!("{lamp} Shape \"sphere\" \"float alpha\" 0")),
        v4(&format!(
            "{lamp} {mesh} \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 0"
        )),
        v3(&format!(
            "{lamp} {mesh} \"point P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 0"
        )),
        v4(&format!(
            "Texture \"t\" \"float\" \"constant\" \"float value\" 0 {lamp} Shape \"sphere\" \"texture alpha\" \"t\""
        )),
    ] {
        assert_eq!(s.lights.len(), 1);
        assert!(s.is_hidden(&s.lights[0].kind));
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    }
    let s = v4(&format!("{lamp} Shape \"sphere\""));
    assert!(!s.is_hidden(&s.lights[0].kind));
}
