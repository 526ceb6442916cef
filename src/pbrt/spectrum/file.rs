//! Spectra in files of their own.

use std::fs;
use std::path::Path;

use crate::formats::file_bytes;
use crate::scene::spectrum::Sample;

/// Largest `.spd` file read: measured spectra have a few thousand lines at most.
const MAX_SPD_BYTES: u64 = 1 << 20;

/// Reads pairs of wavelength (nm) and value, separated by any white space; `#` starts a comment.
pub fn read_spd(path: &Path) -> Result<Vec<Sample>, String> {
    let name = path.display();
    let size = file_bytes(path).map_err(|e| format!("{name}: {e}"))?;
    if size > MAX_SPD_BYTES {
        return Err(format!("{name}: {size} bytes are too many for a spectrum"));
    }
    let text = fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
    let mut numbers = Vec::new();
    for (line, content) in text.lines().enumerate() {
        for word in content.split('#').next().unwrap_or("").split_whitespace() {
            let number = word.parse::<f32>().ok().filter(|v| v.is_finite());
            numbers.push(
                number.ok_or_else(|| format!("{name}:{}: {word:?} is not a number", line + 1))?,
            );
        }
    }
    if numbers.is_empty() {
        return Err(format!("{name}: no pairs of wavelength and value"));
    }
    if !numbers.len().is_multiple_of(2) {
        return Err(format!("{name}: the last wavelength has no value"));
    }
    Ok(numbers
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn spd_files() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        write!(file, "# gold\n400 1.5 # blue\n\n500\t0.5\n").unwrap();
        assert_eq!(
            read_spd(file.path()).unwrap(),
            vec![(400.0, 1.5), (500.0, 0.5)]
        );
        write!(file, "600 x").unwrap();
        assert!(read_spd(file.path()).unwrap_err().contains(":5: \"x\""));
    }
}
