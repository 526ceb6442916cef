//! What a render knows about its own error: tile by tile, and over the whole picture.

mod relmse;

pub(super) use self::relmse::relmse;
pub use self::relmse::standard_errors;

use crate::film::{GROUPS, TILE, Tiling};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Means and standard errors of the tiles of a picture: of the mean over pixels and channels of radiance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Tiles {
    /// Pixels along a side.
    pub size: u32,
    pub columns: usize,
    pub rows: usize,
    /// `columns * rows`, row by row from the top left.
    pub mean: Vec<f64>,
    /// `None` where there are not two independent estimates.
    pub stderr: Option<Vec<f64>>,
    /// Independent estimates of each mean: its standard error has one degree of freedom less.
    pub groups: usize,
}

/// Sums of groups that are independent and alike.
pub(super) struct Groups<'a> {
    /// `[tile][group]`: what has fallen into each tile.
    pub sums: &'a [[f64; GROUPS]],
    /// What each group has thrown in all.
    pub thrown: [f64; GROUPS],
    /// Turns sums over all groups into radiance times pixels.
    pub scale: f64,
    /// Squared relative standard error of `scale`.
    pub relative_variance: f64,
}

impl Tiles {
    /// Multiplies all radiance.
    pub(super) fn scale(&mut self, factor: f64) {
        let values = self.mean.iter_mut().chain(self.stderr.iter_mut().flatten());
        values.for_each(|v| *v *= factor);
    }

    /// Tiles of a sum of independent layers.
    pub(super) fn of(tiling: &Tiling, layers: &[Groups]) -> Self {
        let n = tiling.len();
        let (mut mean, mut variance) = (vec![0.0; n], vec![0.0; n]);
        let mut fewest = GROUPS;
        for layer in layers {
            let groups = layer.thrown.iter().filter(|n| **n > 0.0).count();
            let thrown: f64 = layer.thrown.iter().sum();
            if thrown <= 0.0 {
                continue;
            }
            fewest = fewest.min(groups);
            let groups = groups as f64;
            for tile in 0..n {
                let sums = &layer.sums[tile];
                let pixels = f64::from(tiling.pixels(tile));
                let all: f64 = sums.iter().sum();
                let value = all * layer.scale / pixels;
                // A ratio of sums, linearised (Cochran 1977, equation 2.39).
                let part = all / thrown;
                let spread: f64 = (sums.iter().zip(&layer.thrown))
                    .map(|(sum, thrown)| (sum - part * thrown).powi(2))
                    .sum();
                let spread = spread * groups / (groups - 1.0).max(1.0);
                mean[tile] += value;
                variance[tile] += spread * (layer.scale / pixels).powi(2)
                    + layer.relative_variance * value * value;
            }
        }
        Self {
            size: TILE,
            columns: tiling.columns,
            rows: tiling.rows,
            mean,
            groups: fewest,
            stderr: (fewest >= 2).then(|| variance.into_iter().map(f64::sqrt).collect()),
        }
    }
}

/// When to look at the error again: so rarely that all looks together take no more than a hundredth of the time.
pub(super) struct Looks {
    start: Instant,
    spent: Duration,
    longest: Duration,
}

impl Looks {
    pub fn new() -> Self {
        Self {
            start: Instant::now(),
            spent: Duration::ZERO,
            longest: Duration::ZERO,
        }
    }

    /// Looks, if it is time to.
    pub fn look<T>(&mut self, look: impl FnOnce() -> T) -> Option<T> {
        let begin = Instant::now();
        if (self.spent + self.longest) * 100 > begin - self.start {
            return None;
        }
        let seen = look();
        let taken = begin.elapsed();
        self.spent += taken;
        self.longest = self.longest.max(taken);
        Some(seen)
    }
}
