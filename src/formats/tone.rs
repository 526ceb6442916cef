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
    /// After Sobotka's AgX (2022): colours are brought nearer to grey, and an S-shaped curve over
    /// stops takes 10 stops below a middle grey of 0.18, and 6.5 above it, to black and white.
    /// Bright colours go to white instead of to the corners of the cube of colours. See
    /// [`agx_like`].
    AgxLike,
}

/// Up to here [`Tonemap::Shoulder`] is the identity.
pub const KNEE: f32 = 0.8;

impl Tonemap {
    /// All of them, the default first.
    pub const ALL: [Self; 4] = [Self::Shoulder, Self::Linear, Self::Filmic, Self::AgxLike];

    /// As flags call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shoulder => "shoulder",
            Self::Linear => "linear",
            Self::Filmic => "filmic",
            Self::AgxLike => "agx-like",
        }
    }

    /// Linear red, green and blue to display values that are not above 1, still linear.
    pub fn apply_to(self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            Self::AgxLike => agx_like(rgb),
            _ => rgb.map(|v| self.apply(v)),
        }
    }

    /// A linear value of a grey pixel to one that is not above 1. NaN stays NaN. All curves but
    /// [`Tonemap::AgxLike`] do the same to each channel.
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
            Self::AgxLike => agx_curve(v),
        }
    }
}

/// What [`Tonemap::AgxLike`] leaves as it is.
const GREY: f32 = 0.18;
/// Stops below and above [`GREY`] that become black and white.
const STOPS: [f32; 2] = [10.0, 6.5];
/// Slope of the curve at [`GREY`], of the displayed range over that of stops.
const CONTRAST: f32 = 2.4;
/// How soon the curve bends away from its slope.
const POWER: f32 = 1.5;
/// Exponent between the curve and linear values, that of a display.
const GAMMA: f32 = 2.2;
/// How far each channel is brought to the mean of all before the curve, and back after it.
const TO_GREY: f32 = 0.2;

/// Each channel `v` becomes `v + a (mean - v)`, `a` = 0.2, goes through the curve, and the
/// inverse of that step follows. Greys stay greys. What the inverse brings below 0 or above 1 is
/// cut off.
pub fn agx_like(rgb: [f32; 3]) -> [f32; 3] {
    let towards = |rgb: [f32; 3], part: f32| {
        let mean = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
        rgb.map(|v| v + part * (mean - v))
    };
    // Beyond any white; a sum of three is finite.
    let bounded = rgb.map(|v| if v.is_nan() { v } else { v.clamp(0.0, 1e30) });
    let shown = towards(bounded, TO_GREY).map(agx_curve);
    let back = -TO_GREY / (1.0 - TO_GREY);
    towards(shown, back).map(|v| if v.is_nan() { v } else { v.clamp(0.0, 1.0) })
}

/// A sigmoid `t / (1 + t^p)^(1/p)` on each side of the grey, stretched so that it ends in black and
/// in white.
fn agx_curve(v: f32) -> f32 {
    if v.is_nan() {
        return v;
    }
    let [below, above] = STOPS;
    let range = below + above;
    let pivot = [below / range, GREY.powf(1.0 / GAMMA)];
    let stops = (v.max(f32::MIN_POSITIVE) / GREY)
        .log2()
        .clamp(-below, above);
    let side = |length: f32, height: f32| {
        // Of which the curve at `length` is `height`.
        let rise = CONTRAST * length;
        let scale = rise / ((rise / height).powf(POWER) - 1.0).powf(1.0 / POWER);
        let t = CONTRAST * (stops / range).abs() / scale;
        scale * t / (1.0 + t.powf(POWER)).powf(1.0 / POWER)
    };
    let shown = match stops < 0.0 {
        true => pivot[1] - side(pivot[0], pivot[1]),
        false => pivot[1] + side(1.0 - pivot[0], 1.0 - pivot[1]),
    };
    // Rounding may leave a trace of light in black.
    let black = f32::EPSILON * 4.0;
    if shown < black {
        0.0
    } else {
        shown.min(1.0).powf(GAMMA)
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
    fn agx_keeps_grey_and_takes_bright_colours_to_white() {
        let grey = agx_like([GREY; 3]);
        assert!(grey.iter().all(|v| (v - GREY).abs() < 1e-5), "{grey:?}");
        for level in [0.0, 1e-4, 0.05, 0.5, 3.0, 1e3, f32::INFINITY] {
            let [r, g, b] = agx_like([level; 3]);
            assert!((r - g).abs() < 1e-5 && (g - b).abs() < 1e-5, "{level}");
            assert!((r - Tonemap::AgxLike.apply(level)).abs() < 1e-5, "{level}");
        }
        assert_eq!(agx_like([0.0; 3]), [0.0; 3]);
        // From red through light red to white; the other curves end in yellow.
        let spread = |stops: f32| {
            let [r, g, b] = agx_like([1.0, 0.3, 0.05].map(|v| v * stops.exp2()));
            assert!(r >= g && g >= b, "{stops}: {r} {g} {b}");
            r - b
        };
        assert!(spread(2.0) > spread(5.0) && spread(5.0) > spread(12.0));
        assert!(spread(12.0) < 1e-3);
        assert!(agx_like([f32::NAN, 0.5, 0.5])[0].is_nan());
        assert!(
            agx_like([-1.0, f32::INFINITY, 0.0])
                .iter()
                .all(|v| (0.0..=1.0).contains(v))
        );
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
