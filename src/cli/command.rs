//! All subcommands.

use clap::{ColorChoice, Parser, Subcommand};

use super::about::{CompletionsArgs, ManArgs};
use super::args::RenderArgs;
use super::args::look::{BenchArgs, InspectArgs};
use super::args::merge::MergeArgs;
use super::args::resume::{InfoArgs, ResumeArgs};
use super::compare::args::CompareArgs;
use super::converge::args::ConvergeArgs;
use super::convert::ConvertArgs;
use super::replay::args::ReplayArgs;

/// Phalanx renders pbrt scenes by Metropolis light transport.
///
/// Thousands of Markov chains march in lockstep, eight to a SIMD register. Scenes are read in the
/// text formats of pbrt-v3 and pbrt-v4.
///
/// `phalanx SCENE` is short for `phalanx render SCENE`, if SCENE ends in .pbrt or .pbrt.gz.
///
/// Messages and progress go to stderr; stdout carries only what `inspect`, `bench`, `compare`,
/// `info`, `converge`, `replay`, `completions` and `man` print.
///
/// Exit codes: 0 success; 1 a file could not be written, or a limit of `compare` does not hold; 2
/// bad arguments, or a scene or picture that cannot be used; 129, 130 and 143 stopped by SIGHUP,
/// SIGINT and SIGTERM, with the picture so far written.
#[derive(Debug, Parser)]
#[command(
    name = "phalanx",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    args_override_self = true
)]
pub struct Cli {
    /// When to colour messages
    ///
    /// `auto` colours where stderr is a terminal, unless the environment variable NO_COLOR is set.
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        help_heading = "Messages"
    )]
    pub color: ColorChoice,

    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Render(Box<RenderArgs>),
    Resume(Box<ResumeArgs>),
    Merge(MergeArgs),
    Info(InfoArgs),
    Inspect(InspectArgs),
    Bench(BenchArgs),
    Compare(CompareArgs),
    Converge(Box<ConvergeArgs>),
    Replay(Box<ReplayArgs>),
    Convert(ConvertArgs),
    Completions(CompletionsArgs),
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn declarations_are_consistent() {
        Cli::command().debug_assert();
    }
}
