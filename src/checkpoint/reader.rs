//! Values on their way back.

use super::blocks::{Packed, unpack};
use super::{Malformed, planes};
use bytemuck::{Pod, bytes_of_mut, cast_slice_mut};

/// Longest text.
const TEXT: usize = 1 << 16;

/// Gives values back in the order in which a [`Writer`](super::Writer) has taken them.
pub struct Reader<'a> {
    /// Blocks that have not been unpacked.
    rest: &'a [u8],
    block: Vec<u8>,
    /// Bytes of the block that have been read.
    at: usize,
}

impl<'a> Reader<'a> {
    /// From the first value on.
    pub fn new(packed: &'a Packed) -> Self {
        Self {
            rest: &packed.blocks,
            block: Vec::new(),
            at: 0,
        }
    }

    /// A value of plain bytes.
    ///
    /// # Errors
    /// There are no more.
    pub fn value<T: Pod>(&mut self) -> Result<T, Malformed> {
        let mut value = T::zeroed();
        self.fill(bytes_of_mut(&mut value))?;
        Ok(value)
    }

    /// A length of at most `most`.
    ///
    /// # Errors
    /// It is more.
    pub fn count(&mut self, most: usize) -> Result<usize, Malformed> {
        let count: u64 = self.value()?;
        usize::try_from(count)
            .ok()
            .filter(|count| *count <= most)
            .ok_or_else(|| Malformed::new(format!("{count} entries are more than {most}")))
    }

    /// Yes or no.
    ///
    /// # Errors
    /// It is neither.
    pub fn flag(&mut self) -> Result<bool, Malformed> {
        match self.value::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(Malformed::new(format!("{other} is neither yes nor no"))),
        }
    }

    /// A text.
    ///
    /// # Errors
    /// It is too long, or no UTF-8.
    pub fn text(&mut self) -> Result<String, Malformed> {
        let bytes = self.list(TEXT)?;
        String::from_utf8(bytes).map_err(|_| Malformed::new("a text is not UTF-8"))
    }

    /// A table of at most so many entries.
    ///
    /// # Errors
    /// It has more.
    pub fn list<T: Pod>(&mut self, most: usize) -> Result<Vec<T>, Malformed> {
        let count = self.count(most)?;
        let mut entries = vec![T::zeroed(); count];
        self.entries(&mut entries)?;
        Ok(entries)
    }

    /// A table of as many entries as there is room for.
    ///
    /// # Errors
    /// It has another number.
    pub fn table<T: Pod>(&mut self, to: &mut [T]) -> Result<(), Malformed> {
        let count: u64 = self.value()?;
        if count != to.len() as u64 {
            let wanted = to.len();
            return Err(Malformed::new(format!(
                "a table has {count} entries and not {wanted}"
            )));
        }
        self.entries(to)
    }

    /// A table of so many entries.
    ///
    /// # Errors
    /// It has another number.
    pub fn vector<T: Pod>(&mut self, count: usize) -> Result<Vec<T>, Malformed> {
        let mut entries = vec![T::zeroed(); count];
        self.table(&mut entries)?;
        Ok(entries)
    }

    /// Something that may be missing.
    ///
    /// # Errors
    /// Those of `load`.
    pub fn option<T>(
        &mut self,
        load: impl FnOnce(&mut Self) -> Result<T, Malformed>,
    ) -> Result<Option<T>, Malformed> {
        match self.flag()? {
            true => load(self).map(Some),
            false => Ok(None),
        }
    }

    /// That was all.
    ///
    /// # Errors
    /// There is more.
    pub fn end(&self) -> Result<(), Malformed> {
        let done = self.rest.is_empty() && self.at == self.block.len();
        Malformed::unless(done, "it is longer than expected")
    }

    fn entries<T: Pod>(&mut self, to: &mut [T]) -> Result<(), Malformed> {
        let size = size_of::<T>();
        let bytes: &mut [u8] = cast_slice_mut(to);
        match size {
            0 | 1 => self.fill(bytes),
            size => bytes
                .chunks_mut((super::blocks::BLOCK / size).max(1) * size)
                .try_for_each(|piece| {
                    self.fill(piece)?;
                    planes::join(piece, size);
                    Ok(())
                }),
        }
    }

    fn fill(&mut self, mut to: &mut [u8]) -> Result<(), Malformed> {
        while !to.is_empty() {
            if self.at == self.block.len() {
                self.at = 0;
                let rest = unpack(self.rest, &mut self.block);
                self.rest = rest.ok_or_else(|| Malformed::new("it ends too early"))?;
            }
            let n = to.len().min(self.block.len() - self.at);
            let (now, later) = std::mem::take(&mut to).split_at_mut(n);
            now.copy_from_slice(&self.block[self.at..self.at + n]);
            self.at += n;
            to = later;
        }
        Ok(())
    }
}
