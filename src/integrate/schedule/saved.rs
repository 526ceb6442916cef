//! Budgets and chains on their way, written and read.

use super::{ChainBudget, March, Workspace, layer_of, own, share_out};
use crate::chain::batch::Batch;
use crate::chain::counts::MAX_CHAINS_PER_DEPTH;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::film::{Destination, Tiling};
use crate::integrate::Run;
use crate::integrate::method::Method;
use crate::plan::{Choice, DepthPlan};
use crate::transport::PathSampler;
use std::sync::Mutex;

impl ChainBudget {
    /// Writes what a bootstrap and the tuning have told.
    pub(in crate::integrate) fn save(&self, to: &mut Writer) {
        let Self {
            index,
            sampler,
            chains,
            // Follow from the others.
            layer: _,
            independent: _,
            iterations: _,
            share: _,
            bootstrap,
            proposals,
        } = self;
        to.count(*index);
        let starts = sampler.plan().map_or(&[][..], |plan| plan.choice.starts());
        to.table(starts);
        to.count(*chains);
        to.value(*bootstrap);
        to.value([proposals.large_step_probability, proposals.sigma]);
    }

    fn load(run: &Run, method: &Method, from: &mut Reader) -> Result<Self, Malformed> {
        let index = from.count(method.samplers.len().saturating_sub(1))?;
        let sampler = method.samplers.get(index);
        let sampler = sampler.ok_or_else(|| Malformed::new("there are no chains"))?;
        let starts = from.list(sampler.strategies().len())?;
        let sampler = match sampler {
            PathSampler::Multiplexed(plan) => {
                let choice = Choice::from_starts(&plan.strategies, starts);
                PathSampler::Multiplexed(DepthPlan {
                    choice: choice.ok_or_else(|| Malformed::new("strategies are mixed up"))?,
                    ..plan.clone()
                })
            }
            other => other.clone(),
        };
        // As many as a share of all, or as fill the lanes.
        let most = (run.settings.chains as usize).next_multiple_of(16);
        let chains = from.count(most.min(MAX_CHAINS_PER_DEPTH))?;
        let bootstrap = from.value()?;
        let mut proposals = run.settings.proposal_distribution();
        let [probability, sigma]: [f32; 2] = from.value()?;
        let right = (0.0..=1.0).contains(&probability) && sigma >= 0.0 && sigma.is_finite();
        Malformed::unless(right, "chains make no such steps")?;
        (proposals.large_step_probability, proposals.sigma) = (probability, sigma);
        Ok(Self {
            index,
            sampler,
            chains,
            layer: layer_of(index),
            independent: method.independent(),
            iterations: 0,
            share: 1.0,
            bootstrap,
            proposals,
        })
    }
}

/// Reads the budgets of chains that make so many mutations in all; those of all shards are the
/// same.
pub(in crate::integrate) fn load_budgets(
    run: &Run,
    method: &Method,
    mutations: f64,
    from: &mut [Reader],
) -> Result<Vec<ChainBudget>, Malformed> {
    let mut all = from.iter_mut().map(|from| load_list(run, method, from));
    let first = all.next();
    let mut list = first.ok_or_else(|| Malformed::new("there is no state"))??;
    let packed = |list: &[ChainBudget]| {
        let mut to = Writer::new();
        list.iter().for_each(|a| a.save(&mut to));
        to.finish()
    };
    for other in all {
        let same = packed(&other?) == packed(&list);
        Malformed::unless(same, "shards have other chains")?;
    }
    share_out(&mut list, mutations);
    Ok(list)
}

fn load_list(run: &Run, method: &Method, from: &mut Reader) -> Result<Vec<ChainBudget>, Malformed> {
    let count = from.count(method.samplers.len())?;
    let mut list = Vec::new();
    for _ in 0..count {
        list.push(ChainBudget::load(run, method, from)?);
    }
    let right = list.is_sorted_by(|a, b| a.index < b.index)
        && (list.iter()).all(|a| a.chains > 0 && a.bootstrap.mean() > 0.0);
    Malformed::unless(right, "budgets of chains are mixed up")?;
    Ok(list)
}

/// Batches of chains, with their budgets and where their splats go.
pub(in crate::integrate) type Batches<'a> = Vec<(&'a ChainBudget, Destination, &'a Batch)>;

/// The same, owned.
pub(in crate::integrate) type Owned<'a> = Vec<(&'a ChainBudget, Destination, Batch)>;

/// Writes where all chains stand.
pub(in crate::integrate) fn save_batches(batches: &Batches, to: &mut Writer) {
    to.count(batches.len());
    for (a, destination, batch) in batches {
        let Destination {
            layer: _,
            scale: _,
            half,
        } = destination;
        to.count(a.index);
        to.flag(*half);
        batch.save(to);
    }
}

impl<'a> March<'a> {
    /// Reads where all chains stand: those of one render, or of all of its shards.
    pub fn load(
        run: &'a Run<'a>,
        budgets: &'a [ChainBudget],
        tiling: &Tiling,
        from: &mut [Reader],
    ) -> Result<Self, Malformed> {
        let own = own(run, budgets);
        let batches = load_batches(run, budgets, own.clone(), tiling, from)?.into_iter();
        let mut march = Self {
            run,
            budgets,
            own,
            batches: batches
                .map(|(a, to, batch)| (a, to, Mutex::new(batch)))
                .collect(),
            workspaces: (0..rayon::current_num_threads())
                .map(|_| Mutex::new(Workspace::new(run.world)))
                .collect(),
            queue: Mutex::default(),
            done: 0.0,
            // Asked for at once.
            room: 0.0,
            full: false,
        };
        march.check()?;
        Ok(march)
    }

    /// Chains that share a layer are as far as each other; how far all are, by the mutations that
    /// are still wanted.
    fn check(&mut self) -> Result<(), Malformed> {
        let mut by_layer = std::collections::BTreeMap::new();
        let (mut made, mut wanted) = (0.0, 0.0);
        for (a, _, batch) in &mut self.batches {
            let batch = batch.get_mut().unwrap_or_else(|p| p.into_inner());
            let first = *by_layer.entry(a.layer).or_insert(batch.iterations());
            Malformed::unless(first == batch.iterations(), "chains are apart")?;
            let chains = batch.len() as f64;
            made += f64::from(batch.iterations()) * chains;
            wanted += f64::from(a.iterations) * chains;
        }
        self.done = if wanted > 0.0 { made / wanted } else { 1.0 };
        Ok(())
    }
}

/// Reads batches of chains; `left` are those of each budget that there must be. They are in the
/// order in which they would have been made: sums of floats depend on it.
pub(in crate::integrate) fn load_batches<'a>(
    run: &Run,
    budgets: &'a [ChainBudget],
    mut left: Vec<u64>,
    tiling: &Tiling,
    from: &mut [Reader],
) -> Result<Owned<'a>, Malformed> {
    let tiling = run.settings.estimate_error.then_some(tiling);
    let mut batches = Vec::new();
    for from in from {
        let count = from.count(left.iter().sum::<u64>() as usize)?;
        for _ in 0..count {
            batches.push(load_batch(run, budgets, &mut left, tiling, from)?);
        }
    }
    Malformed::unless(left.iter().all(|n| *n == 0), "a depth has too few chains")?;
    batches.sort_by_key(|(a, _, batch)| (a.index, batch.first()));
    Ok(batches)
}

/// Reads a batch of chains; `left` are those of each budget that have not been read.
fn load_batch<'a>(
    run: &Run,
    budgets: &'a [ChainBudget],
    left: &mut [u64],
    tiling: Option<&Tiling>,
    from: &mut Reader,
) -> Result<(&'a ChainBudget, Destination, Batch), Malformed> {
    let index = from.count(usize::MAX)?;
    let half = from.flag()?;
    let (a, left) = (budgets.iter().zip(left))
        .find(|(a, _)| a.index == index)
        .ok_or_else(|| Malformed::new("chains have no budget"))?;
    let combined = a.independent.map(|layer| (a.constant(), layer));
    let batch = Batch::load(run.world, &a.sampler, a.chains, combined, tiling, from)?;
    *left = left
        .checked_sub(batch.len() as u64)
        .filter(|_| !batch.is_empty())
        .ok_or_else(|| Malformed::new("a depth has too many chains"))?;
    let to = Destination {
        layer: a.layer,
        scale: a.share,
        half,
    };
    Ok((a, to, batch))
}
