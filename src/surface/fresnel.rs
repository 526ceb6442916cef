//! Fresnel reflectance in forms that stay finite at grazing angles, at an index of 1, and at the
//! critical angle.

use crate::simd::{Lanes, Vec3};

/// Dielectric boundary seen from one side: reflectance and the cosine of the refracted direction.
pub struct Dielectric<L> {
    /// In `[0, 1]`.
    pub reflectance: L,
    /// Absolute cosine on the far side; 0 under total internal reflection.
    pub cos_t: L,
}

/// `cos_i >= 0`; `eta` is the index of the far side over that of the near side (pbrt-v4, section
/// 9.3.5).
#[inline(always)]
pub fn dielectric<L: Lanes>(cos_i: L, eta: L) -> Dielectric<L> {
    // (eta cos_t)^2 = eta^2 - sin_i^2 without a difference of large numbers: at grazing incidence
    // on an index near 1, `1 - sin_t^2` would round to total reflection.
    let scaled2 = cos_i.mul_add(cos_i, (eta - L::one()) * (eta + L::one()));
    let total = scaled2.lt(L::zero());
    let scaled = scaled2.max(L::zero()).sqrt();
    let cos_t = (scaled / eta).min(L::one());
    // Parallel and perpendicular amplitudes; 0/0 only at grazing incidence on equal indices, where
    // nothing reflects.
    let ratio = |a: L, b: L| {
        let sum = a + b;
        L::select(sum.gt(L::zero()), (a - b) / sum, L::zero())
    };
    let parallel = ratio(eta * cos_i, cos_t);
    let perpendicular = ratio(cos_i, scaled);
    let r = (parallel * parallel + perpendicular * perpendicular) * L::splat(0.5);
    Dielectric {
        reflectance: L::select(total, L::one(), r),
        cos_t,
    }
}

/// Conductor, per channel; `cos_i >= 0`, `eta + i k` relative to the outside (pbrt-v3, section
/// 8.2.1).
#[inline(always)]
pub fn conductor<L: Lanes>(cos_i: L, eta: Vec3<L>, k: Vec3<L>) -> Vec3<L> {
    Vec3::new(
        conductor_channel(cos_i, eta.x, k.x),
        conductor_channel(cos_i, eta.y, k.y),
        conductor_channel(cos_i, eta.z, k.z),
    )
}

#[inline(always)]
fn conductor_channel<L: Lanes>(cos_i: L, eta: L, k: L) -> L {
    let cos2 = cos_i * cos_i;
    let sin2 = (L::one() - cos2).max(L::zero());
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = (t0 * t0 + L::splat(4.0) * eta2 * k2).sqrt();
    let t1 = a2_plus_b2 + cos2;
    let a = ((a2_plus_b2 + t0) * L::splat(0.5)).max(L::zero()).sqrt();
    let t2 = L::splat(2.0) * cos_i * a;
    let safe = |num: L, den: L| L::select(den.gt(L::zero()), num / den, L::one());
    let rs = safe(t1 - t2, t1 + t2);
    let t3 = cos2 * a2_plus_b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let rp = rs * safe(t3 - t4, t3 + t4);
    // Equal indices reflect nothing, which rounding must not turn into less.
    ((rp + rs) * L::splat(0.5)).max(L::zero())
}
