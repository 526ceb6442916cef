//! Values on their way into a file.

use super::blocks::{BLOCK, Packed, pack};
use super::planes;
use bytemuck::{Pod, bytes_of, cast_slice};
use rayon::prelude::*;

/// Blocks that are compressed together.
const TOGETHER: usize = 32;

/// Takes values one after the other.
#[derive(Default)]
pub struct Writer {
    /// Not yet packed; no block is longer than [`BLOCK`].
    full: Vec<Vec<u8>>,
    last: Vec<u8>,
    packed: Packed,
}

impl Writer {
    /// With nothing in it.
    pub fn new() -> Self {
        Self::default()
    }

    /// A value of plain bytes.
    pub fn value<T: Pod>(&mut self, value: T) {
        self.bytes(bytes_of(&value));
    }

    /// A length.
    pub fn count(&mut self, count: usize) {
        self.value(count as u64);
    }

    /// Yes or no.
    pub fn flag(&mut self, flag: bool) {
        self.value(u8::from(flag));
    }

    /// A text.
    pub fn text(&mut self, text: &str) {
        self.table(text.as_bytes());
    }

    /// A table: its length, and its entries.
    pub fn table<T: Pod>(&mut self, entries: &[T]) {
        self.count(entries.len());
        let bytes: &[u8] = cast_slice(entries);
        match size_of::<T>() {
            0 | 1 => self.bytes(bytes),
            size => {
                // In pieces: a film is larger than the room there is.
                for piece in bytes.chunks((BLOCK / size).max(1) * size) {
                    let mut room = Vec::with_capacity(piece.len());
                    planes::part(piece, size, &mut room);
                    self.bytes(&room);
                }
            }
        }
    }

    /// Something that may be missing.
    pub fn option<T>(&mut self, value: Option<T>, save: impl FnOnce(&mut Self, T)) {
        self.flag(value.is_some());
        if let Some(value) = value {
            save(self, value);
        }
    }

    fn bytes(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let room = BLOCK - self.last.len();
            let (now, later) = bytes.split_at(bytes.len().min(room));
            self.last.extend_from_slice(now);
            bytes = later;
            if self.last.len() == BLOCK {
                self.full.push(std::mem::take(&mut self.last));
                if self.full.len() == TOGETHER {
                    self.pack();
                }
            }
        }
    }

    fn pack(&mut self) {
        let packed: Vec<Vec<u8>> = self.full.par_iter().map(|block| pack(block)).collect();
        self.packed.blocks.extend(packed.into_iter().flatten());
        self.full.clear();
    }

    /// All that has been written.
    pub fn finish(mut self) -> Packed {
        if !self.last.is_empty() {
            self.full.push(std::mem::take(&mut self.last));
        }
        self.pack();
        self.packed
    }
}
