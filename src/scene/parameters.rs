//! What the file of a BSDF reads its parameters from: a directive of a scene file, whoever parses
//! it.

use std::fmt;

use super::Rgb;
use super::material::{Remap, Roughness};
use super::spectrum::IndexCurve;
use super::texture::Param;

/// pbrt-v3 or pbrt-v4. The two write alike but mean different things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// pbrt-v3.
    V3,
    /// pbrt-v4.
    V4,
}

/// The parameters of a material.
pub trait Parameters {
    /// A message with its place in the file.
    type Error;

    /// Of the file it is in.
    fn dialect(&self) -> Dialect;

    /// The name of the material.
    fn kind(&self) -> &str;

    /// Whether it is given.
    fn has(&self, name: &str) -> bool;

    /// An error of the whole directive.
    fn error(&self, message: impl fmt::Display) -> Self::Error;

    /// A warning of the whole directive.
    fn note(&self, message: impl fmt::Display);

    /// A text.
    fn text(&self, name: &str) -> Result<Option<String>, Self::Error>;

    /// Absorption and scattering, per length, of the medium that scene files call so.
    fn medium(&self, name: &str) -> Option<[Rgb; 2]>;

    /// A reflectance or transmittance that may be a texture.
    fn albedo(&self, name: &str) -> Result<Option<Param>, Self::Error>;

    /// A colour without bounds, as of absorption, that may be a texture.
    fn coefficient(&self, name: &str) -> Result<Option<Param>, Self::Error>;

    /// A number that may be a texture.
    fn float(&self, name: &str) -> Result<Option<Param>, Self::Error>;

    /// A constant, within `[low, high]`.
    fn constant(&self, name: &str, default: f64, low: f64, high: f64) -> Result<f64, Self::Error>;

    /// A boolean.
    fn flag(&self, name: &str, default: bool) -> Result<bool, Self::Error>;

    /// An index of refraction or of absorption that may be a texture, channel by channel.
    fn index(&self, name: &str) -> Result<Option<Param>, Self::Error>;

    /// The same as one number, that of green; it may be a texture.
    fn grey_index(&self, name: &str) -> Result<Option<Param>, Self::Error>;

    /// The same as a function of the wavelength, if it is given as one.
    fn index_curve(&self, name: &str) -> Result<Option<IndexCurve>, Self::Error>;

    /// A spectrum that the dialect knows by this name, as an index.
    fn known_index(&self, name: &str) -> Option<Rgb>;

    /// For each wavelength (nm), what a reflectance that is 1 there and falls to 0 at its
    /// neighbours is in linear sRGB, channels below 0 included: with these weights values at the
    /// wavelengths add up to a colour.
    fn hats(&self, wavelengths: &[f32]) -> Result<Vec<[f64; 3]>, String>;

    /// The bytes of the file that it names, `most` at most.
    fn file(&self, name: &str, most: u64) -> Result<Option<Vec<u8>>, Self::Error>;

    /// [`Self::albedo`], or grey if it is not given.
    fn albedo_or(&self, name: &str, default: f32) -> Result<Param, Self::Error> {
        Ok(self.albedo(name)?.unwrap_or(Param::Constant([default; 3])))
    }

    /// [`Self::float`], or a constant if it is not given.
    fn float_or(&self, name: &str, default: f32) -> Result<Param, Self::Error> {
        Ok(self.float(name)?.unwrap_or(Param::Constant([default; 3])))
    }

    /// Of `roughness`, `uroughness` and `vroughness`.
    fn roughness(&self, default: f32) -> Result<Roughness, Self::Error> {
        let both = self.float_or("roughness", default)?;
        self.roughness_or(both)
    }

    /// Of `uroughness` and `vroughness`, or `both`.
    fn roughness_or(&self, both: Param) -> Result<Roughness, Self::Error> {
        let u = self.float("uroughness")?.unwrap_or(both);
        let v = self.float("vroughness")?.unwrap_or(both);
        self.remapped(u, v)
    }

    /// Of a material that has no other parameter for it than `roughness`.
    fn isotropic_roughness(&self, default: f32) -> Result<Roughness, Self::Error> {
        let both = self.float_or("roughness", default)?;
        self.remapped(both, both)
    }

    /// A roughness of these values, remapped unless the file says otherwise.
    fn remapped(&self, u: Param, v: Param) -> Result<Roughness, Self::Error> {
        for value in [u, v] {
            if let Param::Constant([x, ..]) = value
                && x < 0.0
            {
                return Err(self.error(format_args!("roughness {x} is negative")));
            }
        }
        let remap = match (self.flag("remaproughness", true)?, self.dialect()) {
            (false, _) => Remap::None,
            (true, Dialect::V3) => Remap::V3,
            (true, Dialect::V4) => Remap::V4,
        };
        Ok(Roughness { u, v, remap })
    }
}
