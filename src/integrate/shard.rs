//! A part of a render: some of its chains, and some of its samples.

use std::ops::Range;

/// One of the parts that a render falls into. Each makes the whole bootstrap, which comes to the
/// same everywhere, and then its own part of chains and samples; [`merge`](super::merge) adds them
/// up to the bits of one render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 0 on.
    pub index: u32,
    /// How many there are.
    pub of: u32,
}

impl Shard {
    /// Most parts of a render.
    pub const MOST: u32 = 1 << 16;

    /// Whether there is such a part.
    pub(super) fn exists(self) -> bool {
        self.of <= Self::MOST && self.index < self.of
    }

    /// Its share of `count` things that stay together in groups of `grain`.
    pub(super) fn share(self, count: u64, grain: u64) -> Range<u64> {
        let groups = count.div_ceil(grain);
        let border = |i: u32| {
            let group = u128::from(groups) * u128::from(i) / u128::from(self.of.max(1));
            (group as u64).saturating_mul(grain).min(count)
        };
        border(self.index)..border(self.index + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_all_there_is() {
        for (count, grain, of) in [(0, 16, 3), (100, 16, 3), (1000, 1, 7), (u64::MAX, 1, 5)] {
            let mut end = 0;
            for index in 0..of {
                let share = Shard { index, of }.share(count, grain);
                assert_eq!(share.start, end);
                assert!(share.start.is_multiple_of(grain) || share.start == count);
                end = share.end;
            }
            assert_eq!(end, count);
        }
    }
}
