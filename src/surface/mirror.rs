//! Perfect specular reflection without Fresnel (pbrt-v3 `mirror`).

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use crate::simd::{Lanes, Mask, Vec3};

/// Row: reflectance.
pub struct Mirror;

/// The mirror direction about `z`, with unit densities.
#[inline(always)]
pub(super) fn reflect<L: Lanes>(wo: Vec3<L>, reflectance: Vec3<L>) -> BsdfSample<L> {
    BsdfSample {
        wi: Vec3::new(-wo.x, -wo.y, wo.z),
        weight: reflectance.or_zero(wo.z.eq(L::zero()).not()),
        pdf: L::one(),
        pdf_reverse: L::one(),
    }
}

impl Bsdf for Mirror {
    const NAME: &'static str = "mirror";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        reflect(wo, Vec3::new(row[0], row[1], row[2]))
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}
