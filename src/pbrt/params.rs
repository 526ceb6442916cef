//! Parameter lists, `"type name" [ values ]`: typed access with defaults, and a record of what was asked for, so that
//! what nobody asked for can be reported.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::rc::Rc;

use glam::{DVec2, DVec3};

use super::color::ColorSpace;
use super::dialect::Dialect;
use super::error::{Pos, Report, SceneError, Site};
use super::folder::Folder;
use super::lexer::{Token, TokenKind};
use super::stream::TokenStream;
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

/// The type and the name in a declaration. What follows them is no part of it in pbrt.
fn declared(declaration: &Token) -> Result<(Type, String), String> {
    let text = declaration.text();
    let mut words = text.split_ascii_whitespace();
    let (Some(ty), Some(name)) = (words.next(), words.next()) else {
        return Err(format!(
            "expected a parameter as \"type name\", found {}",
            declaration.shown()
        ));
    };
    let Some(ty) = Type::parse(ty) else {
        return Err(format!(
            "parameter \"{name}\" has the unknown type \"{ty}\"; the types are integer, float, bool, string, \
             point2, point3, vector2, vector3, normal, rgb, xyz, spectrum, blackbody, texture"
        ));
    };
    Ok((ty, name.to_owned()))
}

/// v3: cuts values off that make no whole, as pbrt does; false if the parameter is to be left out.
fn fit(ty: Type, values: &mut Values, site: &Site, name: &str, report: &mut Report) -> bool {
    let tuple = ty.tuple();
    match values {
        Values::Numbers(list) if list.len() % tuple != 0 => {
            let rest = list.len() % tuple;
            let what = format_args!(
                "parameter \"{name}\" has {} numbers, not a multiple of {tuple}: the last {rest} ignored",
                list.len()
            );
            report.warn_at(site, what);
            list.truncate(list.len() - rest);
            return !list.is_empty();
        }
        Values::Numbers(list) if ty == Type::Integer && list.iter().any(|x| x.fract() != 0.0) => {
            let what = format_args!("parameter \"{name}\" has fractions, which are cut off");
            report.warn_at(site, what);
            list.iter_mut().for_each(|x| *x = x.trunc());
        }
        Values::Strings(list) if ty == Type::Texture && list.len() != 1 => {
            let what = format_args!(
                "parameter \"{name}\" is left out: expected the name of one texture, found {}",
                list.len()
            );
            report.warn_at(site, what);
            return false;
        }
        _ => {}
    }
    true
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

    fn numbers(&self) -> &[f64] {
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

/// Memory of a parameter besides its name and values, and of one of its strings besides the text, roughly.
const PARAM_BYTES: u64 = size_of::<Param>() as u64 + 64;
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

/// A list of this many numbers is larger than any scene text should hold.
const MAX_VALUES: usize = 1 << 30;

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

    /// Reads parameters until something that is not one.
    pub fn read(
        stream: &mut TokenStream,
        site: Site,
        dialect: Dialect,
        dir: Rc<Folder>,
        color_space: ColorSpace,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        let mut set = Self::empty(site, dialect, dir);
        set.color_space = color_space;
        while stream.peek()?.is_some_and(|t| t.kind == TokenKind::Quoted) {
            let Some(declaration) = stream.next_token()? else {
                break;
            };
            let Some(param) = set.read_one(stream, &declaration, color_space, report)? else {
                continue;
            };
            if let Some(at) = set.params.iter().position(|p| p.name == param.name) {
                let site = Site::new(param.pos.clone(), set.site.label.clone());
                report.warn_at(
                    &site,
                    format_args!(
                        "parameter \"{}\" given twice; the last one counts",
                        param.name
                    ),
                );
                set.params.remove(at);
            }
            if set.params.len() == MAX_PARAMS {
                return Err(set.error_at(&param, "is one of too many"));
            }
            set.params.push(Rc::new(param));
        }
        Ok(set)
    }

    /// `None` if it is left out, with a warning.
    fn read_one(
        &self,
        stream: &mut TokenStream,
        declaration: &Token,
        color_space: ColorSpace,
        report: &mut Report,
    ) -> Result<Option<Param>, SceneError> {
        let pos = declaration.pos();
        let site = Site::new(pos.clone(), &self.site.label);
        let declared = declared(declaration);
        let (ty, name) = match &declared {
            Ok((ty, name)) => (Some(*ty), name.as_str()),
            Err(what) if self.dialect == Dialect::V4 => return Err(site.error(what)),
            // Its values are stepped over.
            Err(_) => (None, ""),
        };
        let room = Charge::of(&stream.budget, PARAM_BYTES + name.len() as u64);
        let mut room = room.map_err(|e| site.error(format_args!("parameter \"{name}\": {e}")))?;
        let (mut values, mistaken) = self.values(stream, &pos, ty, name, &mut room)?;
        let (ty, name) = match declared {
            Ok(declared) => declared,
            Err(what) => {
                report.warn_at(&site, format_args!("left out: {what}"));
                return Ok(None);
            }
        };
        if mistaken {
            let expected = if ty.is_text() {
                "strings in quotes"
            } else {
                "numbers"
            };
            let what = format_args!("parameter \"{name}\" is left out: expected {expected}");
            report.warn_at(&site, what);
            return Ok(None);
        }
        if self.dialect == Dialect::V3 && !fit(ty, &mut values, &site, &name, report) {
            return Ok(None);
        }
        if ty == Type::Integer
            && values
                .numbers()
                .iter()
                .any(|x| x.fract() != 0.0 || x.abs() > 9e15)
        {
            return Err(site.error(format_args!("parameter \"{name}\" must be an integer")));
        }
        Ok(Some(Param {
            ty,
            name,
            values,
            pos,
            color_space,
            used: Cell::new(false),
            _room: room,
        }))
    }

    /// The values of a parameter; in v3 perhaps numbers where strings belong, or the other way round: then the second is true. Without
    /// a type, whatever comes.
    fn values(
        &self,
        stream: &mut TokenStream,
        pos: &Pos,
        ty: Option<Type>,
        name: &str,
        room: &mut Charge,
    ) -> Result<(Values, bool), SceneError> {
        let fail = |pos: &Pos, what: fmt::Arguments<'_>| {
            Err(Site::new(pos.clone(), &self.site.label).error(what))
        };
        let no_room = |e: String| {
            Site::new(pos.clone(), &self.site.label)
                .error(format_args!("parameter \"{name}\": {e}"))
        };
        let mut values = match ty {
            Some(Type::Bool) => Values::Bools(Vec::new()),
            Some(Type::String | Type::Texture) => Values::Strings(Vec::new()),
            _ => Values::Numbers(Vec::new()),
        };
        let mut mistaken = false;
        let bracketed = stream.peek()?.is_some_and(|t| t.kind == TokenKind::Open);
        if bracketed {
            stream.next_token()?;
        }
        loop {
            let Some(token) = stream.next_token()? else {
                let what = if bracketed {
                    "has no closing ']'"
                } else {
                    "has no value"
                };
                return fail(pos, format_args!("parameter \"{name}\" {what}"));
            };
            if bracketed && token.kind == TokenKind::Close {
                break;
            }
            if values.len() == 0 {
                let text = token.kind == TokenKind::Quoted;
                if text && matches!(ty, None | Some(Type::Spectrum)) {
                    // A spectrum is a list of samples, or a name, or a file's name.
                    values = Values::Strings(Vec::new());
                } else if let Some(ty) = ty
                    && self.dialect == Dialect::V3
                    && text != ty.is_text()
                    && (text || token.number().is_ok())
                {
                    mistaken = true;
                    values = match text {
                        true => Values::Strings(Vec::new()),
                        false => Values::Numbers(Vec::new()),
                    };
                }
            }
            let grown = match &values {
                Values::Numbers(list) => room.grow(list, 1),
                Values::Bools(list) => room.grow(list, 1),
                Values::Strings(list) => room
                    .grow(list, 1)
                    .and_then(|()| room.add(STRING_BYTES + token.raw().len() as u64)),
            };
            grown.map_err(no_room)?;
            match &mut values {
                Values::Numbers(list) if list.len() < MAX_VALUES => {
                    list.push(match token.number() {
                        Ok(x) => x,
                        Err(e) => return Err(self.amend(&token, name, e)),
                    })
                }
                Values::Numbers(_) => {
                    return fail(
                        pos,
                        format_args!("parameter \"{name}\" has too many values"),
                    );
                }
                Values::Strings(list) if token.kind == TokenKind::Quoted => {
                    list.push(token.text().into_owned())
                }
                Values::Strings(_) => {
                    return fail(
                        &token.pos(),
                        format_args!(
                            "parameter \"{name}\": expected a string in quotes, found {}",
                            token.shown()
                        ),
                    );
                }
                Values::Bools(list) => list.push(match token.raw() {
                    "true" => true,
                    "false" => false,
                    _ if self.dialect == Dialect::V3 && token.kind == TokenKind::Quoted => {
                        let site = Site::new(token.pos(), &self.site.label);
                        let what = format!(
                            "parameter \"{name}\": {} is neither true nor false; false is used",
                            token.shown()
                        );
                        self.notes.borrow_mut().push((site, what));
                        false
                    }
                    _ => {
                        return fail(
                            &token.pos(),
                            format_args!(
                                "parameter \"{name}\": expected true or false, found {}",
                                token.shown()
                            ),
                        );
                    }
                }),
            }
            if !bracketed {
                break;
            }
        }
        Ok((values, mistaken))
    }

    /// A token's own message, with the directive and the parameter put in front.
    fn amend(&self, token: &Token, name: &str, error: SceneError) -> SceneError {
        let pos = token.pos();
        let message = error
            .0
            .strip_prefix(&format!("{pos}: "))
            .map(str::to_owned)
            .unwrap_or(error.0);
        Site::new(pos, &self.site.label).error(format_args!("parameter \"{name}\": {message}"))
    }

    /// These parameters, then `others` where these say nothing. Marks of use are shared with the originals.
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

    fn typed(&self, name: &str, types: &[Type]) -> Result<Option<&Param>, SceneError> {
        let Some(param) = self.find(name) else {
            return Ok(None);
        };
        if !types.contains(&param.ty) {
            let expected: Vec<_> = types.iter().map(|t| t.name()).collect();
            let expected = expected.join(" or ");
            let what = format!("has type {}, expected {expected}", param.ty.name());
            // Another type is another parameter.
            return self.left_out(param, &what);
        }
        Ok(Some(param))
    }

    fn single(
        &self,
        name: &str,
        types: &[Type],
        count: usize,
    ) -> Result<Option<&Param>, SceneError> {
        let param = self.typed(name, types)?;
        if let Some(param) = param
            && param.values.len() != count
        {
            let plural = if count == 1 { "" } else { "s" };
            let what = format!(
                "expected {count} value{plural}, found {}",
                param.values.len()
            );
            return self.left_out(param, &what);
        }
        Ok(param)
    }

    /// As if the parameter were not there in v3, with a word; an error in v4.
    pub fn left_out<T>(&self, param: &Param, what: &str) -> Result<Option<T>, SceneError> {
        if self.dialect == Dialect::V4 {
            return Err(self.error_at(param, what));
        }
        self.note_at(param, format_args!("{what}; it is left out, as in pbrt-v3"));
        Ok(None)
    }

    /// Of a parameter that may be a texture in pbrt-v3: the first of several numbers.
    pub fn first_float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        match self.find(name) {
            Some(param) if self.dialect == Dialect::V3 && param.ty == Type::Float => {
                let [first, rest @ ..] = param.values.numbers() else {
                    return self.left_out(param, "has no value");
                };
                if !rest.is_empty() {
                    self.note_at(param, "the first of its values is used");
                }
                if !(*first as f32).is_finite() {
                    return Err(
                        self.error_at(param, format_args!("is {first}, which is out of range"))
                    );
                }
                Ok(Some(*first))
            }
            _ => self.float(name),
        }
    }

    /// A float that is one in `f32` as well.
    pub fn float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        let Some(param) = self.single(name, &[Type::Float], 1)? else {
            return Ok(None);
        };
        let value = param.values.numbers()[0];
        if !(value as f32).is_finite() {
            return Err(self.error_at(param, format_args!("is {value}, which is out of range")));
        }
        Ok(Some(value))
    }

    pub fn float_or(&self, name: &str, default: f64) -> Result<f64, SceneError> {
        Ok(self.float(name)?.unwrap_or(default))
    }

    /// A float that must lie in `[low, high]`.
    pub fn float_in(
        &self,
        name: &str,
        default: f64,
        low: f64,
        high: f64,
    ) -> Result<f64, SceneError> {
        let value = self.float_or(name, default)?;
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        let expected = match (low, high) {
            (l, f64::INFINITY) => format!("at least {l}"),
            (l, h) => format!("between {l} and {h}"),
        };
        match self.find(name) {
            Some(param) => {
                Err(self.error_at(param, format_args!("is {value}, must be {expected}")))
            }
            None => Ok(value),
        }
    }

    /// An integer that must lie in `[low, high]`.
    pub fn int_in(&self, name: &str, default: i64, low: i64, high: i64) -> Result<i64, SceneError> {
        let Some(param) = self.single(name, &[Type::Integer], 1)? else {
            return Ok(default);
        };
        // Integers were checked to be exact when read.
        let value = param.values.numbers()[0] as i64;
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        Err(self.error_at(
            param,
            format_args!("is {value}, must be between {low} and {high}"),
        ))
    }

    pub fn bool_or(&self, name: &str, default: bool) -> Result<bool, SceneError> {
        Ok(
            match self.single(name, &[Type::Bool], 1)?.map(|p| &p.values) {
                Some(Values::Bools(v)) => v[0],
                _ => default,
            },
        )
    }

    pub fn string(&self, name: &str) -> Result<Option<&str>, SceneError> {
        Ok(
            match self.single(name, &[Type::String], 1)?.map(|p| &p.values) {
                Some(Values::Strings(v)) => Some(v[0].as_str()),
                _ => None,
            },
        )
    }

    pub fn point_or(&self, name: &str, default: DVec3) -> Result<DVec3, SceneError> {
        Ok(self
            .single(name, &[Type::Point3], 3)?
            .map_or(default, |p| DVec3::from_slice(p.values.numbers())))
    }

    pub fn vector_or(&self, name: &str, default: DVec3) -> Result<DVec3, SceneError> {
        Ok(self
            .single(name, &[Type::Vector3], 3)?
            .map_or(default, |p| DVec3::from_slice(p.values.numbers())))
    }

    pub fn floats(&self, name: &str) -> Result<Option<&[f64]>, SceneError> {
        Ok(self
            .typed(name, &[Type::Float])?
            .map(|p| p.values.numbers()))
    }

    pub fn ints(&self, name: &str) -> Result<Option<&[f64]>, SceneError> {
        Ok(self
            .typed(name, &[Type::Integer])?
            .map(|p| p.values.numbers()))
    }

    /// Points or normals, three numbers each.
    pub fn triples(&self, name: &str, ty: Type) -> Result<Option<Vec<DVec3>>, SceneError> {
        let Some(param) = self.typed(name, &[ty])? else {
            return Ok(None);
        };
        let numbers = param.values.numbers();
        if !numbers.len().is_multiple_of(3) {
            return Err(self.error_at(
                param,
                format_args!("has {} numbers, not a multiple of 3", numbers.len()),
            ));
        }
        Ok(Some(
            numbers.chunks_exact(3).map(DVec3::from_slice).collect(),
        ))
    }

    /// Texture coordinates: v3 writes them as `float`, v4 as `point2`.
    pub fn pairs(&self, name: &str) -> Result<Option<Vec<DVec2>>, SceneError> {
        let Some(param) = self.typed(name, &[Type::Float, Type::Point2])? else {
            return Ok(None);
        };
        let numbers = param.values.numbers();
        if !numbers.len().is_multiple_of(2) && self.dialect == Dialect::V4 {
            return Err(self.error_at(
                param,
                format_args!("has {} numbers, not a multiple of 2", numbers.len()),
            ));
        }
        Ok(Some(
            numbers.chunks_exact(2).map(DVec2::from_slice).collect(),
        ))
    }

    /// Indices below `limit`, or why they are not: the first that is beyond.
    pub fn indices(
        &self,
        name: &str,
        limit: usize,
    ) -> Result<Option<Result<Vec<u32>, String>>, SceneError> {
        let Some(param) = self.typed(name, &[Type::Integer])? else {
            return Ok(None);
        };
        let numbers = param.values.numbers();
        let mut out = Vec::with_capacity(numbers.len());
        for &x in numbers {
            if x < 0.0 || x >= limit as f64 || x >= f64::from(u32::MAX) {
                let what = format!("index {x} is out of range, there are {limit} vertices");
                return match x < 0.0 || self.dialect == Dialect::V4 {
                    true => Err(self.error_at(param, what)),
                    false => Ok(Some(Err(what))),
                };
            }
            out.push(x as u32);
        }
        Ok(Some(Ok(out)))
    }
}
