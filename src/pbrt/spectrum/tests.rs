//! Colours of spectra, against closed forms and published figures.

use super::named::metal;
use super::*;
use crate::scene::spectrum::{Sample, interpolate, luminance, xyz_to_rgb};

fn assert_near(a: [f32; 3], b: [f32; 3], relative: f32) {
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= relative * y.abs(), "{a:?} is not {b:?}");
    }
}

#[test]
fn copper_as_in_pbrt_v3() {
    let eta = named_spd_file("spds/metals/Cu.eta.spd").unwrap();
    let k = named_spd_file("Cu.k.spd").unwrap();
    assert_near(eta, [0.200_437_7, 0.924_033_4, 1.102_212], 1e-3);
    assert_near(k, [3.912_948_5, 2.452_847_7, 2.142_188], 1e-3);
}

#[test]
fn constants() {
    assert_near(
        samples(&[(500.0, 0.3)], Meaning::Reflectance).unwrap(),
        [0.3; 3],
        1e-6,
    );
    let one = [(300.0, 1.0), (900.0, 1.0)];
    assert_near(
        samples(&one, Meaning::Illuminant).unwrap(),
        [1.2048, 0.9483, 0.9087],
        1e-3,
    );
}

/// Fresnel reflectance at normal incidence from the reduced index, against the integral over the
/// spectrum under D65.
#[test]
fn metals_keep_their_colour() {
    let fresnel = |n: f64, k: f64| ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
    for element in ["Ag", "Al", "Cu", "CuZn", "MgO", "TiO2"] {
        let (n, k) = (metal(element, "eta").unwrap(), metal(element, "k").unwrap());
        let spectrum: Vec<Sample> = (360..=830)
            .map(|l| {
                (
                    l as f32,
                    fresnel(interpolate(n, l as f64), interpolate(k, l as f64)) as f32,
                )
            })
            .collect();
        let expected = samples(&spectrum, Meaning::Reflectance).unwrap();
        let n = named(&format!("metal-{element}-eta")).unwrap();
        let k = named(&format!("metal-{element}-k")).unwrap();
        for i in 0..3 {
            let got = fresnel(n[i] as f64, k[i] as f64) as f32;
            assert!(
                (got - expected[i]).abs() < 0.02,
                "{element} channel {i}: {got}, integrated {}",
                expected[i]
            );
        }
    }
}

#[test]
fn illuminants() {
    // D65 is the white of sRGB; A is (0.44757, 0.40745) by definition.
    assert_near(named("stdillum-D65").unwrap(), [1.0; 3], 2e-3);
    let a =
        xyz_to_rgb([0.44757 / 0.40745, 1.0, (1.0 - 0.44757 - 0.40745) / 0.40745]).map(|v| v as f32);
    assert_near(named("stdillum-A").unwrap(), a, 5e-3);
    for i in 1..=12 {
        assert!((luminance(named(&format!("stdillum-F{i}")).unwrap()) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn names() {
    assert_near(named("glass-BK7").unwrap(), [1.5168; 3], 1e-5);
    let metals = ["Ag", "Al", "Au", "Cu", "CuZn", "MgO", "TiO2"].map(|m| format!("metal-{m}"));
    let metals = metals
        .iter()
        .flat_map(|m| [format!("{m}-eta"), format!("{m}-k")]);
    let glasses =
        ["BK7", "BAF10", "FK51A", "LASF9", "F5", "F10", "F11"].map(|g| format!("glass-{g}"));
    let white = [
        "stdillum-A",
        "stdillum-D50",
        "stdillum-D65",
        "illum-acesD60",
    ]
    .map(String::from);
    let tubes = (1..=12).map(|i| format!("stdillum-F{i}"));
    let all: Vec<String> = metals.chain(glasses).chain(white).chain(tubes).collect();
    assert_eq!(all.len(), 14 + 7 + 4 + 12);
    for name in &all {
        let rgb = named(name).unwrap_or_else(|| panic!("{name}"));
        assert!(
            rgb.iter().all(|v| v.is_finite() && *v >= 0.0),
            "{name} {rgb:?}"
        );
        assert!(!is_sensor(name));
        if let Some(metal) = name.strip_prefix("metal-") {
            let file = format!("spds/metals/{}.spd", metal.replace('-', "."));
            assert!(named_spd_file(&file).is_some(), "{file}");
        }
    }
    assert!(is_sensor("canon_eos_5d_r") && is_sensor("nikon_d810_b"));
    // Light bulbs are red, D50 a little; gold reflects red, green, blue in this order.
    let order = |[r, g, b]: [f32; 3]| r > g && g > b;
    assert!(order(named("stdillum-A").unwrap()) && order(named("stdillum-D50").unwrap()));
    let (n, k) = (named("metal-Au-eta").unwrap(), named("metal-Au-k").unwrap());
    let reflected = |c: usize| {
        let kk = k[c] * k[c];
        ((n[c] - 1.0).powi(2) + kk) / ((n[c] + 1.0).powi(2) + kk)
    };
    assert!(order([0, 1, 2].map(reflected)) && reflected(0) > 0.9 && reflected(2) < 0.5);
    for unknown in [
        "canon_eos_5d_r",
        "glass-",
        "metal-Cu",
        "metal-Xx-k",
        "metal-Cu-q",
        "",
    ] {
        assert_eq!(named(unknown), None);
    }
    for unknown in ["Cu.spd", "x/Xx.eta.spd", "Cu.eta", ""] {
        assert_eq!(named_spd_file(unknown), None);
    }
}

#[test]
fn black_bodies() {
    for kelvin in [800.0, 1500.0, 2856.0, 6504.0, 20000.0, 1e9] {
        let rgb = blackbody(kelvin);
        let y = luminance(rgb);
        // Channels out of gamut are cut after the luminance is set: the others keep their value.
        let is_cut = rgb.contains(&0.0);
        assert!((y - 1.0).abs() < 1e-5 || is_cut && y > 1.0, "{kelvin}: {y}");
    }
    assert_near(blackbody(2856.0), named("stdillum-A").unwrap(), 1e-2);
    for kelvin in [0.0, -5.0, 1e-30, 1.0, f32::NAN, f32::INFINITY, f32::MAX] {
        assert!(
            blackbody(kelvin)
                .iter()
                .chain(&blackbody_v3(kelvin))
                .all(|v| v.is_finite() && *v >= 0.0)
        );
    }
    // At 5000 K the maximum is at 580 nm, so the whole visible range is close to 1.
    let y = luminance(blackbody_v3(5000.0));
    assert!((0.95..1.0).contains(&y), "{y}");
}

#[test]
fn hostile_samples() {
    assert!(samples(&[], Meaning::Reflectance).is_err());
    assert!(samples(&[(f32::NAN, 1.0)], Meaning::Reflectance).is_err());
    assert!(samples(&[(500.0, f32::INFINITY)], Meaning::Reflectance).is_err());
    let step = [(600.0, 1.0), (500.0, 0.0), (500.0, 1.0), (400.0, 0.0)];
    assert!(
        samples(&step, Meaning::Reflectance)
            .unwrap()
            .iter()
            .all(|v| v.is_finite())
    );
}
