//! What a BSDF is: a type with a name, flags, a way to sample directions and a value.

use super::tabulated::Tabulated;
use crate::simd::{Lanes, Vec3};
use std::any::TypeId;

/// What is carried along a subpath: radiance on camera subpaths is scaled by the square of the
/// index ratio at refraction, importance on light subpaths is not (Veach 1997, section 5.2).
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
    pub throughput: Vec3<L>,
    /// Density of `wi` given `wo`, solid angle. For delta BSDFs 1.
    pub pdf: L,
    /// Density of `wo` given `wi`. For delta BSDFs over `pdf`: 1, since their choice of lobe is
    /// symmetric, but for what refraction does to solid angles.
    pub pdf_reverse: L,
}

/// A BSDF evaluated for a pair of directions.
#[derive(Clone, Copy, Debug)]
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

/// A scattering function over a parameter row. Directions are local and point away from the
/// surface.
pub trait Bsdf: 'static {
    /// What reports call it.
    const NAME: &'static str;
    /// Consists of delta distributions only: it cannot be connected to.
    const DELTA: bool;
    /// Sampling reads a third primary sample, the choice of lobe.
    const LOBES: bool;
    /// Scatters in a medium: there is no surface, no normal and no cosine, and directions are those
    /// of the world.
    const MEDIUM: bool = false;
    /// [`Bsdf::across`] is not 0.
    const ACROSS: bool = false;
    /// Reflection and transmission are one to it: whatever side of a surface directions are on, it
    /// has a value for them.
    const WHOLE: bool = false;

    /// Samples a direction from three primary samples (the third is 0 unless [`Bsdf::LOBES`]).
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L>;

    /// Value and densities for two given directions (0 for delta BSDFs). One mode is the other with
    /// the directions swapped; of most BSDFs, reflection is the same in both.
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L>;

    /// [`Bsdf::sample`] of a BSDF that looks its values up in tables, which its row names.
    #[inline(always)]
    fn sample_in<L: Lanes>(
        _tables: &Tabulated,
        row: &[L; 8],
        wo: Vec3<L>,
        u: [L; 3],
        mode: Mode,
    ) -> BsdfSample<L> {
        Self::sample(row, wo, u, mode)
    }

    /// [`Bsdf::eval`] of a BSDF that looks its values up in tables.
    #[inline(always)]
    fn eval_in<L: Lanes>(
        _tables: &Tabulated,
        row: &[L; 8],
        wo: Vec3<L>,
        wi: Vec3<L>,
        mode: Mode,
    ) -> BsdfValue<L> {
        Self::eval(row, wo, wi, mode)
    }

    /// What pbrt-v3 makes of directions about which the true surface and this one disagree: the
    /// value of reflection if they are on different sides of this one, of transmission if on the
    /// same.
    #[inline(always)]
    fn across<L: Lanes>(_row: &[L; 8], _wo: Vec3<L>, _wi: Vec3<L>) -> Vec3<L> {
        Vec3::zero()
    }
}

/// Stands for a type of BSDF where it is a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(TypeId);

impl Kernel {
    /// That of `B`.
    pub fn of<B: Bsdf>() -> Self {
        Self(TypeId::of::<B>())
    }
}
