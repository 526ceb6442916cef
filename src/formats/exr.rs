//! OpenEXR: `f32` R, G, B, the crop window as data window inside the display window, attributes in
//! the header.

use std::fs::File;
use std::io::{Cursor, Read, Write};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::Chromaticities;
use exr::prelude::*;

use super::{Picture, check_size, file_bytes};

/// The attribute that names the program.
const SOFTWARE: &str = "software";

/// Writes one losslessly compressed layer: channels R, G, B, and, for each of `more`, a name and as
/// many pixels, `name.R`, `name.G` and `name.B`. Names of attributes that EXR cannot hold are
/// skipped.
pub fn write(
    mut out: impl Write,
    picture: &Picture,
    more: &[(&str, &[[f32; 3]])],
    attributes: impl IntoIterator<Item = (String, AttributeValue)>,
) -> std::result::Result<(), String> {
    let position = Vec2(to_i32(picture.offset[0])?, to_i32(picture.offset[1])?);
    let full = (
        to_i32(picture.full[0])? as usize,
        to_i32(picture.full[1])? as usize,
    );
    let mut channels = SmallVec::new();
    let own = std::iter::once(("", picture.pixels.as_slice()));
    for (name, pixels) in own.chain(more.iter().copied()) {
        for (c, colour) in ["R", "G", "B"].into_iter().enumerate() {
            let name = if name.is_empty() {
                colour.into()
            } else {
                format!("{name}.{colour}")
            };
            let values = pixels.iter().map(|p| p[c]).collect();
            channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(values)));
        }
    }
    let mut layer_attributes = LayerAttributes::default().with_position(position);
    let mut chromaticities = None;
    for (name, value) in attributes {
        if let AttributeValue::Chromaticities(value) = value {
            chromaticities = Some(value);
            continue;
        }
        // A name that EXR itself gives a meaning.
        if let (SOFTWARE, AttributeValue::Text(text)) = (name.as_str(), &value) {
            layer_attributes.software_name = Some(text.clone());
            continue;
        }
        if let Some(name) =
            Text::new_or_none(&name).filter(|n| (1..=255).contains(&n.as_slice().len()))
        {
            layer_attributes.other.insert(name, value);
        }
    }
    let size = (picture.width as usize, picture.height as usize);
    let channels = AnyChannels::sort(channels);
    let layer = Layer::new(size, layer_attributes, Encoding::SMALL_LOSSLESS, channels);
    let mut window = ImageAttributes::new(IntegerBounds::from_dimensions(full));
    window.chromaticities = chromaticities;
    let image = Image::empty(window).with_layer(layer);
    let mut file = Cursor::new(Vec::new());
    (image.write().to_buffered(&mut file)).map_err(|e| e.to_string())?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    out.write_all(&bytes).map_err(|e| e.to_string())
}

/// Puts the attributes of a file of one layer in the order of their names: equal pictures are then
/// equal files, where the library's order changes from run to run.
fn sort_attributes(file: &mut [u8]) {
    let mut entries = Vec::new();
    let mut at = 8;
    while file.get(at).is_some_and(|&b| b != 0) {
        let Some(length) = attribute_length(&file[at..]) else {
            return;
        };
        entries.push(file[at..at + length].to_vec());
        at += length;
    }
    entries.sort();
    let sorted = entries.concat();
    file[8..8 + sorted.len()].copy_from_slice(&sorted);
}

fn to_i32(v: u32) -> std::result::Result<i32, String> {
    i32::try_from(v).map_err(|_| format!("{v} is too large for an EXR window"))
}

/// Text as an attribute; EXR stores Latin characters only, others become `?`.
pub fn text(value: &str) -> AttributeValue {
    let latin: String = value
        .chars()
        .map(|c| if c.is_ascii() { c } else { '?' })
        .collect();
    AttributeValue::Text(Text::new_or_none(latin).unwrap_or_default())
}

/// Chromaticities `x y` of red, green, blue and white as an attribute.
pub fn chromaticities([rx, ry, gx, gy, bx, by, wx, wy]: [f32; 8]) -> AttributeValue {
    AttributeValue::Chromaticities(Chromaticities {
        red: Vec2(rx, ry),
        green: Vec2(gx, gy),
        blue: Vec2(bx, by),
        white: Vec2(wx, wy),
    })
}

/// Longest header that is read, all attributes of all layers: the reader keeps them.
const MAX_HEADER: usize = 1 << 20;

/// Refuses a file whose header is too long. What is wrong with it otherwise, the reader says.
fn check_header(path: &Path) -> std::result::Result<(), String> {
    let mut header = Vec::new();
    let file = File::open(path).map_err(|e| e.to_string())?;
    let read = file.take(MAX_HEADER as u64).read_to_end(&mut header);
    read.map_err(|e| e.to_string())?;
    if ends_within(&header) || header.len() < MAX_HEADER {
        return Ok(());
    }
    Err(format!("its header is longer than {MAX_HEADER} bytes"))
}

/// Bytes of the attribute that begins here: a name, a type, a length and as many bytes.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let text = |bytes: &[u8]| bytes.iter().position(|&b| b == 0);
    let kind = &bytes[text(bytes)? + 1..];
    let size = &kind[text(kind)? + 1..];
    let value: [u8; 4] = size.get(..4)?.try_into().ok()?;
    let value = usize::try_from(i32::from_le_bytes(value)).ok()?;
    Some(bytes.len() - size.len() + 4 + value)
}

/// Whether the header ends in these first bytes of a file. An attribute is a name, a type, a length
/// and as many bytes; a layer without any ends them all if there may be several.
fn ends_within(bytes: &[u8]) -> bool {
    const MULTIPART: u32 = 1 << 12;
    let version = bytes.get(4..8).and_then(|b| b.try_into().ok());
    let several = version.is_some_and(|b| u32::from_le_bytes(b) & MULTIPART != 0);
    let mut rest = bytes.get(8..).unwrap_or_default();
    let mut attributes = 0;
    loop {
        let Some((&first, after)) = rest.split_first() else {
            return false;
        };
        if first == 0 {
            if !several || attributes == 0 {
                return true;
            }
            attributes = 0;
            rest = after;
            continue;
        }
        match attribute_length(rest).and_then(|length| rest.get(length..)) {
            Some(next) => rest = next,
            None => return false,
        }
        attributes += 1;
    }
}

/// Pixels of the largest layer of a file, and samples of all channels of all layers, by its header.
pub fn samples(path: &Path) -> std::result::Result<(u64, u64), String> {
    check_header(path)?;
    let meta = MetaData::read_from_file(path, false).map_err(|e| e.to_string())?;
    let mut most = (0, 0u64);
    for header in &meta.headers {
        let pixels = (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
        most.0 = pixels.max(most.0);
        let samples = pixels.saturating_mul(header.channels.list.len() as u64);
        most.1 = most.1.saturating_add(samples);
    }
    Ok(most)
}

/// What a file of one layer says about its making, in the order of the names.
pub struct Figures {
    /// Of the picture, in pixels.
    pub size: [usize; 2],
    /// What has written it.
    pub software: Option<String>,
    /// Attributes of our own, without the prefix.
    pub own: Vec<(String, String)>,
}

/// Names of attributes of our own begin with this.
pub const OWN: &str = "phalanx:";

/// What a file says about its making.
pub fn figures(path: &Path) -> std::result::Result<Figures, String> {
    check_header(path)?;
    let meta = MetaData::read_from_file(path, false).map_err(|e| e.to_string())?;
    let header = meta.headers.first().ok_or("it has no layer")?;
    let attributes = &header.own_attributes;
    let mut own: Vec<(String, String)> = (attributes.other.iter())
        .filter_map(|(name, value)| {
            let name = name.to_string();
            let name = name.strip_prefix(OWN)?;
            let value = match value {
                AttributeValue::Text(text) => text.to_string(),
                AttributeValue::I32(value) => value.to_string(),
                AttributeValue::F32(value) => value.to_string(),
                AttributeValue::F64(value) => value.to_string(),
                _ => return None,
            };
            Some((name.to_owned(), value))
        })
        .collect();
    own.sort();
    Ok(Figures {
        size: [header.layer_size.0, header.layer_size.1],
        software: attributes.software_name.as_ref().map(Text::to_string),
        own,
    })
}

/// Reads the first layer that has R, G, B or else Y (copied to all channels), half, float or
/// integer, its largest level.
pub fn read(path: &Path) -> std::result::Result<Picture, String> {
    let file_bytes = file_bytes(path)?;
    check_header(path)?;
    // The reader allocates whole layers, so the sizes in the header are judged first.
    let meta = MetaData::read_from_file(path, false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        check_size(
            header.layer_size.0 as u64,
            header.layer_size.1 as u64,
            file_bytes,
        )?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .map_err(|e| e.to_string())?;

    for layer in &image.layer_data {
        let channel = |name: &str| layer.channel_data.list.iter().find(|c| c.name == *name);
        let grey = channel("Y");
        let Some(rgb) = ["R", "G", "B"]
            .map(|name| channel(name).or(grey))
            .into_iter()
            .collect::<Option<Vec<_>>>()
        else {
            continue;
        };
        if rgb.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err("subsampled channels are not supported".into());
        }
        let Vec2(width, height) = layer.size;
        let mut pixels = vec![[0.0; 3]; width * height];
        for (i, channel) in rgb.iter().enumerate() {
            for (pixel, value) in pixels.iter_mut().zip(channel.sample_data.values_as_f32()) {
                pixel[i] = value;
            }
        }
        // A data window left of or above the display window has no place in a crop: it counts from
        // 0 then.
        let display = image.attributes.display_window;
        let start = layer.attributes.layer_position - display.position;
        let offset = [start.0, start.1].map(|v| u32::try_from(v).unwrap_or(0));
        let full = [display.size.0 as u32, display.size.1 as u32];
        return Ok(Picture {
            width: width as u32,
            height: height as u32,
            offset,
            full,
            pixels,
        });
    }
    Err("no layer has channels R, G, B or Y".into())
}
