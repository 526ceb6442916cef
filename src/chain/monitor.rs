//! What a batch's chains have been up to: how well they mix, how their proposals fare, and where
//! independent samples find light.
//!
//! Chains are recorded every [`EVERY`]th iteration: neighbouring states are alike, and a sixteenth
//! of them tells nearly as much. Records go to up to four segments of equal length; when all are
//! full, pairs are joined and the length doubles, so that a run of any length ends with two, three
//! or four equal parts to compare (the "split" of split R-hat; [`super::mixing`]).

use super::discoveries::Discoveries;
use super::splats::{ChainSplat, proposal};
use crate::film::Tiling;
use crate::simd::Lanes;
use crate::transport::Splat;
use std::ops::Range;

/// Iterations from record to record.
pub const EVERY: u32 = 16;

/// Segments that a run is split into.
const SEGMENTS: usize = 4;

/// Scalars that are recorded of every state: raster position (in pixels), and the logarithm of the
/// target (to base 2, linear between powers).
pub const SCALARS: usize = 3;

/// Sums over the records of each chain in one segment.
#[derive(Clone, Debug)]
pub struct Segment {
    /// `[scalar][chain]`
    pub sums: [Vec<f64>; SCALARS],
    /// Of the squares of the records, laid out alike.
    pub squares: [Vec<f64>; SCALARS],
    /// Records in each strategy, `[chain][strategy]`; of a sampler without strategies, as if it
    /// had one.
    pub visits: Vec<u32>,
}

impl Segment {
    fn new(chains: usize, strategies: usize) -> Self {
        let zeros = || std::array::from_fn(|_| vec![0.0; chains]);
        Self {
            sums: zeros(),
            squares: zeros(),
            visits: vec![0; chains * strategies],
        }
    }

    fn absorb(&mut self, other: &Self) {
        let own = self.sums.iter_mut().chain(&mut self.squares);
        for (to, from) in own.zip(other.sums.iter().chain(&other.squares)) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
        let visits = self.visits.iter_mut().zip(&other.visits);
        visits.for_each(|(to, from)| *to += from);
    }

    fn clear(&mut self) {
        let sums = self.sums.iter_mut().chain(&mut self.squares);
        sums.for_each(|sum| sum.fill(0.0));
        self.visits.fill(0);
    }
}

/// Recorded proposals of one kind and strategy.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tally {
    /// How many were recorded.
    pub proposals: u64,
    /// Sum of their acceptance probabilities, in units of 2^-32: the same in any order.
    pub accepted: u64,
    /// Proposals that carry no light.
    pub dark: u64,
}

/// An acceptance probability of 1 in [`Tally::accepted`].
const UNIT: f64 = (1u64 << 32) as f64;

impl Tally {
    /// Sum of acceptance probabilities.
    pub fn acceptance(&self) -> f64 {
        self.accepted as f64 / UNIT
    }

    /// Adds what others have recorded.
    pub fn merge(&mut self, other: &Self) {
        self.proposals += other.proposals;
        self.accepted += other.accepted;
        self.dark += other.dark;
    }
}

/// Large steps that have fallen into a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct TileMoments {
    /// Those with light.
    pub count: u64,
    /// Of their targets.
    pub sum: f64,
    /// Of the squares of their targets.
    pub squares: f64,
}

/// The longest time that a chain stayed in one state.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Stay {
    /// To within [`EVERY`].
    pub iterations: u32,
    /// Raster position of the state, in pixels.
    pub raster: [f32; 2],
    /// Light vertices of its strategy, if the sampler has strategies.
    pub s: u32,
}

/// The weights that a group of chains has left in each tile.
pub struct GroupTiles {
    /// Below [`GROUPS`](crate::film::GROUPS).
    pub group: u8,
    /// Chains of the batch that belong to it.
    pub chains: Range<usize>,
    /// In units of 2^-24 of a mutation.
    pub sums: Vec<u64>,
    /// The same of large steps, if they are splatted as independent samples.
    pub independent: Vec<u64>,
}

/// Bits that a tile does without, so that its sum has room: weights come in units of 2^-32.
const SPARED: u32 = 8;
/// Units of [`GroupTiles::sums`] in a mutation.
pub const UNITS: f64 = (1u64 << (32 - SPARED)) as f64;

/// What is recorded of the chains of a batch.
pub struct Monitor {
    groups: Vec<GroupTiles>,
    /// Tile of the state that each chain leaves (bits); room for all lanes.
    places: Vec<f32>,
    /// Of the depth, ascending.
    strategies: Vec<u32>,
    /// Index of a strategy, by its light vertices.
    index: Vec<usize>,
    segments: [Segment; SEGMENTS],
    /// Segments that are full.
    full: usize,
    /// Records in the segment that is being filled, and in one that is full.
    records: u32,
    length: u32,
    /// Iterations since the current state was accepted.
    held: Vec<f32>,
    stays: Vec<Stay>,
    /// `[small, large][strategy]`
    tallies: [Vec<Tally>; 2],
    tiling: Tiling,
    large: Vec<TileMoments>,
    found: Discoveries,
    /// Large steps with light of the latest iteration; room for all.
    lit: Vec<u32>,
}

/// What a batch shows its monitor after an iteration; one entry a chain.
pub(super) struct View<'a> {
    /// Large steps are splatted as independent samples, too, and states can have several splats.
    pub combined: bool,
    /// `[splat][chain]`, of the current states and of those that are left.
    pub states: &'a [ChainSplat],
    pub left: &'a [ChainSplat],
    /// Of the current states.
    pub targets: &'a [f32],
    /// First splats.
    pub proposed: &'a [Splat],
    /// Acceptance probabilities, and 1 or 0 for accepted and for large.
    pub share: &'a [f32],
    pub taken: &'a [f32],
    pub large: &'a [f32],
    /// Targets of large steps, 0 for small ones.
    pub seen: &'a [f32],
    /// Weights of the states that are left.
    pub left_weights: &'a [u64],
}

impl Monitor {
    /// For as many chains as `groups` has members: the group of each, ascending. `strategies` are
    /// those of the sampler; large steps are splatted as independent samples if they are
    /// `combined`.
    pub fn new(groups: &[u8], strategies: &[u32], combined: bool, tiling: &Tiling) -> Self {
        let (chains, all) = (groups.len(), strategies.len().max(1));
        let mut end = 0;
        let groups = groups.chunk_by(|a, b| a == b).map(|run| {
            let start = end;
            end += run.len();
            GroupTiles {
                group: run[0],
                chains: start..end,
                sums: vec![0; tiling.len()],
                independent: vec![0; if combined { tiling.len() } else { 0 }],
            }
        });
        let groups = groups.collect();
        let mut index = vec![0; strategies.last().map_or(1, |s| *s as usize + 1)];
        for (i, s) in strategies.iter().enumerate() {
            index[*s as usize] = i;
        }
        let never = Stay {
            iterations: 0,
            raster: [0.0; 2],
            s: 0,
        };
        Self {
            groups,
            places: vec![0.0; chains.next_multiple_of(8)],
            strategies: strategies.to_vec(),
            index,
            segments: std::array::from_fn(|_| Segment::new(chains, all)),
            full: 0,
            records: 0,
            length: 1,
            held: vec![0.0; chains],
            stays: vec![never; chains],
            tallies: [vec![Tally::default(); all], vec![Tally::default(); all]],
            tiling: tiling.clone(),
            large: vec![TileMoments::default(); tiling.len()],
            found: Discoveries::roomy(),
            lit: vec![0; chains + 1],
        }
    }

    /// Sees the end of an iteration.
    pub(super) fn see(&mut self, iteration: u32, view: &View) {
        for (held, taken) in self.held.iter_mut().zip(view.taken) {
            // 1 where the state is new, so that a rejection makes 2.
            *held = *held * (1.0 - taken) + 1.0;
        }
        if view.combined {
            self.weigh_splats(view.left, view.left_weights);
            self.see_independent(view);
        } else {
            self.weigh(view.left_weights);
            // All of them: light that chains miss is found by few.
            self.see_large(view);
        }
        if iteration % EVERY == EVERY - 1 {
            self.record(view);
        }
    }

    /// Notes where the states are that chains `start..` leave: raster positions in pixels.
    #[inline(always)]
    pub(super) fn place<L: Lanes>(&mut self, start: usize, x: L, y: L) {
        let tiles = self.tiling.indices(x, y);
        L::from_bits(tiles).store(&mut self.places[start..]);
    }

    /// Adds weights to the tiles noted.
    fn weigh(&mut self, weights: &[u64]) {
        for group in &mut self.groups {
            let places = &self.places[group.chains.clone()];
            for (place, weight) in places.iter().zip(&weights[group.chains.clone()]) {
                if let Some(sum) = group.sums.get_mut(place.to_bits() as usize) {
                    *sum += weight >> SPARED;
                }
            }
        }
    }

    /// Adds the weights of states, one a chain, to the tiles they are in; those beyond the picture,
    /// to the nearest.
    pub(super) fn weigh_states(&mut self, states: &[ChainSplat], weights: &[u64]) {
        for (i, state) in states.iter().enumerate() {
            self.place(i, state.raster[0], state.raster[1]);
        }
        self.weigh(weights);
    }

    /// Adds the weights of states to the tiles that their splats, `[splat][chain]`, are in, in
    /// proportion to their light; those beyond the picture, to the nearest.
    pub(super) fn weigh_splats(&mut self, splats: &[ChainSplat], weights: &[u64]) {
        for splats in splats.chunks(self.held.len().max(1)) {
            for group in &mut self.groups {
                for i in group.chains.clone() {
                    let (light, raster) = seen(&splats[i]);
                    if light > 0.0 && weights[i] > 0 {
                        let part = (weights[i] as f64 * light) as u64;
                        group.sums[self.tiling.index(raster)] += part >> SPARED;
                    }
                }
            }
        }
    }

    /// Large steps, each an independent sample of several splats. Like all splats they are weighed
    /// against the states of the chains, and so are the moments by which both are compared.
    fn see_independent(&mut self, view: &View) {
        let n = self.held.len();
        for group in &mut self.groups {
            for i in group.chains.clone() {
                if view.seen[i] <= 0.0 {
                    continue;
                }
                self.found.see(&view.proposed[i], view.seen[i]);
                // Splats of one sample in one tile are one value, whose square is wanted.
                let splats = |row: usize| {
                    let at = row * n + i;
                    seen(proposal(view.taken[i], &view.states[at], &view.left[at]))
                };
                let rows = view.states.len() / n;
                for row in 0..rows {
                    let (mut light, raster) = splats(row);
                    let tile = self.tiling.index(raster);
                    if light <= 0.0 {
                        continue;
                    }
                    group.independent[tile] += (light * UNITS) as u64;
                    let same = |other: &usize| {
                        let (light, raster) = splats(*other);
                        light > 0.0 && self.tiling.index(raster) == tile
                    };
                    if (0..row).any(|other| same(&other)) {
                        continue;
                    }
                    light += (row + 1..rows)
                        .filter(same)
                        .map(|o| splats(o).0)
                        .sum::<f64>();
                    let target = light * f64::from(view.seen[i]);
                    let moments = &mut self.large[tile];
                    moments.count += 1;
                    moments.sum += target;
                    moments.squares += target * target;
                }
            }
        }
    }

    fn see_large(&mut self, view: &View) {
        let mut n = 0;
        for (i, seen) in view.seen[..self.held.len()].iter().enumerate() {
            // Written always, counted if lit: a branch would be guessed wrong.
            self.lit[n] = i as u32;
            n += usize::from(*seen > 0.0);
        }
        for &i in &self.lit[..n] {
            let i = i as usize;
            self.found.see(&view.proposed[i], view.seen[i]);
            let target = f64::from(view.seen[i]);
            let tile = self.tiling.index(view.proposed[i].raster);
            let moments = &mut self.large[tile];
            moments.count += 1;
            moments.sum += target;
            moments.squares += target * target;
        }
    }

    fn record(&mut self, view: &View) {
        let (n, all) = (self.held.len(), self.tallies[0].len());
        let segment = &mut self.segments[self.full];
        // Without strategies everything counts as one.
        let index = |s: u32| self.index.get(s as usize).copied().unwrap_or(0);
        for i in 0..n {
            let ChainSplat {
                raster: [x, y], s, ..
            } = view.states[i];
            let log = logarithm(view.targets[i]);
            for (c, v) in [f64::from(x), f64::from(y), log].into_iter().enumerate() {
                segment.sums[c][i] += v;
                segment.squares[c][i] += v * v;
            }
            segment.visits[i * all + index(s)] += 1;
            let held = self.held[i] as u32;
            if held > self.stays[i].iterations {
                let (raster, s) = brightest(view.states[i..].iter().step_by(n));
                self.stays[i] = Stay {
                    iterations: held,
                    raster,
                    s,
                };
            }
            let splat = &view.proposed[i];
            let kind = usize::from(view.large[i] > 0.0);
            let tally = &mut self.tallies[kind][index(splat.s)];
            tally.proposals += 1;
            tally.accepted += (f64::from(view.share[i]) * UNIT) as u64;
            tally.dark += u64::from(view.is_dark(i));
        }
        self.records += 1;
        if self.records == self.length {
            self.records = 0;
            self.full += 1;
            if self.full == SEGMENTS {
                self.join();
            }
        }
    }

    /// Pairs of segments become one.
    fn join(&mut self) {
        let [a, b, c, d] = &mut self.segments;
        a.absorb(b);
        c.absorb(d);
        std::mem::swap(b, c);
        c.clear();
        d.clear();
        self.full = SEGMENTS / 2;
        self.length *= 2;
    }

    /// What each group has left in each tile.
    pub fn groups(&self) -> &[GroupTiles] {
        &self.groups
    }
    /// Light vertices of the strategies, ascending.
    pub fn strategies(&self) -> &[u32] {
        &self.strategies
    }
    /// The full segments, and the number of records in each.
    pub fn segments(&self) -> (&[Segment], u32) {
        (&self.segments[..self.full], self.length)
    }
    /// Recorded proposals, `[small, large][strategy]`.
    pub fn tallies(&self) -> &[Vec<Tally>; 2] {
        &self.tallies
    }
    /// Large steps, tile by tile: independent uniform samples.
    pub fn large(&self) -> &[TileMoments] {
        &self.large
    }
    /// Large steps that have met lights as only chance can.
    pub fn found(&self) -> &Discoveries {
        &self.found
    }
    /// The longest stay of each chain.
    pub fn stays(&self) -> &[Stay] {
        &self.stays
    }
}

impl View<'_> {
    /// What was proposed to chain `i` carries no light.
    fn is_dark(&self, i: usize) -> bool {
        if !self.combined {
            return self.proposed[i].rgb == [0.0; 3];
        }
        let n = self.proposed.len();
        let rows = self.states[i..].iter().zip(&self.left[i..]).step_by(n);
        rows.map(|(current, left)| seen(proposal(self.taken[i], current, left)).0)
            .all(|light| light <= 0.0)
    }
}

/// Mean channel of a splat, in parts of its state's light, and where it is.
fn seen(splat: &ChainSplat) -> (f64, [f32; 2]) {
    let [r, g, b] = splat.colour;
    let sum = f64::from(r) + f64::from(g) + f64::from(b);
    (sum / 3.0, splat.raster)
}

/// Place and light vertices of the brightest of a state's splats.
fn brightest<'a>(splats: impl Iterator<Item = &'a ChainSplat>) -> ([f32; 2], u32) {
    let best = splats.reduce(|a, b| if seen(b).0 > seen(a).0 { b } else { a });
    let best = best.copied().unwrap_or_default();
    (best.raster, best.s)
}

/// `log2 x` at powers of two, linear in between: monotone, and cheap.
#[inline(always)]
fn logarithm(x: f32) -> f64 {
    f64::from(x.to_bits()) / f64::from(1 << 23)
}

mod saved;
#[cfg(test)]
mod tests;
