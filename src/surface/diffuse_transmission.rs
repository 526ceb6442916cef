//! Diffuse reflection and transmission of a thin sheet, as of paper or a leaf: a Lambertian lobe on
//! either side (pbrt-v4,
//! `DiffuseTransmissionBxDF`).

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::{cosine_sample, opposite, same_side};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Mask, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Row: reflectance (3), transmittance (3).
pub struct DiffuseTransmission;

/// Probability of reflection: by the largest channels, as in pbrt.
#[inline(always)]
fn reflection_probability<L: Lanes>(row: &[L; 8]) -> L {
    let (r, t) = (
        row[0].max(row[1]).max(row[2]),
        row[3].max(row[4]).max(row[5]),
    );
    let sum = r + t;
    L::select(sum.gt(L::zero()), r / sum, L::one())
}

impl Bsdf for DiffuseTransmission {
    const NAME: &'static str = "diffuse transmission";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let p = reflection_probability(row);
        let reflects = u[2].lt(p);
        let chance = L::select(reflects, p, L::one() - p);
        let albedo = Vec3::select(
            reflects,
            Vec3::new(row[0], row[1], row[2]),
            Vec3::new(row[3], row[4], row[5]),
        );
        let (wi, cosine_pdf) = cosine_sample(wo, u);
        let pdf = cosine_pdf * chance;
        BsdfSample {
            wi: Vec3::new(wi.x, wi.y, L::select(reflects, wi.z, -wi.z)),
            throughput: (albedo * (L::one() / chance)).or_zero(pdf.gt(L::zero())),
            pdf,
            pdf_reverse: wo.z.abs() * L::splat(FRAC_1_PI) * chance,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let reflects = same_side(wo, wi);
        let valid = reflects.or((wo.z * wi.z).lt(L::zero()));
        let p = reflection_probability(row);
        let inv_pi = L::splat(FRAC_1_PI).or_zero(valid);
        let chance = L::select(reflects, p, L::one() - p);
        let albedo = Vec3::select(
            reflects,
            Vec3::new(row[0], row[1], row[2]),
            Vec3::new(row[3], row[4], row[5]),
        );
        BsdfValue {
            f: albedo * inv_pi,
            pdf: wi.z.abs() * inv_pi * chance,
            pdf_reverse: wo.z.abs() * inv_pi * chance,
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let albedo = Vec3::select(
            opposite(wo, wi),
            Vec3::new(row[0], row[1], row[2]),
            Vec3::new(row[3], row[4], row[5]),
        );
        albedo * L::splat(FRAC_1_PI)
    }
}

/// v4 `diffusetransmission`, v3 `translucent` but for its glossy lobes. Each colour is the product
/// of two (v3: `Kd` with `reflect` or `transmit`) and of `scale`, bounded as reflectances are.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmissionMaterial {
    /// Factors of the albedo on the side the light comes from.
    pub reflectance: [Param; 2],
    /// Factors of the albedo on the other side.
    pub transmittance: [Param; 2],
    /// Of both albedos.
    pub scale: f32,
}

impl Description for DiffuseTransmissionMaterial {
    fn params(&self) -> Vec<Param> {
        [self.reflectance, self.transmittance].concat()
    }

    fn is_black(&self) -> bool {
        let black = |product: &[Param; 2]| product.iter().any(Param::is_black);
        black(&self.reflectance) && black(&self.transmittance)
    }
}

impl BsdfMaterial for DiffuseTransmissionMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V4, "diffusetransmission")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let one = Param::Constant([1.0; 3]);
        Ok(Self {
            reflectance: [set.albedo_or("reflectance", 0.25)?, one],
            transmittance: [set.albedo_or("transmittance", 0.25)?, one],
            // Finite in `f32`, too: times 0 it must be 0.
            scale: (set.constant("scale", 1.0, 0.0, f64::INFINITY)? as f32).min(f32::MAX),
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<DiffuseTransmission>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let product = |[a, b]: [Param; 2]| {
            let (a, b) = (at.albedo(a), at.albedo(b));
            std::array::from_fn::<f32, 3, _>(|c| at.bounded(self.scale * a[c] * b[c]))
        };
        let (r, t) = (product(self.reflectance), product(self.transmittance));
        [r[0], r[1], r[2], t[0], t[1], t[2], 0.0, 0.0]
    }
}
