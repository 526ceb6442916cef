//! From what a scene says of a BSDF to parameter rows: what the file of each BSDF implements beside
//! its kernel.

use super::bsdf::Kernel;
use super::bssrdf::Bssrdf;
use super::roughness::alpha;
use super::tabulated::Tabulated;
use super::texture::{self, Place};
use crate::scene::spectrum::IndexCurve;
use crate::scene::{Description, Dialect, Image, Param, Parameters, Rgb, Roughness, Texture};
use std::any::Any;
use std::sync::Arc;

/// A description of which the kernels and rows are known.
pub trait BsdfMaterial: Description + Sized {
    /// What scene files call it. Empty if only other materials are made of it.
    const NAMES: &'static [(Dialect, &'static str)] = &[];

    /// Reads it from a directive that has one of its names.
    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Err(set.error("is no material by itself"))
    }

    /// What takes long to find out and is the same for all of its hits; `()` if nothing does.
    type Tables: Send + Sync;

    /// Makes them, once.
    fn tables(&self, shared: &mut Shared) -> Self::Tables;

    /// The BSDF that its rows are for.
    fn kernel(&self) -> Kernel;

    /// The row at a hit.
    fn row(&self, tables: &Self::Tables, at: &At) -> [f32; 8];

    /// What is below the surface at a hit, if light that it refracts comes out elsewhere.
    fn bssrdf(&self, _tables: &Self::Tables, _at: &At) -> Option<Bssrdf> {
        None
    }
}

/// A hit as rows see it: what parameters are there.
pub struct At<'a> {
    textures: &'a [Texture],
    images: &'a [Image],
    place: &'a Place,
    /// Wavelength, of which only dispersive materials know.
    nm: f32,
    /// [`Scene::brightest`](crate::scene::Scene::brightest).
    brightest: f32,
}

impl<'a> At<'a> {
    /// A place in a scene, for light of the wavelength `nm`. Reflectances there count as at most
    /// `brightest`.
    pub fn new(
        textures: &'a [Texture],
        images: &'a [Image],
        place: &'a Place,
        nm: f32,
        brightest: f32,
    ) -> Self {
        Self {
            textures,
            images,
            place,
            nm,
            brightest,
        }
    }

    /// Texture coordinates.
    #[inline]
    pub fn uv(&self) -> [f32; 2] {
        self.place.uv
    }

    /// The value of a parameter, per channel.
    #[inline]
    pub fn color(&self, param: Param) -> Rgb {
        texture::evaluate(self.textures, self.images, param, self.place)
    }

    /// The value of one that is a number.
    #[inline]
    pub fn number(&self, param: Param) -> f32 {
        self.color(param)[0]
    }

    /// That of a reflectance. In pbrt-v4 it is that of a passive surface; files, interpolation and
    /// scaling can leave [0, 1].
    #[inline]
    pub fn albedo(&self, param: Param) -> Rgb {
        self.color(param).map(|v| self.bounded(v))
    }

    /// A number as reflectances are bounded.
    #[inline]
    pub fn bounded(&self, value: f32) -> f32 {
        value.clamp(0.0, self.brightest)
    }

    /// Trowbridge-Reitz alphas along `u` and `v`.
    #[inline]
    pub fn alphas(&self, roughness: &Roughness) -> [f32; 2] {
        [roughness.u, roughness.v].map(|p| alpha(self.number(p), roughness.remap))
    }

    /// An index of refraction, that of the curve if there is one.
    #[inline]
    pub fn index(&self, eta: Param, curve: &Option<Arc<IndexCurve>>) -> f32 {
        let index = match curve {
            Some(curve) => curve.at(self.nm),
            None => self.number(eta),
        };
        index.max(f32::MIN_POSITIVE)
    }
}

/// Tables that materials of a scene have in common.
#[derive(Default)]
pub struct Shared {
    made: Vec<Box<dyn Any>>,
    /// Those that kernels look values up in.
    pub tabulated: Tabulated,
}

/// Tables of one type, with what they are of.
type Made<K, T> = Vec<(K, T)>;

impl Shared {
    /// The table of `key`: that of an earlier material, or made.
    pub fn table<K, T>(&mut self, key: K, make: impl FnOnce(&K) -> T) -> T
    where
        K: PartialEq + 'static,
        T: Clone + 'static,
    {
        let known = self.made.iter().position(|list| list.is::<Made<K, T>>());
        let place = known.unwrap_or_else(|| {
            self.made.push(Box::new(Made::<K, T>::new()));
            self.made.len() - 1
        });
        let Some(made) = self.made[place].downcast_mut::<Made<K, T>>() else {
            return make(&key);
        };
        if let Some((_, table)) = made.iter().find(|(k, _)| *k == key) {
            return table.clone();
        }
        let table = make(&key);
        made.push((key, table.clone()));
        table
    }
}

/// A material ready to be evaluated.
pub trait Evaluate: Send + Sync {
    /// The row at a hit.
    fn row(&self, at: &At) -> [f32; 8];

    /// [`BsdfMaterial::bssrdf`], lengths as in the scene file.
    fn bssrdf(&self, at: &At) -> Option<Bssrdf>;
}

struct Prepared<'a, M: BsdfMaterial> {
    material: &'a M,
    tables: M::Tables,
}

impl<M: BsdfMaterial> Evaluate for Prepared<'_, M> {
    fn row(&self, at: &At) -> [f32; 8] {
        self.material.row(&self.tables, at)
    }

    fn bssrdf(&self, at: &At) -> Option<Bssrdf> {
        self.material.bssrdf(&self.tables, at)
    }
}

/// The kernel of a material, and what makes its rows.
pub fn prepare<'a, M: BsdfMaterial>(
    material: &'a M,
    shared: &mut Shared,
) -> (Kernel, Box<dyn Evaluate + 'a>) {
    let tables = material.tables(shared);
    (material.kernel(), Box::new(Prepared { material, tables }))
}

/// Whether a material is described by some name of a dialect.
pub fn is_named<M: BsdfMaterial>(dialect: Dialect, name: &str) -> bool {
    M::NAMES.contains(&(dialect, name))
}
