//! Lights that shine from a point: everywhere, into a cone, or by an image.

use super::{DirectSample, EmissionSample, Kind, LightTable, Lot};
use crate::simd::{Frame, Lanes, Mask, Vec3, math};
use std::f32::consts::TAU;

impl LightTable {
    #[inline(always)]
    pub(super) fn direct_point<L: Lanes>(&self, lot: Lot<L>, p: Vec3<L>) -> DirectSample<L> {
        let base = lot.base;
        let place = L::load_rows(&self.place, lot.light);
        let at = Vec3::new(place[0], place[1], place[2]);
        let v = at - p;
        let d2 = v.length2();
        let w = v * (L::one() / d2.sqrt());
        let (intensity, pdf, lit) = if lot.kind.is_mapped() {
            let (intensity, pdf) = self.mapped(lot, -w);
            (intensity, pdf, shines(intensity))
        } else {
            let (factor, pdf) = self.directional(lot.kind, &place, base, -w);
            let colour = Vec3::new(base[1], base[2], base[3]);
            (colour * factor, pdf, factor.gt(L::zero()))
        };
        DirectSample {
            to_light: w,
            target: at,
            radiance: intensity,
            pdf: base[0] * d2,
            emission_ratio: pdf / d2,
            delta: L::Mask::splat(true),
            valid: lit.and(d2.gt(L::zero())),
        }
    }

    #[inline(always)]
    pub(super) fn emission_point<L: Lanes>(&self, lot: Lot<L>, u: [L; 4]) -> EmissionSample<L> {
        let base = lot.base;
        let inv_choice = L::one() / base[0];
        let place = L::load_rows(&self.place, lot.light);
        let direction = match lot.kind {
            Kind::Point => math::uniform_sphere(u[2], u[3]),
            Kind::Spot => {
                // Uniform in the cone.
                let drop = L::one() - place[6];
                let z = L::one() - u[2] * drop;
                let r = ((L::one() - z) * (L::one() + z)).max(L::zero()).sqrt();
                let (sin, cos) = math::sin_cos_turns(u[3]);
                Frame::new(Vec3::new(place[3], place[4], place[5])).to_world(Vec3::new(
                    r * cos,
                    r * sin,
                    z,
                ))
            }
            _ => self.mapped_direction(lot, [u[2], u[3]]),
        };
        let (beta, pdf, lit) = if lot.kind.is_mapped() {
            let (intensity, pdf) = self.mapped(lot, direction);
            let beta = intensity * (L::one() / pdf * inv_choice);
            // Rounding can turn a direction into a texel that is never chosen.
            (beta, pdf, shines(intensity).and(pdf.gt(L::zero())))
        } else {
            let (factor, pdf) = self.directional(lot.kind, &place, base, direction);
            let colour = Vec3::new(base[1], base[2], base[3]);
            let beta = colour * (factor / pdf * inv_choice);
            (beta, pdf, factor.gt(L::zero()))
        };
        EmissionSample {
            origin: Vec3::new(place[0], place[1], place[2]),
            direction,
            beta,
            d_vcm: L::one() / pdf,
            d_vc: L::zero(),
            distant: L::Mask::splat(false),
            valid: lit,
        }
    }

    /// Intensity factor of a point or spot towards `w`, and the density over solid angle that emission samples it with.
    #[inline(always)]
    fn directional<L: Lanes>(
        &self,
        kind: Kind,
        place: &[L; 8],
        base: &[L; 8],
        w: Vec3<L>,
    ) -> (L, L) {
        if kind == Kind::Point {
            return (L::one(), L::splat(0.5 / TAU));
        }
        let cos = w.dot(Vec3::new(place[3], place[4], place[5]));
        let (total, full) = (place[6], place[7]);
        let span = full - total;
        let x = L::select(
            span.gt(L::zero()),
            (cos - total) / span,
            L::select(cos.ge(full), L::one(), L::zero()),
        );
        let x = x.max(L::zero()).min(L::one());
        let smooth = x * x * L::splat(-2.0).mul_add(x, L::splat(3.0));
        let quartic = (x * x) * (x * x);
        let factor = L::select(base[4].gt(L::zero()), smooth, quartic);
        let pdf = L::splat(1.0 / TAU) / (L::one() - total);
        (factor, pdf)
    }

    /// A direction in proportion to the image of a goniometric or projection light.
    #[inline(always)]
    fn mapped_direction<L: Lanes>(&self, lot: Lot<L>, u: [L; 2]) -> Vec3<L> {
        let n = lot.light.len();
        let index = Self::column_bits(lot.base[6], lot.mask, n);
        let mut out = [[0.0f32; 3]; 8];
        for i in (0..n).filter(|i| lot.mask.bits() >> i & 1 != 0) {
            let u = [u[0].lane(i), u[1].lane(i)];
            out[i] = match lot.kind {
                Kind::Goniometric => self.environments[index[i] as usize].sample(u),
                _ => self.projectors[index[i] as usize].sample(u),
            };
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        Vec3::new(column(0), column(1), column(2))
    }

    /// Intensity of a goniometric or projection light towards unit `w`, and the density over solid angle that emission samples it with.
    #[inline(always)]
    fn mapped<L: Lanes>(&self, lot: Lot<L>, w: Vec3<L>) -> (Vec3<L>, L) {
        let n = lot.light.len();
        let index = Self::column_bits(lot.base[6], lot.mask, n);
        let mut out = [[0.0f32; 4]; 8];
        for i in (0..n).filter(|i| lot.mask.bits() >> i & 1 != 0) {
            out[i] = match lot.kind {
                Kind::Goniometric => self.environments[index[i] as usize].look_up(w.lane(i)),
                _ => self.projectors[index[i] as usize].look_up(w.lane(i)),
            };
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        (Vec3::new(column(0), column(1), column(2)), column(3))
    }
}

/// Where there is light at all.
#[inline(always)]
fn shines<L: Lanes>(intensity: Vec3<L>) -> L::Mask {
    let most = intensity.x.max(intensity.y).max(intensity.z);
    most.gt(L::zero())
}
