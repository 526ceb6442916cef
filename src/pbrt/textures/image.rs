//! `imagemap` textures.

use std::path::Path;

use super::mapping::{Ctm, mapping};
use super::{Channels, Class, Tables};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::image::Encoding;
use crate::pbrt::params::ParamSet;
use crate::scene::{Param, Texture, Wrap};

/// The sRGB value 0.5 as a linear one (IEC 61966-2-1).
const GREY_DECODED: f32 = 0.214_041_14;

pub fn image_map(
    class: Class,
    set: &ParamSet,
    ctm: &Ctm,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Param, SceneError> {
    let filename = match set.string("filename")? {
        Some(filename) => filename,
        None if set.dialect == Dialect::V3 => "",
        None => return Err(set.error("an imagemap needs a \"string filename\"")),
    };
    let path = set.dir.join(filename);
    let mapping = mapping(set, ctm)?;
    let scale = set.float_or("scale", 1.0)? as f32;
    let wrap = wrap(set)?;
    let (encoding, invert) = encoding(set, report)?;
    if set.dialect == Dialect::V3 && !path.exists() {
        set.note(format_args!(
            "there is no file {}; it is grey, as in pbrt-v3",
            path.display()
        ));
        return Ok(Param::Constant([scale * stand_in(&path, encoding); 3]));
    }
    let channels = match (class, set.dialect) {
        (Class::Color, _) => Channels::Rgb,
        (Class::Float, Dialect::V3) => Channels::Luminance,
        (Class::Float, Dialect::V4) => Channels::Mean,
    };
    let image = tables
        .image(path, encoding, channels)
        .map_err(|e| set.error(e))?;
    let texture = mapping.map(|mapping| Texture::Image {
        image,
        mapping,
        wrap,
        scale,
        invert,
    });
    tables.push(texture, set)
}

/// What is beyond the borders of an image.
fn wrap(set: &ParamSet) -> Result<Wrap, SceneError> {
    Ok(match set.string("wrap")?.unwrap_or("repeat") {
        "repeat" => Wrap::Repeat,
        "black" => Wrap::Black,
        "clamp" => Wrap::Clamp,
        "octahedralsphere" if set.dialect == Dialect::V4 => Wrap::Octahedral,
        other if set.dialect == Dialect::V3 => {
            set.note(format_args!(
                "wrap mode \"{other}\" is unknown; repeat is used"
            ));
            Wrap::Repeat
        }
        other => {
            return Err(set.error(format_args!(
                "wrap mode \"{other}\" is unknown; use repeat, black, clamp or octahedralsphere"
            )));
        }
    })
}

/// How the file's numbers are meant, and whether each is taken from 1.
fn encoding(set: &ParamSet, report: &mut Report) -> Result<(Encoding, bool), SceneError> {
    Ok(match set.dialect {
        Dialect::V3 => {
            note_filtering(set, &["trilinear", "maxanisotropy"], report);
            let encoding = match (set.has("gamma"), set.bool_or("gamma", true)?) {
                (false, _) => Encoding::Auto,
                (true, true) => Encoding::Srgb,
                (true, false) => Encoding::Linear,
            };
            (encoding, false)
        }
        Dialect::V4 => {
            if set.string("filter")?.is_some_and(|f| f != "bilinear") {
                note_filtering(set, &["filter"], report);
            }
            set.accept(&["maxanisotropy"]);
            let encoding = match set
                .string("encoding")?
                .map(str::to_ascii_lowercase)
                .as_deref()
            {
                None => Encoding::Auto,
                Some("srgb") => Encoding::Srgb,
                Some("linear") => Encoding::Linear,
                Some(text) => match text
                    .strip_prefix("gamma ")
                    .and_then(|g| g.trim().parse::<f32>().ok())
                {
                    Some(gamma) if gamma.is_finite() && gamma > 0.0 => Encoding::Gamma(gamma),
                    _ => {
                        return Err(set.error(format_args!(
                            "encoding \"{text}\" is unknown; use sRGB, linear or \"gamma\" with a number"
                        )));
                    }
                },
            };
            (encoding, set.bool_or("invert", false)?)
        }
    })
}

/// pbrt-v3's grey in place of an image that is not there, as its reader would decode it.
fn stand_in(path: &Path, encoding: Encoding) -> f32 {
    let png_or_tga = |e: &std::ffi::OsStr| matches!(e.to_str(), Some("png" | "tga"));
    let decoded = match encoding {
        Encoding::Auto => path.extension().is_some_and(png_or_tga),
        other => other == Encoding::Srgb,
    };
    if decoded { GREY_DECODED } else { 0.5 }
}

pub fn note_filtering(set: &ParamSet, names: &[&str], report: &mut Report) {
    for name in names {
        if let Some(param) = set.find(name) {
            let site = set.site_of(param);
            report.warn_once(
                "texture filtering",
                &site,
                "textures are looked up bilinearly, other filtering is ignored",
            );
        }
    }
}
