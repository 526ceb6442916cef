//! Where the text of a scene comes from, block by block: files of any length are read in little
//! memory.

use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use encoding_rs::{Decoder, UTF_8, UTF_16BE, UTF_16LE};
use flate2::bufread::MultiGzDecoder;

use crate::formats::file_bytes;

/// Bytes of scene text read in all, after decompression. Meshes of this size belong in PLY files.
const MAX_TEXT: u64 = 4 << 30;

/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// What compressed text begins with.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Memory that a file takes while it is read, roughly: a block as it is read and as text, and the
/// state of inflation.
pub(super) const OPEN_FILE_BYTES: u64 = 5 * BLOCK as u64;

/// A text that can be read from its beginning, as often as it takes.
#[derive(Clone, Debug)]
pub(super) enum Text {
    File(PathBuf),
    /// Its name in messages, and all of it, perhaps compressed.
    Held(Rc<str>, Rc<[u8]>),
}

impl Text {
    pub fn held(name: &str, content: &[u8]) -> Self {
        Self::Held(name.into(), content.into())
    }

    /// As messages call it.
    pub fn name(&self) -> Rc<str> {
        match self {
            Self::File(path) => path.display().to_string().into(),
            Self::Held(name, _) => Rc::clone(name),
        }
    }

    /// Its file, if it has one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Held(..) => None,
        }
    }

    /// Begins to read; `total` counts the bytes of all texts of a scene.
    pub fn open(&self, total: &Rc<Cell<u64>>) -> Result<Blocks, String> {
        Ok(Blocks {
            name: self.name(),
            reader: match self {
                Self::File(path) => open(path)?,
                Self::Held(_, content) => {
                    let bytes = Cursor::new(Rc::clone(content));
                    match content.starts_with(&GZIP) {
                        true => Box::new(MultiGzDecoder::new(bytes)),
                        false => Box::new(bytes),
                    }
                }
            },
            decoder: None,
            total: Rc::clone(total),
        })
    }
}

/// The bytes of a file, unpacked by its content. Pipes may never begin, and devices never end.
fn open(path: &Path) -> Result<Box<dyn Read>, String> {
    let describe = |e: std::io::Error| format!("cannot open {}: {e}", path.display());
    if file_bytes(path).is_err() && path.exists() {
        return Err(format!("{} is not a file", path.display()));
    }
    let mut file = File::open(path).map_err(describe)?;
    let mut magic = [0; 2];
    let gzipped = file.read_exact(&mut magic).is_ok() && magic == GZIP;
    file.seek(SeekFrom::Start(0)).map_err(describe)?;
    Ok(if gzipped {
        Box::new(MultiGzDecoder::new(BufReader::new(file)))
    } else {
        Box::new(file)
    })
}

/// A text as it is read: UTF-8 or UTF-16. Comments may be in any encoding; everything that matters
/// is ASCII or UTF-8.
pub(super) struct Blocks {
    pub name: Rc<str>,
    reader: Box<dyn Read>,
    /// Known from the first block on.
    decoder: Option<Decoder>,
    total: Rc<Cell<u64>>,
}

impl std::fmt::Debug for Blocks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Blocks").field(&self.name).finish()
    }
}

impl Blocks {
    /// Appends the next block; false at the end of the text.
    pub fn append_to(&mut self, text: &mut String) -> Result<bool, String> {
        let mut bytes = [0; BLOCK];
        let mut count = 0;
        while count < BLOCK {
            match self.reader.read(&mut bytes[count..]) {
                Ok(0) => break,
                Ok(n) => count += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(format!("cannot read on: {e}")),
            }
        }
        let bytes = &bytes[..count];
        self.total.set(self.total.get() + count as u64);
        if self.total.get() > MAX_TEXT {
            return Err(format!(
                "the scene's text is longer than {MAX_TEXT} bytes; use PLY files for meshes"
            ));
        }
        let decoder = self.decoder.get_or_insert_with(|| decoder(bytes));
        let most = decoder.max_utf8_buffer_length(count);
        text.reserve(most.unwrap_or(3 * BLOCK));
        let _ = decoder.decode_to_string(bytes, text, count == 0);
        Ok(count > 0)
    }
}

/// For a text that begins with these bytes: by its byte order mark, or by the zeros that UTF-16
/// puts beside ASCII.
fn decoder(bytes: &[u8]) -> Decoder {
    match bytes {
        [0, b, ..] if b.is_ascii() && *b != 0 => UTF_16BE.new_decoder(),
        [b, 0, ..] if b.is_ascii() && *b != 0 => UTF_16LE.new_decoder(),
        _ => UTF_8.new_decoder(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn read(text: &Text) -> Result<String, String> {
        let mut blocks = text.open(&Rc::default())?;
        let mut out = String::new();
        while blocks.append_to(&mut out)? {}
        Ok(out)
    }

    /// Characters lie across the ends of blocks, and bytes that are none become one.
    #[test]
    fn blocks_make_up_the_text() {
        let long = "é€𝄞".repeat(30_000);
        assert_eq!(read(&Text::held("t", long.as_bytes())).unwrap(), long);
        let bytes: Rc<[u8]> = b"a\xffb\xe2\x82".as_slice().into();
        let broken = Text::Held("t".into(), bytes);
        assert_eq!(read(&broken).unwrap(), "a\u{fffd}b\u{fffd}");
    }

    #[test]
    fn encodings_and_gzip_are_recognised_by_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.pbrt");
        let text = "Shape \"é\"";
        let little = text.encode_utf16().flat_map(u16::to_le_bytes);
        let big = text.encode_utf16().flat_map(u16::to_be_bytes);
        let marked = |mark: &[u8], bytes: &mut dyn Iterator<Item = u8>| {
            mark.iter().copied().chain(bytes).collect::<Vec<u8>>()
        };
        let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        gz.write_all(text.as_bytes()).unwrap();
        for bytes in [
            marked(b"\xef\xbb\xbf", &mut text.bytes()),
            marked(b"\xff\xfe", &mut little.clone()),
            marked(b"\xfe\xff", &mut big.clone()),
            marked(b"", &mut little.clone()),
            marked(b"", &mut big.clone()),
            gz.finish().unwrap(),
        ] {
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(read(&Text::File(path.clone())).unwrap(), text, "{bytes:?}");
        }
    }

    #[test]
    fn what_is_no_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = read(&Text::File(folder.path().into())).unwrap_err();
        assert!(error.ends_with("is not a file"), "{error}");
        let missing = folder.path().join("missing");
        assert!(
            read(&Text::File(missing))
                .unwrap_err()
                .starts_with("cannot open ")
        );
    }
}
