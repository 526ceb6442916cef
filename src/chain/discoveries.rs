//! Independent samples that have met lights as only chance can ([`crate::plan::Chance`]), counted
//! by how much they bring.
//!
//! Counts are integers, so that it does not matter in which order threads add theirs up.

use crate::checkpoint::{Malformed, Reader, Writer};
use crate::plan::chance::LAMPS;
use crate::transport::Splat;

/// Two to a factor of 2.
const BINS: usize = 128;
/// The first bin holds what is below 2^-32.
const FIRST: u32 = (127 - 32) << 1;

/// By lamp, as far as any has been met; bins of amounts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Discoveries {
    counts: Vec<u64>,
}

/// What has been found of one lamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Independent samples.
    pub count: u64,
    /// How many of equal amounts would say as much of their mean: the square of the sum over the
    /// sum of squares.
    pub effective: f64,
    /// Of what they bring, to within a quarter.
    pub sum: f64,
}

impl Discoveries {
    /// None yet, with room for those of all lamps: the first one may come at any time.
    pub fn roomy() -> Self {
        Self {
            counts: Vec::with_capacity(LAMPS * BINS),
        }
    }

    /// Counts a sample, if it is such a one; `amount` is what it brings.
    #[inline(always)]
    pub fn see(&mut self, splat: &Splat, amount: f32) {
        if splat.chance != 0 {
            self.add(splat.chance as usize - 1, amount);
        }
    }

    #[cold]
    fn add(&mut self, lamp: usize, amount: f32) {
        let end = (lamp + 1) * BINS;
        if self.counts.len() < end {
            self.counts.resize(end, 0);
        }
        // Exponent and first bit of the mantissa.
        let bin = (amount.max(0.0).to_bits() >> 22).saturating_sub(FIRST);
        self.counts[lamp * BINS + (bin as usize).min(BINS - 1)] += 1;
    }

    /// Adds what others have found.
    pub fn merge(&mut self, other: &Self) {
        if self.counts.len() < other.counts.len() {
            self.counts.resize(other.counts.len(), 0);
        }
        for (to, from) in self.counts.iter_mut().zip(&other.counts) {
            *to = to.saturating_add(*from);
        }
    }

    /// What has been found of a lamp.
    pub fn of(&self, lamp: usize) -> Found {
        let mut found = Found::default();
        let mut squares = 0.0;
        let bins = self.counts.chunks_exact(BINS).nth(lamp).unwrap_or(&[]);
        for (bin, count) in bins.iter().enumerate().filter(|(_, count)| **count > 0) {
            let bits = (bin as u32 + FIRST) << 22;
            // The middle of the bin.
            let amount = f64::from(f32::from_bits(bits | 1 << 21));
            let n = *count as f64;
            found.count = found.count.saturating_add(*count);
            found.sum += n * amount;
            squares += n * amount * amount;
        }
        if squares > 0.0 {
            found.effective = found.sum * found.sum / squares;
        }
        found
    }

    /// Writes them.
    pub fn save(&self, to: &mut Writer) {
        to.count(self.counts.len() / BINS);
        to.table(&self.counts);
    }

    /// Reads them.
    ///
    /// # Errors
    /// There are more lamps than can be.
    pub fn load(from: &mut Reader) -> Result<Self, Malformed> {
        let lamps = from.count(LAMPS)?;
        let counts = from.vector(lamps * BINS)?;
        Ok(Self { counts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(lamp: u32, amounts: impl IntoIterator<Item = f32>) -> Discoveries {
        let mut all = Discoveries::default();
        for amount in amounts {
            let splat = Splat {
                chance: lamp + 1,
                ..Splat::default()
            };
            all.see(&splat, amount);
        }
        all
    }

    #[test]
    fn amounts_are_told_to_a_quarter_and_equal_ones_count_fully() {
        let mut all = seen(1, std::iter::repeat_n(3.0, 20));
        assert_eq!(all.of(0), Found::default());
        let found = all.of(1);
        assert_eq!(found.count, 20);
        assert!((found.effective - 20.0).abs() < 1e-9);
        assert!((found.sum / 60.0 - 1.0).abs() < 0.25, "{}", found.sum);
        // One that brings a thousand times as much is worth one.
        all.merge(&seen(1, [3000.0]));
        let found = all.of(1);
        assert_eq!(found.count, 21);
        assert!(found.effective < 1.1, "{}", found.effective);
    }

    #[test]
    fn what_is_off_the_scale_is_counted() {
        let found = seen(0, [0.0, 1e-30, 1e30, f32::MAX]).of(0);
        assert_eq!(found.count, 4);
        assert!(found.sum.is_finite());
    }
}
