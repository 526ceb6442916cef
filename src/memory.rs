//! Large tables in huge pages, where the system has them; sizes of memory for people.
//!
//! A ray through a large scene touches some fifty cache lines in as many pages of 4 KiB, and a
//! splat falls anywhere in a film: far more pages than the address translation can remember. Pages
//! of 2 MiB spare it most of the misses. Linux gives them to memory that asks (`madvise`, in its
//! default setting), which no allocator does by itself.

use bytemuck::Pod;
use std::fmt;

/// A size that displays as `12.3 MiB`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const PREFIXES: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
        let mut scaled = self.0 as f64;
        let mut prefix = 0;
        while scaled >= 1000.0 && prefix + 1 < PREFIXES.len() {
            scaled /= 1024.0;
            prefix += 1;
        }
        let decimals = if prefix == 0 { 0 } else { 1 };
        write!(f, "{scaled:.decimals$} {}", PREFIXES[prefix])
    }
}

/// A table of fixed length.
pub struct Table<T> {
    memory: Memory<T>,
    len: usize,
}

enum Memory<T> {
    Own(Vec<T>),
    /// And the byte where the entries start.
    #[cfg(target_os = "linux")]
    Huge(memmap2::MmapMut, usize),
}

/// Bytes of a huge page.
#[cfg(target_os = "linux")]
const PAGE: usize = 2 << 20;

impl<T: Pod> Table<T> {
    pub fn new(entries: Vec<T>) -> Self {
        #[cfg(target_os = "linux")]
        if let Some(mut table) = Self::huge(entries.len()) {
            table.entries_mut().copy_from_slice(&entries);
            return table;
        }
        Self {
            len: entries.len(),
            memory: Memory::Own(entries),
        }
    }

    /// `len` entries of zero bytes.
    pub fn zeroed(len: usize) -> Self {
        #[cfg(target_os = "linux")]
        if let Some(table) = Self::huge(len) {
            return table;
        }
        Self {
            memory: Memory::Own(vec![T::zeroed(); len]),
            len,
        }
    }

    /// Memory of a table of so many entries, in bytes.
    pub fn bytes(entries: u64) -> u64 {
        let bytes = entries.saturating_mul(size_of::<T>() as u64);
        #[cfg(target_os = "linux")]
        if bytes > PAGE as u64 / 2 {
            return bytes.next_multiple_of(PAGE as u64);
        }
        bytes
    }

    /// Zeros; `None` if huge pages would be mostly empty, or the system has no memory to map.
    #[cfg(target_os = "linux")]
    fn huge(len: usize) -> Option<Self> {
        let bytes = len.checked_mul(size_of::<T>())?;
        if bytes <= PAGE / 2 {
            return None;
        }
        // Aligned to pages; what lies before the start is never touched, and takes no memory.
        let map = memmap2::MmapMut::map_anon(bytes.next_multiple_of(PAGE) + PAGE).ok()?;
        // Systems without huge pages refuse, which is no reason to refuse.
        let _ = map.advise(memmap2::Advice::HugePage);
        let start = map.as_ptr().align_offset(PAGE);
        Some(Self {
            memory: Memory::Huge(map, start),
            len,
        })
    }

    /// To be asked for once per batch of rays or splats: it looks where the table is.
    #[inline(always)]
    pub fn entries(&self) -> &[T] {
        match &self.memory {
            Memory::Own(entries) => entries,
            #[cfg(target_os = "linux")]
            Memory::Huge(map, start) => {
                bytemuck::cast_slice(&map[*start..][..self.len * size_of::<T>()])
            }
        }
    }

    #[inline(always)]
    pub fn entries_mut(&mut self) -> &mut [T] {
        match &mut self.memory {
            Memory::Own(entries) => entries,
            #[cfg(target_os = "linux")]
            Memory::Huge(map, start) => {
                bytemuck::cast_slice_mut(&mut map[*start..][..self.len * size_of::<T>()])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(Bytes(999).to_string(), "999 B");
        assert_eq!(Bytes(1536).to_string(), "1.5 KiB");
        assert_eq!(Bytes(3 << 30).to_string(), "3.0 GiB");
        assert_eq!(Bytes(u64::MAX).to_string(), "16777216.0 TiB");
    }

    #[test]
    fn tables_keep_their_entries_wherever_they_are() {
        for count in [0, 1, 1000, 300_000, 3 << 20] {
            let entries: Vec<u32> = (0..count).map(|i| i ^ 0x5555).collect();
            assert!(Table::new(entries.clone()).entries() == entries);
            let mut zeros = Table::<u32>::zeroed(count as usize);
            assert!(zeros.entries().len() == entries.len());
            assert!(zeros.entries().iter().all(|v| *v == 0));
            zeros.entries_mut().copy_from_slice(&entries);
            assert!(zeros.entries() == entries);
        }
    }
}
