//! What scenes say of conductors under a coat, of what a smooth coat reflects, and of coats that
//! textures vary.
//!
//! None has a name: pbrt's `coateddiffuse` and `coatedconductor` are one of these or, if the coat
//! is smooth, a mixture of two.

use super::bsdf::Kernel;
use super::coat::CoatLayer;
use super::coat_table::{Base, CoatTable};
use super::coated_conductor::{self, Layers};
use super::coated_rows::pack_bounces;
use super::conductor::ConductorFresnel;
use super::packing::{At, BsdfMaterial, Shared};
use super::roughness::{constant_alphas, resolved};
use super::{coated_diffuse, coated_mirror};
use crate::scene::{Description, Param, Roughness, is_smooth};
use std::sync::Arc;

/// What a smooth coat reflects.
#[derive(Clone, Debug, PartialEq)]
pub struct CoatMaterial {
    /// Inside over outside.
    pub eta: f32,
}

impl Description for CoatMaterial {
    fn params(&self) -> Vec<Param> {
        Vec::new()
    }
}

impl BsdfMaterial for CoatMaterial {
    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<coated_mirror::Coat>()
    }

    fn row(&self, _: &(), _: &At) -> [f32; 8] {
        [self.eta, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// v4 `coatedconductor`. If only the coat is smooth, the conductor alone, as of
/// [`CoatedDiffuseMaterial`](coated_diffuse::CoatedDiffuseMaterial).
#[derive(Clone, Debug, PartialEq)]
pub struct CoatedConductorMaterial {
    /// Relative to the coat, as `k`.
    pub eta: [f32; 3],
    /// Extinction, RGB.
    pub k: [f32; 3],
    /// Of the conductor.
    pub alphas: [f32; 2],
    /// Over the conductor.
    pub coat: CoatLayer,
}

impl Description for CoatedConductorMaterial {
    fn params(&self) -> Vec<Param> {
        Vec::new()
    }

    fn is_anisotropic(&self) -> bool {
        let differ = |alphas: [f32; 2]| alphas[0] != alphas[1];
        differ(self.coat.alphas) || differ(self.alphas)
    }
}

/// The kernel of a conductor under a coat.
fn conductor_kernel(smooth_coat: bool, smooth_conductor: bool) -> Kernel {
    match (smooth_coat, smooth_conductor) {
        (true, true) => Kernel::of::<coated_mirror::Mirror>(),
        (true, false) => Kernel::of::<coated_conductor::Base>(),
        (false, _) => Kernel::of::<coated_conductor::Rough>(),
    }
}

/// The row of a smooth conductor under a smooth coat.
fn mirror_row(eta: [f32; 3], k: [f32; 3], coat: &CoatLayer) -> [f32; 8] {
    let bounces = pack_bounces(coat.thickness, coat.visits());
    [eta[0], eta[1], eta[2], k[0], k[1], k[2], coat.eta, bounces]
}

impl BsdfMaterial for CoatedConductorMaterial {
    /// Its row: no texture varies it, and it takes a walk between the layers.
    type Tables = [f32; 8];

    fn tables(&self, _: &mut Shared) -> [f32; 8] {
        let coat = &self.coat;
        if self.kernel() == Kernel::of::<coated_mirror::Mirror>() {
            return mirror_row(self.eta, self.k, coat);
        }
        let layers = Layers {
            eta: self.eta,
            k: self.k,
            coat_eta: coat.eta,
            coat: (!coat.is_smooth()).then_some(coat.alphas.map(resolved)),
            conductor: self.alphas.map(resolved),
            thickness: coat.thickness,
            bounces: coat.visits(),
        };
        layers.row()
    }

    fn kernel(&self) -> Kernel {
        conductor_kernel(self.coat.is_smooth(), is_smooth(self.alphas))
    }

    fn row(&self, row: &[f32; 8], _: &At) -> [f32; 8] {
        *row
    }
}

/// What is under a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CoatedBase {
    /// Lambertian, of this reflectance.
    Diffuse(Param),
    /// Its index is relative to the outside.
    Conductor {
        /// Which metal.
        fresnel: ConductorFresnel,
        /// Of the metal's own surface.
        roughness: Roughness,
    },
}

/// A coat over either base where a roughness or the conductor is looked up in textures. If the coat
/// is smooth, the base alone.
#[derive(Clone, Debug, PartialEq)]
pub struct TexturedCoatMaterial {
    /// Under the coat.
    pub base: CoatedBase,
    /// The roughness of the coat.
    pub interface: Roughness,
    /// If `interface` varies, its alphas mean nothing, and it counts as rough.
    pub coat: CoatLayer,
}

impl Description for TexturedCoatMaterial {
    fn params(&self) -> Vec<Param> {
        let mut list = vec![self.interface.u, self.interface.v];
        match self.base {
            CoatedBase::Diffuse(reflectance) => list.push(reflectance),
            CoatedBase::Conductor { fresnel, roughness } => {
                list.extend([roughness.u, roughness.v]);
                list.extend(fresnel.params());
            }
        }
        list
    }

    fn is_anisotropic(&self) -> bool {
        let below = match self.base {
            CoatedBase::Conductor { roughness, .. } => roughness.is_anisotropic(),
            CoatedBase::Diffuse(_) => false,
        };
        below || self.interface.is_anisotropic()
    }
}

impl BsdfMaterial for TexturedCoatMaterial {
    type Tables = Arc<CoatTable>;

    fn tables(&self, shared: &mut Shared) -> Arc<CoatTable> {
        let base = match self.base {
            CoatedBase::Diffuse(_) => Base::Diffuse,
            CoatedBase::Conductor { roughness, .. } => Base::Conductor(constant_alphas(&roughness)),
        };
        let fixed = constant_alphas(&self.interface).is_some();
        shared.table((self.coat, base, fixed), |(coat, base, fixed)| {
            Arc::new(CoatTable::new(*coat, *base, *fixed))
        })
    }

    fn kernel(&self) -> Kernel {
        match &self.base {
            CoatedBase::Diffuse(_) => Kernel::of::<coated_diffuse::Rough>(),
            CoatedBase::Conductor { roughness, .. } => {
                let smooth = constant_alphas(roughness).is_some_and(is_smooth);
                conductor_kernel(self.coat.is_smooth(), smooth)
            }
        }
    }

    fn row(&self, table: &Arc<CoatTable>, at: &At) -> [f32; 8] {
        let coat = &self.coat;
        let (fresnel, roughness) = match self.base {
            CoatedBase::Diffuse(reflectance) => {
                let alphas = at.alphas(&self.interface);
                let interface = table.interface(alphas);
                let reflectance = at.albedo(reflectance);
                return coated_diffuse::textured_row(&interface, coat, reflectance, alphas);
            }
            CoatedBase::Conductor { fresnel, roughness } => (fresnel, roughness),
        };
        // The conductor is what the coat ends at.
        let [eta, k] = (fresnel.at(at)).map(|c| c.map(|x| x.max(0.0) / coat.eta));
        if coat.is_smooth() && self.kernel() == Kernel::of::<coated_mirror::Mirror>() {
            return mirror_row(eta, k, coat);
        }
        table.conductor([eta, k], at.alphas(&self.interface), at.alphas(&roughness))
    }
}
