//! Materials: what is in one place of a surface, the same for both dialects.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use super::spectrum::IndexCurve;
use super::texture::{Param, Texture};

/// A material as the file means it, both dialects reduced to one set of kinds.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name it was made under, or its type.
    pub name: String,
    /// Where it was made (`scene.pbrt:42`), for reports.
    pub origin: String,
    /// What scatters light.
    pub kind: MaterialKind,
    /// What tilts shading normals, if anything does.
    pub bump: Option<Bump>,
}

/// What tilts the shading normals of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bump {
    /// v3 `bumpmap`, v4 `displacement`: a height along the normal, in lengths of the scene file.
    Height {
        /// Of the surface, in any channel: a number.
        height: Param,
        /// What it is measured along.
        tangents: Tangents,
    },
    /// v4 `normalmap`: an image of directions, `(1 + x) / 2` in each channel, `x` along dp/du, `z`
    /// along the normal.
    Normal {
        /// Index into the scene's images.
        image: u32,
    },
}

/// What heights are measured along on meshes with vertex normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangents {
    /// v3: directions of length 1 in the scene file.
    Unit,
    /// v4: as long as dp/du, both.
    LikeU,
}

/// What a surface is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialKind {
    /// One BSDF. Which there are is not known here.
    Bsdf(Arc<dyn Description>),
    /// Several materials in one place, their BSDFs added up with a weight each: `mix` of both
    /// dialects, v3's `uber` and `translucent`. At most [`MAX_COMPONENTS`], none of them an
    /// interface; nested at most [`MAX_NESTING`] deep.
    Mixture {
        /// At least one.
        components: Vec<Component>,
    },
    /// `interface`, v3 `""` and `none`: rays pass as if nothing were there.
    Interface,
}

/// What a scene says of a BSDF: its parameters, as plain data. How it scatters is the matter of
/// whoever declares the type.
pub trait Description: Any + Same + fmt::Debug + Send + Sync {
    /// The parameters that textures may vary.
    fn params(&self) -> Vec<Param>;

    /// Whether lobes have different widths along `u` and `v`.
    fn is_anisotropic(&self) -> bool {
        false
    }

    /// How the index of refraction depends on the wavelength, if it does.
    fn dispersion(&self) -> Option<&IndexCurve> {
        None
    }

    /// True only if no light leaves such a surface.
    fn is_black(&self) -> bool {
        false
    }

    /// Whether it is a fibre seen from outside, as hair is, light through it included. Where `v` is
    /// across it always matters, and light is to meet a curve of it once.
    fn is_fibre(&self) -> bool {
        false
    }

    /// Whether light that the surface refracts comes out of it elsewhere.
    fn is_subsurface(&self) -> bool {
        false
    }
}

/// Equality of values whose types are not known.
pub trait Same {
    /// True if both are of one type, and equal.
    fn is_same(&self, other: &dyn Any) -> bool;
}

impl<T: PartialEq + 'static> Same for T {
    fn is_same(&self, other: &dyn Any) -> bool {
        other.downcast_ref() == Some(self)
    }
}

impl PartialEq for dyn Description {
    fn eq(&self, other: &Self) -> bool {
        self.is_same(other)
    }
}

impl<D: Description> From<D> for MaterialKind {
    fn from(description: D) -> Self {
        Self::Bsdf(Arc::new(description))
    }
}

impl MaterialKind {
    /// Its description if it is one BSDF, and of this type.
    pub fn get<D: Description>(&self) -> Option<&D> {
        let any: &dyn Any = &**self.description()?;
        any.downcast_ref()
    }

    /// Changes its description if it is one BSDF, and of this type; says whether it is.
    pub fn change<D: Description + Clone>(&mut self, change: impl FnOnce(&mut D)) -> bool {
        let Some(mut description) = self.get::<D>().cloned() else {
            return false;
        };
        change(&mut description);
        *self = description.into();
        true
    }

    /// If it is one BSDF.
    pub fn description(&self) -> Option<&Arc<dyn Description>> {
        match self {
            Self::Bsdf(description) => Some(description),
            Self::Mixture { .. } | Self::Interface => None,
        }
    }

    /// The parameters that textures may vary; of a mixture its own, not those of its components.
    pub fn params(&self) -> Vec<Param> {
        match self {
            Self::Bsdf(description) => description.params(),
            Self::Mixture { components } => (components.iter())
                .flat_map(|c| [&[c.weight.param()], &c.albedo[..]].concat())
                .collect(),
            Self::Interface => Vec::new(),
        }
    }

    /// [`Description::is_anisotropic`]; never of a mixture, but of its components.
    pub fn is_anisotropic(&self) -> bool {
        self.description().is_some_and(|d| d.is_anisotropic())
    }

    /// [`Description::is_fibre`]; never of a mixture, but of its components.
    pub fn is_fibre(&self) -> bool {
        self.description().is_some_and(|d| d.is_fibre())
    }

    /// [`Description::is_subsurface`]; never of a mixture.
    pub fn is_subsurface(&self) -> bool {
        self.description().is_some_and(|d| d.is_subsurface())
    }

    /// [`Description::dispersion`]; never of a mixture, but of its components.
    pub fn dispersion(&self) -> Option<&IndexCurve> {
        self.description().and_then(|d| d.dispersion())
    }

    /// [`Description::is_black`]; never of a mixture, but of its components.
    pub fn is_black(&self) -> bool {
        self.description().is_some_and(|d| d.is_black())
    }

    /// Whether evaluating it depends on texture coordinates, or on the tangents derived from them.
    /// `below` says it of the materials that a mixture is made of.
    pub fn needs_uv(&self, textures: &[Texture], below: &dyn Fn(u32) -> bool) -> bool {
        let textured = self.params().iter().any(|p| p.uses_uv(textures));
        textured || self.is_anisotropic() || self.components().iter().any(|c| below(c.material))
    }

    /// Of a mixture; none of others.
    pub fn components(&self) -> &[Component] {
        match self {
            Self::Mixture { components } => components,
            Self::Bsdf(_) | Self::Interface => &[],
        }
    }

    /// Memory of its description, in bytes.
    pub fn bytes(&self) -> usize {
        self.description().map_or(0, |d| size_of_val(&**d))
    }
}

/// Components of one mixture, at most.
pub const MAX_COMPONENTS: usize = 4;

/// Mixtures within mixtures, at most, the outermost included: every one spends digits of one
/// primary sample.
pub const MAX_NESTING: usize = 8;

/// A part of a [`MaterialKind::Mixture`].
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// Index of an earlier entry of [`Scene::materials`](super::Scene::materials), so that the
    /// table has no cycles.
    pub material: u32,
    /// What its BSDF is multiplied by.
    pub weight: Weight,
    /// The component is chosen in proportion to the mean of its weight times the sum of the means
    /// of these (1 if there are none): what can be said of its albedo without knowing directions.
    pub albedo: Vec<Param>,
}

/// A weight of a component, per channel, from 0 to what reflectances may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// This amount.
    Amount(Param),
    /// What that amount leaves of 1.
    Rest(Param),
}

impl Weight {
    /// The whole of a BSDF.
    pub const ONE: Weight = Weight::Amount(Param::Constant([1.0; 3]));

    /// The amount, of either kind.
    pub fn param(&self) -> Param {
        let (Weight::Amount(param) | Weight::Rest(param)) = *self;
        param
    }
}

/// Microfacet roughness. With `remap` the value goes through the dialect's own `RoughnessToAlpha`;
/// without it, it is the Trowbridge-Reitz alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// Along increasing `u`.
    pub u: Param,
    /// Across it.
    pub v: Param,
    /// How values become alphas.
    pub remap: Remap,
}

impl Roughness {
    /// Whether it differs along `u` and `v`.
    pub fn is_anisotropic(&self) -> bool {
        self.u != self.v
    }
}

/// What becomes of a roughness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remap {
    /// The value is alpha.
    None,
    /// pbrt-v3's polynomial in `ln(roughness)`, `TrowbridgeReitzDistribution::RoughnessToAlpha`.
    V3,
    /// pbrt-v4's `sqrt(roughness)`.
    V4,
}

/// Alpha below which an interface counts as smooth (pbrt-v4, `EffectivelySmooth`).
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// Whether a surface with these alphas is smooth.
pub fn is_smooth(alphas: [f32; 2]) -> bool {
    alphas[0].max(alphas[1]) < SMOOTH_ALPHA
}
