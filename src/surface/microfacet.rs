//! The Trowbridge-Reitz (GGX) distribution with visible-normal sampling, in forms without tangents
//! or divisions by a cosine.

use super::bsdf::{Bsdf, BsdfSample, Mode};
use super::diffuse::{cosine_sample, opposite};
use crate::simd::{Lanes, Mask, UintLanes, Vec3, math};
use std::f32::consts::FRAC_1_PI;

pub use crate::scene::SMOOTH_ALPHA;

/// Two alphas in the bits of one float, for rows that are full ([`pack_halves`]). The alphas of
/// rows are 1e-3 to 1e3.
pub fn pack_alphas(ax: f32, ay: f32) -> f32 {
    pack_halves(ax.clamp(SMOOTH_ALPHA, 1e3), ay.clamp(SMOOTH_ALPHA, 1e3))
}

/// Two positive numbers in the bits of one float: halves (IEEE 754 binary16), the first in the
/// upper bits. Clamped to 1e-4 .. 6e4 they are normal numbers of that format, right to 1/2048 of
/// themselves; and so is the float that they make together.
pub fn pack_halves(first: f32, second: f32) -> f32 {
    let half = |x: f32| {
        let bits = x.clamp(1e-4, 6e4).to_bits() - ((127 - 15) << 23);
        // To the nearest, halves up; the carry runs into the exponent as it should.
        (bits + (1 << 12)) >> 13
    };
    f32::from_bits(half(first) << 16 | half(second))
}

/// The numbers that [`pack_halves`] has packed.
#[inline(always)]
pub fn unpack_halves<L: Lanes>(packed: L) -> [L; 2] {
    // A half to a float: the bits move, the bias of the exponent changes by 127 - 15. Exact.
    let float = |half: L::Uint| {
        let bias = L::Uint::splat((127 - 15) << 23);
        L::from_bits(half.shl::<13>().add(bias))
    };
    let bits = packed.to_bits();
    [
        float(bits.shr::<16>()),
        float(bits.and(L::Uint::splat(0xffff))),
    ]
}

/// Anisotropic Trowbridge-Reitz; all directions in the upper hemisphere (`z >= 0`).
#[derive(Clone, Copy)]
pub struct TrowbridgeReitz<L> {
    /// Alpha along the tangent, above 0.
    pub ax: L,
    /// Alpha across it.
    pub ay: L,
}

/// Density of a reflected direction and the factors its BRDF needs.
pub struct Reflection<L> {
    /// `D G / (4 cos_o cos_i)`, 1/sr.
    pub brdf: L,
    /// Density of `wi` given `wo` by visible normals, solid angle (Heitz 2014).
    pub pdf: L,
    /// Density of `wo` given `wi`.
    pub pdf_reverse: L,
    /// Cosine between either direction and the half vector.
    pub cos_h: L,
}

impl<L: Lanes> TrowbridgeReitz<L> {
    /// Of a parameter row that ends in alpha x, alpha y.
    #[inline(always)]
    pub fn of_row(row: &[L; 8]) -> Self {
        Self {
            ax: row[6],
            ay: row[7],
        }
    }

    /// Of alphas that [`pack_alphas`] has packed.
    #[inline(always)]
    pub fn of_packed(alphas: L) -> Self {
        let [ax, ay] = unpack_halves(alphas);
        Self { ax, ay }
    }

    /// Normal distribution, normalised so that its projection integrates to 1.
    #[inline(always)]
    pub fn d(&self, h: Vec3<L>) -> L {
        let (x, y) = (h.x / self.ax, h.y / self.ay);
        let s = x.mul_add(x, y.mul_add(y, h.z * h.z));
        L::splat(FRAC_1_PI) / (self.ax * self.ay * s * s)
    }

    /// `sqrt(ax^2 x^2 + ay^2 y^2 + z^2)`: Smith's Lambda is `(this / z - 1) / 2` (Heitz 2014,
    /// equation 72).
    #[inline(always)]
    pub fn stretch(&self, w: Vec3<L>) -> L {
        let (x, y) = (w.x * self.ax, w.y * self.ay);
        x.mul_add(x, y.mul_add(y, w.z * w.z)).sqrt()
    }

    /// Height-correlated masking cancels the cosines: `G / (4 zo zi) = 1 / (2 (zo li + zi lo))`.
    #[inline(always)]
    pub fn reflection(&self, wo: Vec3<L>, wi: Vec3<L>) -> Reflection<L> {
        let h = (wo + wi).normalize();
        let (lo, li) = (self.stretch(wo), self.stretch(wi));
        let d = self.d(h) * L::splat(0.5);
        Reflection {
            brdf: d / wo.z.mul_add(li, wi.z * lo),
            pdf: d / (wo.z + lo),
            pdf_reverse: d / (wi.z + li),
            cos_h: wo.dot(h).max(L::zero()).min(L::one()),
        }
    }

    /// `D G / (4 cos_o cos_i)` of directions on different sides of the surface, as pbrt-v3 has it:
    /// of the half vector between them, wherever it points, and cosines without sign. Also the
    /// cosine between `wi` and the half vector turned up.
    #[inline(always)]
    pub fn reflection_across(&self, wo: Vec3<L>, wi: Vec3<L>) -> (L, L) {
        let sum = wo + wi;
        let length = sum.length2().sqrt();
        let d = self.d(sum.normalize()) * L::splat(0.5);
        let (lo, li) = (self.stretch(wo), self.stretch(wi));
        let brdf = d / wo.z.abs().mul_add(li, wi.z.abs() * lo);
        let cos = (length * L::splat(0.5)).min(L::one()).copysign(sum.z);
        let across = opposite(wo, wi).and(length.gt(L::zero()));
        (brdf.or_zero(across), cos)
    }

    /// A visible normal (Heitz 2018, "Sampling the GGX Distribution of Visible Normals", listing
    /// 1).
    #[inline(always)]
    pub fn sample_normal(&self, wo: Vec3<L>, u: L, v: L) -> Vec3<L> {
        let stretched = Vec3::new(wo.x * self.ax, wo.y * self.ay, wo.z).normalize();
        let len2 = stretched.x.mul_add(stretched.x, stretched.y * stretched.y);
        let has_tangent = len2.gt(L::splat(1e-30));
        let inv = L::one() / len2.sqrt();
        let t1 = Vec3::select(
            has_tangent,
            Vec3::new(-stretched.y * inv, stretched.x * inv, L::zero()),
            Vec3::splat([1.0, 0.0, 0.0]),
        );
        let t2 = stretched.cross(t1);
        let (a, b) = math::concentric_disk(u, v);
        let s = (L::one() + stretched.z) * L::splat(0.5);
        let edge = (L::one() - a * a).max(L::zero()).sqrt();
        let b = (L::one() - s).mul_add(edge, s * b);
        let c = (L::one() - a * a - b * b).max(L::zero()).sqrt();
        let n = t1.mul_add(a, t2.mul_add(b, stretched * c));
        Vec3::new(n.x * self.ax, n.y * self.ay, n.z.max(L::splat(1e-6))).normalize()
    }
}

/// Samples a glossy coat over a diffuse base: visible normals or, with probability `diffuse`, a
/// cosine; `B` weighs the result by both.
#[inline(always)]
pub fn sample_coated<B: Bsdf, L: Lanes>(
    row: &[L; 8],
    distribution: &TrowbridgeReitz<L>,
    wo: Vec3<L>,
    (u, mode): ([L; 3], Mode),
    diffuse: L,
) -> BsdfSample<L> {
    let (up, sign) = upper(wo);
    let h = distribution.sample_normal(up, u[0], u[1]);
    let glossy = h.mul_add(L::splat(2.0) * up.dot(h), -up);
    let wi = Vec3::select(u[2].lt(diffuse), cosine_sample(up, u).0, glossy);
    let wi = Vec3::new(wi.x, wi.y, wi.z * sign);
    let value = B::eval(row, wo, wi, mode);
    let valid = value.pdf.gt(L::zero());
    BsdfSample {
        wi,
        throughput: (value.f * (wi.z.abs() / value.pdf)).or_zero(valid),
        pdf: value.pdf,
        pdf_reverse: value.pdf_reverse,
    }
}

/// Flips a pair of directions so that `wo.z >= 0`; returns the sign that flips them back.
#[inline(always)]
pub fn upper<L: Lanes>(wo: Vec3<L>) -> (Vec3<L>, L) {
    let sign = L::one().copysign(wo.z);
    (Vec3::new(wo.x, wo.y, wo.z.abs()), sign)
}
