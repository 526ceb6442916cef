//! A conductor under a dielectric coat (pbrt-v4's `coatedconductor`), in closed form.
//!
//! pbrt-v4 walks at random between the two layers (`LayeredBxDF`). Here light takes one of three
//! ways (Weidlich and Wilkie 2007, "Arbitrarily Layered Micro-Facet Surfaces", have the first two;
//! Belcour 2018, "Efficient Rendering of Layered Materials using an Atomic Decomposition with
//! Statistical Operators", the width of the second):
//!
//! 1. it is reflected by the coat;
//! 2. it is refracted into the coat, meets the conductor once, and is refracted out. Below a smooth
//!    coat that is exact: `T(wo) T(wi) / eta^2` times the conductor's BRDF of the refracted
//!    directions. A rough coat bends light at its microfacets as well, which gives the lobe another
//!    shape ([`seen_through`](super::seen_through));
//! 3. it meets the conductor more than once, the coat having reflected it down again, wholly beyond
//!    the critical angle. What leaves then has gone in many directions, in the amount that a walk
//!    between the layers gives when the scene is loaded ([`coat::walk`]). Under a smooth coat it is
//!    taken for diffuse. Under a rough one most of it comes from and leaves at grazing angles,
//!    forward: part of it is `facing`, as much as gives the steeper half of the sky its share of
//!    the walk.
//!
//! If both are smooth there is one direction, and the sum of all bounces is exact. Otherwise
//! `tests/renderer/coated.rs` says how far albedos and values are from a transcription of the
//! random walk (alphas of coat and copper 0 to 0.6, indices 1.3 to 2). Most at grazing angles,
//! where later bounces are a lobe as well.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
pub use super::coat::Layers;
use super::coated_rows::{pack_colour, pack_layer, unpack_colour, unpack_layer};
use super::diffuse::{cosine_sample, same_side};
use super::microfacet::{TrowbridgeReitz, pack_alphas, pack_halves, unpack_halves, upper};
use super::rough_dielectric::resolved_eta;
use super::seen_through::{Slopes, once};
use super::{coat, fresnel};
use crate::simd::{Lanes, Mask, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Conductor under a rough coat. Row: conductor eta and k relative to the coat, a pair per channel
/// ([`pack_halves`], 3), coat eta, alphas of the coat, alphas of the conductor, thickness, gain and
/// forward share ([`pack_layer`]), colour of later bounces ([`pack_colour`]).
pub struct Rough;

/// Rough conductor under a smooth coat, without the coat's reflection. Row: that of [`Rough`], but
/// for the thickness, which is alone.
pub struct Base;

impl Layers {
    /// Row of [`Rough`] or, if the coat is smooth, [`Base`].
    pub fn row(&self) -> [f32; 8] {
        let Calibration {
            mut row,
            walk,
            missing,
            square,
            ..
        } = self.calibrated();
        let vector = |c: [f32; 3]| Vec3::new(c[0], c[1], c[2]);
        let metal = fresnel::conductor(0.8, vector(self.eta), vector(self.k));
        let tint = metal * (1.0 / metal.y.max(1e-6));
        let later = vector(walk.later) + tint * missing;
        row[7] = pack_colour((later * (1.0 / square)).lane(0));
        row
    }

    /// Sets the lobe to what a walk between the layers says.
    pub fn calibrated(&self) -> Calibration {
        let coat = self.coat.unwrap_or([0.0; 2]);
        let pair = |c: usize| pack_halves(self.eta[c], self.k[c]);
        let mut row = [
            pair(0),
            pair(1),
            pair(2),
            self.coat_eta,
            pack_alphas(coat[0], coat[1]),
            pack_alphas(self.conductor[0], self.conductor[1]),
            self.thickness,
            0.0,
        ];
        let walk = coat::walk(self);
        let [mut missing, mut forward] = [0.0; 2];
        if let Some([ax, ay]) = self.coat {
            row[3] = resolved_eta(self.coat_eta, ax.min(ay));
            // Of steep directions the lobe has the albedo of the walk; what is missing of the
            // others has gone as far astray as later bounces.
            row[6] = pack_layer(self.thickness, 1.0, 0.0);
            let [steep, once, _] = means::<true>(&row);
            row[6] = pack_layer(self.thickness, walk.steep / steep.max(1e-6), 0.0);
            let [_, gain, _] = unpack_layer(row[6]);
            missing = (walk.each[0] - gain * once).max(0.0);
            let astray = walk.each[1..].iter().sum::<f32>() + missing;
            forward = forward_share(walk.later_steep / astray.max(1e-9));
            row[6] = pack_layer(self.thickness, gain, forward);
        }
        let transmittance = match self.coat {
            Some(_) if row[3] >= 1.0 => 1.0,
            Some(_) => means::<true>(&row)[2],
            None => means::<false>(&row)[2],
        };
        let square = (transmittance * transmittance).max(1e-12);
        Calibration {
            row,
            walk,
            missing,
            forward,
            square,
        }
    }
}

/// What [`Layers::calibrated`] finds.
pub struct Calibration {
    /// But for the colour of later bounces.
    pub row: [f32; 8],
    /// What light does between the layers on its way.
    pub walk: coat::Walk,
    /// Albedo of what meets the conductor once and is not in its lobe, in the green channel.
    pub missing: f32,
    /// How much of that and of later bounces goes forward ([`pack_layer`]).
    pub forward: f32,
    /// Square of the coat's transmittance, over which the colour of later bounces is: 1 if a rough
    /// coat lets light through at all angles, as the walk has it in that colour already.
    pub square: f32,
}

/// Means over a white sky: albedo of what meets the conductor once, in the green channel, from the
/// steeper half of the sky and from all of it, and transmittance of the coat.
fn means<const COAT: bool>(row: &[f32; 8]) -> [f32; 3] {
    let surface = TrowbridgeReitz::of_packed(row[4]);
    let [mut steep, mut once, mut through] = [0.0f64; 3];
    for i in 0..coat::PATHS {
        let [u, v, turns] = coat::evenly(i as usize);
        let mu = ((i as f32 + 0.5) / coat::PATHS as f32).sqrt();
        let o = coat::direction(mu, turns);
        let cos = if COAT {
            effective_cosine(&surface, o)
        } else {
            mu
        };
        let [thickness, ..] = layer::<f32, COAT>(row);
        let below = inside(row, o, (cos, thickness)).transmittance;
        through += f64::from(below);
        // The lobe of the conductor alone: its share of samples is divided out.
        let s = sample::<f32, COAT>(row, o, [u, v, 0.0]);
        let value = eval::<f32, COAT>(row, o, s.wi);
        if COAT && value.pdf > 0.0 && s.throughput.y > 0.0 {
            let r = surface.reflection(o, s.wi);
            let half = ((o + s.wi).length2().sqrt() * 0.5).min(1.0);
            let coat = r.brdf * fresnel::dielectric(half, row[3]).reflectance;
            let [share, ..] = shares(below, 0.0, coat::gloss(cos, row[3]));
            let lobe = (value.pdf - (1.0 - share) * r.pdf).max(1e-6 * value.pdf) / share;
            let share = f64::from((value.f.y - coat).max(0.0) * s.wi.z / lobe);
            once += share;
            steep += if coat::is_steep(i) { share } else { 0.0 };
        }
    }
    let mean = |sum: f64| (sum / f64::from(coat::PATHS)) as f32;
    [steep, once, through].map(mean)
}

/// A direction as the coat refracts it, and as much of it as gets to the conductor.
struct Inside<L: Lanes> {
    w: Vec3<L>,
    transmittance: L,
    exists: L::Mask,
}

/// Cosine of which a smooth coat lets through about what a rough one does of `w`: between its own
/// and that of a visible microfacet.
#[inline(always)]
fn effective_cosine<L: Lanes>(coat: &TrowbridgeReitz<L>, w: Vec3<L>) -> L {
    let stretch = coat.stretch(w);
    let square = (L::splat(0.75) * w.z).mul_add(w.z, L::splat(0.25) * (stretch * stretch));
    square.sqrt().min(L::one())
}

#[inline(always)]
fn inside<L: Lanes>(row: &[L; 8], w: Vec3<L>, (cos, thickness): (L, L)) -> Inside<L> {
    let inverse = L::one() / row[3];
    let (x, y) = (w.x * inverse, w.y * inverse);
    let square = L::one() - x * x - y * y;
    let exists = square.gt(L::zero());
    Inside {
        w: Vec3::new(x, y, L::select(exists, square.sqrt(), L::one())),
        transmittance: coat::smooth_transmittance(cos, row[3], thickness).or_zero(exists),
        exists,
    }
}

/// How far a microfacet's slope moves the refracted direction of one with the cosine `cos`,
/// squared; `below` is the cosine inside.
#[inline(always)]
fn shift2<L: Lanes>(cos: L, below: L, eta: L) -> L {
    let shift = below - cos / eta;
    shift * shift
}

/// What sampling takes the conductor for under a rough coat, of a direction with cosine `below`
/// inside: both refractions are taken to widen its lobe alike ([`Slopes`]).
#[inline(always)]
fn sampled<L: Lanes>(
    metal: &TrowbridgeReitz<L>,
    coat: &TrowbridgeReitz<L>,
    shift2: L,
    below: L,
) -> TrowbridgeReitz<L> {
    let part = shift2.sqrt() / (L::splat(2.0) * below);
    let widened = |metal: L, coat: L| Slopes::of([coat * part, coat * part, metal]).widest();
    TrowbridgeReitz {
        ax: widened(metal.ax, coat.ax),
        ay: widened(metal.ay, coat.ay),
    }
}

/// Thickness of the coat, gain of the lobe and forward share of later bounces.
#[inline(always)]
fn layer<L: Lanes, const COAT: bool>(row: &[L; 8]) -> [L; 3] {
    if COAT {
        unpack_layer(row[6])
    } else {
        [row[6], L::one(), L::zero()]
    }
}

/// Where the forward part of later bounces is: the fourth power of the distance of the directions
/// as seen from above. It is reciprocal, least between steep directions and those side by side, and
/// greatest between grazing ones that face each other.
#[inline(always)]
fn facing<L: Lanes>(o: Vec3<L>, i: Vec3<L>) -> L {
    let (x, y) = (o.x - i.x, o.y - i.y);
    let square = x.mul_add(x, y * y);
    L::splat(1.0 / MEAN_FACING) * square * square
}

/// Albedo of [`facing`] over pi.
#[inline(always)]
fn facing_albedo<L: Lanes>(w: Vec3<L>) -> L {
    let sin2 = w.x.mul_add(w.x, w.y * w.y);
    let sum = sin2.mul_add(sin2 + L::splat(2.0), L::splat(1.0 / 3.0));
    L::splat(1.0 / MEAN_FACING) * sum
}

/// Mean over a white sky of what [`facing_albedo`] is a multiple of.
const MEAN_FACING: f32 = 5.0 / 3.0;

/// Of [`facing`], the part that comes from the steeper half of the sky.
const STEEP_FACING: f32 = 0.275;

/// The forward share of later bounces of which a part of `steep` comes from the steeper half of
/// the sky: of an even share half does.
fn forward_share(steep: f32) -> f32 {
    ((0.5 - steep) / (0.5 - STEEP_FACING)).clamp(0.0, 1.0)
}

/// An even and a forward value, by the forward share.
#[inline(always)]
fn mixed<L: Lanes>(forward: L, value: L) -> L {
    forward.mul_add(value, L::one() - forward)
}

/// How much a direction sees of later bounces, next to the coat's transmittance: what they are
/// sampled by.
#[inline(always)]
fn astray<L: Lanes, const COAT: bool>(row: &[L; 8], w: Vec3<L>, transmittance: L) -> L {
    let later = unpack_colour(row[7]);
    let brightest = later.x.max(later.y).max(later.z);
    if COAT {
        let [.., forward] = layer::<L, COAT>(row);
        brightest * mixed(forward, facing_albedo(w)) * open(row[3], transmittance)
    } else {
        brightest * transmittance
    }
}

/// What a rough coat takes from later bounces: of one that is thinner than the outside, what it
/// takes from all. Otherwise nothing, as they come out at grazing angles too.
#[inline(always)]
fn open<L: Lanes>(eta: L, transmittance: L) -> L {
    L::select(eta.lt(L::one()), transmittance, L::one())
}

/// The parts of a coated conductor seen from one side, and their shares of its samples: conductor,
/// diffuse, coat.
#[inline(always)]
fn shares<L: Lanes>(transmittance: L, astray: L, gloss: L) -> [L; 3] {
    let parts = [transmittance, astray, gloss];
    let sum = parts[0] + parts[1] + parts[2];
    let some = sum.gt(L::zero());
    let inverse = L::one() / L::select(some, sum, L::one());
    let share = |i: usize| parts[i] * inverse;
    [L::select(some, share(0), L::one()), share(1), share(2)]
}

/// [`Rough`] or, without the coat's own reflection, [`Base`].
#[inline(always)]
fn eval<L: Lanes, const COAT: bool>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> BsdfValue<L> {
    let valid = same_side(wo, wi);
    let (o, i) = (upper(wo).0, upper(wi).0);
    let surface = TrowbridgeReitz::of_packed(row[4]);
    let cosine = |w: Vec3<L>| {
        if COAT {
            effective_cosine(&surface, w)
        } else {
            w.z
        }
    };
    let (co, ci) = (cosine(o), cosine(i));
    let [thickness, gain, forward] = layer::<L, COAT>(row);
    let (below_o, below_i) = (
        inside(row, o, (co, thickness)),
        inside(row, i, (ci, thickness)),
    );
    let (p, q) = (below_o.w, below_i.w);
    let both = below_o.exists.and(below_i.exists);

    let bare = TrowbridgeReitz::of_packed(row[5]);
    let mut metal = bare.reflection(p, q);
    if COAT {
        // Sampling knows one of the directions only.
        let (so, si) = (shift2(o.z, p.z, row[3]), shift2(i.z, q.z, row[3]));
        metal.pdf = sampled(&bare, &surface, so, p.z).reflection(p, q).pdf;
        metal.pdf_reverse = sampled(&bare, &surface, si, q.z)
            .reflection(p, q)
            .pdf_reverse;
    }
    let half_cosine =
        |a: Vec3<L>, b: Vec3<L>| ((a + b).length2().sqrt() * L::splat(0.5)).min(L::one());
    let [(ex, kx), (ey, ky), (ez, kz)] = [0, 1, 2].map(|c| {
        let [eta, k] = unpack_halves(row[c]);
        (eta, k)
    });
    let conductor = |cos: L| fresnel::conductor(cos, Vec3::new(ex, ey, ez), Vec3::new(kx, ky, kz));
    let later = unpack_colour(row[7]);
    let inv_pi = L::splat(FRAC_1_PI);
    let squeeze = L::one() / (row[3] * row[3]);
    let through = below_o.transmittance * below_i.transmittance;
    let mut f = if COAT {
        let reach = mixed(forward, facing(o, i)) * open(row[3], through);
        later * (inv_pi * reach)
    } else {
        later * (inv_pi * through)
    };
    if COAT {
        let (lobe, cos) = once(&surface, &bare, [o, i], row[3], thickness);
        f = f + conductor(cos) * (lobe * gain);
    } else {
        let lobe = (metal.brdf * squeeze).or_zero(both);
        f = f + conductor(half_cosine(p, q)) * (lobe * through);
    }

    let (gloss_o, gloss_i) = if COAT {
        (coat::gloss(co, row[3]), coat::gloss(ci, row[3]))
    } else {
        (L::zero(), L::zero())
    };
    let forth = shares(
        below_o.transmittance,
        astray::<L, COAT>(row, o, below_o.transmittance),
        gloss_o,
    );
    let back = shares(
        below_i.transmittance,
        astray::<L, COAT>(row, i, below_i.transmittance),
        gloss_i,
    );
    // The solid angle that a refracted direction's is outside.
    let spread = |outside: Vec3<L>, within: Vec3<L>| squeeze * outside.z / within.z;
    let mut pdf = forth[0] * (metal.pdf * spread(i, q)).or_zero(both) + forth[1] * (i.z * inv_pi);
    let mut pdf_reverse =
        back[0] * (metal.pdf_reverse * spread(o, p)).or_zero(both) + back[1] * (o.z * inv_pi);
    if COAT {
        let r = surface.reflection(o, i);
        let reflectance = fresnel::dielectric(half_cosine(o, i), row[3]).reflectance;
        f = f + Vec3::splat([1.0; 3]) * (r.brdf * reflectance);
        pdf = forth[2].mul_add(r.pdf, pdf);
        pdf_reverse = back[2].mul_add(r.pdf_reverse, pdf_reverse);
    }
    BsdfValue {
        f: f.or_zero(valid),
        pdf: pdf.or_zero(valid),
        pdf_reverse: pdf_reverse.or_zero(valid),
    }
}

#[inline(always)]
fn sample<L: Lanes, const COAT: bool>(row: &[L; 8], wo: Vec3<L>, u: [L; 3]) -> BsdfSample<L> {
    let (o, sign) = upper(wo);
    let surface = TrowbridgeReitz::of_packed(row[4]);
    let (cos, gloss) = if COAT {
        let cos = effective_cosine(&surface, o);
        (cos, coat::gloss(cos, row[3]))
    } else {
        (o.z, L::zero())
    };
    let below = inside(row, o, (cos, layer::<L, COAT>(row)[0]));
    let later = astray::<L, COAT>(row, o, below.transmittance);
    let [metal, diffuse, _] = shares(below.transmittance, later, gloss);
    let on_metal = u[2].lt(metal);
    let on_coat = u[2].ge(metal + diffuse);

    let p = below.w;
    let mut normals = TrowbridgeReitz::of_packed(row[5]);
    if COAT {
        normals = sampled(&normals, &surface, shift2(o.z, p.z, row[3]), p.z);
    }
    let h = normals.sample_normal(p, u[0], u[1]);
    let q = h.mul_add(L::splat(2.0) * p.dot(h), -p);
    let (x, y) = (q.x * row[3], q.y * row[3]);
    let square = L::one() - x * x - y * y;
    // Beyond the critical angle it stays inside: that is a later bounce's.
    let leaves = square.gt(L::zero()).and(q.z.gt(L::zero()));
    let out = Vec3::new(x, y, square.max(L::zero()).sqrt());
    let mut wi = Vec3::select(on_metal, out, cosine_sample(o, u).0);
    let mut sampled = leaves.or(on_metal.not());
    if COAT {
        let h = surface.sample_normal(o, u[0], u[1]);
        let mirrored = h.mul_add(L::splat(2.0) * o.dot(h), -o);
        wi = Vec3::select(on_coat, mirrored, wi);
        sampled = sampled.or(on_coat);
    }
    let wi = wi.normalize();
    let value = eval::<L, COAT>(row, o, wi);
    let valid = value.pdf.gt(L::zero()).and(sampled);
    BsdfSample {
        wi: Vec3::new(wi.x, wi.y, wi.z * sign),
        throughput: (value.f * (wi.z.abs() / value.pdf)).or_zero(valid),
        pdf: value.pdf,
        pdf_reverse: value.pdf_reverse,
    }
}

impl Bsdf for Rough {
    const NAME: &'static str = "coated conductor";
    const DELTA: bool = false;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        sample::<L, true>(row, wo, u)
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        eval::<L, true>(row, wo, wi)
    }
}

impl Bsdf for Base {
    const NAME: &'static str = "conductor under a coat";
    const DELTA: bool = false;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        sample::<L, false>(row, wo, u)
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        eval::<L, false>(row, wo, wi)
    }
}
