//! One chain of a render once more, by itself, up to one iteration: results do not depend on which
//! chains march together.

use super::bootstraps::bootstraps;
use super::chains::mutations;
use super::method::Method;
use super::schedule::{ChainBudget, Start, chain_budgets};
use super::{EndedBy, Observer, RenderError, Run, Settings, auto, check, mmlt, pool, tuning};
use crate::chain::batch::{Batch, ChainStep, State};
use crate::chain::bootstrap::Bootstrap;
use crate::chain::mutate::ProposalDistribution;
use crate::plan::DepthPlan;
use crate::scene::{IntegratorKind, Scene};
use crate::simd::f32x8;
use crate::transport::{Paths, World};

/// Chains that march together, the wanted one among them.
const BATCH: usize = 8;

/// Which iteration of which chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Whose {
    /// Scattering events of the chain's paths.
    pub depth: u32,
    /// Of the chains of its depth, from 0.
    pub chain: usize,
    /// From 0.
    pub iteration: u32,
}

/// What a chain did in an iteration.
#[derive(Clone, Debug)]
pub struct Visit {
    /// What the samples of the chain mean: the plan of its depth, with the choice of strategies
    /// that the chains make.
    pub plan: DepthPlan,
    /// How chains of the depth mutate.
    pub proposals: ProposalDistribution,
    /// Chains of the depth.
    pub chains: usize,
    /// Iterations that each of them makes in a whole render.
    pub iterations: u32,
    /// Bootstrap path that the chain started from.
    pub start: u64,
    /// Where it stood before the iteration.
    pub state: State,
    /// What it did.
    pub step: ChainStep,
}

/// The chains of the render, their bootstrap, and the mutations that they make in all; `None` if it
/// has no chains.
fn chains_of(run: &Run) -> Option<(Method, Vec<Bootstrap>, f64)> {
    let settings = run.settings;
    if settings.integrator == IntegratorKind::Auto {
        let (method, ready, mutations) = auto::chains_of::<f32x8>(run)?;
        return Some((method, ready.bootstraps, mutations));
    }
    let method = mmlt::method(&run.world.plan);
    let stop = || run.observer.stop().then_some(EndedBy::Observer);
    let all = bootstraps::<f32x8>(run.world, &method.samplers, settings, &stop, |_, _| {});
    let wanted = mutations(run, settings.mutations_per_pixel);
    Some((method, all.samplers, wanted))
}

/// Makes the bootstrap and marches one chain to an iteration of it, exactly as
/// [`render`](super::render) does with these settings (of `auto`, or of multiplexed
/// Metropolis light transport if their integrator is another). `world` must be of `scene` and for
/// `settings.max_depth`.
///
/// # Errors
/// Settings out of range, thread pools that cannot be had, and chains or iterations that the render
/// does not have; the observer's stop.
pub fn rerun(
    scene: &Scene,
    world: &World,
    settings: &Settings,
    whose: Whose,
    observer: &dyn Observer,
) -> Result<Visit, RenderError> {
    check(settings)?;
    let fail = |what: String| Err(RenderError::Settings(what));
    let Whose {
        depth,
        chain,
        iteration,
    } = whose;
    if depth as usize >= world.plan.depths.len() {
        return fail(format!(
            "there is no depth {depth}: the largest is {} (max depth)",
            settings.max_depth
        ));
    }
    let run = Run::begin(scene, world, settings, observer);
    let chains = pool(settings.threads)?.install(|| chains_of(&run));
    let Some((method, all, mutations)) = chains else {
        return fail(format!(
            "there are no chains of depth {depth}: samples bring all light"
        ));
    };
    if all.iter().any(Bootstrap::is_short) {
        return fail("stopped".into());
    }
    let mut budgets = chain_budgets(&run, &method, &all, mutations);
    budgets.retain(|a| a.sampler.depth() == Some(depth));
    if let Some(why) = missing(&budgets, &whose, settings) {
        return fail(why);
    }
    let stop = || observer.stop().then_some(EndedBy::Observer);
    let tuned = tuning::tune::<f32x8>(&run, &mut budgets, &all, &stop, |_| {});
    if tuned.ended_by.is_some() {
        return fail("stopped".into());
    }
    let budget = &budgets[0];
    let Some(plan) = budget.sampler.plan() else {
        return fail(format!("chains of depth {depth} have no plan"));
    };
    let start = Start::new(&run, budget, &all);
    drop(all);
    let seeds = start.seeds();
    let first = chain / BATCH * BATCH;
    let together = &seeds[first..seeds.len().min(first + BATCH)];
    let mut paths = Paths::new(world);
    let sampler = &budget.sampler;
    let mut batch = Batch::new::<f32x8>(world, sampler, first, together, settings.seed, &mut paths);
    for _ in 0..iteration {
        if observer.stop() {
            return fail("stopped".into());
        }
        batch.step::<f32x8>(world, &budget.proposals, &mut paths);
    }
    let state = batch.state(chain - first);
    batch.step::<f32x8>(world, &budget.proposals, &mut paths);
    Ok(Visit {
        plan: plan.clone(),
        proposals: budget.proposals,
        chains: budget.chains,
        iterations: budget.iterations,
        start: seeds[chain],
        state,
        step: batch.latest(chain - first),
    })
}

/// Why the render has no such chain or iteration, if it has not; `budgets` are those of the depth.
fn missing(budgets: &[ChainBudget], whose: &Whose, settings: &Settings) -> Option<String> {
    let Whose {
        depth,
        chain,
        iteration,
    } = *whose;
    let Some(budget) = budgets.first() else {
        return Some(format!(
            "there are no chains of depth {depth}: none of its {} bootstrap paths carries light{}",
            settings.bootstrap,
            match settings.integrator {
                IntegratorKind::Auto => ", or samples bring all that there is",
                _ => "",
            }
        ));
    };
    if chain >= budget.chains {
        return Some(format!(
            "there is no chain {chain}: depth {depth} has {} chains, from 0 on",
            budget.chains
        ));
    }
    (iteration >= budget.iterations).then(|| {
        format!(
            "there is no iteration {iteration}: at {} mutations a pixel chains of depth {depth} make {} iterations, from 0 on",
            settings.mutations_per_pixel, budget.iterations
        )
    })
}
