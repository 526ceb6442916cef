//! Parameter lists, `"type name" [ values ]`: typed access with defaults, and a record of what was
//! asked for, so that what nobody asked for can be reported.

mod read;
mod typed;

use std::cell::{Cell, RefCell};
use std::fmt;
use std::rc::Rc;

use super::color_space::ColorSpace;
use super::dialect::Dialect;
use super::error::{Pos, Report, SceneError, Site};
use super::folder::Folder;
use crate::pbrt::budget::Charge;

/// Types of both dialects; spellings that mean the same are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    Integer,
    Float,
    Bool,
    String,
    Point2,
    Point3,
    Vector2,
    Vector3,
    Normal,
    Rgb,
    Xyz,
    Spectrum,
    Blackbody,
    Texture,
}

impl Type {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "integer" => Self::Integer,
            "float" => Self::Float,
            "bool" => Self::Bool,
            "string" => Self::String,
            "point2" => Self::Point2,
            "point" | "point3" => Self::Point3,
            "vector2" => Self::Vector2,
            "vector" | "vector3" => Self::Vector3,
            "normal" | "normal3" => Self::Normal,
            "rgb" | "color" => Self::Rgb,
            "xyz" => Self::Xyz,
            "spectrum" => Self::Spectrum,
            "blackbody" => Self::Blackbody,
            "texture" => Self::Texture,
            _ => return None,
        })
    }

    fn name(self) -> &'static str {
        match self {
            Self::Integer => "integer",
            Self::Float => "float",
            Self::Bool => "bool",
            Self::String => "string",
            Self::Point2 => "point2",
            Self::Point3 => "point3",
            Self::Vector2 => "vector2",
            Self::Vector3 => "vector3",
            Self::Normal => "normal",
            Self::Rgb => "rgb",
            Self::Xyz => "xyz",
            Self::Spectrum => "spectrum",
            Self::Blackbody => "blackbody",
            Self::Texture => "texture",
        }
    }
}

impl Type {
    /// Whether pbrt-v3 writes its values in quotes.
    fn is_text(self) -> bool {
        matches!(self, Self::Bool | Self::String | Self::Texture)
    }

    /// Numbers of one value, if it has more than one.
    fn tuple(self) -> usize {
        match self {
            Self::Point2 | Self::Vector2 | Self::Blackbody | Self::Spectrum => 2,
            Self::Point3 | Self::Vector3 | Self::Normal | Self::Rgb | Self::Xyz => 3,
            _ => 1,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

impl Values {
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(v) => v.len(),
            Self::Strings(v) => v.len(),
            Self::Bools(v) => v.len(),
        }
    }

    pub fn numbers(&self) -> &[f64] {
        match self {
            Self::Numbers(v) => v,
            _ => &[],
        }
    }
}

#[derive(Debug)]
pub(super) struct Param {
    pub ty: Type,
    pub name: String,
    pub values: Values,
    pub pos: Pos,
    /// The `ColorSpace` in force where it was written.
    pub color_space: ColorSpace,
    used: Cell<bool>,
    /// For as long as it is kept.
    _room: Charge,
}

const STRING_BYTES: u64 = 32;

/// The parameters of one directive, with what is needed to interpret them.
#[derive(Clone, Debug)]
pub(super) struct ParamSet {
    pub site: Site,
    pub dialect: Dialect,
    /// Folder that file names are relative to.
    pub dir: Rc<Folder>,
    /// The `ColorSpace` in force at the directive.
    pub color_space: ColorSpace,
    params: Vec<Rc<Param>>,
    /// What was let pass with a word, to be told by [`ParamSet::finish`].
    notes: Rc<RefCell<Vec<(Site, String)>>>,
}

/// More parameters than any directive has; they are looked up one by one.
const MAX_PARAMS: usize = 1000;

impl ParamSet {
    pub fn empty(site: Site, dialect: Dialect, dir: Rc<Folder>) -> Self {
        Self {
            site,
            dialect,
            dir,
            color_space: ColorSpace::default(),
            params: Vec::new(),
            notes: Rc::default(),
        }
    }

    /// These parameters, then `others` where these say nothing. Marks of use are shared with the
    /// originals.
    pub fn over(&self, others: &Self) -> Self {
        let mut set = Self {
            site: others.site.clone(),
            ..self.clone()
        };
        set.params.extend(others.params.iter().cloned());
        set
    }

    /// Adds defaults from an `Attribute` directive, which need not all be used.
    pub fn add_defaults(&mut self, defaults: &Self) -> Result<(), SceneError> {
        // No two defaults have the same name.
        let own = self.params.len();
        for param in &defaults.params {
            param.used.set(true);
            if !self.params[..own].iter().any(|p| p.name == param.name) {
                if self.params.len() == MAX_PARAMS {
                    return Err(self.error_at(param, "is one of too many"));
                }
                self.params.push(Rc::clone(param));
            }
        }
        Ok(())
    }

    /// Memory of all numbers here.
    pub fn number_bytes(&self) -> u64 {
        let counts = self.params.iter().map(|p| p.values.numbers().len() as u64);
        counts.sum::<u64>() * size_of::<f64>() as u64
    }

    pub fn error(&self, what: impl fmt::Display) -> SceneError {
        self.site.error(what)
    }

    pub fn error_at(&self, param: &Param, what: impl fmt::Display) -> SceneError {
        Site::new(param.pos.clone(), &self.site.label)
            .error(format_args!("parameter \"{}\": {what}", param.name))
    }

    pub fn site_of(&self, param: &Param) -> Site {
        Site::new(param.pos.clone(), &self.site.label)
    }

    pub fn has(&self, name: &str) -> bool {
        self.params.iter().any(|p| p.name == name)
    }

    /// Marks these as used; for what has no influence on the picture here.
    pub fn accept(&self, names: &[&str]) {
        for param in self
            .params
            .iter()
            .filter(|p| names.contains(&p.name.as_str()))
        {
            param.used.set(true);
        }
    }

    /// Nothing is said of any parameter: the directive as a whole has been spoken of.
    pub fn accept_all(&self) {
        self.params.iter().for_each(|p| p.used.set(true));
    }

    /// An error if any of these is present: it would alter the picture and is not supported.
    pub fn refuse(&self, names: &[&str], why: &str) -> Result<(), SceneError> {
        match self
            .params
            .iter()
            .find(|p| names.contains(&p.name.as_str()))
        {
            Some(param) => Err(self.error_at(param, why)),
            None => Ok(()),
        }
    }

    /// A word about a parameter that is taken to be something else than it says.
    pub fn note_at(&self, param: &Param, what: impl fmt::Display) {
        let what = format!("parameter \"{}\": {what}", param.name);
        self.notes.borrow_mut().push((self.site_of(param), what));
    }

    /// A word about the directive.
    pub fn note(&self, what: impl fmt::Display) {
        let note = (self.site.clone(), what.to_string());
        self.notes.borrow_mut().push(note);
    }

    /// Warns of parameters nobody asked for, and of what was let pass.
    pub fn finish(&self, report: &mut Report) {
        for (site, what) in self.notes.borrow_mut().drain(..) {
            report.warn_at(&site, what);
        }
        for param in self.params.iter().filter(|p| !p.used.replace(true)) {
            report.warn_at(
                &self.site_of(param),
                format_args!("unknown parameter \"{}\" ignored", param.name),
            );
        }
    }

    /// The parameter whatever its type, marked as used.
    pub fn find(&self, name: &str) -> Option<&Param> {
        let param = self.params.iter().find(|p| p.name == name)?;
        param.used.set(true);
        Some(param)
    }
}
