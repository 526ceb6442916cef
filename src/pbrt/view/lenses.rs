//! pbrt's `realistic` camera: a system of lenses from a file, put in focus.

use std::path::Path;

use super::aperture::stop_mask;
use crate::camera::lenses::exit_pupils;
use crate::camera::lenses::focus::film_distance;
use crate::formats::file_bytes;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::SceneError;
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::Tables;
use crate::scene::lenses::{LensElement, LensWeighting, Lenses};

/// Of the film, if a scene says nothing, in metres.
pub(in crate::pbrt) const DIAGONAL: f64 = 0.035;

/// Largest lens file read: designs have some twenty lines.
const MAX_BYTES: u64 = 1 << 16;

/// Surfaces of a system; a ray goes through all of them.
const MAX_SURFACES: usize = 200;

/// Millimetres to the metres that a unit of the scene stands for.
const MM: f64 = 1e-3;

/// The diagonal of the film in metres; only lenses ask for it.
pub(in crate::pbrt) fn film_diagonal(set: &ParamSet) -> Result<f64, SceneError> {
    let diagonal = set.float_or("diagonal", DIAGONAL / MM)? * MM;
    if (1e-9..=1e9).contains(&diagonal) {
        return Ok(diagonal);
    }
    Err(set.error(format_args!(
        "its diagonal is {} mm, must be between 1e-6 and 1e12",
        diagonal / MM
    )))
}

/// The lenses that the parameters of a camera ask for; their unit is left to be set.
pub(super) fn lenses(
    set: &ParamSet,
    diagonal: f64,
    tables: &mut Tables,
) -> Result<Lenses, SceneError> {
    let Some(file) = set.string("lensfile")?.filter(|file| !file.is_empty()) else {
        return Err(set.error("needs a lens file, \"string lensfile\""));
    };
    let path = set.dir.join(file);
    let mut elements = read(&path).map_err(|e| set.error(e))?;
    stop_down(&mut elements, set)?;
    let distance = set.float_in("focusdistance", 10.0, 1e-9, 1e12)?;
    let found = film_distance(&elements, diagonal, distance);
    let found = found.map_err(|e| set.error(format_args!("{}: {e}", path.display())))?;
    if let Some(last) = elements.last_mut() {
        last.thickness = found;
    }
    let (mask, weighting) = match set.dialect {
        Dialect::V3 => (None, v3_weighting(set)?),
        Dialect::V4 => (stop_mask(set, tables)?, LensWeighting::Irradiance(1.0)),
    };
    let mut lenses = Lenses {
        elements,
        diagonal,
        mask,
        weighting,
        pupils: Vec::new(),
        unit: 1.0,
    };
    lenses.pupils = exit_pupils(&lenses);
    if lenses.pupils.iter().all(Option::is_none) {
        return Err(set.error(format_args!(
            "{}: no light reaches the film through its lenses",
            path.display()
        )));
    }
    Ok(lenses)
}

/// v4 has the time of the exposure in its film.
fn v3_weighting(set: &ParamSet) -> Result<LensWeighting, SceneError> {
    if set.bool_or("simpleweighting", true)? {
        return Ok(LensWeighting::Simple);
    }
    let open = set.float_or("shutteropen", 0.0)?;
    let close = set.float_or("shutterclose", 1.0)?;
    let time = (close - open).abs() as f32;
    if time > 0.0 && time.is_finite() {
        return Ok(LensWeighting::Irradiance(time));
    }
    Err(set.error(format_args!(
        "its shutter opens at {open} and closes at {close}: no light reaches the film"
    )))
}

/// Gives the stops the diameter that the camera asks for, if they can have it.
fn stop_down(elements: &mut [LensElement], set: &ParamSet) -> Result<(), SceneError> {
    let diameter = set.float_or("aperturediameter", 1.0)?;
    if !(diameter > 0.0 && diameter.is_finite()) {
        return Err(set.error(format_args!("aperture diameter {diameter} is not above 0")));
    }
    for stop in elements.iter_mut().filter(|e| e.curvature_radius == 0.0) {
        let radius = diameter * MM / 2.0;
        if radius > stop.aperture_radius {
            set.note(format_args!(
                "the aperture diameter {diameter} is more than the stop has, {:.4}, and is cut down to it",
                2.0 * stop.aperture_radius / MM
            ));
        } else {
            stop.aperture_radius = radius;
        }
    }
    Ok(())
}

/// Four numbers a surface, from the scene to the film: radius of curvature, distance to the next,
/// index of refraction behind it, and diameter, lengths in millimetres; `#` starts a comment.
fn read(path: &Path) -> Result<Vec<LensElement>, String> {
    let name = path.display();
    let size = file_bytes(path).map_err(|e| format!("{name}: {e}"))?;
    if size > MAX_BYTES {
        return Err(format!("{name}: {size} bytes are too many for a lens file"));
    }
    let text = std::fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
    let mut numbers = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        for word in content.split('#').next().unwrap_or("").split_whitespace() {
            let number = word.parse::<f64>().ok().filter(|v| v.abs() <= 1e9);
            let number = number.ok_or_else(|| {
                format!("{name}:{line}: {word:?} is no number, or beyond a billion")
            })?;
            numbers.push((line, number));
        }
    }
    if numbers.is_empty() || !numbers.len().is_multiple_of(4) {
        return Err(format!(
            "{name}: a surface has 4 numbers, but there are {}",
            numbers.len()
        ));
    }
    if numbers.len() / 4 > MAX_SURFACES {
        return Err(format!("{name}: more than {MAX_SURFACES} surfaces"));
    }
    let surface = |four: &[(i32, f64)]| {
        let (line, [radius, thickness, eta, diameter]) =
            (four[0].0, [0, 1, 2, 3].map(|i| four[i].1));
        let fail = |what: String| Err(format!("{name}:{line}: {what}"));
        if thickness < 0.0 {
            return fail(format!("thickness {thickness} is below 0"));
        }
        if !(eta == 0.0 || (0.1..=100.0).contains(&eta)) {
            return fail(format!(
                "index of refraction {eta} is not between 0.1 and 100"
            ));
        }
        if diameter < 1e-9 {
            return fail(format!("diameter {diameter} is not above 0"));
        }
        if radius != 0.0 && radius.abs() < 1e-9 {
            return fail(format!("radius of curvature {radius} is too small"));
        }
        Ok(LensElement {
            curvature_radius: radius * MM,
            thickness: thickness * MM,
            eta,
            aperture_radius: diameter * MM / 2.0,
        })
    };
    numbers.chunks_exact(4).map(surface).collect()
}
