//! Flags of `resume` and `info`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, value_parser};

use super::errors::ErrorArgs;
use super::keep::KeepArgs;
use super::parse::{file, seconds, size, target_error};
use super::preview::PreviewArgs;
use super::values::{Lanes, Quality};
use super::{ChainArgs, DisplayArgs, EffectArgs, MAX_MUTATIONS, PictureArgs, RenderArgs};

/// Go on with a render from a checkpoint
///
/// The scene is loaded again and must be as it was. Without --mutations, --spp, --time,
/// --target-error or --quality the render goes on to where it was to end; with one of them, to
/// there, and nothing of what was said before ends it. --mutations and --spp count from the
/// beginning, --time from now on.
///
/// The picture has the same bits as that of a render that was never stopped, whatever the number of
/// threads and lanes. Chains that go on beyond what they were begun for are tuned, and summed, as
/// they were begun.
///
/// Messages, signals and exit codes are those of `render`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct ResumeArgs {
    /// Checkpoint that `render --checkpoint` or `resume` has written
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

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

    /// Write all files so far every TIME, while the render goes on
    #[arg(long, value_name = "TIME", value_parser = seconds, help_heading = "Output")]
    pub output_every: Option<Duration>,

    #[command(flatten)]
    pub preview: PreviewArgs,

    /// Write the figures of the render to FILE, as a JSON object
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub stats: Option<PathBuf>,

    #[command(flatten)]
    pub errors: ErrorArgs,

    /// Keep the render in another file [default: the one it is resumed from]
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub checkpoint: Option<PathBuf>,

    /// Time between checkpoints: seconds, or 90s, 5m, 1h
    #[arg(
        long,
        value_name = "TIME",
        default_value = "10m",
        value_parser = seconds,
        help_heading = "Output"
    )]
    pub every: Duration,

    /// Mutations per pixel in all (auto, mmlt, pssmlt)
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_MUTATIONS),
        help_heading = "Effort"
    )]
    pub mutations: Option<u64>,

    /// Samples per pixel in all (pt, lt, bdpt)
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=u64::from(u32::MAX)),
        help_heading = "Effort"
    )]
    pub spp: Option<u64>,

    /// Go on for this long: seconds, or 90s, 5m, 1h
    #[arg(long, value_name = "TIME", value_parser = seconds, help_heading = "Effort")]
    pub time: Option<Duration>,

    /// Go on until the picture is this accurate: 0.05 is 5 % of relative RMSE, by its own estimate
    #[arg(long, value_name = "E", value_parser = target_error, help_heading = "Effort")]
    pub target_error: Option<f64>,

    /// Go on to an error that has a name: draft 20 %, good 5 %, final 1 %
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "target_error",
        help_heading = "Effort"
    )]
    pub quality: Option<Quality>,

    /// Worker threads; 0 is one per core
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = value_parser!(u32).range(0..=1024),
        help_heading = "Effort"
    )]
    pub threads: u32,

    /// SIMD width: paths that one instruction advances
    #[arg(long, value_name = "N", default_value = "8", help_heading = "Effort")]
    pub lanes: Lanes,

    /// Refuse to render what needs more memory than SIZE, like 8GiB or 500MB [default: three
    /// quarters of what there is]
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = "Effort")]
    pub max_memory: Option<u64>,

    /// Print nothing but warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

impl ResumeArgs {
    /// Whether what ends the render is another thing than before.
    pub fn has_effort(&self) -> bool {
        self.mutations.is_some()
            || self.spp.is_some()
            || self.time.is_some()
            || self.target_error.is_some()
            || self.quality.is_some()
    }

    /// As flags of `render`, of a scene and a picture.
    pub fn as_render(&self, scene: Option<PathBuf>, picture: PictureArgs) -> RenderArgs {
        RenderArgs {
            scenes: scene.into_iter().collect(),
            output: self.output.clone(),
            display: self.display.clone(),
            no_png: self.no_png,
            output_every: self.output_every,
            preview: self.preview.clone(),
            keep: KeepArgs {
                checkpoint: Some(self.checkpoint.clone().unwrap_or(self.file.clone())),
                every: self.every,
                shard: None,
            },
            stats: self.stats.clone(),
            errors: self.errors,
            strategies: false,
            picture,
            integrator: None,
            host: None,
            chains: ChainArgs {
                mutations: self.mutations,
                ..ChainArgs::none()
            },
            effects: EffectArgs {
                force_effects: Vec::new(),
            },
            spp: self.spp,
            time: self.time,
            target_error: self.target_error,
            quality: self.quality,
            no_estimate: false,
            threads: self.threads,
            lanes: self.lanes,
            max_memory: self.max_memory,
            quiet: self.quiet,
        }
    }
}

/// Print what a checkpoint or a picture holds
///
/// Of a checkpoint: scene, settings, how far the render is, its error, and the command that goes on
/// with it. Of an .exr that Phalanx has written: the settings and figures of its render. To stdout.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct InfoArgs {
    /// Checkpoint, or picture (.exr)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}
