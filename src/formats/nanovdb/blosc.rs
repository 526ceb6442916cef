//! Chunks of the compressor Blosc, of its first format: blocks whose bytes are sorted by their
//! significance (shuffled), and then compressed by LZ4, which is all that NanoVDB writes.
//!
//! Source: `README_CHUNK_FORMAT.rst` of c-blosc 1.21. LZ4 itself is the crate `lz4_flex`.

use super::bytes::{i32_at, slice, u32_at};

const HEADER: u64 = 16;
const SHUFFLED: u8 = 1;
const STORED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const WHOLE_BLOCKS: u8 = 16;
/// Names of compressors by number.
const COMPRESSORS: [&str; 5] = ["BloscLZ", "LZ4", "Snappy", "Zlib", "Zstd"];
/// Blocks are split by the bytes of their values, if these are not more than so many and each part
/// has at least so many bytes.
const MOST_PARTS: usize = 16;
const LEAST_PART: usize = 128;

/// Unpacks a chunk, and adds it to `out`, which may become as long as `most`.
pub fn unpack(chunk: &[u8], out: &mut Vec<u8>, most: u64) -> Result<(), String> {
    let [version, _, flags, width] = *slice(chunk, 0, 4)? else {
        return Err("its Blosc header is cut".into());
    };
    if version != 2 {
        return Err(format!("it has Blosc chunks of version {version}, not 2"));
    }
    let length = u32_at(chunk, 4)?;
    if (out.len() as u64).saturating_add(length.into()) > most {
        return Err("its Blosc chunks are longer than the grid that they are to be".into());
    }
    if flags & STORED != 0 {
        out.extend_from_slice(slice(chunk, HEADER, length.into())?);
        return Ok(());
    }
    let compressor = flags >> 5;
    if compressor != 1 {
        let name = COMPRESSORS.get(usize::from(compressor));
        return Err(format!(
            "its Blosc chunks are compressed by {}; only LZ4 is supported",
            name.unwrap_or(&"an unknown method")
        ));
    }
    if flags & BITS_SHUFFLED != 0 {
        return Err("its Blosc chunks are shuffled by bits; only bytes are supported".into());
    }
    let block = u32_at(chunk, 8)? as usize;
    if length > 0 && block == 0 {
        return Err("its Blosc blocks are empty".into());
    }
    let (length, width) = (length as usize, usize::from(width.max(1)));
    let mut packed = vec![0; block.min(length)];
    for start in (0..length).step_by(block.max(1)) {
        let size = block.min(length - start);
        let place = HEADER + 4 * (start / block) as u64;
        let parts = if flags & WHOLE_BLOCKS == 0
            && width <= MOST_PARTS
            && size / width >= LEAST_PART
            && size == block
        {
            width
        } else {
            1
        };
        let bytes = &mut packed[..size];
        unpack_block(chunk, i32_at(chunk, place)?, parts, bytes)?;
        if flags & SHUFFLED != 0 && width > 1 {
            unshuffle(bytes, width, out);
        } else {
            out.extend_from_slice(bytes);
        }
    }
    Ok(())
}

/// A block of so many parts that starts at a byte of the chunk.
fn unpack_block(chunk: &[u8], at: i32, parts: usize, out: &mut [u8]) -> Result<(), String> {
    let size = out.len() / parts;
    if size * parts != out.len() {
        return Err("its Blosc blocks do not fit its values".into());
    }
    let mut at = u64::try_from(at).map_err(|_| "a Blosc block lies before its chunk")?;
    for part in out.chunks_exact_mut(size) {
        let packed = u64::try_from(i32_at(chunk, at)?);
        let packed = packed.map_err(|_| "a part of a Blosc block has a negative length")?;
        let bytes = slice(chunk, at + 4, packed)?;
        if bytes.len() == size {
            part.copy_from_slice(bytes);
        } else {
            let found = lz4_flex::block::decompress_into(bytes, part);
            let found = found.map_err(|e| format!("its LZ4 data are broken: {e}"))?;
            if found != size {
                return Err(format!("its LZ4 data have {found} bytes of {size}"));
            }
        }
        at += 4 + packed;
    }
    Ok(())
}

/// Adds values of so many bytes, of which `bytes` has first all first bytes, then all second ones.
fn unshuffle(bytes: &[u8], width: usize, out: &mut Vec<u8>) {
    let count = bytes.len() / width;
    for value in 0..count {
        out.extend((0..width).map(|byte| bytes[byte * count + value]));
    }
    out.extend_from_slice(&bytes[count * width..]);
}
