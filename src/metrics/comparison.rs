//! Every metric of two pictures, whole, by tiles and by pixels.

use std::borrow::Cow;
use std::ops::Range;

use serde::Serialize;

use super::flip::{self, Exposures};
use super::{decibels, displayed_squared, of_pixel, relative_squared, squared, symmetric_absolute};

/// Which FLIP suits the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// Both are as on a display; values beyond 0 to 1 are clamped.
    Ldr,
    /// Both have a range no display has.
    Hdr,
}

/// What can be said of single pixels; means over channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// `p - r`
    Difference,
    /// A pixel's squared error.
    Mse,
    /// Square root of a pixel's squared error.
    Rmse,
    /// The terms of [`relmse`](super::relmse).
    Relmse,
    /// The terms of [`smape`](super::smape), 0 to 1.
    Smape,
    /// FLIP of the kind that the comparison was made with, 0 to 1; one number a pixel.
    Flip,
}

/// A picture and its reference.
pub struct Comparison<'a> {
    width: usize,
    picture: &'a [[f32; 3]],
    reference: &'a [[f32; 3]],
    flip: Vec<f32>,
    /// Those HDR-FLIP looked at.
    pub exposures: Option<Exposures>,
}

/// Pixels with a channel that is infinite or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct NotFinite {
    /// How many there are, at least 1.
    pub pixels: usize,
    /// Column and row, from 0 at the left and top.
    pub first: [usize; 2],
}

/// The metrics of a region: means over those of its pixels that are finite in both pictures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// [`mse`](super::mse).
    pub mse: f64,
    /// Square root of [`Self::mse`].
    pub rmse: f64,
    /// [`relmse`](super::relmse).
    pub relmse: f64,
    /// [`smape`](super::smape), 0 to 1.
    pub smape: f64,
    /// Infinite where nothing visible differs; JSON has `null` for it.
    pub psnr_db: f64,
    /// Mean FLIP, 0 to 1.
    pub flip: f64,
    /// Mean of the picture over pixels and channels.
    pub mean_a: f64,
    /// Mean of the reference.
    pub mean_b: f64,
    /// `mean_a / mean_b`: 1 where there is no bias; `None` where only the reference's mean is 0.
    pub ratio: Option<f64>,
}

/// A part of the picture.
#[derive(Clone, Debug, Serialize)]
pub struct Tile {
    /// Left and top, in pixels.
    pub x: usize,
    /// Top, in pixels.
    pub y: usize,
    /// In pixels; tiles at the right may be narrower.
    pub width: usize,
    /// In pixels; tiles at the bottom may be lower.
    pub height: usize,
    /// `None` where no pixel is finite.
    #[serde(flatten)]
    pub figures: Option<Figures>,
}

impl<'a> Comparison<'a> {
    /// Compares rows of `width` pixels; `ppd`: pixels per degree, for FLIP. Pixels that are not
    /// finite in one of the pictures are black in both for FLIP's filters, and left out of
    /// everything else.
    ///
    /// # Panics
    /// If the numbers of pixels differ, or do not fill rows.
    pub fn new(
        picture: &'a [[f32; 3]],
        reference: &'a [[f32; 3]],
        width: usize,
        kind: Flip,
        ppd: f32,
    ) -> Self {
        assert_eq!(picture.len(), reference.len());
        assert!(picture.len().is_multiple_of(width.max(1)));
        let all_finite = picture.iter().chain(reference).all(is_finite);
        let finite = |pixels: &'a [[f32; 3]]| -> Cow<'a, [[f32; 3]]> {
            if all_finite {
                return pixels.into();
            }
            let pairs = pixels.iter().zip(picture.iter().zip(reference));
            pairs
                .map(|(v, (p, r))| {
                    if is_finite(p) && is_finite(r) {
                        *v
                    } else {
                        [0.0; 3]
                    }
                })
                .collect()
        };
        let (p, r) = (finite(picture), finite(reference));
        let (flip, exposures) = match kind {
            Flip::Ldr => (flip::ldr(&p, &r, width, ppd), None),
            Flip::Hdr => {
                let (errors, exposures) = flip::hdr(&p, &r, width, ppd);
                (errors, Some(exposures))
            }
        };
        Self {
            width,
            picture,
            reference,
            flip,
            exposures,
        }
    }

    fn height(&self) -> usize {
        self.picture.len() / self.width.max(1)
    }

    /// Figures of the whole picture; `None` if no pixel is finite.
    pub fn whole(&self) -> Option<Figures> {
        self.region(0..self.width, 0..self.height())
    }

    /// Tiles of `size * size` pixels (those at the right and bottom may be smaller), row by row.
    pub fn tiles(&self, size: usize) -> Vec<Tile> {
        let (width, height) = (self.width, self.height());
        let part = move |start: usize, end: usize| start..(start + size).min(end);
        let corners = (0..height)
            .step_by(size)
            .flat_map(|y| (0..width).step_by(size).map(move |x| (x, y)));
        corners
            .map(|(x, y)| {
                let (xs, ys) = (part(x, width), part(y, height));
                Tile {
                    x,
                    y,
                    width: xs.len(),
                    height: ys.len(),
                    figures: self.region(xs, ys),
                }
            })
            .collect()
    }

    /// The error of every pixel; NaN for those that are not finite.
    pub fn map(&self, map: Map) -> Vec<f32> {
        let pairs = self.picture.iter().zip(self.reference);
        let error = |p: &[f32; 3], r: &[f32; 3], flip: f32| match map {
            Map::Difference => of_pixel(p, r, |p, r| p - r),
            Map::Mse => of_pixel(p, r, squared),
            Map::Rmse => of_pixel(p, r, squared).sqrt(),
            Map::Relmse => of_pixel(p, r, relative_squared),
            Map::Smape => of_pixel(p, r, symmetric_absolute),
            Map::Flip => f64::from(flip),
        };
        pairs
            .zip(&self.flip)
            .map(|((p, r), flip)| match is_finite(p) && is_finite(r) {
                true => error(p, r, *flip) as f32,
                false => f32::NAN,
            })
            .collect()
    }

    fn region(&self, xs: Range<usize>, ys: Range<usize>) -> Option<Figures> {
        let pixels = ys.flat_map(|y| xs.clone().map(move |x| y * self.width + x));
        let mut count = 0;
        let mut sums = [0.0; 7];
        for i in pixels {
            let (p, r) = (&self.picture[i], &self.reference[i]);
            if !is_finite(p) || !is_finite(r) {
                continue;
            }
            let errors = [
                of_pixel(p, r, squared),
                of_pixel(p, r, relative_squared),
                of_pixel(p, r, symmetric_absolute),
                of_pixel(p, r, displayed_squared),
                f64::from(self.flip[i]),
                of_pixel(p, r, |p, _| p),
                of_pixel(p, r, |_, r| r),
            ];
            sums.iter_mut().zip(errors).for_each(|(sum, e)| *sum += e);
            count += 1;
        }
        let means = sums.map(|sum| sum / f64::from(count));
        (count > 0).then(|| Figures::of(means))
    }
}

impl Figures {
    fn of([mse, relmse, smape, displayed, flip, mean_a, mean_b]: [f64; 7]) -> Self {
        let ratio = match mean_b {
            _ if mean_a == mean_b => Some(1.0),
            0.0 => None,
            _ => Some(mean_a / mean_b),
        };
        Self {
            mse,
            rmse: mse.sqrt(),
            relmse,
            smape,
            psnr_db: decibels(displayed),
            flip,
            mean_a,
            mean_b,
            ratio,
        }
    }

    /// The figure that belongs to a map; for differences the magnitude of their mean.
    pub fn of_map(&self, map: Map) -> f64 {
        match map {
            Map::Difference => (self.mean_a - self.mean_b).abs(),
            Map::Mse => self.mse,
            Map::Rmse => self.rmse,
            Map::Relmse => self.relmse,
            Map::Smape => self.smape,
            Map::Flip => self.flip,
        }
    }
}

impl NotFinite {
    /// In rows of `width`; `None` if all are finite.
    pub fn find(pixels: &[[f32; 3]], width: usize) -> Option<Self> {
        let mut bad = (0..pixels.len()).filter(|i| !is_finite(&pixels[*i]));
        let first = bad.next()?;
        Some(Self {
            pixels: 1 + bad.count(),
            first: [first % width, first / width],
        })
    }
}

fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics;

    fn pictures() -> [Vec<[f32; 3]>; 2] {
        let picture = |phase: f32| {
            (0..35)
                .map(|i| [0.0, 0.3, 2.0].map(|c| (i as f32 + c + phase).sin().abs()))
                .collect()
        };
        [picture(0.0), picture(0.1)]
    }

    #[test]
    fn tiles_make_up_the_whole() {
        let [p, r] = pictures();
        let comparison = Comparison::new(&p, &r, 7, Flip::Hdr, flip::PPD);
        let whole = comparison.whole().unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(whole.mse, metrics::mse(&p, &r));
        near(whole.relmse, metrics::relmse(&p, &r));
        near(whole.smape, metrics::smape(&p, &r));
        near(whole.psnr_db, metrics::psnr(&p, &r));
        let tiles = comparison.tiles(4);
        let sizes: Vec<_> = tiles
            .iter()
            .map(|t| (t.x, t.y, t.width, t.height))
            .collect();
        assert_eq!(
            sizes,
            [(0, 0, 4, 4), (4, 0, 3, 4), (0, 4, 4, 1), (4, 4, 3, 1)]
        );
        for map in [Map::Mse, Map::Relmse, Map::Smape, Map::Flip] {
            let parts = tiles.iter().map(|t| {
                (t.width * t.height) as f64 * t.figures.as_ref().unwrap().of_map(map) / 35.0
            });
            near(parts.sum(), whole.of_map(map));
            let pixels = comparison.map(map);
            let mean = pixels.iter().map(|e| f64::from(*e)).sum::<f64>() / 35.0;
            assert!((mean - whole.of_map(map)).abs() < 1e-6);
        }
    }

    #[test]
    fn pixels_that_are_not_finite_are_left_out() {
        let [mut p, mut r] = pictures();
        let clean = Comparison::new(&p[..28], &r[..28], 7, Flip::Ldr, flip::PPD)
            .whole()
            .unwrap();
        p[28..33].fill([0.0, f32::NAN, 0.0]);
        r[32..].fill([f32::INFINITY; 3]);
        let dirty = Comparison::new(&p, &r, 7, Flip::Ldr, flip::PPD);
        let whole = dirty.whole().unwrap();
        assert_eq!((whole.mse, whole.mean_a), (clean.mse, clean.mean_a));
        assert!(whole.flip.is_finite());
        assert!(dirty.map(Map::Flip)[28..].iter().all(|e| e.is_nan()));
        let found = NotFinite::find(&p, 7).unwrap();
        assert_eq!((found.pixels, found.first), (5, [0, 4]));
        assert_eq!(NotFinite::find(&p[..28], 7), None);
        let nothing = Comparison::new(&p[28..29], &r[28..29], 1, Flip::Hdr, flip::PPD);
        assert_eq!(nothing.whole(), None);
        assert!(nothing.tiles(16)[0].figures.is_none());
    }

    #[test]
    fn equal_pictures_have_no_error_and_no_bias() {
        let [p, _] = pictures();
        for kind in [Flip::Ldr, Flip::Hdr] {
            let figures = Comparison::new(&p, &p, 7, kind, flip::PPD).whole().unwrap();
            assert_eq!((figures.mse, figures.smape, figures.flip), (0.0, 0.0, 0.0));
            assert_eq!((figures.psnr_db, figures.ratio), (f64::INFINITY, Some(1.0)));
        }
        let black = [[0.0; 3]; 2];
        let ratio = |p: &[[f32; 3]], r: &[[f32; 3]]| {
            let comparison = Comparison::new(p, r, 2, Flip::Hdr, flip::PPD);
            comparison.whole().unwrap().ratio
        };
        assert_eq!(ratio(&black, &black), Some(1.0));
        assert_eq!(ratio(&p[..2], &black), None);
    }
}
