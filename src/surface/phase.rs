//! Scattering in media, as a kernel with a queue of its own: directions are those of the world, as
//! there is no surface ([`Bsdf::MEDIUM`]).

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use super::packing::{At, BsdfMaterial, Shared};
use crate::medium::henyey_greenstein as hg;
use crate::scene::{Description, Param};
use crate::simd::{Lanes, Vec3};

/// Row: mean cosine.
pub struct HenyeyGreenstein;

impl Bsdf for HenyeyGreenstein {
    const NAME: &'static str = "medium";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const MEDIUM: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let (wi, pdf) = hg::sample(row[0], wo, [u[0], u[1]]);
        BsdfSample {
            wi,
            throughput: Vec3::splat([1.0; 3]),
            pdf,
            pdf_reverse: pdf,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let value = hg::value(row[0], wo, wi);
        BsdfValue {
            f: Vec3::new(value, value, value),
            pdf: value,
            pdf_reverse: value,
        }
    }
}

/// Stands for media among the materials; no surface is made of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseMaterial;

impl Description for PhaseMaterial {
    fn params(&self) -> Vec<Param> {
        Vec::new()
    }
}

impl BsdfMaterial for PhaseMaterial {
    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<HenyeyGreenstein>()
    }

    fn row(&self, (): &(), _: &At) -> [f32; 8] {
        [0.0; 8]
    }
}
