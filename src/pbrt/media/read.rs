//! From parameters to media.

use std::rc::Rc;

use glam::DAffine3;

use super::coefficients::{asymmetry, coefficients};
use super::world::WorldMedium;
use crate::pbrt::budget::Budget;
use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::Deferred;
use crate::scene::Emission;

impl WorldMedium {
    /// Reads a medium; `ctm` is the current transform, and files take of `budget` while they are
    /// read.
    pub fn read(name: &str, set: &ParamSet, ctm: &DAffine3, budget: &Rc<Budget>) -> Deferred<Self> {
        let Some(kind) = set.string("type")? else {
            return Err(set.error("has no \"string type\""));
        };
        let known = match set.dialect {
            Dialect::V3 => "homogeneous or heterogeneous",
            Dialect::V4 => "homogeneous, uniformgrid, rgbgrid, cloud or nanovdb",
        };
        match (set.dialect, kind) {
            (_, "homogeneous") => Self::homogeneous(name, set),
            (Dialect::V3, "heterogeneous") | (Dialect::V4, "uniformgrid") => {
                Self::grid(name, set, ctm)
            }
            (Dialect::V4, "rgbgrid") => Self::rgb_grid(name, set, ctm),
            (Dialect::V4, "cloud") => Self::cloud(name, set, ctm),
            (Dialect::V4, "nanovdb") => Self::nanovdb(name, set, ctm, budget),
            _ => {
                set.accept_all();
                Err(set.error(format_args!(
                    "media of type \"{kind}\" are unknown; use {known}"
                )))
            }
        }
    }

    fn homogeneous(name: &str, set: &ParamSet) -> Deferred<Self> {
        let coefficients = coefficients(set, true)?;
        let mut medium = Self::new(name, set, coefficients);
        medium.g = asymmetry(set)?;
        if set.dialect == Dialect::V4
            && let Some(radiance) = set.color("Le", Use::Emission)?
            && radiance != [0.0; 3]
        {
            let scale = set.float_in("Lescale", 1.0, 0.0, f64::INFINITY)? as f32;
            let [absorption, _] = coefficients;
            medium.emission =
                Emission::Even([0, 1, 2].map(|c| absorption[c] * radiance[c] * scale));
        }
        Ok(medium)
    }
}
