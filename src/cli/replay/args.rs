//! Flags of `phalanx replay`.

use std::path::PathBuf;

use clap::{ArgGroup, Args, value_parser};

use crate::chain::counts::{MAX_CHAINS_PER_DEPTH, MAX_DEPTHS};
use crate::cli::args::{ChainArgs, PictureArgs};
use crate::scene::IntegratorKind;

/// Evaluate one path again, step by step, in single and in double precision
///
/// Either what a Markov chain of a render did in one iteration (--chain, --iteration): where it
/// stood, and what it proposed; or the path that given primary samples stand for (--samples). To
/// stdout: the vertices of both subpaths, throughputs, densities, MIS weight and contribution, as
/// the render computes them to the last bit; and beside them the same figures in double precision,
/// from the same vertices and from the same primary samples.
///
/// With the flags of the render (seed, effort, picture), chains are those of the render. Lengths
/// are in internal space: the scene scaled to a radius of about 1 around its centre.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    args_override_self = true,
    group(ArgGroup::new("path").required(true).args(["chain", "samples", "samples_file"]))
)]
pub struct ReplayArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in studio]
    pub scene: Option<PathBuf>,

    /// Depth of the path: scattering events
    #[arg(
        long,
        value_name = "K",
        value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)),
        help_heading = "Path"
    )]
    pub depth: u32,

    /// Chain of that depth, from 0
    #[arg(
        long,
        value_name = "J",
        requires = "iteration",
        value_parser = value_parser!(u64).range(..MAX_CHAINS_PER_DEPTH as u64),
        help_heading = "Path"
    )]
    pub chain: Option<u64>,

    /// Iteration of the chain, from 0: the proposal made in it, and the state before
    #[arg(long, value_name = "N", requires = "chain", help_heading = "Path")]
    pub iteration: Option<u32>,

    /// Primary samples of the path, in [0, 1), separated by commas or spaces; `-` reads them from
    /// stdin
    ///
    /// The first chooses among the strategies of the depth uniformly, whatever the chains of a
    /// render have learned.
    #[arg(
        long,
        value_name = "U,U,...",
        allow_hyphen_values = true,
        help_heading = "Path"
    )]
    pub samples: Option<String>,

    /// File with the primary samples; `-` is stdin
    #[arg(long, value_name = "FILE", help_heading = "Path")]
    pub samples_file: Option<PathBuf>,

    /// Print JSON in place of tables
    #[arg(long, help_heading = "Path")]
    pub json: bool,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// Integrator of the render, auto or mmlt [default: the scene's, else mmlt]
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub integrator: Option<IntegratorKind>,

    #[command(flatten)]
    pub chains: ChainArgs,

    /// Print nothing but the path, warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}
