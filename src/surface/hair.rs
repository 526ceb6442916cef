//! Hair: light that crosses a rough dielectric cylinder, filled with pigment and covered with
//! scales (Chiang, Bitterli, Tappan and Burley 2016, "A Practical and Controllable Hair and Fur
//! Model for Production Path Tracing"; d'Eon, Francois, Hill, Letteri and Aubry 2011, "An
//! Energy-Conserving Hair Reflectance Model"; pbrt-v3's `HairBSDF`).
//!
//! A fibre lies along `x`, and scatters as a whole: what a direction gets is
//!
//! ```text
//! f(wo, wi) |cos wi| = sum_p M_p(theta_o, theta_i) A_p(theta_o, h) N_p(phi_i - phi_o, h)
//! ```
//!
//! over `p` passages inside, 0, 1, 2, and all more of them together. `h`, from -1 to 1, is where
//! across the fibre it is met. Neither side nor normal of a surface counts.
//!
//! - `f` is not symmetric: attenuation `A` and the tilt of scales are those of the side that the
//!   camera is on, and seen from the light the fibre is met at `-h`. So with
//!   [`Mode::Importance`] the directions change places, and densities of either walk are those of
//!   `S` from where it comes, at its own `h`.
//! - `M` in closed form is `exp(-((cos_i - cos_o)^2 + (sin_i + sin_o)^2) / 2v)` over a factor that
//!   is near 1: exponents do not cancel, however smooth the fibre is.
//! - Three primary samples suffice: what the choice of `p` leaves of the third is the azimuth.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fresnel;
use crate::simd::{Lanes, Mask, Vec3, math};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// Row: absorption per radius (3), `h`, index of refraction, variance of the longitudinal lobe of
/// `p = 0`, scale of the azimuthal logistic distribution, sine of the scales' tilt.
pub struct Hair;

/// Terms: 0, 1, 2 passages, and more.
const TERMS: usize = 4;

/// Square roots of, and divisors that, rounding may leave at 0 or below.
const TINY: f32 = 1e-12;

fn positive_root<L: Lanes>(x: L) -> L {
    x.max(L::zero()).sqrt()
}

/// `exp(-x) I_0(x)`, `x >= 0`; relative error below 3e-7 (Abramowitz and Stegun 1964, 9.8.1 and
/// 9.8.2).
#[inline(always)]
fn scaled_bessel<L: Lanes>(x: L) -> L {
    let all = L::splat;
    let t = x * all(1.0 / 3.75);
    let s = t * t;
    let near = all(0.004_581_3)
        .mul_add(s, all(0.036_076_8))
        .mul_add(s, all(0.265_973_2))
        .mul_add(s, all(1.206_749_2))
        .mul_add(s, all(3.089_942_4))
        .mul_add(s, all(3.515_622_9))
        .mul_add(s, L::one());
    let r = L::one() / t.max(L::one());
    let far = all(0.003_923_77)
        .mul_add(r, all(-0.016_476_33))
        .mul_add(r, all(0.026_355_37))
        .mul_add(r, all(-0.020_577_06))
        .mul_add(r, all(0.009_162_81))
        .mul_add(r, all(-0.001_575_65))
        .mul_add(r, all(0.002_253_19))
        .mul_add(r, all(0.013_285_92))
        .mul_add(r, all(0.398_942_3));
    let close = t.lt(L::one());
    let near = near * math::exp(-x);
    L::select(close, near, far / x.max(L::one()).sqrt())
}

/// `M`: density over `sin theta_i`, of sines and cosines of the angles towards the fibre's normal
/// plane.
#[inline(always)]
fn longitudinal<L: Lanes>([sin_o, cos_o]: [L; 2], [sin_i, cos_i]: [L; 2], v: L) -> L {
    let (c, s) = (cos_i - cos_o, sin_i + sin_o);
    let apart = c.mul_add(c, s * s);
    let inverse = L::one() / v;
    let lobe = math::exp(apart * inverse * L::splat(-0.5));
    let whole = v * (L::one() - math::exp(inverse * L::splat(-2.0)));
    lobe * scaled_bessel(cos_i * cos_o * inverse) / whole
}

/// Logistic distribution of angles within half a turn of 0.
#[derive(Clone, Copy)]
struct Logistic<L> {
    scale: L,
    /// Its share below half a turn back, if it were not cut off.
    below: L,
    /// That between.
    within: L,
}

impl<L: Lanes> Logistic<L> {
    #[inline(always)]
    fn new(scale: L) -> Self {
        let end = math::exp(L::splat(-PI) / scale);
        let below = end / (L::one() + end);
        let within = (L::one() - end) / (L::one() + end);
        Self {
            scale,
            below,
            within,
        }
    }

    #[inline(always)]
    fn density(&self, x: L) -> L {
        let e = math::exp(-(x.abs() / self.scale));
        let one = L::one() + e;
        e / (self.scale * one * one * self.within)
    }

    #[inline(always)]
    fn sample(&self, u: L) -> L {
        let tiny = L::splat(1e-30);
        let below = u.mul_add(self.within, self.below).max(tiny);
        let above = (L::one() - u).mul_add(self.within, self.below).max(tiny);
        let x = self.scale * (math::ln(below) - math::ln(above));
        x.max(L::splat(-PI)).min(L::splat(PI))
    }
}

/// What a fibre does to light along one direction, that of the walk.
struct Passages<L: Lanes> {
    /// `A`, a term each.
    attenuation: [Vec3<L>; TERMS],
    /// Shares of the terms among samples.
    share: [L; TERMS],
    /// Sine and cosine of the angle to the normal plane, tilted by the scales, for each term.
    tilted: [[L; 2]; TERMS],
    /// Azimuth from the direction to the middle of the lobe, of the first three terms.
    turn: [L; TERMS - 1],
    logistic: Logistic<L>,
    variance: [L; TERMS],
}

/// Sine and cosine of the angle of a direction to the normal plane.
#[inline(always)]
fn inclination<L: Lanes>(w: Vec3<L>) -> [L; 2] {
    let sin = w.x.max(L::splat(-1.0)).min(L::one());
    [sin, w.y.mul_add(w.y, w.z * w.z).sqrt()]
}

/// `sin(a + b)` and `cos(a + b)`; cosines that leave the range are turned back into it, as in
/// pbrt.
#[inline(always)]
fn rotated<L: Lanes>([sin_a, cos_a]: [L; 2], [sin_b, cos_b]: [L; 2]) -> [L; 2] {
    [
        sin_a.mul_add(cos_b, cos_a * sin_b),
        cos_a.mul_add(cos_b, -(sin_a * sin_b)).abs(),
    ]
}

#[inline(always)]
fn doubled<L: Lanes>([sin, cos]: [L; 2]) -> [L; 2] {
    [L::splat(2.0) * sin * cos, cos.mul_add(cos, -(sin * sin))]
}

impl<L: Lanes> Passages<L> {
    /// Of light along `o`, which meets the fibre at `h`.
    #[inline(always)]
    fn new(row: &[L; 8], o: Vec3<L>, h: L) -> Self {
        let one = L::one();
        let eta = row[4];
        let [sin_o, cos_o] = inclination(o);
        let sin_t = sin_o / eta;
        let cos_t = positive_root(one - sin_t * sin_t).max(L::splat(1e-6));
        let bent = eta
            .mul_add(eta, -(sin_o * sin_o))
            .max(L::splat(TINY))
            .sqrt();
        let sin_gamma_t = (h * cos_o / bent).max(-one).min(one);
        let cos_gamma_t = positive_root(one - sin_gamma_t * sin_gamma_t);
        let cos_gamma_o = positive_root(one - h * h);
        let way = L::splat(-2.0) * cos_gamma_t / cos_t;
        let t = Vec3::new(row[0], row[1], row[2]) * way;
        let t = Vec3::new(math::exp(t.x), math::exp(t.y), math::exp(t.z));
        let f = fresnel::dielectric((cos_o * cos_gamma_o).min(one), eta).reflectance;
        let white = Vec3::splat([1.0; 3]);
        let through = t * ((one - f) * (one - f));
        let again = (t * f).mul_elem(through);
        let rest = |t: L, again: L| again * f * t / (one - t * f).max(L::splat(TINY));
        let more = Vec3::new(rest(t.x, again.x), rest(t.y, again.y), rest(t.z, again.z));
        let attenuation = [white * f, through, again, more];
        let sums = attenuation.map(|a| a.x + a.y + a.z);
        let all = (sums[0] + sums[1] + sums[2] + sums[3]).max(L::splat(TINY));
        let gamma_o = math::atan2(h, cos_gamma_o);
        let gamma_t = math::atan2(sin_gamma_t, cos_gamma_t);
        let turn = [0.0, 1.0, 2.0].map(|p: f32| {
            let inside = L::splat(2.0 * p).mul_add(gamma_t, L::splat(p * PI));
            L::splat(-2.0).mul_add(gamma_o, inside)
        });
        let once = [row[7], positive_root(one - row[7] * row[7])];
        let twice = doubled(once);
        let four = doubled(twice);
        let here = [sin_o, cos_o];
        let v = row[5];
        Self {
            attenuation,
            share: sums.map(|s| s / all),
            tilted: [
                rotated(here, [-twice[0], twice[1]]),
                rotated(here, once),
                rotated(here, four),
                here,
            ],
            turn,
            logistic: Logistic::new(row[6]),
            variance: [v, v * L::splat(0.25), v * L::splat(4.0), v * L::splat(4.0)],
        }
    }

    /// `f |cos|` and the density of samples for the direction `i` of a walk that comes along `o`.
    #[inline(always)]
    fn towards(&self, o: Vec3<L>, i: Vec3<L>) -> (Vec3<L>, L) {
        let across = o.y.mul_add(i.z, -(o.z * i.y));
        let along = o.y.mul_add(i.y, o.z * i.z);
        let phi = math::atan2(across, along);
        let inclined = inclination(i);
        let mut value = Vec3::zero();
        let mut pdf = L::zero();
        for p in 0..TERMS {
            let m = longitudinal(self.tilted[p], inclined, self.variance[p]);
            let n = match self.turn.get(p) {
                Some(turn) => {
                    let off = (phi - *turn) * L::splat(0.5 * FRAC_1_PI);
                    let off = off - (off + L::splat(0.5)).floor();
                    self.logistic.density(off * L::splat(TAU))
                }
                None => L::splat(0.5 * FRAC_1_PI),
            };
            value = self.attenuation[p].mul_add(m * n, value);
            pdf = self.share[p].mul_add(m * n, pdf);
        }
        (value, pdf)
    }

    /// A direction.
    #[inline(always)]
    fn sample(&self, o: Vec3<L>, u: [L; 3]) -> Vec3<L> {
        let one = L::one();
        // The term, and where in its interval the sample lies.
        let last = TERMS - 1;
        let mut start = L::zero();
        let mut chosen = [L::zero(); 2];
        let (mut tilted, mut variance) = (self.tilted[last], self.variance[last]);
        let mut found = L::Mask::splat(false);
        let mut lobe = found;
        for p in 0..last {
            let end = start + self.share[p];
            let here = u[2].lt(end).and_not(found);
            let rest = (u[2] - start) / self.share[p].max(L::splat(TINY));
            chosen = [
                L::select(here, self.turn[p], chosen[0]),
                L::select(here, rest, chosen[1]),
            ];
            tilted = [
                L::select(here, self.tilted[p][0], tilted[0]),
                L::select(here, self.tilted[p][1], tilted[1]),
            ];
            variance = L::select(here, self.variance[p], variance);
            found = found.or(here);
            lobe = found;
            start = end;
        }
        let rest = (u[2] - start) / self.share[last].max(L::splat(TINY));
        let rest = L::select(lobe, chosen[1], rest).max(L::zero()).min(one);
        let turned = chosen[0] + self.logistic.sample(rest);
        let turn = L::select(lobe, turned * L::splat(0.5 * FRAC_1_PI), rest);

        let least = math::exp(L::splat(-2.0) / variance);
        let fall = (one - u[0]).mul_add(least, u[0]).max(L::splat(1e-30));
        // 1 - cos, without a difference of near numbers.
        let x = (-(variance * math::ln(fall)))
            .max(L::zero())
            .min(L::splat(2.0));
        let (cos, sin) = (one - x, positive_root(x * (L::splat(2.0) - x)));
        let (_, cos_phi) = math::sin_cos_turns(u[1]);
        let sin_i = (sin * cos_phi).mul_add(tilted[1], -(cos * tilted[0]));
        let sin_i = sin_i.max(-one).min(one);
        let cos_i = positive_root((one - sin_i) * (one + sin_i));

        let flat = o.y.mul_add(o.y, o.z * o.z).sqrt();
        let has = flat.gt(L::zero());
        let y = L::select(has, o.y / flat, one);
        let z = L::select(has, o.z / flat, L::zero());
        let (s, c) = math::sin_cos_turns(turn - turn.floor());
        Vec3::new(
            sin_i,
            cos_i * y.mul_add(c, -(z * s)),
            cos_i * z.mul_add(c, y * s),
        )
    }
}

/// `f |cos|` of the camera's direction, and both densities of a walk in a mode that comes along
/// `wo`.
#[inline(always)]
fn evaluate<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> (Vec3<L>, L, L) {
    let h = row[3];
    let of = |from: Vec3<L>, to: Vec3<L>, h: L| Passages::new(row, from, h).towards(from, to);
    match mode {
        Mode::Radiance => {
            let (value, pdf) = of(wo, wi, h);
            (value, pdf, of(wi, wo, -h).1)
        }
        Mode::Importance => {
            let (value, reverse) = of(wi, wo, h);
            (value, of(wo, wi, -h).1, reverse)
        }
    }
}

impl Bsdf for Hair {
    const NAME: &'static str = "hair";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const WHOLE: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let h = match mode {
            Mode::Radiance => row[3],
            Mode::Importance => -row[3],
        };
        let wi = Passages::new(row, wo, h).sample(wo, u);
        let (value, pdf, pdf_reverse) = evaluate(row, wo, wi, mode);
        let cosines = match mode {
            Mode::Radiance => L::one(),
            // The cosine that `f` lacks is the light's.
            Mode::Importance => wi.z.abs() / wo.z.abs(),
        };
        let valid = pdf.gt(L::zero()).and(wi.z.abs().gt(L::zero()));
        let weight = value * (cosines / pdf);
        let finite = (weight.x + weight.y + weight.z).is_finite();
        BsdfSample {
            wi,
            throughput: weight.or_zero(valid.and(finite)),
            pdf,
            pdf_reverse,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        let (value, pdf, pdf_reverse) = evaluate(row, wo, wi, mode);
        let light = match mode {
            Mode::Radiance => wi.z,
            Mode::Importance => wo.z,
        };
        let f = value * (L::one() / light.abs());
        let finite = (f.x + f.y + f.z).is_finite();
        BsdfValue {
            f: f.or_zero(finite),
            pdf,
            pdf_reverse,
        }
    }
}

/// Variance of the first longitudinal lobe (Chiang et al. 2016, equation 7).
fn variance(beta_m: f32) -> f32 {
    let b = beta_m;
    (0.726 * b + 0.812 * b * b + 3.7 * b.powi(20)).powi(2)
}

/// Scale of the azimuthal distribution (Chiang et al. 2016, equation 8).
fn azimuthal_scale(beta_n: f32) -> f32 {
    let b = beta_n;
    (PI / 8.0).sqrt() * (0.265 * b + 1.194 * b * b + 5.372 * b.powi(22))
}

/// The row of a fibre that is met at `h`, of parameters as scene files have them, `alpha` in
/// degrees.
pub fn row(sigma: [f32; 3], h: f32, eta: f32, [beta_m, beta_n]: [f32; 2], alpha: f32) -> [f32; 8] {
    let [r, g, b] = sigma.map(|s| s.clamp(0.0, 1e6));
    let sin = alpha.clamp(-90.0, 90.0).to_radians().sin();
    [
        r,
        g,
        b,
        h.clamp(-1.0, 1.0),
        eta.clamp(1e-3, 1e3),
        variance(beta_m),
        azimuthal_scale(beta_n),
        sin,
    ]
}
