//! A Lambertian base under a dielectric coat (pbrt-v4's `coateddiffuse`), in closed form.
//!
//! pbrt-v4 walks at random between the two layers (`LayeredBxDF`; Pharr, Jakob and Humphreys 2023,
//! section 14.3). A Lambertian base forgets where light came from, so that the sum over those walks
//! factors (Saunderson 1942, "Calculation of the Color of Pigmented Plastics"; Weidlich and Wilkie
//! 2007, "Arbitrarily Layered Micro-Facet Surfaces", have its first term):
//!
//! ```text
//! f(wo, wi) = coat(wo, wi)
//!           + T(wo) T(wi) / eta^2  rho / pi  (1 + rho F + (rho F)^2 + ... + (rho F)^(n - 1))
//! ```
//!
//! where `T` is the share of the light from a direction that reaches the base, `F` what of the
//! light from the base is reflected down to it, and
//! `n` the number of visits to the base that `maxdepth` admits, half of it. For smooth coats that
//! is exact; of rough ones `T` and `F` are integrals over the microfacets ([`coat`]), the same that
//! the random walk estimates. What remains is the error of fitting `T`. Against a transcription of
//! the random walk (`tests/renderer/coated.rs`; reflectances 0.1 to 0.9, roughness alphas 0 to 0.6,
//! indices 1.3 to 2) albedos differ by no more than 0.002 beyond statistical error, and values by
//! less than 0.01 of a white surface's. pbrt-v4's own weights for values of rough coats do not add
//! up to 1, which moves its values by up to 40 % in some directions: the comparison is with weights
//! that do.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::coat::{CoatLayer, Interface};
use super::diffuse::{cosine_sample, same_side};
use super::microfacet::pack_alphas;
use super::microfacet::{TrowbridgeReitz, sample_coated, upper};
use super::packing::{At, BsdfMaterial, Shared};
use super::{coat, fresnel};
use crate::scene::{Description, Param};
use crate::simd::{Lanes, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// A rough coat and its base. Row: value of the base but for the transmittances (3), eta (inside
/// over outside), alphas ([`pack_alphas`]), transmittance
/// ([`coat::Interface::packed`], 3).
pub struct Rough;

/// The base below a smooth coat, without the coat's reflection. Row: value of the base but for the
/// transmittances (3), eta, thickness.
pub struct Base;

/// Factor of the base, per channel, of its reflectance: `rho / (pi eta^2)` and the sum of its
/// visits.
pub fn base_of(reflectance: f32, eta: f32, internal: f32, visits: u32) -> f32 {
    reflectance * coat::bounces(reflectance * internal, visits) / (PI * eta * eta)
}

/// Value of the base, and the share of its samples; of `wo`, then of `wi`.
struct Parts<L: Lanes> {
    base: Vec3<L>,
    shares: [L; 2],
}

#[inline(always)]
fn parts<L: Lanes>(row: &[L; 8], mu: [L; 2]) -> Parts<L> {
    let base = Vec3::new(row[0], row[1], row[2]);
    let brightest = row[0].max(row[1]).max(row[2]);
    let t = mu.map(|mu| coat::transmittance([row[5], row[6], row[7]], row[3], mu));
    let share = |i: usize| coat::share(brightest * L::splat(PI) * t[i], coat::gloss(mu[i], row[3]));
    Parts {
        base: base * (t[0] * t[1]),
        shares: [share(0), share(1)],
    }
}

impl Bsdf for Rough {
    const NAME: &'static str = "coated diffuse";
    const DELTA: bool = false;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_packed(row[4]);
        let mu = wo.z.abs();
        let share = parts(row, [mu, mu]).shares[0];
        sample_coated::<Self, L>(row, &distribution, wo, (u, mode), share)
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let valid = same_side(wo, wi);
        let (o, i) = (upper(wo).0, upper(wi).0);
        let r = TrowbridgeReitz::of_packed(row[4]).reflection(o, i);
        // By the length of the sum: the same from both directions.
        let cos = ((o + i).length2().sqrt() * L::splat(0.5)).min(L::one());
        let reflectance = fresnel::dielectric(cos, row[3]).reflectance;
        let parts = parts(row, [o.z, i.z]);
        let gloss = Vec3::splat([1.0; 3]) * (r.brdf * reflectance);
        let mix = |share: L, cos: L, glossy: L| {
            (share * L::splat(FRAC_1_PI)).mul_add(cos, (L::one() - share) * glossy)
        };
        BsdfValue {
            f: (parts.base + gloss).or_zero(valid),
            pdf: mix(parts.shares[0], i.z, r.pdf).or_zero(valid),
            pdf_reverse: mix(parts.shares[1], o.z, r.pdf_reverse).or_zero(valid),
        }
    }
}

impl Bsdf for Base {
    const NAME: &'static str = "diffuse under a coat";
    const DELTA: bool = false;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let (up, sign) = upper(wo);
        let (wi, _) = cosine_sample(up, u);
        let value = Self::eval(row, up, wi, mode);
        BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * sign),
            throughput: (value.f * L::splat(PI)).or_zero(value.pdf.gt(L::zero())),
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let valid = same_side(wo, wi);
        let t = |w: Vec3<L>| coat::smooth_transmittance(w.z.abs(), row[3], row[4]);
        let f = Vec3::new(row[0], row[1], row[2]) * (t(wo) * t(wi));
        let inv_pi = L::splat(FRAC_1_PI);
        BsdfValue {
            f: f.or_zero(valid),
            pdf: (wi.z.abs() * inv_pi).or_zero(valid),
            pdf_reverse: (wo.z.abs() * inv_pi).or_zero(valid),
        }
    }
}

/// v4 `coateddiffuse`: Lambertian under a dielectric coat. Of a smooth coat the base alone: its
/// reflection is [`CoatMaterial`](super::coated_materials::CoatMaterial).
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedDiffuseMaterial {
    /// Of the base, 0 to 1.
    pub reflectance: Param,
    /// Over the base.
    pub coat: CoatLayer,
}

impl Description for CoatedDiffuseMaterial {
    fn params(&self) -> Vec<Param> {
        vec![self.reflectance]
    }

    fn is_anisotropic(&self) -> bool {
        self.coat.alphas[0] != self.coat.alphas[1]
    }
}

impl BsdfMaterial for CoatedDiffuseMaterial {
    type Tables = Interface;

    fn tables(&self, shared: &mut Shared) -> Interface {
        shared.table(self.coat, Interface::of_layer)
    }

    fn kernel(&self) -> Kernel {
        match self.coat.is_smooth() {
            true => Kernel::of::<Base>(),
            false => Kernel::of::<Rough>(),
        }
    }

    fn row(&self, interface: &Interface, at: &At) -> [f32; 8] {
        let coat = &self.coat;
        let base = base_row(interface, coat, at.albedo(self.reflectance));
        if coat.is_smooth() {
            return [
                base[0],
                base[1],
                base[2],
                coat.eta,
                coat.thickness,
                0.0,
                0.0,
                0.0,
            ];
        }
        rough_row(interface, coat, base, coat.alphas)
    }
}

/// The first three numbers of a row, of the reflectance of the base.
fn base_row(interface: &Interface, coat: &CoatLayer, reflectance: [f32; 3]) -> [f32; 3] {
    let Interface {
        scale, internal, ..
    } = *interface;
    reflectance.map(|r| scale * scale * base_of(r, coat.eta, internal, coat.visits()))
}

/// The row of [`Rough`] with these alphas.
fn rough_row(
    interface: &Interface,
    coat: &CoatLayer,
    [r, g, b]: [f32; 3],
    alphas: [f32; 2],
) -> [f32; 8] {
    let [t, u, v] = interface.packed;
    let alphas = pack_alphas(alphas[0], alphas[1]);
    [r, g, b, coat.eta, alphas, t, u, v]
}

/// The row of a coat whose alphas differ from hit to hit.
pub fn textured_row(
    interface: &Interface,
    coat: &CoatLayer,
    reflectance: [f32; 3],
    alphas: [f32; 2],
) -> [f32; 8] {
    rough_row(
        interface,
        coat,
        base_row(interface, coat, reflectance),
        alphas,
    )
}
