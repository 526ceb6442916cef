//! The film: size, crop window, filter, and what samples are cut down to.

use glam::Vec2;

use super::{Rgb, spectrum};

/// What a picture is rendered onto.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Full resolution.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// `[x0, x1, y0, y1]`: the pixels rendered are `[x0, x1)` by `[y0, y1)`, from the crop window
    /// as pbrt rounds it (ceil of both ends).
    pub crop: [u32; 4],
    /// What the scene calls its picture.
    pub filename: Option<String>,
    /// How samples are spread over pixels.
    pub filter: Filter,
    /// Factor on all values written (v3 `scale`; v4 imaging ratio, the time the shutter is open
    /// times `iso / 100`, 1 by default).
    pub scale: f32,
    /// Linear sRGB to what is written, if that is something else: rows of a matrix.
    pub colour: Option<[[f32; 3]; 3]>,
    /// `x y` of the red, green, blue and white that are written, if they are not those of sRGB.
    pub chromaticities: Option<[f32; 8]>,
    /// What samples are cut down to; chains never are.
    pub clamp: Option<Clamp>,
}

/// The most that one sample may bring to a pixel, in units of the film's input: brighter ones keep
/// their colour and lose the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clamp {
    /// Of luminance (v3 `maxsampleluminance`).
    Luminance(f32),
    /// Of X, Y or Z, whichever is largest: what pbrt-v4's default sensor sees
    /// (`maxcomponentvalue`).
    Xyz(f32),
}

impl Clamp {
    /// The same for light that is so much brighter.
    pub fn scaled(self, factor: f32) -> Self {
        match self {
            Clamp::Luminance(most) => Clamp::Luminance(most * factor),
            Clamp::Xyz(most) => Clamp::Xyz(most * factor),
        }
    }

    /// What is left of a sample.
    pub fn of(self, colour: Rgb) -> Rgb {
        let [r, g, b] = colour;
        let y = spectrum::luminance(colour);
        let (value, most) = match self {
            Clamp::Luminance(most) => (y, most),
            Clamp::Xyz(most) => {
                let x = 0.412453 * r + 0.357580 * g + 0.180423 * b;
                let z = 0.019334 * r + 0.119193 * g + 0.950227 * b;
                (x.max(y).max(z), most)
            }
        };
        match value > most {
            true => colour.map(|c| c * (most / value)),
            false => colour,
        }
    }
}

/// Reconstruction filter; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// Half its width and half its height; it is 0 beyond.
    pub radius: Vec2,
    /// Its shape within the radius.
    pub kind: FilterKind,
}

/// Shapes of reconstruction filters; `x` is the distance to the pixel, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// The same everywhere.
    Box,
    /// Linear, 0 at the radius.
    Triangle,
    /// v3: `exp(-alpha x^2)` minus its value at the radius. v4's `sigma` is `alpha = 1 / (2
    /// sigma^2)`.
    Gaussian {
        /// Per square pixel.
        alpha: f32,
    },
    /// Mitchell and Netravali: a piecewise cubic.
    Mitchell {
        /// How smooth: 1 is the B-spline.
        b: f32,
        /// How sharp: 0.5 with `b = 0` is Catmull-Rom.
        c: f32,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        /// Lobes of the window within the radius.
        tau: f32,
    },
}

/// Why a film cannot have a size or a crop window.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// A side that no film has.
    #[error("{width} x {height}: a side has 1 to {most} pixels", most = Film::MAX_SIDE)]
    Side {
        /// In pixels.
        width: u64,
        /// In pixels.
        height: u64,
    },
    /// Too many of them.
    #[error("{width} x {height} pixels are more than 2^31")]
    Pixels {
        /// In pixels.
        width: u64,
        /// In pixels.
        height: u64,
    },
    /// The window (`x0 x1 y0 y1`), and the film it is on.
    #[error("the crop window {0:?} holds no pixel of {1} x {2}")]
    EmptyCrop([f32; 4], u32, u32),
}

impl Film {
    /// Pixels of a side: raster positions stay exact to a fraction of a pixel in `f32`.
    pub const MAX_SIDE: u64 = 1 << 17;
    /// Pixels of a picture.
    pub const MAX_PIXELS: u64 = 1 << 31;

    /// Pixels of the crop window.
    pub fn crop_pixels(&self) -> u64 {
        let [x0, x1, y0, y1] = self.crop.map(u64::from);
        (x1 - x0) * (y1 - y0)
    }

    /// The size, if a film can have it.
    pub fn check_size(width: u64, height: u64) -> Result<(u32, u32), FilmError> {
        let side = 1..=Self::MAX_SIDE;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(FilmError::Side { width, height });
        }
        if width * height > Self::MAX_PIXELS {
            return Err(FilmError::Pixels { width, height });
        }
        Ok((width as u32, height as u32))
    }

    /// Renders only the pixels from `ceil(x0 * width)` up to, not including, `ceil(x1 * width)`,
    /// and likewise in `y` from the top. Rounded up at both ends, as pbrt does, so that
    /// adjacent windows tile.
    pub fn set_crop(&mut self, [x0, x1, y0, y1]: [f32; 4]) -> Result<(), FilmError> {
        let edge = |x: f32, size: u32| (size as f32 * x.clamp(0.0, 1.0)).ceil() as u32;
        let (w, h) = (self.width, self.height);
        let crop = [edge(x0, w), edge(x1, w), edge(y0, h), edge(y1, h)];
        if crop[0] >= crop[1] || crop[2] >= crop[3] {
            return Err(FilmError::EmptyCrop([x0, x1, y0, y1], w, h));
        }
        self.crop = crop;
        Ok(())
    }
}
