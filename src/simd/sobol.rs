//! Two-dimensional points that are spread evenly: Sobol's (0, 2)-sequence, scrambled as by Owen.
//!
//! The first `2^m` points of the sequence, and every further `2^m` of them, have one point in each
//! of the `2^m` boxes of equal size that halving the sides of the unit square leads to, however
//! long and narrow (Sobol 1967). Owen's scrambling (1995) keeps that and makes each point uniform;
//! two sequences with other seeds are independent. Both are made by hashing, as in Burley 2020,
//! "Practical Hash-based Owen Scrambling": points can be had in any order. More dimensions are
//! pairs of their own, each over an order of its own (the same, section 4): the pairs are
//! independent of each other.

use super::rng::unit_float;
use super::{Lanes, UintLanes};

/// The point of the sequence that three seeds choose (one for the order, one for each side) whose
/// index has these bits, in reversed order: many pairs of dimensions share an index.
#[inline(always)]
pub fn point_of_reversed<L: Lanes>(reversed: L::Uint, [order, x, y]: [L::Uint; 3]) -> [L; 2] {
    // The radical inverse of the shuffled index is the first coordinate. All is done on reversed
    // bits, as the scrambling wants them.
    let index = reverse::<L>(scramble::<L>(reversed, order));
    let sides = [
        scramble::<L>(index, x),
        scramble::<L>(second::<L>(index), y),
    ];
    sides.map(|bits| unit_float::<L>(reverse::<L>(bits)))
}

/// The word with its bits in the other order.
#[inline(always)]
fn reverse<L: Lanes>(x: L::Uint) -> L::Uint {
    let x = x.shr::<16>().or(x.shl::<16>());
    let x = swap::<L, 8>(x, 0x00ff_00ff);
    let x = swap::<L, 4>(x, 0x0f0f_0f0f);
    let x = swap::<L, 2>(x, 0x3333_3333);
    swap::<L, 1>(x, 0x5555_5555)
}

/// Swaps neighbouring groups of so many bits; `low` are the lower ones.
#[inline(always)]
fn swap<L: Lanes, const BITS: i32>(x: L::Uint, low: u32) -> L::Uint {
    let low = L::Uint::splat(low);
    x.shr::<BITS>().and(low).or(x.and(low).shl::<BITS>())
}

/// Flips each bit by a hash of the lower ones: Owen's scrambling of reversed bits (Laine and Karras
/// 2011, with the constants of Vegdahl 2021).
#[inline(always)]
fn scramble<L: Lanes>(x: L::Uint, seed: L::Uint) -> L::Uint {
    let times = |x: L::Uint, factor: u32| x.mul(L::Uint::splat(factor));
    let x = x.xor(times(x, 0x3d20_adea));
    let x = x.add(seed);
    let x = x.mul(seed.shr::<16>().or(L::Uint::splat(1)));
    let x = x.xor(times(x, 0x0552_6c56));
    x.xor(times(x, 0x53a2_2864))
}

/// The second coordinate of an index, with its bits reversed. Its generator matrix is Pascal's
/// triangle modulo 2, which is a product of five sparse ones.
#[inline(always)]
fn second<L: Lanes>(index: L::Uint) -> L::Uint {
    let x = index;
    let x = x.xor(x.and(L::Uint::splat(0xaaaa_aaaa)).shr::<1>());
    let x = x.xor(x.and(L::Uint::splat(0xcccc_cccc)).shr::<2>());
    let x = x.xor(x.and(L::Uint::splat(0xf0f0_f0f0)).shr::<4>());
    let x = x.xor(x.and(L::Uint::splat(0xff00_ff00)).shr::<8>());
    x.xor(x.shr::<16>())
}

#[cfg(test)]
mod tests {
    use super::super::f32x8;
    use super::super::rng::{Purpose, Stream};
    use super::*;

    #[test]
    fn bits_are_those_of_the_definition() {
        for i in 0..5000u32 {
            let i = i.wrapping_mul(0x9e37_79b9);
            assert_eq!(reverse::<f32>(i), i.reverse_bits());
            // Sobol's second dimension: each direction number is the one before, and that shifted.
            let (mut sum, mut direction) = (0, 1u32 << 31);
            for bit in 0..32 {
                if i >> bit & 1 == 1 {
                    sum ^= direction;
                }
                direction ^= direction >> 1;
            }
            assert_eq!(second::<f32>(i).reverse_bits(), sum);
        }
    }

    fn point<L: Lanes>(index: L::Uint, seeds: [L::Uint; 3]) -> [L; 2] {
        point_of_reversed::<L>(reverse::<L>(index), seeds)
    }

    fn seeds(i: u32) -> [u32; 3] {
        let [a, b, c, _] = Stream::new(7, Purpose::PathTracer).words::<f32>(i, 0, 0);
        [a, b, c]
    }

    /// One point in each box of every shape, of every run of a power of two.
    #[test]
    fn boxes_hold_one_point_each() {
        for (m, first) in [(0, 5), (3, 0), (4, 48), (6, 64), (8, 1 << 20)] {
            let n = 1u32 << m;
            let points: Vec<[f32; 2]> = (first..first + n)
                .map(|i| point::<f32>(i, seeds(m)))
                .collect();
            for columns in (0..=m).map(|j| 1u32 << j) {
                let rows = n / columns;
                let mut held = vec![0; n as usize];
                for [x, y] in &points {
                    let at = |v: f32, n: u32| (v * n as f32) as usize;
                    held[at(*y, rows) * columns as usize + at(*x, columns)] += 1;
                }
                assert!(
                    held.iter().all(|n| *n == 1),
                    "2^{m} from {first}, {columns}"
                );
            }
        }
    }

    /// Each point alone is uniform over the square, and two of other seeds are independent.
    #[test]
    fn a_point_can_be_anywhere() {
        const SIDE: usize = 8;
        const N: u32 = 1 << 16;
        let cell = |v: f32| (v * SIDE as f32) as usize;
        for (i, j) in [(0, 0), (1, 1), (3, 700)] {
            let mut square = [0u32; SIDE * SIDE];
            let mut pairs = [0u32; SIDE * SIDE];
            for k in 0..N {
                let [x, y] = point::<f32>(i, seeds(k));
                let [z, _] = point::<f32>(j, seeds(k + N));
                square[cell(x) * SIDE + cell(y)] += 1;
                pairs[cell(x) * SIDE + cell(z)] += 1;
            }
            for counts in [square, pairs] {
                let expected = f64::from(N) / counts.len() as f64;
                let chi = counts.map(|n| (f64::from(n) - expected).powi(2) / expected);
                // 63 degrees of freedom: above 140 once in ten million times.
                let chi: f64 = chi.iter().sum();
                assert!(chi < 140.0, "{chi}");
            }
        }
    }

    #[test]
    fn lanes_have_the_same_points() {
        let words = |k: u32| <f32x8 as Lanes>::Uint::from_fn(|i| seeds(i as u32 * 3 + k)[0]);
        let index = <f32x8 as Lanes>::Uint::from_fn(|i| 1000 + i as u32);
        let wide = point::<f32x8>(index, [words(0), words(1), words(2)]);
        for i in 0..8 {
            let of = |k: u32| seeds(i as u32 * 3 + k)[0];
            let one = point::<f32>(1000 + i as u32, [of(0), of(1), of(2)]);
            assert_eq!(one, wide.map(|v| v.lane(i)));
        }
    }
}
