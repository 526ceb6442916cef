//! The film: exact sums of filtered samples.

pub mod filter;
mod held;
mod judged;
mod log;
pub mod output;
mod passes;
mod samples;
mod scattered;
mod sum;
mod sums;
mod tile_sums;
mod tiles;

pub use self::filter::FilterTable;
pub use self::judged::{Half, Scales};
pub use self::log::SplatLog;
pub use self::passes::Passes;
pub use self::samples::{Sample, SampleFilm};
pub use self::scattered::{Done, ScatteredFilm};
pub use self::sums::{Destination, SplatFilm};
pub use self::tiles::{GROUPS, TILE, Tiling};
