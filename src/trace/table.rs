//! Tables that rays read all over the place, in huge pages where the system has them.
//!
//! A ray through a large scene touches some fifty cache lines in as many pages of 4 KiB, far more than the address
//! translation can remember; pages of 2 MiB spare it most of the misses. Linux gives them to memory that asks
//! (`madvise`, in its default setting), which no allocator does by itself.

use bytemuck::Pod;

/// An immutable table.
pub struct Table<T>(Memory<T>);

enum Memory<T> {
    Own(Vec<T>),
    #[cfg(target_os = "linux")]
    Huge(memmap2::MmapMut, usize),
}

/// Below this size huge pages would be mostly empty.
#[cfg(target_os = "linux")]
const WORTHWHILE: usize = 4 << 20;

impl<T: Pod> Table<T> {
    pub fn new(entries: Vec<T>) -> Self {
        #[cfg(target_os = "linux")]
        if size_of_val(&entries[..]) >= WORTHWHILE
            && let Some(table) = Self::huge(&entries)
        {
            return table;
        }
        Self(Memory::Own(entries))
    }

    /// A copy in memory of its own; `None` if the system has none left.
    #[cfg(target_os = "linux")]
    fn huge(entries: &[T]) -> Option<Self> {
        let mut map = memmap2::MmapMut::map_anon(size_of_val(entries)).ok()?;
        // Systems without huge pages refuse, which is no reason to refuse.
        let _ = map.advise(memmap2::Advice::HugePage);
        bytemuck::cast_slice_mut(&mut map[..]).copy_from_slice(entries);
        Some(Self(Memory::Huge(map, entries.len())))
    }

    /// To be asked for once per batch of rays: it looks where the table is.
    pub fn entries(&self) -> &[T] {
        match &self.0 {
            Memory::Own(entries) => entries,
            #[cfg(target_os = "linux")]
            Memory::Huge(map, len) => &bytemuck::cast_slice(&map[..])[..*len],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_keep_their_entries_wherever_they_are() {
        for count in [0, 1, 1000, 3 << 20] {
            let entries: Vec<u32> = (0..count).map(|i| i ^ 0x5555).collect();
            assert!(Table::new(entries.clone()).entries() == entries);
        }
        #[cfg(target_os = "linux")]
        assert!(Table::huge(&[1u64, 2, 3]).is_none_or(|t| t.entries() == [1, 2, 3]));
    }
}
