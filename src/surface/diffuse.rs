//! Diffuse reflection: Lambert, and Oren and Nayar's rough variant (1994; the qualitative model of
//! pbrt-v3, section 8.4.1).

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Vec3, math};
use std::f32::consts::FRAC_1_PI;

/// Row: reflectance.
pub struct Diffuse;

/// Row: reflectance, A, B.
pub struct OrenNayar;

/// Oren and Nayar's A and B for a roughness in degrees.
pub fn oren_nayar_coefficients(sigma_degrees: f32) -> (f32, f32) {
    let sigma2 = sigma_degrees.to_radians().powi(2);
    (
        1.0 - sigma2 / (2.0 * (sigma2 + 0.33)),
        0.45 * sigma2 / (sigma2 + 0.09),
    )
}

/// Cosine-distributed direction on `wo`'s side, and its density.
#[inline(always)]
pub(super) fn cosine_sample<L: Lanes>(wo: Vec3<L>, u: [L; 3]) -> (Vec3<L>, L) {
    let mut wi = math::cosine_hemisphere(u[0], u[1]);
    let pdf = wi.z * L::splat(FRAC_1_PI);
    wi.z = wi.z.copysign(wo.z);
    (wi, pdf)
}

/// True where the directions are strictly on different sides.
#[inline(always)]
pub(super) fn opposite<L: Lanes>(wo: Vec3<L>, wi: Vec3<L>) -> L::Mask {
    (wo.z * wi.z).lt(L::zero())
}

/// True where both directions are strictly on one side.
#[inline(always)]
pub(super) fn same_side<L: Lanes>(wo: Vec3<L>, wi: Vec3<L>) -> L::Mask {
    (wo.z * wi.z).gt(L::zero())
}

impl Bsdf for Diffuse {
    const NAME: &'static str = "diffuse";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let (wi, pdf) = cosine_sample(wo, u);
        BsdfSample {
            wi,
            throughput: Vec3::new(row[0], row[1], row[2]).or_zero(pdf.gt(L::zero())),
            pdf,
            pdf_reverse: wo.z.abs() * L::splat(FRAC_1_PI),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let valid = same_side(wo, wi);
        let inv_pi = L::splat(FRAC_1_PI).or_zero(valid);
        BsdfValue {
            f: Vec3::new(row[0], row[1], row[2]) * inv_pi,
            pdf: wi.z.abs() * inv_pi,
            pdf_reverse: wo.z.abs() * inv_pi,
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let inv_pi = L::splat(FRAC_1_PI).or_zero(opposite(wo, wi));
        Vec3::new(row[0], row[1], row[2]) * inv_pi
    }
}

impl OrenNayar {
    /// The factor that multiplies `reflectance / pi`.
    #[inline(always)]
    fn factor<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> L {
        let tiny = L::splat(f32::MIN_POSITIVE);
        let (ci, co) = (wi.z.abs(), wo.z.abs());
        let si = (L::one() - ci * ci).max(L::zero()).sqrt();
        let so = (L::one() - co * co).max(L::zero()).sqrt();
        // cos(phi_i - phi_o) from the projections; 0 where one of them has no direction.
        let planar = wi.x.mul_add(wo.x, wi.y * wo.y);
        let norm = si * so;
        let cos_phi = L::select(norm.gt(tiny), planar / norm, L::zero());
        let cos_phi = cos_phi.max(L::zero()).min(L::one());
        // sin(alpha) tan(beta): the larger cosine belongs to the smaller angle.
        let sin_tan = si * so / ci.max(co).max(tiny);
        (row[4] * cos_phi).mul_add(sin_tan, row[3])
    }
}

impl Bsdf for OrenNayar {
    const NAME: &'static str = "diffuse (Oren-Nayar)";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let (wi, pdf) = cosine_sample(wo, u);
        let weight = Vec3::new(row[0], row[1], row[2]) * Self::factor(row, wo, wi);
        BsdfSample {
            wi,
            throughput: weight.or_zero(pdf.gt(L::zero())),
            pdf,
            pdf_reverse: wo.z.abs() * L::splat(FRAC_1_PI),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        let lambert = Diffuse::eval(row, wo, wi, mode);
        BsdfValue {
            f: lambert.f * Self::factor(row, wo, wi),
            ..lambert
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        Diffuse::across(row, wo, wi) * Self::factor(row, wo, wi)
    }
}

/// v3 `matte`, v4 `diffuse`.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseMaterial {
    /// Albedo.
    pub reflectance: Param,
    /// Oren-Nayar's roughness in degrees (v3 only); 0 is Lambertian.
    pub sigma: Param,
}

impl Description for DiffuseMaterial {
    fn params(&self) -> Vec<Param> {
        vec![self.reflectance, self.sigma]
    }

    fn is_black(&self) -> bool {
        self.reflectance.is_black()
    }
}

impl BsdfMaterial for DiffuseMaterial {
    const NAMES: &'static [(Dialect, &'static str)] =
        &[(Dialect::V3, "matte"), (Dialect::V4, "diffuse")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(match set.dialect() {
            Dialect::V3 => Self {
                reflectance: set.albedo_or("Kd", 0.5)?,
                sigma: set.float_or("sigma", 0.0)?,
            },
            Dialect::V4 => Self {
                reflectance: set.albedo_or("reflectance", 0.5)?,
                sigma: Param::Constant([0.0; 3]),
            },
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        match self.sigma {
            Param::Constant([0.0, ..]) => Kernel::of::<Diffuse>(),
            _ => Kernel::of::<OrenNayar>(),
        }
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let [r, g, b] = at.albedo(self.reflectance);
        let (c, d) = oren_nayar_coefficients(at.number(self.sigma).clamp(0.0, 90.0));
        [r, g, b, c, d, 0.0, 0.0, 0.0]
    }
}
