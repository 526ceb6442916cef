//! Coated surfaces in `f64`: the formulas of [`crate::surface::coated_diffuse`] and [`crate::surface::coated_conductor`] over the same rows.

use super::bsdf::{Value, conductor, dielectric, ggx_brdf, ggx_pdf, unpacked_alphas};
use super::vector::{V, add, dot, unit};
use crate::surface::Kind;
use crate::surface::coat::DARK;
use std::f64::consts::PI;

/// Transmittance of a rough coat: the polynomial whose twelve-bit coefficients, -1 to 3, are packed in the row.
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
    let t = transmitted(row, w, mu);
    let brightest = later(row).into_iter().fold(0.0, f64::max);
    let coat = if coated { gloss(mu, row[3]) } else { 0.0 };
    let parts = [t, t * brightest, coat];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 {
        parts.map(|p| p / sum)
    } else {
        [1.0, 0.0, 0.0]
    }
}

fn transmitted(row: &[f64; 8], w: V, mu: f64) -> f64 {
    if w[0].hypot(w[1]) < row[3] {
        smooth_transmittance(mu, row[3], row[6])
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

/// Alphas of a conductor seen through a rough coat, from the squares of its own and of the coat's slopes, of which refraction shows a part.
fn seen_through(row: &[f64; 8], shifts2: f64, cosines: f64) -> (f64, f64) {
    let (metal, coat) = (unpacked_alphas(row[5]), unpacked_alphas(row[4]));
    let part = shifts2.sqrt() / cosines;
    (metal.0.hypot(part * coat.0), metal.1.hypot(part * coat.1))
}

/// The square of `cos' - cos / eta`.
fn shift2(row: &[f64; 8], mu: f64, below: f64) -> f64 {
    (below - mu / row[3]).powi(2)
}

/// Alphas that a conductor is sampled by from a direction with cosines `mu` outside and `below` inside.
pub fn sampled_alphas(kind: Kind, row: &[f64; 8], mu: f64, below: f64) -> (f64, f64) {
    match kind {
        Kind::CoatedConductor => seen_through(row, 2.0 * shift2(row, mu, below), 2.0 * below),
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
    let t = transmitted(row, wo, mu(wo)) * transmitted(row, wi, mu(wi));
    // Snell's law.
    let refract = |w: V| {
        let (x, y) = (w[0] / eta, w[1] / eta);
        [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()]
    };
    let (p, q) = (refract(wo), refract(wi));
    let both = p[2] > 0.0 && q[2] > 0.0;
    let (ax, ay) = match coated {
        true => seen_through(
            row,
            shift2(row, wo[2], p[2]) + shift2(row, wi[2], q[2]),
            p[2] + q[2],
        ),
        false => unpacked_alphas(row[5]),
    };
    let (cx, cy) = unpacked_alphas(row[4]);
    let lobe = if both {
        ggx_brdf(p, q, ax, ay) / (eta * eta)
    } else {
        0.0
    };
    let coat = if coated {
        dielectric(half_cosine(wo, wi), eta).0 * ggx_brdf(wo, wi, cx, cy)
    } else {
        0.0
    };
    let later = later(row);
    let f = |c: usize| {
        let (n, k) = unpacked_alphas(row[c]);
        let metal = if both {
            conductor(half_cosine(p, q), n, k) * lobe
        } else {
            0.0
        };
        t * (metal + later[c] / PI) + coat
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
