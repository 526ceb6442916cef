//! Where a scene came from, and whether it still is what it was.

use super::{Malformed, Reader, Writer};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Most files of a scene.
const FILES: usize = 1 << 20;
/// Bytes of a digest.
const DIGEST: usize = 32;

/// The files that a scene was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// The scene's own file, from the root; `None` for a scene that was read from none.
    pub path: Option<PathBuf>,
    /// What messages and pictures call it.
    pub name: String,
    /// All of its files, those beneath its folder by their names there; with digests.
    files: Vec<(PathBuf, [u8; DIGEST])>,
}

/// What is not as it was.
#[derive(Debug, thiserror::Error)]
pub enum Change {
    /// A file has another content.
    #[error("{} has changed since", .0.display())]
    Content(PathBuf),
    /// A file cannot be read any more.
    #[error("{}: {error}", path.display())]
    Gone {
        /// Which one.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The scene has files that it had not, or the other way round.
    #[error("the scene is read from other files than before, {} among them", .0.display())]
    Other(PathBuf),
}

impl Origin {
    /// Of a scene that was read from `files`; `path` is its own.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn new(path: Option<&Path>, name: &str, files: &[PathBuf]) -> Result<Self, Change> {
        let path = path.map(std::path::absolute).transpose();
        let path = path.map_err(|error| Change::Gone {
            path: name.into(),
            error,
        })?;
        let mut origin = Self {
            path,
            name: name.into(),
            files: Vec::with_capacity(files.len()),
        };
        for file in files {
            let digest = digest(file).map_err(|error| Change::Gone {
                path: file.clone(),
                error,
            })?;
            let named = origin.within(file);
            origin.files.push((named, digest));
        }
        Ok(origin)
    }

    /// Whether a scene was read from files of the same names and content.
    pub fn is_like(&self, other: &Self) -> bool {
        self.files == other.files
    }

    /// How many files.
    pub fn files(&self) -> usize {
        self.files.len()
    }

    /// Whether all files are as they were.
    ///
    /// # Errors
    /// One is not.
    pub fn check(&self) -> Result<(), Change> {
        for (name, digest_then) in &self.files {
            let path = self.folder().join(name);
            match digest(&path) {
                Ok(now) if now == *digest_then => {}
                Ok(_) => return Err(Change::Content(path)),
                Err(error) => return Err(Change::Gone { path, error }),
            }
        }
        Ok(())
    }

    /// Whether a scene that was read again came from the same files.
    ///
    /// # Errors
    /// It did not.
    pub fn check_files(&self, files: &[PathBuf]) -> Result<(), Change> {
        let now: Vec<PathBuf> = files.iter().map(|file| self.within(file)).collect();
        let then = self.files.iter().map(|(name, _)| name);
        let more = now.iter().find(|name| !then.clone().any(|t| t == *name));
        let less = then.clone().find(|name| !now.contains(name));
        match more.or(less) {
            Some(name) => Err(Change::Other(self.folder().join(name))),
            None => Ok(()),
        }
    }

    fn folder(&self) -> &Path {
        self.path
            .as_deref()
            .map_or(Path::new(""), crate::files::folder)
    }

    /// The name of a file in the folder of the scene.
    fn within(&self, file: &Path) -> PathBuf {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        file.strip_prefix(self.folder()).unwrap_or(&file).to_owned()
    }

    /// Writes it.
    pub fn save(&self, to: &mut Writer) {
        let Self { path, name, files } = self;
        to.option(path.as_ref(), |to, path| save_path(to, path));
        to.text(name);
        to.count(files.len());
        for (name, digest) in files {
            save_path(to, name);
            to.value(*digest);
        }
    }

    /// Reads it.
    ///
    /// # Errors
    /// It is none.
    pub fn load(from: &mut Reader) -> Result<Self, Malformed> {
        let path = from.option(load_path)?;
        let name = from.text()?;
        let count = from.count(FILES)?;
        let mut files = Vec::new();
        for _ in 0..count {
            files.push((load_path(from)?, from.value()?));
        }
        Ok(Self { path, name, files })
    }
}

fn save_path(to: &mut Writer, path: &Path) {
    to.table(path.as_os_str().as_encoded_bytes());
}

fn load_path(from: &mut Reader) -> Result<PathBuf, Malformed> {
    let bytes = from.list::<u8>(1 << 16)?;
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStringExt;
        Ok(std::ffi::OsString::from_vec(bytes).into())
    }
    #[cfg(not(unix))]
    {
        let path = String::from_utf8(bytes);
        path.map(PathBuf::from)
            .map_err(|_| Malformed::new("a path is not UTF-8"))
    }
}

fn digest(path: &Path) -> io::Result<[u8; DIGEST]> {
    let mut hasher = blake3::Hasher::new();
    io::copy(&mut File::open(path)?, &mut hasher)?;
    Ok(*hasher.finalize().as_bytes())
}
