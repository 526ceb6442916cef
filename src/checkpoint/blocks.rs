//! Bytes in compressed blocks, each with a checksum.
//!
//! A block is: its length before compression, its length after it, a checksum of both and of what
//! follows (`u32` each, little endian), and the compressed bytes.

use super::CheckpointError;
use flate2::{Compress, Compression, Crc, Decompress, FlushCompress, FlushDecompress, Status};

/// Bytes of a block before compression, at most.
pub(super) const BLOCK: usize = 1 << 20;
/// Bytes before the compressed ones.
pub(super) const HEAD: usize = 12;
/// Bytes that a block can take where nothing can be compressed.
pub(super) const MOST: usize = BLOCK + BLOCK / 64 + 64;

/// Blocks in a row: what a [`Writer`](super::Writer) has written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packed {
    pub(super) blocks: Vec<u8>,
}

impl Packed {
    /// Bytes that it takes.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// All of it, to be sent somewhere.
    pub fn into_bytes(self) -> Vec<u8> {
        self.blocks
    }

    /// What [`Self::into_bytes`] has given. Checksums are for files: they are not looked at.
    pub fn from_bytes(blocks: Vec<u8>) -> Self {
        Self { blocks }
    }

    /// Whether nothing has been written.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }
}

/// Compresses some bytes, at most [`BLOCK`].
pub(super) fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut block = Vec::with_capacity(HEAD + MOST);
    block.resize(HEAD, 0);
    // The room suffices for all bytes there are, so that there is one step and no failure.
    let mut deflate = Compress::new(Compression::fast(), false);
    let _ = deflate.compress_vec(bytes, &mut block, FlushCompress::Finish);
    let lengths = [bytes.len() as u32, (block.len() - HEAD) as u32].map(u32::to_le_bytes);
    block[..8].copy_from_slice(lengths.as_flattened());
    let checksum = checksum(&block);
    block[8..HEAD].copy_from_slice(&checksum.to_le_bytes());
    block
}

/// Of a block, without the checksum in it.
fn checksum(block: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(&block[..8]);
    crc.update(&block[HEAD..]);
    crc.sum()
}

/// The number at byte `at` of the head of a block.
fn number(head: &[u8], at: usize) -> usize {
    let bytes = [head[at], head[at + 1], head[at + 2], head[at + 3]];
    u32::from_le_bytes(bytes) as usize
}

/// The length of the first block of some, from its head of [`HEAD`] bytes.
pub(super) fn length(head: &[u8]) -> Result<usize, CheckpointError> {
    let (raw, packed) = (number(head, 0), number(head, 4));
    if raw > BLOCK || packed > MOST {
        return Err(CheckpointError::Damaged("a block is too long"));
    }
    Ok(HEAD + packed)
}

/// Whether a block is as it was written.
pub(super) fn check(block: &[u8]) -> Result<(), CheckpointError> {
    match checksum(block) as usize == number(block, 8) {
        true => Ok(()),
        false => Err(CheckpointError::Damaged("a checksum is wrong")),
    }
}

/// The first block of some that have been checked is decompressed into `to`; the others remain.
pub(super) fn unpack<'a>(blocks: &'a [u8], to: &mut Vec<u8>) -> Option<&'a [u8]> {
    let head = blocks.get(..HEAD)?;
    let (block, rest) = blocks.split_at_checked(length(head).ok()?)?;
    let raw = number(head, 0);
    to.clear();
    to.reserve_exact(raw);
    let mut inflate = Decompress::new(false);
    let status = inflate.decompress_vec(&block[HEAD..], to, FlushDecompress::Finish);
    let whole = matches!(status, Ok(Status::StreamEnd)) && to.len() == raw;
    whole.then_some(rest)
}
