//! How a path chooses among the strategies of its depth: uniformly, or with probabilities of their
//! own.

/// A discrete distribution over the strategies of a depth, sampled by inversion: strategies have
/// consecutive intervals of `[0, 1)`, in order, and a primary sample of its own
/// ([`Layout::strategy`](super::Layout::strategy)) falls into one.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Lower ends of the strategies' intervals, from 0 on: multiples of 2^-24, as drawn primary
    /// samples are, so that widths are probabilities exactly. Empty if all strategies are
    /// equally probable.
    starts: Vec<f32>,
    /// How many strategies there are.
    count: usize,
    /// One over the probability of the strategy with `s` light vertices, by `s`; 0 where there is
    /// none.
    factors: Vec<f32>,
}

/// Units of the ends of intervals.
const UNITS: f64 = (1 << 24) as f64;

impl Choice {
    /// All of the strategies (numbers of light vertices, ascending) are equally probable.
    pub fn uniform(strategies: &[u32]) -> Self {
        let count = strategies.len();
        let mut choice = Self {
            starts: Vec::new(),
            count,
            factors: Vec::new(),
        };
        choice.set_factors(strategies, |_| count as f32);
        choice
    }

    /// In proportion to `weights`, one for each strategy, finite and above 0 by far more than 2^-24
    /// of their sum. One strategy alone needs no choice.
    ///
    /// # Panics
    /// If weights are so small that a strategy would never be chosen.
    pub fn weighted(strategies: &[u32], weights: &[f64]) -> Self {
        if strategies.len() < 2 {
            return Self::uniform(strategies);
        }
        let total: f64 = weights.iter().sum();
        let mut running = 0.0;
        let starts = weights.iter().map(|w| {
            let start = (running / total * UNITS).round() / UNITS;
            running += w;
            start as f32
        });
        let starts = starts.collect();
        let mut choice = Self {
            count: strategies.len(),
            starts,
            factors: Vec::new(),
        };
        let probabilities: Vec<f32> = (0..choice.count).map(|i| choice.probability(i)).collect();
        assert!(
            probabilities.iter().all(|p| *p > 0.0),
            "a strategy must not be impossible: {weights:?}"
        );
        choice.set_factors_by_probability(strategies);
        choice
    }

    /// The lower ends of the intervals; none if all strategies are equally probable.
    pub fn starts(&self) -> &[f32] {
        &self.starts
    }

    /// The choice whose intervals start there; `None` if there is no such choice.
    pub fn from_starts(strategies: &[u32], starts: Vec<f32>) -> Option<Self> {
        if starts.is_empty() {
            return Some(Self::uniform(strategies));
        }
        let ascending = starts.is_sorted_by(|a, b| a < b) && starts[0] == 0.0;
        if starts.len() != strategies.len() || !ascending || starts.iter().any(|s| *s >= 1.0) {
            return None;
        }
        let mut choice = Self {
            count: strategies.len(),
            starts,
            factors: Vec::new(),
        };
        choice.set_factors_by_probability(strategies);
        Some(choice)
    }

    fn set_factors_by_probability(&mut self, strategies: &[u32]) {
        let probabilities: Vec<f32> = (0..self.count).map(|i| self.probability(i)).collect();
        self.set_factors(strategies, |i| 1.0 / probabilities[i]);
    }

    fn set_factors(&mut self, strategies: &[u32], factor: impl Fn(usize) -> f32) {
        let room = strategies.last().map_or(0, |s| *s as usize + 1);
        // Room for s = 0 and s = 1, which some kernels look up before they know that nobody needs
        // it.
        self.factors = vec![0.0; room.max(2)];
        for (i, s) in strategies.iter().enumerate() {
            self.factors[*s as usize] = factor(i);
        }
    }

    /// All strategies are equally probable.
    pub fn is_uniform(&self) -> bool {
        self.starts.is_empty()
    }

    /// Probability of the `i`-th strategy.
    pub fn probability(&self, i: usize) -> f32 {
        let (start, end) = self.interval(i);
        end - start
    }

    /// One over the probability of a strategy, by its number of light vertices; 0 for numbers that
    /// are no strategy.
    pub fn factors(&self) -> &[f32] {
        &self.factors
    }

    /// One over the probability of the strategy with `s` light vertices, or 0.
    pub fn factor(&self, s: u32) -> f32 {
        self.factors.get(s as usize).copied().unwrap_or(0.0)
    }

    /// Lower and upper end of the interval of the `i`-th strategy. Ends of equal intervals are
    /// rounded: which side a number next to one belongs to, [`Self::index`] says.
    fn interval(&self, i: usize) -> (f32, f32) {
        if self.is_uniform() {
            let n = self.count as f32;
            return (i as f32 / n, (i + 1) as f32 / n);
        }
        (
            self.starts[i],
            self.starts.get(i + 1).copied().unwrap_or(1.0),
        )
    }

    /// The strategy, from 0 on, that a primary sample in `[0, 1)` chooses.
    #[inline(always)]
    pub fn index(&self, u: f32) -> usize {
        if self.is_uniform() {
            let most = (self.count as u32).saturating_sub(1);
            // By way of `i32`, for which there are vector instructions.
            ((u * self.count as f32) as i32 as u32).min(most) as usize
        } else {
            let later = &self.starts[1..];
            later.iter().map(|start| usize::from(u >= *start)).sum()
        }
    }

    /// Indices of many at once.
    pub fn indices(&self, us: &[f32], to: &mut [u32]) {
        if self.is_uniform() {
            for (i, u) in to.iter_mut().zip(us) {
                *i = self.index(*u) as u32;
            }
        } else {
            to[..us.len()].fill(0);
            for start in &self.starts[1..] {
                for (i, u) in to.iter_mut().zip(us) {
                    *i += u32::from(u >= start);
                }
            }
        }
    }

    /// The primary sample that chooses here what `u` chooses in `from`, at the same part of the
    /// strategy's interval: uniform in that interval if `u` was.
    pub fn carry(&self, from: &Self, u: f32) -> f32 {
        if self == from {
            return u;
        }
        let i = from.index(u);
        let (start, end) = from.interval(i);
        let part = ((u - start) / (end - start)).clamp(0.0, 1.0);
        let (start, end) = self.interval(i);
        let mut v = (end - start).mul_add(part, start);
        // Roundings may lead out of the interval, by little.
        for _ in 0..4 {
            match self.index(v.clamp(0.0, 1.0)).cmp(&i) {
                std::cmp::Ordering::Less => v = v.next_up(),
                std::cmp::Ordering::Greater => v = v.next_down(),
                std::cmp::Ordering::Equal => break,
            }
        }
        v.clamp(0.0, 1.0f32.next_down())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_is_by_equal_parts() {
        for n in 1..40u32 {
            let all: Vec<u32> = (0..n).collect();
            let choice = Choice::uniform(&all);
            assert!(choice.is_uniform());
            for s in all {
                assert_eq!(choice.factor(s), n as f32);
                assert_eq!(choice.index((s as f32 + 0.5) / n as f32), s as usize);
            }
            assert_eq!(choice.index(1.0f32.next_down()), n as usize - 1);
            assert_eq!(choice.factor(n), 0.0);
        }
    }

    #[test]
    fn intervals_are_the_probabilities_exactly() {
        let strategies = [0, 1, 5];
        let choice = Choice::weighted(&strategies, &[1.0, 1e-4, 3.0]);
        let mut counts = [0u32; 3];
        // All numbers that can be drawn.
        for i in 0..1u32 << 24 {
            counts[choice.index(i as f32 / (1 << 24) as f32)] += 1;
        }
        for (i, count) in counts.into_iter().enumerate() {
            let exact = f64::from(count) / UNITS;
            assert_eq!(f64::from(choice.probability(i)), exact);
            let factor = f64::from(choice.factor(strategies[i]));
            assert!((factor * exact - 1.0).abs() < 1e-7);
        }
        assert_eq!(choice.factor(2), 0.0);
        let mut many = [9; 3];
        choice.indices(&[0.0, 0.25, 0.99], &mut many);
        assert_eq!(many, [0, choice.index(0.25) as u32, 2]);
    }

    #[test]
    fn carried_samples_choose_the_same() {
        let strategies: Vec<u32> = (0..7).collect();
        let from = Choice::uniform(&strategies);
        let to = Choice::weighted(&strategies, &[0.3, 2e-4, 0.1, 1e-3, 0.2, 0.3, 0.1]);
        for back in [false, true] {
            let (from, to) = if back { (&to, &from) } else { (&from, &to) };
            for j in 0..100_000u32 {
                let u = j as f32 / 100_000.0;
                let v = to.carry(from, u);
                assert!((0.0..1.0).contains(&v));
                assert_eq!(from.index(u), to.index(v), "{u} {v}");
            }
            // Ends of intervals, and their neighbours.
            for i in 0..7 {
                let end = from.interval(i).1;
                for u in [
                    end.next_down().next_down(),
                    end.next_down(),
                    end,
                    end.next_up(),
                ] {
                    if u < 1.0 {
                        let v = to.carry(from, u);
                        assert!(v < 1.0);
                        assert_eq!(from.index(u), to.index(v), "{u} {v}");
                    }
                }
            }
        }
        assert_eq!(to.carry(&to.clone(), 0.123), 0.123);
    }

    #[test]
    fn one_strategy_needs_no_choice() {
        let choice = Choice::weighted(&[3], &[0.7]);
        assert!(choice.is_uniform());
        assert_eq!((choice.index(0.9), choice.factor(3)), (0, 1.0));
    }
}
