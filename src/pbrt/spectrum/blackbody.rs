//! The light of black bodies, and of the sky.

use super::illuminants::ILLUMINANT_D60;
use super::reduce::{Meaning, finish, reduce_law, to_xyz, unit_light};
use crate::scene::spectrum::{CIE_1931, CIE_FIRST, interpolate, xyz_to_rgb};

/// Planck's law in arbitrary units, finite for every temperature: relative to its exponential at
/// the end of the visible range.
fn planck_shape(nanometres: f64, kelvin: f64) -> f64 {
    let x = |nm: f64| PLANCK_C2 / (nm * kelvin);
    let last = (CIE_FIRST + CIE_1931.len() - 1) as f64;
    (x(last) - x(nanometres)).exp() / (-(-x(nanometres)).exp_m1() * (nanometres * 1e-3).powi(5))
}

/// `h c / k_B` in nanometre kelvins (CODATA 2018).
const PLANCK_C2: f64 = 1.438_776_877e7;
/// Wien's displacement constant in nanometre kelvins (CODATA 2018).
const WIEN: f64 = 2.897_771_955e6;

/// The colour of a black body at luminance 1 (`0.2127 R + 0.7152 G + 0.0722 B = 1`; out-of-gamut
/// channels are cut to 0 after the luminance is set). That is what a pbrt-v4 light given
/// `"blackbody" T` and scale 1 emits: pbrt-v4 normalises the spectrum to a maximum of 1, which
/// cancels, and divides by its photometric integral. Black for temperatures that are not
/// positive or so low that nothing visible is left.
pub fn blackbody(kelvin: f32) -> [f32; 3] {
    if !(kelvin > 0.0 && kelvin.is_finite()) {
        return [0.0; 3];
    }
    unit_light(|l| planck_shape(l, kelvin as f64))
}

/// pbrt-v4's `"blackbody" T` as a reflectance: the law divided by its value at Wien's maximum,
/// visible or not.
pub fn blackbody_reflectance(kelvin: f32) -> [f32; 3] {
    let reflectance = planck_of_peak(kelvin.into());
    reduce_law(|l| reflectance(l).clamp(0.0, 1.0), Meaning::Reflectance)
}

/// Planck's law relative to its maximum.
fn planck_of_peak(kelvin: f64) -> impl Fn(f64) -> f64 {
    let law = move |nm: f64| 1.0 / ((PLANCK_C2 / (nm * kelvin)).exp_m1() * (nm * 1e-3).powi(5));
    let peak = law(WIEN / kelvin);
    move |nm| law(nm) / peak
}

/// CIE `x y` of daylight, of a black body where daylight is not defined (below 4000 K), as pbrt-v4
/// balances films for: the temperature is that of today's second radiation constant.
pub fn daylight(kelvin: f64) -> [f64; 2] {
    let cct = kelvin * (1.4388 / 1.4380);
    if cct < 4000.0 {
        let [x, y, z] = to_xyz(|l| planck_shape(l, cct));
        return [x / (x + y + z), y / (x + y + z)];
    }
    let powers = match cct <= 7000.0 {
        true => [0.244063, 0.09911e3, 2.9678e6, -4.6070e9],
        false => [0.237040, 0.24748e3, 1.9018e6, -2.0064e9],
    };
    let x = powers.iter().rev().fold(0.0, |sum, c| sum / cct + c);
    [x, -3.0 * x * x + 2.870 * x - 0.275]
}

/// CIE XYZ of the white of ACES, `Y` 1.
pub fn white_of_d60() -> [f64; 3] {
    let [x, y, z] = to_xyz(|l| interpolate(&ILLUMINANT_D60, l));
    [x / y, 1.0, z / y]
}

/// pbrt-v3's `"blackbody" [T scale]` with scale 1: the spectrum divided by its value at Wien's
/// maximum, visible or not, and reduced as an illuminant. So an orange lamp is darker than 1.
pub fn blackbody_v3(kelvin: f32) -> [f32; 3] {
    if !(kelvin > 0.0 && kelvin.is_finite()) {
        return [0.0; 3];
    }
    let rgb = xyz_to_rgb(to_xyz(planck_of_peak(kelvin.into())));
    if rgb.iter().all(|v| v.is_finite()) {
        finish(rgb)
    } else {
        [0.0; 3]
    }
}

/// What a pbrt-v4 film sees of a medium at a temperature: the spectrum has a maximum of 1, and
/// nothing divides it by its photometric integral, as is done for lights.
pub fn blackbody_medium(kelvin: f32) -> [f32; 3] {
    // Integral of the observer's Y, in nanometres.
    let y: f32 = CIE_1931.iter().map(|cie| cie[1]).sum();
    blackbody_v3(kelvin).map(|c| c * y)
}
