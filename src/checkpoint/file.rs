//! A head and a state in a file.
//!
//! ```text
//! "PHALANX\n"  format  version of the program  length of the head  length of the state  checksum
//!     8          4     length (1), then 31           8                     8                4
//! blocks of the head
//! blocks of the state
//! ```
//!
//! Numbers are little endian, and so are those in blocks: on other machines [`FORMAT`] reads as
//! another format.

use super::blocks::{HEAD, Packed, check, length};
use super::{CheckpointError, FORMAT};
use crate::files::Replacement;
use flate2::Crc;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::Path;

const MAGIC: &[u8; 8] = b"PHALANX\n";
/// Bytes of the version, padded, and of all before the blocks.
const VERSION: usize = 31;
const START: usize = 8 + 4 + 1 + VERSION + 8 + 8 + 4;
/// A head has names and settings.
const MOST: u64 = 64 << 20;

/// Of the program that writes.
const OWN: &str = env!("CARGO_PKG_VERSION");

fn start(head: &Packed, state: &Packed) -> Vec<u8> {
    let version = &OWN.as_bytes()[..OWN.len().min(VERSION)];
    let mut start = Vec::with_capacity(START);
    start.extend_from_slice(MAGIC);
    start.extend_from_slice(&FORMAT.to_ne_bytes());
    start.push(version.len() as u8);
    start.extend_from_slice(version);
    start.resize(8 + 4 + 1 + VERSION, 0);
    for packed in [head, state] {
        start.extend_from_slice(&(packed.len() as u64).to_le_bytes());
    }
    let mut crc = Crc::new();
    crc.update(&start);
    start.extend_from_slice(&crc.sum().to_le_bytes());
    start
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// The system says no; what was there before is still there.
pub fn write(path: &Path, head: &Packed, state: &Packed) -> io::Result<()> {
    let mut file = Replacement::of(path)?;
    file.write_all(&start(head, state))?;
    file.write_all(&head.blocks)?;
    file.write_all(&state.blocks)?;
    file.finish()
}

/// Reads the head and, if it is wanted, the state; every byte of the file is checked. Memory grows
/// with what has been checked only.
///
/// # Errors
/// It is no checkpoint, one of another version, or damaged.
pub fn read(path: &Path, state: bool) -> Result<(Packed, Packed), CheckpointError> {
    let file = File::open(path)?;
    if !file.metadata()?.is_file() {
        return Err(CheckpointError::Foreign);
    }
    read_from(&mut BufReader::with_capacity(1 << 20, file), state)
}

/// The same from what has been opened.
pub(super) fn read_from(
    from: &mut dyn Read,
    state: bool,
) -> Result<(Packed, Packed), CheckpointError> {
    let mut start = [0; START];
    let mut magic = [0; MAGIC.len()];
    let whole = from.read_exact(&mut magic).is_ok() && magic == *MAGIC;
    if !whole {
        return Err(CheckpointError::Foreign);
    }
    start[..MAGIC.len()].copy_from_slice(&magic);
    exact(from, &mut start[MAGIC.len()..])?;
    let (told, sum) = start.split_at(START - 4);
    let mut crc = Crc::new();
    crc.update(told);
    if crc.sum().to_le_bytes() != *sum {
        return Err(CheckpointError::Damaged("a checksum is wrong"));
    }
    check_version(told)?;
    let number = |at: usize| {
        told[at..]
            .first_chunk()
            .map_or(0, |b| u64::from_le_bytes(*b))
    };
    let (head, rest) = (number(START - 20), number(START - 12));
    if head > MOST {
        return Err(CheckpointError::Damaged("its head is too long"));
    }
    let head = blocks(from, head, true)?;
    let state = blocks(from, rest, state)?;
    match from.read(&mut [0]) {
        Ok(0) => Ok((head, state)),
        Ok(_) => Err(CheckpointError::Damaged("it is longer than it should be")),
        Err(e) => Err(e.into()),
    }
}

fn check_version(start: &[u8]) -> Result<(), CheckpointError> {
    let format = start[8..]
        .first_chunk()
        .map_or(0, |b| u32::from_ne_bytes(*b));
    let len = usize::from(start[12]).min(VERSION);
    let version = String::from_utf8_lossy(&start[13..13 + len]);
    if format == FORMAT && version == OWN {
        return Ok(());
    }
    let name = |version: &str, format| match format == FORMAT {
        true => format!("Phalanx {version}"),
        false => format!("Phalanx {version} (format {format})"),
    };
    let this = match format == FORMAT {
        true => format!("Phalanx {OWN}"),
        false => format!("Phalanx {OWN} (format {FORMAT})"),
    };
    Err(CheckpointError::Version {
        by: name(&version, format),
        this,
    })
}

fn exact(from: &mut dyn Read, to: &mut [u8]) -> Result<(), CheckpointError> {
    from.read_exact(to).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => CheckpointError::Damaged("it ends too early"),
        _ => e.into(),
    })
}

/// Blocks of so many bytes in all, checked, and kept if they are wanted.
fn blocks(from: &mut dyn Read, bytes: u64, keep: bool) -> Result<Packed, CheckpointError> {
    let mut packed = Packed::default();
    let mut block = Vec::new();
    let mut left = bytes;
    while left > 0 {
        block.clear();
        block.resize(HEAD, 0);
        exact(from, &mut block)?;
        let len = length(&block)?;
        left = (left.checked_sub(len as u64))
            .ok_or(CheckpointError::Damaged("a block is too long"))?;
        block.resize(len, 0);
        exact(from, &mut block[HEAD..])?;
        check(&block)?;
        if keep {
            packed.blocks.extend_from_slice(&block);
        }
    }
    Ok(packed)
}
