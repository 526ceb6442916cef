//! A picture file becomes texels that are numbers, or is refused with a message of one line. The
//! first byte of the input is the kind of file.

use phalanx::pbrt::image::{Encoding, read_image};

use super::files;

const KINDS: [&str; 8] = ["exr", "pfm", "hdr", "png", "tga", "bmp", "jpg", "xyz"];

pub fn check(data: &[u8]) {
    let Some((kind, bytes)) = data.split_first() else {
        return;
    };
    let name = format!("input.{}", KINDS[*kind as usize % KINDS.len()]);
    files::with_file(&name, bytes, |path| {
        match read_image(path, Encoding::Auto) {
            Ok(image) => {
                assert!(image.width > 0 && image.height > 0);
                assert!(image.texels.len() == image.width as usize * image.height as usize);
                assert!(image.texels.iter().flatten().all(|x| x.is_finite()));
            }
            Err(message) => {
                assert!(message.contains(&name), "{message:?}");
                assert!(!message.contains('\n'), "{message:?}");
            }
        }
    });
}
