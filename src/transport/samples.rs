//! Primary samples of a batch of paths: a matrix `[dimension][path]` of numbers in `[0, 1)`.

use crate::checkpoint::{Malformed, Reader, Writer};
use crate::plan::Pair;
use crate::simd::rng::Stream;
use crate::simd::sobol;
use crate::simd::{Lanes, UintLanes};

/// Floats of a cache line.
const LINE: usize = 16;

/// Where a column stands among samples that are spread evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Sequences that differ here are independent.
    pub sequence: [u32; 2],
    /// Number of its point.
    pub index: u32,
}

/// Row-major by dimension; rows are padded to a multiple of eight paths.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    data: Vec<f32>,
    /// Paths of a row.
    columns: usize,
    /// Floats from row to row.
    stride: usize,
}

impl Samples {
    /// Room for `dimensions` by `paths`, all zero.
    pub fn new(dimensions: usize, paths: usize) -> Self {
        let mut samples = Self::default();
        samples.resize(dimensions, paths);
        samples
    }

    /// New shape, all zero.
    pub fn resize(&mut self, dimensions: usize, paths: usize) {
        self.columns = paths.next_multiple_of(8);
        // An odd number of cache lines: rows a power of two apart would share a few sets of the
        // first-level cache.
        self.stride = (paths.div_ceil(LINE) | 1) * LINE;
        self.data.clear();
        self.data.resize(dimensions * self.stride, 0.0);
    }

    /// Writes all of it.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            data,
            columns: _,
            stride: _,
        } = self;
        to.table(data);
    }

    /// Reads as many dimensions of as many paths as there is room for.
    ///
    /// # Errors
    /// They are others, or not in `[0, 1)`.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        from.table(&mut self.data)?;
        let inside = self.data.iter().all(|u| (0.0..1.0).contains(u));
        Malformed::unless(inside, "a primary sample is out of range")
    }

    /// Rows of the matrix.
    #[inline(always)]
    pub fn dimensions(&self) -> usize {
        self.data.len().checked_div(self.stride).unwrap_or(0)
    }

    /// One dimension of all paths.
    #[inline(always)]
    pub fn row(&self, dimension: usize) -> &[f32] {
        &self.data[dimension * self.stride..][..self.columns]
    }

    /// To write what [`Self::row`] reads.
    #[inline(always)]
    pub fn row_mut(&mut self, dimension: usize) -> &mut [f32] {
        &mut self.data[dimension * self.stride..][..self.columns]
    }

    /// All dimensions of one path.
    pub fn column(&self, path: usize) -> Vec<f32> {
        (0..self.dimensions()).map(|d| self.row(d)[path]).collect()
    }

    /// Fills the first `n` columns with independent uniform numbers; `counter` gives the two
    /// counters of a column in `stream`.
    pub fn fill<L: Lanes>(
        &mut self,
        stream: &Stream,
        n: usize,
        counter: impl Fn(usize) -> [u32; 2],
    ) {
        let dimensions = self.dimensions();
        for start in (0..n).step_by(L::N) {
            let at = |i: usize| counter((start + i).min(n - 1));
            let x = L::Uint::from_fn(|i| at(i)[0]);
            let y = L::Uint::from_fn(|i| at(i)[1]);
            for block in 0..dimensions.div_ceil(4) {
                let numbers: [L; 4] = stream.uniforms(x, y, block as u32);
                for c in 0..4.min(dimensions - 4 * block) {
                    numbers[c].store(&mut self.row_mut(4 * block + c)[start..]);
                }
            }
        }
    }

    /// Fills the first `n` columns with numbers that are uniform, and spread evenly within a
    /// sequence: those of two dimensions in `pairs`, each of which has points of its own
    /// ([`sobol`]). `place` tells a column's sequence, by two counters in `stream`, and its index
    /// there. Dimensions that are not in `pairs` stay as they are.
    pub fn fill_stratified<L: Lanes>(
        &mut self,
        stream: &Stream,
        pairs: &[Pair],
        n: usize,
        place: impl Fn(usize) -> Place,
    ) {
        for start in (0..n).step_by(L::N) {
            let at = |i: usize| place((start + i).min(n - 1));
            let x = L::Uint::from_fn(|i| at(i).sequence[0]);
            let y = L::Uint::from_fn(|i| at(i).sequence[1]);
            let reversed = L::Uint::from_fn(|i| at(i).index.reverse_bits());
            for (block, pair) in pairs.iter().enumerate() {
                let [order, u, v, _] = stream.words::<L>(x, y, block as u32);
                let [u, v] = sobol::point_of_reversed::<L>(reversed, [order, u, v]);
                u.store(&mut self.row_mut(pair.first)[start..]);
                if let Some(second) = pair.second {
                    v.store(&mut self.row_mut(second)[start..]);
                }
            }
        }
    }

    /// A dimension of the paths in `list` (1 to `N` of them; missing lanes repeat the last).
    #[inline(always)]
    pub fn gather<L: Lanes>(&self, dimension: usize, list: &[u32]) -> L {
        let row = self.row(dimension);
        let last = list.len() - 1;
        L::from_fn(|i| row[list[i.min(last)] as usize])
    }

    /// Dimension `first[lane] + offset` of the paths in `list`.
    #[inline(always)]
    pub fn gather_each<L: Lanes>(&self, first: &[usize; 8], offset: usize, list: &[u32]) -> L {
        let last = list.len() - 1;
        L::from_fn(|i| {
            let i = i.min(last);
            self.data[(first[i] + offset) * self.stride + list[i] as usize]
        })
    }
}

/// Where the primary samples of a bounce are.
#[derive(Clone, Copy)]
pub(super) struct Bounce {
    /// First dimension.
    pub first: usize,
    /// Light subpaths start in different waves: dimensions a path is further for every wave since
    /// its start. 0 if all are at `first`.
    pub per_bounce: usize,
    pub wave: u32,
}

impl Bounce {
    /// All paths have theirs at `first`.
    pub fn at(first: usize) -> Self {
        Self {
            first,
            per_bounce: 0,
            wave: 0,
        }
    }

    /// The first dimension of a path; `t` are the camera vertices of all.
    #[inline(always)]
    pub fn dimension(&self, t: &[u32], path: u32) -> usize {
        if self.per_bounce == 0 {
            return self.first;
        }
        // A light subpath starts when its camera subpath has spent its `t - 1` rays.
        self.first + (self.wave + 1 - t[path as usize]) as usize * self.per_bounce
    }
}

/// The primary samples that choose among the components of mixtures.
#[derive(Clone, Copy)]
pub(super) struct ComponentSamples<'a> {
    pub samples: &'a Samples,
    /// `None` where vertices do not scatter.
    pub at: Option<Bounce>,
    /// Camera vertices of all paths.
    pub t: &'a [u32],
}

impl ComponentSamples<'_> {
    /// That of a path.
    pub fn sample(&self, path: u32) -> Option<f32> {
        let row = |at: Bounce| self.samples.row(at.dimension(self.t, path));
        self.at.map(|at| row(at)[path as usize])
    }
}

/// Which dimensions a connection reads.
#[derive(Clone, Copy)]
pub(super) struct ConnectionSamples {
    pub choice: usize,
    pub point: usize,
}
