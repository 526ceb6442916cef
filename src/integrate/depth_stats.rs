//! Figures of chains by depth, and of their agreement with large steps.

use crate::chain::mixing::{Mixing, StrategyMixing};
use serde::{Serialize, Serializer};

/// Chains have mixed if split R-hat is below this (Gelman et al. 2013, section 11.5).
pub const MIXED: f64 = 1.1;
/// Part of all light below which a depth or a strategy is not worth a warning: its own error is in
/// the estimate.
pub(super) const MATTERS: f64 = 0.05;

/// Figures of one depth, or of all depths at once.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DepthStats {
    /// `None` for all depths at once: `"all"` where it is written.
    #[serde(serialize_with = "depth_or_all")]
    pub depth: Option<u32>,
    /// Mean over the sampled raster region of the depth's target (mean channel of radiance).
    pub b: f64,
    /// Standard error of [`Self::b`].
    pub b_stderr: f64,
    /// Part of all light.
    pub share: f64,
    /// Independent paths of equal light that would tell [`Self::b`] as well.
    pub effective: f64,
    /// How many marched.
    pub chains: usize,
    /// Of all of them together.
    pub mutations: u64,
    /// Scale of small steps, as set or as tuned.
    pub sigma: f32,
    /// Probability of large steps, as set or as tuned.
    pub large_step_probability: f32,
    /// How well they have mixed.
    #[serde(flatten)]
    pub mixing: Mixing,
}

fn depth_or_all<S: Serializer>(depth: &Option<u32>, to: S) -> Result<S::Ok, S::Error> {
    match depth {
        Some(depth) => to.serialize_u32(*depth),
        None => to.serialize_str("all"),
    }
}

/// `depth 3`, or `all depths`.
pub(super) fn named(depth: Option<u32>) -> String {
    depth.map_or("all depths".into(), |depth| format!("depth {depth}"))
}

impl DepthStats {
    /// Its chains are long enough to tell whether they agree, or it has less than a twentieth of
    /// all light.
    pub(super) fn is_told(&self) -> bool {
        self.share < MATTERS || self.mixing.rhat.is_some()
    }

    /// The largest R-hat that is too large, where it matters.
    pub(super) fn apart(&self) -> Option<f64> {
        let strategies = self.mixing.strategies.iter().map(|s| (s.rhat, s.share));
        let all = std::iter::once((self.mixing.rhat, 1.0)).chain(strategies);
        all.filter(|(_, share)| share * self.share >= MATTERS)
            .filter_map(|(rhat, _)| rhat)
            .filter(|rhat| *rhat > MIXED)
            .max_by(f64::total_cmp)
    }

    /// Of the strategies that matter the one whose chains agree least; if none does, the one with
    /// the most light.
    pub(super) fn worst_strategy(&self) -> Option<(u32, u32)> {
        let strategies = self.mixing.strategies.iter();
        let badness = |s: &&StrategyMixing| {
            let matters = s.share * self.share >= MATTERS;
            (s.rhat.filter(|_| matters).unwrap_or(0.0), s.share)
        };
        strategies
            .max_by(|a, b| {
                let (a, b) = (badness(a), badness(b));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
            })
            .map(|s| (s.s, s.t))
    }
}

/// Agreement of chains and large steps, tile by tile and depth by depth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CrossCheck {
    /// Pairs of tiles and depths in which large steps have found light at all often enough to
    /// tell.
    pub compared: u64,
    /// Those in which they have found more than the chains, beyond chance.
    pub missed: u64,
    /// The one with the most missing light.
    pub worst: Option<Missed>,
}

/// Light that the chains have not visited as often as they should have.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Missed {
    /// As in [`DepthStats`].
    #[serde(serialize_with = "depth_or_all")]
    pub depth: Option<u32>,
    /// Pixels `[x0, x1, y0, y1]` of the tile.
    pub tile: [u32; 4],
    /// Mean radiance of the tile at this depth, as it is in the picture.
    pub chains: f64,
    /// The same radiance as large steps have it.
    pub large_steps: f64,
    /// The difference, in standard errors.
    pub deviation: f64,
}
