//! Where splats are summed: layers of 64-bit pixels in stripes, each under a lock of its own.

use crate::checkpoint::{Malformed, Packed, Reader, Writer};
use crate::memory::Table;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard};

/// The layers of a film.
pub(super) struct Stripes {
    /// `[layer][stripe]`, each `[pixel][channel]`.
    tables: Vec<Mutex<Table<i64>>>,
    /// Pixels of a stripe, a power of two.
    pixels: usize,
    per_layer: usize,
}

impl Stripes {
    /// Layers of so many pixels, all zero.
    pub fn new(pixels: usize, layers: usize) -> Self {
        let stripe = stripe(pixels);
        let tables = (0..layers)
            .flat_map(|_| (0..pixels).step_by(stripe))
            .map(|first| Mutex::new(Table::zeroed(3 * stripe.min(pixels - first))))
            .collect();
        Self {
            tables,
            pixels: stripe,
            per_layer: pixels.div_ceil(stripe),
        }
    }

    /// Pixels of a stripe, a power of two; the last one of a layer may have fewer.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// The largest of all sums, without its sign.
    pub fn largest(&self) -> f64 {
        let of = |table: &Mutex<Table<i64>>| {
            let table = held(table);
            let sums = table.entries().iter();
            sums.map(|sum| sum.unsigned_abs()).max().unwrap_or(0)
        };
        self.tables.iter().map(of).max().unwrap_or(0) as f64
    }

    /// Writes all sums.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            tables,
            pixels: _,
            per_layer: _,
        } = self;
        for table in tables {
            to.table(held(table).entries());
        }
    }

    /// Gives all sums away, stripe by stripe, packed, and begins anew from zero.
    pub fn hand_over(&self) -> Vec<Vec<u8>> {
        let give = |table: &Mutex<Table<i64>>| {
            let mut table = held(table);
            if table.entries().iter().all(|sum| *sum == 0) {
                return Vec::new();
            }
            let mut to = Writer::new();
            to.table(table.entries());
            table.entries_mut().fill(0);
            to.finish().into_bytes()
        };
        self.tables.par_iter().map(give).collect()
    }

    /// Adds what others like these have handed over.
    pub fn take(&self, stripes: Vec<Vec<u8>>) -> Result<(), Malformed> {
        let all = stripes.len() == self.tables.len();
        Malformed::unless(all, "a film has other stripes")?;
        let take = |(table, stripe): (&Mutex<Table<i64>>, Vec<u8>)| {
            if stripe.is_empty() {
                return Ok(());
            }
            let mut table = held(table);
            let mut more = vec![0; table.entries().len()];
            Reader::new(&Packed::from_bytes(stripe)).table(&mut more)?;
            let sums = table.entries_mut().iter_mut().zip(&more);
            sums.for_each(|(to, from)| *to = to.wrapping_add(*from));
            Ok(())
        };
        self.tables.par_iter().zip(stripes).try_for_each(take)
    }

    /// Adds the sums of others like these.
    pub fn absorb(&mut self, other: &mut Self) {
        for (to, from) in self.tables.iter_mut().zip(&mut other.tables) {
            let (to, from) = (own(to), own(from));
            let sums = to.entries_mut().iter_mut().zip(from.entries());
            sums.for_each(|(to, from)| *to = to.wrapping_add(*from));
        }
    }

    /// Reads all sums.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        for table in &mut self.tables {
            from.table(own(table).entries_mut())?;
        }
        Ok(())
    }

    pub fn lock(&self, layer: usize, stripe: usize) -> MutexGuard<'_, Table<i64>> {
        held(&self.tables[layer * self.per_layer + stripe])
    }
}

/// A thread that panicked while adding integers has left them whole.
fn held(table: &Mutex<Table<i64>>) -> MutexGuard<'_, Table<i64>> {
    (table.lock()).unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The same of what nobody else holds.
fn own(table: &mut Mutex<Table<i64>>) -> &mut Table<i64> {
    (table.get_mut()).unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Memory of so many layers, in bytes.
pub(super) fn bytes(pixels: u64, layers: u64) -> u64 {
    let stripe = stripe(pixels as usize) as u64;
    let table = |pixels: u64| Table::<i64>::bytes(3 * pixels);
    layers * (pixels / stripe * table(stripe) + table(pixels % stripe))
}

/// Pixels of a stripe: some stripes a layer, so that threads that hand in logs at the same time
/// rarely meet, but each of a huge page, or of three in large films, which they fill.
fn stripe(pixels: usize) -> usize {
    const LARGE: usize = 1 << 18;
    if pixels >= 4 * LARGE {
        return LARGE;
    }
    pixels.next_power_of_two().min(65_536)
}
