//! The renderer's BSDF kernels at one lane, by kind.

use crate::scene::Sides;
use crate::simd::Vec3;
use crate::surface::{Bsdf, BsdfValue, Kind, Mode};
use crate::transport::sides::{self, Normals, Sampled};

/// A vertex's surface.
pub struct Surface<'a> {
    pub sides: Option<Sides>,
    pub row: &'a [f32; 8],
    pub normals: Normals<f32>,
}

impl Surface<'_> {
    fn sample_as<B: Bsdf>(&self, wo: Vec3<f32>, u: [f32; 3], mode: Mode) -> Sampled<f32> {
        let lobe = if B::LOBES { u[2] } else { 0.0 };
        let u = [u[0], u[1], lobe];
        sides::sample::<B, f32>(self.sides, self.row, &self.normals, wo, u, mode)
    }

    fn eval_as<B: Bsdf>(&self, directions: [Vec3<f32>; 2], mode: Mode) -> BsdfValue<f32> {
        sides::eval::<B, f32>(self.sides, self.row, &self.normals, directions, mode)
    }

    /// A direction from three primary samples.
    pub fn sample(&self, kind: Kind, wo: Vec3<f32>, u: [f32; 3], mode: Mode) -> Sampled<f32> {
        crate::for_kind!(kind, self.sample_as::<_>(wo, u, mode))
    }

    /// Value and densities of two directions.
    pub fn eval(&self, kind: Kind, directions: [Vec3<f32>; 2], mode: Mode) -> BsdfValue<f32> {
        crate::for_kind!(kind, self.eval_as::<_>(directions, mode))
    }
}
