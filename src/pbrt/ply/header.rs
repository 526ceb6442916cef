//! The header of a PLY file, judged before anything is allocated.

use std::io::{BufRead, Read};

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Encoding, Header, PropertyType, ScalarType};

use super::elements::Vertex;

/// Longest header that is read.
const MAX_HEADER: u64 = 1 << 20;

/// The header, and how many lines it has. The text is cut out first: the crate would read a line of
/// any length, and refuse comments that are not UTF-8.
pub(super) fn read_header(source: &mut dyn BufRead) -> Result<(Header, usize), String> {
    let mut text = Vec::new();
    let mut lines = 0;
    loop {
        let start = text.len();
        let mut rest = source.take(MAX_HEADER - start as u64);
        rest.read_until(b'\n', &mut text)
            .map_err(|e| e.to_string())?;
        lines += 1;
        match text[start..].trim_ascii() {
            b"end_header" => break,
            magic if lines == 1 && magic != b"ply" => return Err("not a PLY file".into()),
            _ if text.len() as u64 == MAX_HEADER => return Err("the header is too long".into()),
            _ if text.len() == start => return Err("the header has no end: truncated?".into()),
            _ => {}
        }
    }
    let text = String::from_utf8_lossy(&text);
    let mut reader = Reader::new(text.as_bytes());
    let header = Parser::<Vertex>::new().read_header(&mut reader);
    Ok((header.map_err(|e| e.to_string())?, lines))
}

/// Rejects headers whose elements cannot fit into the file.
pub(super) fn check_counts(header: &Header, bytes: u64) -> Result<(), String> {
    let size = |t: &ScalarType| match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let mut least = 0u64;
    for element in header.elements.values() {
        let each: u64 = match header.encoding {
            // A digit and a separator for every property, a line end for an element without.
            Encoding::Ascii => (2 * element.properties.len() as u64).max(1),
            _ => element
                .properties
                .values()
                .map(|p| match &p.data_type {
                    PropertyType::Scalar(t) | PropertyType::List(t, _) => size(t),
                })
                .sum(),
        };
        if element.count > u32::MAX as usize {
            return Err(format!(
                "{} elements {:?} are too many",
                element.count, element.name
            ));
        }
        least = least.saturating_add(each.saturating_mul(element.count as u64));
    }
    // The last line of an ASCII file may lack its end.
    if least > bytes.saturating_add(1) {
        return Err(format!(
            "the header promises at least {least} bytes of elements, the file cannot hold more than {bytes}: truncated?"
        ));
    }
    Ok(())
}
