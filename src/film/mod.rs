//! The film: exact sums of filtered samples.

pub mod filter;
pub mod output;
mod samples;
mod sums;

pub use self::filter::FilterTable;
pub use self::samples::SampleFilm;
pub use self::sums::{SplatFilm, SplatLog};
