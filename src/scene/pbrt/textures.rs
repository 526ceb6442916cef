//! `Texture` directives, and material parameters that may be textures.

use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;

use super::color::Use;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::params::{ParamSet, Type, Values};
use crate::scene::budget::Budget;
use crate::scene::image::{self, Encoding, Image};
use crate::scene::spectrum::luminance;
use crate::scene::{Alpha, Material, Param, Rgb, Texture, UvMapping, Wrap};

/// Something defined under a name that may not be usable: the reason is reported where it is used.
pub(super) type Deferred<T> = Result<T, SceneError>;

/// Textures by name; numbers and colours have separate name spaces.
#[derive(Clone, Debug, Default)]
pub(super) struct TextureNames {
    pub float: Rc<HashMap<String, Deferred<Param>>>,
    pub color: Rc<HashMap<String, Deferred<Param>>>,
}

/// The tables that materials and textures fill.
#[derive(Debug, Default)]
pub(super) struct Tables {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    /// What is cut out of shapes.
    pub alphas: Vec<Alpha>,
    /// Textures below each of `textures`, itself included, as often as they are named.
    steps: Vec<u32>,
    loaded: HashMap<(PathBuf, String, Channels), u32>,
    budget: Rc<Budget>,
}

/// What becomes of an image's channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channels {
    Rgb,
    /// v3 takes the luminance of an image used as a number.
    Luminance,
    /// v4 takes the mean.
    Mean,
}

/// Textures that one is made of, at most: each that names another twice doubles them, and they are evaluated by recursion.
const MAX_STEPS: u32 = 1000;

impl Tables {
    pub fn new(budget: Rc<Budget>) -> Self {
        Self {
            budget,
            ..Self::default()
        }
    }

    fn push(&mut self, texture: Texture, set: &ParamSet) -> Result<Param, SceneError> {
        let of = |p: Param| match p {
            Param::Constant(_) => 0,
            Param::Texture(index) => self.steps[index as usize],
        };
        // No sum leaves u32: each of these is bounded.
        let steps = 1 + match texture {
            Texture::Constant(_) | Texture::Image { .. } => 0,
            Texture::Scale { a, b } | Texture::Checkerboard { a, b, .. } => of(a) + of(b),
            Texture::Mix { a, b, amount } => of(a) + of(b) + of(amount),
        };
        if steps > MAX_STEPS {
            return Err(set.error(format_args!(
                "is made of more than {MAX_STEPS} textures; bake it into an image"
            )));
        }
        self.textures.push(texture);
        self.steps.push(steps);
        // The count of texture directives in a text of bounded size fits.
        Ok(Param::Texture(self.textures.len() as u32 - 1))
    }

    /// Loads an image once for all that use it alike.
    pub fn image(
        &mut self,
        path: PathBuf,
        encoding: Encoding,
        channels: Channels,
    ) -> Result<u32, String> {
        let key = (path.clone(), format!("{encoding:?}"), channels);
        if let Some(&index) = self.loaded.get(&key) {
            return Ok(index);
        }
        let bytes = image::bytes_needed(&path)?;
        let taken = self.budget.take(bytes);
        taken.map_err(|e| format!("{}: {e}", path.display()))?;
        let mut image = image::read_image(&path, encoding)?;
        for texel in image.texels.iter_mut() {
            match channels {
                Channels::Rgb => {}
                Channels::Luminance => *texel = [luminance(*texel); 3],
                Channels::Mean => *texel = [(texel[0] + texel[1] + texel[2]) / 3.0; 3],
            }
        }
        let index = self.images.len() as u32;
        self.images.push(image);
        self.loaded.insert(key, index);
        Ok(index)
    }
}

/// A number that may be a texture.
pub(super) fn float_param(
    set: &ParamSet,
    names: &TextureNames,
    name: &str,
) -> Result<Option<Param>, SceneError> {
    if set.find(name).is_some_and(|p| p.ty == Type::Texture) {
        return named(set, &names.float, name, "float");
    }
    Ok(set.float(name)?.map(|x| Param::Constant([x as f32; 3])))
}

pub(super) fn float_param_or(
    set: &ParamSet,
    names: &TextureNames,
    name: &str,
    default: f32,
) -> Result<Param, SceneError> {
    Ok(float_param(set, names, name)?.unwrap_or(Param::Constant([default; 3])))
}

/// A colour that may be a texture.
pub(super) fn color_param(
    set: &ParamSet,
    names: &TextureNames,
    name: &str,
    meaning: Use,
) -> Result<Option<Param>, SceneError> {
    if set.find(name).is_some_and(|p| p.ty == Type::Texture) {
        return named(set, &names.color, name, "spectrum");
    }
    Ok(set.color(name, meaning)?.map(Param::Constant))
}

pub(super) fn color_param_or(
    set: &ParamSet,
    names: &TextureNames,
    name: &str,
    default: f32,
) -> Result<Param, SceneError> {
    Ok(color_param(set, names, name, Use::Albedo)?.unwrap_or(Param::Constant([default; 3])))
}

fn named(
    set: &ParamSet,
    names: &HashMap<String, Deferred<Param>>,
    name: &str,
    class: &str,
) -> Result<Option<Param>, SceneError> {
    let Some(param) = set.find(name) else {
        return Ok(None);
    };
    let Values::Strings(values) = &param.values else {
        return Ok(None);
    };
    let [texture] = values.as_slice() else {
        return Err(set.error_at(
            param,
            format_args!("expected the name of one texture, found {}", values.len()),
        ));
    };
    match names.get(texture) {
        Some(found) => found.clone().map(Some),
        None => Err(set.error_at(
            param,
            format_args!("there is no {class} texture named \"{texture}\""),
        )),
    }
}

/// Whether a texture yields a number or a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Float,
    Color,
}

/// Builds the texture of a `Texture "name" "class" "kind"` directive; constants need no entry in the table.
pub(super) fn build(
    kind: &str,
    class: Class,
    set: &ParamSet,
    names: &TextureNames,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Param, SceneError> {
    // A child of the texture's own class.
    let child =
        |name: &str, default: f32| match class {
            Class::Float => float_param_or(set, names, name, default),
            Class::Color => Ok(color_param(set, names, name, Use::Unbounded)?
                .unwrap_or(Param::Constant([default; 3]))),
        };
    let texture = match kind {
        "constant" => child("value", 1.0)?,
        "scale" => {
            let (a, b) = match set.dialect {
                Dialect::V3 => (child("tex1", 1.0)?, child("tex2", 1.0)?),
                Dialect::V4 => (
                    child("tex", 1.0)?,
                    float_param_or(set, names, "scale", 1.0)?,
                ),
            };
            match (a, b) {
                (Param::Constant(a), Param::Constant(b)) => {
                    Param::Constant(zip(a, b, |a, b| a * b))
                }
                (Param::Constant([1.0, 1.0, 1.0]), x) | (x, Param::Constant([1.0, 1.0, 1.0])) => x,
                _ => tables.push(Texture::Scale { a, b }, set)?,
            }
        }
        "mix" => {
            let (a, b) = (child("tex1", 0.0)?, child("tex2", 1.0)?);
            let amount = float_param_or(set, names, "amount", 0.5)?;
            match (a, b, amount) {
                (Param::Constant(a), Param::Constant(b), Param::Constant([t, ..])) => {
                    Param::Constant(zip(a, b, |a, b| (1.0 - t) * a + t * b))
                }
                _ => tables.push(Texture::Mix { a, b, amount }, set)?,
            }
        }
        "checkerboard" => {
            let dimension = set.int_in("dimension", 2, 2, 3)?;
            if dimension != 2 {
                return Err(set.error(
                    "checkerboards of 3 dimensions are not supported; use \"integer dimension\" 2",
                ));
            }
            if set.dialect == Dialect::V3 {
                note_filtering(set, &["aamode"], report);
            }
            let (a, b) = (child("tex1", 1.0)?, child("tex2", 0.0)?);
            let mapping = uv_mapping(set)?;
            if a == b {
                a
            } else {
                tables.push(Texture::Checkerboard { a, b, mapping }, set)?
            }
        }
        "imagemap" => image_map(class, set, tables, report)?,
        _ => {
            return Err(set.error(
                "this kind of texture is not supported; use constant, scale, mix, checkerboard or imagemap, or bake it \
                 into an image",
            ));
        }
    };
    set.finish(report);
    Ok(texture)
}

fn zip(a: Rgb, b: Rgb, f: impl Fn(f32, f32) -> f32) -> Rgb {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

fn image_map(
    class: Class,
    set: &ParamSet,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Param, SceneError> {
    let Some(filename) = set.string("filename")? else {
        return Err(set.error("an imagemap needs a \"string filename\""));
    };
    let path = set.dir.join(filename);
    let mapping = uv_mapping(set)?;
    let scale = set.float_or("scale", 1.0)? as f32;
    let wrap = match set.string("wrap")?.unwrap_or("repeat") {
        "repeat" => Wrap::Repeat,
        "black" => Wrap::Black,
        "clamp" => Wrap::Clamp,
        other => {
            return Err(set.error(format_args!(
                "wrap mode \"{other}\" is unknown; use repeat, black or clamp"
            )));
        }
    };
    let (encoding, invert) = match set.dialect {
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
    };
    let channels = match (class, set.dialect) {
        (Class::Color, _) => Channels::Rgb,
        (Class::Float, Dialect::V3) => Channels::Luminance,
        (Class::Float, Dialect::V4) => Channels::Mean,
    };
    let image = tables
        .image(path, encoding, channels)
        .map_err(|e| set.error(e))?;
    let texture = Texture::Image {
        image,
        mapping,
        wrap,
        scale,
        invert,
    };
    tables.push(texture, set)
}

fn note_filtering(set: &ParamSet, names: &[&str], report: &mut Report) {
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

fn uv_mapping(set: &ParamSet) -> Result<UvMapping, SceneError> {
    let kind = set.string("mapping")?.unwrap_or("uv");
    if kind != "uv" {
        return Err(set.error(format_args!(
            "texture mapping \"{kind}\" is not supported; use \"uv\" and give the shape texture coordinates"
        )));
    }
    Ok(UvMapping {
        su: set.float_or("uscale", 1.0)? as f32,
        sv: set.float_or("vscale", 1.0)? as f32,
        du: set.float_or("udelta", 0.0)? as f32,
        dv: set.float_or("vdelta", 0.0)? as f32,
    })
}
