//! Portable float map: a text header, then `f32` rows from the bottom up; the sign of the scale is
//! the byte order.

use std::io::{self, Write};

use super::{MAX_PIXELS, Picture};

/// Writes `PF`, little endian. PFM knows no crop: only the pixels are stored.
pub fn write(out: &mut impl Write, picture: &Picture) -> io::Result<()> {
    write!(out, "PF\n{} {}\n-1.0\n", picture.width, picture.height)?;
    for row in picture
        .pixels
        .chunks_exact(picture.width.max(1) as usize)
        .rev()
    {
        let bytes: Vec<u8> = row.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Reads `PF` (RGB) and `Pf` (grey, copied to all channels), values times the magnitude of the
/// header's scale.
pub fn read(file: &[u8]) -> Result<Picture, String> {
    let mut rest = file;
    let magic = word(&mut rest)?;
    let channels = match magic {
        "PF" => 3,
        "Pf" => 1,
        _ => return Err("not a PFM file".into()),
    };
    let mut size = || {
        let text = word(&mut rest)?;
        text.parse::<u32>()
            .map_err(|_| format!("{text:?} is not a size"))
    };
    let (width, height) = (size()?, size()?);
    let text = word(&mut rest)?;
    let scale = text
        .parse::<f32>()
        .ok()
        .filter(|s| s.is_finite() && *s != 0.0);
    let scale = scale.ok_or_else(|| format!("{text:?} is not a scale"))?;

    let pixels = width as u64 * height as u64;
    if pixels == 0 || pixels > MAX_PIXELS {
        return Err(format!("{width} x {height} is not a size PFM files have"));
    }
    let needed = pixels * channels * 4;
    if (rest.len() as u64) < needed {
        return Err(format!(
            "{width} x {height} pixels need {needed} bytes, {} are left: truncated?",
            rest.len()
        ));
    }
    let decode = |b: &[u8]| {
        let bytes = [b[0], b[1], b[2], b[3]];
        let value = if scale < 0.0 {
            f32::from_le_bytes(bytes)
        } else {
            f32::from_be_bytes(bytes)
        };
        value * scale.abs()
    };
    let row_bytes = width as usize * channels as usize * 4;
    let rows = rest[..needed as usize].chunks_exact(row_bytes).rev();
    let pixels = rows
        .flat_map(|row| row.chunks_exact(channels as usize * 4))
        .map(|pixel| {
            if channels == 3 {
                [decode(pixel), decode(&pixel[4..]), decode(&pixel[8..])]
            } else {
                [decode(pixel); 3]
            }
        });
    Ok(Picture {
        width,
        height,
        offset: [0; 2],
        full: [width, height],
        pixels: pixels.collect(),
    })
}

/// The next word of the header, with the single byte of white space that ends it.
fn word<'a>(rest: &mut &'a [u8]) -> Result<&'a str, String> {
    let start = rest
        .iter()
        .position(|b| !b.is_ascii_whitespace())
        .unwrap_or(rest.len());
    let text = &rest[start..];
    // No number of a header is longer; without a bound a binary file would be searched to its end.
    let end = text
        .iter()
        .take(64)
        .position(|b| b.is_ascii_whitespace())
        .ok_or("not a PFM file")?;
    *rest = &text[end + 1..];
    std::str::from_utf8(&text[..end]).map_err(|_| "not a PFM file".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn big_endian_and_grey() {
        let mut file = b"Pf\n1 2\n2.0\n".to_vec();
        file.extend([0.5f32, 3.0].iter().flat_map(|v| v.to_be_bytes()));
        assert_eq!(read(&file).unwrap().pixels, vec![[6.0; 3], [1.0; 3]]);
    }

    #[test]
    fn hostile_headers() {
        for text in [
            "",
            "PF",
            "PF\n1 1\n",
            "P6\n1 1\n255\n",
            "PF\n0 5\n-1\n",
            "PF\n-1 1\n-1\n",
            "PF\n1 1\n0\n",
            "PF\n1 1\nnan\n",
        ] {
            assert!(read(text.as_bytes()).is_err(), "{text:?}");
        }
        assert!(read(b"PF\n4294967295 4294967295\n-1\n").is_err());
        assert!(
            read(b"PF\n10000 10000\n-1\nabcd")
                .unwrap_err()
                .contains("truncated")
        );
    }
}
