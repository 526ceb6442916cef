//! Coated surfaces in `f64`: the formulas of [`crate::surface::coated_diffuse`] and
//! [`crate::surface::coated_conductor`] over the same rows.

use super::microfacet::{
    Value, conductor, dielectric, ggx_brdf, ggx_lambda, ggx_pdf, ggx_refraction, unpacked_alphas,
};
use super::vector::{V, add, dot, unit};
use crate::surface::Kind;
use crate::surface::coat::DARK;
use std::f64::consts::PI;

/// Transmittance of a rough coat: the polynomial whose twelve-bit coefficients, -1 to 3, are packed
/// in the row.
fn transmittance(row: &[f64; 8], mu: f64) -> f64 {
    let eta = row[3];
    let beyond = (1.0 - eta * eta).max(0.0);
    let s = ((mu * mu - beyond) / (1.0 - beyond))
        .clamp(0.0, 1.0)
        .powf(0.25);
    let mut sum = 0.0;
    for (i, choose) in [1.0, 5.0, 10.0, 10.0, 5.0, 1.0].into_iter().enumerate() {
        let pair = row[5 + i / 2];
        let steps = if i % 2 == 0 {
            (pair / 4096.0).floor()
        } else {
            pair % 4096.0
        };
        let coefficient = 4.0 * steps / 4095.0 - 1.0;
        sum += coefficient * choose * s.powi(i as i32) * (1.0 - s).powi(5 - i as i32);
    }
    sum.max(0.0)
}

/// What a smooth coat lets down.
fn smooth_transmittance(mu: f64, eta: f64, thickness: f64) -> f64 {
    match dielectric(mu, eta) {
        (_, 0.0) => 0.0,
        (_, cos) if thickness / cos >= f64::from(DARK) => 0.0,
        (r, cos) => (1.0 - r) * (-thickness / cos).exp(),
    }
}

/// Schlick's approximation, by which the coat is sampled.
fn gloss(mu: f64, eta: f64) -> f64 {
    let least = ((eta - 1.0) / (eta + 1.0)).powi(2);
    least + (1.0 - least) * (1.0 - mu).max(0.0).powi(5)
}

fn stretch(w: V, (ax, ay): (f64, f64)) -> f64 {
    (w[0] * ax).hypot(w[1] * ay).hypot(w[2])
}

/// Of samples of direction `w`: how many are by the cosine, on a diffuse base under a rough coat.
pub fn diffuse_share(row: &[f64; 8], mu: f64) -> f64 {
    let brightest = row[0].max(row[1]).max(row[2]);
    let base = PI * brightest * transmittance(row, mu);
    let coat = gloss(mu, row[3]);
    if base > 0.0 {
        base / (base + coat)
    } else {
        0.0
    }
}

fn effective_cosine(row: &[f64; 8], w: V) -> f64 {
    let stretch = stretch(w, unpacked_alphas(row[4]));
    (0.75 * w[2] * w[2] + 0.25 * stretch * stretch)
        .sqrt()
        .min(1.0)
}

/// Colour of the later bounces: three numbers of eight bits, 0 to 2.
fn later(row: &[f64; 8]) -> V {
    let bits = row[7] as u32;
    [bits >> 16, bits >> 8 & 255, bits & 255].map(|b| 2.0 * f64::from(b) / 255.0)
}

/// Shares of the conductor, the diffuse lobe and the coat among the samples of a coated conductor.
pub fn conductor_shares(kind: Kind, row: &[f64; 8], w: V) -> [f64; 3] {
    let coated = kind == Kind::CoatedConductor;
    let mu = if coated {
        effective_cosine(row, w)
    } else {
        w[2]
    };
    let t = transmitted(row, layer(kind, row).0, w, mu);
    let brightest = later(row).into_iter().fold(0.0, f64::max);
    let coat = if coated { gloss(mu, row[3]) } else { 0.0 };
    let seen = match kind {
        Kind::CoatedConductor if row[3] >= 1.0 => astray_albedo(row, w),
        Kind::CoatedConductor => t * astray_albedo(row, w),
        _ => t,
    };
    let parts = [t, seen * brightest, coat];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 {
        parts.map(|p| p / sum)
    } else {
        [1.0, 0.0, 0.0]
    }
}

fn transmitted(row: &[f64; 8], thickness: f64, w: V, mu: f64) -> f64 {
    if w[0].hypot(w[1]) < row[3] {
        smooth_transmittance(mu, row[3], thickness)
    } else {
        0.0
    }
}

/// Reflectance of smooth layers, as often as the row's thickness says.
pub fn mirror(row: &[f64; 8], mu: f64, channel: usize) -> f64 {
    let (r, cos) = dielectric(mu, row[6]);
    if cos == 0.0 {
        return r;
    }
    let bounces = (row[7] as f32).to_bits() & 0xff;
    let metal = conductor(cos, row[channel], row[3 + channel]);
    let once = metal * (-2.0 * row[7] / cos).exp();
    let mut light = (1.0 - r) * (1.0 - r) * once;
    let mut sum = r;
    for _ in 0..bounces {
        sum += light;
        light *= r * once;
    }
    sum
}

/// Of directions in the upper hemisphere.
pub fn eval(kind: Kind, row: &[f64; 8], wo: V, wi: V) -> Value {
    match kind {
        Kind::CoatedDiffuse => rough_diffuse(row, wo, wi),
        Kind::CoatedDiffuseBase => {
            let t = |w: V| smooth_transmittance(w[2], row[3], row[4]);
            Value {
                f: std::array::from_fn(|c| row[c] * t(wo) * t(wi)),
                pdf: wi[2] / PI,
                pdf_reverse: wo[2] / PI,
            }
        }
        _ => conductor_below(kind, row, wo, wi),
    }
}

/// Square of the alpha of slopes that add up, for one of which `far` is the square over that of the
/// alphas.
fn added(alphas: [f64; 3], far: f64) -> f64 {
    let [a, b, c] = alphas;
    squares(alphas) + 0.95 * (a * b + b * c + c * a) / (1.0 + far / 16.0)
}

fn squares(alphas: [f64; 3]) -> f64 {
    alphas.iter().map(|a| a * a).sum()
}

/// Thickness of the coat, and what the lobe is multiplied by: from 1/4 on, two bits of an exponent
/// and seven of the mantissa.
fn layer(kind: Kind, row: &[f64; 8]) -> (f64, f64) {
    match kind {
        Kind::CoatedConductor => {
            let code = (row[6] as f32).to_bits() >> 7 & 0x1ff;
            let mantissa = 1.0 + f64::from(code & 127) / 128.0;
            let gain = mantissa * 2f64.powi((code >> 7) as i32 - 2);
            (unpacked_alphas(row[6]).0, gain)
        }
        _ => (row[6], 1.0),
    }
}

/// Of an even lobe and one that is greatest between directions that face each other, the latter's
/// share among later bounces.
fn forward(row: &[f64; 8]) -> f64 {
    f64::from((row[6] as f32).to_bits() & 127) / 127.0
}

/// Shape of later bounces under a rough coat, 1 on average.
fn astray(row: &[f64; 8], o: V, i: V) -> f64 {
    let square = (o[0] - i[0]).powi(2) + (o[1] - i[1]).powi(2);
    1.0 - forward(row) + forward(row) * 0.6 * square * square
}

/// Its albedo.
fn astray_albedo(row: &[f64; 8], w: V) -> f64 {
    let sin2 = w[0] * w[0] + w[1] * w[1];
    1.0 - forward(row) + forward(row) * 0.6 * (1.0 / 3.0 + sin2 * (2.0 + sin2))
}

/// What a mean visible microfacet makes of a direction: where it goes inside, the share that gets
/// in, what the way leaves of it, and how far a slope moves it.
fn enter(row: &[f64; 8], w: V) -> (V, f64, f64, f64) {
    let (ax, ay) = unpacked_alphas(row[4]);
    let eta = row[3];
    let s = unit([w[0] * ax, w[1] * ay, w[2]]);
    // Its disk seen from `s`, of which half is cut off at grazing angles: the mean lies on the way
    // from `s` towards the normal.
    let planar = s[0].hypot(s[1]);
    let b = (1.0 - (1.0 + s[2]) / 2.0) * 8.0 / (3.0 * PI);
    let up = (1.0 - b * b).sqrt();
    let towards = if planar > 0.0 {
        [-s[2] * s[0] / planar, -s[2] * s[1] / planar, planar]
    } else {
        [0.0; 3]
    };
    let n: V = std::array::from_fn(|c| towards[c] * b + s[c] * up);
    let h = unit([n[0] * ax, n[1] * ay, n[2]]);
    let cos = dot(w, h).clamp(0.0, 1.0);
    let (r, cos_t) = dielectric(cos, eta);
    let shift = cos_t - cos / eta;
    let inside = unit(std::array::from_fn(|c| w[c] / eta + shift * h[c]));
    let (outer, inner) = (ggx_lambda(w, ax, ay), ggx_lambda(inside, ax, ay));
    let depth = layer(Kind::CoatedConductor, row).0 / inside[2];
    if inside[2] <= 0.0 || depth >= f64::from(DARK) {
        return (inside, 0.0, 0.0, shift.abs());
    }
    let seen = (1.0 + outer) / (1.0 + outer + inner);
    (inside, (1.0 - r) * seen, (-depth).exp(), shift.abs())
}

/// The lobe of a conductor below a rough coat, over its reflectance, and the cosine for that
/// ([`seen_through`](crate::surface::seen_through)).
fn once(row: &[f64; 8], o: V, i: V) -> (f64, f64) {
    let (coat, metal) = (unpacked_alphas(row[4]), unpacked_alphas(row[5]));
    let eta = row[3];
    let (p, share_o, way_o, shift_o) = enter(row, o);
    let (q, share_i, way_i, shift_i) = enter(row, i);
    let h = unit(add(p, q));
    let cos = dot(p, h).clamp(0.0, 1.0);
    if way_o == 0.0 || way_i == 0.0 {
        return (0.0, cos);
    }
    let slope = [h[0] / h[2], h[1] / h[2]];
    let level = p[2] + q[2];
    let alphas = [(coat.0, metal.0), (coat.1, metal.1)]
        .map(|(coat, metal)| [coat * shift_i / level, coat * shift_o / level, metal]);
    let far: f64 = (0..2).map(|j| slope[j].powi(2) / squares(alphas[j])).sum();
    let wide = alphas.map(|a| added(a, far).sqrt());
    let area = |k: usize| alphas[0][k] * alphas[1][k];
    let whole: f64 = (0..3).map(area).sum();
    // Trowbridge-Reitz over slopes, but for pi.
    let density = |x: f64, y: f64| {
        1.0 / (x * y * (1.0 + (slope[0] / x).powi(2) + (slope[1] / y).powi(2)).powi(2))
    };
    let sum = density(wide[0], wide[1]);
    let bend = |outside: V, inside: V, k: usize| {
        if area(k) == 0.0 {
            return 0.0;
        }
        let turned = [inside[0], inside[1], -inside[2]];
        let [f, ..] = ggx_refraction((turned, eta), (outside, 1.0), coat.0, coat.1);
        f * area(k) / whole * sum / density(alphas[0][k], alphas[1][k])
    };
    let out = bend(i, p, 0) * share_o;
    let back = bend(o, q, 1) * share_i;
    let turned =
        ggx_brdf(p, q, wide[0], wide[1]) * share_o * share_i / (eta * eta) * area(2) / whole;
    let lobe = (out + back + turned) * way_o * way_i;
    (if lobe.is_finite() { lobe } else { 0.0 }, cos)
}

/// The square of `cos' - cos / eta`.
fn shift2(row: &[f64; 8], mu: f64, below: f64) -> f64 {
    (below - mu / row[3]).powi(2)
}

/// Alphas that a conductor is sampled by from a direction with cosines `mu` outside and `below`
/// inside.
pub fn sampled_alphas(kind: Kind, row: &[f64; 8], mu: f64, below: f64) -> (f64, f64) {
    match kind {
        Kind::CoatedConductor => {
            let (metal, coat) = (unpacked_alphas(row[5]), unpacked_alphas(row[4]));
            let part = shift2(row, mu, below).sqrt() / (2.0 * below);
            let widest = |metal, coat: f64| added([part * coat, part * coat, metal], 0.0).sqrt();
            (widest(metal.0, coat.0), widest(metal.1, coat.1))
        }
        _ => unpacked_alphas(row[5]),
    }
}

fn half_cosine(a: V, b: V) -> f64 {
    dot(a, unit(add(a, b))).clamp(0.0, 1.0)
}

fn rough_diffuse(row: &[f64; 8], wo: V, wi: V) -> Value {
    let (ax, ay) = unpacked_alphas(row[4]);
    let coat = dielectric(half_cosine(wo, wi), row[3]).0 * ggx_brdf(wo, wi, ax, ay);
    let t = transmittance(row, wo[2]) * transmittance(row, wi[2]);
    let density = |from: V, to: V| {
        let share = diffuse_share(row, from[2]);
        share * to[2] / PI + (1.0 - share) * ggx_pdf(from, to, ax, ay)
    };
    Value {
        f: std::array::from_fn(|c| row[c] * t + coat),
        pdf: density(wo, wi),
        pdf_reverse: density(wi, wo),
    }
}

fn conductor_below(kind: Kind, row: &[f64; 8], wo: V, wi: V) -> Value {
    let coated = kind == Kind::CoatedConductor;
    let eta = row[3];
    let mu = |w: V| {
        if coated {
            effective_cosine(row, w)
        } else {
            w[2]
        }
    };
    let thickness = layer(kind, row).0;
    let t = transmitted(row, thickness, wo, mu(wo)) * transmitted(row, thickness, wi, mu(wi));
    // Snell's law.
    let refract = |w: V| {
        let (x, y) = (w[0] / eta, w[1] / eta);
        [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()]
    };
    let (p, q) = (refract(wo), refract(wi));
    let both = p[2] > 0.0 && q[2] > 0.0;
    let (cx, cy) = unpacked_alphas(row[4]);
    let (lobe, cos) = if coated {
        let (lobe, cos) = once(row, wo, wi);
        (lobe * layer(kind, row).1, cos)
    } else if both {
        let (ax, ay) = unpacked_alphas(row[5]);
        (t * ggx_brdf(p, q, ax, ay) / (eta * eta), half_cosine(p, q))
    } else {
        (0.0, 1.0)
    };
    let coat = if coated {
        dielectric(half_cosine(wo, wi), eta).0 * ggx_brdf(wo, wi, cx, cy)
    } else {
        0.0
    };
    let later = later(row);
    let seen = match kind {
        Kind::CoatedConductor if eta >= 1.0 => astray(row, wo, wi),
        Kind::CoatedConductor => t * astray(row, wo, wi),
        _ => t,
    };
    let f = |c: usize| {
        let (n, k) = unpacked_alphas(row[c]);
        conductor(cos, n, k) * lobe + seen * later[c] / PI + coat
    };
    let density = |from: V, to: V, from_inside: V, to_inside: V| {
        let [metal, diffuse, gloss] = conductor_shares(kind, row, from);
        let (ax, ay) = sampled_alphas(kind, row, from[2], from_inside[2]);
        let below = if both {
            ggx_pdf(from_inside, to_inside, ax, ay) * to[2] / (eta * eta * to_inside[2])
        } else {
            0.0
        };
        let above = if coated {
            gloss * ggx_pdf(from, to, cx, cy)
        } else {
            0.0
        };
        metal * below + diffuse * to[2] / PI + above
    };
    Value {
        f: std::array::from_fn(f),
        pdf: density(wo, wi, p, q),
        pdf_reverse: density(wi, wo, q, p),
    }
}
