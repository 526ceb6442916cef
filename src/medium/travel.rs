//! Rays on their way through media.

use super::passed::Passed;
use crate::scene::Rgb;

/// A piece of a ray: `origin + t direction` for `t` in a range.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// Where it goes, of any length but 0.
    pub direction: [f32; 3],
    /// Where the piece starts and ends, in units of the direction's length. The end may be
    /// infinite.
    pub range: [f32; 2],
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub struct Travel {
    /// What it has passed so far.
    pub passed: Passed,
    /// It is scattered where the logarithm of its mean transmittance falls to this: `ln(1 - u)` of
    /// a primary sample `u`. Negative infinity if it is not scattered.
    pub least: f32,
    /// What it has been lit with on its way by media, over the probability that it came to there;
    /// `None` if nobody asks.
    pub glow: Option<Rgb>,
}

/// Where a ray is scattered in a medium.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// How far along it, in units of its direction's length.
    pub t: f32,
    /// Scattering times transmittance over the density of the distance.
    pub weight: Rgb,
}

impl Travel {
    /// Of a ray that leaves its vertex; `least` as in [`Travel::least`].
    pub fn new(least: f32, glows: bool) -> Self {
        Self {
            passed: Passed::default(),
            least,
            glow: glows.then_some([0.0; 3]),
        }
    }

    /// It is not scattered.
    pub fn is_straight(&self) -> bool {
        self.least == -f32::INFINITY
    }

    /// Its vertex sends light back, `beta` times what it was lit with.
    pub fn light(&mut self, beta: Rgb) {
        if let Some(glow) = &mut self.glow {
            for c in 0..3 {
                glow[c] *= beta[c];
            }
        }
    }

    /// What it carries, if nothing has scattered it: transmittance over the probability of that.
    pub fn through(&self) -> Rgb {
        through(&self.passed, self.is_straight())
    }
}

pub(super) fn through(passed: &Passed, straight: bool) -> Rgb {
    if straight {
        passed.transmittance()
    } else {
        passed.through()
    }
}
