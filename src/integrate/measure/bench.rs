//! What all measurements share.

use crate::chain::bootstrap::Bootstrap;
use crate::chain::mutate::ProposalDistribution;
use crate::film::SplatFilm;
use crate::transport::{PathSampler, World};
use std::time::Duration;

/// Rounds of a comparison; an odd number, so that the median is one of them.
pub const ROUNDS: usize = 7;

/// A scene made ready, and how it is measured.
pub struct Bench<'a> {
    pub world: &'a World<'a>,
    pub film: SplatFilm,
    /// One that knows its own error.
    pub judged: SplatFilm,
    /// `[x0, x1, y0, y1]` of the picture.
    pub crop: [u32; 4],
    pub proposals: ProposalDistribution,
    pub bootstraps: Vec<Bootstrap>,
    /// As chains choose strategies.
    pub samplers: Vec<PathSampler>,
    /// The layer of large steps, if they are splatted as independent samples.
    pub independent: Option<usize>,
    pub seed: u64,
    /// Chains of a batch.
    pub chains: usize,
    /// Time that one side of a comparison gets.
    pub time: Duration,
}
