//! Where independent samples lie: one in each cell of the raster, pass after pass.

use super::Run;
use crate::film::{Done, FilterTable, Passes, SEQUENCES};
use crate::plan::Pair;
use crate::simd::Lanes;
use crate::simd::rng::Stream;
use crate::transport::samples::{Place, Samples};

/// The pixel cells that cover the sampled region.
pub(super) struct Grid {
    x0: f64,
    y0: f64,
    columns: u64,
    rows: u64,
    /// Of the region.
    origin: [f64; 2],
    size: [f64; 2],
    /// Sides of the part of each cell that samples lie in, about its centre:
    /// [`FilterTable::cell`].
    part: [f64; 2],
}

impl Grid {
    pub fn new(run: &Run, filter: &FilterTable) -> Self {
        let region = run.world.camera.region;
        let origin = [f64::from(region.x0), f64::from(region.y0)];
        let size = [f64::from(region.width), f64::from(region.height)];
        let low = origin.map(f64::floor);
        let count = |axis: usize| ((origin[axis] + size[axis]).ceil() - low[axis]) as u64;
        Self {
            x0: low[0],
            y0: low[1],
            columns: count(0),
            rows: count(1),
            origin,
            size,
            part: [filter.cell(0), filter.cell(1)],
        }
    }

    /// Samples of a pass.
    pub fn cells(&self) -> u64 {
        self.columns * self.rows
    }

    /// Area of the region over that of all cells: paths that are not placed are normalised to the
    /// region.
    pub fn cover(&self) -> f64 {
        self.size[0] * self.size[1] / self.cells() as f64
    }

    /// What `done` samples come to.
    pub fn done(&self, done: u64, filter: &FilterTable) -> Done {
        let (whole, rest) = (done / self.cells(), done % self.cells());
        if rest == 0 {
            let passes = Passes::whole(whole);
            return Done {
                placed: passes.clone(),
                splats: passes,
            };
        }
        let (row, column) = (rest / self.columns, rest % self.columns);
        let border = [self.x0 + column as f64, self.y0 + row as f64];
        Done {
            placed: Passes::with_part(whole, filter, border),
            splats: Passes::with_part_everywhere(whole, rest as f64 / self.cells() as f64),
        }
    }

    /// Primary samples of paths `begin..begin + n`; path `i` lies in cell `i` modulo the number of
    /// cells, and within it uniformly where its pixel's filter reaches. The raster position is
    /// that of the first two rows. Passes with the same remainder modulo [`SEQUENCES`] share out
    /// each cell, and every pair of dimensions, among them.
    pub fn fill<L: Lanes>(
        &self,
        stream: &Stream,
        pairs: &[Pair],
        samples: &mut Samples,
        begin: u64,
        n: usize,
    ) {
        samples.fill_stratified::<L>(stream, pairs, n, |i| {
            let path = begin + i as u64;
            let (cell, pass) = (path % self.cells(), path / self.cells());
            let (index, sequence) = (pass / SEQUENCES as u64, pass % SEQUENCES as u64);
            // A sequence has 2^32 points; another follows it.
            let sequence = sequence + SEQUENCES as u64 * (index >> 32);
            Place {
                sequence: [cell as u32, sequence as u32],
                index: index as u32,
            }
        });
        // The first two numbers place the sample in its cell, as a position in the region.
        for axis in 0..2 {
            let (low, size) = ([self.x0, self.y0][axis], self.size[axis]);
            // A number next to the border must not be rounded into the next cell.
            let edge = (size * f64::from(f32::EPSILON)).min(0.25);
            for (i, u) in samples.row_mut(axis)[..n].iter_mut().enumerate() {
                let cell = (begin + i as u64) % self.cells();
                let cell = [cell % self.columns, cell / self.columns][axis] as f64;
                let inside = 0.5 + (f64::from(*u) - 0.5) * self.part[axis];
                let inside = inside.clamp(edge, 1.0 - edge);
                *u = ((low + cell + inside - self.origin[axis]) / size) as f32;
            }
        }
    }
}
