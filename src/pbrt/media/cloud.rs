//! The density of pbrt-v4's `cloud`: noise that thins out with height (pbrt-v4, section 11.4.5).

use crate::surface::texture::noise::noise;

/// Its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cloud {
    pub density: f32,
    pub wispiness: f32,
    pub frequency: f32,
}

impl Default for Cloud {
    fn default() -> Self {
        Self {
            density: 1.0,
            wispiness: 1.0,
            frequency: 5.0,
        }
    }
}

/// Octaves have frequencies of this ratio.
const LACUNARITY: f32 = 1.99;

impl Cloud {
    /// The density at a point of the medium's own space.
    pub fn at(&self, p: [f32; 3]) -> f32 {
        let mut q = p.map(|x| x * self.frequency);
        if self.wispiness > 0.0 {
            let (mut amplitude, mut frequency) = (0.05 * self.wispiness, 10.0);
            for _ in 0..2 {
                let d = slope(q.map(|x| x * frequency));
                for c in 0..3 {
                    q[c] += amplitude * d[c];
                }
                amplitude *= 0.5;
                frequency *= LACUNARITY;
            }
        }
        let (mut sum, mut amplitude, mut frequency) = (0.0, 0.5, 1.0);
        for _ in 0..5 {
            sum += amplitude * noise(q.map(|x| x * frequency));
            amplitude *= 0.5;
            frequency *= LACUNARITY;
        }
        let high = ((1.0 - p[1]) * 4.5 * self.density * sum).clamp(0.0, 1.0);
        (high + 2.0 * (0.5 - p[1]).max(0.0)).clamp(0.0, 1.0)
    }
}

/// Differences of noise, as pbrt takes them.
fn slope(p: [f32; 3]) -> [f32; 3] {
    const STEP: f32 = 0.01;
    let here = noise(p);
    [0, 1, 2].map(|c| {
        let mut there = p;
        there[c] += STEP;
        (noise(there) - here) / STEP
    })
}
