//! Smooth glass: a delta reflection and a delta refraction, chosen by Fresnel reflectance.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fresnel;
use super::microfacet::pack_alphas;
use super::packing::{At, BsdfMaterial, Shared};
use super::rough_dielectric::{LEAST_LOBE, Rough, resolved_eta};
use super::roughness::alpha;
use crate::scene::spectrum::IndexCurve;
use crate::scene::{Description, Dialect, Param, Parameters, Remap, Roughness, SMOOTH_ALPHA};
use crate::simd::{Lanes, Vec3};
use std::sync::Arc;

/// Row: reflectance (3), transmittance (3), eta (inside over outside).
pub struct Smooth;

impl Bsdf for Smooth {
    const NAME: &'static str = "smooth dielectric";
    const DELTA: bool = true;
    const LOBES: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let outside = wo.z.gt(L::zero());
        let eta = L::select(outside, row[6], L::one() / row[6]);
        let cos_i = wo.z.abs();
        let boundary = fresnel::dielectric(cos_i, eta);
        let reflects = u[2].lt(boundary.reflectance);
        let inv_eta = L::one() / eta;
        let refracted = Vec3::new(
            -wo.x * inv_eta,
            -wo.y * inv_eta,
            -boundary.cos_t.copysign(wo.z),
        );
        let reflected = Vec3::new(-wo.x, -wo.y, wo.z);
        let transmit = Vec3::new(row[3], row[4], row[5]);
        let transmit = match mode {
            // (eta_i / eta_t)^2 with eta_i on wo's side: radiance is compressed into the denser
            // medium.
            Mode::Radiance => transmit * (inv_eta * inv_eta),
            Mode::Importance => transmit,
        };
        let weight = Vec3::select(reflects, Vec3::new(row[0], row[1], row[2]), transmit);
        // Solid angles change at the boundary: n_i^2 cos_i dw_i = n_t^2 cos_t dw_t, and deltas with
        // them.
        let bend = inv_eta * inv_eta * (cos_i / boundary.cos_t);
        BsdfSample {
            wi: Vec3::select(reflects, reflected, refracted),
            throughput: weight.or_zero(cos_i.gt(L::zero())),
            pdf: L::one(),
            pdf_reverse: L::select(reflects, L::one(), bend),
        }
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

/// v3 `glass`, v4 `dielectric`: smooth, or microfacet reflection and refraction.
#[derive(Clone, Debug, PartialEq)]
pub struct DielectricMaterial {
    /// Multiplies what is reflected; 1 in physics.
    pub reflectance: Param,
    /// Multiplies what is refracted; 1 in physics.
    pub transmittance: Param,
    /// Inside over outside, RGB equal; with `dispersion` it is that of the helium d line.
    pub eta: Param,
    /// `eta` by wavelength; `None` if it is the same for all.
    pub dispersion: Option<Arc<IndexCurve>>,
    /// Smooth ones have two delta lobes.
    pub roughness: Roughness,
}

impl Description for DielectricMaterial {
    fn params(&self) -> Vec<Param> {
        let Roughness { u, v, .. } = self.roughness;
        vec![u, v, self.reflectance, self.transmittance, self.eta]
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    fn dispersion(&self) -> Option<&IndexCurve> {
        self.dispersion.as_deref()
    }
}

impl BsdfMaterial for DielectricMaterial {
    const NAMES: &'static [(Dialect, &'static str)] =
        &[(Dialect::V3, "glass"), (Dialect::V4, "dielectric")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        if set.dialect() == Dialect::V4 {
            let (eta, dispersion) = read_index(set, "eta")?;
            return Ok(Self {
                reflectance: Param::Constant([1.0; 3]),
                transmittance: Param::Constant([1.0; 3]),
                eta,
                dispersion,
                roughness: set.roughness(0.0)?,
            });
        }
        let eta = read_v3_index(set)?;
        Ok(Self {
            reflectance: set.albedo_or("Kr", 1.0)?,
            transmittance: set.albedo_or("Kt", 1.0)?,
            eta,
            // v3's index is a number.
            dispersion: None,
            roughness: set.roughness_or(Param::Constant([0.0; 3]))?,
        })
    }

    /// Whether the kernel is that of rough glass.
    type Tables = bool;

    fn tables(&self, _: &mut Shared) -> bool {
        self.kernel() == Kernel::of::<Rough>()
    }

    /// Rough glass is smooth where its roughness is that of a smooth surface, and where its
    /// refracted lobe would be too narrow: at an index of 1 rays pass straight through, as in
    /// pbrt-v4 (`DielectricBxDF`).
    fn kernel(&self) -> Kernel {
        let (smooth, rough) = (Kernel::of::<Smooth>(), Kernel::of::<Rough>());
        let (Param::Constant(u), Param::Constant(v)) = (self.roughness.u, self.roughness.v) else {
            return match self.eta {
                Param::Constant([1.0, ..]) => smooth,
                _ => rough,
            };
        };
        let [ax, ay] = alphas(u[0], v[0], self.roughness.remap);
        let narrow = |eta: f32| (eta - 1.0).abs() * ax.min(ay) < LEAST_LOBE;
        match self.eta {
            _ if ax.max(ay) <= SMOOTH_ALPHA => smooth,
            Param::Constant([eta, ..]) if narrow(eta) => smooth,
            _ => rough,
        }
    }

    fn row(&self, rough: &bool, at: &At) -> [f32; 8] {
        let (r, t) = (at.albedo(self.reflectance), at.albedo(self.transmittance));
        let eta = at.index(self.eta, &self.dispersion);
        let (eta, packed) = if *rough {
            let (u, v) = (at.number(self.roughness.u), at.number(self.roughness.v));
            let [ax, ay] = alphas(u, v, self.roughness.remap);
            (resolved_eta(eta, ax.min(ay)), pack_alphas(ax, ay))
        } else {
            (eta, 0.0)
        };
        [r[0], r[1], r[2], t[0], t[1], t[2], eta, packed]
    }
}

/// The alphas of glass. v3 takes a roughness of 0 both ways for smooth before it remaps it
/// (`GlassMaterial`).
fn alphas(u: f32, v: f32, remap: Remap) -> [f32; 2] {
    if u == 0.0 && v == 0.0 {
        [SMOOTH_ALPHA; 2]
    } else {
        [alpha(u, remap), alpha(v, remap)]
    }
}

/// v3's `eta` or, in its absence, `index`.
pub fn read_v3_index<P: Parameters>(set: &P) -> Result<Param, P::Error> {
    let eta = match set.float("eta")? {
        Some(eta) => eta,
        None => set.float_or("index", 1.5)?,
    };
    positive(set, eta)
}

/// The wavelength that an index of refraction is given for where it is one number (helium d), in
/// nanometres.
const D_LINE: f32 = 587.56;

/// v4's index of a dielectric, a number or a spectrum, and how it depends on the wavelength, if it
/// does.
pub fn read_index<P: Parameters>(
    set: &P,
    name: &str,
) -> Result<(Param, Option<Arc<IndexCurve>>), P::Error> {
    if let Some(curve) = set.index_curve(name)? {
        let eta = positive(set, Param::Constant([curve.at(D_LINE); 3]))?;
        return Ok((eta, Some(Arc::new(curve))));
    }
    let eta = set.grey_index(name)?;
    let eta = positive(set, eta.unwrap_or(Param::Constant([1.5; 3])))?;
    Ok((eta, None))
}

fn positive<P: Parameters>(set: &P, eta: Param) -> Result<Param, P::Error> {
    match eta {
        // v4 reads an index of 0 as "no change".
        Param::Constant([0.0, ..]) if set.dialect() == Dialect::V4 => Ok(Param::Constant([1.0; 3])),
        Param::Constant([x, ..]) if x <= 0.0 => Err(set.error(format_args!(
            "index of refraction {x} is not positive; glass has 1.5"
        ))),
        eta => Ok(eta),
    }
}
