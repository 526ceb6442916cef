//! Picture files with floating-point pixels, and the sRGB curve: what textures read and the film
//! writes. Files of volumes.

pub mod exr;
pub mod nanovdb;
pub mod pfm;
pub mod srgb;
pub mod tone;

use std::path::Path;

/// A picture: linear sRGB, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Size of the crop window, which is all that is stored.
    pub width: u32,
    /// In pixels.
    pub height: u32,
    /// Left and top of the crop window in the full picture.
    pub offset: [u32; 2],
    /// Resolution of the full picture.
    pub full: [u32; 2],
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

/// More pixels than any texture or film has (a cap on what a hostile header can ask for: 3 GiB as
/// `f32` RGB).
pub const MAX_PIXELS: u64 = 1 << 28;

/// Pixels one byte of a compressed file can stand for: deflate expands up to 1032 times, one-bit
/// greyscale has 8 a byte.
const MAX_PIXELS_PER_BYTE: u64 = 8 * 1032;

/// Bytes of a file. Devices never end and pipes may never begin, so that they are refused before
/// they are opened.
pub fn file_bytes(path: &Path) -> Result<u64, String> {
    let metadata = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if metadata.is_file() {
        Ok(metadata.len())
    } else {
        Err("it is not a file".into())
    }
}

/// Rejects dimensions that cannot come from a file of this length, before anything of that size is
/// allocated.
pub fn check_size(width: u64, height: u64, file_bytes: u64) -> Result<(), String> {
    let pixels = width.checked_mul(height).filter(|&n| n <= MAX_PIXELS);
    match pixels {
        Some(0) => Err("the picture has no pixels".into()),
        Some(n) if n <= file_bytes.saturating_mul(MAX_PIXELS_PER_BYTE) => Ok(()),
        Some(_) => Err(format!(
            "the header promises {width} x {height} pixels, more than {file_bytes} bytes can hold"
        )),
        None => Err(format!("{width} x {height} pixels are too many")),
    }
}
