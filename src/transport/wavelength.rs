//! Which wavelength a path has, and what colour that gives it.
//!
//! Rendering is in RGB. Only a path that is scattered by a surface whose index of refraction
//! depends on the wavelength has one: its contribution `T` in RGB, computed at that wavelength, is
//! that of all light of the path's kind, of which the wavelength `l`, of density `p`, stands for a
//! part. It becomes
//!
//! ```text
//! T_c W_c(l),   W_c = w_c / p,   w_c(l) = max(0, r_c(l)) / integral of max(0, r_c),
//! ```
//!
//! channel by channel, where `r(l)` is the linear sRGB of white light's (D65's) nanometre at `l`,
//! that is CIE 1931's matching functions times D65 through the matrix of sRGB. The mean of `W_c`
//! over `l` is 1, so that glass whose index is the same at all wavelengths gives the picture it
//! gives in RGB.
//!
//! Metropolis sampling needs contributions that are not negative. A map of `T` to them that is
//! linear in `T` and has the mean `T` is one number per channel and wavelength: what it brings from
//! one channel to another has the mean 0, and so, not being negative, is 0. So the choice is of
//! three functions `w_c`, and these are the negative lobes cut off and the rest scaled down alike.
//! A colour's channels stand for bands of light that overlap as those lobes do; there is no other
//! uplifting.
//!
//! What a fully dispersed white looks like, against the truth `r` cut off at 0 (what a spectral
//! renderer shows of it after clamping), both relative to the brightest channel of the truth
//! anywhere, in percent:
//!
//! | nm  | truth (R G B) | here (R G B) |
//! |-----|---------------|--------------|
//! | 400 |   0   0   3 |   0   0   2 |
//! | 420 |   4   0  28 |   3   0  26 |
//! | 440 |  10   0  86 |   7   0  78 |
//! | 460 |   1   0  92 |   1   0  83 |
//! | 480 |   0  10  43 |   0   9  39 |
//! | 500 |   0  30  11 |   0  26  10 |
//! | 520 |   0  59   0 |   0  53   0 |
//! | 540 |   0  70   0 |   0  62   0 |
//! | 560 |  17  57   0 |  12  51   0 |
//! | 580 |  69  32   0 |  47  28   0 |
//! | 600 |  98   6   0 |  66   5   0 |
//! | 620 |  85   0   0 |  57   0   0 |
//! | 640 |  44   0   0 |  30   0   0 |
//! | 660 |  16   0   0 |  11   0   0 |
//! | 680 |   4   0   0 |   3   0   0 |
//!
//! So red is 33 % darker than the truth, green 11 % and blue 10 %, at every wavelength: orange is a
//! little yellower. That is what the truth takes away from red in the blue-green, where here
//! nothing can be taken away.
//!
//! Wavelengths are sampled with the density `p = (w_r + w_g + w_b) / 3`, so that the mean of the
//! channels, which is what Metropolis sampling goes by, does not depend on the wavelength for grey
//! `T`, and no `W_c` is above 3. (Radziszewski, Boryczko and Alda 2009, and pbrt-v4's
//! `SampleVisibleWavelengths`, sample by an analytic curve close to the response of all channels
//! together.)

use crate::scene::spectrum::{FIRST, responses};

/// Maps a primary sample to a wavelength: the curves are linear between knots a nanometre apart.
#[derive(Clone, Debug)]
pub struct Wavelengths {
    /// `w_c` at the knots.
    response: Vec<[f64; 3]>,
    /// `p` at the knots, per nanometre.
    density: Vec<f64>,
    /// Its integral up to each knot.
    below: Vec<f64>,
}

/// The wavelength of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wavelength {
    /// In nanometres.
    pub nm: f32,
    /// `W_c`, which sum to 3.
    pub colour: [f32; 3],
}

impl Default for Wavelengths {
    fn default() -> Self {
        Self::new()
    }
}

impl Wavelengths {
    /// With the curves of the module, which are the same for all scenes.
    pub fn new() -> Self {
        let response = responses();
        let density: Vec<f64> = (response.iter())
            .map(|w| (w[0] + w[1] + w[2]) / 3.0)
            .collect();
        let mut below = vec![0.0];
        let mut sum = 0.0;
        for pair in density.windows(2) {
            sum += 0.5 * (pair[0] + pair[1]);
            below.push(sum);
        }
        Self {
            response,
            density,
            below,
        }
    }

    /// The wavelength that a primary sample stands for. In `f64`, so that it is as exact as a path
    /// in `f32` can have it: once a path, it costs nothing.
    pub fn at(&self, u: f32) -> Wavelength {
        let u = f64::from(u);
        let last = self.density.len() - 2;
        let i = (self.below.partition_point(|b| *b <= u).max(1) - 1).min(last);
        // Where the integral of a + (b - a) x is what is left, by the formula that does not cancel.
        let (a, b) = (self.density[i], self.density[i + 1]);
        let rest = (u - self.below[i]).max(0.0);
        let root = (2.0 * (b - a)).mul_add(rest, a * a).max(0.0).sqrt();
        let x = (2.0 * rest / (a + root)).clamp(0.0, 1.0);
        let w: [f64; 3] = std::array::from_fn(|c| {
            let (a, b) = (self.response[i][c], self.response[i + 1][c]);
            a + (b - a) * x
        });
        let density = (w[0] + w[1] + w[2]) / 3.0;
        Wavelength {
            nm: ((FIRST + i) as f64 + x) as f32,
            colour: w.map(|w| (w / density) as f32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::spectrum::spectral_white;

    /// Both as functions of the wavelength and of the primary sample.
    #[test]
    fn colours_have_the_mean_white() {
        let table = Wavelengths::new();
        assert!((table.below.last().unwrap() - 1.0).abs() < 1e-12);
        const N: usize = 1 << 18;
        let mut sum = [0.0; 3];
        let mut last = 0.0;
        for i in 0..N {
            let l = table.at((i as f32 + 0.5) / N as f32);
            assert!(l.nm >= last && (360.0..=830.0).contains(&l.nm));
            last = l.nm;
            assert!((l.colour.iter().sum::<f32>() - 3.0).abs() < 1e-5);
            for c in 0..3 {
                assert!((0.0..=3.0 + 1e-6).contains(&l.colour[c]));
                sum[c] += f64::from(l.colour[c]) / N as f64;
            }
        }
        // The midpoint rule over samples; colours vary smoothly with them but at both ends.
        assert!(sum.iter().all(|s| (s - 1.0).abs() < 1e-6), "{sum:?}");
    }

    /// The density is the derivative of the map.
    #[test]
    fn wavelengths_follow_their_density() {
        let table = Wavelengths::new();
        for nm in [400.5f64, 450.25, 520.0, 555.5, 610.75, 690.0] {
            let i = nm as usize - FIRST;
            let x = nm.fract();
            let (a, b) = (table.density[i], table.density[i + 1]);
            let u = table.below[i] + a * x + 0.5 * (b - a) * x * x;
            let l = table.at(u as f32);
            // A primary sample is good to 2^-25.
            let tolerance = f64::from(l.nm) * 6e-8 + 3e-8 / a;
            assert!((f64::from(l.nm) - nm).abs() < tolerance, "{nm}: {}", l.nm);
        }
    }

    /// The table at the top of this file.
    #[test]
    fn distance_from_the_truth() {
        let truth = spectral_white();
        let ours = responses();
        let most = truth.iter().flatten().copied().fold(0.0, f64::max);
        let percent = |v: f64| (100.0 * v.max(0.0) / most).round();
        for nm in [
            400, 420, 440, 460, 480, 500, 520, 540, 560, 580, 600, 620, 640, 660, 680,
        ] {
            let [t, o] = [&truth, &ours].map(|curve| curve[nm - FIRST].map(percent));
            println!(
                "//! | {nm} | {:3} {:3} {:3} | {:3} {:3} {:3} |",
                t[0], t[1], t[2], o[0], o[1], o[2]
            );
        }
        let scale: [f64; 3] = std::array::from_fn(|c| {
            let at = (0..truth.len()).max_by(|a, b| truth[*a][c].total_cmp(&truth[*b][c]));
            ours[at.unwrap_or(0)][c] / truth[at.unwrap_or(0)][c]
        });
        for (s, expected) in scale.iter().zip([0.674, 0.889, 0.898]) {
            assert!((s - expected).abs() < 5e-4, "{scale:?}");
        }
    }
}
