//! Sums of samples, written, read and added up.

use super::{SampleFilm, Sums, lock};
use crate::checkpoint::{Malformed, Packed, Reader, Writer};
use rayon::prelude::*;
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

    /// Gives all that it holds away, in packed pieces, and begins anew from nothing.
    pub fn hand_over(&self) -> Vec<Vec<u8>> {
        let give = |block: &Mutex<Sums>| {
            let mut block = lock(block);
            if block.is_empty() {
                return Vec::new();
            }
            let mut to = Writer::new();
            block.save(&mut to);
            *block = block.empty();
            to.finish().into_bytes()
        };
        let blocks: Vec<&Mutex<Sums>> = self.blocks().collect();
        let mut pieces: Vec<Vec<u8>> = blocks.into_par_iter().map(give).collect();
        let mut to = Writer::new();
        self.tiles.hand_over(&mut to);
        to.flag(self.lit.swap(false, Relaxed));
        to.value(self.full.swap(0, Relaxed));
        pieces.push(to.finish().into_bytes());
        pieces
    }

    /// How many pieces it hands over.
    pub fn pieces(&self) -> usize {
        self.blocks().count() + 1
    }

    /// Adds what a film like this one has handed over.
    ///
    /// # Errors
    /// It was another.
    pub fn take(&self, mut pieces: Vec<Vec<u8>>) -> Result<(), Malformed> {
        let all = pieces.len() == self.pieces();
        Malformed::unless(all, "a film has other blocks")?;
        let rest = Packed::from_bytes(pieces.pop().unwrap_or_default());
        let take = |(block, piece): (&Mutex<Sums>, Vec<u8>)| {
            if piece.is_empty() {
                return Ok(0);
            }
            let mut block = lock(block);
            let mut more = block.empty();
            more.load(&mut Reader::new(&Packed::from_bytes(piece)))?;
            Ok(block.absorb(&more))
        };
        let blocks: Vec<&Mutex<Sums>> = self.blocks().collect();
        let blocks = blocks.into_par_iter().zip(pieces).map(take);
        let mut full = blocks.try_reduce(|| 0, |a, b| Ok(a + b))?;
        let mut from = Reader::new(&rest);
        full += self.tiles.take(&mut from)?;
        self.lit.fetch_or(from.flag()?, Relaxed);
        full += from.value::<u64>()?;
        self.full.fetch_add(full, Relaxed);
        from.end()
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
