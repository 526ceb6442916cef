//! Colours and spectra of both dialects, reduced to linear sRGB.

use super::color_space::narrow;
use super::dialect::Dialect;
use super::error::SceneError;
use super::params::{Param, ParamSet, Type, Values};
use super::spectrum::{self, Meaning};
use crate::scene::Rgb;
use crate::scene::spectrum::{IndexCurve, Sample, xyz_to_rgb};

/// What a colour is for; decides about clamping and normalisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// A reflectance; v4 clamps it to `[0, 1]`.
    Albedo,
    /// A texture's value: what it is for shows only where it is used.
    Unbounded,
    /// Index of refraction, absorption coefficient.
    Index,
    /// Emission. v4 scales every light by the inverse of its spectrum's luminous efficacy, so a
    /// spectrum that is not `rgb` has luminance 1 whatever its samples' magnitude.
    Emission,
}

impl ParamSet {
    /// A colour parameter of any of the types that stand for one.
    pub fn color(&self, name: &str, meaning: Use) -> Result<Option<Rgb>, SceneError> {
        let Some(param) = self.find(name) else {
            return Ok(None);
        };
        if self.dialect == Dialect::V3 && !self.is_color(param, meaning)? {
            return Ok(None);
        }
        self.color_of(param, meaning).map(Some)
    }

    /// v3: whether a parameter is a colour, or for materials and textures at least begins with one.
    /// If not, it is left out with a word.
    fn is_color(&self, param: &Param, meaning: Use) -> Result<bool, SceneError> {
        let size = match (param.ty, &param.values) {
            (Type::Rgb | Type::Xyz, Values::Numbers(_)) => 3,
            (Type::Blackbody, Values::Numbers(_)) => 2,
            (Type::Spectrum, Values::Numbers(v)) => v.len(),
            (Type::Spectrum, _) => return Ok(true),
            _ => {
                let what = "is no colour; expected rgb, xyz, spectrum or blackbody";
                return Ok(self.left_out::<()>(param, what)?.is_some());
            }
        };
        let given = param.values.len();
        if given == 0 || given != size && meaning == Use::Emission {
            let what = format!("has {given} numbers where {size} make a colour");
            return Ok(self.left_out::<()>(param, &what)?.is_some());
        }
        if given != size {
            self.note_at(param, "the first of its values is used");
        }
        Ok(true)
    }

    /// The colour a parameter means, or an error if it is of no such type.
    pub fn color_of(&self, param: &Param, meaning: Use) -> Result<Rgb, SceneError> {
        let fail = |what: String| self.error_at(param, what);
        let spectrum_meaning = match (meaning, self.dialect) {
            (Use::Emission, _) => Meaning::Illuminant,
            (_, Dialect::V3) => Meaning::OfV3,
            _ => Meaning::Reflectance,
        };
        let three = |v: &[f64]| match *v {
            [r, g, b] => Ok([r, g, b]),
            [r, g, b, ..] if self.dialect == Dialect::V3 => Ok([r, g, b]),
            _ => Err(fail(format!("expected 3 values, found {}", v.len()))),
        };
        let rgb = match (param.ty, &param.values) {
            (Type::Rgb, Values::Numbers(v)) => narrow(match meaning {
                Use::Emission => param.color_space.emission_to_srgb(three(v)?),
                _ => param.color_space.to_srgb(three(v)?),
            }),
            (Type::Xyz, Values::Numbers(v)) => narrow(xyz_to_rgb(three(v)?)),
            (Type::Blackbody, Values::Numbers(v)) => self.blackbody(v, meaning).map_err(fail)?,
            (Type::Spectrum, Values::Numbers(v)) => {
                if v.is_empty() || v.len() % 2 != 0 {
                    return Err(fail(format!(
                        "a spectrum is a list of wavelengths and values in turn, found {} numbers",
                        v.len()
                    )));
                }
                self.reduced(&pairs(v), meaning, spectrum_meaning)
                    .map_err(fail)?
            }
            (Type::Spectrum, Values::Strings(v)) => (self)
                .named_spectrum(param, v, meaning, spectrum_meaning)
                .map_err(fail)?,
            _ => {
                return Err(fail(
                    "is no colour; expected rgb, xyz, spectrum or blackbody".to_owned(),
                ));
            }
        };
        if !rgb.iter().all(|c| c.is_finite()) {
            return Err(fail("is out of range".to_owned()));
        }
        // Conversions leave the bounds by a little.
        const SLACK: f32 = 1e-3;
        if rgb.iter().any(|c| *c < -SLACK) {
            self.note_at(param, "is negative, and counts as 0");
        }
        let bounded = meaning == Use::Albedo && self.dialect == Dialect::V4;
        if bounded && rgb.iter().any(|c| *c > 1.0 + SLACK) {
            self.note_at(param, "is more than 1, and counts as 1");
        }
        Ok(match (self.dialect, meaning) {
            (Dialect::V4, Use::Albedo) => rgb.map(|c| c.clamp(0.0, 1.0)),
            _ => rgb.map(|c| c.max(0.0)),
        })
    }

    /// Light of a temperature; v3 writes a temperature and a factor.
    fn blackbody(&self, values: &[f64], meaning: Use) -> Result<Rgb, String> {
        let (kelvin, scale) = match *values {
            [kelvin] => (kelvin, 1.0),
            [kelvin, scale] => (kelvin, scale),
            [kelvin, scale, ..] if self.dialect == Dialect::V3 => (kelvin, scale),
            _ => {
                return Err(format!(
                    "expected a temperature in kelvin, found {} values",
                    values.len()
                ));
            }
        };
        if !(1.0..=1e6).contains(&kelvin) {
            return Err(format!(
                "temperature {kelvin} is not between 1 and 1000000 kelvin"
            ));
        }
        let color = match (self.dialect, meaning) {
            (Dialect::V3, _) => spectrum::blackbody_v3(kelvin as f32),
            (_, Use::Emission) => spectrum::blackbody(kelvin as f32),
            _ => spectrum::blackbody_reflectance(kelvin as f32),
        };
        Ok(color.map(|c| c * scale as f32))
    }

    /// A spectrum known by name, or that of a file of samples.
    fn named_spectrum(
        &self,
        param: &Param,
        names: &[String],
        meaning: Use,
        spectrum_meaning: Meaning,
    ) -> Result<Rgb, String> {
        let [name] = names else {
            return Err(format!(
                "expected the name of one spectrum, found {}",
                names.len()
            ));
        };
        let path = self.dir.join(name);
        if path.is_file() {
            return spectrum::read_spd(&path)
                .and_then(|pairs| self.reduced(&pairs, meaning, spectrum_meaning));
        }
        // v3 scenes often come without the files of measured metals they name.
        let known = spectrum::named(name).or_else(|| spectrum::named_spd_file(name));
        let known = known.or_else(|| self.black_for(param, name));
        known.ok_or_else(|| {
            if spectrum::is_sensor(name) {
                return format!(
                    "\"{name}\" is the response of a camera's sensor, not a colour; use \"rgb {}\" instead",
                    param.name
                );
            }
            format!(
                "\"{name}\" is neither a spectrum known by name nor a file; use \"rgb {}\" instead",
                param.name
            )
        })
    }

    /// v3: what stands for a file of samples that is missing.
    fn black_for(&self, param: &Param, name: &str) -> Option<Rgb> {
        if self.dialect == Dialect::V4 {
            return None;
        }
        let what = format_args!("there is no file \"{name}\"; it is black, as in pbrt-v3");
        self.note_at(param, what);
        Some([0.0; 3])
    }

    /// The index of refraction that a spectrum means, over the wavelength; `None` if the parameter
    /// is no spectrum, or the same everywhere.
    pub fn index_curve(&self, param: &Param) -> Result<Option<IndexCurve>, SceneError> {
        let fail = |what: String| self.error_at(param, what);
        let curve = match (param.ty, &param.values) {
            // An odd list is an error wherever it stands.
            (Type::Spectrum, Values::Numbers(v)) if v.len() % 2 == 0 && !v.is_empty() => {
                spectrum::index_samples(&pairs(v)).map_err(fail)?
            }
            (Type::Spectrum, Values::Strings(v)) if v.len() == 1 => {
                let path = self.dir.join(&v[0]);
                if path.is_file() {
                    let samples = spectrum::read_spd(&path).map_err(fail)?;
                    spectrum::index_samples(&samples).map_err(fail)?
                } else {
                    match spectrum::named_index(&v[0]) {
                        Some(curve) => curve,
                        None => return Ok(None),
                    }
                }
            }
            _ => return Ok(None),
        };
        if curve.is_constant() {
            return Ok(None);
        }
        match curve.range() {
            [least, _] if least <= 0.0 => Err(fail(format!(
                "index of refraction {least} is not positive; glass has 1.5"
            ))),
            _ => Ok(Some(curve)),
        }
    }

    /// The colour of measured samples. v3 holds the ends, v4 has nothing beyond them; where an
    /// index of refraction ends, it is held all the same, as pbrt-v4 has no use for one of 0
    /// either.
    fn reduced(&self, samples: &[Sample], of: Use, meaning: Meaning) -> Result<Rgb, String> {
        match (self.dialect, of) {
            (Dialect::V3, _) | (_, Use::Index) => spectrum::samples(samples, meaning),
            (_, Use::Emission) => spectrum::light_samples(samples),
            _ => spectrum::bounded_samples(samples, meaning),
        }
    }
}

/// Wavelengths and values in turn.
fn pairs(v: &[f64]) -> Vec<Sample> {
    let pairs = v.chunks_exact(2);
    pairs.map(|p| (p[0] as f32, p[1] as f32)).collect()
}
