//! Small scenes of one difficulty each, in which every strategy must weigh itself right: MMLT
//! against PT, by the rule of [`support`].

use crate::support;
use crate::support::dialect;

use dialect::to_v4;
use phalanx::pbrt::load_str;
use support::{expect_integrators_agree, head, scene, write_pfm};

const SEEDS: u64 = 48;
const CAMERA: &str = "LookAt 0 1.6 5  0 0.6 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]";

/// A floor, a back wall and something on them.
const STAGE: &str = r#"
Material "matte" "rgb Kd" [.7 .6 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-3 0 -2 3 0 -2 3 3 -2 -3 3 -2]
AttributeBegin
Material "plastic" "rgb Kd" [.2 .3 .5] "rgb Ks" [.4 .4 .4] "float roughness" [.2]
Translate 0 0.7 0
Shape "sphere" "float radius" [0.7]
AttributeEnd
"#;

fn agree(light: &str, name: &str) {
    let text = head(24, 18, 4, CAMERA) + light + STAGE;
    expect_integrators_agree(&scene(&text), 12, SEEDS, [4, 3], name);
}

#[test]
fn point_light() {
    agree(
        "LightSource \"point\" \"rgb I\" [5 6 7] \"point from\" [1 2.5 1.5]\n",
        "point",
    );
}

#[test]
fn spot_light() {
    agree(
        "LightSource \"spot\" \"rgb I\" [9 8 7] \"point from\" [1 2.5 1.5] \"point to\" [0 0 0] \"float coneangle\" [30] \
         \"float conedeltaangle\" [15]\n",
        "spot",
    );
}

#[test]
fn distant_light() {
    agree(
        "LightSource \"distant\" \"rgb L\" [2 3 1] \"point from\" [1 2 2] \"point to\" [0 0 0]\n",
        "distant",
    );
}

/// An image with one bright texel, turned.
#[test]
fn infinite_image() {
    let dir = tempfile::tempdir().unwrap();
    let pixels = (0..128).map(|i| {
        if i == 37 {
            [40.0, 30.0, 20.0]
        } else {
            [0.2, 0.1 * (i % 4) as f32, 0.4]
        }
    });
    let sky: Vec<[f32; 3]> = pixels.collect();
    write_pfm(&dir.path().join("sky.pfm"), 16, &sky);
    let light = "AttributeBegin\nRotate -70 1 0 0\nRotate 40 0 0 1\nLightSource \"infinite\" \"string mapname\" \"sky.pfm\"\nAttributeEnd\n";
    let text = head(24, 18, 4, CAMERA) + light + STAGE;
    let scene = load_str(&text, "sky.pbrt", dir.path()).unwrap();
    expect_integrators_agree(&scene, 12, SEEDS, [4, 3], "infinite image");
}

fn area(shape: &str, two_sided: bool) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [9 8 7] \"bool twosided\" \"{two_sided}\"\n\
         Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n{shape}\nAttributeEnd\n"
    )
}

/// Stands upright in the middle of the stage, so that both sides light something; it reflects as
/// well.
#[test]
fn one_and_two_sided_lights() {
    let shape = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [1.2 .2 -.5 1.2 .2 .5 1.2 1.2 .5 1.2 1.2 -.5]";
    agree(&area(shape, false), "one-sided");
    agree(&area(shape, true), "two-sided");
}

#[test]
fn disk_light() {
    agree(
        &area(
            "Translate 0 2.6 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [.5]",
            false,
        ),
        "disk",
    );
}

#[test]
fn sphere_light() {
    agree(
        &area(
            "Translate 1.2 1.5 .8\nShape \"sphere\" \"float radius\" [.3]",
            false,
        ),
        "sphere",
    );
}

/// Not a sphere any more: points on it are not uniform over its area. Two-sided, its inside emits
/// as well.
#[test]
fn ellipsoid_light() {
    let shape = "Translate 1.4 1.2 .5\nRotate 40 1 1 0\nScale .1 .7 .3\nShape \"sphere\" \"float radius\" [1]";
    agree(&area(shape, false), "ellipsoid");
    agree(&area(shape, true), "two-sided ellipsoid");
}

/// A coarse ball whose vertex normals are those of the sphere: seen from a light, its triangles are
/// not what they seem, and without the adjoint correction (Veach 1997, section 5.3) light subpaths
/// give another picture than camera subpaths.
fn smooth_ball(material: &str) -> String {
    let (rings, segments) = (5, 8);
    let mut points = Vec::new();
    for i in 0..=rings {
        let theta = std::f64::consts::PI * f64::from(i) / f64::from(rings);
        for j in 0..segments {
            let phi = std::f64::consts::TAU * f64::from(j) / f64::from(segments);
            let (x, z) = (theta.sin() * phi.cos(), theta.sin() * phi.sin());
            points.push(format!("{x:.6} {:.6} {z:.6}", theta.cos()));
        }
    }
    let mut indices = Vec::new();
    for i in 0..rings {
        for j in 0..segments {
            let at = |i: i32, j: i32| i * segments + j % segments;
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            // Those at the poles have no area.
            if i > 0 {
                indices.push(format!("{a} {b} {c}"));
            }
            if i < rings - 1 {
                indices.push(format!("{a} {c} {d}"));
            }
        }
    }
    let points = points.join("  ");
    format!(
        "AttributeBegin\nMaterial {material}\nTranslate 0 .9 0\nScale .8 .8 .8\n\
         Shape \"trianglemesh\" \"integer indices\" [{}] \"point P\" [{points}] \"normal N\" [{points}]\nAttributeEnd\n",
        indices.join("  ")
    )
}

fn shading_normals(material: &str, name: &str) {
    let floor = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let lights = [
        (
            "point light",
            "LightSource \"point\" \"rgb I\" [9 9 9] \"point from\" [1.5 2 1]\n".to_string(),
        ),
        (
            "disk",
            area(
                "Translate 0 2.6 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [.5]",
                false,
            ),
        ),
    ];
    for (what, light) in lights {
        let text = head(24, 18, 4, CAMERA) + &light + floor + &smooth_ball(material);
        expect_integrators_agree(&scene(&text), 12, SEEDS, [4, 3], &format!("{name}, {what}"));
    }
}

#[test]
fn shading_normals_of_a_diffuse_mesh() {
    shading_normals("\"matte\" \"rgb Kd\" [.8 .5 .3]", "smooth diffuse mesh");
}

#[test]
fn shading_normals_of_a_rough_metal_mesh() {
    shading_normals(
        "\"metal\" \"float roughness\" [.3] \"bool remaproughness\" \"false\"",
        "smooth metal mesh",
    );
}

/// Refraction at shading normals, and the square of the index that radiance is scaled by and
/// importance is not (Veach 1997, section 5.2): a floor under a slab of glass, lit by an emitter
/// that both integrators can find.
#[test]
fn floor_under_glass() {
    let slab = "AttributeBegin\nMaterial \"glass\" \"float index\" [1.5]\nReverseOrientation\n"
        .to_string()
        + &support::inward_box([-2.5, 2.5, 0.3, 0.6, -1.5, 2.5])
        + "AttributeEnd\n";
    let light = area(
        "Translate 0 2.6 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [1.2]",
        false,
    );
    let floor = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let text = head(24, 18, 6, CAMERA) + &light + &slab + floor;
    expect_integrators_agree(&scene(&text), 24, SEEDS, [2, 2], "floor under glass");
}

#[test]
fn shading_normals_of_a_lacquered_mesh() {
    shading_normals(
        "\"substrate\" \"rgb Kd\" [.6 .2 .1] \"rgb Ks\" [.2 .2 .2] \"float uroughness\" [.2] \"float vroughness\" [.4] \
         \"bool remaproughness\" \"false\"",
        "smooth lacquered mesh",
    );
}

#[test]
fn shading_normals_of_a_paper_mesh() {
    shading_normals(
        "\"translucent\" \"rgb Ks\" [0 0 0] \"rgb Kd\" [1 .8 .6] \"rgb reflect\" [.4 .4 .4] \"rgb transmit\" [.6 .6 .5]",
        "smooth paper mesh",
    );
}

/// All light of the lamp in a paper shade goes through it.
#[test]
fn lampshade() {
    let lamp = area(
        "Translate 0 .8 0\nShape \"sphere\" \"float radius\" [.3]",
        false,
    );
    let shade = "AttributeBegin\nMaterial \"translucent\" \"rgb Ks\" [0 0 0] \"rgb Kd\" [1 .9 .7] \"rgb reflect\" [.5 .5 .5]\n\
                 Translate 0 .8 0\nShape \"sphere\" \"float radius\" [.7]\nAttributeEnd\n";
    let floor = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let text = head(24, 18, 4, CAMERA) + &lamp + shade + floor;
    expect_integrators_agree(&scene(&text), 24, SEEDS, [2, 2], "lampshade");
}

/// Light that a sheet of glass lets through or reflects is where both integrators look for it.
#[test]
fn floor_under_a_pane() {
    let pane = "Material \"thindielectric\"\n\
                Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 .4 -1.5 -2 .8 2 2 .8 2 2 .4 -1.5]\n";
    let light = area(
        "Translate 0 2.6 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [1.2]",
        false,
    );
    let floor = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let text = to_v4(&(head(24, 18, 5, CAMERA) + &light + pane + floor));
    expect_integrators_agree(&scene(&text), 24, SEEDS, [2, 2], "floor under a pane");
}

/// Rough glass, whose both sides light subpaths and camera subpaths are joined at; a smooth mesh of
/// it as well.
#[test]
fn rough_glass() {
    let frosted = "\"glass\" \"float uroughness\" [.4] \"float vroughness\" [.2] \"bool remaproughness\" \"false\"";
    let light = area(
        "Translate 0 2.6 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [1.2]",
        false,
    );
    let floor = "Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let slab = format!("AttributeBegin\nMaterial {frosted}\nReverseOrientation\n")
        + &support::inward_box([-2.5, 2.5, 0.3, 0.6, -1.5, 2.5])
        + "AttributeEnd\n";
    for (name, glass) in [("slab", slab), ("ball", smooth_ball(frosted))] {
        let text = head(24, 18, 6, CAMERA) + &light + &glass + floor;
        expect_integrators_agree(&scene(&text), 24, SEEDS, [2, 2], &format!("rough {name}"));
    }
}

/// Oren-Nayar, an anisotropic metal, a mirror and glass side by side under a large light.
#[test]
fn every_material() {
    let mut text = head(32, 18, 5, CAMERA)
        + &area(
            "Translate 0 2.9 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" [1.5]",
            false,
        )
        + "Material \"matte\" \"rgb Kd\" [.7 .6 .5] \"float sigma\" [30]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n";
    let materials = [
        "\"mirror\"",
        "\"glass\"",
        "\"metal\" \"float uroughness\" [.4] \"float vroughness\" [.1] \"bool remaproughness\" \"false\"",
        "\"plastic\"",
    ];
    for (i, material) in materials.iter().enumerate() {
        text += &format!(
            "AttributeBegin\nMaterial {material}\nTranslate {} .5 0\nShape \"sphere\" \"float radius\" [.5]\nAttributeEnd\n",
            -1.8 + 1.2 * i as f64
        );
    }
    expect_integrators_agree(&scene(&text), 24, SEEDS, [4, 2], "every material");
}
