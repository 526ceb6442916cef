//! pbrt-v3's `substrate`: a diffuse base under a glossy coat, neither of which gets what the other
//! reflects.
//!
//! The model of Ashikhmin and Shirley (2000, "An Anisotropic Phong Light Reflection Model") with
//! the microfacets of Trowbridge and Reitz (pbrt-v3, section 8.5, `FresnelBlend`). Directions are
//! sampled as there, half of them by the cosine and half by visible normals, but a primary sample
//! of its own chooses, where pbrt divides the first one between the lobes.

use super::bsdf::Kernel;
use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::diffuse::{opposite, same_side};
use super::microfacet::{TrowbridgeReitz, sample_coated, upper};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters, Roughness};
use crate::simd::{Lanes, Mask, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// Row: diffuse (3), specular at normal incidence (3), alpha x, alpha y.
pub struct Substrate;

/// Makes a white base reflect all that a black coat lets through.
const BASE: f32 = 28.0 / (23.0 * PI);

/// Least cosines' product that the glossy lobe is divided by: what is left of it is finite.
const LEAST: f32 = 1e-30;

/// `1 - (1 - cos / 2)^5`, what the coat lets through, without the difference.
#[inline(always)]
fn admitted<L: Lanes>(cos: L) -> L {
    let x = cos * L::splat(0.5);
    let (five, ten) = (L::splat(5.0), L::splat(10.0));
    x * (five - x * (ten - x * (ten - x * (five - x))))
}

impl Substrate {
    /// The value for two directions, and where there is one; they may be on different sides.
    #[inline(always)]
    fn value<L: Lanes>(row: &[L; 8], o: Vec3<L>, i: Vec3<L>) -> (Vec3<L>, L::Mask) {
        // Half the length of the sum: of two directions along the surface, and opposite, either
        // one's cosine against the half vector is left to the rounding of its length.
        let sum = o + i;
        let cos_h = (sum.length2().sqrt() * L::splat(0.5)).min(L::one());
        let base = Vec3::new(row[0], row[1], row[2]);
        let coat = Vec3::new(row[3], row[4], row[5]);
        let rest = Vec3::splat([1.0; 3]) - coat;
        // Of what a coat above 1 leaves, pbrt makes less than no light.
        let left = |c: L| c.max(L::zero());
        let left = Vec3::new(left(rest.x), left(rest.y), left(rest.z));
        let (zo, zi) = (o.z.abs(), i.z.abs());
        let diffuse = base.mul_elem(left) * (L::splat(BASE) * admitted(zo) * admitted(zi));
        let d = TrowbridgeReitz::of_row(row).d(sum.normalize());
        let cosines = (cos_h * zo.max(zi)).max(L::splat(LEAST));
        // Schlick's term, of 1 - cos as the directions' distance tells it: the difference itself
        // would cancel.
        let away = (o - i).length2() * L::splat(0.25) / (L::one() + cos_h);
        let away2 = away * away;
        let fresnel = coat + rest * (away2 * away2 * away);
        let f = diffuse + fresnel * (d * L::splat(0.25) / cosines);
        // There may be no half vector at all.
        (f, cos_h.gt(L::zero()))
    }

    /// pbrt leaves the model out where both colours are black, although its coat reflects at
    /// grazing angles whatever its colour.
    #[inline(always)]
    fn exists<L: Lanes>(row: &[L; 8]) -> L::Mask {
        let brightest = row[1..6].iter().fold(row[0], |most, &c| most.max(c));
        brightest.gt(L::zero())
    }
}

impl Bsdf for Substrate {
    const NAME: &'static str = "substrate";
    const DELTA: bool = false;
    const LOBES: bool = true;
    const ACROSS: bool = true;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let distribution = TrowbridgeReitz::of_row(row);
        sample_coated::<Self, L>(row, &distribution, wo, (u, mode), L::splat(0.5))
    }

    #[inline(always)]
    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let (o, i) = (upper(wo).0, upper(wi).0);
        let r = TrowbridgeReitz::of_row(row).reflection(o, i);
        let (f, some) = Self::value(row, o, i);
        let valid = same_side(wo, wi).and(some);
        let half = L::splat(0.5);
        let mix = |cos: L, glossy: L| half * L::splat(FRAC_1_PI).mul_add(cos, glossy);
        BsdfValue {
            f: f.or_zero(valid.and(Self::exists(row))),
            pdf: mix(i.z, r.pdf).or_zero(valid),
            pdf_reverse: mix(o.z, r.pdf_reverse).or_zero(valid),
        }
    }

    #[inline(always)]
    fn across<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>) -> Vec3<L> {
        let (f, some) = Self::value(row, wo, wi);
        f.or_zero(opposite(wo, wi).and(some).and(Self::exists(row)))
    }
}

/// v3 `substrate`.
#[derive(Clone, Debug, PartialEq)]
pub struct SubstrateMaterial {
    /// Albedo of the base.
    pub diffuse: Param,
    /// Reflectance of the coat at normal incidence.
    pub specular: Param,
    /// Of the coat.
    pub roughness: Roughness,
}

impl Description for SubstrateMaterial {
    fn params(&self) -> Vec<Param> {
        let Roughness { u, v, .. } = self.roughness;
        vec![u, v, self.diffuse, self.specular]
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }
}

impl BsdfMaterial for SubstrateMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V3, "substrate")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(Self {
            diffuse: set.albedo_or("Kd", 0.5)?,
            specular: set.albedo_or("Ks", 0.5)?,
            // It has no "roughness" for both directions.
            roughness: set.roughness_or(Param::Constant([0.1; 3]))?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<Substrate>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let (d, s) = (at.albedo(self.diffuse), at.albedo(self.specular));
        let [ax, ay] = at.alphas(&self.roughness);
        [d[0], d[1], d[2], s[0], s[1], s[2], ax, ay]
    }
}
