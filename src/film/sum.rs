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

/// Numbers below which fit under the unit of each place: [`place`] of them is no higher. None does
/// where there is no place yet.
const BELOW: [f64; HIGHEST as usize + 1] = {
    let mut below = [0.0; HIGHEST as usize + 1];
    let mut place = 1;
    while place <= HIGHEST {
        below[place as usize] = power(BITS * (place - BIAS + 1) - 1);
        place += 1;
    }
    below
};

/// Added to a number of less than 51 bits, it leaves the nearest integer in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Sums in 17 bytes each, in groups of the same width that are added to together.
pub(super) struct Sums {
    /// `[group][digit][entry]`
    digits: Vec<i64>,
    /// `[group][entry]`
    places: Vec<u8>,
    /// Entries of a group.
    width: usize,
}

impl Sums {
    /// Bytes of a sum.
    pub const BYTES: u64 = 17;

    /// So many groups.
    pub fn new(groups: usize, width: usize) -> Self {
        Self {
            digits: vec![0; 2 * groups * width],
            places: vec![0; groups * width],
            width,
        }
    }

    /// Writes all of them.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            digits,
            places,
            width: _,
        } = self;
        to.table(digits);
        to.table(places);
    }

    /// Reads as many as there are.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        let Self {
            digits,
            places,
            width: _,
        } = self;
        from.table(digits)?;
        from.table(places)?;
        let right = places.iter().all(|place| i32::from(*place) <= HIGHEST);
        Malformed::unless(right, "a sum is too large")
    }

    /// Adds as many others of the same width; how many are full.
    pub fn absorb(&mut self, other: &Self) -> u64 {
        let mut full = 0;
        for i in 0..self.places.len() {
            let (group, entry) = (i / self.width, i % self.width);
            let mut sum = self.get(group, entry);
            full += u64::from(sum.merge(other.get(group, entry)));
            self.set(group, entry, sum);
        }
        full
    }

    /// Adds finite numbers to the entries of a group, as [`Sum::add`] does; how many of them are
    /// full. `N` is the width.
    ///
    /// Nearly always no number is larger than all before it, and no sum is full: that case has no
    /// branches, for all entries at once.
    #[inline(always)]
    pub fn add<const N: usize>(&mut self, group: usize, values: [f64; N]) -> u64 {
        debug_assert_eq!(N, self.width);
        let places = &self.places[group * N..][..N];
        let digits = &mut self.digits[2 * group * N..][..2 * N];
        let (mut next, mut usual) = ([[0; N]; 2], true);
        for i in 0..N {
            let place = usize::from(places[i]) % UNITS.len();
            usual &= values[i].abs() < BELOW[place];
            let scaled = values[i] * UNITS[place][1];
            let first = scaled + ROUND;
            let second = (scaled - (first - ROUND)) * BASE + ROUND;
            for (digit, next) in [first, second].into_iter().zip(&mut next) {
                next[i] = (digit.to_bits() as i64).wrapping_sub(ROUND.to_bits() as i64);
            }
        }
        for (sum, digit) in digits.iter().zip(next.as_flattened_mut()) {
            let (more, over) = sum.overflowing_add(*digit);
            *digit = more;
            usual &= !over;
        }
        if !usual {
            return self.add_each(group, values);
        }
        digits.copy_from_slice(next.as_flattened());
        0
    }

    #[cold]
    #[inline(never)]
    fn add_each<const N: usize>(&mut self, group: usize, values: [f64; N]) -> u64 {
        let mut full = 0;
        for (entry, value) in values.into_iter().enumerate() {
            let mut sum = self.get(group, entry);
            full += u64::from(sum.add(value));
            self.set(group, entry, sum);
        }
        full
    }

    pub fn get(&self, group: usize, entry: usize) -> Sum {
        let first = 2 * group * self.width + entry;
        Sum {
            digits: [self.digits[first], self.digits[first + self.width]],
            place: self.places[group * self.width + entry],
        }
    }

    pub fn set(&mut self, group: usize, entry: usize, sum: Sum) {
        let first = 2 * group * self.width + entry;
        self.digits[first] = sum.digits[0];
        self.digits[first + self.width] = sum.digits[1];
        self.places[group * self.width + entry] = sum.place;
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

    #[test]
    fn groups_are_full_as_sums_are() {
        let mut sums = Sums::new(1, 3);
        let nearly = Sum {
            digits: [i64::MAX - 5, 0],
            place: BIAS as u8,
        };
        sums.set(0, 1, nearly);
        assert_eq!(sums.add(0, [5.0; 3]), 0);
        assert_eq!(sums.add(0, [1.0; 3]) + sums.add(0, [7.0; 3]), 2);
        assert_eq!(sums.get(0, 1).value(), i64::MAX as f64);
        assert_eq!([sums.get(0, 0).value(), sums.get(0, 2).value()], [13.0; 2]);
    }

    proptest! {
        #![proptest_config(crate::property::cases(300))]

        /// Groups are sums, whatever comes to their entries and in whatever order.
        #[test]
        fn groups_are_sums(
            values in prop::collection::vec(
                prop::array::uniform3(
                    (-1f64..1.0, -149i32..128, 0..4).prop_map(|(v, e, zero)| {
                        if zero == 0 { 0.0 } else { v * 2f64.powi(e) }
                    }),
                ),
                1..100,
            ),
        ) {
            let mut sums = Sums::new(2, 3);
            let mut alone = [Sum::default(); 3];
            for values in values {
                prop_assert_eq!(sums.add(1, values), 0);
                for (sum, value) in alone.iter_mut().zip(values) {
                    sum.add(value);
                }
                let group: [Sum; 3] = std::array::from_fn(|entry| sums.get(1, entry));
                prop_assert_eq!(group, alone);
            }
            prop_assert_eq!(sums.get(0, 2), Sum::default());
        }

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
