//! Flags of renders that are kept.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::parse::seconds;

// Not doc comments: clap would take them for the command's description.

// Where a render is kept.
#[derive(Clone, Debug, Args)]
pub struct KeepArgs {
    /// Keep the render in FILE as it goes on, so that `phalanx resume FILE` can go on with it
    ///
    /// The checkpoint is replaced every so often (--every), and when the render ends, by itself or
    /// by Ctrl-C (SIGINT), SIGTERM or SIGHUP. Whatever happens, the last whole one is there. A
    /// render that is resumed comes to the same picture, bit for bit, as one that was never
    /// stopped.
    ///
    /// The scene is read again then: it is refused if one of its files has changed.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub checkpoint: Option<PathBuf>,

    /// Time between checkpoints: seconds, or 90s, 5m, 1h
    #[arg(
        long,
        value_name = "TIME",
        default_value = "10m",
        value_parser = seconds,
        requires = "checkpoint",
        help_heading = "Output"
    )]
    pub every: Duration,
}
