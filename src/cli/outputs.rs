//! Which files a render writes, and how nothing rendered is lost when they cannot be written; and what goes to stdout.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::Failure;
use crate::film::output;
use crate::memory::Bytes;

/// Files the built-in scene is written to.
const DEFAULT_FILES: [&str; 2] = ["cornell.exr", "cornell.png"];

/// The files to write when none is named: in the current folder, called as the scene's film says (`film_name`), or after the scene file.
/// With a remark if the film asks for a format that is not written.
pub fn default_files(
    scene: Option<&Path>,
    film_name: Option<&str>,
) -> (Vec<PathBuf>, Option<String>) {
    let Some(scene) = scene else {
        return (DEFAULT_FILES.map(PathBuf::from).into(), None);
    };
    // A file's own folders are those of the machine it was made on.
    let name = film_name.and_then(|n| n.rsplit(['/', '\\']).next());
    if let Some(name) = name.filter(|n| !n.is_empty() && *n != "." && *n != "..") {
        let path = PathBuf::from(name);
        if output::is_supported(&path) {
            return (vec![path], None);
        }
        let replacement = path.with_extension("exr");
        let remark = format!(
            "the scene's film is called \"{name}\", which is not a format written here; writing {} instead",
            replacement.display()
        );
        return (vec![replacement], Some(remark));
    }
    // scene.pbrt.gz is called scene, too.
    let stem = scene.file_name().map(Path::new).unwrap_or(Path::new("out"));
    let stem = match stem.extension() {
        Some(e) if e.eq_ignore_ascii_case("gz") => stem.with_extension(""),
        _ => stem.to_owned(),
    };
    (vec![stem.with_extension("exr")], None)
}

/// Fails now where writing a picture would fail after the render.
pub fn check_pictures(paths: &[PathBuf]) -> Result<(), Failure> {
    for path in paths {
        output::check_writable(path).map_err(|e| Failure::Input(e.to_string()))?;
    }
    Ok(())
}

/// Fails now where the disk has no room for pictures of so many pixels, even uncompressed; `layers` of three channels in EXR files. Disks fill up
/// later, too: see [`save`].
pub fn check_room(paths: &[PathBuf], pixels: u64, layers: u64) -> Result<(), Failure> {
    let mut wanted: Vec<(&Path, u64)> = Vec::new();
    for path in paths.iter().filter(|path| !is_special(path)) {
        let channels: u64 = match output::is_exr(path) {
            true => 3 * layers,
            false => 3,
        };
        let folder = output::folder(path);
        let bytes = pixels * channels * size_of::<f32>() as u64;
        match wanted.iter_mut().find(|(other, _)| *other == folder) {
            Some((_, sum)) => *sum += bytes,
            None => wanted.push((folder, bytes)),
        }
    }
    for (folder, bytes) in wanted {
        // Where the system does not say, the render goes on.
        let Ok(room) = fs4::available_space(folder) else {
            continue;
        };
        if room < bytes {
            return Err(Failure::Io(format!(
                "{}: the disk has {} left, and the picture may need {}",
                folder.display(),
                Bytes(room),
                Bytes(bytes)
            )));
        }
    }
    Ok(())
}

/// Writes a file, or, if that fails, writes it where there may be room: the folders for temporary files and of the user, the current one.
///
/// # Errors
/// The file is not where it was asked for; the message says where it is.
pub fn save<E: std::fmt::Display>(
    path: &Path,
    write: impl Fn(&Path) -> Result<(), E>,
) -> Result<(), String> {
    let Err(error) = write(path) else {
        return Ok(());
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = format!("phalanx-{}-{name}", std::process::id());
    let folders = [
        Some(std::env::temp_dir()),
        std::env::home_dir(),
        std::env::current_dir().ok(),
    ];
    let mut second = None;
    for folder in folders.into_iter().flatten() {
        let refuge = folder.join(&name);
        match write(&refuge) {
            Ok(()) => return Err(format!("{error}; it is saved as {}", refuge.display())),
            Err(e) => second = second.or(Some(e)),
        }
    }
    let second = second.map_or(String::new(), |e| format!(": {e}"));
    Err(format!("{error}; nor can it be saved elsewhere{second}"))
}

/// Fails now where [`write_text`] would fail after the render.
pub fn check_text(path: &Path) -> Result<(), Failure> {
    let fail = |e: io::Error| Failure::Input(format!("{}: {e}", path.display()));
    if path.is_dir() {
        return Err(Failure::Input(format!("{}: is a folder", path.display())));
    }
    if is_special(path) {
        return Ok(());
    }
    output::check_folder(path).map_err(fail)
}

/// Writes a text file in one step; into pipes and devices directly.
pub fn write_text(path: &Path, text: &str) -> Result<(), String> {
    write_bytes(path, text.as_bytes())
}

/// The same for any content.
pub fn write_bytes(path: &Path, content: &[u8]) -> Result<(), String> {
    let written = if is_special(path) {
        fs::write(path, content)
    } else {
        output::temporary(path).and_then(|mut file| {
            file.write_all(content)?;
            file.as_file().sync_all()?;
            file.persist(path).map(drop).map_err(|e| e.error)
        })
    };
    written.map_err(|e| format!("{}: {e}", path.display()))
}

/// Prints a result; a reader that has gone away is no concern.
pub fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Io(format!("stdout: {e}"))),
        _ => Ok(()),
    }
}

/// Something that must be written into, not replaced.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::output::OutputError;

    #[test]
    fn names() {
        let files = |scene: Option<&str>, film| {
            let (paths, remark) = default_files(scene.map(Path::new), film);
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            (names.join(" "), remark.is_some())
        };
        assert_eq!(files(None, Some("x.exr")).0, "cornell.exr cornell.png");
        let scene = Some("some/where/room.pbrt");
        assert_eq!(files(scene, None), ("room.exr".into(), false));
        assert_eq!(files(scene, Some("")), ("room.exr".into(), false));
        assert_eq!(files(scene, Some("..")), ("room.exr".into(), false));
        assert_eq!(files(scene, Some("a.PNG")), ("a.PNG".into(), false));
        assert_eq!(files(scene, Some("/etc/a.exr")), ("a.exr".into(), false));
        assert_eq!(files(scene, Some("a.tga")), ("a.exr".into(), true));
        assert_eq!(
            files(Some("room.pbrt.gz"), None),
            ("room.exr".into(), false)
        );
    }

    #[test]
    fn a_picture_that_cannot_be_written_is_saved_elsewhere() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/a.pfm");
        let write = |path: &Path| {
            fs::write(path, "picture").map_err(|source| OutputError::Io {
                path: path.into(),
                source,
            })
        };
        let message = save(&path, write).unwrap_err();
        let refuge = message.rsplit(" as ").next().unwrap();
        assert_eq!(fs::read(refuge).unwrap(), b"picture");
        fs::remove_file(refuge).unwrap();
        save(&folder.path().join("a.pfm"), write).unwrap();
    }

    #[test]
    fn text_goes_into_devices_and_replaces_files() {
        write_text(Path::new("/dev/null"), "x").unwrap();
        assert!(is_special(Path::new("/dev/null")));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        for text in ["long text", "short"] {
            write_text(&path, text).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert!(check_text(folder.path()).is_err());
        assert!(check_text(&folder.path().join("missing/a")).is_err());
    }
}
