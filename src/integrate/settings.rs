//! What is rendered how, and with how much effort.

use std::time::Duration;

use super::failure::RenderError;
use super::shard::Shard;
use crate::chain::mutate::{Mutation, ProposalDistribution};
use crate::chain::tune::Tune;
use crate::plan::Forced;
use crate::scene::{IntegratorKind, Scene};
pub use crate::simd::Width;
use crate::transport::bidirectional::Strategy;

/// Everything that can be asked of a render. [`Settings::of`] takes the scene's own wishes.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Schedule of the render.
    pub integrator: IntegratorKind,
    /// Of all random numbers; the picture depends on it and on no machine.
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
    /// Chains over all depths; every depth that carries light has enough to fill the lanes, if
    /// this is enough for one depth.
    pub chains: u64,
    /// Bootstrap paths per depth, or of all depths at once (PSSMLT).
    pub bootstrap: u64,
    /// Of steps that draw all primary samples afresh, 0 to 1.
    pub large_step_probability: f32,
    /// Law of small steps.
    pub mutation: Mutation,
    /// Scale of small steps, in primary sample space; see [`Mutation`].
    pub sigma: f32,
    /// What of them is tuned before samples count, in place of the above; sigma is then where the
    /// search begins.
    pub tune: Tune,
    /// Stop after this long, bootstrap included.
    pub time: Option<Duration>,
    /// Stop when the estimated [`Stats::relative_error`](super::Stats::relative_error) is at most
    /// this, and chains have mixed.
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
    /// Render this part alone. What it comes to is no picture: its state is to be merged.
    pub shard: Option<Shard>,
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
            shard: None,
        }
    }
}

impl Settings {
    /// What chains propose by, before any tuning.
    pub(super) fn proposal_distribution(&self) -> ProposalDistribution {
        ProposalDistribution::new(self.seed, self.large_step_probability, self.sigma)
            .with_mutation(self.mutation)
    }
}

/// How a path chooses among the strategies of its depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrategyChoice {
    /// Each as often as any other.
    Uniform,
    /// As the bootstrap suggests, see [`strategy_choice`](crate::chain::strategy_choice). The
    /// picture's expectation is the same.
    Learned,
}

impl StrategyChoice {
    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            StrategyChoice::Uniform => "uniform",
            StrategyChoice::Learned => "learned",
        }
    }
}

/// Threads that are started however few cores there are: results must not depend on it, which is
/// worth trying out.
pub(super) const FEW_THREADS: usize = 64;

/// Worker threads for so many asked for; 0 means one per core. No more than two per core beyond
/// `FEW_THREADS`: one without work asks every other for some, again and again, and on few cores a
/// thousand of them take minutes of that for a second of work.
pub fn worker_threads(asked: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    match asked {
        0 => cores,
        n => n.min(FEW_THREADS.max(2 * cores)),
    }
}

/// Largest depth of which strategies have pictures: nobody looks at more than the 502 of depth 20.
const MAX_STRATEGIES: u32 = 20;

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
    if let Some(shard) = s.shard {
        if !shard.exists() {
            let Shard { index, of } = shard;
            return fail(format!("there is no shard {index} of {of}"));
        }
        if s.time.is_some() || s.target_error.is_some() {
            return fail("shards end by their effort: time and error are not theirs".into());
        }
    }
    if s.batch.is_some_and(|b| b == 0) {
        return fail("a batch holds at least one path".into());
    }
    Ok(())
}
