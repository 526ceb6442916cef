//! Index lists that are filtered without branches: whether a path belongs is no better than a coin
//! toss to a branch predictor.

use std::ops::Deref;

/// Paths in a list, with room for every path of a batch.
#[derive(Clone, Debug, Default)]
pub struct List {
    data: Vec<u32>,
    len: usize,
}

impl List {
    /// Makes room for `n` entries; existing ones stay.
    pub fn reserve(&mut self, n: usize) {
        // One more: a path that does not belong is written and not counted.
        if self.data.len() < n + 1 {
            self.data.resize(n + 1, 0);
        }
    }

    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub fn push(&mut self, path: u32) {
        self.push_if(path, true);
    }

    /// # Panics
    /// If there is no room.
    #[inline(always)]
    pub fn push_if(&mut self, path: u32, belongs: bool) {
        self.data[self.len] = path;
        self.len += usize::from(belongs);
    }

    /// Appends the entries of `chunk` (at most eight) whose bit is set.
    #[inline(always)]
    pub fn push_where(&mut self, chunk: &[u32], bits: u32) {
        for (i, &path) in chunk.iter().enumerate() {
            self.push_if(path, bits >> i & 1 != 0);
        }
    }

    #[inline(always)]
    pub fn extend(&mut self, other: &[u32]) {
        self.data[self.len..self.len + other.len()].copy_from_slice(other);
        self.len += other.len();
    }
}

impl Deref for List {
    type Target = [u32];
    #[inline(always)]
    fn deref(&self) -> &[u32] {
        &self.data[..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_keep_order() {
        let mut list = List::default();
        list.reserve(8);
        list.push_where(&[3, 1, 4, 1, 5, 9, 2, 6], 0b1010_0101);
        list.push_if(7, false);
        list.push(8);
        assert_eq!(*list, [3, 4, 9, 6, 8]);
        list.extend(&[1, 2, 3]);
        assert_eq!(*list, [3, 4, 9, 6, 8, 1, 2, 3]);
        list.clear();
        assert!(list.is_empty());
    }
}
