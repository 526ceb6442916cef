//! Choosing a light in proportion to its power, in constant time, by inversion: neighbouring
//! primary samples keep choosing the same light, which an alias table would not.
//!
//! Primary samples are drawn on a grid of `2^24` cells, and small steps move them off it only
//! within a cell. The lights' intervals therefore end on that grid: the probability of a light is
//! the number of its cells, exactly, and fits `f32`. A guide table says for each of as many
//! equal parts of `[0, 1)` as there are lights, or up to twice as many, which lights it touches
//! (Chen and Asau 1974, "On Generating Random Variates from an Empirical Distribution"): fewer than
//! three on average, however uneven the powers.

/// Cells of a primary sample's grid; more lights than this cannot all be chosen.
pub const CELLS: u32 = 1 << 24;

/// A discrete distribution over lights.
pub struct LightChoice {
    /// Upper ends of the lights' intervals in cells, strictly ascending; the last is `CELLS`.
    ends: Vec<u32>,
    /// The light that holds the first cell of each part, and the last light.
    guide: Vec<u32>,
    /// A part has `2^shift` cells.
    shift: u32,
}

/// A light whose power is estimated at zero is still chosen this often relative to a uniform
/// choice: the estimate averages over the picture, and a zero here would lose light.
const FLOOR: f64 = 1e-3;

impl LightChoice {
    /// Up to `CELLS` lights; those beyond are never chosen.
    pub fn new(powers: &[f64]) -> Self {
        let powers = &powers[..powers.len().min(CELLS as usize)];
        let n = powers.len();
        let finite = |p: &f64| if p.is_finite() { p.max(0.0) } else { 0.0 };
        let total: f64 = powers.iter().map(finite).sum();
        let weight = |p: &f64| {
            if total > 0.0 {
                finite(p) / total + FLOOR / n as f64
            } else {
                1.0
            }
        };
        let sum: f64 = powers.iter().map(weight).sum();
        // A cell is at or beyond an end exactly if it is at or beyond the next whole one.
        let ends = |cells: f64, least: u32| {
            let mut ends = Vec::with_capacity(n);
            let mut running: f64 = 0.0;
            for (i, p) in powers.iter().enumerate() {
                running += weight(p) / sum;
                let own = (f64::from(running as f32) * cells).ceil().min(cells) as u32;
                ends.push(own + least * (i as u32 + 1));
            }
            if let Some(last) = ends.last_mut() {
                *last = CELLS;
            }
            ends
        };
        let mut table = ends(CELLS.into(), 0);
        let width = |i: usize, table: &[u32]| table[i] - if i == 0 { 0 } else { table[i - 1] };
        // Lights too weak for a cell get one: it is set aside for each, and the rest is shared by
        // power.
        if (0..n).any(|i| width(i, &table) == 0) {
            table = ends(f64::from(CELLS - n as u32), 1);
        }
        let parts = (n.max(1)).next_power_of_two().min(CELLS as usize);
        let shift = CELLS.trailing_zeros() - parts.trailing_zeros();
        let mut guide = Vec::with_capacity(parts + 1);
        let mut light = 0;
        for part in 0..parts as u32 {
            while light + 1 < n && table[light] <= part << shift {
                light += 1;
            }
            guide.push(light as u32);
        }
        guide.push(n.saturating_sub(1) as u32);
        Self {
            ends: table,
            guide,
            shift,
        }
    }

    /// How many of all primary samples choose the light; 0 for a light beyond `CELLS`.
    pub fn probability(&self, light: usize) -> f32 {
        let end = |i: usize| self.ends.get(i).copied().unwrap_or(CELLS);
        let start = light.checked_sub(1).map_or(0, end);
        (end(light) - start) as f32 / CELLS as f32
    }

    /// The light whose interval holds `u` in `[0, 1)`.
    #[inline(always)]
    pub fn sample(&self, u: f32) -> u32 {
        let cell = ((u * CELLS as f32) as u32).min(CELLS - 1);
        let part = (cell >> self.shift) as usize;
        let (first, last) = (self.guide[part], self.guide[part + 1]);
        let touched = &self.ends[first as usize..last as usize];
        first + touched.partition_point(|end| *end <= cell) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every sample of the grid, counted.
    fn sweep(powers: &[f64]) -> LightChoice {
        let choice = LightChoice::new(powers);
        let mut count = vec![0u32; powers.len()];
        let mut before = 0;
        for i in 0..CELLS {
            let light = choice.sample(i as f32 / CELLS as f32);
            assert!(light >= before, "neighbours stay neighbours");
            before = light;
            count[light as usize] += 1;
        }
        for (i, c) in count.iter().enumerate() {
            assert_eq!(*c as f32 / CELLS as f32, choice.probability(i), "{i}");
            assert!(*c > 0, "{i} is never chosen");
        }
        choice
    }

    #[test]
    fn intervals_are_the_probabilities() {
        let choice = sweep(&[1.0, 0.0, 3.0, f64::NAN]);
        assert!(choice.probability(2) > 0.7);
        for powers in [
            &[2.0][..],
            &[0.0; 5],
            &[f64::MAX; 3],
            &[1e-300, 1e300, f64::INFINITY, -1.0],
        ] {
            sweep(powers);
        }
        assert_eq!(LightChoice::new(&[7.0]).probability(0), 1.0);
    }

    #[test]
    fn a_hundred_thousand_lights_of_wildly_different_power() {
        let n = 100_000;
        // Over 24 orders of magnitude, scattered; some without power.
        let power = |i: usize| {
            let hash = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            if hash.is_multiple_of(7) {
                0.0
            } else {
                10f64.powf(hash as f64 / f64::from(CELLS) * 24.0 - 12.0)
            }
        };
        let powers: Vec<f64> = (0..n).map(power).collect();
        let choice = sweep(&powers);
        // A cell for each light takes their number from the rest, which is shared by power.
        let total: f64 = powers.iter().sum();
        let cell = 1.0 / f64::from(CELLS);
        let rest = 1.0 - n as f64 * cell;
        for (i, p) in powers.iter().enumerate() {
            let share = (p / total + FLOOR / n as f64) / (1.0 + FLOOR);
            let wish = cell + rest * share;
            let got = f64::from(choice.probability(i));
            // Both ends rounded to a float, and up to a cell.
            assert!((got - wish).abs() < 2.5 * cell, "{i}: {got} {wish}");
        }
    }

    /// As a search in the cumulative sums chooses.
    #[test]
    fn few_lights_are_chosen_by_their_cumulative_power() {
        for n in [2usize, 3, 10, 100] {
            let powers: Vec<f64> = (0..n).map(|i| 1.0 + (i * i % 17) as f64).collect();
            let total: f64 = powers.iter().sum();
            let weight = |p: &f64| p / total + FLOOR / n as f64;
            let sum: f64 = powers.iter().map(weight).sum();
            let mut running: f64 = 0.0;
            let mut ends: Vec<f32> = (powers.iter())
                .map(|p| {
                    running += weight(p) / sum;
                    running as f32
                })
                .collect();
            ends[n - 1] = 1.0;
            let choice = LightChoice::new(&powers);
            for i in 0..CELLS {
                let u = i as f32 / CELLS as f32;
                let searched = ends.partition_point(|end| *end <= u);
                assert_eq!(choice.sample(u) as usize, searched, "{n} lights, {u}");
            }
        }
    }
}
