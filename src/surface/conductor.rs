//! Metals: complex Fresnel over a smooth or Trowbridge-Reitz surface.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::same_side;
use super::microfacet::{TrowbridgeReitz, upper};
use super::{fresnel, mirror};
use crate::simd::{Lanes, Mask, Vec3};

/// Row: eta (3), k (3).
pub struct Smooth;

/// Row: eta (3), k (3), alpha x, alpha y.
pub struct Rough;

#[inline(always)]
fn reflectance<L: Lanes>(row: &[L; 8], cos: L) -> Vec3<L> {
    fresnel::conductor(
        cos,
        Vec3::new(row[0], row[1], row[2]),
        Vec3::new(row[3], row[4], row[5]),
    )
}

impl Bsdf for Smooth {
    const NAME: &'static str = "smooth conductor";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        mirror::reflect(wo, reflectance(row, wo.z.abs()))
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

impl Bsdf for Rough {
    const NAME: &'static str = "rough conductor";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        let (up, sign) = upper(wo);
        let h = distribution.sample_normal(up, u[0], u[1]);
        let wi = h.mul_add(L::splat(2.0) * up.dot(h), -up);
        let valid = up.z.gt(L::zero()).and(wi.z.gt(L::zero()));
        let r = distribution.reflection(up, wi);
        let weight = reflectance(row, r.cos_h) * (r.brdf * wi.z / r.pdf);
        BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * sign),
            weight: weight.or_zero(valid),
            pdf: r.pdf,
            pdf_reverse: r.pdf_reverse,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        let valid = same_side(wo, wi);
        let (up_o, up_i) = (upper(wo).0, upper(wi).0);
        let r = distribution.reflection(up_o, up_i);
        BsdfValue {
            f: (reflectance(row, r.cos_h) * r.brdf).or_zero(valid),
            pdf: r.pdf.or_zero(valid),
            pdf_reverse: r.pdf_reverse.or_zero(valid),
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let (brdf, cos) = TrowbridgeReitz::of_row(row).reflection_across(wo, wi);
        reflectance(row, cos.abs()) * brdf
    }
}
