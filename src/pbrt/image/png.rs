//! PNG files, of which only the picture is read: profiles and texts may unpack to any length.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::{DynamicImage, ImageBuffer};
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use crate::formats::check_size;

/// Memory for what is neither picture nor skipped: palettes, transparent colours and the like.
const BESIDE: usize = 1 << 20;
/// Bytes of a pixel, at most.
const PIXEL: u64 = 8;

fn decoder(path: &Path) -> Result<Decoder<BufReader<File>>, String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut decoder = Decoder::new_with_limits(BufReader::new(file), Limits { bytes: BESIDE });
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_ignore_text_chunk(true);
    decoder.set_transformations(Transformations::EXPAND);
    Ok(decoder)
}

/// Width, height and bytes of the decoded picture, at most, by the header.
pub fn size(path: &Path) -> Result<(u32, u32, u64), String> {
    let mut decoder = decoder(path)?;
    let info = decoder.read_header_info().map_err(|e| e.to_string())?;
    let (width, height) = info.size();
    let channels = match info.color_type {
        ColorType::Grayscale => 2,
        _ => 4,
    };
    let each = channels
        * if info.bit_depth == BitDepth::Sixteen {
            2
        } else {
            1
        };
    let pixels = u64::from(width) * u64::from(height);
    Ok((width, height, pixels.saturating_mul(each)))
}

/// Reads the picture of a file of so many bytes.
pub fn read(path: &Path, file_bytes: u64) -> Result<DynamicImage, String> {
    let mut decoder = decoder(path)?;
    let info = decoder.read_header_info().map_err(|e| e.to_string())?;
    let (width, height) = info.size();
    check_size(width.into(), height.into(), file_bytes)?;
    let pixels = u64::from(width) * u64::from(height) * PIXEL;
    decoder.set_limits(Limits {
        bytes: usize::try_from(pixels).map_or(usize::MAX, |n| n.saturating_add(BESIDE)),
    });
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let length = reader.output_buffer_size().ok_or("it is too large")?;
    let mut bytes = vec![0; length];
    let frame = reader.next_frame(&mut bytes).map_err(|e| e.to_string())?;
    bytes.truncate(frame.buffer_size());
    // Samples of 16 bits have their higher byte first.
    let wide = |bytes: &[u8]| -> Vec<u16> {
        let (pairs, _) = bytes.as_chunks::<2>();
        pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect()
    };
    let image = match (frame.color_type, frame.bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => {
            ImageBuffer::from_raw(width, height, bytes).map(DynamicImage::ImageLuma8)
        }
        (ColorType::GrayscaleAlpha, BitDepth::Eight) => {
            ImageBuffer::from_raw(width, height, bytes).map(DynamicImage::ImageLumaA8)
        }
        (ColorType::Rgb, BitDepth::Eight) => {
            ImageBuffer::from_raw(width, height, bytes).map(DynamicImage::ImageRgb8)
        }
        (ColorType::Rgba, BitDepth::Eight) => {
            ImageBuffer::from_raw(width, height, bytes).map(DynamicImage::ImageRgba8)
        }
        (ColorType::Grayscale, BitDepth::Sixteen) => {
            ImageBuffer::from_raw(width, height, wide(&bytes)).map(DynamicImage::ImageLuma16)
        }
        (ColorType::GrayscaleAlpha, BitDepth::Sixteen) => {
            ImageBuffer::from_raw(width, height, wide(&bytes)).map(DynamicImage::ImageLumaA16)
        }
        (ColorType::Rgb, BitDepth::Sixteen) => {
            ImageBuffer::from_raw(width, height, wide(&bytes)).map(DynamicImage::ImageRgb16)
        }
        (ColorType::Rgba, BitDepth::Sixteen) => {
            ImageBuffer::from_raw(width, height, wide(&bytes)).map(DynamicImage::ImageRgba16)
        }
        // Expanded, there are no others.
        (color, depth) => return Err(format!("{color:?} of {depth:?} bits is not supported")),
    };
    image.ok_or_else(|| "it is shorter than its header says".into())
}
