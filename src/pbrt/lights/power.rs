//! How much a light sends, in the units of both dialects.

use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::SceneError;
use crate::pbrt::params::{ParamSet, Type};
use crate::scene::Rgb;

/// `name` times `scale`; the white of the colour space if there is no `name`.
pub(super) fn emission(set: &ParamSet, name: &str) -> Result<Rgb, SceneError> {
    let value = set.color(name, Use::Emission)?;
    scaled(set, value.unwrap_or_else(|| set.color_space.illuminant()))
}

/// The same, of a light that may show an image in place of `name`. Images have a white of their
/// own.
pub(super) fn emission_or_image(set: &ParamSet, name: &str) -> Result<Rgb, SceneError> {
    match set.dialect {
        Dialect::V4 if names_image(set)? => scaled(set, [1.0; 3]),
        _ => emission(set, name),
    }
}

pub(super) fn scaled(set: &ParamSet, value: Rgb) -> Result<Rgb, SceneError> {
    let scale = match (set.dialect, set.find("scale").map(|p| p.ty)) {
        // A v3 scale is a colour, yet many files write a plain number, as v4 does.
        (Dialect::V3, Some(ty)) if ty != Type::Float => {
            set.color("scale", Use::Unbounded)?.unwrap_or([1.0; 3])
        }
        _ => [set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32; 3],
    };
    Ok([
        value[0] * scale[0],
        value[1] * scale[1],
        value[2] * scale[2],
    ])
}

/// v4's `power` or `illuminance`: replaces the unit by a target that `k` units of the light reach.
pub(super) fn with_unit(set: &ParamSet, value: Rgb, name: &str, k: f64) -> Result<Rgb, SceneError> {
    if set.dialect == Dialect::V3 {
        return Ok(value);
    }
    let target = set.float_or(name, -1.0)?;
    let factor = target / k;
    if target <= 0.0 {
        return Ok(value);
    }
    if !(factor as f32).is_finite() {
        return Err(set.error(format_args!(
            "\"{name}\" cannot be reached: the light has no extent"
        )));
    }
    Ok(value.map(|c| c * factor as f32))
}

/// In v4 an image takes the place of a spectrum.
pub(super) fn check_exclusive(set: &ParamSet) -> Result<(), SceneError> {
    if set.dialect == Dialect::V3 {
        return Ok(());
    }
    if names_image(set)? && set.has("L") {
        return Err(
            set.error("\"L\" and \"filename\" exclude each other; scale the image with \"scale\"")
        );
    }
    Ok(())
}

/// Whether a v4 light shows an image.
pub(super) fn names_image(set: &ParamSet) -> Result<bool, SceneError> {
    Ok(set.string("filename")?.is_some_and(|f| !f.is_empty()))
}
