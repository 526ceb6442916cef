//! Integrators: schedules over the parts below. [`render`] is the whole of Phalanx in one call; [`measure`] says how fast it is.

mod bdpt;
mod bootstraps;
mod chains;
mod error;
mod grid;
mod light;
mod lt;
pub mod measure;
mod mixed;
mod mmlt;
mod needs;
mod pssmlt;
mod pt;
mod revisit;
mod sampled;
mod schedule;
mod tuning;

pub use self::error::{Tiles, standard_errors};
pub use self::mixed::{CrossCheck, DepthStats};
pub use self::needs::{Need, Needs};
pub use self::revisit::{Visit, Whose, revisit};

use crate::chain::mutate::{Kernel, Mutation};
use crate::chain::tune::Tune;
use crate::plan::Forced;
use crate::scene::{IntegratorKind, Scene};
pub use crate::simd::Width;
use crate::simd::{Lanes, f32x8};
use crate::transport::World;
use crate::transport::bidirectional::Strategy;
use serde::Serialize;
use std::time::{Duration, Instant};

/// Everything that can be asked of a render. [`Settings::of`] takes the scene's own wishes.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    pub integrator: IntegratorKind,
    pub seed: u64,
    /// Worker threads; 0 means one per core ([`worker_threads`]).
    pub threads: usize,
    /// SIMD width of all kernels. The picture does not depend on it.
    pub lanes: Width,
    /// Largest number of scattering events.
    pub max_depth: u32,
    /// Samples per pixel (integrators of independent samples).
    pub samples_per_pixel: u64,
    /// Mutations per pixel (Metropolis integrators).
    pub mutations_per_pixel: u64,
    /// Chains over all depths; every depth that carries light has enough to fill the lanes, if this is enough for one depth.
    pub chains: u64,
    /// Bootstrap paths per depth, or of all depths at once (PSSMLT).
    pub bootstrap: u64,
    pub large_step_probability: f32,
    /// Law and scale of small steps.
    pub mutation: Mutation,
    pub sigma: f32,
    /// What of them is tuned before samples count, in place of the above; sigma is then where the search begins.
    pub tune: Tune,
    /// Stop after this long, bootstrap included.
    pub time: Option<Duration>,
    /// Stop when the estimated [`Stats::relative_error`] is at most this, and chains have mixed.
    pub target_error: Option<f64>,
    /// Estimate the picture's error. It costs a few per cent of time and memory.
    pub estimate_error: bool,
    /// Return the standard error of every pixel, too.
    pub error_layers: bool,
    /// Return a picture of each strategy, too (bidirectional path tracing).
    pub strategies: bool,
    /// How chains choose among the strategies of their depth (MMLT).
    pub strategy_choice: StrategyChoice,
    /// Chains or paths that march together; `None` chooses. The picture does not depend on it.
    pub batch: Option<usize>,
    /// Effects that are on though the scene does not call for them.
    pub forced: Vec<Forced>,
}

impl Settings {
    /// What the scene file asks for, at 8 lanes, on all cores.
    pub fn of(scene: &Scene) -> Self {
        let i = &scene.integrator;
        Self {
            integrator: i.kind,
            seed: i.seed,
            threads: 0,
            lanes: Width::Eight,
            max_depth: i.max_depth,
            samples_per_pixel: u64::from(i.pixel_samples),
            mutations_per_pixel: i.mutations_per_pixel,
            chains: i.chains,
            bootstrap: i.bootstrap_samples,
            large_step_probability: i.large_step_probability,
            mutation: Mutation::Gaussian,
            sigma: i.sigma,
            tune: Tune::default(),
            time: None,
            target_error: None,
            estimate_error: true,
            error_layers: false,
            strategies: i.strategies,
            strategy_choice: StrategyChoice::Uniform,
            batch: None,
            forced: Vec::new(),
        }
    }
}

impl Settings {
    /// How chains mutate that nobody tunes.
    fn kernel(&self) -> Kernel {
        Kernel::new(self.seed, self.large_step_probability, self.sigma).with_law(self.mutation)
    }
}

/// How a path chooses among the strategies of its depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrategyChoice {
    /// Each as often as any other.
    Uniform,
    /// As the bootstrap suggests, see [`learn`](crate::chain::learn). The picture's expectation is the same.
    Learned,
}

impl StrategyChoice {
    pub fn name(self) -> &'static str {
        match self {
            StrategyChoice::Uniform => "uniform",
            StrategyChoice::Learned => "learned",
        }
    }
}

/// What a render is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// The tree that rays are traced through: 0 of its primitives, then all of them (at least 1).
    Build,
    /// Bootstrap paths, and mutations that tune those that count.
    Bootstrap,
    /// Mutations or samples.
    Render,
}

/// Told how a render goes, and asked whether to go on. Called from the thread that called [`render`], except [`Observer::stop`], which any
/// worker may call.
pub trait Observer: Sync {
    /// `done` of `total` mutations, samples or bootstrap paths.
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        let _ = (phase, done, total);
    }
    /// The picture's estimated relative error ([`Stats::relative_error`]); told now and then, as often as costs next to nothing.
    fn error(&self, relative: f64) {
        let _ = relative;
    }
    /// True ends the render early, with a correctly normalised picture.
    fn stop(&self) -> bool {
        false
    }
}

/// Sees nothing, stops nothing.
pub struct Silent;
impl Observer for Silent {}

/// What ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndedBy {
    /// All mutations or samples are made.
    Effort,
    Time,
    /// The estimated error has reached its target.
    Target,
    Observer,
}

/// The figures of a render.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stats {
    pub integrator: String,
    pub seed: u64,
    pub lanes: u32,
    pub threads: usize,
    pub width: u32,
    pub height: u32,
    pub max_depth: u32,
    pub mutations: u64,
    pub mutations_per_second: f64,
    pub samples: u64,
    pub samples_per_second: f64,
    pub rays: u64,
    pub rays_per_second: f64,
    /// Reading and parsing the scene; 0 for a scene that was not read from a file.
    pub load_seconds: f64,
    pub build_seconds: f64,
    pub bootstrap_seconds: f64,
    pub render_seconds: f64,
    pub total_seconds: f64,
    pub acceptance_large: f64,
    pub acceptance_small: f64,
    /// Part of small and of large proposals that carries no light, over all depths; `None` if not recorded.
    pub dark_small: Option<f64>,
    pub dark_large: Option<f64>,
    /// Mean over the sampled raster region of the target (mean channel of radiance), and its standard error.
    pub b: f64,
    pub b_stderr: f64,
    pub rejected_nonfinite: u64,
    pub peak_rss_bytes: u64,
    /// Estimated relative mean squared error of the picture as written: the mean over pixels and channels of the squared standard error
    /// over (squared value + [`RELATIVE_EPSILON`](crate::metrics::RELATIVE_EPSILON)); and its root. `None` if not estimated.
    pub relmse: Option<f64>,
    pub relative_error: Option<f64>,
    /// Largest split R-hat of depths that matter (see [`DepthStats`]), and smallest effective sample size.
    pub rhat: Option<f64>,
    pub ess: Option<f64>,
    pub stuck_chains: u64,
    pub cross_check: Option<CrossCheck>,
    pub depths: Vec<DepthStats>,
    /// In radiance as written.
    pub tiles: Option<Tiles>,
}

/// A finished render.
pub struct Render {
    /// Linear sRGB radiance of the crop window, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
    pub width: u32,
    pub height: u32,
    pub stats: Stats,
    /// Things the user should know, a sentence each.
    pub warnings: Vec<String>,
    /// Standard error of each value of `pixels`, from one difference of two halves: a single one is a rough estimate, but their mean square is
    /// right. `None` unless [`Settings::error_layers`] asks for them.
    pub deviation: Option<Vec<[f32; 3]>>,
    /// By depth, then by light vertices; none unless [`Settings::strategies`] asks for them.
    pub strategies: Vec<StrategyPictures>,
    pub ended_by: EndedBy,
}

/// What a bidirectional strategy adds to the picture: like [`Render::pixels`].
pub struct StrategyPictures {
    pub strategy: Strategy,
    /// Times its weight: these pictures of all strategies add up to the picture.
    pub weighted: Vec<[f32; 3]>,
    /// As if there were no other: all light that it can find, as noisy as it finds it.
    pub unweighted: Vec<[f32; 3]>,
}

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    #[error("{0}")]
    Settings(String),
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        threads: usize,
        source: rayon::ThreadPoolBuildError,
    },
}

/// Renders a scene.
///
/// # Errors
/// Settings out of range, and thread pools that cannot be had.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Render, RenderError> {
    let start = Instant::now();
    check(settings)?;
    let pool = pool(settings.threads)?;
    let primitives = (scene.triangles.len() + scene.spheres.len()).max(1) as u64;
    observer.progress(Phase::Build, 0, primitives);
    let world = World::with_forced(scene, settings.max_depth, &settings.forced);
    observer.progress(Phase::Build, primitives, primitives);
    let run = Run {
        scene,
        world: &world,
        settings,
        observer,
        start,
    };
    let mut render = pool.install(|| match settings.lanes {
        Width::Eight => integrate::<f32x8>(&run),
        Width::One => integrate::<f32>(&run),
    });
    let scale = scene.film.scale;
    let parts = (render.strategies.iter_mut()).flat_map(|s| [&mut s.weighted, &mut s.unweighted]);
    let colour = scene.film.colour.as_ref();
    let beyond = bring_to_scale(&mut render.pixels, scale, colour);
    parts.for_each(|pixels| _ = bring_to_scale(pixels, scale, colour));
    if let Some(deviation) = &mut render.deviation {
        _ = bring_to_scale(deviation, scale, None);
        if let Some(m) = colour {
            deviation
                .iter_mut()
                .for_each(|d| *d = mixed_deviation(m, *d));
        }
    }
    if beyond > 0 {
        render.warnings.push(format!(
            "{beyond} values of the picture are beyond what a 32-bit float holds and were set to the largest, {:.1e}",
            f32::MAX
        ));
    }
    render.stats.relative_error = render.stats.relmse.map(f64::sqrt);
    if let Some(tiles) = &mut render.stats.tiles {
        tiles.scale(f64::from(scale));
    }
    let stats = &mut render.stats;
    stats.seed = settings.seed;
    stats.lanes = settings.lanes.lanes();
    stats.threads = pool.current_num_threads();
    stats.max_depth = settings.max_depth;
    stats.width = render.width;
    stats.height = render.height;
    stats.build_seconds = world.tracer.stats().build_time.as_secs_f64();
    stats.total_seconds = start.elapsed().as_secs_f64();
    stats.rays_per_second = per_second(stats.rays, stats.render_seconds + stats.bootstrap_seconds);
    stats.peak_rss_bytes = peak_rss_bytes();
    let dark = settings.target_error.is_some() && stats.b * f64::from(scale) < DARK;
    if dark && stats.b > 0.0 {
        render.warnings.push(format!(
            "the picture is dark (mean radiance {:.2e}): channels below 0.1 are judged by absolute error, so its relative error means \
             little; the film's scale can brighten it",
            stats.b * f64::from(scale)
        ));
    }
    if stats.rejected_nonfinite > 0 {
        render.warnings.push(format!(
            "{} contributions were not finite or negative and were left out",
            stats.rejected_nonfinite
        ));
    }
    Ok(render)
}

/// Multiplies pixels by the film's scale and its matrix of colours. Values beyond `f32` are set to its largest number, so that bright pixels
/// stay numbers; returns how many.
fn bring_to_scale(pixels: &mut [[f32; 3]], scale: f32, colour: Option<&[[f32; 3]; 3]>) -> u64 {
    const MOST: f64 = f32::MAX as f64;
    let mut beyond = 0;
    for pixel in pixels {
        let mut values = pixel.map(|v| f64::from(v).clamp(-MOST, MOST) * f64::from(scale));
        if let Some(m) = colour {
            values = m.map(|row| dot(row.map(f64::from), values));
        }
        *pixel = values.map(|v| {
            beyond += u64::from(v.abs() > MOST);
            v.clamp(-MOST, MOST) as f32
        });
    }
    beyond
}

/// Every integrator, by name.
fn integrate<L: Lanes>(run: &Run) -> Render {
    match run.settings.integrator {
        IntegratorKind::Mmlt => mmlt::render::<L>(run),
        IntegratorKind::Pssmlt(host) => pssmlt::render::<L>(run, host),
        IntegratorKind::Pt => pt::render::<L>(run),
        IntegratorKind::Lt => lt::render::<L>(run),
        IntegratorKind::Bdpt => bdpt::render::<L>(run),
    }
}

/// Why a picture is black, of which `searched` have found no light.
fn black_reason(run: &Run, searched: &str) -> String {
    if run.world.lights.is_empty() {
        return "the scene has no lights: the picture is black".into();
    }
    format!("{searched} carries light to the camera: the picture is black")
}

/// Mean radiance below which the epsilon of relative errors rules the picture.
const DARK: f64 = 0.02;

/// Threads that are started however few cores there are: results must not depend on it, which is worth trying out.
const FEW_THREADS: usize = 64;

/// Worker threads for so many asked for; 0 means one per core. No more than two per core beyond [`FEW_THREADS`]: one without work asks every
/// other for some, again and again, and on few cores a thousand of them take minutes of that for a second of work.
pub fn worker_threads(asked: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    match asked {
        0 => cores,
        n => n.min(FEW_THREADS.max(2 * cores)),
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool, RenderError> {
    let threads = worker_threads(threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|source| RenderError::Threads { threads, source })
}

/// Largest depth of which strategies have pictures: nobody looks at more than the 502 of depth 20.
const MAX_STRATEGIES: u32 = 20;

/// Length of a round of work: progress and stops are prompt, the barrier costs little.
const ROUND: Duration = Duration::from_millis(250);

/// What an integrator works on.
struct Run<'a> {
    scene: &'a Scene,
    world: &'a World<'a>,
    settings: &'a Settings,
    observer: &'a dyn Observer,
    start: Instant,
}

impl Run<'_> {
    /// Width and height of the crop window.
    fn size(&self) -> (u32, u32) {
        let [x0, x1, y0, y1] = self.scene.film.crop;
        (x1 - x0, y1 - y0)
    }

    /// How much longer the next round should be than one that took so long: [`ROUND`], or the time that is left.
    fn pace(&self, taken: Duration) -> f64 {
        let next = match self.settings.time {
            Some(limit) => ROUND.min(limit.saturating_sub(self.start.elapsed())),
            None => ROUND,
        };
        let ratio = next.as_secs_f64() / taken.as_secs_f64().max(1e-6);
        ratio.clamp(0.01, 4.0)
    }

    /// Time is up, or the observer has had enough.
    fn ended(&self) -> Option<EndedBy> {
        let late = (self.settings.time).is_some_and(|limit| self.start.elapsed() >= limit);
        if self.observer.stop() {
            Some(EndedBy::Observer)
        } else {
            late.then_some(EndedBy::Time)
        }
    }
}

/// Whether a render can start with these settings, in enough memory.
///
/// # Errors
/// Settings out of range.
pub fn check(settings: &Settings) -> Result<(), RenderError> {
    let fail = |what: String| Err(RenderError::Settings(what));
    let s = settings;
    if s.max_depth >= crate::chain::counts::MAX_DEPTHS {
        return fail(format!(
            "max depth {} is beyond {}",
            s.max_depth,
            crate::chain::counts::MAX_DEPTHS - 1
        ));
    }
    if !(0.0..=1.0).contains(&s.large_step_probability) {
        return fail(format!(
            "the large step probability is {}, not in [0, 1]",
            s.large_step_probability
        ));
    }
    if !(s.sigma >= 0.0 && s.sigma.is_finite()) {
        return fail(format!(
            "sigma is {}, not a finite number of at least 0",
            s.sigma
        ));
    }
    if s.integrator.mutates() && (s.chains == 0 || s.bootstrap == 0) {
        return fail("chains and bootstrap samples must be at least 1".into());
    }
    if s.chains > crate::chain::counts::MAX_CHAINS_PER_DEPTH as u64 {
        let most = crate::chain::counts::MAX_CHAINS_PER_DEPTH;
        return fail(format!("{} chains are more than {most}", s.chains));
    }
    if s.bootstrap > 1 << 48 {
        return fail(format!(
            "{} bootstrap samples are more than 2^48",
            s.bootstrap
        ));
    }
    if s.target_error.is_some_and(|e| !(e > 0.0 && e.is_finite())) {
        return fail("the target error must be a finite number above 0".into());
    }
    if s.target_error.is_some() && !s.estimate_error {
        return fail("a target error needs an estimate of the error".into());
    }
    if s.strategies && s.integrator == IntegratorKind::Bdpt && s.max_depth > MAX_STRATEGIES {
        return fail(format!(
            "pictures of strategies of depths up to {} would be {}; with them the max depth is at most {MAX_STRATEGIES}",
            s.max_depth,
            2 * Strategy::most(s.max_depth)
        ));
    }
    if s.batch.is_some_and(|b| b == 0) {
        return fail("a batch holds at least one path".into());
    }
    Ok(())
}

fn per_second(count: u64, seconds: f64) -> f64 {
    if seconds > 0.0 {
        count as f64 / seconds
    } else {
        0.0
    }
}

/// Largest resident size of this process so far; 0 where the system does not tell.
pub fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Standard errors of channels that a matrix mixes. How they vary together is not known: the larger of what it is for channels that do so
/// fully, as noise mostly does, and not at all.
fn mixed_deviation(matrix: &[[f32; 3]; 3], deviation: [f32; 3]) -> [f32; 3] {
    let deviation = deviation.map(f64::from);
    matrix.map(|row| {
        let row = row.map(f64::from);
        let together = dot(row, deviation).abs();
        let apart = dot(row.map(|v| v * v), deviation.map(|d| d * d)).sqrt();
        together.max(apart).min(f32::MAX.into()) as f32
    })
}
