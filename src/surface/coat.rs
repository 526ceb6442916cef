//! What a rough dielectric interface over a base lets through, computed when a scene is loaded.
//!
//! Light that reaches a base below such an interface has crossed it in all directions the interface
//! scatters it to. Of a Lambertian base only their sum is seen: the *transmittance* `T(mu)` of a
//! direction from outside, which no closed form is known for. It is integrated over the
//! microfacets' visible normals and fitted by a polynomial (Bernstein's form, degree 5, in the
//! square root of the cosine: near grazing directions `T` behaves like it). What the base sends
//! back and the interface reflects down again is one number, the *internal reflectance*.
//!
//! Between the two the light is absorbed by a medium of extinction 1 as thick as the coat,
//! `exp(-thickness / cos)` on each way, as in pbrt-v4's `LayeredBxDF`, where it is so whatever the
//! medium's albedo.

use super::fresnel;
use super::microfacet::{SMOOTH_ALPHA, TrowbridgeReitz};
use super::roughness::resolved;
use crate::scene::is_smooth;
use crate::simd::{Lanes, Mask, Vec3, math};

/// Degree of the polynomial of [`transmittance`].
const DEGREE: usize = 5;

/// Numbers of twelve bits: those of the polynomial are in `[LOW, LOW + RANGE]`.
const STEPS: f32 = 4095.0;
const LOW: f32 = -1.0;
const RANGE: f32 = 4.0;

/// Cosines that [`Interface::of`] fits, visible normals for each, and directions from below.
const FITTED: usize = 48;
const NORMALS: usize = 1 << 10;
const BELOW: usize = 1 << 16;

/// A layer of dielectric over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatLayer {
    /// Trowbridge-Reitz alphas of its interface, 0 to 1e3; [`CoatLayer::is_smooth`].
    pub alphas: [f32; 2],
    /// Inside over outside, positive.
    pub eta: f32,
    /// Times the extinction, which is 1.
    pub thickness: f32,
    /// Events that a path between the layers may have; every other one is at the base.
    pub max_depth: u32,
}

impl CoatLayer {
    /// The interface reflects and refracts as a mirror does: no microfacets.
    pub fn is_smooth(&self) -> bool {
        is_smooth(self.alphas)
    }

    /// How often light may meet the base.
    pub fn visits(&self) -> u32 {
        self.max_depth.div_ceil(2)
    }
}

/// What a scene's loading knows of a coated conductor.
#[derive(Clone, Copy, Debug)]
pub struct Layers {
    /// Relative to the coat.
    pub eta: [f32; 3],
    /// Extinction, relative to the coat, RGB.
    pub k: [f32; 3],
    /// Index of refraction of the coat, inside over outside.
    pub coat_eta: f32,
    /// `None` if smooth.
    pub coat: Option<[f32; 2]>,
    /// Trowbridge-Reitz alphas of the conductor.
    pub conductor: [f32; 2],
    /// Of the coat, times its extinction.
    pub thickness: f32,
    /// How often light may meet the conductor.
    pub bounces: u32,
}

/// A rough interface, seen from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// The six coefficients of the transmittance over `scale`, two in a float ([`transmittance`]).
    pub packed: [f32; 3],
    /// Largest transmittance of the fitted ones.
    pub scale: f32,
    /// Share of what a Lambertian base sends up that comes back down to it, what the coat absorbs
    /// left out.
    pub internal: f32,
}

/// Points that fill the unit cube evenly (Roberts 2018, "The unreasonable effectiveness of
/// quasirandom sequences").
pub fn evenly(i: usize) -> [f32; 3] {
    const STEP: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ];
    STEP.map(|s| ((i as f64 + 0.5) * s).fract() as f32)
        .map(|x| x.min(1.0 - f32::EPSILON))
}

/// A direction with a cosine, and an azimuth in turns.
pub fn direction(cos: f32, turns: f32) -> Vec3<f32> {
    let r = (1.0 - cos * cos).max(0.0).sqrt();
    let (s, c) = math::sin_cos_turns(turns);
    Vec3::new(r * c, r * s, cos)
}

/// A visible normal sampled from `w` and what scattering at it does: `[reflected, transmitted]`
/// cosines against the surface, each with its weight; 0 if there is none. `eta` is the index of the
/// far side over that of the near one.
fn scatter(
    distribution: &TrowbridgeReitz<f32>,
    w: Vec3<f32>,
    eta: f32,
    [u, v]: [f32; 2],
) -> [(f32, f32); 2] {
    let h = distribution.sample_normal(w, u, v);
    let cos = w.dot(h).clamp(0.0, 1.0);
    let boundary = fresnel::dielectric(cos, eta);
    let up = h.mul_add(2.0 * cos, -w);
    let down = -h.mul_add(cos / eta - boundary.cos_t, w * (-1.0 / eta));
    let lw = distribution.stretch(w);
    // Sampled by one masking, seen by both (Heitz 2018, equation 19, with correlated heights).
    let unmasked = |i: Vec3<f32>, share: f32| {
        if i.z <= 0.0 || share <= 0.0 {
            return (1.0, 0.0);
        }
        let z = i.z.min(1.0);
        let li = distribution.stretch(i);
        (z, share * z * (w.z + lw) / (w.z * li + z * lw))
    };
    let r = boundary.reflectance;
    [unmasked(up, r), unmasked(down, 1.0 - r)]
}

impl Interface {
    /// That of a coat.
    pub fn of_layer(coat: &CoatLayer) -> Self {
        match coat.is_smooth() {
            true => Self::smooth(coat.eta, coat.thickness),
            false => Self::of(coat.alphas.map(resolved), coat.eta, coat.thickness),
        }
    }

    /// Of the alphas, the index (inside over outside) and the thickness of a coat.
    pub fn of([ax, ay]: [f32; 2], eta: f32, thickness: f32) -> Self {
        let distribution = TrowbridgeReitz { ax, ay };
        let through = |cos: f32| (-thickness / cos.max(1e-6)).exp();
        let mut samples = Vec::with_capacity(FITTED);
        for i in 0..FITTED {
            let root = (i as f32 + 0.5) / FITTED as f32;
            let mu = root * root;
            let sum: f64 = (0..NORMALS)
                .map(|j| {
                    let [u, v, turns] = evenly(j);
                    let [_, (cos, weight)] =
                        scatter(&distribution, direction(mu, turns), eta, [u, v]);
                    f64::from(weight * through(cos))
                })
                .sum();
            samples.push((mu, sum / NORMALS as f64));
        }
        let scale = samples.iter().fold(1e-30, |most: f64, s| most.max(s.1));
        let internal: f64 = (0..BELOW)
            .map(|j| {
                let [u, v, turns] = evenly(j);
                // Lambertian: squares of cosines are uniform.
                let mu = ((j as f32 + 0.5) / BELOW as f32).sqrt();
                let [(cos, weight), _] =
                    scatter(&distribution, direction(mu, turns), 1.0 / eta, [u, v]);
                f64::from(through(mu) * weight * through(cos))
            })
            .sum();
        Self {
            packed: fit(&samples, eta, scale),
            scale: scale as f32,
            internal: (internal / BELOW as f64).clamp(0.0, 1.0) as f32,
        }
    }
}

impl Interface {
    /// Between `a` and `b`, `t` of the way.
    pub fn between(a: &Self, b: &Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| (b - a).mul_add(t, a);
        let scale = a.scale.max(b.scale);
        let (x, y) = (a.coefficients(), b.coefficients());
        Self {
            packed: pack(std::array::from_fn(|i| mix(x[i], y[i]) / scale)),
            scale,
            internal: mix(a.internal, b.internal),
        }
    }

    /// Those of the transmittance.
    fn coefficients(&self) -> [f32; DEGREE + 1] {
        std::array::from_fn(|i| {
            let pair = self.packed[i / 2];
            let first = (pair / 4096.0).floor();
            let steps = if i % 2 == 0 {
                first
            } else {
                pair - 4096.0 * first
            };
            (LOW + steps * (RANGE / STEPS)) * self.scale
        })
    }

    /// Of a smooth coat, whose transmittance is known ([`smooth_transmittance`]).
    pub fn smooth(eta: f32, thickness: f32) -> Self {
        let strata = 1 << 14;
        let sum: f64 = (0..strata)
            .map(|i| {
                let mu = ((i as f32 + 0.5) / strata as f32).sqrt();
                let r = fresnel::dielectric(mu, 1.0 / eta).reflectance;
                f64::from(r * (-2.0 * thickness / mu).exp())
            })
            .sum();
        Self {
            packed: [0.0; 3],
            scale: 1.0,
            internal: (sum / f64::from(strata)) as f32,
        }
    }
}

/// `sum x^k` for `k < count`, what a base sees of light that meets it `count` times with a share of
/// `x` in between.
pub fn bounces(x: f32, count: u32) -> f32 {
    let (x, n) = (f64::from(x), f64::from(count));
    if x >= 1.0 {
        return n as f32;
    }
    ((1.0 - x.powf(n)) / (1.0 - x)) as f32
}

/// Least squares, by their normal equations: the basis is well conditioned. Grazing directions
/// count less, as little light comes from there.
fn fit(samples: &[(f32, f64)], eta: f32, scale: f64) -> [f32; 3] {
    const N: usize = DEGREE + 1;
    let mut m = [[0.0f64; N + 1]; N];
    for &(mu, value) in samples {
        let weight = f64::from(mu / 0.05).min(1.0).powi(2);
        let basis = basis(variable(mu, eta));
        for (i, row) in m.iter_mut().enumerate() {
            for (j, cell) in row[..N].iter_mut().enumerate() {
                *cell += weight * f64::from(basis[i] * basis[j]);
            }
            row[N] += weight * f64::from(basis[i]) * value / scale;
        }
    }
    // Of directions that nothing comes through the basis may have too few: it stays solvable.
    (0..N).for_each(|i| m[i][i] += 1e-9);
    for i in 0..N {
        for j in 0..N {
            if j != i {
                let ratio = m[j][i] / m[i][i];
                for k in i..=N {
                    m[j][k] -= ratio * m[i][k];
                }
            }
        }
    }
    pack(std::array::from_fn(|i| (m[i][N] / m[i][i]) as f32))
}

fn pack(coefficients: [f32; DEGREE + 1]) -> [f32; 3] {
    let quantised = |i: usize| {
        let x = coefficients[i];
        (((x - LOW) / RANGE * STEPS).clamp(0.0, STEPS)).round()
    };
    std::array::from_fn(|i| quantised(2 * i) * 4096.0 + quantised(2 * i + 1))
}

/// What the polynomial is of: the square root of the cosine; of the refracted one if the coat is
/// the thinner medium, and directions beyond the critical angle see nothing of the base.
#[inline(always)]
fn variable<L: Lanes>(mu: L, eta: L) -> L {
    let sin2 = (L::one() - eta * eta).max(L::zero());
    let square = ((mu * mu - sin2) / (L::one() - sin2)).max(L::zero());
    square.min(L::one()).sqrt().sqrt()
}

/// Bernstein's polynomials of degree 5.
#[inline(always)]
fn basis<L: Lanes>(s: L) -> [L; DEGREE + 1] {
    let r = L::one() - s;
    let (s2, r2) = (s * s, r * r);
    let (five, ten) = (L::splat(5.0), L::splat(10.0));
    [
        r2 * r2 * r,
        five * (r2 * r2 * s),
        ten * (r2 * r * s2),
        ten * (s2 * s * r2),
        five * (s2 * s2 * r),
        s2 * s2 * s,
    ]
}

/// Transmittance of directions with the cosine `mu >= 0`, over [`Interface::scale`], of
/// coefficients packed as there.
#[inline(always)]
pub fn transmittance<L: Lanes>(packed: [L; 3], eta: L, mu: L) -> L {
    let basis = basis(variable(mu, eta));
    let step = L::splat(RANGE / STEPS);
    let mut sum = L::zero();
    for (i, pair) in packed.into_iter().enumerate() {
        let first = (pair * L::splat(1.0 / 4096.0)).floor();
        let second = first.mul_add(L::splat(-4096.0), pair);
        sum = (first.mul_add(step, L::splat(LOW))).mul_add(basis[2 * i], sum);
        sum = (second.mul_add(step, L::splat(LOW))).mul_add(basis[2 * i + 1], sum);
    }
    sum.max(L::zero())
}

/// Optical depth beyond which nothing is seen: products of two transmittances stay normal numbers.
pub const DARK: f32 = 40.0;

/// Transmittance of a smooth interface and of the way down below it.
#[inline(always)]
pub fn smooth_transmittance<L: Lanes>(mu: L, eta: L, thickness: L) -> L {
    let boundary = fresnel::dielectric(mu, eta);
    let lit = boundary.cos_t.gt(L::zero());
    let depth = thickness / L::select(lit, boundary.cos_t, L::one());
    let lit = lit.and(depth.lt(L::splat(DARK)));
    ((L::one() - boundary.reflectance) * math::exp(-depth)).or_zero(lit)
}

/// About what a coat reflects of directions with the cosine `mu` (Schlick 1994): how often it is
/// sampled.
#[inline(always)]
pub fn gloss<L: Lanes>(mu: L, eta: L) -> L {
    let ratio = (eta - L::one()) / (eta + L::one());
    let least = ratio * ratio;
    let away = (L::one() - mu).max(L::zero());
    let away2 = away * away;
    (L::one() - least).mul_add(away2 * away2 * away, least)
}

/// Share of the base among the samples of a coated surface, of the two parts' weights.
#[inline(always)]
pub fn share<L: Lanes>(base: L, coat: L) -> L {
    let sum = base + coat;
    let some = sum.gt(L::zero());
    (base / L::select(some, sum, L::one())).or_zero(some.and(base.gt(L::zero())))
}

/// Paths between the layers that [`walk`] follows.
pub const PATHS: u32 = 1 << 13;

/// What a walk between a coat and a conductor says of the light that leaves again, of light from
/// all sides as from a white sky.
#[derive(Clone, Debug)]
pub struct Walk {
    /// The part of the first of `each` that comes from the steeper half of the sky.
    pub steep: f32,
    /// Albedo of what meets it more than once.
    pub later: [f32; 3],
    /// The part of it that comes from the steeper half of the sky, in the green channel.
    pub later_steep: f32,
    /// Albedos of what meets it once, twice and so on, in the green channel.
    pub each: Vec<f32>,
}

/// Whether the path is of the half that comes from steep directions: squares of cosines are evenly
/// spread.
pub fn is_steep(path: u32) -> bool {
    2 * path >= PATHS
}

/// Bounces that [`walk`] follows light for, at most: what has not left by then is little.
const LONGEST: u32 = 64;

/// Follows light between the layers.
pub fn walk(layers: &Layers) -> Walk {
    let coat = layers.coat.unwrap_or([SMOOTH_ALPHA; 2]);
    let surface = TrowbridgeReitz {
        ax: coat[0],
        ay: coat[1],
    };
    let [ax, ay] = layers.conductor;
    let metal = TrowbridgeReitz { ax, ay };
    let colour = |cos: f32| {
        let [eta, k] = [layers.eta, layers.k].map(|c| Vec3::new(c[0], c[1], c[2]));
        fresnel::conductor(cos, eta, k)
    };
    let way = |w: Vec3<f32>| (-layers.thickness / w.z).exp();
    let bounce = |d: &TrowbridgeReitz<f32>, w: Vec3<f32>, [u, v]: [f32; 2]| {
        let h = d.sample_normal(w, u, v);
        let cos = w.dot(h).clamp(0.0, 1.0);
        (h, cos)
    };
    let mut sum = [0.0f64; 3];
    let mut each = vec![0.0f64; layers.bounces.clamp(1, LONGEST) as usize];
    let mut steep = [0.0f64; 2];
    let mut random = Random(1);
    for i in 0..PATHS {
        let [u, v, turns] = evenly(i as usize);
        let outside = direction(((i as f32 + 0.5) / PATHS as f32).sqrt(), turns);
        let (h, cos) = bounce(&surface, outside, [u, v]);
        let boundary = fresnel::dielectric(cos, layers.coat_eta);
        let inverse = 1.0 / layers.coat_eta;
        let into = -h.mul_add(cos * inverse - boundary.cos_t, outside * -inverse);
        if into.z <= 0.0 || boundary.reflectance >= 1.0 {
            continue;
        }
        // Up, from the conductor's side.
        let mut w = Vec3::new(-into.x, -into.y, into.z).normalize();
        let masked = |d: &TrowbridgeReitz<f32>, from: Vec3<f32>, to: Vec3<f32>| {
            let (a, b) = (d.stretch(from), d.stretch(to));
            to.z * (from.z + a) / (from.z * b + to.z * a)
        };
        let mut light = Vec3::splat([1.0; 3])
            * ((1.0 - boundary.reflectance) * masked(&surface, outside, w) * way(w));
        // `w` points from the conductor to where the light came from.
        for bounces in 1..=layers.bounces.min(LONGEST) {
            let (h, cos) = bounce(&metal, w, random.pair());
            let up = h.mul_add(2.0 * cos, -w);
            if up.z <= 0.0 {
                break;
            }
            light = light.mul_elem(colour(cos)) * (masked(&metal, w, up) * way(up));
            // Seen from below the coat is the surface that light comes up to: its far side is the
            // outside.
            let (h, cos) = bounce(&surface, up, random.pair());
            let boundary = fresnel::dielectric(cos, inverse);
            let eta = layers.coat_eta;
            let leaving = -h.mul_add(cos * eta - boundary.cos_t, up * -eta);
            if leaving.z > 0.0 && boundary.reflectance < 1.0 {
                let share = (1.0 - boundary.reflectance) * masked(&surface, up, leaving);
                let seen = f64::from(light.y * share);
                each[bounces as usize - 1] += seen;
                if is_steep(i) {
                    steep[usize::from(bounces > 1)] += seen;
                }
                if bounces > 1 {
                    for (sum, light) in sum.iter_mut().zip([light.x, light.y, light.z]) {
                        *sum += f64::from(light * share);
                    }
                }
            }
            let down = h.mul_add(2.0 * cos, -up);
            if down.z <= 0.0 {
                break;
            }
            light = light * (boundary.reflectance * masked(&surface, up, down) * way(down));
            w = down;
            if light.x.max(light.y).max(light.z) < 1e-4 {
                break;
            }
        }
    }
    let mean = |sum: f64| (sum / f64::from(PATHS)) as f32;
    Walk {
        steep: mean(steep[0]),
        later: sum.map(mean),
        later_steep: mean(steep[1]),
        each: each.into_iter().map(mean).collect(),
    }
}

/// Random numbers of [`walk`] (splitmix64; Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }

    fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }
}
