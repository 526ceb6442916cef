//! The command line, declared once: flags, their documentation, and what values they take. A flag
//! left out is `None`, and the scene file decides.

pub(super) mod errors;
mod fitting;
mod keep;
pub(super) mod look;
pub(super) mod merge;
pub(super) mod parse;
pub(super) mod preview;
pub(super) mod resume;
pub(super) mod values;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, value_parser};

use self::errors::ErrorArgs;
use self::keep::KeepArgs;
use self::parse::{
    crop, exposure, file, probability, resolution, seconds, sigma, size, target_error,
};
use self::preview::PreviewArgs;
use self::values::{ChoiceName, Exposure, Host, Lanes, Quality, Tuned};
use super::failure::Failure;
use super::ranks::processes;
use crate::chain::counts::{MAX_CHAINS_PER_DEPTH, MAX_DEPTHS};
use crate::chain::mutate::Mutation;
use crate::formats::tone::{Display, Tonemap};
use crate::integrate::{Settings, Width, worker_threads};
use crate::plan::Forced;
use crate::scene::{IntegratorKind, Scene};

/// Render a scene into picture files
///
/// Flags beat what the scene file says; what neither says is as in pbrt.
///
/// The same scene, seed and settings give the same picture, bit for bit, with any number of threads
/// and lanes, unless --time or a signal ends the render.
///
/// Ctrl-C (SIGINT), SIGTERM or a closed terminal (SIGHUP; not under `nohup`) ends the render and
/// writes the picture so far, correctly normalised; a second signal quits at once.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct RenderArgs {
    /// Scene file, pbrt-v3 or pbrt-v4 (.pbrt, .pbrt.gz); - is stdin [default: a built-in
    /// studio]
    ///
    /// Without SCENE, the built-in scene is rendered to studio.exr and studio.png in the
    /// current folder. Several scenes are rendered one after another.
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Write the picture to FILE: .exr, .pfm or .png; - is stdout (.exr); may be repeated
    ///
    /// .exr holds linear RGB as 32-bit floats, with the settings and figures of the render as
    /// attributes; .pfm the same without attributes; .png 8-bit sRGB (see --exposure). Equal
    /// renders are equal files, byte for byte: times and rates, threads, lanes and memory are
    /// in --stats alone.
    ///
    /// The file is replaced in one step, and keeps its permissions. A pipe or a device is written
    /// into; one without an extension gets what an .exr holds.
    ///
    /// Without -o, the picture is named as the scene's Film "filename" says, or else after SCENE,
    /// in the current folder.
    #[arg(short, long, value_name = "FILE", value_parser = file(), help_heading = "Output")]
    pub output: Vec<PathBuf>,

    #[command(flatten)]
    pub display: DisplayArgs,

    /// Do not write a .png beside every .exr
    ///
    /// It has the same name but for the extension, unless -o names a .png itself.
    #[arg(long, help_heading = "Output")]
    pub no_png: bool,

    /// Write all files so far every TIME, while the render goes on: seconds, or 90s, 5m, 1h
    ///
    /// Each, with its layers, replaces the one before in one step: whatever happens, the last
    /// whole one is there. What it misses is what each chain holds at that moment.
    #[arg(long, value_name = "TIME", value_parser = seconds, help_heading = "Output")]
    pub output_every: Option<Duration>,

    #[command(flatten)]
    pub preview: PreviewArgs,

    /// Write the figures of the render to FILE, as a JSON object
    ///
    /// Times are in seconds; rates are per second of bootstrap and render; `b` is the mean
    /// radiance of the picture as the chains' normalisation has it, and `b_stderr` its
    /// standard error. `relmse` and `relative_error` are the picture's estimated relative mean
    /// squared error and its root; `depths` holds, for each path depth and strategy, acceptance,
    /// split R-hat and effective sample sizes; `tiles` the means and standard errors of tiles
    /// of 16 x 16 pixels.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub stats: Option<PathBuf>,

    #[command(flatten)]
    pub errors: ErrorArgs,

    /// Write two pictures of each strategy beside every picture (bdpt)
    ///
    /// Beside a.exr, a.s1.t3.weighted.exr has what paths of 1 vertex from a light and 3 from the
    /// camera add to the picture; all weighted ones add up to it. a.s1.t3.unweighted.exr has
    /// what they find if there is no other strategy.
    #[arg(long, help_heading = "Output")]
    pub strategies: bool,

    #[command(flatten)]
    pub keep: KeepArgs,

    #[command(flatten)]
    pub picture: PictureArgs,

    /// Algorithm [default: the scene's; auto where it names none, mlt or sppm]
    ///
    /// auto begins with a pilot, which measures what samples (bdpt) and chains (mmlt) would leave
    /// as error for the same work. Each path depth then goes to samples, to chains, or is
    /// shared by both; the last lines and --stats say who brings what.
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

    /// Render for this long, bootstrap included: seconds, or 90s, 5m, 1h
    ///
    /// It counts from when the scene is loaded; neither loading nor the building of its tree is
    /// cut short, but Ctrl-C ends both at once.
    ///
    /// Takes the place of the scene's mutations or samples per pixel. With --mutations or --spp as
    /// well, whichever ends first ends the render.
    #[arg(long, value_name = "TIME", value_parser = seconds, help_heading = "Effort")]
    pub time: Option<Duration>,

    /// Render until the picture is this accurate: 0.05 is 5 % of relative RMSE, by its own
    /// estimate
    ///
    /// Takes the place of the scene's mutations or samples per pixel. With --time, --mutations or
    /// --spp as well, whichever ends first ends the render. Never reached while Markov chains
    /// that matter have not mixed (split R-hat above 1.1) and it shows, or while light may be
    /// missing that only chance finds.
    ///
    /// The relative RMSE is the root of the mean over pixels and channels of (picture - truth)^2 /
    /// (truth^2 + 0.01).
    #[arg(long, value_name = "E", value_parser = target_error, help_heading = "Effort")]
    pub target_error: Option<f64>,

    /// Render to an error that has a name: draft 20 %, good 5 %, final 1 %
    ///
    /// The same as --target-error 0.2, 0.05 and 0.01. Four times the work is half the error.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "target_error",
        help_heading = "Effort"
    )]
    pub quality: Option<Quality>,

    /// Do not estimate the picture's error: slightly faster, in less memory
    #[arg(
        long,
        conflicts_with_all = ["target_error", "quality", "error_layers", "despeckle", "firefly_report"],
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

    /// Refuse to render what needs more memory than SIZE, like 8GiB or 500MB [default: three
    /// quarters of what there is]
    ///
    /// The scene is measured while it is read, and the rest of the render before it starts; the
    /// message says what needs how much.
    #[arg(long, value_name = "SIZE", value_parser = size, help_heading = "Effort")]
    pub max_memory: Option<u64>,

    /// Print nothing but warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

// Not doc comments: clap would take them for the command's description.

// How pictures become .png files. Shared by the commands that write them.
#[derive(Clone, Debug, Args)]
pub struct DisplayArgs {
    /// Brighten .png files by EV stops (darken, if negative); or auto [default: 0]
    ///
    /// `auto` makes white of the luminance that 99 % of the pixels are below.
    #[arg(
        long,
        value_name = "EV",
        value_parser = exposure,
        default_value = "0",
        hide_default_value = true,
        help_heading = "Output"
    )]
    pub exposure: Exposure,

    /// How .png files show what is brighter than white
    #[arg(
        long,
        value_name = "NAME",
        default_value = "shoulder",
        help_heading = "Output"
    )]
    pub tonemap: Tonemap,
}

impl DisplayArgs {
    /// What they ask for.
    pub fn display(&self) -> Display {
        Display {
            exposure: match self.exposure {
                Exposure::Auto => None,
                Exposure::Stops(stops) => Some(stops),
            },
            tonemap: self.tonemap,
        }
    }
}

// Which picture. Shared by the commands that must see the same one.
#[derive(Clone, Debug, Args)]
pub struct PictureArgs {
    /// Size of the full picture in pixels
    ///
    /// The framing stays as it is: where the shape of the picture changes, the shorter side shows
    /// what it showed before. A crop window keeps its proportions.
    #[arg(long, value_name = "WxH", value_parser = resolution, help_heading = "Picture")]
    pub resolution: Option<(u32, u32)>,

    /// Render part of the picture, in fractions of its size from the left and top
    ///
    /// Pixels ceil(x0 * W) to ceil(x1 * W), as pbrt does it: adjacent windows tile without
    /// overlap.
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

    /// Markov chains, over all path depths (auto, mmlt, pssmlt)
    ///
    /// Every depth that carries light (auto, mmlt) gets at least 512, or N if that is fewer.
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_CHAINS_PER_DEPTH as u64),
        help_heading = "Algorithm"
    )]
    pub chains: Option<u64>,

    /// Independent paths, per depth (auto, mmlt) or in all (pssmlt), that estimate the picture's
    /// brightness and start the chains
    #[arg(
        long,
        value_name = "N",
        value_parser = value_parser!(u64).range(1..=MAX_BOOTSTRAP),
        help_heading = "Algorithm"
    )]
    pub bootstrap: Option<u64>,

    /// Probability of a mutation that forgets the current path, 0 to 1; or auto (auto, mmlt,
    /// pssmlt)
    ///
    /// `auto` chooses it for each path depth (or for all of them: pssmlt) before the render
    /// starts, from what some chains do meanwhile: so that pixels get the most independent
    /// samples.
    #[arg(
        long,
        alias = "large-step-probability",
        value_name = "P",
        value_parser = probability,
        help_heading = "Algorithm"
    )]
    pub large_step: Option<Tuned>,

    /// How small mutations move primary samples (auto, mmlt, pssmlt) [default: gaussian]
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub mutation: Option<Mutation>,

    /// Scale of small mutations, in primary sample space; or auto (auto, mmlt, pssmlt)
    ///
    /// The standard deviation of gaussian ones, and half the width of cauchy ones (half of them
    /// move less); those of kelemen move by S / 10 to 1.6 S, by 1/1024 to 1/64 if S is 0.01.
    /// `auto` tries out, for each path depth (or for all of them: pssmlt) and before the
    /// render starts, what has half of all small mutations accepted.
    #[arg(long, value_name = "S", value_parser = sigma, help_heading = "Algorithm")]
    pub sigma: Option<Tuned>,

    /// How chains choose among the bidirectional strategies of their depth (auto, mmlt) [default:
    /// uniform]
    #[arg(long, value_name = "NAME", help_heading = "Algorithm")]
    pub strategy_choice: Option<ChoiceName>,

    /// Random seed [default: the scene's, or 0]
    #[arg(long, value_name = "N", help_heading = "Algorithm")]
    pub seed: Option<u64>,

    /// Mutations per pixel (auto, mmlt, pssmlt)
    ///
    /// One of mmlt mutates a path of one depth, one of pssmlt a sample of all depths. With auto
    /// samples take the place of as many mutations as trace as many rays.
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
    /// To see what they cost, and that they change nothing: the picture stays the same but for
    /// noise.
    #[arg(
        long,
        value_name = "EFFECTS",
        value_delimiter = ',',
        hide_short_help = true,
        help_heading = "Algorithm"
    )]
    pub force_effects: Vec<Forced>,
}

/// Every bootstrap path leaves a number in memory.
pub(super) const MAX_BOOTSTRAP: u64 = 1 << 32;

const MAX_MUTATIONS: u64 = 1 << 40;

/// Mutations or samples per pixel where only the error counts: nobody waits for more, and the film
/// keeps its precision.
const ENDLESS: u64 = 1 << 20;

/// Mutations or samples a second that no machine reaches per thread: the effort where only time
/// counts.
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
        s.estimate_error = !self.no_estimate;
        s.forced = self.effects.force_effects.clone();
        s.error_layers = self.errors.wanted().is_some();
        s.shard = self.keep.shard;
        self.chains.apply(s);
        self.apply_effort(s, pixels);
    }

    /// What ends the render.
    pub fn apply_effort(&self, s: &mut Settings, pixels: u64) {
        s.time = self.time;
        if let Some(time) = self.time {
            let threads = worker_threads(s.threads) * processes();
            let most =
                time.as_secs_f64() * UNREACHABLE_RATE * threads as f64 / pixels.max(1) as f64;
            s.mutations_per_pixel = (most.ceil() as u64).clamp(1, MAX_MUTATIONS);
            s.samples_per_pixel = (most.ceil() as u64).clamp(1, u64::from(u32::MAX));
        }
        s.target_error = self.target_error();
        if s.target_error.is_some() && self.time.is_none() {
            s.mutations_per_pixel = ENDLESS;
            s.samples_per_pixel = ENDLESS;
        }
        let set = |value: &mut u64, flag: Option<u64>| *value = flag.unwrap_or(*value);
        set(&mut s.mutations_per_pixel, self.chains.mutations);
        set(&mut s.samples_per_pixel, self.spp);
    }

    /// The error that ends the render.
    pub fn target_error(&self) -> Option<f64> {
        self.target_error.or(self.quality.map(Quality::error))
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
    /// As if none was given.
    fn none() -> Self {
        Self {
            max_depth: None,
            chains: None,
            bootstrap: None,
            large_step: None,
            mutation: None,
            sigma: None,
            strategy_choice: None,
            seed: None,
            mutations: None,
        }
    }

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
}
