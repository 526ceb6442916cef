//! The film: exact sums of filtered samples.

pub mod filter;
pub mod output;
mod sums;

pub use self::filter::FilterTable;
pub use self::sums::{SampleFilm, SplatFilm, SplatLog};
