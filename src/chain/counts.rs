//! What chains count while they march, and how they are numbered.

use super::bootstrap::Moments;
use super::splats::WEIGHT_BITS;
use crate::checkpoint::{Malformed, Reader, Writer};

/// What happened to proposals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Counts {
    /// Large steps proposed.
    pub large: u64,
    /// Sum of acceptance probabilities of large steps, in units of 2^-32.
    pub large_accepted: u64,
    /// Small steps proposed.
    pub small: u64,
    /// Sum of acceptance probabilities of small steps, in units of 2^-32.
    pub small_accepted: u64,
    /// Proposals whose contribution was no finite number; they count as dark.
    pub rejected: u64,
    /// Rays traced.
    pub rays: u64,
}

impl Counts {
    /// Adds what others have counted.
    pub fn merge(&mut self, o: &Self) {
        self.large += o.large;
        self.large_accepted += o.large_accepted;
        self.small += o.small;
        self.small_accepted += o.small_accepted;
        self.rejected += o.rejected;
        self.rays += o.rays;
    }
    /// Mean acceptance probability of large and small steps.
    pub fn acceptance(&self) -> (f64, f64) {
        let rate = |sum: u64, n: u64| {
            if n > 0 {
                sum as f64 / 2f64.powi(WEIGHT_BITS as i32) / n as f64
            } else {
                0.0
            }
        };
        (
            rate(self.large_accepted, self.large),
            rate(self.small_accepted, self.small),
        )
    }
}

/// Chain number of chain `j` of a sampler. No two chains of a run share one, and none depends on
/// how chains are batched.
pub(super) fn chain_id(sampler: u32, j: usize) -> u32 {
    sampler << MAX_CHAINS_BITS | j as u32
}

const MAX_CHAINS_BITS: u32 = 20;
/// Chains a depth can have.
pub const MAX_CHAINS_PER_DEPTH: usize = 1 << MAX_CHAINS_BITS;
/// Depths a run can have.
pub const MAX_DEPTHS: u32 = 1 << (32 - MAX_CHAINS_BITS);

/// Sums over the large steps of each chain.
pub(super) struct LargeSteps {
    pub count: Vec<u32>,
    pub sum: Vec<f64>,
    pub squares: Vec<f64>,
}

impl LargeSteps {
    pub fn new(chains: usize) -> Self {
        Self {
            count: vec![0; chains],
            sum: vec![0.0; chains],
            squares: vec![0.0; chains],
        }
    }

    pub fn save(&self, to: &mut Writer) {
        let Self {
            count,
            sum,
            squares,
        } = self;
        to.table(count);
        to.table(sum);
        to.table(squares);
    }

    /// Those of so many chains.
    pub fn load(chains: usize, from: &mut Reader) -> Result<Self, Malformed> {
        Ok(Self {
            count: from.vector(chains)?,
            sum: from.vector(chains)?,
            squares: from.vector(chains)?,
        })
    }

    /// Chain by chain.
    pub fn moments(&self) -> impl Iterator<Item = Moments> {
        let sums = self.sum.iter().zip(&self.squares);
        self.count
            .iter()
            .zip(sums)
            .map(|(n, (sum, squares))| Moments {
                count: u64::from(*n),
                sum: *sum,
                sum_squares: *squares,
            })
    }
}
