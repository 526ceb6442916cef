//! Zeroed memory for sums that are hit all over the place, in huge pages where the system has them: a splat then costs a cache miss
//! and not an address translation as well.

/// Integers, all 0 at first.
pub(super) struct Zeros {
    memory: Memory,
    len: usize,
}

enum Memory {
    Own(Vec<i64>),
    /// And the byte where the integers start.
    #[cfg(target_os = "linux")]
    Huge(memmap2::MmapMut, usize),
}

/// Bytes of a huge page.
#[cfg(target_os = "linux")]
const PAGE: usize = 2 << 20;

impl Zeros {
    pub fn new(len: usize) -> Self {
        #[cfg(target_os = "linux")]
        if len * size_of::<i64>() > PAGE / 2
            && let Some(memory) = huge(len)
        {
            return Self { memory, len };
        }
        Self {
            memory: Memory::Own(vec![0; len]),
            len,
        }
    }

    #[inline(always)]
    pub fn get(&self) -> &[i64] {
        match &self.memory {
            Memory::Own(v) => v,
            #[cfg(target_os = "linux")]
            Memory::Huge(map, start) => {
                bytemuck::cast_slice(&map[*start..][..self.len * size_of::<i64>()])
            }
        }
    }

    #[inline(always)]
    pub fn get_mut(&mut self) -> &mut [i64] {
        match &mut self.memory {
            Memory::Own(v) => v,
            #[cfg(target_os = "linux")]
            Memory::Huge(map, start) => {
                bytemuck::cast_slice_mut(&mut map[*start..][..self.len * size_of::<i64>()])
            }
        }
    }
}

/// Aligned to huge pages; `None` if the system has no memory left. Bytes before the start are never touched, so they take none.
#[cfg(target_os = "linux")]
fn huge(len: usize) -> Option<Memory> {
    let bytes = (len * size_of::<i64>()).next_multiple_of(PAGE);
    let map = memmap2::MmapMut::map_anon(bytes + PAGE).ok()?;
    // Systems without huge pages refuse, which is no reason to refuse.
    let _ = map.advise(memmap2::Advice::HugePage);
    let start = map.as_ptr().align_offset(PAGE);
    Some(Memory::Huge(map, start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_keep_what_is_written() {
        for len in [0, 1, 1000, 200_000, 1 << 20] {
            let mut zeros = Zeros::new(len);
            assert_eq!(zeros.get().len(), len);
            assert!(zeros.get().iter().all(|v| *v == 0));
            for (i, v) in zeros.get_mut().iter_mut().enumerate() {
                *v = i as i64;
            }
            assert!(zeros.get().iter().enumerate().all(|(i, v)| *v == i as i64));
        }
    }
}
