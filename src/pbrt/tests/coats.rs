//! Coated materials.

use super::*;
use crate::surface::{CoatLayer, CoatMaterial, CoatedConductorMaterial, CoatedDiffuseMaterial};

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
