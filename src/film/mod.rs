//! The film: from splats to files.
pub mod output;
