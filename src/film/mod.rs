//! The film: exact sums of filtered samples.

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
pub use self::tiles::{GROUPS, TILE, Tiling};
