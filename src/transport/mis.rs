//! Multiple importance sampling by two running sums.
//!
//! The balance heuristic weighs a path sampled with `s` light vertices by its density over the sum
//! of the densities of all strategies that could have made it. Walking a subpath, two quantities
//! collect everything about its own vertices that a later weight needs, so that no vertex has to be
//! kept (van Antwerpen 2011; Georgiev 2012, "Implementing Vertex Connection and Merging", section
//! 4, with no merging: the terms in eta vanish):
//!
//! ```text
//! dVCM_i = 1 / p_i
//! dVC_i  = g_i / p_i * (dVCM_(i-1) + r_(i-1) * dVC_(i-1))
//! ```
//!
//! * `p_i`: density over area with which vertex `i` was sampled from vertex `i - 1`;
//! * `g_i`: absolute cosine at vertex `i - 1` over the squared distance of the two: it turns a
//!   density over solid angle at vertex `i` into one over area at vertex `i - 1`;
//! * `r_i`: density over solid angle with which vertex `i` would sample the direction back to `i -
//!   1`, were it walked the other way.
//!
//! So `dVC` is the sum over all strategies further back, all densities in reverse relative to
//! forward. [`Partial::scatter`] takes the step up to a density over solid angle, and
//! [`Partial::arrive`] turns that into one over area. A subpath starts, before its first arrival,
//! with
//!
//! | side | `dVCM` | `dVC` |
//! |---|---|---|
//! | camera | one over the density of its ray; 0 if no strategy has `t = 1` | 0 |
//! | light | direct density over emission density | cosine at the light over emission density |
//!
//! The densities of lights are those of [`light`](crate::light). At infinity the cosine is 1, and
//! for lights that no camera subpath can meet `dVC` is 0.
//!
//! All cosines here are against geometric normals: they convert densities, they do not shade.
//! Ratios only ever multiply quantities of one path, and saturate: a weight ends at 0 or 1, not at
//! NaN.

use crate::simd::Lanes;

/// The running sums of a subpath endpoint.
#[derive(Clone, Copy, Debug)]
pub struct Partial<L> {
    /// `dVCM` of the module.
    pub d_vcm: L,
    /// `dVC` of the module.
    pub d_vc: L,
}

/// Beyond this a sum cannot change a weight any more, and a product of two of them still fits
/// `f32`.
const SATURATED: f32 = 1e18;

#[inline(always)]
fn saturate<L: Lanes>(x: L) -> L {
    x.min(L::splat(SATURATED))
}

impl<L: Lanes> Partial<L> {
    /// Arrival at a surface: the density of the new vertex goes from solid angle to area (equations
    /// 31 to 33). `distance2` is 1 on a first hop from infinity or along parallel rays.
    #[inline(always)]
    pub fn arrive(self, distance2: L, cos: L) -> Self {
        Self {
            d_vcm: saturate(self.d_vcm * distance2 / cos),
            d_vc: saturate(self.d_vc / cos),
        }
    }

    /// Scattering (equations 34 and 35; a delta BSDF cannot be connected, and its reverse path is
    /// the sampled one, equations 53 and 54). Those equations take the two densities of a delta
    /// BSDF to be equal; at a refraction they differ by the change of solid angle, without
    /// which the weights still sum to 1 but are not the balance heuristic.
    #[inline(always)]
    pub fn scatter(self, cos_out: L, pdf: L, pdf_reverse: L, delta: bool) -> Self {
        if delta {
            Self {
                d_vcm: L::zero(),
                d_vc: saturate(self.d_vc * (cos_out * pdf_reverse)),
            }
        } else {
            let inv = L::one() / pdf;
            Self {
                d_vcm: saturate(inv),
                d_vc: saturate(cos_out * inv * self.d_vc.mul_add(pdf_reverse, self.d_vcm)),
            }
        }
    }

    /// `dVCM + dVC * pdf_reverse`: all strategies further back than a connection here.
    #[inline(always)]
    pub fn back(self, pdf_reverse: L) -> L {
        self.d_vc.mul_add(pdf_reverse, self.d_vcm)
    }

    /// `s = 0`: the camera subpath met a light (equation 43). Densities as in
    /// [`crate::light::Emitted`].
    #[inline(always)]
    pub fn weight_hit(self, direct_pdf: L, emission_pdf: L) -> L {
        weight(direct_pdf * self.d_vcm + emission_pdf * self.d_vc)
    }
}

/// An endpoint that is joined.
#[derive(Clone, Copy, Debug)]
pub struct Joint<L> {
    /// BSDF density towards the other end, solid angle.
    pub pdf: L,
    /// All strategies further back, [`Partial::back`] of the reverse density.
    pub back: L,
    /// Absolute cosine towards the other end.
    pub cos: L,
}

impl<L: Lanes> Joint<L> {
    /// `s = 1` (equations 44 and 45): a camera endpoint joined to a point on a light; `hittable` is
    /// false for delta lights.
    #[inline(always)]
    pub fn weight_direct(self, light_pdf: L, emission_ratio: L, hittable: L::Mask) -> L {
        let w_light = (self.pdf / light_pdf).or_zero(hittable);
        let w_camera = emission_ratio * self.cos * self.back;
        weight(w_light + w_camera)
    }

    /// `t = 1` (equation 46): a light endpoint joined to the camera, whose density over area at the
    /// endpoint is `camera_pdf`.
    #[inline(always)]
    pub fn weight_camera(self, camera_pdf: L) -> L {
        weight(camera_pdf * self.back)
    }
}

/// Camera endpoint to light endpoint (equations 40 to 42).
#[inline(always)]
pub fn weight_connect<L: Lanes>(camera: &Joint<L>, light: &Joint<L>, inv_distance2: L) -> L {
    let w_light = camera.pdf * light.cos * inv_distance2 * light.back;
    let w_camera = light.pdf * camera.cos * inv_distance2 * camera.back;
    weight(w_light + w_camera)
}

/// `1 / (1 + others)`; an overflown sum means weight 0, and so does one that is not a number.
#[inline(always)]
fn weight<L: Lanes>(others: L) -> L {
    let w = L::one() / (L::one() + others);
    w.or_zero(others.ge(L::zero()))
}
