//! One path, step by step, from its primary samples: in `f32` by the renderer, and once more in
//! `f64`.
//!
//! Scenes with participating media, subsurface scattering or instances of objects, and cameras
//! with a system of lenses, are out of scope: what is said here of their paths means nothing. The
//! program refuses them.
//!
//! 1. [`Recorder::walk`] records the path that given primary samples stand for, vertex by vertex:
//!    the renderer's waves evaluate it, and a [probe](crate::transport::probe) notes positions,
//!    throughputs, densities, running sums, MIS weight and contribution ([`walk`], `record`).
//! 2. [`Recorder::reference`] computes from the vertices alone, in `f64`, the contribution, the
//!    density under every strategy and the MIS weight. The [`oracle`] shares no BSDF, density or
//!    weight with the renderer.
//! 3. [`Recorder::retrace`] walks the path once more in `f64`, from the same primary samples along
//!    the same primitives, so that the whole of what `f32` does to a path can be told from what it
//!    does to the last formula.
//! 4. [`Recorder::sensitivity`] says how far these move if the vertices move by what `f32` makes of
//!    positions.
//!
//! Vertices are in internal space (see [`crate::scene`]), contributions in linear sRGB.

pub mod compare;
pub mod oracle;
mod record;
mod recorder;
pub mod report;
mod retrace;
pub mod sensitivity;
pub mod walk;

pub use self::oracle::{End, Joint, Path, PathVertex, Reference, bsdf, spectral, vector};
pub use self::recorder::Recorder;
pub use self::report::PathReport;
pub use self::sensitivity::Sensitivity;
pub use self::walk::{Fate, Walk};
