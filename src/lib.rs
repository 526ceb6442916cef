//! Phalanx: Metropolis light transport with thousands of Markov chains in lockstep.
//!
//! Multiplexed Metropolis light transport fixes a chain's path depth `k` and lets a primary sample
//! choose the bidirectional strategy `(s, t)`, `s + t = k + 2`. A proposal then costs `k + 1` rays
//! whatever its strategy, so chains of one depth never diverge in length: they march together, a
//! ray a wave, eight to a SIMD register. Everything here follows from that.
//!
//! ```text
//! scene file -> Scene -> World, Plan -> bootstrap -> batches of chains -> film -> picture, figures
//! ```
//!
//! The stages of a path are methods of [`transport::World`], the scene as kernels read it. They
//! work on [`transport::Paths`], the tables of a batch, and lists of numbers tell them on which
//! paths.
//! `src/transport/README.md` follows one path from the integrator to the picture: read it first.
//!
//! Data flows one way: a room uses only rooms above it in this table.
//!
//! | room | what it does | what it does not know |
//! |---|---|---|
//! | [`simd`] | lanes of width 1 and 8, vectors, polynomials, random numbers | what they are for |
//! | `memory` | tables in huge pages | what they hold |
//! | `brief` | messages made to fit a line | what they say |
//! | `files` | files written whole or not at all | what they hold |
//! | [`checkpoint`] | values in a file: packed, checked, versioned | what they are the state of |
//! | [`formats`] | EXR, PFM and sRGB, read and written; NanoVDB, read | what pictures are for |
//! | [`scene`] | what is rendered, as plain tables | files, behaviour, which BSDFs there are |
//! | [`trace`] | tree, packets, closest hits and visibility | materials |
//! | [`geometry`] | points on surfaces, with error bounds | how rays found them |
//! | [`medium`] | optical depths, where rays are scattered, phase functions | what bounds media |
//! | [`surface`] | BSDFs and textures, by queue | lights, paths |
//! | [`light`] | emission, its sampling and densities | surfaces |
//! | [`camera`] | rays, raster positions, importance | pixels |
//! | [`pbrt`] | scene text (v3, v4), meshes, images, spectra to tables | what tables are for |
//! | [`plan`] | strategies that carry light, primary samples that exist | how they are used |
//! | [`film`] | exact sums, filters, output | strategies |
//! | [`transport`] | subpaths in waves, joined and weighed; samplers of chains | chains |
//! | [`chain`] | mutation, acceptance, bootstrap, batches | pixels' layout |
//! | [`replay`] | one path of a chain, step by step, in `f32` and in `f64` | pixels |
//! | [`metrics`] | how far two pictures are apart | how they were made |
//! | [`integrate`] | schedules over all: `auto`, `mmlt`, `pssmlt`, `pt`, `lt`, `bdpt` | who asks |
//! | `converge` | the program's: error against time, and a report of it | who asks for it |
//! | [`cli`] | the program's: the command line | - |
//!
//! The last two rooms are the program's. They come with the feature `cli`, which is on by default;
//! the library alone is built by `--no-default-features`.
//!
//! [`integrate::render`] is the whole renderer in one call:
//!
//! ```
//! use phalanx::{integrate, pbrt};
//! let text = r#"
//!     LookAt 0 0 5  0 0 0  0 1 0
//!     Camera "perspective" "float fov" 40
//!     Film "image" "integer xresolution" 16 "integer yresolution" 16
//!     WorldBegin
//!     LightSource "infinite" "rgb L" [1 1 1]
//!     Shape "sphere"
//!     WorldEnd
//! "#;
//! let scene = pbrt::load_str(text, "sphere.pbrt", ".".as_ref())?;
//! let mut settings = integrate::Settings::of(&scene);
//! settings.bootstrap = 1000;
//! settings.mutations_per_pixel = 10;
//! let render = integrate::render(&scene, &settings, &integrate::Silent)?;
//! # let folder = tempfile::tempdir()?;
//! # std::env::set_current_dir(&folder)?;
//! render.write("sphere.png")?;
//! assert_eq!(render.pixels.len(), 16 * 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! To add a BSDF see [`surface`]; a light, [`light`]; what only some scenes need, [`plan::Effect`].
//! An integrator is a schedule over shared stages: a file in [`integrate`], a line in its function
//! `integrate`, and a name in [`scene::IntegratorKind`], by which the command line, figures and
//! `converge` know it. If its samples are independent, all but what a sample is comes from
//! `integrate/sampled.rs`: passes over the picture, film, errors, progress and stops;
//! `integrate/pt.rs` is the shortest example, and `integrate/lt.rs` one whose samples also splat.
//! If it mutates them, all but what is mutated comes from `integrate/chains.rs`: bootstrap, chains,
//! film, errors, mixing; `integrate/mmlt.rs` and `integrate/pssmlt.rs` name their samplers
//! ([`transport::PathSampler`]) and no more. `integrate/auto` has both march side by side.

#![deny(unsafe_code)]
#![warn(missing_docs)]

mod brief;
pub mod camera;
pub mod chain;
pub mod checkpoint;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
mod converge;
// The program writes more kinds of files than the library.
#[cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]
mod files;
pub mod film;
pub mod formats;
pub mod geometry;
pub mod integrate;
pub mod light;
pub mod medium;
mod memory;
pub mod metrics;
pub mod pbrt;
pub mod plan;
#[cfg(test)]
mod property;
pub mod replay;
pub mod scene;
pub mod simd;
pub mod surface;
pub mod trace;
pub mod transport;

pub(crate) use surface::table::for_kind;
