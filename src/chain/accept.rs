//! The target and the acceptance rule.

use crate::simd::{Lanes, Mask, math};
use crate::transport::Paths;

/// The scalar a chain equilibrates to: the mean of the channels. Positive wherever any channel is
/// (luminance would starve blue), and a colour over its target is at most 3 a channel, which is
/// what lets the film be fixed-point.
#[inline(always)]
pub fn target<L: Lanes>(rgb: [L; 3]) -> L {
    // Divided first: three large finite channels must not overflow.
    let third = L::splat(1.0 / 3.0);
    let mean = rgb[0] * third + rgb[1] * third + rgb[2] * third;
    // Subnormal targets have lost the digits that a ratio needs.
    mean.or_zero(mean.ge(L::splat(f32::MIN_POSITIVE)))
}

/// The target of a state of several splats: the sum of their targets, 0 if that overflows.
#[inline(always)]
pub fn total<L: Lanes>(targets: impl Iterator<Item = L>) -> L {
    let sum = targets.fold(L::zero(), |sum, target| sum + target);
    sum.or_zero(sum.is_finite())
}

/// Targets of all paths of a batch, of so many splats each.
pub fn totals(paths: &Paths, splats: usize) -> Vec<f32> {
    let of = |i: usize| (0..splats).map(move |row| target(paths.splat_row(row)[i].rgb));
    (0..paths.n).map(|i| total(of(i))).collect()
}

/// Colour over target, at most 3 a channel; 0 where there is no light.
#[inline(always)]
pub fn colour<L: Lanes>(rgb: [L; 3], target: L) -> [L; 3] {
    let lit = target.gt(L::zero());
    let [r, g, b] = rgb;
    let over = |v: L| (v / target).min(L::splat(3.0)).or_zero(lit);
    [over(r), over(g), over(b)]
}

/// Metropolis acceptance `min(1, proposed / current)` of two finite, non-negative targets. A state
/// without light accepts any that has some, and nothing accepts a proposal without.
#[inline(always)]
pub fn acceptance<L: Lanes>(current: L, proposed: L) -> L {
    let one = L::one();
    let ratio = L::select(current.gt(L::zero()), (proposed / current).min(one), one);
    ratio.or_zero(proposed.gt(L::zero()).and(proposed.is_finite()))
}

/// The same where proposals are not as probable as their reversals: `min(1, proposed / current
/// exp(log_ratio))`, with the natural logarithm of the density of the way back over that of the way
/// there (Hastings 1970). A proposal from which there is no way back (`-inf`, or not a number) is
/// rejected.
#[inline(always)]
pub fn biased_acceptance<L: Lanes>(current: L, proposed: L, log_ratio: L) -> L {
    let one = L::one();
    let ratio = (proposed / current) * math::exp(log_ratio.min(L::splat(80.0)));
    let ratio = L::select(current.gt(L::zero()), ratio.min(one), one);
    let possible = log_ratio.gt(L::splat(f32::NEG_INFINITY));
    ratio.or_zero(
        possible
            .and(proposed.gt(L::zero()))
            .and(proposed.is_finite()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acceptance_over_the_whole_table() {
        let (tiny, huge) = (f32::MIN_POSITIVE, f32::MAX);
        let bad: [f32; 4] = [f32::INFINITY, f32::NAN, -1.0, f32::NEG_INFINITY];
        for current in [0.0, tiny, 1.0, huge] {
            assert_eq!(acceptance(current, 0.0), 0.0);
            for proposed in bad {
                assert_eq!(acceptance(current, proposed), 0.0, "{current} {proposed}");
            }
            for proposed in [tiny, 1.0, huge] {
                let a = acceptance(current, proposed);
                assert!((0.0..=1.0).contains(&a), "{current} {proposed} {a}");
                if current <= proposed {
                    assert_eq!(a, 1.0);
                }
            }
        }
        // A current state that is not a number cannot arise, and would not trap a chain.
        assert_eq!(acceptance(f32::NAN, 1.0f32), 1.0);
        assert_eq!(acceptance(4.0f32, 1.0), 0.25);
    }

    #[test]
    fn targets_are_positive_where_any_channel_is() {
        assert!(target([0.0f32, 0.0, 1e-20]) > 0.0);
        assert!(target([f32::MAX; 3]).is_finite());
        let rgb = [0.0f32, 0.0, 7.0];
        assert!((colour(rgb, target(rgb))[2] - 3.0).abs() < 1e-6);
    }
}
