//! Spectra reduced to linear sRGB at load. Nothing downstream knows wavelengths but what disperses light: [`IndexCurve`], [`responses`].
//!
//! Every reduction integrates against the CIE 1931 2-degree observer in steps of 1 nm from 360 to 830 nm and converts XYZ
//! to Rec. 709 primaries with the matrix pbrt-v3 uses. They differ in what counts as white:
//!
//! - a *reflectance* is seen under D65 and divided by the same integral of a perfect white, so a constant `c` becomes `(c, c, c)`;
//! - an *illuminant* keeps its own colour and magnitude: X, Y, Z are divided by the integral of the observer's Y, as
//!   pbrt-v3 does, so a constant 1 becomes `(1.2049, 0.9482, 0.9093)`;
//! - an *index* (eta or k of a metal) reduces like a reflectance in pbrt-v4 scenes, where it must stand in for a spectral
//!   render: Fresnel reflectances of Cu, Ag, Al, MgO, TiO2 then lie within 0.01 of the integrated ones. pbrt-v3 in RGB mode
//!   puts it through the illuminant's formula; [`named_spd_file`] and [`Meaning::Index`] reproduce that.

mod glass;
mod index;
mod response;
mod tables;

pub use self::glass::{Sellmeier, glass_index};
pub use self::index::IndexCurve;
pub use self::response::{FIRST, LAST, responses, spectral_white};

use crate::formats::file_bytes;
use std::fs;
use std::path::Path;

use tables::{CIE_1931, CIE_FIRST};

/// (wavelength in nanometres, value)
pub type Sample = (f32, f32);

/// What the values of a spectrum stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Fraction reflected or transmitted, or another quantity without a colour of its own.
    Reflectance,
    /// Radiance, intensity or irradiance per wavelength.
    Illuminant,
    /// pbrt-v3's `eta` and `k`.
    Index,
}

/// Largest `.spd` file read, and longest list of samples; measured spectra have a few thousand lines at most.
const MAX_SPD_BYTES: u64 = 1 << 20;
const MAX_SAMPLES: usize = 1 << 18;

/// XYZ to linear sRGB (Rec. 709 primaries, D65 white), rounded as in pbrt-v3.
const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_RGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// Relative luminance Y of a linear sRGB colour (inverse of the matrix above).
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2]
}

/// Integral of `f(wavelength in nm)` times the observer over the integral of the observer's Y.
fn to_xyz(f: impl Fn(f64) -> f64) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    let mut y = 0.0;
    for (i, cie) in CIE_1931.iter().enumerate() {
        let value = f((CIE_FIRST + i) as f64);
        for (sum, &c) in xyz.iter_mut().zip(cie) {
            *sum += value * c as f64;
        }
        y += cie[1] as f64;
    }
    xyz.map(|v| v / y)
}

/// The same, 0 beyond both ends.
fn interpolate_within(spectrum: &[Sample], lambda: f64) -> f64 {
    let (Some(first), Some(last)) = (spectrum.first(), spectrum.last()) else {
        return 0.0;
    };
    if !(f64::from(first.0)..=f64::from(last.0)).contains(&lambda) {
        return 0.0;
    }
    interpolate(spectrum, lambda)
}

/// Linear interpolation, held constant beyond both ends. `spectrum` is sorted and not empty.
fn interpolate(spectrum: &[Sample], lambda: f64) -> f64 {
    let above = spectrum.partition_point(|s| (s.0 as f64) < lambda);
    let Some(&(l1, v1)) = spectrum.get(above) else {
        return spectrum[spectrum.len() - 1].1 as f64;
    };
    if above == 0 {
        return v1 as f64;
    }
    let (l0, v0) = spectrum[above - 1];
    let t = (lambda - l0 as f64) / (l1 as f64 - l0 as f64);
    v0 as f64 + t * (v1 as f64 - v0 as f64)
}

/// Out-of-gamut channels become 0: no table of a scene means a negative value.
fn finish(rgb: [f64; 3]) -> [f32; 3] {
    rgb.map(|v| v.max(0.0) as f32)
}

fn reduce(spectrum: &[Sample], meaning: Meaning) -> [f32; 3] {
    reduce_law(|l| interpolate(spectrum, l), meaning)
}

/// The colour of `f(wavelength in nm)`.
fn reduce_law(f: impl Fn(f64) -> f64, meaning: Meaning) -> [f32; 3] {
    match meaning {
        Meaning::Illuminant | Meaning::Index => finish(xyz_to_rgb(to_xyz(f))),
        Meaning::Reflectance => {
            let d65 = |l: f64| interpolate(&tables::ILLUMINANT_D65, l);
            let white = xyz_to_rgb(to_xyz(d65));
            let seen = xyz_to_rgb(to_xyz(|l| d65(l) * f(l)));
            finish(std::array::from_fn(|i| seen[i] / white[i]))
        }
    }
}

/// The colour of `f(wavelength in nm)` at luminance 1, as pbrt-v4 has every light; channels out of gamut are cut to 0 after that, so that the
/// others keep their value. Black if there is no light to speak of.
fn unit_light(f: impl Fn(f64) -> f64) -> [f32; 3] {
    let xyz = to_xyz(f);
    if !(xyz[1].is_normal() && xyz[1] > 0.0 && xyz.iter().all(|v| v.is_finite())) {
        return [0.0; 3];
    }
    finish(xyz_to_rgb(xyz.map(|v| v / xyz[1])))
}

/// Reduces pairs of wavelength (nm) and value, in any order, interpolated linearly and held constant beyond the ends. The
/// scale of an illuminant is kept (pbrt-v3).
pub fn samples(lambda_value: &[Sample], meaning: Meaning) -> Result<[f32; 3], String> {
    Ok(reduce(&sorted(lambda_value)?, meaning))
}

/// The same, but 0 beyond the ends (pbrt-v4).
pub fn bounded_samples(lambda_value: &[Sample], meaning: Meaning) -> Result<[f32; 3], String> {
    let sorted = sorted(lambda_value)?;
    Ok(reduce_law(|l| interpolate_within(&sorted, l), meaning))
}

/// What a pbrt-v4 light of such a spectrum sends: 0 beyond the ends, luminance 1.
pub fn light_samples(lambda_value: &[Sample]) -> Result<[f32; 3], String> {
    let sorted = sorted(lambda_value)?;
    Ok(unit_light(|l| interpolate_within(&sorted, l)))
}

/// Checked, and by wavelength.
fn sorted(lambda_value: &[Sample]) -> Result<Vec<Sample>, String> {
    check(lambda_value)?;
    let mut sorted = lambda_value.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(sorted)
}

/// What keeps pairs of wavelength and value from being a spectrum, if anything.
fn check(lambda_value: &[Sample]) -> Result<(), String> {
    if lambda_value.is_empty() {
        return Err("a spectrum needs at least one pair of wavelength and value".into());
    }
    if lambda_value.len() > MAX_SAMPLES {
        let count = lambda_value.len();
        return Err(format!("{count} samples are too many for a spectrum"));
    }
    for &(lambda, value) in lambda_value {
        if !(lambda > 0.0 && lambda.is_finite()) {
            return Err(format!("{lambda} is not a wavelength in nanometres"));
        }
        if !value.is_finite() {
            return Err(format!("value {value} at {lambda} nm is not finite"));
        }
    }
    Ok(())
}

/// An index of refraction over the wavelength from pairs of wavelength (nm) and value; see [`IndexCurve::of_samples`].
pub fn index_samples(lambda_value: &[Sample]) -> Result<IndexCurve, String> {
    check(lambda_value)?;
    Ok(IndexCurve::of_samples(lambda_value))
}

/// Planck's law in arbitrary units, finite for every temperature: relative to its exponential at the end of the visible range.
fn planck_shape(nanometres: f64, kelvin: f64) -> f64 {
    let x = |nm: f64| PLANCK_C2 / (nm * kelvin);
    let last = (CIE_FIRST + CIE_1931.len() - 1) as f64;
    (x(last) - x(nanometres)).exp() / (-(-x(nanometres)).exp_m1() * (nanometres * 1e-3).powi(5))
}

/// `h c / k_B` in nanometre kelvins (CODATA 2018).
const PLANCK_C2: f64 = 1.438_776_877e7;
/// Wien's displacement constant in nanometre kelvins (CODATA 2018).
const WIEN: f64 = 2.897_771_955e6;

/// The colour of a black body at luminance 1 (`0.2127 R + 0.7152 G + 0.0722 B = 1`; out-of-gamut channels are cut to 0 after
/// the luminance is set). That is what a pbrt-v4 light given `"blackbody" T` and scale 1 emits: pbrt-v4 normalises the
/// spectrum to a maximum of 1, which cancels, and divides by its photometric integral. Black for temperatures that are not
/// positive or so low that nothing visible is left.
pub fn blackbody(kelvin: f32) -> [f32; 3] {
    if !(kelvin > 0.0 && kelvin.is_finite()) {
        return [0.0; 3];
    }
    unit_light(|l| planck_shape(l, kelvin as f64))
}

/// pbrt-v4's `"blackbody" T` as a reflectance: the law divided by its value at Wien's maximum, visible or not.
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

/// CIE `x y` of daylight, of a black body where daylight is not defined (below 4000 K), as pbrt-v4 balances films for: the temperature is
/// that of today's second radiation constant.
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
    let [x, y, z] = to_xyz(|l| interpolate(&tables::ILLUMINANT_D60, l));
    [x / y, 1.0, z / y]
}

/// pbrt-v3's `"blackbody" [T scale]` with scale 1: the spectrum divided by its value at Wien's maximum, visible or not, and
/// reduced as an illuminant. An orange lamp is therefore darker than 1.
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

/// pbrt-v4's named spectra.
///
/// - `metal-{Ag,Al,Au,Cu,CuZn,MgO,TiO2}-{eta,k}`: reduced like a reflectance (see the top of this file);
/// - `glass-...`: the index at the helium d line (587.6 nm), near the maximum of the eye, the same in all channels, as there
///   is no dispersion in RGB;
/// - `stdillum-{A,D50,D65,F1...F12}`, `illum-acesD60`: luminance 1, as pbrt-v4 normalises them.
///
/// Spectral responses of cameras are not colours: `None`, see [`is_sensor`].
pub fn named(name: &str) -> Option<[f32; 3]> {
    if let Some(rest) = name.strip_prefix("metal-") {
        let (element, quantity) = rest.split_once('-')?;
        return Some(reduce(metal(element, quantity)?, Meaning::Reflectance));
    }
    if let Some(glass) = glass_index(name) {
        return Some([glass.at_d() as f32; 3]);
    }
    illuminant(name).map(|s| unit_light(|l| interpolate(s, l)))
}

/// The colour of a measured metal by the file name pbrt-v3 scenes use (`spds/metals/Au.eta.spd`, any folder), for scenes that
/// come without the file. Reduced as pbrt-v3 does ([`Meaning::Index`]); `Cu.eta.spd` and `Cu.k.spd` are pbrt-v3's defaults of
/// `metal`.
pub fn named_spd_file(path: &str) -> Option<[f32; 3]> {
    let file = path.rsplit(['/', '\\']).next()?;
    let (element, quantity) = file.strip_suffix(".spd")?.split_once('.')?;
    Some(reduce(metal(element, quantity)?, Meaning::Index))
}

/// True of the names that pbrt-v4 gives to the responses of cameras' sensors: `canon_eos_100d_r` and so on.
pub fn is_sensor(name: &str) -> bool {
    let makers = ["canon_", "hasselblad_", "nikon_", "sony_"];
    makers.iter().any(|m| name.starts_with(m))
        && ["_r", "_g", "_b"].iter().any(|c| name.ends_with(c))
}

fn metal(element: &str, quantity: &str) -> Option<&'static [Sample]> {
    use tables::*;
    let (eta, k): (&[Sample], &[Sample]) = match element {
        "Ag" => (&AG_ETA, &AG_K),
        "Al" => (&AL_ETA, &AL_K),
        "Au" => (&AU_ETA, &AU_K),
        "Cu" => (&CU_ETA, &CU_K),
        "CuZn" => (&CUZN_ETA, &CUZN_K),
        "MgO" => (&MGO_ETA, &MGO_K),
        "TiO2" => (&TIO2_ETA, &TIO2_K),
        _ => return None,
    };
    match quantity {
        "eta" => Some(eta),
        "k" => Some(k),
        _ => None,
    }
}

fn illuminant(name: &str) -> Option<&'static [Sample]> {
    use tables::*;
    Some(match name {
        "stdillum-A" => &ILLUMINANT_A,
        "stdillum-D50" => &ILLUMINANT_D50,
        "stdillum-D65" => &ILLUMINANT_D65,
        "illum-acesD60" => &ILLUMINANT_D60,
        "stdillum-F1" => &ILLUMINANT_F1,
        "stdillum-F2" => &ILLUMINANT_F2,
        "stdillum-F3" => &ILLUMINANT_F3,
        "stdillum-F4" => &ILLUMINANT_F4,
        "stdillum-F5" => &ILLUMINANT_F5,
        "stdillum-F6" => &ILLUMINANT_F6,
        "stdillum-F7" => &ILLUMINANT_F7,
        "stdillum-F8" => &ILLUMINANT_F8,
        "stdillum-F9" => &ILLUMINANT_F9,
        "stdillum-F10" => &ILLUMINANT_F10,
        "stdillum-F11" => &ILLUMINANT_F11,
        "stdillum-F12" => &ILLUMINANT_F12,
        _ => return None,
    })
}

/// pbrt-v4's named spectra as indices of refraction over the wavelength: glasses, and what it has of metals.
pub fn named_index(name: &str) -> Option<IndexCurve> {
    if let Some(rest) = name.strip_prefix("metal-") {
        let (element, quantity) = rest.split_once('-')?;
        return Some(IndexCurve::of_samples(metal(element, quantity)?));
    }
    glass_index(name).map(|glass| IndexCurve::of(|nm| glass.at(nm)))
}

/// Reads pairs of wavelength (nm) and value, separated by any white space; `#` starts a comment.
pub fn read_spd(path: &Path) -> Result<Vec<Sample>, String> {
    let name = path.display();
    let size = file_bytes(path).map_err(|e| format!("{name}: {e}"))?;
    if size > MAX_SPD_BYTES {
        return Err(format!("{name}: {size} bytes are too many for a spectrum"));
    }
    let text = fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
    let mut numbers = Vec::new();
    for (line, content) in text.lines().enumerate() {
        for word in content.split('#').next().unwrap_or("").split_whitespace() {
            let number = word.parse::<f32>().ok().filter(|v| v.is_finite());
            numbers.push(
                number.ok_or_else(|| format!("{name}:{}: {word:?} is not a number", line + 1))?,
            );
        }
    }
    if numbers.is_empty() {
        return Err(format!("{name}: no pairs of wavelength and value"));
    }
    if !numbers.len().is_multiple_of(2) {
        return Err(format!("{name}: the last wavelength has no value"));
    }
    Ok(numbers
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

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

    /// Fresnel reflectance at normal incidence from the reduced index, against the integral over the spectrum under D65.
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
        let a = xyz_to_rgb([0.44757 / 0.40745, 1.0, (1.0 - 0.44757 - 0.40745) / 0.40745])
            .map(|v| v as f32);
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

    #[test]
    fn spd_files() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        write!(file, "# gold\n400 1.5 # blue\n\n500\t0.5\n").unwrap();
        assert_eq!(
            read_spd(file.path()).unwrap(),
            vec![(400.0, 1.5), (500.0, 0.5)]
        );
        write!(file, "600 x").unwrap();
        assert!(read_spd(file.path()).unwrap_err().contains(":5: \"x\""));
    }
}
