//! One path, step by step, from its primary samples: in `f32` by the renderer's kernels, and once more in `f64`.
//!
//! 1. [`Recorder::walk`] records the path that given primary samples stand for, vertex by vertex: the
//!    renderer's waves evaluate it, and a [probe](crate::transport::probe) notes positions,
//!    throughputs, densities, running sums, MIS weight and contribution ([`walk`]).
//! 2. [`Recorder::reference`] computes from the vertices alone, in `f64`, the contribution, the density under every strategy and the MIS weight
//!    ([`mod@reference`]); it shares no BSDF, density or weight with the renderer ([`bsdf`], [`sky`], [`lights`]).
//! 3. [`Recorder::retrace`] walks the path once more in `f64`, from the same primary samples along the same primitives, so that the whole of what
//!    `f32` does to a path can be told from what it does to the last formula.
//! 4. [`Recorder::sensitivity`] says how far these move if the vertices move by what `f32` makes of positions.
//!
//! Vertices are in internal space (see [`crate::scene`]), contributions in linear sRGB.

pub mod bsdf;
pub mod coated;
pub mod compare;
mod exact;
mod frustum;
pub mod lights;
pub mod panorama;
pub mod path;
mod record;
mod recorder;
pub mod reference;
pub mod report;
pub mod sensitivity;
pub mod sky;
pub mod spectral;
mod texels;
pub mod vector;
pub mod walk;
pub mod warp;

pub use self::path::{End, Path, Vertex};
pub use self::recorder::Recorder;
pub use self::reference::{Joint, Reference};
pub use self::report::Report;
pub use self::sensitivity::Sensitivity;
pub use self::walk::{Fate, Walk};
