//! The integrator that chooses: bidirectional path tracing, multiplexed Metropolis light transport,
//! or both together, whichever leaves the smallest error for the same work.
//!
//! 1. A pilot ([`pilot`]) makes some samples, and paths from the camera alone if these may do
//!    ([`forward`]). Where samples are clearly best, nothing else is tried.
//! 2. Else every depth gets the beginning of its bootstrap, and some chains are on trial
//!    ([`crate::chain::trial`]).
//! 3. [`evidence`] is what both have seen; [`model`] chooses, for each depth, how much of its
//!    light samples keep and how much is left to chains.
//! 4. What it has chosen, samples alone and chains alone render the scene for a moment each
//!    ([`trials`]): the smallest error that is seen decides.
//! 5. Both march side by side ([`super::chains`] with [`super::sampled`] beside it), in proportion
//!    from the first round on: a render that is stopped has all of its light.
//!
//! The pilot's samples do not count for the picture: what they have seen decides about weights, and
//! would not be independent of them. The budget is that of mutations per pixel: a sample takes the
//! place of as many mutations as trace as many rays.

mod bulk;
mod evidence;
mod forward;
mod march;
mod model;
mod pilot;
mod saved;
mod start;
mod trials;

use self::evidence::Chains;
use self::march::{Budget, Effort, march};
use self::model::{Choice, Costs};
use self::pilot::Pilot;
use self::start::{finish_bootstrap, method_of};
use super::bootstraps::fresh;
use super::chains::{Ready, mutations, ready};
use super::method::Method;
use super::shares::{Share, Shares};
use super::{EndedBy, Render, Run};
use crate::chain::bootstrap::{Bootstrap, CHUNK};
use crate::chain::trial::Trial;
use crate::checkpoint::{Malformed, Reader};
use crate::simd::Lanes;
use crate::transport::PathSampler;
use crate::transport::bidirectional::BidirectionalLayout;
use rayon::prelude::*;
use std::time::Instant;

/// Most samples of the pilot, and fewest.
const SAMPLES: [f64; 2] = [2048.0, 32768.0];
/// Most bootstrap paths of a depth before anything is decided, and fewest.
const PATHS: [f64; 2] = [1024.0, 16384.0];
/// Most chains of a depth on trial, and fewest.
const CHAINS: [f64; 2] = [16.0, 128.0];
/// Part of all mutations that the pilot's samples come to, and its paths and chains of a depth; a
/// part of the time.
const PART: f64 = 0.02;
const TIME: f64 = 0.05;
/// Rays of a mutation, roughly, for the size of a pilot.
const RAYS: f64 = 4.0;

/// Where nothing can be tried, chains alone render if samples would get less of all rays.
const FEW: f64 = 0.4;

/// What a pilot has come to.
pub(super) struct Decision {
    choice: Choice,
    /// Of all depths, begun; none if chains are of no use.
    bootstraps: Vec<Bootstrap>,
    /// Light of each depth, and rays that the pilot has traced.
    light: Vec<f64>,
    /// Of a mutation of mmlt.
    usual: f64,
    rays: u64,
    /// Mutations per pixel that there was time for.
    affordable: f64,
    /// Error of samples alone over that of the choice, and that of chains for all but depth 0.
    gain: f64,
    /// Expected squared error of the choice, relative to the picture, after a thousand rays a
    /// pixel.
    expected: f64,
}

pub(super) fn render<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    let start = Instant::now();
    let mut decision = match from.is_empty() {
        true => Decision::new::<L>(run),
        false => Decision::load_all(run, from)?,
    };
    let shares = decision.shares();
    let begun = std::mem::take(&mut decision.bootstraps);
    let run = &Run {
        // What a stop has cut short would have decided otherwise.
        keeps: run.keeps && (!from.is_empty() || !run.observer.stop()),
        preface: &|to| decision.save(to),
        ..*run
    };
    let (choice, budget) = (&decision.choice, decision.budget());
    let mut render = march::<L>(run, choice, budget, begun, start, from)?;
    render.stats.rays += decision.rays;
    render.stats.shares = Some(shares);
    Ok(render)
}

/// Who would bring what.
pub(super) fn shares<L: Lanes>(run: &Run) -> Shares {
    Decision::new::<L>(run).shares()
}

/// The chains that a render has, with their bootstrap and the mutations they make in all; `None`
/// if samples bring all light.
pub(super) fn chains_of<L: Lanes>(run: &Run) -> Option<(Method, Ready, f64)> {
    let start = Instant::now();
    let decision = Decision::new::<L>(run);
    let effort = Effort::of(run, &decision.choice, decision.budget());
    decision.choice.has_chains().then(|| {
        let method = method_of(run, &decision.choice.bounds());
        let ready =
            finish_bootstrap::<L>(run, &method, decision.bootstraps, effort.mutations, start);
        (method, ready, effort.mutations)
    })
}

impl Decision {
    /// What a pilot decides.
    pub fn new<L: Lanes>(run: &Run) -> Self {
        let world = run.world;
        let depths = world.plan.depths.len();
        let layout = BidirectionalLayout::new(world).with_parts();
        let wanted = mutations(run, run.settings.mutations_per_pixel);
        let within = |[least, most]: [f64; 2], n: f64| n.clamp(least, most);
        let cost = layout.rays(|_| true);
        let count = within(SAMPLES, PART * wanted * RAYS / cost) as u32;
        let late = || {
            let limit = run.settings.time.map(|limit| limit.mul_f64(TIME));
            let late = limit.is_some_and(|limit| run.start.elapsed() >= limit);
            ready(run).or(late.then_some(EndedBy::Time))
        };
        let pilot = Pilot::run::<L>(run, &layout, count, &late);
        let samples = pilot.samples;
        let of_sample = pilot.rays as f64 / f64::from(samples.max(1));
        let costs = Costs {
            sample: &|on| of_sample * layout.rays(|k| on[k as usize]) / cost,
            shared: world.lights.infinite.len() < 2,
            chains: &|k| k > 0 && !world.plan.depths[k].strategies.is_empty(),
        };
        let region = world.camera.region;
        let region = [region.x0, region.y0, region.width, region.height].map(f64::from);
        let gather = |chains: &[Chains]| {
            evidence::gather(region, samples, &pilot.contributions, chains, depths)
        };
        let mut seen = gather(&[]);
        let mut choice = model::choose(&seen, samples, &costs);
        let mut bootstraps = Vec::new();
        let mut rays = pilot.rays;
        let known = |k: usize| !(costs.chains)(k) || seen[k].samples.len() >= ENOUGH;
        if (choice.has_chains() || !(0..depths).all(known)) && ready(run).is_none() {
            let paths = within(PATHS, PART * wanted) as u64;
            let paths = paths.min(run.settings.bootstrap).next_multiple_of(CHUNK);
            let chains = within(CHAINS, PART * wanted / 128.0) as usize;
            let (begun, chains, traced) = try_chains::<L>(run, paths, chains, wanted);
            rays += traced;
            seen = gather(&chains);
            choice = model::choose(&seen, samples, &costs);
            bootstraps = begun;
        }
        // The best without chains.
        let alone = match ready(run) {
            None => forward::choice::<L>(run, &pilot),
            Some(_) => None,
        };
        let alone = alone.map(|(forward, traced)| {
            rays += traced;
            forward
        });
        let alone = alone.unwrap_or_else(|| model::alone(&seen, samples, &costs));
        let without = alone.error();
        let usual = usual(&seen);
        let mut decision = Self {
            affordable: Budget::after(run, usual, rays).affordable,
            gain: 1.0,
            expected: 0.0,
            usual,
            light: seen.iter().map(|d| d.light).collect(),
            choice,
            bootstraps,
            rays,
        };
        let mut best = 0;
        let mut tried = None;
        if decision.choice.has_chains() {
            let whole = model::whole(&seen, samples, &costs);
            let choices = [&alone, &whole, &decision.choice];
            tried = trials::best::<L>(run, choices, decision.budget());
            best = match &tried {
                Some(tried) => tried.best,
                None => usize::from(decision.choice.part() < FEW),
            };
            if best == 1 {
                decision.choice = whole;
            }
        }
        if best == 0 {
            decision.choice = alone;
        }
        let error = decision.choice.error();
        decision.gain = if error > 0.0 { without / error } else { 1.0 };
        decision.expected = error / 1000.0;
        if let Some(tried) = tried {
            decision.gain = tried.gain;
            decision.expected = tried.expected;
            decision.rays += tried.rays;
        }
        decision
    }

    fn budget(&self) -> Budget {
        Budget {
            usual: self.usual,
            spent: self.rays,
            affordable: self.affordable,
        }
    }

    fn shares(&self) -> Shares {
        let depths = self.light.iter().zip(&self.choice.kept).enumerate();
        Shares {
            gain: self.gain,
            rays: self.choice.part(),
            forward: self.choice.forward,
            expected: self.expected,
            depths: depths
                .filter(|(_, (light, _))| **light > 0.0)
                .map(|(depth, (light, kept))| Share {
                    depth: depth as u32,
                    light: *light,
                    kept: kept.is_finite().then_some(*kept),
                })
                .collect(),
        }
    }
}

/// Rays of a mutation where each depth has as many as it has light.
fn usual(seen: &[evidence::Depth]) -> f64 {
    let light: f64 = seen.iter().map(|d| d.light).sum();
    let rays: f64 = seen.iter().map(|d| d.light * d.rays).sum();
    if light > 0.0 { rays / light } else { RAYS }
}

/// Contributions of a depth that make it known.
const ENOUGH: usize = 16;

/// Begins the bootstrap of every depth, and has chains on trial; the rays of the latter.
fn try_chains<L: Lanes>(
    run: &Run,
    paths: u64,
    chains: usize,
    wanted: f64,
) -> (Vec<Bootstrap>, Vec<Chains>, u64) {
    let settings = run.settings;
    let samplers: Vec<PathSampler> = run
        .world
        .plan
        .depths
        .iter()
        .map(PathSampler::from)
        .collect();
    let mut all = fresh(&samplers, settings.bootstrap);
    let cancelled = || ready(run).is_some();
    let trial = Trial {
        seed: settings.seed,
        proposals: settings.proposal_distribution(),
        iterations: (wanted / settings.chains as f64).min(1e9) as u32,
        chains,
    };
    let tried: Vec<(Chains, u64)> = (all.par_iter_mut().zip(&samplers))
        .map(|(bootstrap, sampler)| {
            bootstrap.extend::<L>(run.world, sampler, settings.seed, paths, &cancelled);
            bootstrap.settle();
            let light = bootstrap.estimate.mean();
            let strategies = sampler.strategies().len() as f64;
            let deep = sampler.depth() > Some(0);
            let (traces, rays) = match light > 0.0 && deep {
                true => trial.run::<L>(run.world, sampler, bootstrap),
                false => Default::default(),
            };
            let steps: usize = traces.len() * crate::chain::tune::STEPS as usize;
            let chains = Chains {
                light,
                strategies,
                rays: rays as f64 / steps.max(1) as f64,
                traces,
            };
            (chains, rays)
        })
        .collect();
    let rays = tried.iter().map(|(_, rays)| rays).sum();
    (
        all,
        tried.into_iter().map(|(chains, _)| chains).collect(),
        rays,
    )
}
