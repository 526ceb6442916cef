//! Light between a coat and what it covers, one random walk at a time: the model of pbrt-v4
//! without its shortcuts, in `f64`.

use crate::common::stats::Random;
use phalanx::pbrt::load_str;
use phalanx::replay::bsdf::{conductor, dielectric, ggx_brdf, ggx_d, ggx_lambda};
use phalanx::replay::vector::*;
use phalanx::surface::{Kind, MaterialTable};
use std::f64::consts::{PI, TAU};

/// The layers as pbrt-v4 has them; grey.
#[derive(Clone, Copy)]
pub struct Layers {
    pub alpha: f64,
    pub eta: f64,
    pub thickness: f64,
    pub base: Base,
    pub max_depth: u32,
}

#[derive(Clone, Copy)]
pub enum Base {
    Diffuse(f64),
    /// Of eta, k relative to the coat.
    Conductor {
        eta: f64,
        k: f64,
        alpha: f64,
    },
}

/// A direction sampled at an interface, its value times the cosine over the density, and the
/// density; smooth interfaces have density 1.
struct Scattered {
    w: V,
    weight: f64,
    pdf: f64,
}

/// pbrt's `EffectivelySmooth`.
pub fn smooth(alpha: f64) -> bool {
    alpha < 1e-3
}

fn visible_normal(wo: V, alpha: f64, random: &mut Random) -> V {
    let s = unit([wo[0] * alpha, wo[1] * alpha, wo[2]]);
    let planar = s[0].hypot(s[1]);
    let t1 = if planar > 1e-12 {
        [-s[1] / planar, s[0] / planar, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let t2 = cross(s, t1);
    let (r, phi) = (random.uniform64().sqrt(), TAU * random.uniform64());
    let (a, b) = (r * phi.cos(), r * phi.sin());
    let h = 0.5 * (1.0 + s[2]);
    let b = (1.0 - h) * (1.0 - a * a).max(0.0).sqrt() + h * b;
    let c = (1.0 - a * a - b * b).max(0.0).sqrt();
    let n = add(scale(t1, a), add(scale(t2, b), scale(s, c)));
    unit([n[0] * alpha, n[1] * alpha, n[2].max(1e-9)])
}

fn g1(w: V, alpha: f64) -> f64 {
    1.0 / (1.0 + ggx_lambda([w[0], w[1], w[2].abs()], alpha, alpha))
}

fn visible_pdf(w: V, h: V, alpha: f64) -> f64 {
    g1(w, alpha) * ggx_d(h, alpha, alpha) * dot(w, h).abs() / w[2].abs()
}

fn masking(a: V, b: V, alpha: f64) -> f64 {
    let lambda = |w: V| ggx_lambda([w[0], w[1], w[2].abs()], alpha, alpha);
    1.0 / (1.0 + lambda(a) + lambda(b))
}

impl Layers {
    /// pbrt-v4's `DielectricBxDF`, `w` on either side, only the reflection or only the
    /// transmission. Importance: without the squared index, which between entering and leaving
    /// cancels.
    fn sample_coat(&self, w: V, reflect: bool, random: &mut Random) -> Option<Scattered> {
        let up = [w[0], w[1], w[2].abs()];
        let side = 1f64.copysign(w[2]);
        let eta = if w[2] > 0.0 { self.eta } else { 1.0 / self.eta };
        let h = if smooth(self.alpha) {
            [0.0, 0.0, 1.0]
        } else {
            visible_normal(up, self.alpha, random)
        };
        let cos = dot(up, h).clamp(0.0, 1.0);
        let (r, cos_t) = dielectric(cos, eta);
        let (out, share) = if reflect {
            (sub(scale(h, 2.0 * cos), up), r)
        } else {
            (
                sub(scale(h, cos / eta - cos_t), scale(up, 1.0 / eta)),
                1.0 - r,
            )
        };
        if share <= 0.0 || (out[2] > 0.0) != reflect || out[2] == 0.0 {
            return None;
        }
        let (weight, pdf) = if smooth(self.alpha) {
            (share, 1.0)
        } else {
            let jacobian = if reflect {
                1.0 / (4.0 * cos)
            } else {
                dot(out, h).abs() / (dot(out, h) + cos / eta).powi(2)
            };
            let g = masking(up, out, self.alpha) / g1(up, self.alpha);
            (share * g, visible_pdf(up, h, self.alpha) * jacobian)
        };
        Some(Scattered {
            w: unit([out[0], out[1], out[2] * side]),
            weight,
            pdf,
        })
    }

    /// Transmission from inside, `w` pointing away from the coat (`w.z < 0`), to `wi` outside,
    /// times no cosine; the density of `wi`, and that of `w` if light came from `wi`.
    fn transmit(&self, w: V, wi: V) -> (f64, f64, f64) {
        let eta = 1.0 / self.eta;
        // Seen from inside: `w` is on the near side.
        let (near, far) = ([w[0], w[1], -w[2]], [wi[0], wi[1], -wi[2]]);
        let h = add(near, scale(far, eta));
        let h = scale(unit(h), 1f64.copysign(h[2]));
        let (a, b) = (dot(near, h), dot(far, h));
        if a <= 0.0 || b >= 0.0 {
            return (0.0, 0.0, 0.0);
        }
        let t = 1.0 - dielectric(a.min(1.0), eta).0;
        let d = ggx_d(h, self.alpha, self.alpha);
        let denominator = (b + a / eta).powi(2);
        let f = t * d * masking(near, far, self.alpha) * (a * b).abs()
            / (denominator * (near[2] * far[2]).abs());
        // Only the transmission is sampled.
        let pdf = visible_pdf(near, h, self.alpha) * b.abs() / denominator;
        let back = visible_pdf(far, h, self.alpha) * a / (a + b * eta).powi(2);
        (f, pdf, back)
    }

    fn base_value(&self, a: V, b: V) -> f64 {
        match self.base {
            Base::Diffuse(rho) => rho / PI,
            Base::Conductor { eta, k, alpha } => {
                let c = dot(a, unit(add(a, b))).clamp(0.0, 1.0);
                ggx_brdf(a, b, alpha, alpha) * conductor(c, eta, k)
            }
        }
    }

    fn base_pdf(&self, a: V, b: V) -> f64 {
        match self.base {
            Base::Diffuse(_) => b[2] / PI,
            Base::Conductor { alpha, .. } => {
                let h = unit(add(a, b));
                visible_pdf(a, h, alpha) / (4.0 * dot(a, h))
            }
        }
    }

    fn base_is_smooth(&self) -> bool {
        matches!(self.base, Base::Conductor { alpha, .. } if smooth(alpha))
    }

    /// `a.z > 0`, away from the base.
    fn sample_base(&self, a: V, random: &mut Random) -> Option<Scattered> {
        match self.base {
            Base::Diffuse(rho) => {
                let (r, phi) = (random.uniform64().sqrt(), TAU * random.uniform64());
                let z = (1.0 - r * r).sqrt();
                let w = [r * phi.cos(), r * phi.sin(), z];
                (rho > 0.0 && z > 0.0).then_some(Scattered {
                    w,
                    weight: rho,
                    pdf: z / PI,
                })
            }
            Base::Conductor { eta, k, alpha } => {
                let h = if smooth(alpha) {
                    [0.0, 0.0, 1.0]
                } else {
                    visible_normal(a, alpha, random)
                };
                let c = dot(a, h).clamp(0.0, 1.0);
                let w = sub(scale(h, 2.0 * c), a);
                let r = conductor(c, eta, k);
                if w[2] <= 0.0 {
                    return None;
                }
                let (g, pdf) = if smooth(alpha) {
                    (1.0, 1.0)
                } else {
                    (masking(a, w, alpha) / g1(a, alpha), self.base_pdf(a, w))
                };
                Some(Scattered {
                    w: unit(w),
                    weight: r * g,
                    pdf,
                })
            }
        }
    }

    /// `exp(-|dz / cos|)`: pbrt attenuates whatever the albedo.
    fn way(&self, w: V) -> f64 {
        (-self.thickness / w[2].abs()).exp()
    }

    /// One estimate of `LayeredBxDF::f`, without what an interface reflects at once; `wo` and `wi`
    /// outside. The value is over the squared index.
    ///
    /// pbrt weighs two ways to sample the direction in which light leaves the base, from the base
    /// and through the interface from outside, but takes for the density of the latter that of `wi`
    /// given the direction inside (`exitInterface.PDF(-w, wi, ..)`): its weights do not add up to
    /// 1, and the estimate is biased where both are rough. `as_pbrt` does the same; otherwise the
    /// density is the right one.
    pub fn walk(&self, wo: V, wi: V, as_pbrt: bool, random: &mut Random) -> f64 {
        let power = |a: f64, b: f64| a * a / (a * a + b * b);
        let (Some(entering), Some(leaving)) = (
            self.sample_coat(wo, false, random),
            self.sample_coat(wi, false, random),
        ) else {
            return 0.0;
        };
        // `leaving.w` points down; its weight has the cosine below, that pbrt divides out.
        let exit = leaving.w;
        let exit_weight = leaving.weight / exit[2].abs();
        let mut f = 0.0;
        let mut beta = entering.weight;
        let mut w = entering.w;
        let mut at_top = true;
        for depth in 0..self.max_depth {
            if depth > 3 && beta < 0.25 {
                let q = (1.0 - beta).max(0.0);
                if random.uniform64() < q {
                    break;
                }
                beta /= 1.0 - q;
            }
            at_top = !at_top;
            beta *= self.way(w);
            if at_top {
                // Seen from inside, with z up as outside: the near side is below.
                let Some(s) = self.sample_coat(scale(w, -1.0), true, random) else {
                    break;
                };
                beta *= s.weight;
                w = s.w;
            } else {
                let a = scale(w, -1.0);
                let b = scale(exit, -1.0);
                if !self.base_is_smooth() {
                    let weight = if smooth(self.alpha) {
                        1.0
                    } else {
                        power(leaving.pdf, self.base_pdf(a, b))
                    };
                    f += beta * self.base_value(a, b) * b[2] * weight * self.way(b) * exit_weight;
                }
                let Some(s) = self.sample_base(a, random) else {
                    break;
                };
                beta *= s.weight;
                w = s.w;
                if !smooth(self.alpha) {
                    let (value, forth, back) = self.transmit(scale(w, -1.0), wi);
                    let pdf = if as_pbrt { forth } else { back };
                    if value > 0.0 {
                        let weight = if self.base_is_smooth() {
                            1.0
                        } else {
                            power(s.pdf, pdf)
                        };
                        // Radiance grows by the squared index, which the whole is over.
                        f += beta * self.way(w) * value * weight * self.eta * self.eta;
                    }
                }
            }
        }
        f
    }

    /// What the interface reflects at once.
    pub fn gloss(&self, wo: V, wi: V) -> f64 {
        if smooth(self.alpha) {
            return 0.0;
        }
        let c = dot(wo, unit(add(wo, wi))).clamp(0.0, 1.0);
        dielectric(c, self.eta).0 * ggx_brdf(wo, wi, self.alpha, self.alpha)
    }

    /// One estimate of the share of the light from `wo` that leaves again, by
    /// `LayeredBxDF::Sample_f`: what the interface reflects at once, and what comes out of the
    /// layers.
    pub fn sampled(&self, wo: V, random: &mut Random) -> f64 {
        let mut total = self.sample_coat(wo, true, random).map_or(0.0, |s| s.weight);
        let Some(s) = self.sample_coat(wo, false, random) else {
            return total;
        };
        let (mut w, mut beta, mut at_top) = (s.w, s.weight, true);
        for _ in 0..self.max_depth {
            at_top = !at_top;
            beta *= self.way(w);
            let a = scale(w, -1.0);
            let next = if at_top {
                // What leaves is added up, not chosen.
                total += self
                    .sample_coat(a, false, random)
                    .map_or(0.0, |s| beta * s.weight);
                self.sample_coat(a, true, random)
            } else {
                self.sample_base(a, random)
            };
            let Some(s) = next else {
                break;
            };
            beta *= s.weight;
            w = s.w;
        }
        total
    }

    /// The row that the renderer has for it, by way of a scene file; and its kind.
    pub fn row(&self) -> (Kind, [f32; 8]) {
        let Layers {
            alpha,
            eta,
            thickness,
            max_depth,
            ..
        } = *self;
        let rest = "\"bool remaproughness\" false";
        let material = match self.base {
            Base::Diffuse(rho) => format!(
                "\"coateddiffuse\" \"rgb reflectance\" [{rho} {rho} {rho}] \"float roughness\" {alpha} \"float eta\" {eta} \"float thickness\" {thickness} \"integer maxdepth\" {max_depth} {rest}"
            ),
            Base::Conductor {
                eta: n,
                k,
                alpha: below,
            } => {
                let (n, k) = (n * eta, k * eta);
                format!(
                    "\"coatedconductor\" \"rgb conductor.eta\" [{n} {n} {n}] \"rgb conductor.k\" [{k} {k} {k}] \"float conductor.roughness\" {below} \"float interface.roughness\" {alpha} \"float interface.eta\" {eta} \"float thickness\" {thickness} \"integer maxdepth\" {max_depth} {rest}"
                )
            }
        };
        let text =
            format!("Camera \"perspective\"\nWorldBegin\nMaterial {material}\nShape \"sphere\"\n");
        let scene = load_str(&text, "coat.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"));
        let table = MaterialTable::new(&scene);
        let coated = table
            .entries
            .iter()
            .zip(&table.rows)
            .find(|(entry, _)| entry.kind >= Kind::CoatedDiffuse);
        let (entry, row) = coated.expect("a coated material");
        (entry.kind, row.0)
    }
}
