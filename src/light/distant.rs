//! Lights at infinity: from one direction, or from all around the scene.

use super::records::PlaceLanes;
use super::{DirectSample, EmissionSample, Emitted, Kind, LightTable, Lot};
use crate::simd::{Frame, Lanes, Mask, Vec3, math};
use std::f32::consts::{FRAC_1_PI, TAU};

impl LightTable {
    #[inline(always)]
    pub(super) fn direct_distant<L: Lanes>(&self, lot: Lot<L>, p: Vec3<L>) -> DirectSample<L> {
        let base = lot.base;
        let place = PlaceLanes::<L>::load(&self.place, lot.light);
        let w = -place.p;
        DirectSample {
            to_light: w,
            end: w.mul_add(self.far(), p),
            radiance: base.colour,
            pdf: base.choice,
            emission_ratio: self.inv_disk(),
            delta: L::Mask::splat(true),
            valid: L::Mask::splat(true),
        }
    }

    #[inline(always)]
    pub(super) fn direct_environment<L: Lanes>(
        &self,
        lot: Lot<L>,
        p: Vec3<L>,
        u: [L; 2],
    ) -> DirectSample<L> {
        let (w, radiance, pdf) = self.environment_sample(lot, u);
        DirectSample {
            to_light: w,
            end: w.mul_add(self.far(), p),
            radiance,
            pdf: lot.base.choice * pdf,
            emission_ratio: self.inv_disk(),
            delta: L::Mask::splat(false),
            valid: pdf.gt(L::zero()),
        }
    }

    #[inline(always)]
    pub(super) fn emission_distant<L: Lanes>(&self, lot: Lot<L>, u: [L; 4]) -> EmissionSample<L> {
        let base = lot.base;
        let inv_choice = L::one() / base.choice;
        let place = PlaceLanes::<L>::load(&self.place, lot.light);
        let direction = place.p;
        EmissionSample {
            origin: self.disk_point(direction, u),
            direction,
            beta: base.colour * (inv_choice / self.inv_disk()),
            d_vcm: L::one() / self.inv_disk(),
            d_vc: L::zero(),
            distant: L::Mask::splat(true),
            valid: L::Mask::splat(true),
        }
    }

    #[inline(always)]
    pub(super) fn emission_environment<L: Lanes>(
        &self,
        lot: Lot<L>,
        u: [L; 4],
    ) -> EmissionSample<L> {
        let inv_choice = L::one() / lot.base.choice;
        let (w, radiance, pdf) = self.environment_sample(lot, [u[2], u[3]]);
        let inv_density = L::one() / (self.inv_disk::<L>() * pdf);
        EmissionSample {
            origin: self.disk_point(-w, u),
            direction: -w,
            beta: radiance * (inv_density * inv_choice),
            d_vcm: L::one() / self.inv_disk(),
            d_vc: inv_density * inv_choice,
            distant: L::Mask::splat(true),
            valid: pdf.gt(L::zero()),
        }
    }

    /// What rays escaping along unit `direction` see of one environment.
    #[inline(always)]
    pub fn escaped<L: Lanes>(&self, light: u32, direction: Vec3<L>) -> Emitted<L> {
        let base = &self.base[light as usize];
        let (radiance, pdf) = match self.kinds[light as usize] {
            Kind::InfiniteImage => {
                let map = &self.environments[base.image as usize];
                map.radiance_and_pdf(direction)
            }
            _ => (Vec3::splat(base.colour), L::splat(0.5 / TAU)),
        };
        let direct = pdf * L::splat(base.choice);
        Emitted {
            radiance,
            direct_pdf: direct,
            emission_pdf: direct * self.inv_disk(),
        }
    }

    /// Direction to the light, radiance, density over solid angle.
    #[inline(always)]
    fn environment_sample<L: Lanes>(&self, lot: Lot<L>, u: [L; 2]) -> (Vec3<L>, Vec3<L>, L) {
        let (base, n) = (lot.base, lot.light.len());
        if lot.kind == Kind::InfiniteConstant {
            let w = math::uniform_sphere(u[0], u[1]);
            let radiance = base.colour;
            return (w, radiance, L::splat(0.5 / TAU));
        }
        let index = Self::column_bits::<L>(base.image, lot.mask, n);
        let mut out = [[0.0f32; 7]; 8];
        for i in (0..n).filter(|i| lot.mask.bits() >> i & 1 != 0) {
            out[i] = self.environments[index[i] as usize].sample([u[0].lane(i), u[1].lane(i)]);
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        (
            Vec3::new(column(0), column(1), column(2)),
            Vec3::new(column(3), column(4), column(5)),
            column(6),
        )
    }

    /// A point of the disk outside the scene that faces it along `direction`.
    #[inline(always)]
    fn disk_point<L: Lanes>(&self, direction: Vec3<L>, u: [L; 4]) -> Vec3<L> {
        let r = L::splat(self.radius);
        let (x, y) = math::concentric_disk(u[0], u[1]);
        Frame::new(direction).to_world(Vec3::new(x * r, y * r, -r))
    }

    /// One over the area of that disk.
    #[inline(always)]
    fn inv_disk<L: Lanes>(&self) -> L {
        L::splat(FRAC_1_PI / (self.radius * self.radius))
    }

    /// Beyond the scene from any surface.
    #[inline(always)]
    fn far<L: Lanes>(&self) -> L {
        L::splat(3.0 * self.radius)
    }
}
