//! From tokens to parameters.

use std::cell::Cell;
use std::fmt;
use std::rc::Rc;

use super::{MAX_PARAMS, Param, ParamSet, Type, Values};
use crate::pbrt::budget::Charge;
use crate::pbrt::color_space::ColorSpace;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Pos, Report, SceneError, Site};
use crate::pbrt::folder::Folder;
use crate::pbrt::lexer::{Token, TokenKind};
use crate::pbrt::stream::TokenStream;

/// Memory of a parameter besides its name and values, and of one of its strings besides the text,
/// roughly.
const PARAM_BYTES: u64 = size_of::<Param>() as u64 + 64;

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

/// A list of this many numbers is larger than any scene text should hold.
const MAX_VALUES: usize = 1 << 30;

impl ParamSet {
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

    /// The values of a parameter; in v3 perhaps numbers where strings belong, or the other way
    /// round: then the second is true. Without a type, whatever comes.
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
                    .and_then(|()| room.add(super::STRING_BYTES + token.raw().len() as u64)),
            };
            grown.map_err(no_room)?;
            self.push_value(&mut values, &token, pos, name)?;
            if !bracketed {
                break;
            }
        }
        Ok((values, mistaken))
    }

    /// Appends the value that a token is; `pos` is where the parameter stands.
    fn push_value(
        &self,
        values: &mut Values,
        token: &Token,
        pos: &Pos,
        name: &str,
    ) -> Result<(), SceneError> {
        let fail = |pos: &Pos, what: fmt::Arguments<'_>| {
            Err(Site::new(pos.clone(), &self.site.label).error(what))
        };
        match values {
            Values::Numbers(list) if list.len() < MAX_VALUES => list.push(match token.number() {
                Ok(x) => x,
                Err(e) => return Err(self.amend(token, name, e)),
            }),
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
        Ok(())
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
}
