//! Tables byte by byte: first the lowest byte of every entry, then the next.

/// Bytes that are laid out anew at a time.
const SPAN: usize = 1 << 16;

/// Appends `bytes`, entries of `size` bytes each, to `to`, laid out by byte.
pub(super) fn part(bytes: &[u8], size: usize, to: &mut Vec<u8>) {
    for span in bytes.chunks(span(size)) {
        for byte in 0..size {
            to.extend(span.iter().skip(byte).step_by(size));
        }
    }
}

/// Entries of `size` bytes each, as they were before [`part`].
pub(super) fn join(bytes: &mut [u8], size: usize) {
    let mut room = Vec::new();
    for span in bytes.chunks_mut(span(size)) {
        room.clear();
        room.extend_from_slice(span);
        let count = span.len() / size;
        for (byte, plane) in room.chunks(count.max(1)).enumerate() {
            for (to, from) in span.iter_mut().skip(byte).step_by(size).zip(plane) {
                *to = *from;
            }
        }
    }
}

fn span(size: usize) -> usize {
    (SPAN / size).max(1) * size
}
