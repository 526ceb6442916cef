//! What a render knows about its own error: tile by tile, and over the whole picture.

mod relmse;

pub(super) use self::relmse::relmse;
pub use self::relmse::standard_errors;

use crate::film::{GROUPS, TILE, Tiling};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Means and standard errors of the tiles of a picture: of the mean over pixels and channels of
/// radiance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Tiles {
    /// Pixels along a side.
    pub size: u32,
    /// Tiles from left to right.
    pub columns: usize,
    /// Tiles from top to bottom.
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
        let (mut fewest, mut compared) = (GROUPS, false);
        for layer in layers {
            let groups = layer.thrown.iter().filter(|n| **n > 0.0).count();
            let thrown: f64 = layer.thrown.iter().sum();
            if thrown <= 0.0 {
                continue;
            }
            // Chains that all start from one path have nothing to be compared with: their light is
            // taken to be off by as much as it is.
            let alone = groups < 2;
            if !alone {
                (fewest, compared) = (fewest.min(groups), true);
            }
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
                let of_splats = if alone {
                    value * value
                } else {
                    spread * (layer.scale / pixels).powi(2)
                };
                variance[tile] += of_splats + layer.relative_variance * value * value;
            }
        }
        Self {
            size: TILE,
            columns: tiling.columns,
            rows: tiling.rows,
            mean,
            groups: if compared { fewest } else { 1 },
            stderr: compared.then(|| variance.into_iter().map(f64::sqrt).collect()),
        }
    }
}

/// When to look at the error again: so rarely that all looks together take no more than a hundredth
/// of the time.
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

    /// Whether it is time to.
    pub fn is_due(&self) -> bool {
        (self.spent + self.longest) * 100 <= self.start.elapsed()
    }

    /// A look has taken the time from `begin` on.
    pub fn looked(&mut self, begin: Instant) {
        let taken = begin.elapsed();
        self.spent += taken;
        self.longest = self.longest.max(taken);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_of_one_group_is_as_uncertain_as_it_is_large() {
        let tiling = Tiling::new([0, 4, 0, 4]);
        let group = |value: f64, groups: usize| {
            let mut sums = [0.0; GROUPS];
            let mut thrown = [0.0; GROUPS];
            sums[..groups].fill(value / groups as f64);
            thrown[..groups].fill(1.0 / groups as f64);
            ([sums], thrown)
        };
        let (many, one) = (group(32.0, GROUPS), group(3.2, 1));
        fn layer((sums, thrown): &([[f64; GROUPS]; 1], [f64; GROUPS])) -> Groups<'_> {
            Groups {
                sums,
                thrown: *thrown,
                scale: 1.0,
                relative_variance: 0.0,
            }
        }
        let both = Tiles::of(&tiling, &[layer(&many), layer(&one)]);
        assert_eq!(both.groups, GROUPS);
        assert!((both.mean[0] - 2.2).abs() < 1e-12);
        assert!((both.stderr.unwrap()[0] - 0.2).abs() < 1e-12);
        let alone = Tiles::of(&tiling, &[layer(&one)]);
        assert_eq!((alone.groups, alone.stderr), (1, None));
    }
}
