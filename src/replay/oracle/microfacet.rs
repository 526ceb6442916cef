//! What scattering functions are made of: Fresnel's formulas, and microfacets.

use super::vector::{V, add, dot, scale, unit};
use std::f64::consts::PI;

/// `f(wo, wi)`, density of `wi` given `wo`, and the reverse; delta BSDFs are 0.
pub struct Value {
    /// BSDF, 1/sr, by channel; without the cosine.
    pub f: V,
    /// Density of `wi` given `wo`, over solid angle.
    pub pdf: f64,
    /// Density of `wo` given `wi`, over solid angle.
    pub pdf_reverse: f64,
}

/// Unpolarised Fresnel reflectance of a dielectric, `eta` far over near side, from Snell's law and
/// the two amplitudes; and the cosine of the refracted direction.
pub fn dielectric(cos_i: f64, eta: f64) -> (f64, f64) {
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return (1.0, 0.0);
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    if cos_i == 0.0 && cos_t == 0.0 {
        return (0.0, 0.0);
    }
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    (0.5 * (s * s + p * p), cos_t)
}

/// Reflectance of a sheet of dielectric: what leaves it on the side it came from, after any odd
/// number of reflections inside.
pub fn sheet(cos_i: f64, eta: f64) -> f64 {
    let r = dielectric(cos_i, eta).0;
    let t = 1.0 - r;
    if t > 0.0 {
        r + t * t * r / (1.0 - r * r)
    } else {
        1.0
    }
}

/// Reflectance of a conductor, in complex arithmetic.
pub fn conductor(cos_i: f64, eta: f64, k: f64) -> f64 {
    // n^2 and q = sqrt(n^2 - sin^2), n = eta + i k.
    let n2 = (eta * eta - k * k, 2.0 * eta * k);
    let z = (n2.0 - (1.0 - cos_i * cos_i), n2.1);
    let r = z.0.hypot(z.1);
    let q = (
        ((r + z.0) / 2.0).max(0.0).sqrt(),
        ((r - z.0) / 2.0).max(0.0).sqrt(),
    );
    let norm = |a: (f64, f64)| a.0 * a.0 + a.1 * a.1;
    let power = |a: (f64, f64), b: (f64, f64)| {
        if norm(b) > 0.0 {
            norm(a) / norm(b)
        } else {
            1.0
        }
    };
    let s = power((cos_i - q.0, -q.1), (cos_i + q.0, q.1));
    let nc = (n2.0 * cos_i, n2.1 * cos_i);
    let p = power((nc.0 - q.0, nc.1 - q.1), (nc.0 + q.0, nc.1 + q.1));
    0.5 * (s + p)
}

/// Trowbridge-Reitz: D, and Smith's Lambda by tangents (Heitz 2014, equations 71, 72 and 85).
pub fn ggx_d(h: V, ax: f64, ay: f64) -> f64 {
    let tan = (h[0] / h[2] / ax).powi(2) + (h[1] / h[2] / ay).powi(2);
    1.0 / (PI * ax * ay * h[2].powi(4) * (1.0 + tan).powi(2))
}

/// Smith's Lambda of a direction in the shading frame.
pub fn ggx_lambda(w: V, ax: f64, ay: f64) -> f64 {
    let tan2 = ((w[0] * ax).powi(2) + (w[1] * ay).powi(2)) / (w[2] * w[2]);
    ((1.0 + tan2).sqrt() - 1.0) / 2.0
}

/// Density of the reflected direction if normals are sampled among the visible ones.
pub fn ggx_pdf(wo: V, wi: V, ax: f64, ay: f64) -> f64 {
    let h = unit(add(wo, wi));
    let g1 = 1.0 / (1.0 + ggx_lambda(wo, ax, ay));
    let visible = g1 * dot(wo, h).max(0.0) * ggx_d(h, ax, ay) / wo[2];
    visible / (4.0 * dot(wo, h))
}

/// `D G / (4 cos_o cos_i)`, with the height-correlated `G` (Heitz 2014, equation 99); without
/// Fresnel's term.
pub fn ggx_brdf(wo: V, wi: V, ax: f64, ay: f64) -> f64 {
    let h = unit(add(wo, wi));
    let g = 1.0 / (1.0 + ggx_lambda(wo, ax, ay) + ggx_lambda(wi, ax, ay));
    ggx_d(h, ax, ay) * g / (4.0 * wo[2] * wi[2])
}

/// The two alphas in a float of a row: binary16 numbers, the first in the upper bits.
pub fn unpacked_alphas(packed: f64) -> (f64, f64) {
    let bits = (packed as f32).to_bits();
    let half = |h: u32| {
        let (exponent, fraction) = ((h >> 10 & 31) as i32, f64::from(h & 1023) / 1024.0);
        (1.0 + fraction) * 2f64.powi(exponent - 15)
    };
    (half(bits >> 16), half(bits & 0xffff))
}

/// Refraction at microfacets (Walter et al. 2007), `i` and `o` on different sides of the surface
/// with indices `eta_i` and `eta_o`, light going from `i` to `o`: the BSDF (equation 21) over the
/// transmittance, the density of `o` given `i` (equation 17 and visible normals), and that of `i`
/// given `o`.
pub fn ggx_refraction((i, eta_i): (V, f64), (o, eta_o): (V, f64), ax: f64, ay: f64) -> [f64; 3] {
    // Equation 16; the sign is that of the normal's side.
    let h = unit(add(scale(i, eta_i), scale(o, eta_o)));
    let h = scale(h, 1f64.copysign(h[2]));
    let (ih, oh) = (dot(i, h), dot(o, h));
    if ih * i[2] <= 0.0 || oh * o[2] <= 0.0 {
        return [0.0; 3];
    }
    let through = 1.0 - dielectric(ih.abs().min(1.0), eta_o / eta_i).0;
    let up = |w: V| [w[0], w[1], w[2].abs()];
    let (lambda_i, lambda_o) = (ggx_lambda(up(i), ax, ay), ggx_lambda(up(o), ax, ay));
    let d = ggx_d(h, ax, ay);
    let g = 1.0 / (1.0 + lambda_i + lambda_o);
    let length2 = (eta_i * ih + eta_o * oh).powi(2);
    let f = (ih * oh / (i[2] * o[2])).abs() * eta_o * eta_o * through * g * d / length2;
    let visible = |w: V, lambda: f64| d * dot(w, h).abs() / (w[2].abs() * (1.0 + lambda));
    [
        f,
        through * visible(i, lambda_i) * eta_o * eta_o * oh.abs() / length2,
        through * visible(o, lambda_o) * eta_i * eta_i * ih.abs() / length2,
    ]
}
