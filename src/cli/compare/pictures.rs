//! The two pictures of a comparison: read, and found to fit together.

use std::path::Path;

use crate::cli::failure::Failure;
use crate::cli::messages::Messages;
use crate::film::output;
use crate::formats::Picture;
use crate::metrics::{Flip, NotFinite};
use crate::pbrt::image::{Encoding, read_image};

/// A picture, and the file it was in.
pub struct Input {
    pub name: String,
    pub picture: Picture,
    pub not_finite: Option<NotFinite>,
    displayed: bool,
}

/// Reads A and B; warns of what a comparison leaves out.
pub fn read(a: &Path, b: &Path, messages: Messages) -> Result<[Input; 2], Failure> {
    let inputs = [read_one(a)?, read_one(b)?];
    let [a, b] = &inputs;
    if [a.picture.width, a.picture.height] != [b.picture.width, b.picture.height] {
        let size = |i: &Input| format!("{} x {}", i.picture.width, i.picture.height);
        return Err(Failure::Input(format!(
            "{} is {} pixels, {} is {}: pictures must be of the same size",
            a.name,
            size(a),
            b.name,
            size(b)
        )));
    }
    if a.picture.offset != b.picture.offset {
        let place = |i: &Input| format!("{}, {}", i.picture.offset[0], i.picture.offset[1]);
        messages.warning(format_args!(
            "the crop window of {} starts at ({}), that of {} at ({}): they are compared as if at the same place",
            a.name,
            place(a),
            b.name,
            place(b)
        ));
    }
    for input in &inputs {
        if let Some(bad) = input.not_finite {
            messages.warning(format_args!(
                "{}: {} not finite, the first in column {}, row {}; left out",
                input.name,
                count(bad.pixels),
                bad.first[0],
                bad.first[1]
            ));
        }
    }
    Ok(inputs)
}

/// `1 pixel is`, `2 pixels are`
pub fn count(pixels: usize) -> String {
    match pixels {
        1 => "1 pixel is".into(),
        n => format!("{n} pixels are"),
    }
}

/// LDR where either picture has gone through a display's range.
pub fn suitable_flip([a, b]: &[Input; 2]) -> Flip {
    if a.displayed || b.displayed {
        Flip::Ldr
    } else {
        Flip::Hdr
    }
}

pub fn read_one(path: &Path) -> Result<Input, Failure> {
    let name = path.display().to_string();
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let extension = extension.as_ref().and_then(|e| e.to_str());
    let read = match extension {
        Some("exr") => output::read_exr(path).map_err(|e| e.to_string()),
        Some("pfm") => output::read_pfm(path).map_err(|e| e.to_string()),
        Some("png") => read_image(path, Encoding::Srgb).map(|image| Picture {
            width: image.width,
            height: image.height,
            offset: [0; 2],
            full: [image.width, image.height],
            pixels: image.texels,
        }),
        _ => Err(format!("{name}: the extension must be .exr, .pfm or .png")),
    };
    // Decoders explain themselves over several lines.
    let picture = read.map_err(|e| {
        let words: Vec<&str> = e.split_whitespace().collect();
        Failure::Input(words.join(" "))
    })?;
    Ok(Input {
        name,
        not_finite: NotFinite::find(&picture.pixels, picture.width as usize),
        displayed: extension == Some("png"),
        picture,
    })
}
