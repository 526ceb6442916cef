//! Parameters of a type, with defaults.

use glam::{DVec2, DVec3};

use super::{Param, ParamSet, Type, Values};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::SceneError;

impl ParamSet {
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
