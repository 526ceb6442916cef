//! Flags of the commands that render no picture: `inspect` and `bench`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, value_parser};

use super::parse::{batch, bench_seconds};
use super::{EffectArgs, MAX_BOOTSTRAP};
use crate::chain::counts::MAX_DEPTHS;
use crate::scene::IntegratorKind;

/// Print what a scene holds and how it would be rendered
///
/// Counts, bounds, camera, film and settings; the tree rays are traced through; and the plan: which
/// kernels and bidirectional strategies the scene calls for, and why. To stdout.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct InspectArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in studio]
    pub scene: Option<PathBuf>,

    /// Most scattering events on a path [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)))]
    pub max_depth: Option<u32>,

    #[command(flatten)]
    pub effects: EffectArgs,

    /// Render for a second, and say how long errors of 10, 5 and 1 % take
    #[arg(long)]
    pub estimate: bool,

    /// Print all of the plan: effects that are left out, and what paths of each depth consist of
    #[arg(long)]
    pub plan: bool,

    /// Print a JSON object in place of tables
    ///
    /// Lengths are those of the scene file; sizes are in bytes, times in seconds.
    #[arg(long)]
    pub json: bool,
}

/// Measure how fast this machine renders a scene, and where the time goes
///
/// What eight SIMD lanes buy over one, what threads buy, what each stage of a mutation takes, and
/// how full the lanes are; for Markov chains, whatever the scene file asks for. To stdout, as
/// tables or as JSON.
///
/// What is compared takes turns in seven short rounds; figures are medians. No picture is written.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct BenchArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in studio]
    pub scene: Option<PathBuf>,

    /// Time for each side of each comparison
    ///
    /// There are four for lanes, two for the error estimate, and one for each number of threads.
    /// In less than a second the rounds scatter: long paths carry little light, and not every
    /// round has their turn.
    #[arg(long, value_name = "SECONDS", default_value = "2", value_parser = bench_seconds)]
    pub seconds: Duration,

    /// Write all figures to FILE, as JSON; `-` is stdout, and takes the place of the tables
    ///
    /// Names end in their units; `median`, `min` and `max` are over the rounds.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,

    /// Most threads to measure; 0 is one per core
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = value_parser!(u32).range(0..=1024)
    )]
    pub threads: u32,

    /// Algorithm: mmlt, or one of pssmlt [default: mmlt]
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<IntegratorKind>,

    /// Markov chains that march together, of each depth [default: as renders do]
    #[arg(long, value_name = "N", value_parser = batch)]
    pub batch: Option<usize>,

    /// Most scattering events on a path [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)))]
    pub max_depth: Option<u32>,

    #[command(flatten)]
    pub effects: EffectArgs,

    /// Independent paths per depth that start the chains [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(1..=MAX_BOOTSTRAP))]
    pub bootstrap: Option<u64>,

    /// Random seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Print nothing but the figures, warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}
