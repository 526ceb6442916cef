//! Counter-based random numbers: a hash of (seed, chain, iteration, dimension block, purpose) gives
//! four numbers.
//!
//! Any number can be had in any order, so lane width, batch size, threads, sharding and resuming
//! cannot change a result. The hash is pcg4d ([`Numerics::hash`](super::Numerics::hash)).

use super::{Lanes, UintLanes};

/// What a number is used for. No two uses share a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// Fresh primary samples of a bootstrap path.
    Bootstrap = 1,
    /// The mutation of a chain: fresh primary samples or offsets, never both.
    Mutation = 2,
    /// The choice between large and small step, and the acceptance test.
    Decision = 3,
    /// Picking bootstrap samples to start chains from.
    Seeding = 4,
    /// The path tracer's samples.
    PathTracer = 5,
    /// Those of bidirectional path tracing.
    Bidirectional = 6,
    /// Those of light tracing.
    LightTracer = 7,
    /// As `Mutation`, `Decision` and `Seeding`, for chains that only tune others.
    Tuning = 8,
    /// As `Decision`.
    TuningDecision = 9,
    /// As `Seeding`.
    TuningSeeding = 10,
    /// Samples that find out who should render what.
    Pilot = 11,
    /// As `Mutation`, for the chains that do.
    PilotMutation = 12,
    /// As `Decision`, for the pilot's chains.
    PilotDecision = 13,
    /// As `Seeding`, for the pilot's chains.
    PilotSeeding = 14,
}

/// The constant half of a counter: 32 bits that mix the run's seed and the purpose.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    key: u32,
    salt: u32,
}

impl Stream {
    /// Mixes a 64-bit seed and a purpose (splitmix64 finaliser; Steele et al. 2014).
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        let mut z = seed.wrapping_add((purpose as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        Self {
            key: z as u32,
            salt: (z >> 32) as u32,
        }
    }

    /// Four words for counter (`x`, `y`, `block`): typically chain, iteration, and dimension / 4.
    #[inline(always)]
    pub fn words<L: Lanes>(&self, x: L::Uint, y: L::Uint, block: u32) -> [L::Uint; 4] {
        let counter = [
            x,
            y.xor(L::Uint::splat(self.salt)),
            L::Uint::splat(block),
            L::Uint::splat(self.key),
        ];
        L::hash(counter)
    }

    /// Four floats in `[0, 1)`.
    #[inline(always)]
    pub fn uniforms<L: Lanes>(&self, x: L::Uint, y: L::Uint, block: u32) -> [L; 4] {
        let [a, b, c, d] = self.words::<L>(x, y, block);
        [
            unit_float::<L>(a),
            unit_float::<L>(b),
            unit_float::<L>(c),
            unit_float::<L>(d),
        ]
    }
}

/// The top 24 bits of a word as a multiple of 2^-24 in `[0, 1)`.
#[inline(always)]
pub fn unit_float<L: Lanes>(word: L::Uint) -> L {
    L::from_uint24(word.shr::<8>()) * L::splat(1.0 / 16_777_216.0)
}

/// Four words that look random, a function of four.
#[inline(always)]
pub fn hash<L: Lanes>(v: [L::Uint; 4]) -> [L::Uint; 4] {
    L::hash(v)
}
