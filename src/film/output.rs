//! Writing finished pictures: `.exr`, `.pfm` and `.png` by extension, in one step, so that a reader
//! never sees half a picture and a failure keeps the old one. What cannot be replaced, like a pipe,
//! is written into.

use std::ffi::OsString;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::files::{self, Replacement};
pub use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::formats::{exr, file_bytes, pfm, srgb};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

/// Something about the render that EXR files carry in the header; other formats have no place for
/// it.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// As readers of the file see it.
    pub name: String,
    /// Its type follows from it.
    pub value: AttributeValue,
}

/// The value of an [`Attribute`].
#[derive(Clone, Debug, PartialEq)]
pub enum AttributeValue {
    /// Written as a `string`.
    Text(String),
    /// Written as an `int` where it fits into 32 bits, else as text.
    Integer(i64),
    /// Written as a `double`.
    Float(f64),
    /// `x y` of red, green, blue and white; whatever its name, it is the file's standard attribute.
    Chromaticities([f32; 8]),
}

/// Why a picture was not read or written. All messages begin with the path.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// No format has this extension.
    #[error("{}: the extension must be .exr, .pfm or .png", .0.display())]
    Extension(PathBuf),
    /// The system refused.
    #[error("{}: {source}", .path.display())]
    Io {
        /// What was to be read or written.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Not a file of this format, or a picture that the format cannot hold.
    #[error("{}: {message}", .path.display())]
    Format {
        /// What was to be read or written.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
}

#[derive(Clone, Copy)]
enum Format {
    Exr,
    Pfm,
    Png,
}

/// By the extension; a pipe or device without one gets what a file would lose least by.
fn format(path: &Path) -> Result<Format, OutputError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        None if files::is_special(path) => Ok(Format::Exr),
        Some("exr") => Ok(Format::Exr),
        Some("pfm") => Ok(Format::Pfm),
        Some("png") => Ok(Format::Png),
        _ => Err(OutputError::Extension(path.into())),
    }
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> OutputError {
    |source| OutputError::Io {
        path: path.into(),
        source,
    }
}

fn format_error(path: &Path) -> impl FnOnce(String) -> OutputError {
    |message| OutputError::Format {
        path: path.into(),
        message,
    }
}

/// True if [`write()`] knows the format of the extension.
pub fn is_supported(path: &Path) -> bool {
    format(path).is_ok()
}

/// The name of a file of its own that takes what [`write()`] cannot bring to `path`.
pub fn file_name(path: &Path) -> OsString {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    if path.extension().is_none() {
        name.push(".exr");
    }
    name
}

/// True if [`write()`] will make it an EXR file.
pub fn is_exr(path: &Path) -> bool {
    matches!(format(path), Ok(Format::Exr))
}

/// Fails now where [`write()`] would fail after the render: unknown extension, missing or read-only
/// folder, read-only file.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    format(path)?;
    files::check(path).map_err(io_error(path))
}

/// Writes `picture` in the format of the extension. `display` applies to PNG only, which holds
/// 8-bit sRGB; the others keep linear values.
pub fn write(
    path: &Path,
    picture: &Picture,
    attributes: &[Attribute],
    display: &Display,
) -> Result<(), OutputError> {
    write_layers(path, picture, &[], attributes, display)
}

/// The same, with further layers for EXR: names, and as many pixels as the picture has.
pub fn write_layers(
    path: &Path,
    picture: &Picture,
    more: &[(&str, &[[f32; 3]])],
    attributes: &[Attribute],
    display: &Display,
) -> Result<(), OutputError> {
    let format = format(path)?;
    let size = picture.width as usize * picture.height as usize;
    if size == 0 || picture.pixels.len() != size {
        let message = format!(
            "{} pixels do not fill {} x {}",
            picture.pixels.len(),
            picture.width,
            picture.height
        );
        return Err(format_error(path)(message));
    }
    let mut file = Replacement::of(path).map_err(io_error(path))?;
    {
        let mut out = BufWriter::new(&mut file);
        match format {
            Format::Exr => exr::write(&mut out, picture, more, exr_attributes(attributes))
                .map_err(format_error(path))?,
            Format::Pfm => pfm::write(&mut out, picture).map_err(io_error(path))?,
            Format::Png => write_png(&mut out, picture, display).map_err(format_error(path))?,
        }
        out.flush().map_err(io_error(path))?;
    }
    file.finish().map_err(io_error(path))
}

fn exr_attributes(
    attributes: &[Attribute],
) -> impl Iterator<Item = (String, ::exr::prelude::AttributeValue)> {
    use ::exr::prelude::AttributeValue as Exr;
    attributes.iter().map(|a| {
        let value = match &a.value {
            AttributeValue::Text(text) => exr::text(text),
            AttributeValue::Integer(v) => {
                i32::try_from(*v).map_or_else(|_| exr::text(&v.to_string()), Exr::I32)
            }
            AttributeValue::Float(v) => Exr::F64(*v),
            AttributeValue::Chromaticities(v) => exr::chromaticities(*v),
        };
        (a.name.clone(), value)
    })
}

fn write_png(out: impl Write, picture: &Picture, display: &Display) -> Result<(), String> {
    let factor = display.factor(&picture.pixels);
    let bytes: Vec<u8> = picture
        .pixels
        .iter()
        .flat_map(|rgb| display.tonemap.apply_to(rgb.map(|v| v * factor)))
        .map(srgb::encode_u8)
        .collect();
    PngEncoder::new(out)
        .write_image(
            &bytes,
            picture.width,
            picture.height,
            ExtendedColorType::Rgb8,
        )
        .map_err(|e| e.to_string())
}

/// Reads a PFM file; the crop window is the whole picture.
pub fn read_pfm(path: &Path) -> Result<Picture, OutputError> {
    file_bytes(path).map_err(format_error(path))?;
    let file = fs::read(path).map_err(io_error(path))?;
    pfm::read(&file).map_err(format_error(path))
}

/// Reads an EXR file with its windows.
pub fn read_exr(path: &Path) -> Result<Picture, OutputError> {
    exr::read(path).map_err(format_error(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let pixels = (0..12)
            .map(|i| [i as f32, -0.5 * i as f32, 1e9 / (i + 1) as f32])
            .collect();
        Picture {
            width: 4,
            height: 3,
            offset: [5, 2],
            full: [16, 9],
            pixels,
        }
    }

    #[test]
    fn exr_keeps_pixels_windows_and_attributes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let attribute = |name: &str, value| Attribute {
            name: name.into(),
            value,
        };
        let attributes = [
            attribute("scene", AttributeValue::Text("Küche.pbrt".into())),
            attribute("chains", AttributeValue::Integer(1000)),
            attribute("mutations", AttributeValue::Integer(1 << 40)),
            attribute("b", AttributeValue::Float(0.25)),
            attribute("", AttributeValue::Integer(1)),
        ];
        write(&path, &picture(), &attributes, &Display::LINEAR).unwrap();
        assert_eq!(read_exr(&path).unwrap(), picture());

        use ::exr::prelude::AttributeValue as Exr;
        let meta = ::exr::meta::MetaData::read_from_file(&path, true).unwrap();
        let other = &meta.headers[0].own_attributes.other;
        let get = |name: &str| {
            other
                .iter()
                .find(|(n, _)| **n == *name)
                .map(|(_, v)| v.clone())
        };
        assert_eq!(get("scene"), Some(exr::text("K?che.pbrt")));
        assert_eq!(get("chains"), Some(Exr::I32(1000)));
        assert_eq!(get("mutations"), Some(exr::text("1099511627776")));
        assert_eq!(get("b"), Some(Exr::F64(0.25)));
    }

    #[test]
    fn layers_are_channels_beside_the_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let errors: Vec<[f32; 3]> = (0..12).map(|i| [0.1 * i as f32, 2.0, 3.0]).collect();
        write_layers(
            &path,
            &picture(),
            &[("error", &errors)],
            &[],
            &Display::LINEAR,
        )
        .unwrap();
        assert_eq!(read_exr(&path).unwrap(), picture());
        let image = ::exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
        let channels = &image.layer_data[0].channel_data.list;
        let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R", "error.B", "error.G", "error.R"]);
        let red: Vec<f32> = channels[5].sample_data.values_as_f32().collect();
        assert_eq!(red, errors.iter().map(|e| e[0]).collect::<Vec<_>>());
    }

    #[test]
    fn pfm_keeps_pixels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.PFM");
        write(&path, &picture(), &[], &Display::default()).unwrap();
        let read = read_pfm(&path).unwrap();
        assert_eq!(read.pixels, picture().pixels);
        // The bottom row comes first in the file.
        let bytes = fs::read(&path).unwrap();
        assert_eq!(&bytes[..12], b"PF\n4 3\n-1.0\n");
        assert_eq!(bytes[12..16], 8f32.to_le_bytes());
    }

    #[test]
    fn png_is_exposed_srgb() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let pixels = vec![[0.25, 0.5, f32::NAN], [100.0, -1.0, 0.107_930_3]];
        let picture = Picture {
            width: 2,
            height: 1,
            offset: [0; 2],
            full: [2, 1],
            pixels,
        };
        let display = Display {
            exposure: Some(1.0),
            ..Display::LINEAR
        };
        write(&path, &picture, &[], &display).unwrap();
        let png = image::open(&path).unwrap().into_rgb8();
        assert_eq!(png.into_raw(), vec![188, 255, 0, 255, 0, 128]);
    }

    #[test]
    fn failures_come_early_and_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(
            check_writable(&folder.path().join("a.jpg")),
            Err(OutputError::Extension(_))
        ));
        assert!(check_writable(&folder.path().join("missing/a.exr")).is_err());
        fs::create_dir(folder.path().join("b.exr")).unwrap();
        assert!(check_writable(&folder.path().join("b.exr")).is_err());
        check_writable(&folder.path().join("a.exr")).unwrap();

        let bad = Picture {
            pixels: Vec::new(),
            ..picture()
        };
        assert!(write(&folder.path().join("a.exr"), &bad, &[], &Display::LINEAR).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn damaged_exr_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, &picture(), &[], &Display::LINEAR).unwrap();
        let good = fs::read(&path).unwrap();
        for length in [0, 3, 20, good.len() / 2, good.len() - 1] {
            fs::write(&path, &good[..length]).unwrap();
            assert!(read_exr(&path).is_err(), "cut to {length} bytes");
        }
        // A data window of 2^30 by 2^30 pixels.
        let name = good.windows(10).position(|w| w == b"dataWindow").unwrap();
        let mut hostile = good.clone();
        let values = name + b"dataWindow\0box2i\0".len() + 4;
        hostile[values + 8..values + 12].copy_from_slice(&(1i32 << 30).to_le_bytes());
        hostile[values + 12..values + 16].copy_from_slice(&(1i32 << 30).to_le_bytes());
        fs::write(&path, &hostile).unwrap();
        assert!(read_exr(&path).is_err());
    }
}
