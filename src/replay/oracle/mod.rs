//! The oracle: what a path is worth, in `f64`, from its vertices alone.
//!
//! It stands against the renderer, and so has every formula for itself: scattering functions
//! ([`bsdf`], [`coated`], [`microfacet`]), lights and their images ([`lights`], [`sky`]), cameras
//! ([`panorama`], `rays`), maps of primary samples ([`warp`], `bend`), intersections (`hit`), and
//! the weights of all strategies ([`mod@reference`]), by products of densities instead of running
//! sums. It knows nothing of waves, lanes or [probes](crate::transport::probe).
//!
//! What it takes from the renderer nevertheless, and why:
//!
//! - the [scene](crate::scene), which both are given;
//! - parameters of BSDFs as `f32` looked them up: textures are not what is compared;
//! - the names of BSDFs and of what is carried, [`Kind`](crate::surface::Kind) and
//!   [`Mode`](crate::surface::Mode), and which of them are deltas;
//! - what an image of a bump or normal map says
//!   ([`Perturbation`](crate::surface::bump::Perturbation)), and the frame that follows, which the
//!   renderer computes in `f64` itself (`known`);
//! - which intervals of primary samples stand for lights and texels: they are exact multiples of
//!   `2^-24` by definition, and a path that falls on another side of a border is another path;
//! - constants of a model that are fitted, not derived: [`DARK`](crate::surface::coat::DARK), and
//!   the spectra of [`scene::spectrum`](crate::scene::spectrum);
//! - facts of the plan that say which numbers a path is made of: sampled region, lens, tangents,
//!   sides of surfaces, the ball that distant lights shine on.
//!
//! `known` holds all that is asked of a [`World`](crate::transport::World).

pub mod bend;
pub mod bsdf;
pub mod coated;
mod frustum;
mod hit;
mod known;
pub mod lights;
pub mod microfacet;
pub mod panorama;
pub mod path;
pub mod rays;
pub mod reference;
pub mod sky;
pub mod spectral;
mod texels;
pub mod vector;
pub mod warp;

pub use self::known::Oracle;
pub use self::path::{End, Path, PathVertex};
pub use self::reference::{Joint, Reference};
