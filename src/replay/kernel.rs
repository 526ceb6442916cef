//! The renderer's BSDF kernels at one lane, by kind.

use crate::simd::Vec3;
use crate::surface::{Bsdf, BsdfSample, BsdfValue, Kind, Mode};

/// Gives [`crate::for_kind`] something to call.
struct Kernel;

impl Kernel {
    fn sample_as<B: Bsdf>(
        &self,
        row: &[f32; 8],
        wo: Vec3<f32>,
        u: [f32; 3],
        mode: Mode,
    ) -> BsdfSample<f32> {
        let lobe = if B::LOBES { u[2] } else { 0.0 };
        B::sample(row, wo, [u[0], u[1], lobe], mode)
    }

    fn eval_as<B: Bsdf>(
        &self,
        row: &[f32; 8],
        wo: Vec3<f32>,
        wi: Vec3<f32>,
        mode: Mode,
    ) -> BsdfValue<f32> {
        B::eval(row, wo, wi, mode)
    }
}

/// A direction from three primary samples.
pub fn sample(
    kind: Kind,
    row: &[f32; 8],
    wo: Vec3<f32>,
    u: [f32; 3],
    mode: Mode,
) -> BsdfSample<f32> {
    crate::for_kind!(kind, Kernel.sample_as::<_>(row, wo, u, mode))
}

/// Value and densities of two directions.
pub fn eval(
    kind: Kind,
    row: &[f32; 8],
    wo: Vec3<f32>,
    wi: Vec3<f32>,
    mode: Mode,
) -> BsdfValue<f32> {
    crate::for_kind!(kind, Kernel.eval_as::<_>(row, wo, wi, mode))
}
