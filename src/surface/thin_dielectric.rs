//! A thin sheet of glass: both of its boundaries, and all reflections between them, at one place of a surface.
//!
//! Light leaves a sheet with parallel sides as it came: reflected or straight on, never bent. Of each boundary's reflectance `R` and
//! transmittance `T = 1 - R` the sheet makes `R + T R T + T R R R T + ... = R + T^2 R / (1 - R^2)` (pbrt-v4, section 9.5.1,
//! `ThinDielectricBxDF`), which is `2 R / (1 + R)`, without a quotient of zeros where all is reflected.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fresnel;
use crate::simd::{Lanes, Vec3};

/// Row: eta (inside over outside).
pub struct ThinDielectric;

impl Bsdf for ThinDielectric {
    const NAME: &'static str = "thin dielectric";
    const DELTA: bool = true;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        // The same from both sides, and back as forth: densities and radiance are those of a mirror in both lobes.
        let cos = wo.z.abs();
        let r = fresnel::dielectric(cos, row[0]).reflectance;
        let reflects = u[2].lt((r + r) / (L::one() + r));
        let reflected = Vec3::new(-wo.x, -wo.y, wo.z);
        BsdfSample {
            wi: Vec3::select(reflects, reflected, -wo),
            weight: Vec3::splat([1.0; 3]).or_zero(cos.gt(L::zero())),
            pdf: L::one(),
            pdf_reverse: L::one(),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}
