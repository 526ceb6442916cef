//! Flags of `phalanx converge`. Those that name settings take lists: every combination runs.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::chain::counts::{MAX_CHAINS_PER_DEPTH, MAX_DEPTHS};
use crate::chain::mutate::Mutation;
use crate::cli::args::MAX_BOOTSTRAP;
use crate::cli::args::parse::{number_in, probability, resolution, sigma, stops};
use crate::cli::args::values::{ChoiceName, Lanes, Tuned};
use crate::converge::plan::{Axis, MAX_EFFORT};
use crate::integrate::Width;
use crate::scene::IntegratorKind;

/// Run integrators and settings against each other, and draw their error against time
///
/// Every variant (an integrator with one combination of settings) renders every scene with budgets
/// of time that double, several seeds each, in turns. Errors are relative mean squared errors
/// against a reference; the reference's own error is estimated and subtracted. Tables go to stdout;
/// a page with curves, tables, pictures and error maps, the curves as SVG, and all figures as
/// CSV go to a folder.
///
/// Lists are separated by commas: --integrators pt,mmlt --lanes 1,8 --large-step 0.1,0.3. Flags
/// that mean nothing to an integrator do not multiply its variants.
///
/// Ctrl-C (SIGINT), SIGTERM or SIGHUP drops the run under way and reports those that are complete;
/// a second signal quits at once.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct ConvergeArgs {
    /// Scene files, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in studio]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Algorithms
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "pt,mmlt",
        help_heading = "Variants"
    )]
    pub integrators: Vec<IntegratorKind>,

    /// SIMD widths
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        default_value = "8",
        help_heading = "Variants"
    )]
    pub lanes: Vec<Lanes>,

    /// Most scattering events on a path [default: as the scene says]
    ///
    /// Of several, the reference has the largest.
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)),
        help_heading = "Variants"
    )]
    pub max_depth: Vec<u32>,

    /// Markov chains, over all path depths (mmlt, pssmlt) [default: as the scene says]
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        value_parser = value_parser!(u64).range(1..=MAX_CHAINS_PER_DEPTH as u64),
        help_heading = "Variants"
    )]
    pub chains: Vec<u64>,

    /// Independent paths, per depth (mmlt) or in all (pssmlt), that start the chains [default: as
    /// the scene says]
    #[arg(
        long,
        value_name = "N,...",
        value_delimiter = ',',
        value_parser = value_parser!(u64).range(1..=MAX_BOOTSTRAP),
        help_heading = "Variants"
    )]
    pub bootstrap: Vec<u64>,

    /// Probabilities of large mutations, 0 to 1, or auto (mmlt, pssmlt) [default: as the scene
    /// says]
    #[arg(
        long,
        alias = "large-step-probability",
        value_name = "P,...",
        value_delimiter = ',',
        value_parser = probability,
        help_heading = "Variants"
    )]
    pub large_step: Vec<Tuned>,

    /// How small mutations move primary samples (mmlt, pssmlt) [default: gaussian]
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        help_heading = "Variants"
    )]
    pub mutation: Vec<Mutation>,

    /// Scales of small mutations, or auto (mmlt, pssmlt) [default: as the scene says]
    #[arg(
        long,
        value_name = "S,...",
        value_delimiter = ',',
        value_parser = sigma,
        help_heading = "Variants"
    )]
    pub sigma: Vec<Tuned>,

    /// How chains choose among the strategies of their depth (mmlt) [default: uniform]
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        help_heading = "Variants"
    )]
    pub strategy_choice: Vec<ChoiceName>,

    /// Number of budgets; each is twice the one before
    #[arg(
        long,
        value_name = "N",
        default_value_t = 6,
        value_parser = value_parser!(u32).range(1..=24),
        help_heading = "Effort"
    )]
    pub budgets: u32,

    /// The first budget: time of tree, bootstrap and render
    ///
    /// A trial run of each variant finds what fits in it.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value = "0.25",
        value_parser = first_seconds,
        help_heading = "Effort"
    )]
    pub first_seconds: f64,

    /// The first budget in mutations or samples per pixel, in place of --first-seconds
    ///
    /// The work, and with it every error, is then the same on any machine.
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_EFFORT),
        conflicts_with = "first_seconds",
        help_heading = "Effort"
    )]
    pub first_effort: Option<u64>,

    /// Runs of each variant at each budget
    ///
    /// With one there are no error bars.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3,
        value_parser = value_parser!(u64).range(1..=10_000),
        help_heading = "Effort"
    )]
    pub seeds: u64,

    /// The first seed; the others count on from it
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Effort")]
    pub seed: u64,

    /// Worker threads; 0 is one per core
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = value_parser!(u32).range(0..=1024),
        help_heading = "Effort"
    )]
    pub threads: u32,

    /// Size of the full picture in pixels, for all scenes
    #[arg(long, value_name = "WxH", value_parser = resolution, help_heading = "Effort")]
    pub resolution: Option<(u32, u32)>,

    /// Compare with FILE (.exr or .pfm) rather than render a reference; one for each scene, in
    /// their order
    #[arg(
        long,
        value_name = "FILE,...",
        value_delimiter = ',',
        help_heading = "Reference"
    )]
    pub reference: Vec<PathBuf>,

    /// What is known of the relMSE of each --reference, to be subtracted [default: nothing]
    #[arg(
        long,
        value_name = "RELMSE,...",
        value_delimiter = ',',
        value_parser = reference_error,
        requires = "reference",
        help_heading = "Reference"
    )]
    pub reference_error: Vec<f64>,

    /// Algorithm of the reference that is rendered
    #[arg(
        long,
        value_name = "NAME",
        default_value = "mmlt",
        conflicts_with = "reference",
        help_heading = "Reference"
    )]
    pub reference_integrator: IntegratorKind,

    /// Budget of the reference that is rendered, in multiples of the largest
    #[arg(
        long,
        value_name = "FACTOR",
        default_value = "16",
        value_parser = reference_factor,
        conflicts_with = "reference",
        help_heading = "Reference"
    )]
    pub reference_factor: f64,

    /// Independent parts of that reference: their scatter tells its error
    #[arg(
        long,
        value_name = "N",
        default_value_t = 4,
        value_parser = value_parser!(u64).range(2..=1024),
        conflicts_with = "reference",
        help_heading = "Reference"
    )]
    pub reference_parts: u64,

    /// Folder of the report; made if it is missing, and what is in it replaced
    #[arg(
        short,
        long,
        value_name = "DIR",
        default_value = "converge",
        help_heading = "Output"
    )]
    pub output: PathBuf,

    /// Brighten the report's pictures by EV stops (darken, if negative)
    #[arg(
        long,
        value_name = "EV",
        default_value = "0",
        value_parser = stops,
        help_heading = "Output"
    )]
    pub exposure: f32,

    /// Write all figures to FILE, as JSON; `-` is stdout, and takes the place of the tables
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Print nothing but the figures, warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

/// Ten hours for the first budget: nobody waits for more.
fn first_seconds(text: &str) -> Result<f64, String> {
    number_in(text, 1e-3, 36_000.0)
}

fn reference_error(text: &str) -> Result<f64, String> {
    number_in(text, 0.0, 1e6)
}

fn reference_factor(text: &str) -> Result<f64, String> {
    number_in(text, 1e-3, 1e6)
}

fn any(_: IntegratorKind) -> bool {
    true
}

/// Those that choose among the strategies of a depth.
fn multiplexed(kind: IntegratorKind) -> bool {
    matches!(kind, IntegratorKind::Auto | IntegratorKind::Mmlt)
}

/// Those that mutate paths.
fn metropolis(kind: IntegratorKind) -> bool {
    kind.mutates()
}

impl ConvergeArgs {
    /// The settings that are swept, each with the flag it comes from.
    pub fn axes(&self) -> Vec<(&'static str, Axis)> {
        let width = |lanes: &Lanes| match lanes {
            Lanes::One => Width::One,
            Lanes::Eight => Width::Eight,
        };
        let widths: Vec<Width> = self.lanes.iter().map(width).collect();
        fn text<T: ToString>(value: T) -> String {
            value.to_string()
        }
        vec![
            (
                "--lanes",
                Axis::new(
                    "lanes",
                    any,
                    &widths,
                    |w| text(w.lanes()),
                    |s, v| {
                        s.lanes = v;
                    },
                ),
            ),
            (
                "--max-depth",
                Axis::new("max depth", any, &self.max_depth, text, |s, v| {
                    s.max_depth = v
                }),
            ),
            (
                "--chains",
                Axis::new("chains", metropolis, &self.chains, text, |s, v| {
                    s.chains = v
                }),
            ),
            (
                "--bootstrap",
                Axis::new("bootstrap", metropolis, &self.bootstrap, text, |s, v| {
                    s.bootstrap = v;
                }),
            ),
            (
                "--large-step",
                Axis::new("large step", metropolis, &self.large_step, text, |s, v| {
                    v.set_large_step(s);
                }),
            ),
            (
                "--mutation",
                Axis::new(
                    "mutation",
                    metropolis,
                    &self.mutation,
                    |m| text(m.name()),
                    |s, v| s.mutation = v,
                ),
            ),
            (
                "--sigma",
                Axis::new("sigma", metropolis, &self.sigma, text, |s, v| {
                    v.set_sigma(s)
                }),
            ),
            (
                "--strategy-choice",
                Axis::new(
                    "strategy choice",
                    multiplexed,
                    &self.strategy_choice,
                    |c| text(c.setting().name()),
                    |s, v| s.strategy_choice = v.setting(),
                ),
            ),
        ]
    }
}
