//! pbrt-v3's `plastic`: a Lambertian lobe plus a glossy one under dielectric Fresnel, each sampled
//! half of the time.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::{opposite, same_side};
use super::fresnel;
use super::microfacet::{TrowbridgeReitz, sample_coated, upper};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters, Roughness};
use crate::simd::{Lanes, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Row: diffuse (3), specular (3), alpha x, alpha y.
pub struct Plastic;

/// pbrt-v3 sets the boundary up with 1.5 on the outside and 1 on the inside
/// (`FresnelDielectric(1.5f, 1.f)`), so that from the front the lobe reflects fully beyond 41.8
/// degrees, and from the back as glass does; its scenes are made for that look.
const ETA: f32 = 1.5;

/// What is reflected of directions from the front or from the back.
#[inline(always)]
fn reflectance<L: Lanes>(cos: L, front: L::Mask) -> L {
    let eta = L::select(front, L::splat(1.0 / ETA), L::splat(ETA));
    fresnel::dielectric(cos, eta).reflectance
}

/// Probability of sampling the diffuse lobe: a half, unless one of the lobes is black.
#[inline(always)]
fn diffuse_probability<L: Lanes>(row: &[L; 8]) -> L {
    let no_diffuse = (row[0].max(row[1]).max(row[2])).le(L::zero());
    let no_specular = (row[3].max(row[4]).max(row[5])).le(L::zero());
    let p = L::select(no_specular, L::one(), L::splat(0.5));
    L::select(no_diffuse, L::zero(), p)
}

impl Bsdf for Plastic {
    const NAME: &'static str = "plastic";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        sample_coated::<Self, L>(row, &distribution, wo, (u, mode), diffuse_probability(row))
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        let valid = same_side(wo, wi);
        let (o, i) = (upper(wo).0, upper(wi).0);
        let r = distribution.reflection(o, i);
        let share = reflectance(r.cos_h, wo.z.gt(L::zero()));
        let inv_pi = L::splat(FRAC_1_PI);
        let f = (Vec3::new(row[0], row[1], row[2]) * inv_pi)
            + Vec3::new(row[3], row[4], row[5]) * (r.brdf * share);
        let p = diffuse_probability(row);
        let mix = |cos: L, glossy: L| (p * inv_pi).mul_add(cos, (L::one() - p) * glossy);
        BsdfValue {
            f: f.or_zero(valid),
            pdf: mix(i.z, r.pdf).or_zero(valid),
            pdf_reverse: mix(o.z, r.pdf_reverse).or_zero(valid),
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let (brdf, cos) = TrowbridgeReitz::of_row(row).reflection_across(wo, wi);
        let glossy = brdf * reflectance(cos.abs(), cos.gt(L::zero()));
        let diffuse = L::splat(FRAC_1_PI).or_zero(opposite(wo, wi));
        Vec3::new(row[0], row[1], row[2]) * diffuse + Vec3::new(row[3], row[4], row[5]) * glossy
    }
}

/// v3 `plastic`.
#[derive(Clone, Debug, PartialEq)]
pub struct PlasticMaterial {
    /// Albedo of the Lambertian lobe.
    pub diffuse: Param,
    /// Multiplies the glossy lobe, beside its Fresnel term.
    pub specular: Param,
    /// Of the glossy lobe.
    pub roughness: Roughness,
}

impl Description for PlasticMaterial {
    fn params(&self) -> Vec<Param> {
        let Roughness { u, v, .. } = self.roughness;
        vec![u, v, self.diffuse, self.specular]
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }
}

impl BsdfMaterial for PlasticMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V3, "plastic")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(Self {
            diffuse: set.albedo_or("Kd", 0.25)?,
            specular: set.albedo_or("Ks", 0.25)?,
            roughness: set.roughness(0.1)?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<Plastic>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let (d, s) = (at.albedo(self.diffuse), at.albedo(self.specular));
        let [ax, ay] = at.alphas(&self.roughness);
        [d[0], d[1], d[2], s[0], s[1], s[2], ax, ay]
    }
}
