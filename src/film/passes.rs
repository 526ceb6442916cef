//! How often a path tracer has gone over each part of the picture.

use super::FilterTable;

/// Samples that each pixel has had, one in each unit cell of the raster being 1: whole passes, and
/// what of one more is done. A pass goes over the cells row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Passes {
    /// Passes that are done everywhere.
    pub whole: u64,
    part: Option<Part>,
}

/// The share of a pixel in a pass that is not whole.
#[derive(Clone, Debug, PartialEq)]
enum Part {
    /// Of cells done row by row.
    Cells(Cells),
    /// Of samples that may fall anywhere.
    Everywhere(f64),
}

/// `above[y] + beside[y] * left[x]`.
#[derive(Clone, Debug, PartialEq)]
struct Cells {
    /// By row of pixels: the weight of its filter over the rows of cells that are done, and over
    /// the row that is begun.
    above: Vec<f64>,
    beside: Vec<f64>,
    /// By column of pixels: the weight of its filter over the cells that are done in the row that
    /// is begun.
    left: Vec<f64>,
    /// Cells of the crop window that are done, row by row.
    done: usize,
}

/// A pixel that has seen less than this of its only pass is not rendered: what its filter has seen
/// may be next to nothing, or negative.
const LEAST: f64 = 0.5;

impl Passes {
    /// So many, and no part of another.
    pub fn whole(count: u64) -> Self {
        Self {
            whole: count,
            part: None,
        }
    }

    /// Of one more pass all cells above raster row `row` are done, and those of that row that lie
    /// left of `column`.
    pub fn with_part(count: u64, filter: &FilterTable, [column, row]: [f64; 2]) -> Self {
        let [x0, x1, y0, y1] = filter.crop();
        // Cells between `low` and `high` that lie below a border.
        let within = |low: u32, high: u32, border: f64| {
            (border.floor() - f64::from(low)).clamp(0.0, f64::from(high - low)) as usize
        };
        let width = (x1 - x0) as usize;
        let whole_rows = within(y0, y1, row) * width;
        let begun = row.floor() >= f64::from(y0) && row.floor() < f64::from(y1);
        let begun = usize::from(begun) * within(x0, x1, column);
        // Weight of the filter of pixel `i` below `border`.
        let below = |axis, i: u32, border: f64| filter.below(axis, border - f64::from(i) - 0.5);
        let rows = || y0..y1;
        let above: Vec<f64> = rows().map(|y| below(1, y, row)).collect();
        let beside = rows().zip(&above);
        let beside = beside.map(|(y, above)| below(1, y, row + 1.0) - above);
        Self {
            whole: count,
            part: Some(Part::Cells(Cells {
                beside: beside.collect(),
                left: (x0..x1).map(|x| below(0, x, column)).collect(),
                above,
                done: whole_rows + begun,
            })),
        }
    }

    /// Of one more pass a part is done, of samples that fall where they like: the same part of
    /// every pixel.
    pub fn with_part_everywhere(count: u64, part: f64) -> Self {
        Self {
            whole: count,
            part: Some(Part::Everywhere(part)),
        }
    }

    /// Passes over a pixel of the crop window in all.
    pub fn at(&self, pixel: usize) -> f64 {
        self.whole as f64 + self.part(pixel)
    }

    /// Samples in a pixel's own cell; there is one for each pass over the cells. None if the pixel
    /// is not rendered.
    pub fn inside(&self, pixel: usize) -> f64 {
        let more = match &self.part {
            Some(Part::Cells(part)) => {
                pixel < part.done && (self.whole > 0 || self.part(pixel) > 0.0)
            }
            _ => false,
        };
        self.whole as f64 + f64::from(u8::from(more))
    }

    /// Even passes over a pixel, and odd ones.
    pub fn halves(&self, pixel: usize) -> [f64; 2] {
        let mut halves = [self.whole.div_ceil(2) as f64, (self.whole / 2) as f64];
        halves[(self.whole % 2) as usize] += self.part(pixel);
        halves
    }

    /// What a pixel has had of the pass that is not whole.
    pub fn part(&self, pixel: usize) -> f64 {
        let part = match &self.part {
            None => return 0.0,
            Some(Part::Everywhere(part)) => return *part,
            Some(Part::Cells(part)) => part,
        };
        let (x, y) = (pixel % part.left.len(), pixel / part.left.len());
        let share = part.above[y] + part.beside[y] * part.left[x];
        if self.whole == 0 && share < LEAST {
            return 0.0;
        }
        share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, FilterKind};
    use glam::Vec2;

    #[test]
    fn parts_are_the_weight_of_cells_that_are_done() {
        let crop = [2, 9, 1, 7];
        for (kind, radius) in [
            (FilterKind::Box, 0.5),
            (FilterKind::Box, 1.0),
            (FilterKind::Triangle, 2.0),
            (FilterKind::Gaussian { alpha: 2.0 }, 1.5),
        ] {
            let filter = Filter {
                radius: Vec2::splat(radius),
                kind,
            };
            let filter = FilterTable::new(&filter, crop);
            let (column, row) = (5, 3);
            let passes = Passes::with_part(1, &filter, [5.0, 3.0]);
            // A fine grid of samples in every cell that is done.
            let mut weight = vec![0.0; filter.pixels()];
            const FINE: i32 = 32;
            for y in -4 * FINE..(row + 1) * FINE {
                for x in -4 * FINE..16 * FINE {
                    let done = y < row * FINE || x < column * FINE;
                    let at = [x, y].map(|v| (v as f32 + 0.5) / FINE as f32);
                    if done {
                        filter.splat(at, |p, w| weight[p] += w / f64::from(FINE * FINE));
                    }
                }
            }
            for (pixel, weight) in weight.iter().enumerate() {
                let part = passes.part(pixel);
                assert!(
                    (part - weight).abs() < 0.002,
                    "{kind:?} {pixel}: {part} {weight}"
                );
                assert_eq!(passes.at(pixel), 1.0 + part);
                assert_eq!(passes.halves(pixel), [1.0, part]);
            }
        }
    }

    #[test]
    fn whole_passes_are_halved() {
        let passes = Passes::whole(5);
        assert_eq!((passes.at(7), passes.halves(7)), (5.0, [3.0, 2.0]));
    }
}
