//! Sums of samples that add light where they were placed, and elsewhere.

use super::samples::Estimate;
use super::{FilterTable, GROUPS, Passes, SEQUENCES, Sample, SampleFilm, Tiling};
use crate::checkpoint::{Malformed, Reader, Writer};
use std::ops::Range;

/// Film for samples that are placed in the cells of the raster one after the other and also splat
/// light to places that nobody chose, as those of light subpaths do. What was placed and what was
/// splatted is normalised apart: a pass that is broken off has gone over a part of the cells, but
/// its splats fell everywhere.
pub struct SplattingFilm {
    placed: SampleFilm,
    splats: Option<SampleFilm>,
}

/// How far a picture is.
#[derive(Clone, Debug)]
pub struct Done {
    /// Passes over the cells.
    pub placed: Passes,
    /// As many, whose samples fell everywhere.
    pub splats: Passes,
}

/// Pixels that are resolved at a time.
const BAND: usize = 4096;

impl SplattingFilm {
    /// `judged` says that the film knows its own error, `splats` that there are any.
    pub fn new(filter: FilterTable, judged: bool, splats: bool) -> Self {
        Self {
            splats: splats.then(|| SampleFilm::splatted(filter.clone(), judged)),
            placed: SampleFilm::placed(filter, judged),
        }
    }

    /// Writes all that it holds.
    pub fn save(&self, to: &mut Writer) {
        let Self { placed, splats } = self;
        placed.save(to);
        if let Some(splats) = splats {
            splats.save(to);
        }
    }

    /// Reads all that a film like this one held.
    ///
    /// # Errors
    /// It was another.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        let Self { placed, splats } = self;
        placed.load(from)?;
        match splats {
            Some(splats) => splats.load(from),
            None => Ok(()),
        }
    }

    /// Gives all that it holds away, in packed pieces, and begins anew from nothing.
    pub fn hand_over(&self) -> Vec<Vec<u8>> {
        let mut pieces = self.placed.hand_over();
        if let Some(splats) = &self.splats {
            pieces.extend(splats.hand_over());
        }
        pieces
    }

    /// Adds what a film like this one has handed over.
    ///
    /// # Errors
    /// It was another.
    pub fn take(&self, mut pieces: Vec<Vec<u8>>) -> Result<(), Malformed> {
        let placed = self.placed.pieces().min(pieces.len());
        let more = pieces.split_off(placed);
        self.placed.take(pieces)?;
        match &self.splats {
            Some(splats) => splats.take(more),
            None => Malformed::unless(more.is_empty(), "there are no splats"),
        }
    }

    /// Adds all that a film like this one holds.
    pub fn absorb(&self, other: &Self) {
        self.placed.absorb(&other.placed);
        if let (Some(splats), Some(more)) = (&self.splats, &other.splats) {
            splats.absorb(more);
        }
    }

    /// Adds samples that were placed.
    pub fn add(&self, samples: impl Iterator<Item = Sample>) {
        self.placed.add(samples);
    }

    /// Adds splats: sums over a pass that estimate radiance. There is a place for them only if the
    /// film was made with one.
    pub fn splat(&self, splats: impl Iterator<Item = Sample>) {
        if let Some(film) = &self.splats {
            film.add(splats);
        }
    }

    /// Its tiles.
    pub fn tiling(&self) -> &Tiling {
        self.placed.tiling()
    }

    /// The filter.
    pub fn filter(&self) -> &FilterTable {
        self.placed.filter()
    }

    /// What was placed.
    pub fn placed(&self) -> &SampleFilm {
        &self.placed
    }

    /// No sample has had any light.
    pub fn is_black(&self) -> bool {
        self.placed.is_black() && self.splats.as_ref().is_none_or(SampleFilm::is_black)
    }

    /// How often a sum was full and stayed as it was.
    pub fn full(&self) -> u64 {
        self.placed.full() + self.splats.as_ref().map_or(0, SampleFilm::full)
    }

    /// The picture; black where no pass has been.
    pub fn resolve(&self, done: &Done) -> Vec<[f32; 3]> {
        let Some(splats) = &self.splats else {
            return self.placed.resolve(&done.placed);
        };
        let pixels = self.filter().pixels();
        let mut picture = Vec::with_capacity(pixels);
        for first in (0..pixels).step_by(BAND) {
            let band = first..pixels.min(first + BAND);
            picture.extend(self.sums(splats, band, done).map(|e| e.narrow().0));
        }
        picture
    }

    /// Pixels of the picture, and a standard error of each of their values, as
    /// [`SampleFilm::resolve_with_error`]: what is placed and what is splatted in a pass
    /// belongs together, and both are added before halves are compared.
    ///
    /// # Panics
    /// If the film is not judged.
    pub fn resolve_with_error(
        &self,
        pixels: Range<usize>,
        done: &Done,
    ) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let Some(splats) = &self.splats else {
            return self.placed.resolve_with_error(pixels, &done.placed);
        };
        self.sums(splats, pixels, done).map(|e| e.narrow()).unzip()
    }

    fn sums<'a>(
        &self,
        splats: &SampleFilm,
        pixels: Range<usize>,
        done: &'a Done,
    ) -> impl Iterator<Item = Estimate> + use<'a> {
        let placed = (self.placed).estimates(&self.placed, pixels.clone(), &done.placed);
        let splatted = splats.estimates(splats, pixels.clone(), &done.splats);
        (pixels.zip(placed).zip(splatted)).map(|((pixel, a), b)| {
            // What has been splatted to a pixel that no pass has seen is not all of its light.
            let whole = done.placed.at(pixel) > 0.0;
            let sum = |a: f64, b: f64| if whole { a + b } else { 0.0 };
            Estimate {
                radiance: std::array::from_fn(|c| sum(a.radiance[c], b.radiance[c])),
                deviation: std::array::from_fn(|c| a.deviation[c] + b.deviation[c]),
            }
        })
    }

    /// What has fallen into each tile by group of passes, one for each of the [`SEQUENCES`], as if
    /// no pass had been broken off: a part of a pass makes its group's sum more certain, not
    /// larger.
    pub fn tile_sums(&self, done: &Done) -> Vec<[f64; GROUPS]> {
        let mut sums = regular(&self.placed, &done.placed);
        if let Some(splats) = &self.splats {
            for (sums, more) in sums.iter_mut().zip(regular(splats, &done.splats)) {
                sums.iter_mut().zip(more).for_each(|(sum, v)| *sum += v);
            }
        }
        sums.into_iter().map(by_sequence).collect()
    }

    /// Passes in each group of [`Self::tile_sums`].
    pub fn thrown(passes: u64) -> [f64; GROUPS] {
        by_sequence(thrown(passes))
    }
}

/// Passes that are a number modulo [`GROUPS`].
fn thrown(passes: u64) -> [f64; GROUPS] {
    std::array::from_fn(|g| (passes.saturating_sub(g as u64)).div_ceil(GROUPS as u64) as f64)
}

/// Sums by pass modulo [`GROUPS`] as such by sequence: the first [`SEQUENCES`]; the others are 0.
fn by_sequence(sums: [f64; GROUPS]) -> [f64; GROUPS] {
    let mut folded = [0.0; GROUPS];
    for (g, sum) in sums.into_iter().enumerate() {
        folded[g % SEQUENCES] += sum;
    }
    folded
}

fn regular(film: &SampleFilm, passes: &Passes) -> Vec<[f64; GROUPS]> {
    let mut tiles = film.tile_sums();
    let mut weights = film.tile_weights();
    let group = passes.whole as usize % GROUPS;
    let thrown = thrown(passes.whole.max(1));
    let regular = thrown[group];
    let tiling = film.tiling();
    let [left, right, top, _] = film.filter().crop();
    let width = (right - left) as usize;
    for (tile, sums) in tiles.iter_mut().enumerate() {
        let [x0, x1, y0, y1] = tiling.bounds(tile);
        let rows = y0 - top..y1 - top;
        let part: f64 = rows
            .flat_map(|y| (x0 - left..x1 - left).map(move |x| y as usize * width + x as usize))
            .map(|pixel| passes.part(pixel))
            .sum();
        let part = part / f64::from(tiling.pixels(tile));
        let made = if passes.whole == 0 {
            part
        } else {
            regular + part
        };
        let factor = if made > 0.0 { regular / made } else { 0.0 };
        sums[group] *= factor;
        if let Some(weights) = &mut weights {
            weights[tile][group] *= factor;
            weigh(sums, &weights[tile], thrown, f64::from(tiling.pixels(tile)));
        }
    }
    tiles
}

/// Sums over the pixels of a tile as if each had had a weight of 1 in each pass: what they lack or
/// have too much of is put down to the tile's mean, as pixels are divided by what their samples
/// weigh.
fn weigh(sums: &mut [f64; GROUPS], weights: &[f64; GROUPS], thrown: [f64; GROUPS], pixels: f64) {
    let weight: f64 = weights.iter().sum();
    if weight > 0.0 {
        let mean = sums.iter().sum::<f64>() / weight;
        for ((sum, w), thrown) in sums.iter_mut().zip(weights).zip(thrown) {
            *sum += mean * (thrown * pixels - w);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, FilterKind};
    use glam::Vec2;

    fn film(judged: bool, splats: bool) -> SplattingFilm {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        SplattingFilm::new(FilterTable::new(&filter, [0, 2, 0, 1]), judged, splats)
    }

    fn sample(x: f32, value: f32, pass: u64) -> Sample {
        Sample {
            raster: [x, 0.5],
            colour: [value; 3],
            pass,
        }
    }

    /// Of a third pass the first of two cells is done, and so half of its splats.
    #[test]
    fn a_broken_pass_counts_where_it_has_been() {
        let film = film(true, true);
        for pass in 0..2 {
            film.add([sample(0.5, 1.0, pass), sample(1.5, 2.0, pass)].into_iter());
            film.splat([sample(0.5, 0.25, pass), sample(1.5, 0.5, pass)].into_iter());
        }
        film.add([sample(0.5, 1.0, 2)].into_iter());
        film.splat([sample(1.5, 0.25, 2), sample(0.5, 0.125, 2)].into_iter());
        let done = Done {
            placed: Passes::with_part(2, film.filter(), [1.0, 0.0]),
            splats: Passes::with_part_everywhere(2, 0.5),
        };
        let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
        let [left, right] = film.resolve(&done)[..] else {
            panic!()
        };
        assert!(
            near(left[0], 1.25) && near(right[0], 2.5),
            "{left:?} {right:?}"
        );
        let (again, variance) = film.resolve_with_error(0..2, &done);
        assert_eq!(again, [left, right]);
        assert!(variance.iter().flatten().all(|v| *v < 1e-6));
        let tile = film.tile_sums(&done)[0];
        for sum in &tile[..3] {
            // The third group is told as if its pass were whole, or not at all.
            assert!((sum - 3.75).abs() < 0.01 || *sum == 0.0, "{tile:?}");
        }
    }

    /// Where what is placed is high whenever what is splatted is low, their sum is certain.
    #[test]
    fn errors_are_those_of_the_sum() {
        let film = film(true, true);
        for pass in 0..4 {
            let high = pass % 2 == 0;
            film.add([sample(0.5, if high { 3.0 } else { 1.0 }, pass)].into_iter());
            film.splat([sample(0.5, if high { 1.0 } else { 3.0 }, pass)].into_iter());
        }
        let done = Done {
            placed: Passes::whole(4),
            splats: Passes::whole(4),
        };
        let (picture, variance) = film.resolve_with_error(0..1, &done);
        assert_eq!((picture[0], variance[0]), ([4.0; 3], [0.0; 3]));
        let alone = film.placed.resolve_with_error(0..1, &done.placed).1[0];
        assert_eq!(alone, [1.0; 3]);
    }
}
