//! Perfect specular reflection without Fresnel (pbrt-v3 `mirror`).

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Mask, Vec3};

/// Row: reflectance.
pub struct Mirror;

/// The mirror direction about `z`, with unit densities.
#[inline(always)]
pub(super) fn reflect<L: Lanes>(wo: Vec3<L>, reflectance: Vec3<L>) -> BsdfSample<L> {
    BsdfSample {
        wi: Vec3::new(-wo.x, -wo.y, wo.z),
        throughput: reflectance.or_zero(wo.z.eq(L::zero()).not()),
        pdf: L::one(),
        pdf_reverse: L::one(),
    }
}

impl Bsdf for Mirror {
    const NAME: &'static str = "mirror";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        reflect(wo, Vec3::new(row[0], row[1], row[2]))
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

/// v3 `mirror`.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorMaterial {
    /// The same at all angles.
    pub reflectance: Param,
}

impl Description for MirrorMaterial {
    fn params(&self) -> Vec<Param> {
        vec![self.reflectance]
    }

    fn is_black(&self) -> bool {
        self.reflectance.is_black()
    }
}

impl BsdfMaterial for MirrorMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V3, "mirror")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(Self {
            reflectance: set.albedo_or("Kr", 0.9)?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<Mirror>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let [r, g, b] = at.albedo(self.reflectance);
        [r, g, b, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}
