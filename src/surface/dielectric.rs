//! Smooth glass: a delta reflection and a delta refraction, chosen by Fresnel reflectance.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fresnel;
use crate::simd::{Lanes, Vec3};

/// Row: reflectance (3), transmittance (3), eta (inside over outside).
pub struct Smooth;

impl Bsdf for Smooth {
    const NAME: &'static str = "smooth dielectric";
    const DELTA: bool = true;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let outside = wo.z.gt(L::zero());
        let eta = L::select(outside, row[6], L::one() / row[6]);
        let cos_i = wo.z.abs();
        let boundary = fresnel::dielectric(cos_i, eta);
        let reflects = u[2].lt(boundary.reflectance);
        let inv_eta = L::one() / eta;
        let refracted = Vec3::new(
            -wo.x * inv_eta,
            -wo.y * inv_eta,
            -boundary.cos_t.copysign(wo.z),
        );
        let reflected = Vec3::new(-wo.x, -wo.y, wo.z);
        let transmit = Vec3::new(row[3], row[4], row[5]);
        let transmit = match mode {
            // (eta_i / eta_t)^2 with eta_i on wo's side: radiance is compressed into the denser medium.
            Mode::Radiance => transmit * (inv_eta * inv_eta),
            Mode::Importance => transmit,
        };
        let weight = Vec3::select(reflects, Vec3::new(row[0], row[1], row[2]), transmit);
        // Solid angles change at the boundary: n_i^2 cos_i dw_i = n_t^2 cos_t dw_t, and deltas with them.
        let bend = inv_eta * inv_eta * (cos_i / boundary.cos_t);
        BsdfSample {
            wi: Vec3::select(reflects, reflected, refracted),
            weight: weight.or_zero(cos_i.gt(L::zero())),
            pdf: L::one(),
            pdf_reverse: L::select(reflects, L::one(), bend),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}
