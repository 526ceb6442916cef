//! Exact sums of numbers of any size.
//!
//! A number is written in digits of base 2^30, each rounded to nearest and so between -2^29 and
//! 2^29, and digits of the same place are added as integers. A [`Sum`] keeps two places: that of
//! the largest number so far, and the one below; what a larger number pushes out at the
//! bottom is forgotten. The digits of a number depend on it alone, and which places remain on the
//! largest: the same numbers give the same bits in any order, however they are grouped.
//!
//! What is forgotten of a number is at most 2^-30 of the largest. A sample so much brighter than
//! the others leaves far more noise than that, unless there are billions of them. Tried, and left:
//! 128 bits with one binary point for all pixels lose what is small or large; sums of all
//! digits that `f32` has need 40 bytes, not 17.

use crate::checkpoint::{Malformed, Reader, Writer};

/// Bits of a digit.
const BITS: i32 = 30;
/// One over the unit of the second digit, in units of the first.
const BASE: f64 = (1u64 << BITS) as f64;
/// Place 1 is that of 2^(30 (1 - BIAS)).
const BIAS: i32 = 7;
/// The highest place: far beyond the largest `f32` times the weight of any filter.
const HIGHEST: i32 = 12;

/// Units of places, and one over them. There is no place 0.
const UNITS: [[f64; 2]; HIGHEST as usize + 1] = {
    let mut units = [[0.0; 2]; HIGHEST as usize + 1];
    let mut place = 1;
    while place <= HIGHEST {
        let exponent = BITS * (place - BIAS);
        units[place as usize] = [power(exponent), power(-exponent)];
        place += 1;
    }
    units
};

/// 2 to a power that `f64` has.
const fn power(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// The place of the first digit of a number: that whose unit is less than 2 to 2^30 times smaller.
#[inline(always)]
fn place(value: f64) -> u8 {
    let exponent = (value.to_bits() >> 52 & 0x7ff) as i32 - 1023;
    // Not a negative number, which would be divided the other way.
    ((exponent + 1 + BITS * (BIAS + 40)) / BITS - 40).clamp(1, HIGHEST) as u8
}

/// A sum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum {
    pub digits: [i64; 2],
    /// Of the first digit; 0 while there is none.
    pub place: u8,
}

impl Sum {
    /// Adds a finite number. Returns true if the sum is full and stays at its limit: after 2^34
    /// numbers at the earliest.
    #[inline(always)]
    pub fn add(&mut self, value: f64) -> bool {
        if value == 0.0 {
            return false;
        }
        self.raise(place(value));
        let scaled = value * UNITS[self.place as usize][1];
        let first = scaled.round_ties_even();
        let second = ((scaled - first) * BASE).round_ties_even();
        self.add_digits([first as i64, second as i64])
    }

    /// Adds another sum.
    pub fn merge(&mut self, mut other: Sum) -> bool {
        if other.place == 0 {
            return false;
        }
        self.raise(other.place);
        other.raise(self.place);
        self.add_digits(other.digits)
    }

    #[inline(always)]
    fn raise(&mut self, place: u8) {
        if place > self.place {
            self.digits = match place - self.place {
                1 => [0, self.digits[0]],
                _ => [0, 0],
            };
            self.place = place;
        }
    }

    #[inline(always)]
    fn add_digits(&mut self, digits: [i64; 2]) -> bool {
        let mut full = false;
        for (sum, digit) in self.digits.iter_mut().zip(digits) {
            let (next, over) = sum.overflowing_add(digit);
            *sum = if over {
                sum.saturating_add(digit)
            } else {
                next
            };
            full |= over;
        }
        full
    }

    pub fn value(&self) -> f64 {
        let [first, second] = self.digits.map(|d| d as f64);
        (first + second / BASE) * UNITS[self.place as usize][0]
    }
}

/// Sums in 17 bytes each.
pub(super) struct Sums {
    digits: Vec<[i64; 2]>,
    places: Vec<u8>,
}

impl Sums {
    /// Bytes of a sum.
    pub const BYTES: u64 = 17;

    /// How many.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    pub fn new(count: usize) -> Self {
        Self {
            digits: vec![[0; 2]; count],
            places: vec![0; count],
        }
    }

    /// Writes all of them.
    pub fn save(&self, to: &mut Writer) {
        let Self { digits, places } = self;
        to.table(digits);
        to.table(places);
    }

    /// Reads as many as there are.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        let Self { digits, places } = self;
        from.table(digits)?;
        from.table(places)?;
        let right = places.iter().all(|place| i32::from(*place) <= HIGHEST);
        Malformed::unless(right, "a sum is too large")
    }

    /// Nothing has been added.
    pub fn is_empty(&self) -> bool {
        self.places.iter().all(|place| *place == 0)
    }

    /// Begins anew from zero.
    pub fn clear(&mut self) {
        self.digits.fill([0; 2]);
        self.places.fill(0);
    }

    /// Adds as many others; how many are full.
    pub fn absorb(&mut self, other: &Self) -> u64 {
        let mut full = 0;
        for i in 0..self.places.len() {
            let mut sum = self.get(i);
            full += u64::from(sum.merge(other.get(i)));
            self.set(i, sum);
        }
        full
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Sum {
        Sum {
            digits: self.digits[i],
            place: self.places[i],
        }
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, sum: Sum) {
        self.digits[i] = sum.digits;
        self.places[i] = sum.place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(values: &[f64]) -> Sum {
        let mut sum = Sum::default();
        values.iter().for_each(|v| assert!(!sum.add(*v)));
        sum
    }

    #[test]
    fn every_f32_is_kept() {
        for exponent in -149..=127 {
            for digits in [1.0f64, 1.5, 1.999_999_880_790_71] {
                let value = f64::from((digits * 2f64.powi(exponent)) as f32);
                for value in [value, -value] {
                    assert_eq!(sum(&[value]).value(), value, "{value:e}");
                    let thousand = sum(&vec![value; 1000]);
                    assert_eq!(thousand.value(), 1000.0 * value, "{value:e}");
                }
            }
        }
        assert_eq!(sum(&[]).value(), 0.0);
        assert!(sum(&[0.0, -0.0]).value().is_sign_positive());
    }

    #[test]
    fn full_sums_stay_at_their_limit() {
        let mut full = Sum {
            digits: [i64::MAX - 5, 0],
            place: BIAS as u8,
        };
        assert!(!full.add(5.0));
        assert!(full.add(1.0) && full.add(7.0));
        assert_eq!(full.value(), i64::MAX as f64);
    }

    proptest! {
        #![proptest_config(crate::property::cases(300))]

        /// Any order and any grouping gives the same bits, and nearly the sum.
        #[test]
        fn order_does_not_matter(
            (values, shuffled) in prop::collection::vec(
                (-1f64..1.0, -149i32..128).prop_map(|(v, e)| v * 2f64.powi(e)), 1..100,
            ).prop_flat_map(|v| (Just(v.clone()), Just(v).prop_shuffle())),
            cut in 0..100usize,
        ) {
            let all = sum(&values);
            prop_assert_eq!(all, sum(&shuffled));
            let (a, b) = shuffled.split_at(cut.min(shuffled.len()));
            let (mut left, right) = (sum(a), sum(b));
            left.merge(right);
            prop_assert_eq!(all, left);
            let exact: f64 = values.iter().sum();
            let largest = values.iter().fold(0f64, |most, v| most.max(v.abs()));
            let bound = values.len() as f64 * largest * 2f64.powi(1 - BITS);
            prop_assert!((all.value() - exact).abs() <= bound);
        }
    }
}
