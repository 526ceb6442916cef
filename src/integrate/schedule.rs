//! Who marches when: chains and mutations per sampler (per depth, if paths are multiplexed), and
//! the rounds in which threads march them.

pub(super) mod saved;

use super::Run;
use super::method::{LAYERS, Method};
use crate::chain::batch::{Batch, Workspace};
use crate::chain::bootstrap::{Bootstrap, Estimate};
use crate::chain::counts::MAX_CHAINS_PER_DEPTH;
use crate::chain::mutate::{ProposalDistribution, large_step_probability};
use crate::chain::strategy_choice::learned;
use crate::checkpoint::Malformed;
use crate::film::{Destination, GROUPS, SplatFilm, Tiling};
use crate::integrate::{EndedBy, Phase, Settings, StrategyChoice};
use crate::plan::DepthPlan;
use crate::simd::Lanes;
use crate::transport::{PathSampler, Paths};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// The layer of a sampler.
pub(super) fn layer_of(sampler: usize) -> usize {
    sampler.min(LAYERS - 1)
}

/// Chains that a layer has at least, if the settings ask for as many: with fewer, lanes stay empty.
const FEWEST: usize = 512;
/// The same for each sampler of a shared layer.
const FEWEST_SHARED: usize = 64;
/// Most chains of a batch: its working set of about a kilobyte a path should fit the second-level
/// cache (`benches/batch`).
pub(super) const LARGEST_BATCH: usize = 512;
/// Fewest chains of a batch, however many threads want work.
const SMALLEST_BATCH: usize = 64;

/// Chains that no shards divide: two halves of full lanes.
const GRAIN: u64 = 16;

/// Iterations a thread marches a batch before it looks for another.
pub(super) const STRIDE: u32 = 16;
/// The chains of a sampler, and how they reach the film.
pub(super) struct ChainBudget {
    /// Index into the method's samplers.
    pub index: usize,
    /// The sampler, with the choice of strategies that its chains make.
    pub sampler: PathSampler,
    pub chains: usize,
    pub layer: usize,
    /// The layer of large steps, if they are splatted as independent samples.
    pub independent: Option<usize>,
    /// Iterations of every chain in the whole run, the same for all samplers of a layer.
    pub iterations: u32,
    /// Weight of this sampler's splats within its layer, at most 1.
    pub share: f64,
    pub bootstrap: Estimate,
    /// How its chains mutate.
    pub proposals: ProposalDistribution,
}

impl ChainBudget {
    /// Probability of a large step of its chains, exactly.
    pub fn large_step_probability(&self) -> f64 {
        large_step_probability(self.proposals.large_step_probability)
    }

    /// What large steps are weighed with ([`Batch::combine`]).
    pub fn constant(&self) -> f32 {
        (self.large_step_probability() * self.bootstrap.mean()) as f32
    }
}

/// Shares out `mutations` to the samplers in proportion to `b_k`. Chains are shared out likewise,
/// but at least as many as fill the lanes, with accordingly fewer iterations; samplers that share a
/// layer of the film make the same number.
pub(super) fn chain_budgets(
    run: &Run,
    method: &Method,
    bootstraps: &[Bootstrap],
    mutations: f64,
) -> Vec<ChainBudget> {
    let chains = run.settings.chains as usize;
    let b: f64 = bootstraps.iter().map(|b| b.estimate.mean()).sum();
    let mut list: Vec<ChainBudget> = (bootstraps.iter().enumerate())
        .filter(|(_, boot)| boot.estimate.mean() > 0.0)
        .map(|(index, boot)| {
            let layer = layer_of(index);
            let fewest = if layer < LAYERS - 1 {
                FEWEST
            } else {
                FEWEST_SHARED
            };
            let wish = chains as f64 * boot.estimate.mean() / b;
            let wish = (wish.ceil() as usize).max(fewest.min(chains));
            ChainBudget {
                index,
                sampler: chosen(run.settings, &method.samplers[index], boot),
                // Two halves of full lanes.
                chains: wish.next_multiple_of(16).min(MAX_CHAINS_PER_DEPTH),
                layer,
                independent: method.independent(),
                iterations: 0,
                share: 1.0,
                bootstrap: boot.estimate,
                proposals: run.settings.proposal_distribution(),
            }
        })
        .collect();
    share_out(&mut list, mutations);
    list
}

/// Iterations of all budgets that come to so many mutations, and their shares of layers.
fn share_out(list: &mut [ChainBudget], mutations: f64) {
    let b: f64 = list.iter().map(|a| a.bootstrap.mean()).sum();
    for layer in 0..LAYERS {
        let members = || list.iter().filter(|a| a.layer == layer);
        let chains: usize = members().map(|a| a.chains).sum();
        let light: f64 = members().map(|a| a.bootstrap.mean()).sum();
        let most = members().map(density).fold(0.0, f64::max);
        for a in list.iter_mut().filter(|a| a.layer == layer) {
            let iterations = (mutations * light / b / chains as f64).ceil();
            a.iterations = iterations.min(f64::from(u32::MAX)) as u32;
            // Path samplers that share a layer keep the proportions the bootstrap gave them.
            a.share = density(a) / most;
        }
    }
}

/// `sampler` with the choice of strategies that chains make after this bootstrap.
pub(super) fn chosen(
    settings: &Settings,
    sampler: &PathSampler,
    bootstrap: &Bootstrap,
) -> PathSampler {
    match (settings.strategy_choice, sampler) {
        (StrategyChoice::Learned, PathSampler::Multiplexed(plan)) => {
            PathSampler::Multiplexed(DepthPlan {
                choice: learned(plan, bootstrap.strategies())
                    .unwrap_or_else(|| plan.choice.clone()),
                ..plan.clone()
            })
        }
        _ => sampler.clone(),
    }
}

/// First states of the chains of a budget, and the independent groups they fall into.
pub(super) struct Start {
    /// Bootstrap paths, ascending; one a chain.
    seeds: Vec<u64>,
    /// Group of each chain, ascending.
    groups: Vec<u8>,
    /// Chains in the half that the film sums once more, from the first on.
    half: usize,
}

impl Start {
    /// Chains that start from one path are not independent while they remember it: they belong to
    /// one group, so that groups can differ in size; and to one half, if their sampler has a layer
    /// of the film to itself.
    pub fn new(run: &Run, a: &ChainBudget, bootstraps: &[Bootstrap]) -> Self {
        let seeds = bootstraps[a.index].seeds(run.settings.seed, a.sampler.id(), a.chains);
        let n = seeds.len();
        let mut groups = vec![0; n];
        for group in 1..GROUPS {
            groups[border(&seeds, group * n / GROUPS)..].fill(group as u8);
        }
        let middle = border(&seeds, n / 2);
        let alone = a.layer < LAYERS - 1 && middle > 0 && middle < n;
        Self {
            half: if alone { middle } else { n / 2 },
            seeds,
            groups,
        }
    }

    /// Bootstrap paths that chains start from, ascending; one a chain.
    pub fn seeds(&self) -> &[u64] {
        &self.seeds
    }

    /// Part of the chains that are in the half.
    pub fn half(&self) -> f64 {
        self.half as f64 / self.seeds.len().max(1) as f64
    }
}

/// The position nearest to `at` where a run of equal seeds ends.
fn border(seeds: &[u64], at: usize) -> usize {
    let Some(seed) = seeds.get(at) else {
        return at;
    };
    let start = seeds.partition_point(|s| s < seed);
    let end = seeds.partition_point(|s| s <= seed);
    if at - start <= end - at { start } else { end }
}

/// Light per chain.
pub(super) fn density(a: &ChainBudget) -> f64 {
    a.bootstrap.mean() / a.chains as f64
}

/// Chains per batch unless the settings say otherwise: few enough that every thread finds work.
fn batch_size(run: &Run, budgets: &[ChainBudget]) -> usize {
    let chains: usize = budgets.iter().map(|a| a.chains).sum();
    // Others of a team have as many.
    let threads = rayon::current_num_threads() * run.team().size();
    let spread = (chains / (4 * threads)).next_multiple_of(8);
    run.settings
        .batch
        .unwrap_or(spread.clamp(SMALLEST_BATCH, LARGEST_BATCH))
        .next_multiple_of(8)
}

/// Chains on their way.
pub(super) struct March<'a> {
    run: &'a Run<'a>,
    budgets: &'a [ChainBudget],
    /// Chains of each budget that are here; of a shard not all.
    own: Vec<u64>,
    /// With the budget each belongs to, and where its splats go.
    batches: Vec<(&'a ChainBudget, Destination, Mutex<Batch>)>,
    /// One for every thread.
    workspaces: Vec<Mutex<Workspace>>,
    /// Batches that have not reached the end of a round.
    queue: Mutex<VecDeque<usize>>,
    /// Part of all iterations that has been made.
    done: f64,
    /// Mutations that the film surely has room for; it is made for those of its first process.
    room: f64,
    /// It has ended because there was none.
    full: bool,
}

/// Batches between two rounds.
pub(super) type Held<'a, 'b> = Vec<(&'a ChainBudget, Destination, MutexGuard<'b, Batch>)>;

/// A thread that panicked has ended the render: nobody sees what it left.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl<'a> March<'a> {
    /// Starts all chains.
    pub fn new<L: Lanes>(
        run: &'a Run<'a>,
        budgets: &'a [ChainBudget],
        starts: &[Start],
        tiling: &Tiling,
    ) -> Self {
        let settings = run.settings;
        let size = batch_size(run, budgets);
        let mut parts = Vec::new();
        for (a, start) in budgets.iter().zip(starts) {
            let own = run.share(a.chains as u64, GRAIN);
            let own = own.start as usize..own.end as usize;
            // No batch belongs to both halves.
            for (half, range) in [(true, 0..start.half), (false, start.half..a.chains)] {
                let range = range.start.max(own.start)..range.end.min(own.end);
                let to = Destination {
                    layer: a.layer,
                    scale: a.share,
                    half,
                };
                let firsts = range.clone().step_by(size);
                parts.extend(firsts.map(|i| (a, to, start, i..range.end.min(i + size))));
            }
        }
        let batches = parts
            .into_par_iter()
            .map_init(
                || Paths::new(run.world),
                |paths, (a, to, start, chains)| {
                    let first = chains.start;
                    let seeds = &start.seeds[chains.clone()];
                    let mut batch =
                        Batch::new::<L>(run.world, &a.sampler, first, seeds, settings.seed, paths);
                    if let Some(layer) = a.independent {
                        batch.combine(a.constant(), layer);
                    }
                    if settings.estimate_error {
                        batch.watch(&start.groups[chains], tiling);
                    }
                    (a, to, Mutex::new(batch))
                },
            )
            .collect();
        Self {
            run,
            own: own(run, budgets),
            budgets,
            batches,
            workspaces: (0..rayon::current_num_threads())
                .map(|_| Mutex::new(Workspace::new(run.world)))
                .collect(),
            queue: Mutex::default(),
            done: 0.0,
            room: f64::INFINITY,
            full: false,
        }
    }

    /// Of all chains.
    pub fn budgets(&self) -> &'a [ChainBudget] {
        self.budgets
    }

    /// Keeps those batches that this process of a team marches: each process has about as many
    /// rays to trace. All processes must hold all of them.
    pub fn deal(&mut self) {
        let team = self.run.team();
        if team.is_alone() {
            return;
        }
        let cost = |(a, _, batch): &(&ChainBudget, Destination, Mutex<Batch>)| {
            let rays = 1 + u64::from(a.sampler.depth().unwrap_or(0));
            lock(batch).len() as u64 * u64::from(a.iterations) * rays
        };
        let mut order: Vec<(u64, usize)> = (self.batches.iter().map(cost)).zip(0..).collect();
        order.sort_by_key(|(cost, i)| (Reverse(*cost), *i));
        let mut loads: BinaryHeap<_> = (0..team.size()).map(|rank| Reverse((0, rank))).collect();
        let mut owners = vec![0; order.len()];
        for (cost, i) in order {
            if let Some(mut least) = loads.peek_mut() {
                let Reverse((load, rank)) = &mut *least;
                owners[i] = *rank;
                *load += cost;
            }
        }
        let mut owners = owners.into_iter();
        self.batches.retain(|_| owners.next() == Some(team.rank()));
    }

    /// Marches until every chain has made its iterations, in rounds; says what ended it. After
    /// each `beside` is told the part that is done, and `enough` is asked between rounds whether
    /// the picture is good enough. It takes at least `least`, if there is so much to do.
    ///
    /// # Errors
    /// Those of `enough`.
    pub fn march<L: Lanes>(
        &mut self,
        film: &SplatFilm,
        least: Duration,
        mut beside: impl FnMut(f64),
        mut enough: impl FnMut(&Held) -> Result<bool, Malformed>,
    ) -> Result<EndedBy, Malformed> {
        let total = self.mutations(|a| a.iterations);
        let longest = self.budgets.iter().map(|a| a.iterations).max();
        let Some(longest) = longest.filter(|i| *i > 0) else {
            return Ok(EndedBy::Effort);
        };
        let start = Instant::now();
        [self.done, self.room] = self.run.team().agree([self.done, self.room]);
        // Fractions of the whole.
        let mut step = 4.0 / f64::from(longest);
        while self.done < 1.0 {
            let begin = Instant::now();
            let before = self.done;
            let until = if before + step < 1.0 {
                before + step
            } else {
                1.0
            };
            let Some(until) = self.fit(film, self.run.team().agree(until)) else {
                self.full = true;
                return Ok(EndedBy::Effort);
            };
            self.round::<L>(film, until);
            self.done = until;
            beside(until);
            let made = self.mutations(|a| part(a, until));
            (self.run.observer).progress(Phase::Render, made, total);
            if until < 1.0 {
                if let Some(by) = self.run.ended(start.elapsed() >= least) {
                    return Ok(by);
                }
                if enough(&self.held())? {
                    return Ok(EndedBy::Target);
                }
            }
            step = ((until - before) * self.run.pace(begin.elapsed())).max(f64::EPSILON);
        }
        Ok(EndedBy::Effort)
    }

    /// The fraction up to which the film has room, at most `until`; the same at all processes of a
    /// team.
    fn fit(&mut self, film: &SplatFilm, mut until: f64) -> Option<f64> {
        if self.room == f64::INFINITY {
            return Some(until);
        }
        let made = |fraction| self.mutations(|a| part(a, fraction)) as f64;
        let before = made(self.done);
        let mut room = self.room;
        if made(until) - before > room {
            // The sum of all films is no fuller than all of them together.
            let team = self.run.team();
            room = film.room(team.agree(team.sum(film.fullest())));
            let part = 0.5 * room / (made(until) - before);
            until = self.done + (until - self.done) * part.min(1.0);
            if made(until) - before > room {
                return None;
            }
        }
        self.room = room - (made(until) - before);
        Some(until)
    }

    /// All batches that are here.
    pub fn held(&self) -> Held<'a, '_> {
        let batches = self.batches.iter();
        batches.map(|(a, to, b)| (*a, *to, lock(b))).collect()
    }

    fn mutations(&self, iterations: impl Fn(&ChainBudget) -> u32) -> u64 {
        let budgets = self.budgets.iter().zip(&self.own);
        budgets.map(|(a, own)| u64::from(iterations(a)) * own).sum()
    }

    /// What is worth a warning.
    pub fn warned(&self) -> Vec<String> {
        let full = self.full.then(|| {
            "the film is full: it was made for fewer mutations; begin anew to make more".into()
        });
        full.into_iter().collect()
    }

    /// Marches all batches to the fraction `until` of their iterations.
    fn round<L: Lanes>(&self, film: &SplatFilm, until: f64) {
        lock(&self.queue).extend(0..self.batches.len());
        rayon::broadcast(|context| {
            let mut workspace = lock(&self.workspaces[context.index()]);
            loop {
                // Not in the condition: the guard would live as long as the body.
                let next = lock(&self.queue).pop_front();
                let Some(i) = next else {
                    break;
                };
                let (a, to, batch) = &self.batches[i];
                let mut batch = lock(batch);
                let left = part(a, until).saturating_sub(batch.iterations());
                batch.march::<L>(
                    self.run.world,
                    &a.proposals,
                    left.min(STRIDE),
                    &mut workspace,
                    film,
                    *to,
                );
                if left > STRIDE {
                    lock(&self.queue).push_back(i);
                }
            }
        });
    }

    /// All batches, with their budgets and where their splats go.
    pub fn finish(self) -> Vec<(&'a ChainBudget, Destination, Batch)> {
        let own = |batch: Mutex<Batch>| {
            batch
                .into_inner()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
        };
        (self.batches.into_iter())
            .map(|(a, to, batch)| (a, to, own(batch)))
            .collect()
    }
}

/// Iterations that are a fraction of a budget's; a pure function, so that all batches of a
/// layer reach the same.
fn part(a: &ChainBudget, fraction: f64) -> u32 {
    (f64::from(a.iterations) * fraction).ceil() as u32
}

/// Chains of each budget that are here.
fn own(run: &Run, budgets: &[ChainBudget]) -> Vec<u64> {
    let share = |a: &ChainBudget| run.share(a.chains as u64, GRAIN);
    let shares = budgets.iter().map(share);
    shares.map(|share| share.end - share.start).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_seeds_are_not_parted() {
        let seeds = [1, 1, 1, 4, 5, 5, 5, 5, 5, 9];
        let borders: Vec<usize> = (0..=10).map(|at| border(&seeds, at)).collect();
        assert_eq!(borders, [0, 0, 3, 3, 4, 4, 4, 9, 9, 9, 10]);
    }
}
