//! Metals: complex Fresnel over a smooth or Trowbridge-Reitz surface.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::same_side;
use super::microfacet::{TrowbridgeReitz, upper};
use super::packing::{At, BsdfMaterial, Shared};
use super::roughness::raw_alpha;
use super::{fresnel, mirror};
use crate::scene::{Description, Dialect, Param, Parameters, Rgb, Roughness, SMOOTH_ALPHA};
use crate::simd::{Lanes, Mask, Vec3};

/// Row: eta (3), k (3).
pub struct Smooth;

/// Row: eta (3), k (3), alpha x, alpha y.
pub struct Rough;

#[inline(always)]
fn reflectance<L: Lanes>(row: &[L; 8], cos: L) -> Vec3<L> {
    fresnel::conductor(
        cos,
        Vec3::new(row[0], row[1], row[2]),
        Vec3::new(row[3], row[4], row[5]),
    )
}

impl Bsdf for Smooth {
    const NAME: &'static str = "smooth conductor";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        mirror::reflect(wo, reflectance(row, wo.z.abs()))
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

impl Bsdf for Rough {
    const NAME: &'static str = "rough conductor";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], _: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        let (up, sign) = upper(wo);
        let h = distribution.sample_normal(up, u[0], u[1]);
        let wi = h.mul_add(L::splat(2.0) * up.dot(h), -up);
        let valid = up.z.gt(L::zero()).and(wi.z.gt(L::zero()));
        let r = distribution.reflection(up, wi);
        let weight = reflectance(row, r.cos_h) * (r.brdf * wi.z / r.pdf);
        BsdfSample {
            wi: Vec3::new(wi.x, wi.y, wi.z * sign),
            throughput: weight.or_zero(valid),
            pdf: r.pdf,
            pdf_reverse: r.pdf_reverse,
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        let valid = same_side(wo, wi);
        let (up_o, up_i) = (upper(wo).0, upper(wi).0);
        let r = distribution.reflection(up_o, up_i);
        BsdfValue {
            f: (reflectance(row, r.cos_h) * r.brdf).or_zero(valid),
            pdf: r.pdf.or_zero(valid),
            pdf_reverse: r.pdf_reverse.or_zero(valid),
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let (brdf, cos) = TrowbridgeReitz::of_row(row).reflection_across(wo, wi);
        reflectance(row, cos.abs()) * brdf
    }
}

/// Of which metal a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConductorFresnel {
    /// Complex index of refraction (relative to the outside).
    EtaK {
        /// Its real part.
        eta: Param,
        /// Its imaginary part, the extinction.
        k: Param,
    },
    /// v4 `reflectance`: the index with `eta = 1` whose reflectance at normal incidence is this.
    Reflectance(Param),
}

/// The extinction with `eta = 1` whose reflectance at normal incidence is `r` (pbrt-v4,
/// `ConductorMaterial`).
fn k_of_reflectance(r: f32) -> f32 {
    let r = r.clamp(0.0, 0.9999);
    2.0 * r.sqrt() / (1.0 - r).sqrt()
}

impl ConductorFresnel {
    /// As [`Description::params`].
    pub fn params(&self) -> Vec<Param> {
        match self {
            Self::EtaK { eta, k } => vec![*eta, *k],
            Self::Reflectance(r) => vec![*r],
        }
    }

    /// `eta` and `k`, if they are the same everywhere.
    pub fn constant(&self) -> Option<[Rgb; 2]> {
        match *self {
            Self::EtaK {
                eta: Param::Constant(eta),
                k: Param::Constant(k),
            } => Some([eta, k]),
            Self::Reflectance(Param::Constant(r)) => Some([[1.0; 3], r.map(k_of_reflectance)]),
            _ => None,
        }
    }

    /// `eta` and `k` at a hit, as they are given.
    pub fn at(&self, at: &At) -> [Rgb; 2] {
        match *self {
            Self::EtaK { eta, k } => [at.color(eta), at.color(k)],
            Self::Reflectance(r) => [[1.0; 3], at.albedo(r).map(k_of_reflectance)],
        }
    }

    /// Reads v4's `reflectance`, or `eta` and `k`, whose names begin with `prefix`.
    pub fn read<P: Parameters>(set: &P, prefix: &str) -> Result<Self, P::Error> {
        let given = |name: &str| set.has(&format!("{prefix}{name}"));
        match set.albedo("reflectance")? {
            Some(_) if given("eta") || given("k") => Err(set.error(format_args!(
                "\"reflectance\" and \"{prefix}eta\" or \"{prefix}k\" exclude each other; give one"
            ))),
            Some(reflectance) => Ok(Self::Reflectance(reflectance)),
            None => Self::read_eta_k(set, prefix),
        }
    }

    fn read_eta_k<P: Parameters>(set: &P, prefix: &str) -> Result<Self, P::Error> {
        // Copper is pbrt's default metal; the dialects reduce its spectra differently.
        let or_copper = |name: &str| -> Result<Param, P::Error> {
            if let Some(param) = set.index(&format!("{prefix}{name}"))? {
                return Ok(param);
            }
            let copper = match set.dialect() {
                Dialect::V3 => set.known_index(&format!("Cu.{name}.spd")),
                Dialect::V4 => set.known_index(&format!("metal-Cu-{name}")),
            };
            let copper = copper.ok_or_else(|| set.error(format_args!("needs \"{name}\"")))?;
            Ok(Param::Constant(copper))
        };
        Ok(Self::EtaK {
            eta: or_copper("eta")?,
            k: or_copper("k")?,
        })
    }
}

/// v3 `metal`, v4 `conductor`: microfacet reflection, complex Fresnel.
#[derive(Clone, Debug, PartialEq)]
pub struct ConductorMaterial {
    /// Which metal.
    pub fresnel: ConductorFresnel,
    /// Smooth ones are mirrors.
    pub roughness: Roughness,
}

impl Description for ConductorMaterial {
    fn params(&self) -> Vec<Param> {
        [
            &[self.roughness.u, self.roughness.v],
            &self.fresnel.params()[..],
        ]
        .concat()
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }
}

impl BsdfMaterial for ConductorMaterial {
    const NAMES: &'static [(Dialect, &'static str)] =
        &[(Dialect::V3, "metal"), (Dialect::V4, "conductor")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(match set.dialect() {
            Dialect::V3 => Self {
                fresnel: ConductorFresnel::read_eta_k(set, "")?,
                roughness: set.roughness(0.01)?,
            },
            Dialect::V4 => Self {
                fresnel: ConductorFresnel::read(set, "")?,
                roughness: set.roughness(0.0)?,
            },
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    /// A constant roughness decides between smooth and rough; a textured one is rough throughout.
    fn kernel(&self) -> Kernel {
        let Roughness { u, v, remap } = self.roughness;
        match (u, v) {
            (Param::Constant(u), Param::Constant(v))
                if raw_alpha(u[0], remap).max(raw_alpha(v[0], remap)) < SMOOTH_ALPHA =>
            {
                Kernel::of::<Smooth>()
            }
            _ => Kernel::of::<Rough>(),
        }
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let [eta, k] = self.fresnel.at(at).map(|c| c.map(|v| v.max(0.0)));
        let [ax, ay] = at.alphas(&self.roughness);
        [eta[0], eta[1], eta[2], k[0], k[1], k[2], ax, ay]
    }
}
