//! Materials as they were read, before the scene's table has them.

use std::cell::Cell;
use std::rc::Rc;

use rpds::HashTrieMap;

use super::budget::Charge;
use super::params::ParamSet;
use super::textures::Deferred;
use crate::scene::{Bump, MaterialKind, Param, Weight};

/// A material as it was read: of one kind, or several in one place.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Built {
    One(MaterialKind),
    /// At most [`MAX_COMPONENTS`](crate::scene::MAX_COMPONENTS).
    Mixture(Vec<Part>),
}

/// Memory of an index over the wavelengths, roughly.
const CURVE_BYTES: usize = 2048;

impl Built {
    /// Memory that it takes besides its own size, roughly.
    pub fn bytes(&self) -> usize {
        match self {
            Self::One(kind) => kind.bytes() + kind.dispersion().map_or(0, |_| CURVE_BYTES),
            Self::Mixture(parts) => (parts.iter())
                .map(|part| size_of::<Part>() + part.material.bytes() + CURVE_BYTES / 8)
                .sum(),
        }
    }
}

/// A part of a mixture, as [`Component`](crate::scene::Component).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub material: PartMaterial,
    pub weight: Weight,
    pub albedo: Vec<Param>,
}

#[derive(Clone, Debug)]
pub(super) enum PartMaterial {
    /// Belongs to this mixture alone.
    Own(MaterialKind),
    Named(Rc<MaterialDef>),
}

impl PartMaterial {
    fn bytes(&self) -> usize {
        match self {
            Self::Own(kind) => kind.bytes(),
            Self::Named(_) => 0,
        }
    }
}

impl PartialEq for PartMaterial {
    /// Names stand for what they name.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Own(a), Self::Own(b)) => a == b,
            (Self::Named(a), Self::Named(b)) => Rc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// A material as it was made. It enters the scene's table when a shape first uses it.
#[derive(Debug)]
pub(super) struct MaterialDef {
    /// Its name, or its type if it has none.
    pub name: String,
    pub kind: String,
    pub set: ParamSet,
    pub built: Deferred<(Built, Option<Bump>)>,
    pub index: Cell<Option<u32>>,
    pub used: Cell<bool>,
    pub _room: Charge,
}

/// By name, as a mixture finds its components. Copies share what they have in common: every block
/// saves one.
pub(super) type MaterialNames = HashTrieMap<String, Rc<MaterialDef>>;
