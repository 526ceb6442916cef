//! Rough glass: reflection and refraction by Trowbridge-Reitz microfacets (Walter, Marschner, Li
//! and Torrance 2007).
//!
//! The half vector of a refraction points along `v = n_o wo + n_i wi` (their equation 16), and both
//! the denominator of the BSDF (equation 21) and that of the change of solid angle (equation 17)
//! are the square of its length. So `v` need not be normalised: with
//! `q = (v_x / ax)^2 + (v_y / ay)^2 + v_z^2`, the distribution of normals over that denominator is
//! `|v|^2 / (pi ax ay q^2)`, and lengths cancel.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fresnel;
use super::microfacet::{TrowbridgeReitz, upper};
use crate::simd::{Lanes, Mask, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Row: reflectance (3), transmittance (3), eta (inside over outside), alphas
/// ([`pack_alphas`](super::microfacet::pack_alphas)).
pub struct Rough;

/// Least width of a refracted lobe, in radians, that directions in `f32` resolve to a percent: it
/// is the roughness times the distance of the index from 1.
pub const LEAST_LOBE: f32 = 1e-5;

/// Indices beyond this, or below its inverse, are taken for it: such a boundary is a mirror.
pub const GREATEST_ETA: f32 = 1e3;

/// The index that a row has instead of `eta`: as far from 1 as the lobe of the smaller roughness
/// needs ([`LEAST_LOBE`]).
pub fn resolved_eta(eta: f32, alpha: f32) -> f32 {
    let eta = eta.clamp(1.0 / GREATEST_ETA, GREATEST_ETA);
    let least = LEAST_LOBE / alpha.min(1.0);
    if (eta - 1.0).abs() >= least {
        eta
    } else {
        1.0 + least.copysign(eta - 1.0)
    }
}

/// Values between two directions whose cosines are both below this would overflow `f32`.
pub(super) const GRAZING: f32 = 1e-20;

/// Indices on the side of `wo` and on the other; that of the outside is 1.
#[inline(always)]
fn indices<L: Lanes>(row: &[L; 8], wo: Vec3<L>) -> (L, L) {
    let outside = wo.z.gt(L::zero());
    (
        L::select(outside, L::one(), row[6]),
        L::select(outside, row[6], L::one()),
    )
}

/// What values and densities of a refraction have in common,
/// `2 (1 - F) D |o . h| |i . h| / |n_o o + n_i i|^2`, and 0 if no microfacet refracts one direction
/// into the other. `o.z >= 0 >= i.z`; `no` and `ni` are the indices on their sides.
#[inline(always)]
pub(super) fn refraction<L: Lanes>(
    distribution: &TrowbridgeReitz<L>,
    (o, no): (Vec3<L>, L),
    (i, ni): (Vec3<L>, L),
) -> L {
    let (common, transmitted) = bent(distribution, (o, no), (i, ni));
    common * transmitted
}

/// The two factors of [`refraction`]: all but `1 - F`, and that.
#[inline(always)]
pub(super) fn bent<L: Lanes>(
    distribution: &TrowbridgeReitz<L>,
    (o, no): (Vec3<L>, L),
    (i, ni): (Vec3<L>, L),
) -> (L, L) {
    let v = o * no + i * ni;
    // The half vector is v or -v, whichever points up; it has to be on the side of both directions
    // that they are on.
    let up = L::one().copysign(v.z);
    let (oh, ih) = (o.dot(v) * up, -i.dot(v) * up);
    let faces = oh.gt(L::zero()).and(ih.gt(L::zero()));
    // 1 - F of the two amplitudes, from cosines that obey Snell's law already: a sum of positive
    // terms, the same from both sides.
    let s = no * oh + ni * ih;
    let p = ni * oh + no * ih;
    let product = oh * ih;
    let transmitted = L::splat(2.0) * no * ni * product * (L::one() / (s * s) + L::one() / (p * p));
    let (x, y) = (v.x / distribution.ax, v.y / distribution.ay);
    let q = x.mul_add(x, y.mul_add(y, v.z * v.z));
    let d = L::splat(2.0 * FRAC_1_PI) / (distribution.ax * distribution.ay);
    let common = d * (product / q) / q;
    let passes = transmitted.min(L::one());
    let some = faces.and((common * passes).is_finite());
    (common.or_zero(some), passes.or_zero(some))
}

impl Bsdf for Rough {
    const NAME: &'static str = "rough dielectric";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_packed(row[7]);
        let (o, sign) = upper(wo);
        let (no, ni) = indices(row, wo);
        let eta = ni / no;
        let h = distribution.sample_normal(o, u[0], u[1]);
        let cos = o.dot(h).max(L::zero()).min(L::one());
        let boundary = fresnel::dielectric(cos, eta);
        let reflects = u[2].lt(boundary.reflectance);
        let reflected = h.mul_add(L::splat(2.0) * cos, -o);
        let inv_eta = L::one() / eta;
        let refracted = h.mul_add(cos * inv_eta - boundary.cos_t, o * -inv_eta);
        let i = Vec3::select(reflects, reflected, refracted).normalize();
        let wi = Vec3::new(i.x, i.y, i.z * sign);
        let value = Self::eval(row, wo, wi, mode);
        // A direction that has ended on the other side of the surface than its lobe is none of that
        // lobe.
        let side = L::select(reflects, i.z, -i.z);
        let valid = side.gt(L::zero()).and(value.pdf.gt(L::zero()));
        // f cos / pdf: Fresnel, the distribution and one of the maskings cancel.
        let (lo, li) = (distribution.stretch(o), distribution.stretch(i));
        let (zo, zi) = (o.z, i.z.abs());
        let unmasked = zi * (zo + lo) / zo.mul_add(li, zi * lo).max(L::splat(GRAZING));
        let transmit = match mode {
            Mode::Radiance => inv_eta * inv_eta,
            Mode::Importance => L::one(),
        };
        let colour = Vec3::select(
            reflects,
            Vec3::new(row[0], row[1], row[2]),
            Vec3::new(row[3], row[4], row[5]) * transmit,
        );
        BsdfSample {
            wi,
            throughput: (colour * unmasked).or_zero(valid),
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        let distribution = TrowbridgeReitz::of_packed(row[7]);
        let (o, sign) = upper(wo);
        let i = Vec3::new(wi.x, wi.y, wi.z * sign);
        let (no, ni) = indices(row, wo);
        let sides = o.z * i.z;
        let (reflects, refracts) = (sides.gt(L::zero()), sides.lt(L::zero()));

        let mirrored = upper(i).0;
        let r = distribution.reflection(o, mirrored);
        // The cosine against the half vector by its length: the same from both directions, which
        // near the critical angle matters.
        let cos = ((o + mirrored).length2().sqrt() * L::splat(0.5)).min(L::one());
        let reflectance = fresnel::dielectric(cos, ni / no).reflectance;
        let t = refraction(&distribution, (o, no), (i, ni));
        // Height-correlated masking cancels the cosines, as it does for reflections.
        let (lo, li) = (distribution.stretch(o), distribution.stretch(i));
        let (zo, zi) = (o.z, i.z.abs());
        let masked = t / zo.mul_add(li, zi * lo).max(L::splat(GRAZING));
        // Equation 21 is that of radiance, `wi` towards the light; importance goes the other way
        // (Veach 1997, section 5.2).
        let transmission = masked
            * match mode {
                Mode::Radiance => no * no,
                Mode::Importance => ni * ni,
            };
        let f = Vec3::select(
            reflects,
            Vec3::new(row[0], row[1], row[2]) * (r.brdf * reflectance),
            Vec3::new(row[3], row[4], row[5]) * transmission,
        );
        let pick = |reflection: L, transmission: L| {
            L::select(reflects, reflection * reflectance, transmission)
                .or_zero(reflects.or(refracts))
        };
        BsdfValue {
            f: f.or_zero(reflects.or(refracts)),
            // Equation 17 with normals sampled among the visible ones.
            pdf: pick(r.pdf, t * ni * ni / (zo + lo)),
            pdf_reverse: pick(r.pdf_reverse, t * no * no / (zi + li)),
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let (brdf, cos) = TrowbridgeReitz::of_packed(row[7]).reflection_across(wo, wi);
        let outside = cos.gt(L::zero());
        let eta = L::select(outside, row[6], L::one() / row[6]);
        let reflectance = fresnel::dielectric(cos.abs(), eta).reflectance;
        Vec3::new(row[0], row[1], row[2]) * (brdf * reflectance)
    }
}
