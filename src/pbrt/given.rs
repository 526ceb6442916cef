//! What a BSDF's file reads its parameters from: a directive, and the textures it may name.

use std::fmt;

use super::color::Use;
use super::dialect::Dialect;
use super::error::SceneError;
use super::media::preset;
use super::params::{ParamSet, Type};
use super::spectrum;
use super::textures::{TextureNames, color_param, float_param};
use crate::formats::file_bytes;
use crate::scene::spectrum::IndexCurve;
use crate::scene::{Param, Parameters, Rgb};

/// The parameters of a directive, and the textures that they may name.
pub(super) struct Given<'a> {
    /// The type of the directive.
    pub kind: &'a str,
    pub set: &'a ParamSet,
    pub names: &'a TextureNames,
}

impl<'a> Given<'a> {
    /// Of a directive whose type does not matter.
    pub fn plain(set: &'a ParamSet, names: &'a TextureNames) -> Self {
        let kind = "";
        Self { kind, set, names }
    }
}

impl Parameters for Given<'_> {
    type Error = SceneError;

    fn dialect(&self) -> Dialect {
        self.set.dialect
    }

    fn kind(&self) -> &str {
        self.kind
    }

    fn has(&self, name: &str) -> bool {
        self.set.has(name)
    }

    fn error(&self, message: impl fmt::Display) -> SceneError {
        self.set.error(message)
    }

    fn note(&self, message: impl fmt::Display) {
        self.set.note(message);
    }

    fn text(&self, name: &str) -> Result<Option<String>, SceneError> {
        Ok(self.set.string(name)?.map(str::to_owned))
    }

    fn medium(&self, name: &str) -> Option<[Rgb; 2]> {
        preset(name)
    }

    fn albedo(&self, name: &str) -> Result<Option<Param>, SceneError> {
        color_param(self.set, self.names, name, Use::Albedo)
    }

    fn coefficient(&self, name: &str) -> Result<Option<Param>, SceneError> {
        color_param(self.set, self.names, name, Use::Unbounded)
    }

    fn float(&self, name: &str) -> Result<Option<Param>, SceneError> {
        float_param(self.set, self.names, name)
    }

    fn constant(&self, name: &str, default: f64, low: f64, high: f64) -> Result<f64, SceneError> {
        self.set.float_in(name, default, low, high)
    }

    fn flag(&self, name: &str, default: bool) -> Result<bool, SceneError> {
        self.set.bool_or(name, default)
    }

    fn index(&self, name: &str) -> Result<Option<Param>, SceneError> {
        color_param(self.set, self.names, name, Use::Index)
    }

    fn grey_index(&self, name: &str) -> Result<Option<Param>, SceneError> {
        let given = self.set.find(name);
        if given.is_some_and(|p| p.ty == Type::Float) {
            return self.float(name);
        }
        // A colour is no spectrum: the index is one number, that of its green.
        Ok(self.index(name)?.map(|eta| match eta {
            Param::Constant(c) => Param::Constant([c[1]; 3]),
            texture => texture,
        }))
    }

    fn index_curve(&self, name: &str) -> Result<Option<IndexCurve>, SceneError> {
        match self.set.find(name) {
            Some(given) => self.set.index_curve(given),
            None => Ok(None),
        }
    }

    fn hats(&self, wavelengths: &[f32]) -> Result<Vec<[f64; 3]>, String> {
        spectrum::hats(wavelengths)
    }

    fn file(&self, name: &str, most: u64) -> Result<Option<Vec<u8>>, SceneError> {
        let Some(given) = self.set.string(name)? else {
            return Ok(None);
        };
        let path = self.set.dir.join(given);
        let fail = |what: String| self.error(format_args!("{}: {what}", path.display()));
        let size = file_bytes(&path).map_err(|e| fail(e.to_string()))?;
        if size > most {
            return Err(fail(format!(
                "{size} bytes are too many, {most} are possible"
            )));
        }
        let bytes = std::fs::read(&path).map_err(|e| fail(e.to_string()))?;
        Ok(Some(bytes))
    }

    fn known_index(&self, name: &str) -> Option<Rgb> {
        match self.set.dialect {
            Dialect::V3 => spectrum::named_spd_file(name),
            Dialect::V4 => spectrum::named(name),
        }
    }
}
