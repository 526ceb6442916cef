//! A thin sheet of glass: both of its boundaries, and all reflections between them, at one place of
//! a surface.
//!
//! Light leaves a sheet with parallel sides as it came: reflected or straight on, never bent. Of
//! each boundary's reflectance `R` and transmittance `T = 1 - R` the sheet makes `R + T R T + T R R
//! R T + ... = R + T^2 R / (1 - R^2)` (pbrt-v4, section 9.5.1,
//! `ThinDielectricBxDF`), which is `2 R / (1 + R)`, without a quotient of zeros where all is
//! reflected.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::dielectric::read_index;
use super::fresnel;
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::spectrum::IndexCurve;
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Vec3};
use std::sync::Arc;

/// Row: eta (inside over outside).
pub struct ThinDielectric;

impl Bsdf for ThinDielectric {
    const NAME: &'static str = "thin dielectric";
    const DELTA: bool = true;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        // The same from both sides, and back as forth: densities and radiance are those of a mirror
        // in both lobes.
        let cos = wo.z.abs();
        let r = fresnel::dielectric(cos, row[0]).reflectance;
        let reflects = u[2].lt((r + r) / (L::one() + r));
        let reflected = Vec3::new(-wo.x, -wo.y, wo.z);
        BsdfSample {
            wi: Vec3::select(reflects, reflected, -wo),
            throughput: Vec3::splat([1.0; 3]).or_zero(cos.gt(L::zero())),
            pdf: L::one(),
            pdf_reverse: L::one(),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

/// v4 `thindielectric`.
#[derive(Clone, Debug, PartialEq)]
pub struct ThinDielectricMaterial {
    /// As of [`DielectricMaterial`](super::dielectric::DielectricMaterial).
    pub eta: Param,
    /// As of [`DielectricMaterial`](super::dielectric::DielectricMaterial).
    pub dispersion: Option<Arc<IndexCurve>>,
}

impl Description for ThinDielectricMaterial {
    fn params(&self) -> Vec<Param> {
        vec![self.eta]
    }

    fn dispersion(&self) -> Option<&IndexCurve> {
        self.dispersion.as_deref()
    }
}

impl BsdfMaterial for ThinDielectricMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V4, "thindielectric")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let (eta, dispersion) = read_index(set, "eta")?;
        Ok(Self { eta, dispersion })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<ThinDielectric>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let eta = at.index(self.eta, &self.dispersion);
        [eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}
