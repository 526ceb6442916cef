//! Where a grid is in a file, and its bytes without their compression.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use flate2::read::ZlibDecoder;

use super::blosc;
use super::bytes::{GRID_HEADER, Room, u16_at, u32_at, u64_at};

/// `NanoVDB` without its last letter: 0 of files and grids before version 32.6, then 1 of grids and
/// 2 of files.
const MAGIC: &[u8; 7] = b"NanoVDB";
/// The only version of the format that is in use.
const MAJOR: u32 = 32;
const FILE_HEADER: u64 = 16;
const META: u64 = 176;
const MOST_NAME: u32 = 1 << 16;
/// Bytes that one compressed byte can stand for, by deflate and by LZ4.
const DEFLATE_RATIO: u64 = 1032;
const LZ4_RATIO: u64 = 256;

/// How the grids of a segment are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Codec {
    Stored,
    Zlib,
    Blosc,
}

/// The grid of this name, if the file has it.
pub fn find(
    file: &mut File,
    length: u64,
    name: &str,
    room: Room,
) -> Result<Option<Vec<u8>>, String> {
    let mut at = 0;
    while at < length {
        let head = read(file, at, FILE_HEADER, length)?;
        if !head.starts_with(MAGIC) {
            return Err("it is no NanoVDB file".into());
        }
        let version = u32_at(&head, 8)?;
        // Grids without anything around them: there a checksum follows.
        if head[7] == b'1'
            || (head[7] == b'0' && version >> 21 != MAJOR && is_raw(file, at, length))
        {
            return find_raw(file, (at, length), name, room);
        }
        check_version(version)?;
        let (count, codec) = (u16_at(&head, 12)?, codec(u16_at(&head, 14)?)?);
        let mut grids = Vec::new();
        at += FILE_HEADER;
        for _ in 0..count {
            let meta = read(file, at, META, length)?;
            let letters = u32_at(&meta, 136)?;
            if letters > MOST_NAME {
                return Err(format!("the name of a grid has {letters} letters"));
            }
            let called = read(file, at + META, letters.into(), length)?;
            at += META + u64::from(letters);
            grids.push((u64_at(&meta, 0)?, u64_at(&meta, 8)?, text(&called) == name));
        }
        for (size, packed, wanted) in grids {
            let end = at.checked_add(packed).filter(|end| *end <= length);
            let Some(end) = end else {
                return Err("its grids are cut off".into());
            };
            if wanted {
                return unpack(file, (at, packed), size, codec, room).map(Some);
            }
            at = end;
        }
    }
    Ok(None)
}

/// A name ends with the first zero.
pub fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

fn codec(number: u16) -> Result<Codec, String> {
    match number {
        0 => Ok(Codec::Stored),
        1 => Ok(Codec::Zlib),
        2 => Ok(Codec::Blosc),
        other => Err(format!("its grids are packed by an unknown codec, {other}")),
    }
}

/// Whether a grid's header is where that of a file could be.
fn is_raw(file: &mut File, at: u64, length: u64) -> bool {
    let head = read(file, at, GRID_HEADER, length);
    let version = head.and_then(|head| u32_at(&head, 16));
    version.is_ok_and(|version| version >> 21 == MAJOR)
}

fn find_raw(
    file: &mut File,
    (mut at, length): (u64, u64),
    name: &str,
    room: Room,
) -> Result<Option<Vec<u8>>, String> {
    while at < length {
        let head = read(file, at, GRID_HEADER, length)?;
        let size = u64_at(&head, 32)?;
        let end = at.checked_add(size).filter(|end| *end <= length);
        let Some(end) = end.filter(|_| size >= GRID_HEADER) else {
            return Err("its grids are cut off".into());
        };
        if text(&head[40..296]) == name {
            return unpack(file, (at, size), size, Codec::Stored, room).map(Some);
        }
        at = end;
    }
    Ok(None)
}

/// Fails for versions whose layout is another.
pub fn check_version(version: u32) -> Result<(), String> {
    match version >> 21 {
        MAJOR => Ok(()),
        other => Err(format!(
            "it has version {other} of the format; only {MAJOR} is supported"
        )),
    }
}

/// Bytes of the file, which are few.
fn read(file: &mut File, at: u64, count: u64, length: u64) -> Result<Vec<u8>, String> {
    if at.checked_add(count).is_none_or(|end| end > length) {
        return Err(format!("it ends before byte {}", at.saturating_add(count)));
    }
    let mut bytes = vec![0; count as usize];
    file.seek(SeekFrom::Start(at)).map_err(|e| e.to_string())?;
    file.read_exact(&mut bytes).map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// A grid of `size` bytes from the `packed` bytes at a place, which are in the file.
fn unpack(
    file: &mut File,
    (at, packed): (u64, u64),
    size: u64,
    codec: Codec,
    room: Room,
) -> Result<Vec<u8>, String> {
    let most = match codec {
        Codec::Stored => packed,
        Codec::Zlib => packed.saturating_mul(DEFLATE_RATIO),
        Codec::Blosc => packed.saturating_mul(LZ4_RATIO),
    };
    if size > most {
        return Err(format!(
            "its header promises a grid of {size} bytes, more than {packed} bytes can hold"
        ));
    }
    room(size)?;
    if codec == Codec::Stored {
        return read(file, at, size, at.saturating_add(packed));
    }
    room(packed)?;
    let bytes = read(file, at, packed, at.saturating_add(packed))?;
    let mut grid = Vec::new();
    if codec == Codec::Zlib {
        let data = bytes.get(8..).unwrap_or_default();
        let read = ZlibDecoder::new(data).take(size).read_to_end(&mut grid);
        read.map_err(|e| format!("its zlib data are broken: {e}"))?;
    } else {
        let mut rest = &bytes[..];
        while (grid.len() as u64) < size {
            let length = u64_at(rest, 0)?;
            let end = length.checked_add(8).and_then(|n| usize::try_from(n).ok());
            let chunk = end.and_then(|end| rest.get(8..end));
            let chunk = chunk.ok_or("its Blosc chunks are cut off")?;
            let before = grid.len();
            blosc::unpack(chunk, &mut grid, size)?;
            if grid.len() == before {
                return Err("it has an empty Blosc chunk".into());
            }
            rest = &rest[8 + chunk.len()..];
        }
    }
    if grid.len() as u64 != size {
        return Err(format!("its grid has {} bytes of {size}", grid.len()));
    }
    Ok(grid)
}
