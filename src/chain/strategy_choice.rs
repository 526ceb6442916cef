//! How chains choose strategies, learned from the bootstrap and then frozen.
//!
//! A strategy is chosen with the probability `q_s = (1 - EVEN) r_s + EVEN / n`: half of all choices
//! follow the shares `r_s` of the depth's light that the `n` strategies carried in the bootstrap,
//! the other half is even, so that none is chosen less than half as often as uniformly,
//! whatever the bootstrap has missed. Large steps then go where light is, and targets `f / q_s`
//! differ less from strategy to strategy. Contributions are divided by `q_s`, so any choice is
//! right (Hachisuka et al. 2014 multiplex uniformly; MIS weights are left as they are, which sum to
//! 1 whatever the choice).

use super::bootstrap::Moments;
use crate::plan::{Choice, DepthPlan};

/// Part of all probability that is divided evenly.
pub const EVEN: f64 = 0.5;

/// Effective number of lit paths from which shares of `n` strategies are learned: `7 n / (2 EVEN)`.
///
/// A strategy with the share `r` that `m` such paths have missed altogether, with probability `(1 -
/// r)^m <= exp(-r m)`, has only its part `EVEN / n` of choices, and those weigh `r n / EVEN` times
/// as much as they should. The bound has strategies for which that is more than 2, of `r > 2 EVEN /
/// n`, missed with less than `exp(-7)`: once in a thousand.
pub fn enough(n: usize) -> f64 {
    7.0 * n as f64 / (2.0 * EVEN)
}

/// The choice that `strategies`, sums over the bootstrap's paths of each strategy of `plan`,
/// suggest. `None`, that is to choose uniformly, if there is nothing to choose, or light has come
/// by fewer than [`enough`] paths. Paths count by their effective number (sum of targets)^2 / sum
/// of squared targets (Kish 1965): a single path with all the light is one, however many are dim.
pub fn learned(plan: &DepthPlan, strategies: &[Moments]) -> Option<Choice> {
    let n = plan.strategies.len();
    if n < 2 || strategies.len() != n {
        return None;
    }
    let sums = |of: fn(&Moments) -> f64| strategies.iter().map(of).sum::<f64>();
    let (sum, squares) = (sums(|m| m.sum), sums(|m| m.sum_squares));
    // False also for no light at all.
    let told = sum * sum >= enough(n) * squares && sum > 0.0 && squares.is_finite();
    let total = sums(Moments::mean);
    let weight = |m: &Moments| (1.0 - EVEN) * m.mean() / total + EVEN / n as f64;
    let weights = || strategies.iter().map(weight).collect::<Vec<f64>>();
    told.then(|| Choice::weighted(&plan.strategies, &weights()))
}
