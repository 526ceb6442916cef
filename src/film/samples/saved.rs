//! Sums of samples, written, read and added up.

use super::{SampleFilm, Sums, lock};
use crate::checkpoint::{Malformed, Reader, Writer};
use std::sync::Mutex;
use std::sync::atomic::Ordering::Relaxed;

impl SampleFilm {
    /// Writes all that it holds.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            filter: _,
            weighing: _,
            entries: _,
            halves,
            inside,
            tiles,
            lit,
            full,
        } = self;
        for block in halves.iter().flatten().chain(inside) {
            lock(block).save(to);
        }
        tiles.save(to);
        to.flag(lit.load(Relaxed));
        to.value(full.load(Relaxed));
    }

    /// Reads all that a film like this one held.
    ///
    /// # Errors
    /// It was another.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), Malformed> {
        for block in self.blocks() {
            lock(block).load(from)?;
        }
        self.tiles.load(from)?;
        *self.lit.get_mut() = from.flag()?;
        *self.full.get_mut() = from.value()?;
        Ok(())
    }

    fn blocks(&self) -> impl Iterator<Item = &Mutex<Sums>> {
        self.halves.iter().flatten().chain(&self.inside)
    }

    /// Adds all that a film like this one holds: the same bits in any order.
    pub fn absorb(&self, other: &Self) {
        let mut full = other.full.load(Relaxed);
        for (to, from) in self.blocks().zip(other.blocks()) {
            full += lock(to).absorb(&lock(from));
        }
        full += self.tiles.absorb(&other.tiles);
        self.full.fetch_add(full, Relaxed);
        self.lit.fetch_or(other.lit.load(Relaxed), Relaxed);
    }
}
