//! What a ray has passed so far: optical depths, and what follows from them.

use crate::scene::Rgb;
use crate::simd::math;

/// Optical depths beyond this let nothing pass.
pub(super) const OPAQUE: f32 = 1e30;

/// Optical depths that a ray has passed since it left its last vertex.
#[derive(Clone, Copy, Debug, Default)]
pub struct Passed {
    /// In media that scatter: these enter the density of where the ray is scattered.
    depth: Rgb,
    /// In media that only absorb.
    absorbed: Rgb,
}

impl Passed {
    /// Adds optical depths of a medium.
    #[inline]
    pub fn add(&mut self, depth: Rgb, scatters: bool) {
        let to = if scatters {
            &mut self.depth
        } else {
            &mut self.absorbed
        };
        for c in 0..3 {
            to[c] = (to[c] + depth[c]).min(OPAQUE);
        }
    }

    /// Transmittance per channel.
    pub fn transmittance(&self) -> Rgb {
        [0, 1, 2].map(|c| exp(-(self.depth[c] + self.absorbed[c])))
    }

    /// Logarithm of the mean transmittance of the media that scatter.
    pub(super) fn log_mean(&self) -> f32 {
        log_mean(self.depth)
    }

    /// How fast the logarithm of the mean transmittance falls per length where the extinction is
    /// this.
    pub(super) fn slope(&self, extinction: Rgb) -> f32 {
        let least = least(self.depth);
        let relative = self.depth.map(|d| exp(least - d));
        let sum = relative[0] + relative[1] + relative[2];
        (0..3).map(|c| extinction[c] * relative[c]).sum::<f32>() / sum
    }

    /// Whether all channels see equally far.
    pub(super) fn is_grey(&self) -> bool {
        self.depth == [self.depth[0]; 3]
    }

    /// What a ray that was not scattered carries: transmittance over the probability of that.
    pub fn through(&self) -> Rgb {
        self.over_mean([1.0; 3], [1.0; 3])
    }

    /// What a ray that is scattered here carries: scattering times transmittance over the density
    /// of the place.
    pub(super) fn scattered(&self, extinction: Rgb, scattering: Rgb) -> Rgb {
        self.over_mean(extinction, scattering)
    }

    /// `value` times transmittance over the mean of `density` times transmittance. Of media that
    /// only absorb the mean knows nothing.
    fn over_mean(&self, density: Rgb, value: Rgb) -> Rgb {
        // Relative to the channel that sees farthest, as all of them can be below `f32`.
        let least = least(self.depth);
        let relative = self.depth.map(|d| exp(least - d));
        let mean = (0..3).map(|c| density[c] * relative[c]).sum::<f32>() / 3.0;
        if mean <= 0.0 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|c| value[c] * relative[c] / mean * exp(-self.absorbed[c]))
    }

    /// How far the mean transmittance takes to fall to that of the logarithm `least`, in a medium
    /// of constant extinction.
    pub(super) fn invert(&self, extinction: Rgb, least: f32) -> f32 {
        // The logarithm of a mean of exponentials is convex and falls, so that Newton's method
        // comes from below and never passes the root. In grey media its first step is the last.
        let mut x = 0.0f32;
        for _ in 0..MOST_STEPS {
            let at = [0, 1, 2].map(|c| self.depth[c] + extinction[c] * x);
            let there = Self {
                depth: at,
                ..Self::default()
            };
            let slope = there.slope(extinction);
            let above = log_mean(at) - least;
            if above <= 0.0 || slope <= 0.0 {
                break;
            }
            let step = above / slope;
            x += step;
            if step <= x * f32::EPSILON {
                break;
            }
        }
        x
    }
}

/// Newton's method doubles the digits at every step, once it is near.
const MOST_STEPS: usize = 24;

fn least(depth: Rgb) -> f32 {
    depth[0].min(depth[1]).min(depth[2])
}

fn log_mean(depth: Rgb) -> f32 {
    let least = least(depth);
    if depth == [least; 3] {
        return -least;
    }
    let sum: f32 = depth.iter().map(|d| exp(least - d)).sum();
    math::ln(sum / 3.0) - least
}

/// Exponential of a number that is not above 0; nothing is left of the smallest.
pub(super) fn exp(x: f32) -> f32 {
    if x < -80.0 { 0.0 } else { math::exp(x) }
}

/// `ln(1 - u)`, also of a small `u`, to its last digits (Kahan).
pub fn ln_1m(u: f32) -> f32 {
    let rest = 1.0 - u;
    let lost = 1.0 - rest;
    if lost == 0.0 {
        -u
    } else {
        math::ln(rest) * (u / lost)
    }
}

/// Optical depths of a length.
pub(super) fn depths(extinction: Rgb, length: f32) -> Rgb {
    // Of a vacuum 0, also if the length is infinite.
    extinction.map(|e| {
        if e > 0.0 {
            (e * length).min(OPAQUE)
        } else {
            0.0
        }
    })
}
