//! Coated surfaces against pbrt-v4's random walk between their layers, which they stand for in
//! closed form: how far apart they are.

use crate::common;

use common::bsdf::Kernels;
use common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::pbrt::load_str;
use phalanx::replay::bsdf::{conductor, dielectric, ggx_brdf, ggx_d, ggx_lambda};
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::{Kind, MaterialTable, Mode};
use std::f64::consts::{PI, TAU};

/// The layers as pbrt-v4 has them; grey.
#[derive(Clone, Copy)]
struct Layers {
    alpha: f64,
    eta: f64,
    thickness: f64,
    base: Base,
    max_depth: u32,
}

#[derive(Clone, Copy)]
enum Base {
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
fn smooth(alpha: f64) -> bool {
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
    fn walk(&self, wo: V, wi: V, as_pbrt: bool, random: &mut Random) -> f64 {
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
    fn gloss(&self, wo: V, wi: V) -> f64 {
        if smooth(self.alpha) {
            return 0.0;
        }
        let c = dot(wo, unit(add(wo, wi))).clamp(0.0, 1.0);
        dielectric(c, self.eta).0 * ggx_brdf(wo, wi, self.alpha, self.alpha)
    }

    /// One estimate of the share of the light from `wo` that leaves again, by
    /// `LayeredBxDF::Sample_f`: what the interface reflects at once, and what comes out of the
    /// layers.
    fn sampled(&self, wo: V, random: &mut Random) -> f64 {
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
    fn row(&self) -> (Kind, [f32; 8]) {
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

fn at(mu: f64, phi: f64) -> V {
    let r = (1.0 - mu * mu).sqrt();
    [r * phi.cos(), r * phi.sin(), mu]
}

/// Albedo of the kernel by its own sampling.
fn albedo(kind: Kind, row: &[f32; 8], mu: f64, n: usize, random: &mut Random) -> Mean {
    let wo = vec![narrow(at(mu, 0.3)); n];
    let u: Vec<[f32; 3]> = (0..n)
        .map(|_| std::array::from_fn(|_| random.uniform()))
        .collect();
    let mut mean = Mean::default();
    for (_, weight, ..) in Kernels::sample::<f32x8>(kind, row, &wo, &u, Mode::Radiance) {
        mean.add(weight[1].into());
    }
    mean
}

const COSINES: [f64; 5] = [1.0, 0.7, 0.4, 0.2, 0.1];

/// Distances of albedos: of each cosine.
fn albedo_distances(layers: Layers, random: &mut Random) -> [(f64, f64); 5] {
    let (kind, row) = layers.row();
    COSINES.map(|mu| {
        let n = 8_000;
        let ours = albedo(kind, &row, mu, n, random);
        let mut theirs = Mean::default();
        for _ in 0..n {
            theirs.add(layers.sampled(at(mu, 0.3), random));
        }
        let mut base = ours.mean();
        if smooth(layers.alpha) && kind != Kind::CoatedMirror {
            base += dielectric(mu, layers.eta).0;
        }
        (base - theirs.mean(), ours.error().hypot(theirs.error()))
    })
}

fn diffuse_cases() -> Vec<Layers> {
    let mut cases = Vec::new();
    for eta in [1.3, 1.5, 2.0] {
        for alpha in [0.0, 0.1, 0.3, 0.6] {
            for rho in [0.1, 0.5, 0.9] {
                cases.push(Layers {
                    alpha,
                    eta,
                    thickness: 0.01,
                    base: Base::Diffuse(rho),
                    max_depth: 10,
                });
            }
        }
    }
    cases
}

fn conductor_cases() -> Vec<Layers> {
    let mut cases = Vec::new();
    for eta in [1.3, 1.5, 2.0] {
        for alpha in [0.0, 0.1, 0.3, 0.6] {
            for below in [0.0, 0.1, 0.3, 0.6] {
                cases.push(Layers {
                    alpha,
                    eta,
                    thickness: 0.01,
                    base: Base::Conductor {
                        eta: 0.9 / eta,
                        k: 2.4 / eta,
                        alpha: below,
                    },
                    max_depth: 10,
                });
            }
        }
    }
    cases
}

/// Prints the distances of albedos and returns the largest, of what is beyond the statistical
/// error.
fn table(cases: &[Layers], random: &mut Random) -> f64 {
    let tail = normal_quantile(FALSE_ALARM);
    let mut worst = 0.0f64;
    for layers in cases {
        let base = match layers.base {
            Base::Diffuse(rho) => format!("rho {rho:4}"),
            Base::Conductor { alpha, .. } => format!("alpha {alpha:4}"),
        };
        let distances = albedo_distances(*layers, random);
        let row: Vec<String> = distances
            .iter()
            .map(|(d, e)| format!("{d:+.4} ({e:.4})"))
            .collect();
        println!(
            "eta {:3} coat {:4} {base}: {}",
            layers.eta,
            layers.alpha,
            row.join(" ")
        );
        for (distance, error) in distances {
            worst = worst.max(distance.abs() - tail * error);
        }
    }
    println!("beyond noise: {worst:.4}");
    worst
}

#[test]
fn albedos_of_coated_diffuse_surfaces_are_those_of_the_random_walk() {
    let worst = table(&diffuse_cases(), &mut Random(1));
    assert!(worst < 0.002, "{worst}");
}

#[test]
fn albedos_of_coated_conductors_are_near_those_of_the_random_walk() {
    let worst = table(&conductor_cases(), &mut Random(2));
    assert!(worst < 0.03, "{worst}");
}

/// Largest distance of values, in parts of what a white diffuse surface has, in directions around
/// and away from the mirror's; the largest relative one; and the bias of pbrt's weights. All of
/// what is beyond statistical error.
fn value_distance(layers: Layers, random: &mut Random) -> [f64; 3] {
    let (kind, row) = layers.row();
    let tail = normal_quantile(FALSE_ALARM);
    let [mut worst, mut relative, mut bias] = [0.0f64; 3];
    for (mo, mi, phi) in [
        (0.9, 0.9, 3.0),
        (0.9, 0.5, 3.1),
        (0.7, 0.7, 1.5),
        (0.6, 0.3, 2.6),
        (0.4, 0.4, 3.0),
        (0.2, 0.5, 0.5),
        (0.9, 0.2, 0.0),
    ] {
        let (wo, wi) = (at(mo, 0.0), at(mi, phi));
        let value =
            Kernels::eval::<f32x8>(kind, &row, &[narrow(wo)], &[narrow(wi)], Mode::Radiance)[0].0
                [1];
        let mut mean = |as_pbrt: bool| {
            let mut mean = Mean::default();
            for _ in 0..4_000 {
                mean.add(layers.walk(wo, wi, as_pbrt, random) / (layers.eta * layers.eta));
            }
            mean
        };
        let right = mean(false);
        let theirs = right.mean() + layers.gloss(wo, wi);
        let distance = (f64::from(value) - theirs).abs() - tail * right.error();
        worst = worst.max(PI * distance);
        relative = relative.max(distance / theirs);
        let pbrt = mean(true);
        let error = tail * right.error().hypot(pbrt.error());
        bias = bias.max(((pbrt.mean() - right.mean()).abs() - error) / theirs);
    }
    [worst, relative, bias]
}

#[test]
fn values_of_coated_diffuse_surfaces_are_those_of_the_random_walk() {
    let mut random = Random(3);
    let mut worst = [0.0f64; 3];
    for layers in diffuse_cases() {
        let distances = value_distance(layers, &mut random);
        worst = std::array::from_fn(|i| worst[i].max(distances[i]));
    }
    println!("{worst:?}");
    assert!(worst[0] < 0.01, "{worst:?}");
}

#[test]
fn values_of_coated_conductors_are_near_those_of_the_random_walk() {
    let mut random = Random(4);
    for layers in conductor_cases() {
        if layers.row().0 == Kind::CoatedMirror {
            continue;
        }
        let [d, r, _] = value_distance(layers, &mut random);
        let Base::Conductor { alpha, .. } = layers.base else {
            continue;
        };
        println!(
            "eta {} coat {} alpha {alpha}: {d:.4} of a white surface's, {r:.3} of its own",
            layers.eta, layers.alpha
        );
        if smooth(layers.alpha) && alpha >= 0.3 {
            assert!(r < 0.2, "{r}");
        }
        if alpha >= 0.6 {
            assert!(d < 0.12 && r < 0.25, "{d} {r}");
        }
    }
}

/// A white base under a clear coat, as many bounces as it takes: smooth coats lose nothing, rough
/// ones what microfacets send into each other.
#[test]
fn white_under_a_clear_coat_stays_white() {
    let mut random = Random(5);
    let tail = normal_quantile(FALSE_ALARM);
    for (alpha, least) in [(0.0, 1.0), (0.1, 0.88), (0.3, 0.6), (0.6, 0.4)] {
        let layers = Layers {
            alpha,
            eta: 1.5,
            thickness: 0.0,
            base: Base::Diffuse(1.0),
            max_depth: 2000,
        };
        let (kind, row) = layers.row();
        let all = COSINES.map(|mu| {
            let mean = albedo(kind, &row, mu, 8000, &mut random);
            let mut sum = mean.mean();
            if smooth(alpha) {
                sum += dielectric(mu, layers.eta).0;
            }
            let reach = tail * mean.error() + 1e-3;
            assert!(
                sum <= 1.0 + reach && sum >= least - reach,
                "{alpha} {mu}: {sum}"
            );
            sum
        });
        println!("alpha {alpha}: {all:.4?}");
    }
}

/// The kernel and row of a material's coated part, evaluated at a hit if it has textures.
fn evaluated(material: &str) -> (Kind, [f32; 8]) {
    let textures = "Texture \"f\" \"float\" \"checkerboard\" \"float tex1\" FLOAT \"float tex2\" FLOAT\n\
                    Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.7 .6 .4] \"rgb tex2\" [.7 .6 .4]\n";
    let float = material.rsplit(' ').next().unwrap_or_default();
    let textures = textures.replace("FLOAT", if float.is_empty() { "0" } else { float });
    let material = material.strip_suffix(float).unwrap_or(material);
    let text = format!(
        "Camera \"perspective\"\nWorldBegin\n{textures}Material {material}\nShape \"sphere\"\n"
    );
    let scene = load_str(&text, "coat.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let table = MaterialTable::new(&scene);
    let coated = |kind: Kind| kind >= Kind::CoatedDiffuse;
    let found = table
        .entries
        .iter()
        .position(|e| coated(e.kind) && !e.mixture);
    let index = found.expect("a coated material");
    let row = table.evaluate(index, &Default::default(), 0.0);
    (table.entries[index].kind, row.0)
}

/// A texture that is the same everywhere is as good as a constant: rows of both have the same
/// values but for what interpolation between tabulated roughnesses leaves.
#[test]
fn textures_on_coats_are_those_of_constants() {
    let white = "\"rgb reflectance\" [.7 .6 .4]";
    let cases = [
        (
            "\"coateddiffuse\" \"rgb reflectance\" [.7 .6 .4] \"float roughness\" R",
            "\"coateddiffuse\" \"texture reflectance\" \"c\" \"texture roughness\" \"f\" R",
            0.01,
        ),
        (
            "\"coatedconductor\" \"float conductor.roughness\" .1 W \"float interface.roughness\" R",
            "\"coatedconductor\" \"float conductor.roughness\" .1 \"texture reflectance\" \"c\" \"texture interface.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W \"float interface.roughness\" .1 \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"float interface.roughness\" .1 \"texture conductor.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W \"float interface.roughness\" R \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"texture interface.roughness\" \"f\" \"texture conductor.roughness\" \"f\" R",
            0.05,
        ),
        (
            "\"coatedconductor\" W \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"texture conductor.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W",
            "\"coatedconductor\" \"texture reflectance\" \"c\" R",
            1e-4,
        ),
    ];
    for (constant, textured, bound) in cases {
        for roughness in ["0.04", "0.13", "0.3"] {
            let fill = |text: &str| text.replace('W', white).replace('R', roughness);
            let (kind, row) = evaluated(&(fill(constant) + " "));
            let (same, other) = evaluated(&fill(textured));
            assert_eq!(kind, same, "{textured}");
            if kind == Kind::CoatedMirror {
                assert_eq!(row, other);
                continue;
            }
            for (mo, mi, phi) in [
                (1.0, 0.9, 3.0),
                (0.8, 0.8, 3.1),
                (0.5, 0.3, 2.8),
                (0.3, 0.6, 0.5),
            ] {
                let value = |row| {
                    let (wo, wi) = (narrow(at(mo, 0.0)), narrow(at(mi, phi)));
                    Kernels::eval::<f32x8>(kind, row, &[wo], &[wi], Mode::Radiance)[0].0
                };
                let (a, b) = (value(&row), value(&other));
                for c in 0..3 {
                    let off = (a[c] - b[c]).abs();
                    assert!(
                        off <= bound * (a[c] + 0.03),
                        "{textured} {roughness}: {a:?} {b:?}"
                    );
                }
            }
        }
    }
}

/// What cannot be looked up in a texture is said so.
#[test]
fn textures_that_coats_cannot_have() {
    for (material, given) in [
        ("coateddiffuse", "\"texture thickness\" \"f\""),
        ("coateddiffuse", "\"texture albedo\" \"c\""),
    ] {
        let text = format!(
            "Camera \"perspective\"\nWorldBegin\nTexture \"f\" \"float\" \"checkerboard\"\nTexture \"c\" \"spectrum\" \"checkerboard\"\nMaterial \"{material}\" {given}\nShape \"sphere\"\n"
        );
        let error = load_str(&text, "coat.pbrt", ".".as_ref())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("not supported") && error.contains("coat.pbrt:5"),
            "{error}"
        );
    }
}

/// Over smooth metal under a rough coat: the whole lobe, against the walk's mean over sun and eye
/// around a ball. What is left is the shape's error.
#[test]
fn lobes_over_smooth_metal_have_the_shape_of_the_walk() {
    let mut random = Random(6);
    let light = unit([1.0, 2.0, 2.0]);
    for (alpha, eta) in [(0.2f64.sqrt(), 1.5), (0.2, 1.5), (0.3, 1.3), (0.3, 2.0)] {
        let k = 2.0 * 0.9f64.sqrt() / 0.1f64.sqrt();
        let layers = Layers {
            alpha,
            eta,
            thickness: 0.01,
            base: Base::Conductor {
                eta: 1.0 / eta,
                k: k / eta,
                alpha: 0.0,
            },
            max_depth: 10,
        };
        let (kind, row) = layers.row();
        let n = 14;
        let [mut ours, mut theirs, mut apart] = [0.0f64; 3];
        for i in 0..n * n {
            let x = (2 * (i % n) + 1) as f64 / n as f64 - 1.0;
            let y = (2 * (i / n) + 1) as f64 / n as f64 - 1.0;
            let square = 1.0 - x * x - y * y;
            if square < 0.02 {
                continue;
            }
            let normal = [x, y, square.sqrt()];
            let cos = dot(normal, light);
            if cos <= 0.02 {
                continue;
            }
            let s = unit(cross(normal, [0.0, 1.0, 0.1]));
            let t = cross(normal, s);
            let local = |w: V| [dot(w, s), dot(w, t), dot(w, normal)];
            let (wo, wi) = (local([0.0, 0.0, 1.0]), local(light));
            let value =
                Kernels::eval::<f32x8>(kind, &row, &[narrow(wo)], &[narrow(wi)], Mode::Radiance);
            let a = f64::from(value[0].0[1]) * cos;
            let walks = 800;
            let sum: f64 = (0..walks)
                .map(|_| layers.walk(wo, wi, false, &mut random))
                .sum();
            let b = (sum / f64::from(walks) / (eta * eta) + layers.gloss(wo, wi)) * cos;
            ours += a;
            theirs += b;
            apart += (a - b).abs();
        }
        println!(
            "alpha {alpha:.3} eta {eta}: {:.3} of the walk's, {:.3} apart",
            ours / theirs,
            apart / theirs
        );
        assert!(
            (ours / theirs - 1.0).abs() < 0.05,
            "{alpha} {eta}: {}",
            ours / theirs
        );
        assert!(apart < 0.12 * theirs, "{alpha} {eta}: {}", apart / theirs);
    }
}
