//! The two ends of the way through a surface below which light is scattered: the interface that it
//! goes in by, and what it comes out by.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::{cosine_sample, opposite, same_side};
use super::diffusion_table::first_moment;
use super::fresnel;
use super::rough_dielectric::Rough;
use crate::simd::{Lanes, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A rough interface, rows as of [`Rough`]. What is refracted by it is not seen through it, as it
/// comes out elsewhere: nothing is joined across.
pub struct RoughInterface;

impl Bsdf for RoughInterface {
    const NAME: &'static str = "rough interface of a medium";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        Rough::sample(row, wo, u, mode)
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        let value = Rough::eval(row, wo, wi, mode);
        BsdfValue {
            f: value.f.or_zero(same_side(wo, wi)),
            ..value
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        Rough::across(row, wo, wi).or_zero(opposite(wo, wi))
    }
}

/// Light that comes out, in all directions as the interface lets it (pbrt's normalised Fresnel
/// term). Row: index of refraction, `scale`.
pub struct Exit;

impl Exit {
    /// The row of an index of refraction. The squared index takes back what the interface has done
    /// to radiance on the way in.
    pub fn row(eta: f32) -> [f32; 8] {
        let leaves = 1.0 - 2.0 * first_moment(1.0 / f64::from(eta));
        let scale = eta * eta / leaves as f32;
        [eta, scale, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    /// What the interface lets pass, times pi.
    #[inline(always)]
    fn scale<L: Lanes>(row: &[L; 8], cos: L) -> L {
        let reflected = fresnel::dielectric(cos, row[0]).reflectance;
        (L::one() - reflected) * row[1]
    }
}

impl Bsdf for Exit {
    const NAME: &'static str = "light from below the surface";
    const DELTA: bool = false;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let (wi, pdf) = cosine_sample(wo, u);
        let weight = Self::scale(row, wi.z.abs());
        BsdfSample {
            wi,
            throughput: Vec3::new(weight, weight, weight).or_zero(pdf.gt(L::zero())),
            pdf,
            pdf_reverse: wo.z.abs() * L::splat(FRAC_1_PI),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let inv_pi = L::splat(FRAC_1_PI).or_zero(same_side(wo, wi));
        let f = Self::scale(row, wi.z.abs()) * inv_pi;
        BsdfValue {
            f: Vec3::new(f, f, f),
            pdf: wi.z.abs() * inv_pi,
            pdf_reverse: wo.z.abs() * inv_pi,
        }
    }
}
