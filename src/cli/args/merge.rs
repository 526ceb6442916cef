//! Flags of `merge`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, value_parser};

use super::errors::ErrorArgs;
use super::keep::KeepArgs;
use super::parse::{file, size};
use super::preview::PreviewArgs;
use super::values::Lanes;
use super::{ChainArgs, DisplayArgs, EffectArgs, PictureArgs, RenderArgs};

/// Add up the shards of a render
///
/// FILES are the checkpoints of `render --shard 1/N --checkpoint FILE` to `--shard N/N`, in any
/// order, each of which has come to its end. The picture has the same bits as that of one render
/// on one machine, and so have its figures and its error.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct MergeArgs {
    /// Checkpoints of all shards
    #[arg(value_name = "FILES", required = true)]
    pub files: Vec<PathBuf>,

    /// Write the picture to FILE: .exr, .pfm or .png; - is stdout (.exr); may be repeated
    ///
    /// Without -o, the picture is named after the scene, in the current folder, as by `render`.
    #[arg(short, long, value_name = "FILE", value_parser = file(), help_heading = "Output")]
    pub output: Vec<PathBuf>,

    #[command(flatten)]
    pub display: DisplayArgs,

    /// Do not write a .png beside every .exr
    #[arg(long, help_heading = "Output")]
    pub no_png: bool,

    /// Write the figures of the render to FILE, as a JSON object
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub stats: Option<PathBuf>,

    #[command(flatten)]
    pub errors: ErrorArgs,

    /// Keep the whole render in FILE, to go on with it
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub checkpoint: Option<PathBuf>,

    /// Worker threads; 0 is one per core
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = value_parser!(u32).range(0..=1024),
        help_heading = "Effort"
    )]
    pub threads: u32,

    /// Refuse what needs more memory than SIZE, like 8GiB or 500MB [default: three quarters of what
    /// there is]
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = "Effort")]
    pub max_memory: Option<u64>,

    /// Print nothing but warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

impl MergeArgs {
    /// As flags of `render`, of a scene and a picture.
    pub fn as_render(&self, scene: Option<PathBuf>, picture: PictureArgs) -> RenderArgs {
        RenderArgs {
            scenes: scene.into_iter().collect(),
            output: self.output.clone(),
            display: self.display.clone(),
            no_png: self.no_png,
            output_every: None,
            preview: PreviewArgs::default(),
            keep: KeepArgs {
                checkpoint: self.checkpoint.clone(),
                every: Duration::MAX,
                shard: None,
            },
            stats: self.stats.clone(),
            errors: self.errors,
            strategies: false,
            picture,
            integrator: None,
            host: None,
            chains: ChainArgs::none(),
            effects: EffectArgs {
                force_effects: Vec::new(),
            },
            spp: None,
            time: None,
            target_error: None,
            quality: None,
            no_estimate: false,
            threads: self.threads,
            lanes: Lanes::Eight,
            max_memory: self.max_memory,
            quiet: self.quiet,
        }
    }
}
