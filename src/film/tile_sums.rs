//! What samples come to tile by tile and group by group of passes.

use super::sum::{Sum, Sums};
use super::{FilterTable, GROUPS, Tiling};
use crate::checkpoint::{Malformed, Reader, Writer};
use std::sync::{Mutex, MutexGuard};

/// Sums of the mean channel over the pixels of each tile, by group: pass modulo [`GROUPS`].
pub(super) struct TileSums {
    tiling: Tiling,
    /// Samples have their weights summed too.
    weighed: bool,
    /// `[row of tiles]`, each `[column][group]`. Empty: nothing is summed.
    rows: Vec<Mutex<Vec<[Entry; GROUPS]>>>,
}

/// Light, and the weights of the samples that brought it.
#[derive(Clone, Copy, Default, PartialEq)]
struct Entry {
    light: Sum,
    weight: Sum,
}

impl Entry {
    /// How many of its sums were full.
    fn merge(&mut self, other: Entry) -> u64 {
        u64::from(self.light.merge(other.light)) + u64::from(self.weight.merge(other.weight))
    }
}

/// A tile's row and column, and a group.
type Place = (usize, usize, usize);

/// What is not yet handed over: samples that follow each other mostly lie in one tile.
pub(super) struct Pending<'a> {
    sums: &'a TileSums,
    at: Place,
    entry: Entry,
    full: u64,
}

impl TileSums {
    pub fn new(tiling: Tiling, judged: bool, weighed: bool) -> Self {
        let row = || Mutex::new(vec![[Entry::default(); GROUPS]; tiling.columns]);
        Self {
            rows: (0..if judged { tiling.rows } else { 0 })
                .map(|_| row())
                .collect(),
            tiling,
            weighed,
        }
    }

    pub fn tiling(&self) -> &Tiling {
        &self.tiling
    }

    pub fn pending(&self) -> Pending<'_> {
        Pending {
            sums: self,
            at: (0, 0, 0),
            entry: Entry::default(),
            full: 0,
        }
    }

    /// Sums of light in each tile, as if every sample weighed 1 in the mean.
    pub fn light(&self) -> Vec<[f64; GROUPS]> {
        self.all(|entry| entry.light.value())
    }

    /// Sums of weights, if there are any.
    pub fn weights(&self) -> Option<Vec<[f64; GROUPS]>> {
        self.weighed.then(|| self.all(|entry| entry.weight.value()))
    }

    /// Writes all sums.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            tiling: _,
            weighed: _,
            rows,
        } = self;
        for row in rows {
            let row = lock(row);
            let mut sums = Sums::new(GROUPS * row.len(), 2);
            for (i, entry) in row.as_flattened().iter().enumerate() {
                let Entry { light, weight } = *entry;
                sums.set(i, 0, light);
                sums.set(i, 1, weight);
            }
            sums.save(to);
        }
    }

    /// Adds the sums of others like these; how many are full.
    pub fn absorb(&self, other: &Self) -> u64 {
        let mut full = 0;
        for (to, from) in self.rows.iter().zip(&other.rows) {
            let (mut to, from) = (lock(to), lock(from));
            let entries = to.as_flattened_mut().iter_mut();
            for (to, from) in entries.zip(from.as_flattened()) {
                full += to.merge(*from);
            }
        }
        full
    }

    /// Reads all sums.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        for row in &self.rows {
            let mut row = lock(row);
            let mut sums = Sums::new(GROUPS * row.len(), 2);
            sums.load(from)?;
            for (i, entry) in row.as_flattened_mut().iter_mut().enumerate() {
                *entry = Entry {
                    light: sums.get(i, 0),
                    weight: sums.get(i, 1),
                };
            }
        }
        Ok(())
    }

    fn all(&self, value: impl Fn(&Entry) -> f64) -> Vec<[f64; GROUPS]> {
        let mut sums = Vec::with_capacity(self.tiling.len());
        for row in &self.rows {
            sums.extend(lock(row).iter().map(|tile| tile.each_ref().map(&value)));
        }
        sums
    }
}

impl Pending<'_> {
    /// Adds a sample, in every tile with what it weighs in all of its pixels, times `dense`.
    #[inline]
    pub fn add(
        &mut self,
        filter: &FilterTable,
        raster: [f32; 2],
        light: f64,
        pass: u64,
        dense: f64,
    ) {
        let sums = self.sums;
        let group = pass as usize % GROUPS;
        if sums.rows.is_empty() {
        } else if !filter.is_single() {
            filter.by_tile(raster, |[column, row], w| {
                self.put((row, column, group), light, w * dense);
            });
        } else if filter.contains(raster) {
            let [column, row] = sums.tiling.at(raster);
            self.put((row, column, group), light, 1.0);
        }
    }

    #[inline]
    fn put(&mut self, place: Place, light: f64, weight: f64) {
        if place != self.at {
            self.hand_over();
            self.at = place;
        }
        self.full += u64::from(self.entry.light.add(light * weight));
        if self.sums.weighed {
            self.full += u64::from(self.entry.weight.add(weight));
        }
    }

    fn hand_over(&mut self) {
        let entry = std::mem::take(&mut self.entry);
        if entry != Entry::default() {
            let (row, column, group) = self.at;
            self.full += lock(&self.sums.rows[row])[column][group].merge(entry);
        }
    }

    /// Hands over what is left; how many sums were full.
    pub fn end(mut self) -> u64 {
        self.hand_over();
        self.full
    }
}

/// A thread that panicked while adding integers has left them whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}
