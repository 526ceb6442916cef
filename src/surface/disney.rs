//! The BSDF of pbrt-v3's `disney` material (Burley 2012, "Physically Based Shading at Disney";
//! Burley 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering"): a sum
//! of lobes that are not weighed against each other.
//!
//! Directions are sampled by five of them: a cosine for all diffuse ones together, visible normals
//! for the metallic or dielectric one, the clearcoat's own distribution of normals, visible normals
//! for what is refracted, and a cosine for what a thin sheet lets through. How often each is chosen
//! depends on the row alone, so that the density of the way back is that of the directions
//! swapped. The density is that of all five, whichever was chosen.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::{cosine_sample, opposite, same_side};
use super::disney_row::Parts;
use super::fresnel;
use super::microfacet::{TrowbridgeReitz, upper};
use super::rough_dielectric::{GRAZING, bent};
use crate::simd::{Lanes, Mask, Vec3, math};
use std::f32::consts::{FRAC_1_PI, PI};

/// Of a solid body. The row is that of [`disney_row`](super::disney_row).
pub struct Disney;

/// Of a thin sheet; the same row.
pub struct DisneyThin;

/// Reflectance of the clearcoat at normal incidence.
const COAT_R0: f32 = 0.04;
/// Roughness of its masking.
const COAT_MASKING: f32 = 0.25;

/// `(1 - cos)^5` of `1 - cos`.
#[inline(always)]
fn schlick<L: Lanes>(away: L) -> L {
    let away = away.max(L::zero()).min(L::one());
    let away2 = away * away;
    away2 * away2 * away
}

#[inline(always)]
fn mix<L: Lanes>(t: L, a: L, b: L) -> L {
    (L::one() - t) * a + t * b
}

/// Smith's masking over twice the cosine, of Trowbridge and Reitz's distribution.
#[inline(always)]
fn coat_masking<L: Lanes>(z: L) -> L {
    let alpha2 = L::splat(COAT_MASKING * COAT_MASKING);
    L::one() / (z + (alpha2 + z * z * (L::one() - alpha2)).sqrt())
}

/// Density of the clearcoat's normals (Burley 2012, appendix B.2), whose projection integrates
/// to 1.
#[inline(always)]
fn coat_normals<L: Lanes>(alpha: L, h: Vec3<L>) -> L {
    let alpha2 = alpha * alpha;
    let sin2 = h.x.mul_add(h.x, h.y * h.y);
    let s = sin2 + alpha2 * (h.z * h.z);
    (L::one() - alpha2) / (-math::ln(alpha2) * L::splat(PI) * s)
}

/// A normal of the clearcoat.
#[inline(always)]
fn sample_coat<L: Lanes>(alpha: L, u: [L; 3]) -> Vec3<L> {
    let alpha2 = alpha * alpha;
    let power = math::exp((L::one() - u[0]) * math::ln(alpha2));
    let sin2 = ((power - alpha2) / (L::one() - alpha2))
        .max(L::zero())
        .min(L::one());
    let (sin, cos) = math::sin_cos_turns(u[1]);
    let r = sin2.sqrt();
    Vec3::new(r * cos, r * sin, (L::one() - sin2).sqrt())
}

/// Lobes by which directions are sampled.
const LOBES: usize = 5;

struct Model<L> {
    of: Parts<L>,
    thin: bool,
    /// Of the light that is reflected at the surface.
    distribution: TrowbridgeReitz<L>,
    /// Of that which is refracted.
    refracting: TrowbridgeReitz<L>,
    /// How often each lobe is chosen: diffuse, reflecting, clearcoat, refracting, thin diffuse.
    shares: [L; LOBES],
}

/// A value and the densities of both directions.
struct Value<L: Lanes> {
    f: Vec3<L>,
    pdf: L,
    pdf_reverse: L,
}

impl<L: Lanes> Model<L> {
    #[inline(always)]
    fn new(row: &[L; 8], thin: bool) -> Self {
        let of = Parts::of(row);
        let aspect = (L::one() - of.anisotropic * L::splat(0.9)).sqrt();
        let distribution = |rough: L| {
            let least = L::splat(1e-3);
            TrowbridgeReitz {
                ax: (rough * rough / aspect).max(least),
                ay: (rough * rough * aspect).max(least),
            }
        };
        let scaled = (of.eta * L::splat(0.65) - L::splat(0.35)) * of.roughness;
        let refracting = if thin { scaled } else { of.roughness };
        let brightest = of.colour.x.max(of.colour.y).max(of.colour.z);
        let reflected = match thin {
            true => L::one() - of.through,
            false => L::one(),
        };
        let (r0, dw) = (of.r0(), of.diffuse());
        let chances = [
            dw * (brightest * reflected + of.sheen * L::splat(0.2)),
            mix(of.metallic, r0, brightest) + L::splat(0.1),
            of.clearcoat.min(L::one()) * L::splat(0.1),
            of.transmission * brightest.sqrt(),
            if thin {
                of.through * brightest
            } else {
                L::zero()
            },
        ];
        let sum = chances[0] + chances[1] + chances[2] + chances[3] + chances[4];
        Self {
            thin,
            distribution: distribution(of.roughness),
            refracting: distribution(refracting),
            shares: chances.map(|chance| chance / sum),
            of,
        }
    }

    /// Lobes of reflection, of directions on whatever side, as pbrt-v3 evaluates them.
    #[inline(always)]
    fn reflect(&self, o: Vec3<L>, i: Vec3<L>) -> Value<L> {
        let of = &self.of;
        let (one, half) = (L::one(), L::splat(0.5));
        let sum = o + i;
        let length = sum.length2().sqrt();
        let h = sum.normalize();
        let cos = (length * half).min(one);
        let (zo, zi) = (o.z.abs(), i.z.abs());
        let (so, si) = (schlick(one - zo), schlick(one - zi));
        // 1 - cos as the directions' distance tells it: the difference itself would cancel.
        let away = schlick((o - i).length2() * L::splat(0.25) / (one + cos));

        // Diffuse lobes.
        let mut diffuse = (one - so * half) * (one - si * half);
        if self.thin {
            // As if light came out elsewhere (Hanrahan and Krueger).
            let flat = cos * cos * of.roughness;
            let fss = mix(so, one, flat) * mix(si, one, flat);
            let depth = one / (zo + zi).max(L::splat(GRAZING));
            let ss = L::splat(1.25) * fss.mul_add(depth - half, half);
            diffuse = (one - of.through) * mix(of.flatness, diffuse, ss);
        }
        let rr = L::splat(2.0) * of.roughness * cos * cos;
        let retro = rr * (so + si + so * si * (rr - one));
        let dw = of.diffuse();
        let base = of.colour * (dw * L::splat(FRAC_1_PI) * (diffuse + retro));
        let sheen = of.tinted(of.sheen_tint) * (dw * of.sheen * away);

        // Metal and dielectric. From inside pbrt-v3 has Schlick's term at its largest.
        let d = self.distribution.d(h);
        let (lo, li) = (self.distribution.stretch(o), self.distribution.stretch(i));
        let outside = sum.z.ge(L::zero());
        let eta = L::select(outside, of.eta, one / of.eta);
        let dielectric = fresnel::dielectric(cos, eta).reflectance;
        let weight = L::select(outside, away, one);
        let tinted = of.tinted(of.specular_tint) * of.r0();
        let share = |c: L, tinted: L| {
            let r0 = mix(of.metallic, tinted, c);
            mix(of.metallic, dielectric, mix(weight, r0, one))
        };
        let c = of.colour;
        let share = Vec3::new(
            share(c.x, tinted.x),
            share(c.y, tinted.y),
            share(c.z, tinted.z),
        );
        let specular = share * (d / ((zo + lo) * (zi + li)));

        // Clearcoat.
        let dc = coat_normals(of.coat_alpha, h);
        let fc = mix(away, L::splat(COAT_R0), one);
        let coat = coat_masking(zo) * coat_masking(zi) * fc * dc * (of.clearcoat * L::splat(0.25));

        let some = length.gt(L::zero());
        let of_coat = dc * h.z.abs() * L::splat(0.25) / cos.max(L::splat(GRAZING));
        let density = |zo: L, lo: L, zi: L| {
            let [diffuse, specular, coat, ..] = self.shares;
            let of_specular = d * half / (zo + lo);
            diffuse * zi * L::splat(FRAC_1_PI) + specular * of_specular + coat * of_coat
        };
        Value {
            f: (base + sheen + specular + Vec3::splat([1.0; 3]) * coat).or_zero(some),
            pdf: density(zo, lo, zi).or_zero(some),
            pdf_reverse: density(zi, li, zo).or_zero(some),
        }
    }

    /// Lobes of transmission; `o.z >= 0 >= i.z`, and the indices on their sides.
    #[inline(always)]
    fn transmit(&self, (o, no): (Vec3<L>, L), (i, ni): (Vec3<L>, L), mode: Mode) -> Value<L> {
        let of = &self.of;
        let (common, passes) = bent(&self.refracting, (o, no), (i, ni));
        let (lo, li) = (self.refracting.stretch(o), self.refracting.stretch(i));
        let (zo, zi) = (o.z, i.z.abs());
        let masking = if self.thin {
            L::one() / zo.mul_add(li, zi * lo).max(L::splat(GRAZING))
        } else {
            // pbrt-v3 masks both directions by themselves.
            L::splat(2.0) / ((zo + lo) * (zi + li))
        };
        let beyond = match mode {
            Mode::Radiance => no * no,
            Mode::Importance => ni * ni,
        };
        let c = of.colour;
        let root = Vec3::new(c.x.sqrt(), c.y.sqrt(), c.z.sqrt());
        let mut f = root * (of.transmission * common * passes * masking * beyond);
        let inv_pi = L::splat(FRAC_1_PI);
        let [.., refracting, through] = self.shares;
        if self.thin {
            f = f + c * (of.through * inv_pi);
        }
        Value {
            f,
            pdf: refracting * common * ni * ni / (zo + lo) + through * zi * inv_pi,
            pdf_reverse: refracting * common * no * no / (zi + li) + through * zo * inv_pi,
        }
    }

    #[inline(always)]
    fn indices(&self, wo: Vec3<L>) -> (L, L) {
        let outside = wo.z.gt(L::zero());
        (
            L::select(outside, L::one(), self.of.eta),
            L::select(outside, self.of.eta, L::one()),
        )
    }

    #[inline(always)]
    fn eval(&self, wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        let (reflects, refracts) = (same_side(wo, wi), opposite(wo, wi));
        let (o, sign) = upper(wo);
        let i = Vec3::new(wi.x, wi.y, wi.z * sign);
        let (no, ni) = self.indices(wo);
        let r = self.reflect(wo, wi);
        let t = self.transmit((o, no), (i, ni), mode);
        let some = reflects.or(refracts);
        BsdfValue {
            f: Vec3::select(reflects, r.f, t.f).or_zero(some),
            pdf: L::select(reflects, r.pdf, t.pdf).or_zero(some),
            pdf_reverse: L::select(reflects, r.pdf_reverse, t.pdf_reverse).or_zero(some),
        }
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let (o, sign) = upper(wo);
        let (no, ni) = self.indices(wo);
        let mut below = [L::zero(); LOBES];
        let mut sum = L::zero();
        for (below, share) in below.iter_mut().zip(self.shares) {
            sum += share;
            *below = sum;
        }
        let diffuse = u[2].lt(below[0]);
        let reflecting = u[2].lt(below[1]).and_not(diffuse);
        let coated = u[2].lt(below[2]).and_not(u[2].lt(below[1]));
        let through = below[3].le(u[2]).and(self.shares[4].gt(L::zero()));
        let cosine = diffuse.or(through);
        let refracting = cosine.or(reflecting).or(coated).not();

        let normals = TrowbridgeReitz {
            ax: L::select(refracting, self.refracting.ax, self.distribution.ax),
            ay: L::select(refracting, self.refracting.ay, self.distribution.ay),
        };
        let h = Vec3::select(
            coated,
            sample_coat(self.of.coat_alpha, u),
            normals.sample_normal(o, u[0], u[1]),
        );
        let cos = o.dot(h).max(L::zero()).min(L::one());
        let reflected = h.mul_add(L::splat(2.0) * o.dot(h), -o);
        let eta = ni / no;
        let inv_eta = L::one() / eta;
        let boundary = fresnel::dielectric(cos, eta);
        let refracted = h.mul_add(cos * inv_eta - boundary.cos_t, o * -inv_eta);
        let around = cosine_sample(o, u).0;
        let around = Vec3::new(around.x, around.y, L::select(through, -around.z, around.z));
        let i = Vec3::select(refracting, refracted, reflected);
        let i = Vec3::select(cosine, around, i.normalize());
        let wi = Vec3::new(i.x, i.y, i.z * sign);
        let value = self.eval(wo, wi, mode);
        // A direction that has ended on the other side of the surface than its lobe is none of that
        // lobe.
        let crosses = refracting.or(through);
        let side = L::select(crosses, -i.z, i.z);
        let whole = boundary.cos_t.gt(L::zero()).or(refracting.not());
        let valid = side.gt(L::zero()).and(whole).and(value.pdf.gt(L::zero()));
        BsdfSample {
            wi,
            throughput: (value.f * (wi.z.abs() / value.pdf)).or_zero(valid),
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
        }
    }

    /// Of directions on different sides the lobes of reflection, on one side those of transmission:
    /// only that which goes straight on is known there.
    #[inline(always)]
    fn across(&self, wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let reflected = self.reflect(wo, wi).f;
        let through = match self.thin {
            true => self.of.through * L::splat(FRAC_1_PI),
            false => L::zero(),
        };
        Vec3::select(opposite(wo, wi), reflected, self.of.colour * through)
    }
}

/// Both are one model.
macro_rules! disney {
    ($kernel:ident, $name:literal, $thin:literal) => {
        impl Bsdf for $kernel {
            const NAME: &'static str = $name;
            const DELTA: bool = false;
            const LOBES: bool = true;
            const ACROSS: bool = true;

            #[inline(always)]
            fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
                Model::new(row, $thin).sample(wo, u, mode)
            }

            #[inline(always)]
            fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
                Model::new(row, $thin).eval(wo, wi, mode)
            }

            #[inline(always)]
            fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
                Model::new(row, $thin).across(wo, wi)
            }
        }
    };
}

disney!(Disney, "disney", false);
disney!(DisneyThin, "thin disney", true);
