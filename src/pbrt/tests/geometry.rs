//! Transforms, blocks, orientation, normals and instances.

use super::*;
use crate::surface::{DielectricMaterial, MirrorMaterial};

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
}

#[test]
fn texture_coordinates_by_default() {
    // Shared vertices cannot have the coordinates (0,0) (1,0) (1,1) of each triangle; only what
    // looks at them pays.
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
