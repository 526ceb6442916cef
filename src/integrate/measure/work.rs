//! The work that is timed: chains of every depth, as one thread of a render marches them.

use super::bench::Bench;
use crate::chain::batch::{Batch, Workspace};
use crate::chain::mutate::large_step_probability;
use crate::film::{Destination, GROUPS, Tiling};
use crate::integrate::schedule::{STRIDE, layer_of};
use crate::simd::Lanes;
use crate::transport::clock::{Clock, Spent, Stage};
use std::marker::PhantomData;
use std::time::Instant;

/// One batch of every depth that carries light. Two of the same number make the same mutations,
/// whatever their width.
pub(super) struct Work<L> {
    batches: Vec<Share>,
    workspace: Workspace,
    /// Splats go to the film that knows its own error, those of every other turn also to its half.
    judged: bool,
    turn: u64,
    width: PhantomData<L>,
}

struct Share {
    /// Visits per turn: 1 for the depth with the most light, else its fraction of that.
    rate: f64,
    /// Visits that are due.
    due: f64,
    layer: usize,
    batch: Batch,
}

/// What some turns took.
#[derive(Clone, Copy, Default)]
pub(super) struct Taken {
    pub seconds: f64,
    pub mutations: u64,
    pub rays: u64,
    /// All zeros if the clock was off.
    pub spent: [Spent; Stage::ALL.len()],
}

impl<L: Lanes> Work<L> {
    /// The work of thread `number` of `threads`, each with chains of its own.
    pub fn new(bench: &Bench, number: usize, threads: usize) -> Self {
        let mut workspace = Workspace::new(bench.world);
        let light = |i: usize| bench.bootstraps[i].estimate.mean();
        let depths = 0..bench.bootstraps.len();
        let most = depths.clone().map(light).fold(0.0, f64::max);
        let batches = depths
            .filter(|i| light(*i) > 0.0)
            .map(|i| {
                let p = large_step_probability(bench.proposals.large_step_probability);
                let sampler = &bench.samplers[i];
                let all = threads * bench.chains;
                let seeds = bench.bootstraps[i].seeds(bench.seed, sampler.id(), all);
                let first = number * bench.chains;
                let seeds = &seeds[first..first + bench.chains];
                let paths = &mut workspace.paths;
                let mut batch =
                    Batch::new::<L>(bench.world, sampler, first, seeds, bench.seed, paths);
                if let Some(layer) = bench.independent {
                    batch.combine((p * light(i)) as f32, layer);
                }
                Share {
                    rate: light(i) / most,
                    // Rounds what is due, in the long run, to the nearest visit.
                    due: 0.5,
                    layer: layer_of(i),
                    batch,
                }
            })
            .collect();
        Self {
            batches,
            workspace,
            judged: false,
            turn: 0,
            width: PhantomData,
        }
    }

    /// The work of one thread, its chains watched, on the film that knows its own error.
    pub fn judged(bench: &Bench) -> Self {
        let mut work = Self::new(bench, 0, 1);
        let tiling = Tiling::new(bench.crop);
        for share in &mut work.batches {
            let groups: Vec<u8> = (0..share.batch.len())
                .map(|i| (i * GROUPS / share.batch.len()) as u8)
                .collect();
            (share.batch).watch(&groups, &tiling);
        }
        work.judged = true;
        work
    }

    /// Turns the stage clock on or off, and sets it to zero.
    pub fn set_clock(&mut self, on: bool) {
        let clock = &mut self.workspace.paths.clock;
        *clock = Clock::default();
        if on {
            clock.start();
        }
    }

    /// Some turns, timed. In a turn the depth with the most light is visited once, others less
    /// often, in proportion to their light.
    pub fn turns(&mut self, bench: &Bench, turns: u64) -> Taken {
        let paths = &self.workspace.paths;
        let (rays, clock) = (paths.rays.traced, paths.clock.spent);
        let mut mutations = 0;
        let start = Instant::now();
        for _ in 0..turns {
            mutations += self.turn(bench);
        }
        let seconds = start.elapsed().as_secs_f64();
        let paths = &self.workspace.paths;
        let mut spent = paths.clock.spent;
        for (now, before) in spent.iter_mut().zip(&clock) {
            now.seconds -= before.seconds;
            now.items -= before.items;
            now.slots -= before.slots;
        }
        Taken {
            seconds,
            mutations,
            rays: paths.rays.traced - rays,
            spent,
        }
    }

    fn turn(&mut self, bench: &Bench) -> u64 {
        let mut mutations = 0;
        self.turn += 1;
        let film = if self.judged {
            &bench.judged
        } else {
            &bench.film
        };
        for share in &mut self.batches {
            share.due += share.rate;
            if share.due < 1.0 {
                continue;
            }
            share.due -= 1.0;
            share.batch.march::<L>(
                bench.world,
                &bench.proposals,
                STRIDE,
                &mut self.workspace,
                film,
                Destination {
                    layer: share.layer,
                    scale: 1.0,
                    half: self.turn.is_multiple_of(2),
                },
            );
            mutations += u64::from(STRIDE) * share.batch.len() as u64;
        }
        mutations
    }
}
