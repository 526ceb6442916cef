//! Materials: one set of kinds for both dialects.

use std::sync::Arc;

use super::spectrum::IndexCurve;
use super::texture::Param;

/// A material as the file means it, both dialects reduced to one set of kinds.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name it was made under, or its type.
    pub name: String,
    /// Where it was made (`scene.pbrt:42`), for reports.
    pub origin: String,
    pub kind: MaterialKind,
    pub bump: Option<Bump>,
}

/// What tilts the shading normals of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bump {
    /// v3 `bumpmap`, v4 `displacement`: a height along the normal, in lengths of the scene file.
    Height { height: Param, tangents: Tangents },
    /// v4 `normalmap`: an image of directions, `(1 + x) / 2` in each channel, `x` along dp/du, `z`
    /// along the normal.
    Normal { image: u32 },
}

/// What heights are measured along on meshes with vertex normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangents {
    /// v3: directions of length 1 in the scene file.
    Unit,
    /// v4: as long as dp/du, both.
    LikeU,
}

#[derive(Clone, Debug, PartialEq)]
pub enum MaterialKind {
    /// v3 `matte`, v4 `diffuse`. `sigma` is Oren-Nayar's roughness in degrees (v3 only; 0 is
    /// Lambertian).
    Diffuse { reflectance: Param, sigma: Param },
    /// v3 `mirror`: perfect specular reflection without Fresnel.
    Mirror { reflectance: Param },
    /// v3 `metal`, v4 `conductor`: microfacet reflection, complex Fresnel.
    Conductor {
        fresnel: ConductorFresnel,
        roughness: Roughness,
    },
    /// v3 `glass`, v4 `dielectric`: smooth, or microfacet reflection and refraction. `eta` is
    /// inside over outside, RGB equal; with `dispersion` it is that of the helium d line.
    Dielectric {
        reflectance: Param,
        transmittance: Param,
        eta: Param,
        dispersion: Option<Arc<IndexCurve>>,
        roughness: Roughness,
    },
    /// v3 `plastic`: Lambertian plus glossy dielectric reflection (index 1.5).
    Plastic {
        diffuse: Param,
        specular: Param,
        roughness: Roughness,
    },
    /// v4 `thindielectric`: a sheet of glass without thickness, that reflects and transmits without
    /// bending.
    ThinDielectric {
        eta: Param,
        dispersion: Option<Arc<IndexCurve>>,
    },
    /// v4 `diffusetransmission`, v3 `translucent` but for its glossy lobes: Lambertian on both
    /// sides. Each colour is the product of two (v3: `Kd` with `reflect` or `transmit`) and of
    /// `scale`, clamped to [0, 1].
    DiffuseTransmission {
        reflectance: [Param; 2],
        transmittance: [Param; 2],
        scale: f32,
    },
    /// v3 `substrate`: a diffuse base under a glossy coat (Ashikhmin and Shirley 2000).
    Substrate {
        diffuse: Param,
        specular: Param,
        roughness: Roughness,
    },
    /// v4 `coateddiffuse`: Lambertian under a dielectric coat. Of a smooth coat the base alone: its
    /// reflection is [`MaterialKind::Coat`].
    CoatedDiffuse { reflectance: Param, coat: Coat },
    /// v4 `coatedconductor`. `eta` and `k` are relative to the coat, `alphas` those of the
    /// conductor. If only the coat is smooth, the conductor alone, as of
    /// [`MaterialKind::CoatedDiffuse`].
    CoatedConductor {
        eta: [f32; 3],
        k: [f32; 3],
        alphas: [f32; 2],
        coat: Coat,
    },
    /// Either of the two where a roughness or the conductor is looked up in textures. `interface`
    /// is the roughness of the coat; if that varies, the alphas in `coat` mean nothing, and it
    /// counts as rough. If the coat is smooth, the base alone.
    TexturedCoat {
        base: CoatedBase,
        interface: Roughness,
        coat: Coat,
    },
    /// What a smooth coat reflects; `eta` is inside over outside.
    Coat { eta: f32 },
    /// Several materials in one place, their BSDFs added up with a weight each: `mix` of both
    /// dialects, v3's `uber` and `translucent`. At most [`MAX_COMPONENTS`], none of them an
    /// interface; nested at most [`MAX_NESTING`] deep.
    Mixture { components: Vec<Component> },
    /// `interface`, v3 `""` and `none`: rays pass as if nothing were there.
    Interface,
}

/// A layer of dielectric over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Trowbridge-Reitz alphas of its interface, 0 to 1e3; [`Coat::is_smooth`].
    pub alphas: [f32; 2],
    /// Inside over outside, positive.
    pub eta: f32,
    /// Times the extinction, which is 1.
    pub thickness: f32,
    /// Events that a path between the layers may have; every other one is at the base.
    pub max_depth: u32,
}

/// What is under a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CoatedBase {
    Diffuse(Param),
    /// Its index is relative to the outside.
    Conductor {
        fresnel: ConductorFresnel,
        roughness: Roughness,
    },
}

/// Alpha below which an interface counts as smooth (pbrt-v4, `EffectivelySmooth`).
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// Whether a surface with these alphas is smooth.
pub fn is_smooth(alphas: [f32; 2]) -> bool {
    alphas[0].max(alphas[1]) < SMOOTH_ALPHA
}

impl Coat {
    pub fn is_smooth(&self) -> bool {
        is_smooth(self.alphas)
    }

    /// How often light may meet the base.
    pub fn visits(&self) -> u32 {
        self.max_depth.div_ceil(2)
    }
}

impl MaterialKind {
    /// How the index of refraction depends on the wavelength, if it does.
    pub fn dispersion(&self) -> Option<&IndexCurve> {
        match self {
            Self::Dielectric { dispersion, .. } | Self::ThinDielectric { dispersion, .. } => {
                dispersion.as_deref()
            }
            _ => None,
        }
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
    /// of these (1 if there are none): what can be said of its albedo without knowing
    /// directions.
    pub albedo: Vec<Param>,
}

/// A weight of a component, per channel, clamped to [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    Amount(Param),
    /// What that amount leaves of 1.
    Rest(Param),
}

impl Weight {
    pub const ONE: Weight = Weight::Amount(Param::Constant([1.0; 3]));

    pub fn param(&self) -> Param {
        let (Weight::Amount(param) | Weight::Rest(param)) = *self;
        param
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Complex index of refraction (relative to the outside).
    EtaK { eta: Param, k: Param },
    /// v4 `reflectance`: the index with `eta = 1` whose reflectance at normal incidence is this.
    Reflectance(Param),
}

/// Microfacet roughness. With `remap` the value goes through the dialect's own `RoughnessToAlpha`;
/// without it, it is the Trowbridge-Reitz alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    pub u: Param,
    pub v: Param,
    pub remap: Remap,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remap {
    /// The value is alpha.
    None,
    /// pbrt-v3's polynomial in `ln(roughness)`, `TrowbridgeReitzDistribution::RoughnessToAlpha`.
    V3,
    /// pbrt-v4's `sqrt(roughness)`.
    V4,
}
