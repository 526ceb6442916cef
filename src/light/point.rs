//! Lights that shine from a point: everywhere, into a cone, or by an image.

use super::records::{BaseLanes, PlaceLanes};
use super::{DirectSample, EmissionSample, Kind, LightTable, Lot};
use crate::simd::{Frame, Lanes, Mask, Vec3, math};
use std::f32::consts::TAU;

impl LightTable {
    #[inline(always)]
    pub(super) fn direct_point<L: Lanes>(&self, lot: Lot<L>, p: Vec3<L>) -> DirectSample<L> {
        let base = lot.base;
        let place = PlaceLanes::<L>::load(&self.place, lot.light);
        let at = place.p;
        let v = at - p;
        let d2 = v.length2();
        let w = v * (L::one() / d2.sqrt());
        let (intensity, pdf, lit) = if lot.kind.is_mapped() {
            let (intensity, pdf) = self.mapped(lot, -w);
            (intensity, pdf, shines(intensity))
        } else {
            let (factor, pdf) =
                Self::directional(lot.kind, &place, base, Self::versine(&place, -w));
            let colour = base.colour;
            (colour * factor, pdf, factor.gt(L::zero()))
        };
        DirectSample {
            to_light: w,
            end: at,
            radiance: intensity,
            pdf: base.choice * d2,
            emission_ratio: pdf / d2,
            delta: L::Mask::splat(true),
            valid: lit.and(d2.gt(L::zero())),
        }
    }

    #[inline(always)]
    pub(super) fn emission_point<L: Lanes>(&self, lot: Lot<L>, u: [L; 4]) -> EmissionSample<L> {
        let base = lot.base;
        let inv_choice = L::one() / base.choice;
        let place = PlaceLanes::<L>::load(&self.place, lot.light);
        // Intensity and density are those of the sample, not of its direction as rounded, which may
        // lie outside a narrow cone.
        let (direction, intensity, pdf) = if lot.kind.is_mapped() {
            self.mapped_sample(lot, [u[2], u[3]])
        } else {
            // Uniform in the cone.
            let drop = u[2] * place.versine_total;
            let direction = match lot.kind {
                Kind::Point => math::uniform_sphere(u[2], u[3]),
                _ => {
                    let r = (drop * (L::splat(2.0) - drop)).max(L::zero()).sqrt();
                    let (sin, cos) = math::sin_cos_turns(u[3]);
                    let local = Vec3::new(r * cos, r * sin, L::one() - drop);
                    Frame::new(place.axis).to_world(local)
                }
            };
            let (factor, pdf) = Self::directional(lot.kind, &place, base, drop);
            let colour = base.colour;
            (direction, colour * factor, pdf)
        };
        let lit = shines(intensity).and(pdf.gt(L::zero()));
        EmissionSample {
            origin: place.p,
            direction,
            beta: intensity * (inv_choice / pdf),
            d_vcm: L::one() / pdf,
            d_vc: L::zero(),
            distant: L::Mask::splat(false),
            valid: lit,
        }
    }

    /// One minus the cosine between unit `w` and the axis. From the chord between them, which keeps
    /// its digits where they are close.
    #[inline(always)]
    fn versine<L: Lanes>(place: &PlaceLanes<L>, w: Vec3<L>) -> L {
        let chord = w - place.axis;
        chord.length2() * L::splat(0.5)
    }

    /// Intensity factor of a point or spot at one minus the cosine to its axis, and the density
    /// over solid angle that emission samples it with.
    #[inline(always)]
    fn directional<L: Lanes>(
        kind: Kind,
        place: &PlaceLanes<L>,
        base: &BaseLanes<L>,
        versine: L,
    ) -> (L, L) {
        if kind == Kind::Point {
            return (L::one(), L::splat(0.5 / TAU));
        }
        let (total, full) = (place.versine_total, place.versine_full);
        let span = total - full;
        let x = L::select(
            span.gt(L::zero()),
            (total - versine) / span,
            L::select(versine.le(total), L::one(), L::zero()),
        );
        let x = x.max(L::zero()).min(L::one());
        let smooth = x * x * L::splat(-2.0).mul_add(x, L::splat(3.0));
        let quartic = (x * x) * (x * x);
        let factor = L::select(base.sides_or_falloff.gt(L::zero()), smooth, quartic);
        let pdf = L::splat(1.0 / TAU) / total;
        (factor, pdf)
    }

    /// A direction in proportion to the image of a goniometric or projection light, the intensity
    /// and the density over solid angle there.
    #[inline(always)]
    fn mapped_sample<L: Lanes>(&self, lot: Lot<L>, u: [L; 2]) -> (Vec3<L>, Vec3<L>, L) {
        let n = lot.light.len();
        let index = Self::column_bits::<L>(lot.base.image, lot.mask, n);
        let mut out = [[0.0f32; 7]; 8];
        for i in (0..n).filter(|i| lot.mask.bits() >> i & 1 != 0) {
            let u = [u[0].lane(i), u[1].lane(i)];
            out[i] = match lot.kind {
                Kind::Goniometric => self.environments[index[i] as usize].sample(u),
                _ => self.projectors[index[i] as usize].sample(u),
            };
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        (
            Vec3::new(column(0), column(1), column(2)),
            Vec3::new(column(3), column(4), column(5)),
            column(6),
        )
    }

    /// Intensity of a goniometric or projection light towards unit `w`, and the density over solid
    /// angle that emission samples it with.
    #[inline(always)]
    fn mapped<L: Lanes>(&self, lot: Lot<L>, w: Vec3<L>) -> (Vec3<L>, L) {
        let n = lot.light.len();
        let index = Self::column_bits::<L>(lot.base.image, lot.mask, n);
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
