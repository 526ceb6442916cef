//! Scattering at surfaces: one file a BSDF, eight hits at a time, queued by kind.
//!
//! 1. [`MaterialTable`] reduces a scene's materials to a [`Kind`] and a *parameter row* of eight floats each. Rows of
//!    constant materials are shared; textured ones are evaluated into a row per hit ([`texture`]).
//! 2. A BSDF is a type implementing [`Bsdf`] over local directions (`z` along the shading normal) and a parameter row. It
//!    never sees a scene.
//! 3. Of a [`mixture`] one component is chosen per hit; it never gets as far as a kernel.
//! 4. Adding one is a file, a [`Kind`], and a line in [`for_kind`] and in [`MaterialTable::new`].

pub mod bump;
pub mod coat;
pub mod coat_table;
pub mod coated_conductor;
pub mod coated_diffuse;
pub mod conductor;
pub mod cutout;
pub mod dielectric;
pub mod diffuse;
pub mod diffuse_transmission;
pub mod fresnel;
pub mod material;
pub mod microfacet;
pub mod mirror;
pub mod mixture;
pub mod plastic;
pub mod rough_dielectric;
pub mod seen_through;
pub mod substrate;
pub mod texture;
pub mod thin_dielectric;

pub use self::cutout::Cutouts;
pub use self::material::MaterialTable;
use crate::simd::{Lanes, Vec3};

/// The kinds of BSDF kernels; a shading queue each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Kind {
    Diffuse,
    OrenNayar,
    Mirror,
    SmoothConductor,
    RoughConductor,
    SmoothDielectric,
    Plastic,
    ThinDielectric,
    DiffuseTransmission,
    Substrate,
    RoughDielectric,
    Coat,
    CoatedDiffuse,
    CoatedDiffuseBase,
    CoatedMirror,
    CoatedConductor,
    CoatedConductorBase,
}

impl Kind {
    pub const ALL: [Kind; 17] = [
        Kind::Diffuse,
        Kind::OrenNayar,
        Kind::Mirror,
        Kind::SmoothConductor,
        Kind::RoughConductor,
        Kind::SmoothDielectric,
        Kind::Plastic,
        Kind::ThinDielectric,
        Kind::DiffuseTransmission,
        Kind::Substrate,
        Kind::RoughDielectric,
        Kind::Coat,
        Kind::CoatedDiffuse,
        Kind::CoatedDiffuseBase,
        Kind::CoatedMirror,
        Kind::CoatedConductor,
        Kind::CoatedConductorBase,
    ];

    /// True if the BSDF is a sum of delta distributions: it cannot be connected to ([`Bsdf::DELTA`]).
    pub fn is_delta(self) -> bool {
        matches!(
            self,
            Kind::Mirror
                | Kind::SmoothConductor
                | Kind::SmoothDielectric
                | Kind::ThinDielectric
                | Kind::Coat
                | Kind::CoatedMirror
        )
    }

    /// [`Bsdf::LOBES`].
    pub fn has_lobes(self) -> bool {
        matches!(
            self,
            Kind::SmoothDielectric
                | Kind::Plastic
                | Kind::ThinDielectric
                | Kind::DiffuseTransmission
                | Kind::Substrate
                | Kind::RoughDielectric
                | Kind::CoatedDiffuse
                | Kind::CoatedConductor
                | Kind::CoatedConductorBase
        )
    }

    pub fn name(self) -> &'static str {
        match self {
            Kind::Diffuse => "diffuse",
            Kind::OrenNayar => "diffuse (Oren-Nayar)",
            Kind::Mirror => "mirror",
            Kind::SmoothConductor => "smooth conductor",
            Kind::RoughConductor => "rough conductor",
            Kind::SmoothDielectric => "smooth dielectric",
            Kind::Plastic => "plastic",
            Kind::ThinDielectric => "thin dielectric",
            Kind::DiffuseTransmission => "diffuse transmission",
            Kind::Substrate => "substrate",
            Kind::RoughDielectric => "rough dielectric",
            Kind::Coat => "coat",
            Kind::CoatedDiffuse => "coated diffuse",
            Kind::CoatedDiffuseBase => "diffuse under a coat",
            Kind::CoatedMirror => "coated mirror",
            Kind::CoatedConductor => "coated conductor",
            Kind::CoatedConductorBase => "conductor under a coat",
        }
    }
}

/// Calls `$f::<BsdfType, ...>($args)` for the BSDF type of a kind.
#[macro_export]
macro_rules! for_kind {
    ($kind:expr, $self:ident . $f:ident :: <_ $(, $g:ty)*> ($($arg:expr),* $(,)?)) => {
        match $kind {
            $crate::surface::Kind::Diffuse => $self.$f::<$crate::surface::diffuse::Diffuse $(, $g)*>($($arg),*),
            $crate::surface::Kind::OrenNayar => $self.$f::<$crate::surface::diffuse::OrenNayar $(, $g)*>($($arg),*),
            $crate::surface::Kind::Mirror => $self.$f::<$crate::surface::mirror::Mirror $(, $g)*>($($arg),*),
            $crate::surface::Kind::SmoothConductor => $self.$f::<$crate::surface::conductor::Smooth $(, $g)*>($($arg),*),
            $crate::surface::Kind::RoughConductor => $self.$f::<$crate::surface::conductor::Rough $(, $g)*>($($arg),*),
            $crate::surface::Kind::SmoothDielectric => $self.$f::<$crate::surface::dielectric::Smooth $(, $g)*>($($arg),*),
            $crate::surface::Kind::Plastic => $self.$f::<$crate::surface::plastic::Plastic $(, $g)*>($($arg),*),
            $crate::surface::Kind::ThinDielectric => $self.$f::<$crate::surface::thin_dielectric::ThinDielectric $(, $g)*>($($arg),*),
            $crate::surface::Kind::DiffuseTransmission => $self.$f::<$crate::surface::diffuse_transmission::DiffuseTransmission $(, $g)*>($($arg),*),
            $crate::surface::Kind::Substrate => $self.$f::<$crate::surface::substrate::Substrate $(, $g)*>($($arg),*),
            $crate::surface::Kind::RoughDielectric => $self.$f::<$crate::surface::rough_dielectric::Rough $(, $g)*>($($arg),*),
            $crate::surface::Kind::Coat => $self.$f::<$crate::surface::coated_conductor::Coat $(, $g)*>($($arg),*),
            $crate::surface::Kind::CoatedDiffuse => $self.$f::<$crate::surface::coated_diffuse::Rough $(, $g)*>($($arg),*),
            $crate::surface::Kind::CoatedDiffuseBase => $self.$f::<$crate::surface::coated_diffuse::Base $(, $g)*>($($arg),*),
            $crate::surface::Kind::CoatedMirror => $self.$f::<$crate::surface::coated_conductor::Smooth $(, $g)*>($($arg),*),
            $crate::surface::Kind::CoatedConductor => $self.$f::<$crate::surface::coated_conductor::Rough $(, $g)*>($($arg),*),
            $crate::surface::Kind::CoatedConductorBase => $self.$f::<$crate::surface::coated_conductor::Base $(, $g)*>($($arg),*),
        }
    };
}

/// What is carried along a subpath: radiance on camera subpaths is scaled by the square of the index ratio at refraction,
/// importance on light subpaths is not (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Camera subpath: the sampled direction is where light comes from.
    Radiance,
    /// Light subpath.
    Importance,
}

/// A sampled direction.
pub struct BsdfSample<L: Lanes> {
    /// Local, unit.
    pub wi: Vec3<L>,
    /// `f(wo, wi) |cos wi| / pdf`, cosine against the shading normal; 0 in lanes without a sample.
    pub weight: Vec3<L>,
    /// Density of `wi` given `wo`, solid angle. For delta BSDFs 1.
    pub pdf: L,
    /// Density of `wo` given `wi`. For delta BSDFs over `pdf`: 1, since their choice of lobe is symmetric, but for what refraction does to
    /// solid angles.
    pub pdf_reverse: L,
}

/// A BSDF evaluated for a pair of directions.
pub struct BsdfValue<L: Lanes> {
    /// `f(wo, wi)`, without a cosine.
    pub f: Vec3<L>,
    /// Density of `wi` given `wo`, solid angle.
    pub pdf: L,
    /// Density of `wo` given `wi`.
    pub pdf_reverse: L,
}

impl<L: Lanes> BsdfValue<L> {
    /// No scattering.
    #[inline(always)]
    pub fn black() -> Self {
        Self {
            f: Vec3::zero(),
            pdf: L::zero(),
            pdf_reverse: L::zero(),
        }
    }
}

/// A scattering function over a parameter row. Directions are local and point away from the surface.
pub trait Bsdf {
    /// Consists of delta distributions only.
    const DELTA: bool;
    /// Sampling reads a third primary sample, the choice of lobe.
    const LOBES: bool;
    /// [`Bsdf::across`] is not 0.
    const ACROSS: bool = false;

    /// Samples a direction from three primary samples (the third is 0 unless [`Kind::has_lobes`]).
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L>;

    /// Value and densities for two given directions (0 for delta BSDFs). Reflection is the same in both modes; of transmission, one mode is
    /// the other with the directions swapped.
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L>;

    /// What pbrt-v3 makes of directions about which the true surface and this one disagree: the value of reflection if they are on
    /// different sides of this one, of transmission if on the same.
    #[inline(always)]
    fn across<L: Lanes>(_row: &[L; 8], _wo: Vec3<L>, _wi: Vec3<L>) -> Vec3<L> {
        Vec3::zero()
    }
}
