//! What follows the header, element by element.

use std::io::{BufRead, Read};

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{ElementDef, Encoding, Header, PropertyAccess, PropertyType};

use super::ascii;

/// Longest line of an ASCII file, and longest element of a binary one, that is read: polygons do
/// not have a million corners.
const MAX_LINE: u64 = 1 << 22;

/// What follows the header.
pub(super) struct Lines {
    pub source: Box<dyn BufRead>,
    pub line: String,
    /// Lines read so far, those of the header included.
    pub number: usize,
}

impl Lines {
    /// Reads the next line that is not empty.
    fn next(&mut self) -> Result<&str, String> {
        loop {
            self.line.clear();
            self.number += 1;
            match (&mut self.source).take(MAX_LINE).read_line(&mut self.line) {
                Ok(0) => return Err("the file ends: truncated?".into()),
                Ok(n) if n as u64 == MAX_LINE => return Err("line too long".into()),
                Ok(_) if self.line.trim().is_empty() => continue,
                Ok(_) => return Ok(&self.line),
                Err(e) => return Err(e.to_string()),
            }
        }
    }
}

/// Calls `f` with every element of one kind.
pub(super) fn each<E: PropertyAccess>(
    reader: &mut Lines,
    header: &Header,
    element: &ElementDef,
    mut f: impl FnMut(E) -> Result<(), String>,
) -> Result<(), String> {
    let parser = Parser::<E>::new();
    if element.properties.is_empty() && header.encoding != Encoding::Ascii {
        return Ok(());
    }
    let has_lists =
        (element.properties.values()).any(|p| matches!(p.data_type, PropertyType::List(..)));
    let most = if has_lists { MAX_LINE } else { u64::MAX };
    for i in 0..element.count {
        let source = &mut *reader.source;
        let parsed = match header.encoding {
            Encoding::Ascii => reader.next().and_then(|line| ascii::element(line, element)),
            encoding => {
                let mut source = source.take(most);
                let read = match encoding {
                    Encoding::BinaryLittleEndian => {
                        parser.read_little_endian_element(&mut source, element)
                    }
                    _ => parser.read_big_endian_element(&mut source, element),
                };
                read.map_err(|e| match source.limit() {
                    0 => format!("longer than {most} bytes"),
                    _ => e.to_string(),
                })
            }
        };
        let read = parsed.map_err(|message| {
            let place = format!("{} {i} of {}", element.name, element.count);
            match header.encoding {
                Encoding::Ascii => format!("line {}: {place}: {message}", reader.number),
                _ => format!("{place}: {message}"),
            }
        })?;
        f(read)?;
    }
    Ok(())
}
