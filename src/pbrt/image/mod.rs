//! Pictures from files: linear, `f32`, row 0 on top.

mod png;

use std::fs::{self, File};
use std::io::{BufReader, Read};
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::formats::{Picture, check_size, exr, file_bytes, pfm, srgb};
use crate::scene::Image;

/// How the values of an integer format become linear. Float formats (EXR, HDR, PFM) are linear
/// under every encoding, as in pbrt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Encoding {
    /// sRGB. pbrt decodes 16-bit PNG like 8-bit files.
    #[default]
    Auto,
    /// The curve of IEC 61966-2-1, whatever the file says of itself.
    Srgb,
    /// Values are proportional to light.
    Linear,
    /// `value^gamma`
    Gamma(f32),
}

impl Encoding {
    fn decode(self, value: f32) -> f32 {
        match self {
            Encoding::Auto | Encoding::Srgb => srgb::decode(value),
            Encoding::Linear => value,
            Encoding::Gamma(gamma) => value.powf(gamma),
        }
    }

    /// All values of a format with `N` codes.
    fn table<const N: usize>(self) -> Vec<f32> {
        (0..N)
            .map(|code| self.decode(code as f32 / (N - 1) as f32))
            .collect()
    }
}

/// Most bytes the decoder may allocate, besides the check of the header against the length of the
/// file.
const MAX_DECODER_BYTES: u64 = 4 << 30;

/// Reads PNG, TGA, JPEG, BMP, HDR (by content, TGA by extension), EXR and PFM (by extension). Grey
/// is copied to all channels, alpha dropped, texels that are not finite become 0.
pub fn read_image(path: &Path, encoding: Encoding) -> Result<Image, String> {
    let name = path.display().to_string();
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let picture = file_bytes(path).and_then(|_| match extension.as_deref() {
        Some("exr") => exr::read(path),
        Some("pfm") => fs::read(path)
            .map_err(|e| e.to_string())
            .and_then(|file| pfm::read(&file)),
        _ => read_other(path, encoding),
    });
    let mut picture = picture.map_err(|e| one_line(&name, &e))?;
    for texel in picture.pixels.iter_mut().flatten() {
        if !texel.is_finite() {
            *texel = 0.0;
        }
    }
    Ok(Image {
        name,
        width: picture.width,
        height: picture.height,
        texels: picture.pixels,
    })
}

/// Memory that [`read_image`] will take, in bytes, by the file's header: the texels, and what the
/// decoder makes of them first.
pub fn bytes_needed(path: &Path) -> Result<u64, String> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let texels = |width: u64, height: u64| width.saturating_mul(height);
    let texel = size_of::<[f32; 3]>() as u64;
    let needed = file_bytes(path).and_then(|bytes| match extension.as_deref() {
        Some("exr") => exr::samples(path).map(|(texels, samples)| {
            let decoded = samples.saturating_mul(size_of::<f32>() as u64);
            texels.saturating_mul(texel).saturating_add(decoded)
        }),
        // Grey is three times as long in memory.
        Some("pfm") => {
            begins_with(path, b"Pf").map(|grey| bytes.saturating_mul(if grey { 4 } else { 2 }))
        }
        _ => size_of_other(path, bytes).map(|(width, height, decoded)| {
            let decoded = decoded.saturating_mul(2);
            (texels(width.into(), height.into()).saturating_mul(texel)).saturating_add(decoded)
        }),
    });
    needed.map_err(|e| one_line(&path.display().to_string(), &e))
}

/// Decoders explain themselves over several lines.
fn one_line(name: &str, message: &str) -> String {
    let words: Vec<&str> = message.split_whitespace().collect();
    format!("{name}: {}", words.join(" "))
}

fn begins_with(path: &Path, magic: &[u8; 2]) -> Result<bool, String> {
    let mut bytes = [0; 2];
    let mut file = File::open(path).map_err(|e| e.to_string())?;
    Ok(file.read_exact(&mut bytes).is_ok() && bytes == *magic)
}

/// Width, height and bytes of the decoded picture, by the header of a file of so many bytes.
fn size_of_other(path: &Path, file_bytes: u64) -> Result<(u32, u32, u64), String> {
    let reader = reader(path)?;
    match reader.format() {
        Some(ImageFormat::Png) => return png::size(path),
        Some(ImageFormat::Jpeg) => {
            // The decoder reads the file whole, and copies what it holds besides the picture.
            let (width, height) = jpeg_size(path)?;
            let pixels = u64::from(width) * u64::from(height);
            return Ok((width, height, 3 * pixels + file_bytes));
        }
        _ => {}
    }
    let decoder = decoder(reader)?;
    let (width, height) = decoder.dimensions();
    Ok((width, height, decoder.total_bytes()))
}

/// Width and height of a JPEG file, from its frame header; 0 if there is none, as the decoder will
/// say.
fn jpeg_size(path: &Path) -> Result<(u32, u32), String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut file = BufReader::new(file);
    Ok(jpeg_frame(&mut file).unwrap_or_default())
}

/// Walks the segments after the first marker: a marker, the length of the rest, the rest (ITU-T
/// T.81, annex B).
fn jpeg_frame(file: &mut BufReader<File>) -> std::io::Result<(u32, u32)> {
    file.seek_relative(2)?;
    loop {
        let mut marker = [0; 2];
        file.read_exact(&mut marker)?;
        if marker == [0xff; 2] {
            // Markers may be preceded by any number of such bytes.
            file.seek_relative(-1)?;
            continue;
        }
        let mut length = [0; 2];
        file.read_exact(&mut length)?;
        let frame = matches!(marker[1], 0xc0..=0xcf) && !matches!(marker[1], 0xc4 | 0xc8 | 0xcc);
        if frame {
            let mut size = [0; 5];
            file.read_exact(&mut size)?;
            let [_, h1, h0, w1, w0] = size;
            let of = |high, low| u16::from_be_bytes([high, low]).into();
            return Ok((of(w1, w0), of(h1, h0)));
        }
        let rest = i64::from(u16::from_be_bytes(length)) - 2;
        if marker[0] != 0xff || rest < 0 {
            return Ok((0, 0));
        }
        file.seek_relative(rest)?;
    }
}

type Reader = ImageReader<BufReader<File>>;

/// Knows the format, by content or extension.
fn reader(path: &Path) -> Result<Reader, String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut reader = ImageReader::new(BufReader::new(file));
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format);
    }
    let reader = reader.with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format() == Some(ImageFormat::Hdr) {
        check_hdr_header(path)?;
    }
    Ok(reader)
}

/// Longest header of an HDR file: the decoder keeps every line of it.
const MAX_HDR_HEADER: usize = 1 << 16;

fn check_hdr_header(path: &Path) -> Result<(), String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let mut start = Vec::new();
    let read = file.take(MAX_HDR_HEADER as u64).read_to_end(&mut start);
    read.map_err(|e| e.to_string())?;
    let blank = start.windows(2).position(|two| two == b"\n\n");
    // The size of the picture is in the line after the blank one.
    let whole = blank.is_some_and(|at| start[at + 2..].contains(&b'\n'));
    if !whole && start.len() == MAX_HDR_HEADER {
        return Err(format!("its header is longer than {MAX_HDR_HEADER} bytes"));
    }
    Ok(())
}

fn decoder(mut reader: Reader) -> Result<impl ImageDecoder, String> {
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);

    reader.into_decoder().map_err(|e| e.to_string())
}

fn read_other(path: &Path, encoding: Encoding) -> Result<Picture, String> {
    let file_bytes = file_bytes(path)?;
    let reader = reader(path)?;
    let decoded = if reader.format() == Some(ImageFormat::Png) {
        png::read(path, file_bytes)?
    } else {
        let decoder = decoder(reader)?;
        let (width, height) = decoder.dimensions();
        check_size(width as u64, height as u64, file_bytes)?;
        DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?
    };
    let (width, height) = (decoded.width(), decoded.height());
    let pixels = linear(decoded, encoding);
    Ok(Picture {
        width,
        height,
        offset: [0; 2],
        full: [width, height],
        pixels,
    })
}

fn linear(image: DynamicImage, encoding: Encoding) -> Vec<[f32; 3]> {
    let wide = matches!(
        image,
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_)
    ) || matches!(
        image,
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_)
    );
    if matches!(
        image,
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
    ) {
        image.into_rgb32f().pixels().map(|p| p.0).collect()
    } else if wide {
        let table = encoding.table::<65536>();
        image
            .into_rgb16()
            .pixels()
            .map(|p| p.0.map(|v| table[v as usize]))
            .collect()
    } else {
        let table = encoding.table::<256>();
        image
            .into_rgb8()
            .pixels()
            .map(|p| p.0.map(|v| table[v as usize]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, ImageBuffer, Rgb, RgbaImage};

    use super::*;

    fn near(a: f32, b: f32) -> bool {
        (a - b).abs() < 1e-5
    }

    #[test]
    fn eight_bits_under_every_encoding() {
        let folder = tempfile::tempdir().unwrap();
        for file in ["a.png", "a.tga"] {
            let path = folder.path().join(file);
            let mut image = RgbaImage::new(2, 3);
            image.put_pixel(1, 2, image::Rgba([255, 128, 0, 7]));
            image.save(&path).unwrap();
            let texel = |encoding| {
                let read = read_image(&path, encoding).unwrap();
                assert_eq!((read.width, read.height, read.texels.len()), (2, 3, 6));
                assert_eq!(read.texels[0], [0.0; 3]);
                read.texels[5]
            };
            assert!(near(texel(Encoding::Auto)[1], 0.215_860_5));
            assert_eq!(texel(Encoding::Auto), texel(Encoding::Srgb));
            assert!(near(texel(Encoding::Linear)[1], 128.0 / 255.0));
            assert!(near(
                texel(Encoding::Gamma(2.0))[1],
                (128.0f32 / 255.0).powi(2)
            ));
        }
    }

    #[test]
    fn other_integer_formats() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let image: ImageBuffer<Rgb<u16>, _> =
            ImageBuffer::from_pixel(1, 1, Rgb([65535u16, 32768, 0]));
        image.save(&path).unwrap();
        let auto = read_image(&path, Encoding::Auto).unwrap().texels[0];
        assert!(near(auto[0], 1.0) && near(auto[1], srgb::decode(32768.0 / 65535.0)));
        let linear = read_image(&path, Encoding::Linear).unwrap().texels[0];
        assert!(near(linear[1], 32768.0 / 65535.0));

        for file in ["a.jpg", "a.bmp"] {
            let path = folder.path().join(file);
            GrayImage::from_pixel(8, 8, image::Luma([188]))
                .save(&path)
                .unwrap();
            let texel = read_image(&path, Encoding::Auto).unwrap().texels[63];
            assert!(
                (texel[0] - 0.5029).abs() < 0.01 && texel[0] == texel[2],
                "{file} {texel:?}"
            );
        }
    }

    #[test]
    fn float_formats_are_linear() {
        use crate::film::output;
        let folder = tempfile::tempdir().unwrap();
        let pixels = vec![[0.5, 2.0, 1e4], [0.0, f32::NAN, 0.25]];
        let picture = Picture {
            width: 2,
            height: 1,
            offset: [0; 2],
            full: [2, 1],
            pixels,
        };
        for file in ["a.exr", "a.pfm"] {
            let path = folder.path().join(file);
            output::write(&path, &picture, &[], &crate::formats::tone::Display::LINEAR).unwrap();
            let image = read_image(&path, Encoding::Srgb).unwrap();
            assert_eq!(image.texels, vec![[0.5, 2.0, 1e4], [0.0, 0.0, 0.25]]);
        }
        let path = folder.path().join("a.hdr");
        let encoder = image::codecs::hdr::HdrEncoder::new(File::create(&path).unwrap());
        encoder
            .encode(&[Rgb([0.5, 2.0, 4.0]), Rgb([1.0, 1.0, 1.0])], 2, 1)
            .unwrap();
        let texels = read_image(&path, Encoding::Auto).unwrap().texels;
        assert!(
            texels[0]
                .iter()
                .zip([0.5, 2.0, 4.0])
                .all(|(a, b)| (a - b).abs() < 0.03),
            "{texels:?}"
        );
    }

    #[test]
    fn damaged_files_are_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let check = |file: &str, bytes: &[u8]| {
            let path = folder.path().join(file);
            fs::write(&path, bytes).unwrap();
            let error = read_image(&path, Encoding::Auto).unwrap_err();
            assert!(error.contains(file) && !error.contains('\n'), "{error:?}");
        };
        // A TGA header promising 65535 x 65535 true-colour pixels.
        let mut tga = [0u8; 18];
        (tga[2], tga[12], tga[13], tga[14], tga[15], tga[16]) = (2, 255, 255, 255, 255, 24);
        check("huge.tga", &tga);
        check(
            "huge.hdr",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n",
        );
        check("huge.pfm", b"PF 1000000 1000000 -1\n");

        let path = folder.path().join("good.png");
        GrayImage::new(100, 100).save(&path).unwrap();
        let png = fs::read(&path).unwrap();
        check("short.png", &png[..png.len() / 2]);
        let mut hostile = png.clone();
        hostile[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        check("huge.png", &hostile);
        check("empty.png", b"");
        check("text.exr", b"not a picture");
        check("text.jpg", b"not a picture");
        check("text.xyz", b"not a picture");
        assert!(
            read_image(&folder.path().join("missing.png"), Encoding::Auto)
                .unwrap_err()
                .contains("missing.png")
        );
    }
}
