//! Flags of renders that are kept.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::parse::{seconds, shard};
use crate::integrate::Shard;

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

    /// Make the part I of N of the render, and keep it: `phalanx merge` adds all N up
    ///
    /// Each makes the bootstrap, and then its own part of the chains and of the samples. No picture
    /// is written. The settings must be the same for all N; the picture then has the bits of one
    /// render.
    #[arg(
        long,
        value_name = "I/N",
        value_parser = shard,
        requires = "checkpoint",
        conflicts_with_all = ["output", "output_every", "preview", "stats", "time", "target_error", "quality", "error_layers", "despeckle", "firefly_report"],
        help_heading = "Output"
    )]
    pub shard: Option<Shard>,
}
