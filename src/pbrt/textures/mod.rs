//! `Texture` directives, and material parameters that may be textures.
//!
//! `build` makes the textures, `mapping` lays them on surfaces and in space, `image` reads those
//! that are images.

mod build;
mod image;
mod mapping;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::path::PathBuf;
use std::rc::Rc;

use glam::DAffine3;
use rpds::HashTrieMap;

pub(super) use self::build::build;
use self::mapping::Mapped;
use super::color::Use;
use super::error::SceneError;
use super::params::{ParamSet, Type, Values};
use super::transform::rows;
use crate::pbrt::budget::{Budget, Charge};
use crate::pbrt::image::{Encoding, bytes_needed, read_image};
use crate::scene::Image;
use crate::scene::spectrum::luminance;
use crate::scene::{Alpha, Material, Param, Space, Texture};

/// Something defined under a name that may not be usable: the reason is reported where it is used.
pub(super) type Deferred<T> = Result<T, SceneError>;

/// Textures by name; numbers and colours have separate name spaces. Copies share what they have in
/// common: every block saves one.
#[derive(Clone, Debug, Default)]
pub(super) struct TextureNames {
    float: NamedTextures,
    color: NamedTextures,
}

type NamedTextures = HashTrieMap<String, NamedTexture>;

#[derive(Debug)]
struct NamedTexture {
    param: Deferred<Param>,
    _room: Charge,
}

/// Memory of an entry of a table of names, besides what it holds, roughly.
pub(super) const NAME_BYTES: u64 = 256;

impl TextureNames {
    /// Whether there was one of this name before.
    pub fn insert(
        &mut self,
        name: String,
        class: Class,
        param: Deferred<Param>,
        budget: &Rc<Budget>,
    ) -> Result<bool, String> {
        let message = param.as_ref().err().map_or(0, |e| e.0.len());
        let bytes = NAME_BYTES + (name.len() + message + size_of::<NamedTexture>()) as u64;
        let map = match class {
            Class::Float => &mut self.float,
            Class::Color => &mut self.color,
        };
        let known = map.contains_key(&name);
        let texture = NamedTexture {
            param,
            _room: Charge::of(budget, bytes)?,
        };
        map.insert_mut(name, texture);
        Ok(known)
    }
}

/// The tables that materials and textures fill.
#[derive(Debug, Default)]
pub(super) struct Tables {
    pub materials: Vec<Material>,
    textures: Vec<Texture>,
    /// World to texture space, of textures that look at points; the matrices in the textures come
    /// last.
    to_texture: Vec<Option<DAffine3>>,
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

/// Memory of a texture, in tables that grow by doubling.
const TEXTURE_BYTES: u64 =
    2 * (size_of::<Texture>() + size_of::<Option<DAffine3>>() + size_of::<u32>()) as u64;

/// Textures that one is made of, at most: each that names another twice doubles them, and they are
/// evaluated by recursion.
const MAX_STEPS: u32 = 1000;

impl Tables {
    pub fn new(budget: Rc<Budget>) -> Self {
        Self {
            budget,
            ..Self::default()
        }
    }

    fn push(&mut self, texture: Mapped<Texture>, set: &ParamSet) -> Result<Param, SceneError> {
        let Mapped { what, to_texture } = texture;
        let of = |p: Param| match p {
            Param::Constant(_) => 0,
            Param::Texture(index) => self.steps[index as usize],
        };
        // No sum leaves u32: each of these is bounded.
        let steps = 1 + what.children().map(of).sum::<u32>();
        if steps > MAX_STEPS {
            return Err(set.error(format_args!(
                "is made of more than {MAX_STEPS} textures; bake it into an image"
            )));
        }
        let room = self.budget.take(TEXTURE_BYTES);
        room.map_err(|e| set.error(e))?;
        self.textures.push(what);
        self.to_texture.push(to_texture);
        self.steps.push(steps);
        // The count of texture directives in a text of bounded size fits.
        Ok(Param::Texture(self.textures.len() as u32 - 1))
    }

    /// The textures, with maps from internal space.
    pub fn take_textures(&mut self, space: &Space) -> Vec<Texture> {
        let mut textures = std::mem::take(&mut self.textures);
        for (texture, from_world) in textures.iter_mut().zip(&self.to_texture) {
            if let (Some(matrix), Some(from_world)) = (texture.to_texture_mut(), from_world) {
                *matrix = rows(&DAffine3 {
                    matrix3: from_world.matrix3 * (1.0 / space.scale),
                    translation: from_world.transform_point3(space.centre),
                });
            }
        }
        textures
    }

    /// All textures so far.
    pub fn textures(&self) -> &[Texture] {
        &self.textures
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
        let bytes = bytes_needed(&path)?;
        let room = Charge::of(&self.budget, bytes);
        let room = room.map_err(|e| format!("{}: {e}", path.display()))?;
        let mut image = read_image(&path, encoding)?;
        // What the decoder took is free again.
        drop(room);
        let bytes = size_of_val(&image.texels[..]) + path.as_os_str().len();
        self.budget.take(bytes as u64 + NAME_BYTES)?;
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
    Ok(set
        .first_float(name)?
        .map(|x| Param::Constant([x as f32; 3])))
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
    names: &NamedTextures,
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
        Some(found) => found.param.clone().map(Some),
        None => {
            let what = format!("there is no {class} texture named \"{texture}\"");
            set.left_out(param, &what)
        }
    }
}

/// Whether a texture yields a number or a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    Float,
    Color,
}
