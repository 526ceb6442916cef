//! The lobe of a conductor seen through a rough dielectric interface: what light does that is
//! refracted in, reflected once and refracted out.
//!
//! 1. Each of the three events moves the direction by a slope of its microfacets. In terms of the
//!    half vector inside the coat those are Trowbridge-Reitz distributions: of the conductor with
//!    its alpha, of a refraction with `alpha |cos' - cos / eta| / (cos'_o + cos'_i)` (the
//!    derivative of Snell's law in vector form).
//! 2. The distribution of their sum has no closed form, but is near to one with `A^2 = S + 0.95 P /
//!    (1 + s^2 / (16 S))`, `S` the sum of squares of the alphas, `P` of the products of pairs, `s`
//!    the slope: the centre is wider than squares that add up would have it, as tails are heavy,
//!    and far out, where one of the slopes does it all, they do add up. Against the integral that
//!    is right to 5 % within five alphas.
//! 3. Refraction is not linear: it has an end at the critical angle, a Fresnel term and a masking.
//!    So the lobe is three, one for each event that may do most of the turning, with shares of `S`:
//!    the exact value of that event between the mean directions that the others leave, times the
//!    ratio of the distribution of the sum to its own.
//! 4. The mean direction of a refraction is that of the mean visible microfacet (Heitz 2018,
//!    section 3: in the stretched frame its place on the projected disk), by which light at grazing
//!    angles gets in at all.

use super::microfacet::TrowbridgeReitz;
use super::rough_dielectric::refraction;
use super::{coat, fresnel};
use crate::simd::{Lanes, Mask, Vec3, math};

/// Alphas of slopes that add up, along one axis.
pub struct Slopes<L> {
    squares: L,
    products: L,
}

/// Share of the products of pairs at the centre.
const CENTRE: f32 = 0.95;

impl<L: Lanes> Slopes<L> {
    /// Of three alphas along the same axis.
    #[inline(always)]
    pub fn of([a, b, c]: [L; 3]) -> Self {
        Self {
            squares: a.mul_add(a, b.mul_add(b, c * c)),
            products: a.mul_add(b, c * (a + b)),
        }
    }

    /// Square of the alpha of the sum, for a slope of which `far` is the square over that of the
    /// alphas.
    #[inline(always)]
    fn square(&self, far: L) -> L {
        let fall = L::splat(1.0 / 16.0).mul_add(far, L::one());
        (self.products * L::splat(CENTRE) / fall) + self.squares
    }

    /// Alpha of the sum at the centre.
    #[inline(always)]
    pub fn widest(&self) -> L {
        self.square(L::zero()).sqrt()
    }
}

/// What the mean microfacet makes of a direction outside.
struct Entered<L: Lanes> {
    /// Inside, up.
    w: Vec3<L>,
    /// Share that gets to the conductor.
    share: L,
    /// What the way to the conductor leaves.
    way: L,
    /// How far a slope of the microfacet moves it.
    shift: L,
}

/// Mean normal of the microfacets that are visible from `w`.
#[inline(always)]
fn mean_normal<L: Lanes>(d: &TrowbridgeReitz<L>, w: Vec3<L>) -> Vec3<L> {
    // Mean of `sqrt(1 - x^2)` over the unit disk.
    const MEAN: f32 = 0.848_826_4;
    let s = Vec3::new(w.x * d.ax, w.y * d.ay, w.z).normalize();
    let planar = s.x.mul_add(s.x, s.y * s.y).sqrt();
    let b = L::splat(0.5 * MEAN) * (L::one() - s.z);
    let up = (L::one() - b * b).sqrt();
    let tilt = b * s.z / planar.max(L::splat(f32::MIN_POSITIVE));
    let n = Vec3::new(
        s.x * (up - tilt) * d.ax,
        s.y * (up - tilt) * d.ay,
        b.mul_add(planar, s.z * up),
    );
    n.normalize()
}

#[inline(always)]
fn enter<L: Lanes>(d: &TrowbridgeReitz<L>, w: Vec3<L>, eta: L, thickness: L) -> Entered<L> {
    let h = mean_normal(d, w);
    let cos = w.dot(h).max(L::zero()).min(L::one());
    let boundary = fresnel::dielectric(cos, eta);
    let inverse = L::one() / eta;
    let shift = boundary.cos_t - cos * inverse;
    let inside = h.mul_add(shift, w * inverse).normalize();
    let depth = thickness / inside.z;
    let lit = inside.z.gt(L::zero()).and(depth.lt(L::splat(coat::DARK)));
    let (outer, inner) = (d.stretch(w), d.stretch(inside));
    // Sampled by one masking, seen by both.
    let seen = inside.z * (w.z + outer) / inside.z.mul_add(outer, w.z * inner);
    Entered {
        w: inside,
        share: ((L::one() - boundary.reflectance) * seen).or_zero(lit),
        way: math::exp(-depth).or_zero(lit),
        shift: shift.abs(),
    }
}

/// The lobe over the conductor's reflectance for directions `o` and `i` in the upper hemisphere,
/// and the cosine of which that is to be.
#[inline(always)]
pub fn once<L: Lanes>(
    coat: &TrowbridgeReitz<L>,
    metal: &TrowbridgeReitz<L>,
    [o, i]: [Vec3<L>; 2],
    eta: L,
    thickness: L,
) -> (L, L) {
    let (from, to) = (
        enter(coat, o, eta, thickness),
        enter(coat, i, eta, thickness),
    );
    let (p, q) = (from.w, to.w);
    let sum = p + q;
    let (inverse, level) = (L::one() / sum.z, L::one() / (p.z + q.z));
    let slope2 = [sum.x * inverse, sum.y * inverse].map(|s| s * s);
    let part = [to.shift * level, from.shift * level];
    let axis = |coat: L, metal: L| Slopes::of([coat * part[0], coat * part[1], metal]);
    let axes = [axis(coat.ax, metal.ax), axis(coat.ay, metal.ay)];
    let far = slope2[0] / axes[0].squares + slope2[1] / axes[1].squares;
    let squares = [axes[0].square(far), axes[1].square(far)];
    let area = (squares[0] * squares[1]).sqrt();
    let spread = L::one() + slope2[0] / squares[0] + slope2[1] / squares[1];

    // The ratio of distributions and the share, over what they have in common.
    let round = coat.ay / coat.ax;
    let stretched = slope2[0].mul_add(round, slope2[1] / round);
    let area_of = |x: L| coat.ax * coat.ay * (x * x);
    let areas = [area_of(part[0]), area_of(part[1]), metal.ax * metal.ay];
    let common = L::one() / ((areas[0] + areas[1] + areas[2]) * area);
    let ratio = |area: L| {
        let x = (area + stretched) / spread;
        x * x * common
    };
    let bend = |outside: Vec3<L>, below: Vec3<L>| {
        let turned = Vec3::new(below.x, below.y, -below.z);
        let t = refraction(coat, (outside, L::one()), (turned, eta));
        let (lo, li) = (coat.stretch(outside), coat.stretch(below));
        t / outside.z.mul_add(li, below.z * lo)
    };
    let out = bend(i, p) * from.share * from.way * to.way * ratio(areas[0]);
    let back = bend(o, q) * to.share * to.way * from.way * ratio(areas[1]);
    let widened = TrowbridgeReitz {
        ax: squares[0].sqrt(),
        ay: squares[1].sqrt(),
    };
    let through = from.share * to.share * from.way * to.way / (eta * eta);
    let turned = widened.reflection(p, q).brdf * through * (areas[2] * area * common);
    let lobe = out + back + turned;
    let exists = from.way.gt(L::zero()).and(to.way.gt(L::zero()));
    let cos = (sum.length2().sqrt() * L::splat(0.5)).min(L::one());
    (lobe.or_zero(exists.and(lobe.is_finite())), cos)
}
