//! The film: exact sums of filtered samples.
//!
//! Chains splat to a [`SplatFilm`]; their splats are of bounded size:
//!
//! 1. A thread collects splats in a [`SplatLog`] (`log.rs`) of its own.
//! 2. [`SplatFilm::add`] (`sums.rs`) takes a full log: it sorts the log by stripe and asks the
//!    [`filter`] for the pixels in reach of each splat.
//! 3. `locked_stripe.rs` adds to them, under the lock of one stripe of a layer (`stripes.rs`), in
//!    64-bit integers.
//! 4. [`SplatFilm::resolve`] multiplies each layer by its scale and adds layers up;
//!    `error_halves.rs` says how far off that is, by the half of all chains (`half.rs`).
//!
//! Independent samples are of any size:
//!
//! 1. A [`SampleFilm`] (`samples.rs`) sums them with digits enough for all of `f32` (`sum.rs`), and
//!    tile by tile (`tile_sums.rs`, `tiles.rs`) if it knows its error.
//! 2. A [`SplattingFilm`] (`samples_and_splats.rs`) is two of them: for what samples add at their
//!    own place, and for what they splat elsewhere. All integrators of samples use it.
//! 3. [`Passes`] says how many samples each pixel has had: their sums are divided by that.
//!
//! [`output`] writes finished pictures of both.

mod error_halves;
pub mod filter;
mod half;
mod locked_stripe;
mod log;
pub mod output;
mod passes;
mod samples;
mod samples_and_splats;
mod stripes;
mod sum;
mod sums;
mod tile_sums;
mod tiles;

pub use self::error_halves::Scales;
pub use self::filter::FilterTable;
pub use self::half::Half;
pub use self::log::SplatLog;
pub use self::passes::Passes;
pub use self::samples::{Sample, SampleFilm};
pub use self::samples_and_splats::{Done, SplattingFilm};
pub use self::sums::{Destination, SplatFilm};
pub use self::tiles::{GROUPS, SEQUENCES, TILE, Tiling};
