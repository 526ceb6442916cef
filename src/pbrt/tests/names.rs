//! Textures, bump maps and alpha masks, and how long their names last.

use super::*;
use crate::surface::{DielectricMaterial, DiffuseMaterial};

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
    // Textures of alpha masks have texture coordinates to go by.
    assert_eq!(s.vertices[s.triangles[0].v[2] as usize].uv, [1.0, 1.0]);
    let s = v3(&format!(
        "{checks}\n{V3_TRIANGLE} \"texture alpha\" \"c\" \"texture shadowalpha\" \"c\"\n{V3_TRIANGLE} \"float alpha\" 0.5\n\
         {V3_TRIANGLE} \"float alpha\" 0 \"float shadowalpha\" 0"
    ));
    assert_eq!(s.shapes.len(), 2);
    assert_eq!(s.shapes[1].alpha, NONE);
    assert_eq!(s.alphas[0].test, AlphaTest::NotZero);
    assert!(s.alphas.iter().all(|a| a.shadow.is_none()) && s.warnings.is_empty());
    // Shadows of their own, of what is there otherwise.
    let s = v3(&format!(
        "{checks}\n{V3_TRIANGLE} \"texture shadowalpha\" \"c\"\n{V3_TRIANGLE} \"float shadowalpha\" 0\n\
         {V3_TRIANGLE} \"texture alpha\" \"c\" \"float shadowalpha\" 0\n{V3_TRIANGLE} \"float shadowalpha\" 2"
    ));
    let shadows: Vec<_> = s.alphas.iter().map(|a| (a.value, a.shadow)).collect();
    let (here, none) = (Param::Constant([1.0; 3]), Param::Constant([0.0; 3]));
    let texture = Param::Texture(0);
    assert_eq!(
        shadows,
        [
            (here, Some(texture)),
            (here, Some(none)),
            (texture, Some(none))
        ]
    );
    assert_eq!(s.shapes[3].alpha, NONE);
    assert_eq!(s.vertices[s.triangles[0].v[2] as usize].uv, [1.0, 1.0]);
    assert!(
        s.warnings.len() == 3 && s.warnings[0].contains("\"shadowalpha\": shadows other than"),
        "{:?}",
        s.warnings
    );
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
