//! The command line, declared once: flags, their documentation, and what values they take. A flag left out is `None`, and the
//! scene file decides.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::PossibleValue;
use clap::{Args, ColorChoice, Parser, Subcommand, ValueEnum, value_parser};

use super::Failure;
pub use super::compare::args::CompareArgs;
pub use super::replay::args::ReplayArgs;
use crate::chain::counts::{MAX_CHAINS_PER_DEPTH, MAX_DEPTHS};
use crate::chain::mutate::Mutation;
use crate::integrate::{Settings, StrategyChoice, Width, worker_threads};
use crate::plan::Forced;
use crate::scene::{Film, HostKind, IntegratorKind, Scene};

/// Phalanx renders pbrt scenes by Metropolis light transport.
///
/// Thousands of Markov chains march in lockstep, eight to a SIMD register. Scenes are read in the text formats of pbrt-v3 and
/// pbrt-v4.
///
/// Messages and progress go to stderr; stdout carries only what `inspect`, `bench`, `compare`, `converge` and
/// `replay` print.
///
/// Exit codes: 0 success; 1 a file could not be written, or a limit of `compare` does not hold; 2 bad arguments, or a scene or
/// picture that cannot be used; 129, 130 and 143 stopped by SIGHUP, SIGINT and SIGTERM, with the picture so far written.
#[derive(Debug, Parser)]
#[command(
    name = "phalanx",
    version,
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
    Inspect(InspectArgs),
    Bench(BenchArgs),
    Compare(CompareArgs),
    Converge(Box<super::converge::args::ConvergeArgs>),
    Replay(Box<ReplayArgs>),
}

/// Render a scene into picture files
///
/// Flags beat what the scene file says; what neither says is as in pbrt.
///
/// The same scene, seed and settings give the same picture, bit for bit, with any number of threads and lanes, unless --time or a
/// signal ends the render.
///
/// Ctrl-C (SIGINT), SIGTERM or a closed terminal (SIGHUP; not under `nohup`) ends the render and writes the picture so far, correctly
/// normalised; a second signal quits at once.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct RenderArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in Cornell box]
    ///
    /// Without SCENE, the built-in Cornell box is rendered to cornell.exr and cornell.png in the current folder.
    pub scene: Option<PathBuf>,

    /// Write the picture to FILE: .exr, .pfm or .png; may be repeated
    ///
    /// .exr holds linear RGB as 32-bit floats, with the settings and figures of the render as attributes; .pfm the same
    /// without attributes; .png 8-bit sRGB (see --exposure). Equal renders are equal files, byte for byte: times and rates, threads, lanes and
    /// memory are in --stats alone.
    ///
    /// The file is replaced in one step, and keeps its permissions. A pipe or a device is written into; one without an extension gets
    /// what an .exr holds.
    ///
    /// Without -o, the picture is named as the scene's Film "filename" says, or else after SCENE, in the current folder.
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,

    /// Brighten .png files by EV stops (darken, if negative) [default: 0]
    #[arg(long, value_name = "EV", value_parser = exposure, help_heading = "Output")]
    pub exposure: Option<f32>,

    /// Write the figures of the render to FILE, as a JSON object
    ///
    /// Times are in seconds; rates are per second of bootstrap and render; `b` is the mean radiance of the picture as the
    /// chains' normalisation has it, and `b_stderr` its standard error. `relmse` and `relative_error` are the picture's estimated relative mean
    /// squared error and its root; `depths` holds, for each path depth and strategy, acceptance, split R-hat and effective sample sizes;
    /// `tiles` the means and standard errors of tiles of 16 x 16 pixels.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub stats: Option<PathBuf>,

    /// Add layers stderr.R, stderr.G, stderr.B to .exr files: the standard error of each pixel
    ///
    /// From two independent halves of the render, averaged over 5 x 5 pixels.
    #[arg(long, help_heading = "Output")]
    pub error_layers: bool,

    /// Write two pictures of each strategy beside every picture (bdpt)
    ///
    /// Beside a.exr, a.s1.t3.weighted.exr has what paths of 1 vertex from a light and 3 from the camera add to the picture; all weighted ones add
    /// up to it. a.s1.t3.unweighted.exr has what they find if there is no other strategy.
    #[arg(long, help_heading = "Output")]
    pub strategies: bool,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// Algorithm
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub integrator: Option<IntegratorKind>,

    /// Whose samples are mutated (pssmlt) [default: bdpt]
    ///
    /// `--integrator pssmlt --host pt` is `--integrator pssmlt-pt`.
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub host: Option<Host>,

    #[command(flatten)]
    pub chains: ChainArgs,

    #[command(flatten)]
    pub effects: EffectArgs,

    /// Samples per pixel (pt, lt, bdpt)
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=u64::from(u32::MAX)),
        help_heading = "Effort"
    )]
    pub spp: Option<u64>,

    /// Render for SECONDS, bootstrap included
    ///
    /// They count from when the scene is loaded; neither loading nor the building of its tree is cut short, but Ctrl-C ends both at once.
    ///
    /// Takes the place of the scene's mutations or samples per pixel. With --mutations or --spp as well, whichever ends first
    /// ends the render.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = "Effort")]
    pub time: Option<Duration>,

    /// Render until the picture is this accurate: 0.05 is 5 % of relative RMSE, by its own estimate
    ///
    /// Takes the place of the scene's mutations or samples per pixel. With --time, --mutations or --spp as well, whichever ends first ends the
    /// render. Never reached while Markov chains that matter have not mixed (split R-hat above 1.1).
    ///
    /// The relative RMSE is the root of the mean over pixels and channels of (picture - truth)^2 / (truth^2 + 0.01).
    #[arg(long, value_name = "E", value_parser = target_error, help_heading = "Effort")]
    pub target_error: Option<f64>,

    /// Do not estimate the picture's error: slightly faster, in less memory
    #[arg(
        long,
        conflicts_with_all = ["target_error", "error_layers"],
        help_heading = "Effort"
    )]
    pub no_estimate: bool,

    /// Worker threads; 0 is one per core
    ///
    /// Of more than 64, no more than two per core are started.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = value_parser!(u32).range(0..=1024),
        help_heading = "Effort"
    )]
    pub threads: u32,

    /// SIMD width: paths that one instruction advances
    ///
    /// The picture is the same; 1 is for comparison.
    #[arg(long, value_name = "N", default_value = "8", help_heading = "Effort")]
    pub lanes: Lanes,

    /// Refuse to render what needs more memory than SIZE, like 8GiB or 500MB [default: three quarters of what there is]
    ///
    /// The scene is measured while it is read, and the rest of the render before it starts; the message says what needs how much.
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = "Effort")]
    pub max_memory: Option<u64>,

    /// Print nothing but warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

// Not doc comments: clap would take them for the command's description.

// Which picture. Shared by the commands that must see the same one.
#[derive(Clone, Debug, Args)]
pub struct PictureArgs {
    /// Size of the full picture in pixels
    ///
    /// The framing stays as it is: where the shape of the picture changes, the shorter side shows what it showed before. A
    /// crop window keeps its proportions.
    #[arg(long, value_name = "WxH", value_parser = resolution, help_heading = "Picture")]
    pub resolution: Option<(u32, u32)>,

    /// Render part of the picture, in fractions of its size from the left and top
    ///
    /// Pixels ceil(x0 * W) to ceil(x1 * W), as pbrt does it: adjacent windows tile without overlap.
    #[arg(
        long,
        value_name = "X0,X1,Y0,Y1",
        value_parser = crop,
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub crop: Option<[f32; 4]>,
}

// Which chains, and how they mutate. Shared by the commands that must make the same ones.
#[derive(Clone, Debug, Args)]
pub struct ChainArgs {
    /// Most scattering events on a path
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)),
        help_heading = "Algorithm"
    )]
    pub max_depth: Option<u32>,

    /// Markov chains, over all path depths (mmlt, pssmlt)
    ///
    /// Every depth that carries light (mmlt) gets at least 512, or N if that is fewer.
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_CHAINS_PER_DEPTH as u64),
        help_heading = "Algorithm"
    )]
    pub chains: Option<u64>,

    /// Independent paths, per depth (mmlt) or in all (pssmlt), that estimate the picture's brightness and start the chains
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_BOOTSTRAP),
        help_heading = "Algorithm"
    )]
    pub bootstrap: Option<u64>,

    /// Probability of a mutation that forgets the current path, 0 to 1; or auto (mmlt, pssmlt)
    ///
    /// `auto` chooses it for each path depth (mmlt) or for all of them (pssmlt) before the render starts, from what some chains do meanwhile: so that pixels get the most
    /// independent samples.
    #[arg(
        long,
        alias = "large-step-probability",
        value_name = "P",
        value_parser = probability,
        help_heading = "Algorithm"
    )]
    pub large_step: Option<Tuned>,

    /// How small mutations move primary samples (mmlt, pssmlt) [default: gaussian]
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub mutation: Option<Mutation>,

    /// Scale of small mutations, in primary sample space; or auto (mmlt, pssmlt)
    ///
    /// The standard deviation of gaussian ones, and half the width of cauchy ones (half of them move less); those of kelemen move by S / 10 to 1.6 S, by
    /// 1/1024 to 1/64 if S is 0.01. `auto` tries out, for each path depth (mmlt) or for all of them (pssmlt) and before the render starts,
    /// what has half of all small mutations accepted.
    #[arg(long, value_name = "S", value_parser = sigma, help_heading = "Algorithm")]
    pub sigma: Option<Tuned>,

    /// How chains choose among the bidirectional strategies of their depth (mmlt) [default: uniform]
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub strategy_choice: Option<ChoiceName>,

    /// Random seed [default: the scene's, or 0]
    #[arg(long, value_name = "N", help_heading = "Algorithm")]
    pub seed: Option<u64>,

    /// Mutations per pixel (mmlt, pssmlt)
    ///
    /// One of mmlt mutates a path of one depth, one of pssmlt a sample of all depths.
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_MUTATIONS),
        help_heading = "Effort"
    )]
    pub mutations: Option<u64>,
}

// What runs beside what the scene calls for. Shared by the commands that plan a render.
#[derive(Clone, Debug, Args)]
pub struct EffectArgs {
    /// Turn on effects that the scene does not call for: all, or some of them, separated by commas
    ///
    /// To see what they cost, and that they change nothing: the picture stays the same but for noise.
    #[arg(
        long,
        value_name = "EFFECTS",
        value_delimiter = ',',
        hide_short_help = true,
        help_heading = "Algorithm"
    )]
    pub force_effects: Vec<Forced>,
}

/// Print what a scene holds and how it would be rendered
///
/// Counts, bounds, camera, film and settings; the tree rays are traced through; and the plan: which kernels and
/// bidirectional strategies the scene calls for, and why. To stdout.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct InspectArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in Cornell box]
    pub scene: Option<PathBuf>,

    /// Most scattering events on a path [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..i64::from(MAX_DEPTHS)))]
    pub max_depth: Option<u32>,

    #[command(flatten)]
    pub effects: EffectArgs,

    /// Print a JSON object in place of tables
    ///
    /// Lengths are those of the scene file; sizes are in bytes, times in seconds.
    #[arg(long)]
    pub json: bool,
}

/// Measure how fast this machine renders a scene, and where the time goes
///
/// What eight SIMD lanes buy over one, what threads buy, what each stage of a mutation takes, and how full the lanes are; for
/// Markov chains, whatever the scene file asks for. To stdout, as tables or as JSON.
///
/// What is compared takes turns in seven short rounds; figures are medians. No picture is written.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct BenchArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz) [default: a built-in Cornell box]
    pub scene: Option<PathBuf>,

    /// Time for each side of each comparison
    ///
    /// There are four for lanes, two for the error estimate, and one for each number of threads. In less than a second the rounds scatter: long paths carry
    /// little light, and not every round has their turn.
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

impl ValueEnum for Forced {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
}

impl ValueEnum for IntegratorKind {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        // As a sentence begins.
        let mut title = self.title().to_owned();
        title[..1].make_ascii_uppercase();
        let value = PossibleValue::new(self.name()).help(title);
        Some(match self {
            Self::Pssmlt(Host::DEFAULT) => value.alias("pssmlt"),
            _ => value,
        })
    }
}

/// Whose samples are mutated, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Host {
    /// Bidirectional path tracing
    Bdpt,
    /// Path tracing
    Pt,
}

impl Host {
    const DEFAULT: HostKind = HostKind::Bdpt;

    pub fn kind(self) -> HostKind {
        match self {
            Host::Bdpt => HostKind::Bdpt,
            Host::Pt => HostKind::Pt,
        }
    }
}

impl ValueEnum for Mutation {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Gaussian => "Normally distributed",
            Self::Kelemen => {
                "All orders of magnitude between two bounds alike (Kelemen et al. 2002)"
            }
            Self::Cauchy => "Mostly short, now and then very long",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// A number, or none: it is tuned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tuned {
    Auto,
    Is(f32),
}

impl Tuned {
    /// Sigma. Where it is tuned, the search begins at what the settings have.
    pub fn set_sigma(self, s: &mut Settings) {
        s.tune.sigma = self == Tuned::Auto;
        if let Tuned::Is(value) = self {
            s.sigma = value;
        }
    }

    /// The probability of large steps.
    pub fn set_large_step(self, s: &mut Settings) {
        s.tune.large_step = self == Tuned::Auto;
        if let Tuned::Is(value) = self {
            s.large_step_probability = value;
        }
    }
}

impl fmt::Display for Tuned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Tuned::Auto => write!(f, "auto"),
            Tuned::Is(value) => write!(f, "{value}"),
        }
    }
}

/// How chains choose strategies, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ChoiceName {
    /// Each strategy of a depth as often as any other
    Uniform,
    /// More often those that the bootstrap has seen carry light, none less than half as often as uniformly
    Learned,
}

impl ChoiceName {
    /// The setting of that name.
    pub fn setting(self) -> StrategyChoice {
        match self {
            ChoiceName::Uniform => StrategyChoice::Uniform,
            ChoiceName::Learned => StrategyChoice::Learned,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lanes {
    #[value(name = "1")]
    One,
    #[value(name = "8")]
    Eight,
}

/// Every bootstrap path leaves a number in memory.
pub(super) const MAX_BOOTSTRAP: u64 = 1 << 32;
const MAX_MUTATIONS: u64 = 1 << 40;
/// Mutations or samples per pixel where only the error counts: nobody waits for more, and the film keeps its precision.
const ENDLESS: u64 = 1 << 20;
/// Thirty years.
const MAX_SECONDS: f64 = 1e9;
/// Mutations or samples a second that no machine reaches per thread: the effort where only time counts.
const UNREACHABLE_RATE: f64 = 2e8;

impl RenderArgs {
    /// Applies the flags to what the scene says. `pixels` is the size of the crop window.
    pub fn apply(&self, settings: &mut Settings, pixels: u64) {
        let s = settings;
        s.integrator = self.integrator.unwrap_or(s.integrator);
        if let (IntegratorKind::Pssmlt(_), Some(host)) = (s.integrator, self.host) {
            s.integrator = IntegratorKind::Pssmlt(host.kind());
        }
        s.strategies |= self.strategies;
        s.threads = self.threads as usize;
        s.lanes = match self.lanes {
            Lanes::One => Width::One,
            Lanes::Eight => Width::Eight,
        };
        s.time = self.time;
        if let Some(time) = self.time {
            let threads = worker_threads(s.threads);
            let most =
                time.as_secs_f64() * UNREACHABLE_RATE * threads as f64 / pixels.max(1) as f64;
            s.mutations_per_pixel = (most.ceil() as u64).clamp(1, MAX_MUTATIONS);
            s.samples_per_pixel = (most.ceil() as u64).clamp(1, u64::from(u32::MAX));
        }
        let set = |value: &mut u64, flag: Option<u64>| *value = flag.unwrap_or(*value);
        s.target_error = self.target_error;
        s.estimate_error = !self.no_estimate;
        s.forced = self.effects.force_effects.clone();
        s.error_layers = self.error_layers;
        if self.target_error.is_some() && self.time.is_none() {
            s.mutations_per_pixel = ENDLESS;
            s.samples_per_pixel = ENDLESS;
        }
        self.chains.apply(s);
        set(&mut s.samples_per_pixel, self.spp);
    }

    /// Flags given that mean nothing to an integrator.
    pub fn idle(&self, integrator: IntegratorKind) -> Vec<&'static str> {
        let mut idle = match integrator.mutates() {
            true => self.spp.iter().map(|_| "--spp").collect(),
            false => self.chains.given(),
        };
        let whole = matches!(integrator, IntegratorKind::Pssmlt(_));
        if whole && self.chains.strategy_choice.is_some() {
            idle.push("--strategy-choice");
        }
        if !whole && self.host.is_some() {
            idle.push("--host");
        }
        if self.strategies && integrator != IntegratorKind::Bdpt {
            idle.push("--strategies");
        }
        idle
    }
}

impl PictureArgs {
    /// Applies the flags to a scene.
    pub(super) fn apply(&self, scene: &mut Scene) -> Result<(), Failure> {
        let flag = |name, e| Failure::Input(format!("{name}: {e}"));
        if let Some((width, height)) = self.resolution {
            let set = scene.set_resolution(width, height);
            set.map_err(|e| flag("--resolution", e))?;
        }
        if let Some(crop) = self.crop {
            scene.film.set_crop(crop).map_err(|e| flag("--crop", e))?;
        }
        Ok(())
    }
}

impl ChainArgs {
    /// Applies the flags to what the scene says.
    pub fn apply(&self, s: &mut Settings) {
        let set = |value: &mut u64, flag: Option<u64>| *value = flag.unwrap_or(*value);
        set(&mut s.seed, self.seed);
        set(&mut s.mutations_per_pixel, self.mutations);
        set(&mut s.chains, self.chains);
        set(&mut s.bootstrap, self.bootstrap);
        s.max_depth = self.max_depth.unwrap_or(s.max_depth);
        if let Some(probability) = self.large_step {
            probability.set_large_step(s);
        }
        s.mutation = self.mutation.unwrap_or(s.mutation);
        if let Some(sigma) = self.sigma {
            sigma.set_sigma(s);
        }
        if let Some(choice) = self.strategy_choice {
            s.strategy_choice = choice.setting();
        }
    }

    /// Flags given that only chains know.
    pub fn given(&self) -> Vec<&'static str> {
        let flags = [
            ("--mutations", self.mutations.is_some()),
            ("--chains", self.chains.is_some()),
            ("--bootstrap", self.bootstrap.is_some()),
            ("--large-step", self.large_step.is_some()),
            ("--mutation", self.mutation.is_some()),
            ("--sigma", self.sigma.is_some()),
            ("--strategy-choice", self.strategy_choice.is_some()),
        ];
        flags.into_iter().filter(|f| f.1).map(|f| f.0).collect()
    }
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        Ok(_) => Err("it is not finite".into()),
        Err(_) => Err("it is not a number".into()),
    }
}

pub(super) fn number_in(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value = number(text)?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{text} is not in {least}..={most}"))
    }
}

pub(super) fn probability(text: &str) -> Result<Tuned, String> {
    tuned(text, 1.0)
}

pub(super) fn sigma(text: &str) -> Result<Tuned, String> {
    tuned(text, 1e6)
}

fn tuned(text: &str, most: f64) -> Result<Tuned, String> {
    match text.trim() {
        "auto" => Ok(Tuned::Auto),
        text => match number_in(text, 0.0, most) {
            Ok(value) => Ok(Tuned::Is(value as f32)),
            Err(e) => Err(format!("{e}, nor auto")),
        },
    }
}

pub(super) fn exposure(text: &str) -> Result<f32, String> {
    number_in(text, -100.0, 100.0).map(|v| v as f32)
}

fn seconds(text: &str) -> Result<Duration, String> {
    let time = Duration::from_secs_f64(number_in(text, 0.0, MAX_SECONDS)?);
    if time.is_zero() {
        // Or less than a nanosecond.
        return Err("it must be more than 0".into());
    }
    Ok(time)
}

fn target_error(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err("it must be more than 0".into())
    }
}

/// An hour at most: the film must not overflow.
fn bench_seconds(text: &str) -> Result<Duration, String> {
    number_in(text, 0.001, 3600.0).map(Duration::from_secs_f64)
}

fn batch(text: &str) -> Result<usize, String> {
    number_in(text, 1.0, MAX_CHAINS_PER_DEPTH as f64)?;
    text.trim()
        .parse()
        .map_err(|_| "it is not a whole number".into())
}

/// Bytes, with a unit: kB, MB, GB are powers of 1000, KiB, MiB, GiB of 1024.
fn size(text: &str) -> Result<u64, String> {
    match text.trim().parse::<bytesize::ByteSize>() {
        Ok(size) if size.0 > 0 => Ok(size.0),
        Ok(_) => Err("it must be more than nothing".into()),
        Err(_) => Err("expected a size like 8GiB or 500MB".into()),
    }
}

pub(super) fn resolution(text: &str) -> Result<(u32, u32), String> {
    let expected = || "expected width and height in pixels, like 640x480".to_string();
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let side = |t: &str| t.trim().parse::<u64>().map_err(|_| expected());
    let size = (side(w)?, side(h)?);
    Film::check_size(size.0, size.1).map_err(|e| e.to_string())
}

fn crop(text: &str) -> Result<[f32; 4], String> {
    let values: Result<Vec<f64>, String> = text.split(',').map(number).collect();
    let [x0, x1, y0, y1] = values?[..] else {
        return Err("expected four fractions x0,x1,y0,y1, like 0.25,0.75,0,1".into());
    };
    if ![x0, x1, y0, y1].iter().all(|v| (0.0..=1.0).contains(v)) {
        return Err("fractions lie between 0 and 1".into());
    }
    if x0 >= x1 || y0 >= y1 {
        return Err("it is empty: x0 must be less than x1, and y0 less than y1".into());
    }
    Ok([x0, x1, y0, y1].map(|v| v as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use proptest::prelude::*;

    #[test]
    fn declarations_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn values() {
        assert_eq!(resolution("640x480"), Ok((640, 480)));
        for bad in ["640", "0x5", "x", "-1x5", "99999999x1", "131072x131072"] {
            assert!(resolution(bad).is_err(), "{bad}");
        }
        assert_eq!(crop("0,1,0.25,.5"), Ok([0.0, 1.0, 0.25, 0.5]));
        for bad in ["0,1,0", "0,1,0,2", "1,0,0,1", "0,1,0,nan", "", "0,1,0,1,1"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        for bad in ["nan", "inf", "1.01", "-0.1", "x", ""] {
            assert!(probability(bad).is_err(), "{bad}");
        }
        assert_eq!(probability("auto"), Ok(Tuned::Auto));
        assert_eq!(sigma("0.5"), Ok(Tuned::Is(0.5)));
        for bad in ["nan", "inf", "0", "-1", "1e300", "1e-300"] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
        assert_eq!(size("8GiB"), Ok(8 << 30));
        assert_eq!(size("1.5 MB"), Ok(1_500_000));
        for bad in ["0", "-1", "x", "", "5 furlongs", "nan"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    proptest! {
        #![proptest_config(crate::property::cases(1000))]

        /// Numbers, and what people may take for them: a value in its range, or a message.
        #[test]
        fn values_are_in_range_or_refused(
            text in "[-+ ]?([0-9]{0,12}[.]?[0-9]{0,4}(e[-+]?[0-9]{1,4})?|nan|inf|\\PC{0,8})",
            separator in "[xX, ]",
        ) {
            let within = |value: Result<f32, String>, least: f32, most: f32| {
                value.map_or(true, |v| (least..=most).contains(&v))
            };
            let tuned = |value: Result<Tuned, String>| value.map(|v| match v {
                Tuned::Auto => 0.0,
                Tuned::Is(v) => v,
            });
            prop_assert!(within(tuned(probability(&text)), 0.0, 1.0));
            prop_assert!(within(tuned(sigma(&text)), 0.0, 1e6));
            prop_assert!(within(exposure(&text), -100.0, 100.0));
            prop_assert!(seconds(&text).map_or(true, |t| !t.is_zero() && t.as_secs_f64() <= MAX_SECONDS));
            prop_assert!(target_error(&text).map_or(true, |e| e > 0.0 && e.is_finite()));
            prop_assert!(bench_seconds(&text).map_or(true, |t| !t.is_zero()));
            prop_assert!(batch(&text).map_or(true, |n| n >= 1));
            let list = [text.as_str(); 4].join(&separator);
            prop_assert!(resolution(&list).is_err());
            prop_assert!(crop(&list).is_err());
            let pair = format!("{text}{separator}{text}");
            prop_assert!(resolution(&pair).map_or(true, |(w, h)| w >= 1 && h >= 1));
        }

        /// Sizes and windows are what they say.
        #[test]
        fn sizes_are_as_written(w in 1..20_000u32, h in 1..20_000u32, x in 0f32..1.0, y in 0f32..1.0) {
            prop_assert_eq!(resolution(&format!(" {w} x{h}")), Ok((w, h)));
            prop_assert_eq!(crop(&format!("{x},1, {y} ,1")), Ok([x, 1.0, y, 1.0]));
        }
    }
}
