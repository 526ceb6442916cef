//! Scattering at surfaces: one file a BSDF, eight hits at a time, queued by kind.
//!
//! 1. [`MaterialTable`] reduces a scene's materials to a [`Kind`] and a *parameter row* of eight
//!    floats each. Rows of constant materials are shared; textured ones are evaluated into a row
//!    per hit ([`texture`]).
//! 2. A BSDF is a type implementing [`Bsdf`] over local directions (`z` along the shading normal)
//!    and a parameter row. It never sees a scene.
//! 3. Of a [`mixture`] one component is chosen per hit; it never gets as far as a kernel.
//! 4. What a scene says of a BSDF is a [`Description`](crate::scene::Description). How that is
//!    read, and which kernel and rows it gives, is in the file of the BSDF
//!    ([`BsdfMaterial`](packing::BsdfMaterial)).
//!
//! # Adding a BSDF
//!
//! Write its file, and add its `mod` and its line in the table, both here below. Nothing else lists
//! BSDFs: kinds, queues, dispatch, flags, names in reports and in scene files, what textures may
//! vary and what the plan asks follow from these. `tests/lommel_seeliger.rs` is a whole one, with
//! its test.
//!
//! - What it has besides a row is of a type of its own ([`packing::BsdfMaterial::Tables`]), made
//!   once a material and shared between those of which it is the same, as the tables of coats are.
//! - What kernels look up themselves is a table of the scene ([`Tabulated`]), which rows name
//!   ([`Bsdf::eval_in`]), as `fourier` does.
//! - A material made of several BSDFs is no BSDF. `uber`, `translucent`, `mix` and smooth coats are
//!   mixtures, put together where scene files are read; their names are there as well.
//! - [`replay`](crate::replay) answers in `f64` for the BSDFs whose formulas it has, written anew
//!   and not shared with these files. Of others it repeats what the kernel says. To be checked
//!   there a BSDF needs its formulas in `replay/oracle/bsdf.rs` or, if it is a delta, in
//!   `replay/oracle/reference.rs`, and its way of sampling in `replay/oracle/bend.rs`.

/// The table: a line for each material of one BSDF, with its kernels as `Kind: type`. It calls a
/// macro, `$then`, with all lines and with what else was given.
///
/// Their order is that of queues and of reports; pictures do not depend on it.
macro_rules! bsdfs {
    ($then:path; $($rest:tt)*) => {
        $then! {
            [
                diffuse::DiffuseMaterial =>
                    Diffuse: diffuse::Diffuse, OrenNayar: diffuse::OrenNayar;
                mirror::MirrorMaterial => Mirror: mirror::Mirror;
                conductor::ConductorMaterial =>
                    SmoothConductor: conductor::Smooth, RoughConductor: conductor::Rough;
                dielectric::DielectricMaterial =>
                    SmoothDielectric: dielectric::Smooth, RoughDielectric: rough_dielectric::Rough;
                plastic::PlasticMaterial => Plastic: plastic::Plastic;
                thin_dielectric::ThinDielectricMaterial =>
                    ThinDielectric: thin_dielectric::ThinDielectric;
                diffuse_transmission::DiffuseTransmissionMaterial =>
                    DiffuseTransmission: diffuse_transmission::DiffuseTransmission;
                substrate::SubstrateMaterial => Substrate: substrate::Substrate;
                disney_material::DisneyMaterial =>
                    Disney: disney::Disney, DisneyThin: disney::DisneyThin;
                fourier_material::FourierMaterial => Fourier: fourier::Fourier;
                measured::MeasuredMaterial => Measured: measured::Measured;
                hair_material::HairMaterial => Hair: hair::Hair;
                // Smooth ones have the interface of glass.
                subsurface_material::SubsurfaceMaterial =>
                    RoughInterface: subsurface::RoughInterface, SubsurfaceExit: subsurface::Exit;
                coated_materials::CoatMaterial => Coat: coated_mirror::Coat;
                coated_diffuse::CoatedDiffuseMaterial =>
                    CoatedDiffuse: coated_diffuse::Rough, CoatedDiffuseBase: coated_diffuse::Base;
                coated_materials::CoatedConductorMaterial =>
                    CoatedMirror: coated_mirror::Mirror,
                    CoatedConductor: coated_conductor::Rough,
                    CoatedConductorBase: coated_conductor::Base;
                // Its kernels are those of the three before.
                coated_materials::TexturedCoatMaterial => ;
                phase::PhaseMaterial => HenyeyGreenstein: phase::HenyeyGreenstein;
                #[cfg(test)]
                tests::lommel_seeliger::LommelSeeligerMaterial =>
                    #[cfg(test)] LommelSeeliger: tests::lommel_seeliger::LommelSeeliger;
            ]
            $($rest)*
        }
    };
}

pub(crate) use bsdfs;

pub mod alpha_mask;
pub mod bsdf;
pub mod bssrdf;
pub mod bump;
pub mod coat;
pub mod coat_table;
pub mod coated_conductor;
pub mod coated_diffuse;
pub mod coated_materials;
pub mod coated_mirror;
pub mod coated_rows;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod diffuse_transmission;
pub mod diffusion_table;
pub mod disney;
pub mod disney_material;
pub mod disney_row;
pub mod fourier;
pub mod fourier_material;
pub mod fourier_table;
pub mod fresnel;
pub mod hair;
pub mod hair_material;
pub mod material;
pub mod measured;
pub mod measured_table;
pub mod microfacet;
pub mod mirror;
pub mod mixture;
pub mod packing;
pub mod phase;
pub mod plastic;
pub mod rough_dielectric;
pub mod roughness;
pub mod seen_through;
pub mod spline;
pub mod substrate;
pub mod subsurface;
pub mod subsurface_material;
pub mod table;
pub mod tabulated;
pub mod tabulated_bsdf;
pub mod tensor;
#[cfg(test)]
pub(crate) mod tests;
pub mod texture;
pub mod thin_dielectric;
pub mod warp;

pub use self::alpha_mask::AlphaMasks;
pub use self::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
pub use self::bssrdf::Bssrdf;
pub use self::coat::CoatLayer;
pub use self::coated_diffuse::CoatedDiffuseMaterial;
pub use self::coated_materials::{
    CoatMaterial, CoatedBase, CoatedConductorMaterial, TexturedCoatMaterial,
};
pub use self::conductor::{ConductorFresnel, ConductorMaterial};
pub use self::dielectric::DielectricMaterial;
pub use self::diffuse::DiffuseMaterial;
pub use self::diffuse_transmission::DiffuseTransmissionMaterial;
pub use self::disney_material::DisneyMaterial;
pub use self::hair_material::{HairMaterial, Pigment};
pub use self::material::MaterialTable;
pub use self::mirror::MirrorMaterial;
pub use self::plastic::PlasticMaterial;
pub use self::substrate::SubstrateMaterial;
pub use self::subsurface_material::SubsurfaceMaterial;
pub use self::table::Kind;
pub use self::tabulated::Tabulated;
pub use self::thin_dielectric::ThinDielectricMaterial;
