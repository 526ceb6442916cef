//! The target and the acceptance rule.

use crate::transport::Outcome;

/// The scalar a chain equilibrates to: the mean of the channels. Positive wherever any channel is (luminance would starve blue), and a
/// colour over its target is at most 3 a channel, which is what lets the film be fixed-point.
#[inline(always)]
pub fn target(rgb: [f32; 3]) -> f32 {
    // Divided first: three large finite channels must not overflow.
    let third = 1.0 / 3.0;
    let mean = rgb[0] * third + rgb[1] * third + rgb[2] * third;
    // Subnormal targets have lost the digits that a ratio needs.
    if mean >= f32::MIN_POSITIVE { mean } else { 0.0 }
}

/// Metropolis acceptance `min(1, proposed / current)` of two finite, non-negative targets. A state without light accepts any that has some,
/// and nothing accepts a proposal without.
#[inline(always)]
pub fn acceptance(current: f32, proposed: f32) -> f32 {
    if !(proposed > 0.0 && proposed.is_finite()) {
        0.0
    } else if current > 0.0 {
        (proposed / current).min(1.0)
    } else {
        1.0
    }
}

/// A chain's state as the film sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    pub target: f32,
    /// Colour over target, at most 3 a channel.
    pub colour: [f32; 3],
    pub raster: [f32; 2],
}

impl State {
    pub fn new(outcome: &Outcome) -> Self {
        let target = target(outcome.rgb);
        let colour = if target > 0.0 {
            outcome.rgb.map(|v| (v / target).min(3.0))
        } else {
            [0.0; 3]
        };
        Self {
            target,
            colour,
            raster: outcome.raster,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acceptance_over_the_whole_table() {
        let (tiny, huge) = (f32::MIN_POSITIVE, f32::MAX);
        let bad = [f32::INFINITY, f32::NAN, -1.0, f32::NEG_INFINITY];
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
        assert_eq!(acceptance(f32::NAN, 1.0), 1.0);
        assert_eq!(acceptance(4.0, 1.0), 0.25);
    }

    #[test]
    fn targets_are_positive_where_any_channel_is() {
        assert!(target([0.0, 0.0, 1e-20]) > 0.0);
        assert!(target([f32::MAX; 3]).is_finite());
        let state = State::new(&Outcome {
            rgb: [0.0, 0.0, 7.0],
            raster: [0.0; 2],
            s: 0,
            rejected: false,
        });
        assert!((state.colour[2] - 3.0).abs() < 1e-6);
    }
}
