//! Scattering at surfaces: one file a BSDF, eight hits at a time, queued by kind.
//!
//! 1. [`MaterialTable`] reduces a scene's materials to a [`Kind`] and a *parameter row* of eight
//!    floats each. Rows of constant materials are shared; textured ones are evaluated into a row
//!    per hit ([`texture`]).
//! 2. A BSDF is a type implementing [`Bsdf`] over local directions (`z` along the shading normal)
//!    and a parameter row. It never sees a scene.
//! 3. Of a [`mixture`] one component is chosen per hit; it never gets as far as a kernel.
//! 4. Adding one is a file, and a line in [`table`].

pub mod bsdf;
pub mod bump;
pub mod coat;
pub mod coat_table;
pub mod coated_conductor;
pub mod coated_diffuse;
pub mod coated_materials;
pub mod conductor;
pub mod cutout;
pub mod dielectric;
pub mod diffuse;
pub mod diffuse_transmission;
pub mod fresnel;
pub mod material;
pub mod microfacet;
pub mod mirror;
pub mod mixture;
pub mod packing;
pub mod plastic;
pub mod rough_dielectric;
pub mod roughness;
pub mod seen_through;
pub mod substrate;
pub mod table;
#[cfg(test)]
pub(crate) mod tests;
pub mod texture;
pub mod thin_dielectric;

pub use self::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
pub use self::coat::CoatLayer;
pub use self::coated_diffuse::CoatedDiffuseMaterial;
pub use self::coated_materials::{
    CoatMaterial, CoatedBase, CoatedConductorMaterial, TexturedCoatMaterial,
};
pub use self::conductor::{ConductorFresnel, ConductorMaterial};
pub use self::cutout::Cutouts;
pub use self::dielectric::DielectricMaterial;
pub use self::diffuse::DiffuseMaterial;
pub use self::diffuse_transmission::DiffuseTransmissionMaterial;
pub use self::material::MaterialTable;
pub use self::mirror::MirrorMaterial;
pub use self::plastic::PlasticMaterial;
pub use self::substrate::SubstrateMaterial;
pub use self::table::Kind;
pub use self::thin_dielectric::ThinDielectricMaterial;
