//! How linear pictures become what a display shows.

/// The way from linear values to display values, for 8-bit files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Factors of two by which the picture is brightened; `None`: by [`automatic`].
    pub exposure: Option<f32>,
    /// What becomes of values near and above 1.
    pub tonemap: Tonemap,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            exposure: Some(0.0),
            tonemap: Tonemap::Shoulder,
        }
    }
}

impl Display {
    /// Values as they are, cut off at 1.
    pub const LINEAR: Self = Self {
        exposure: Some(0.0),
        tonemap: Tonemap::Linear,
    };

    /// What values of a picture are multiplied by.
    pub fn factor(&self, pixels: &[[f32; 3]]) -> f32 {
        self.exposure.unwrap_or_else(|| automatic(pixels)).exp2()
    }
}

/// What becomes of values near and above 1, which is white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tonemap {
    /// The identity up to [`KNEE`], an exponential that approaches 1 beyond, with a continuous
    /// derivative.
    Shoulder,
    /// Cut off at 1.
    Linear,
    /// The rational fit of Narkowicz 2015 ("ACES Filmic Tone Mapping Curve").
    Filmic,
}

/// Up to here [`Tonemap::Shoulder`] is the identity.
pub const KNEE: f32 = 0.8;

impl Tonemap {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [Self::Shoulder, Self::Linear, Self::Filmic];

    /// As flags call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shoulder => "shoulder",
            Self::Linear => "linear",
            Self::Filmic => "filmic",
        }
    }

    /// A linear value of one channel to one that is not above 1. NaN stays NaN.
    pub fn apply(self, v: f32) -> f32 {
        match self {
            // Black in the end, not white.
            _ if v.is_nan() => v,
            Self::Shoulder if v > KNEE => {
                let range = 1.0 - KNEE;
                KNEE + range * (1.0 - ((KNEE - v) / range).exp())
            }
            Self::Shoulder => v,
            Self::Linear => v.min(1.0),
            Self::Filmic => {
                // The fit ends near 10; beyond it the quotient of its leading terms is above 1.
                let x = v.clamp(0.0, 1e4);
                (x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)).min(1.0)
            }
        }
    }
}

/// Stops that bring the luminance that 99 % of the pixels are below to 1; 0 for a black picture.
pub fn automatic(pixels: &[[f32; 3]]) -> f32 {
    let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mut values: Vec<f32> = (pixels.iter().map(luminance))
        .filter(|v| v.is_finite() && *v > 0.0)
        .collect();
    if values.is_empty() {
        return 0.0;
    }
    let at = (values.len() - 1) * 99 / 100;
    let (_, bright, _) = values.select_nth_unstable_by(at, f32::total_cmp);
    -bright.log2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_from_black_to_white() {
        for curve in Tonemap::ALL {
            assert_eq!(curve.apply(0.0), 0.0, "{curve:?}");
            let mut last = 0.0;
            for i in 0..=4000 {
                let v = curve.apply(i as f32 / 100.0);
                assert!((last..=1.0).contains(&v), "{curve:?} {i}: {v} after {last}");
                last = v;
            }
            assert!(last > 0.999, "{curve:?}");
            assert!(curve.apply(f32::INFINITY) <= 1.0, "{curve:?}");
            assert!(curve.apply(f32::NAN).is_nan(), "{curve:?}");
        }
        assert_eq!(Tonemap::Shoulder.apply(0.5), 0.5);
        // What a display cannot tell from white in the cut-off picture still has shape here.
        assert!((Tonemap::Shoulder.apply(1.0) - 0.926_424).abs() < 1e-5);
    }

    #[test]
    fn exposure_by_the_picture() {
        let mut pixels = vec![[0.25; 3]; 99];
        pixels.push([1e6; 3]);
        assert!((automatic(&pixels) - 2.0).abs() < 1e-5);
        assert_eq!(automatic(&[[0.0; 3]; 4]), 0.0);
        assert_eq!(automatic(&[[f32::NAN; 3], [4.0; 3]]), -2.0);
    }
}
