//! Spectra to linear sRGB.

use crate::scene::spectrum::{
    CIE_1931, CIE_FIRST, ILLUMINANT_D65, IndexCurve, Sample, interpolate, xyz_to_rgb,
};

/// What the values of a spectrum stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Fraction reflected or transmitted, or another quantity without a colour of its own.
    Reflectance,
    /// Radiance, intensity or irradiance per wavelength.
    Illuminant,
    /// Whatever is no light in pbrt-v3, reflectances as well as `eta` and `k`: its RGB build
    /// reduces all spectra alike.
    OfV3,
}

/// Longest list of samples.
const MAX_SAMPLES: usize = 1 << 18;

/// Integral of `f(wavelength in nm)` times the observer over the integral of the observer's Y.
pub(super) fn to_xyz(f: impl Fn(f64) -> f64) -> [f64; 3] {
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

/// [`interpolate`], but 0 beyond both ends.
fn interpolate_within(spectrum: &[Sample], lambda: f64) -> f64 {
    let (Some(first), Some(last)) = (spectrum.first(), spectrum.last()) else {
        return 0.0;
    };
    if !(f64::from(first.0)..=f64::from(last.0)).contains(&lambda) {
        return 0.0;
    }
    interpolate(spectrum, lambda)
}

/// Out-of-gamut channels become 0: no table of a scene means a negative value.
pub(super) fn finish(rgb: [f64; 3]) -> [f32; 3] {
    rgb.map(|v| v.max(0.0) as f32)
}

pub(super) fn reduce(spectrum: &[Sample], meaning: Meaning) -> [f32; 3] {
    reduce_law(|l| interpolate(spectrum, l), meaning)
}

/// The colour of `f(wavelength in nm)`.
pub(super) fn reduce_law(f: impl Fn(f64) -> f64, meaning: Meaning) -> [f32; 3] {
    match meaning {
        Meaning::Illuminant | Meaning::OfV3 => finish(xyz_to_rgb(to_xyz(f))),
        Meaning::Reflectance => {
            let d65 = |l: f64| interpolate(&ILLUMINANT_D65, l);
            let white = xyz_to_rgb(to_xyz(d65));
            let seen = xyz_to_rgb(to_xyz(|l| d65(l) * f(l)));
            finish(std::array::from_fn(|i| seen[i] / white[i]))
        }
    }
}

/// For each of these wavelengths, which rise, the colour of a reflectance that is 1 there and falls
/// to 0 at its neighbours; 0 beyond the ends. Channels out of gamut are kept.
pub fn hats(wavelengths: &[f32]) -> Result<Vec<[f64; 3]>, String> {
    let finite = wavelengths.iter().all(|w| w.is_finite());
    if !(finite && wavelengths.is_sorted_by(|a, b| a < b)) {
        return Err("has wavelengths that do not rise".into());
    }
    let d65 = |l: f64| interpolate(&ILLUMINANT_D65, l);
    let white = xyz_to_rgb(to_xyz(d65));
    let mut spectrum: Vec<Sample> = wavelengths.iter().map(|w| (*w, 0.0)).collect();
    let mut all = Vec::with_capacity(wavelengths.len());
    for k in 0..wavelengths.len() {
        spectrum[k].1 = 1.0;
        let seen = xyz_to_rgb(to_xyz(|l| d65(l) * interpolate_within(&spectrum, l)));
        all.push(std::array::from_fn(|i| seen[i] / white[i]));
        spectrum[k].1 = 0.0;
    }
    Ok(all)
}

/// The colour of `f(wavelength in nm)` at luminance 1, as pbrt-v4 has every light; channels out of
/// gamut are cut to 0 after that, so that the others keep their value. Black if there is no light
/// to speak of.
pub(super) fn unit_light(f: impl Fn(f64) -> f64) -> [f32; 3] {
    let xyz = to_xyz(f);
    if !(xyz[1].is_normal() && xyz[1] > 0.0 && xyz.iter().all(|v| v.is_finite())) {
        return [0.0; 3];
    }
    finish(xyz_to_rgb(xyz.map(|v| v / xyz[1])))
}

/// Reduces pairs of wavelength (nm) and value, in any order, interpolated linearly and held
/// constant beyond the ends. The scale of an illuminant is kept (pbrt-v3).
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

/// An index of refraction over the wavelength from pairs of wavelength (nm) and value; see
/// [`IndexCurve::of_samples`].
pub fn index_samples(lambda_value: &[Sample]) -> Result<IndexCurve, String> {
    check(lambda_value)?;
    Ok(IndexCurve::of_samples(lambda_value))
}
