//! Which files a render writes, and how nothing rendered is lost when they cannot be written; and
//! what goes to stdout.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::input::is_stdin;
use crate::files::{self, Identity};
use crate::film::output;
use crate::memory::Bytes;

/// Files the built-in scene is written to.
const DEFAULT_FILES: [&str; 2] = ["studio.exr", "studio.png"];

/// The files to write when none is named: in the current folder, called as the scene's film says
/// (`film_name`), or after the scene file. With a remark if the film asks for a format that is not
/// written.
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
            "the scene's film is called \"{name}\", and only .exr, .pfm and .png are written here: writing {} instead",
            replacement.display()
        );
        return (vec![replacement], Some(remark));
    }
    // scene.pbrt.gz is called scene, too; what comes from standard input has no name.
    let named = scene.file_name().filter(|_| !is_stdin(scene));
    let stem = named.map(Path::new).unwrap_or(Path::new("out"));
    let stem = match stem.extension() {
        Some(e) if e.eq_ignore_ascii_case("gz") => stem.with_extension(""),
        _ => stem.to_owned(),
    };
    (vec![stem.with_extension("exr")], None)
}

/// A file, not a pipe or a device, that will hold what the name says: EXR.
pub fn is_exr_file(path: &Path) -> bool {
    path.extension().is_some() && output::is_exr(path) && !files::is_special(path)
}

/// By its name.
pub fn is_png(path: &Path) -> bool {
    (path.extension()).is_some_and(|e| e.eq_ignore_ascii_case("png"))
}

/// Each path once, however often it is given.
pub fn once(paths: &[PathBuf]) -> Vec<&Path> {
    let mut once: Vec<&Path> = Vec::new();
    for path in paths {
        if !once.contains(&path.as_path()) {
            once.push(path);
        }
    }
    once
}

/// Fails now where writing a picture would fail after the render.
pub fn check_pictures(paths: &[PathBuf]) -> Result<(), Failure> {
    for path in paths {
        output::check_writable(path).map_err(|e| Failure::Input(e.to_string()))?;
    }
    Ok(())
}

/// Fails now where the disk has no room for pictures of so many pixels, even uncompressed; `layers`
/// of three channels in EXR files. Disks fill up later, too: see [`save`].
pub fn check_room(paths: &[PathBuf], pixels: u64, layers: u64) -> Result<(), Failure> {
    let mut wanted: Vec<(PathBuf, u64)> = Vec::new();
    for path in paths.iter().filter(|path| !files::is_special(path)) {
        let channels: u64 = match output::is_exr(path) {
            true => 3 * layers,
            false => 3,
        };
        let folder = files::folder(&files::target(path)).to_owned();
        let bytes = pixels * channels * size_of::<f32>() as u64;
        match wanted.iter_mut().find(|(other, _)| *other == folder) {
            Some((_, sum)) => *sum += bytes,
            None => wanted.push((folder, bytes)),
        }
    }
    for (folder, bytes) in wanted {
        // Where the system does not say, the render goes on.
        let Ok(room) = fs4::available_space(&folder) else {
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

/// Fails if what is going to be written would overwrite what has been read (`inputs`), or would be
/// overwritten itself by what is written after it.
pub fn check_distinct<'a>(
    outputs: impl IntoIterator<Item = &'a Path>,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let known = |path: &'a Path| Some((Identity::of(path)?, path));
    let inputs: HashMap<Identity, &Path> = inputs.into_iter().filter_map(known).collect();
    let mut written: HashMap<Identity, &Path> = HashMap::new();
    for (identity, path) in outputs.into_iter().filter_map(known) {
        let name = path.display();
        if let Some(input) = inputs.get(&identity) {
            let input = input.display();
            return Err(Failure::Input(format!(
                "{name}: would overwrite {input}, which is an input; choose another name"
            )));
        }
        if let Some(before) = written.insert(identity, path) {
            let what = match before == path {
                true => "would be written twice".to_string(),
                false => format!(
                    "is the same file as {}, which is written, too",
                    before.display()
                ),
            };
            return Err(Failure::Input(format!(
                "{name}: {what}; choose another name"
            )));
        }
    }
    Ok(())
}

/// Writes a file, or, if that fails, writes it where there may be room: the folders for temporary
/// files and of the user, the current one.
///
/// # Errors
/// The file is not where it was asked for; the message says where it is.
pub fn save<E: Display>(path: &Path, write: impl Fn(&Path) -> Result<(), E>) -> Result<(), String> {
    save_or(path, path.file_name().unwrap_or_default(), write)
}

/// [`save`] of a picture, whose name must have an extension.
pub fn save_picture<E: Display>(
    path: &Path,
    write: impl Fn(&Path) -> Result<(), E>,
) -> Result<(), String> {
    save_or(path, &output::file_name(path), write)
}

/// Most characters of a name that a saved file repeats, the last ones: names have a limit.
const MAX_REPEATED: usize = 40;

fn save_or<E: Display>(
    path: &Path,
    name: &OsStr,
    write: impl Fn(&Path) -> Result<(), E>,
) -> Result<(), String> {
    let Err(error) = write(path) else {
        return Ok(());
    };
    let name = name.to_string_lossy();
    let skipped = name.chars().count().saturating_sub(MAX_REPEATED);
    let name: String = name.chars().skip(skipped).collect();
    let process = std::process::id();
    let folders = [
        Some(std::env::temp_dir()),
        std::env::home_dir(),
        std::env::current_dir().ok(),
    ];
    let mut second = None;
    for folder in folders.into_iter().flatten() {
        // Others may write to these folders: what is there is left alone.
        let mut names = (0..100).map(|i| match i {
            0 => folder.join(format!("phalanx-{process}-{name}")),
            i => folder.join(format!("phalanx-{process}-{i}-{name}")),
        });
        let Some(refuge) = names.find(|path| path.symlink_metadata().is_err()) else {
            continue;
        };
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
    files::check(path).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))
}

/// Writes a text file in one step; into pipes and devices directly.
pub fn write_text(path: &Path, text: &str) -> Result<(), String> {
    write_bytes(path, text.as_bytes())
}

/// The same for any content.
pub fn write_bytes(path: &Path, content: &[u8]) -> Result<(), String> {
    files::write(path, content).map_err(|e| format!("{}: {e}", path.display()))
}

/// Prints a result; a reader that has gone away is no concern.
pub fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Io(format!("stdout: {e}"))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::output::OutputError;
    use std::fs;

    #[test]
    fn names() {
        let files = |scene: Option<&str>, film| {
            let (paths, remark) = default_files(scene.map(Path::new), film);
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            (names.join(" "), remark.is_some())
        };
        assert_eq!(files(None, Some("x.exr")).0, "studio.exr studio.png");
        let scene = Some("some/where/room.pbrt");
        assert_eq!(files(scene, None), ("room.exr".into(), false));
        assert_eq!(files(scene, Some("")), ("room.exr".into(), false));
        assert_eq!(files(Some("-"), None), ("out.exr".into(), false));
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
