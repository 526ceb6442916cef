//! Where a path leads, what may be done there, and which paths lead to the same file.

use std::fs::{self, Metadata};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Links followed before they count as a circle, as in Linux.
const MAX_LINKS: usize = 40;

/// What becomes of a path that is written.
#[derive(Debug)]
pub(super) enum Place {
    /// A new file takes the place of what is there, if anything is.
    Replaced(PathBuf, Option<Metadata>),
    /// What is there is overwritten: a device, a pipe, or a file that a new one could not stand in
    /// for.
    Overwritten(PathBuf),
    /// One of the files that the process was started with, by its number.
    Descriptor(u32, PathBuf),
}

impl Place {
    /// What would become of the path now.
    ///
    /// # Errors
    /// It may not be written, in words.
    pub fn of(path: &Path) -> io::Result<Self> {
        if path.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(io::Error::other("is the name of a folder"));
        }
        let path = match resolve(path)? {
            (path, Some(number)) => {
                fs::metadata(&path)?;
                return Ok(Self::Descriptor(number, path));
            }
            (path, None) => path,
        };
        let metadata = match fs::metadata(&path) {
            Ok(metadata) => metadata,
            Err(e) => {
                check_folder(&path)?;
                return match e.kind() {
                    ErrorKind::NotFound => Ok(Self::Replaced(path, None)),
                    // A name that is too long, for one.
                    _ => Err(e),
                };
            }
        };
        if metadata.is_dir() {
            return Err(io::Error::other("is a folder"));
        }
        check_permission(&path, &metadata)?;
        if metadata.is_file() && is_ours(&metadata) && check_folder(&path).is_ok() {
            return Ok(Self::Replaced(path, Some(metadata)));
        }
        Ok(Self::Overwritten(path))
    }
}

/// Fails now where writing would fail later: a missing folder, a file that is read-only.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    Place::of(path).map(drop)
}

/// The folder that a file is in.
pub(crate) fn folder(path: &Path) -> &Path {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}

/// Something that can only be written into: a device, a pipe.
pub(crate) fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
        || resolve(path).is_ok_and(|(_, number)| number.is_some())
}

/// Where symbolic links lead.
pub(crate) fn target(path: &Path) -> PathBuf {
    resolve(path).map_or_else(|_| path.to_owned(), |(path, _)| path)
}

/// Follows symbolic links, also to where nothing is yet. With the number of an open file if the
/// path stands for one.
fn resolve(path: &Path) -> io::Result<(PathBuf, Option<u32>)> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        let number = descriptor(&path);
        if number.is_some() {
            return Ok((path, number));
        }
        match fs::read_link(&path) {
            Ok(to) => path = folder(&path).join(to),
            Err(_) => return Ok((path, None)),
        }
    }
    Err(io::Error::other("is a circle of symbolic links"))
}

/// `N` of `/dev/fd/N` and `/proc/self/fd/N`: links that name no path.
fn descriptor(path: &Path) -> Option<u32> {
    let number = path.file_name()?.to_str()?.parse().ok()?;
    let folder = folder(path).canonicalize().ok()?;
    (folder.starts_with("/proc") && folder.ends_with("fd")).then_some(number)
}

/// Whether files can be made beside `path`. A process that is killed in here leaves nothing behind.
fn check_folder(path: &Path) -> io::Result<()> {
    let folder = folder(path);
    match fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => return Err(about(folder, ErrorKind::NotADirectory, "is not a folder")),
        Err(e) if e.kind() == ErrorKind::NotFound => {
            return Err(io::Error::new(
                e.kind(),
                format!("the folder {} does not exist", folder.display()),
            ));
        }
        Err(e) => return Err(about(folder, e.kind(), &e.to_string())),
    }
    let made = tempfile::tempfile_in(folder).map(drop);
    made.map_err(|e| {
        let what = format!(
            "no file can be made in the folder {}: {}",
            folder.display(),
            cause(&e)
        );
        io::Error::new(e.kind(), what)
    })
}

fn about(path: &Path, kind: ErrorKind, what: &str) -> io::Error {
    io::Error::new(kind, format!("{} {what}", path.display()))
}

/// What the system says, without the path that was tried.
fn cause(error: &io::Error) -> String {
    let code = error.raw_os_error().or_else(|| {
        error
            .get_ref()?
            .source()?
            .downcast_ref::<io::Error>()?
            .raw_os_error()
    });
    code.map_or_else(
        || error.to_string(),
        |code| io::Error::from_raw_os_error(code).to_string(),
    )
}

/// Whether this user may write what is there. A file that is read-only for everyone stays, even if
/// root could write it.
fn check_permission(path: &Path, metadata: &Metadata) -> io::Result<()> {
    if metadata.is_file() && metadata.permissions().readonly() {
        return Err(io::Error::new(ErrorKind::PermissionDenied, "is read-only"));
    }
    #[cfg(unix)]
    {
        use rustix::fs::{Access, AtFlags, CWD, accessat};
        accessat(CWD, path, Access::WRITE_OK, AtFlags::EACCESS).map_err(|e| {
            let what = format!("may not be written: {}", io::Error::from(e));
            io::Error::new(ErrorKind::PermissionDenied, what)
        })?;
    }
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
}

/// Whether a new file could have the owner of this one.
#[cfg(unix)]
fn is_ours(metadata: &Metadata) -> bool {
    let user = rustix::process::geteuid();
    user.is_root() || std::os::unix::fs::MetadataExt::uid(metadata) == user.as_raw()
}

#[cfg(not(unix))]
fn is_ours(_: &Metadata) -> bool {
    true
}

/// Equal if two paths lead to one file, however they are spelled.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Identity {
    /// Device and number of a file that is there.
    #[cfg(unix)]
    Node(u64, u64),
    /// Folder and name.
    Name(PathBuf),
}

impl Identity {
    /// `None` of devices and pipes, which nothing written into them is lost by, and of what cannot
    /// be found out.
    pub fn of(path: &Path) -> Option<Self> {
        if let Ok(metadata) = fs::metadata(path) {
            if !metadata.is_file() {
                return None;
            }
            #[cfg(unix)]
            {
                use std::os::unix::fs::MetadataExt;
                return Some(Self::Node(metadata.dev(), metadata.ino()));
            }
            #[cfg(not(unix))]
            return path.canonicalize().ok().map(Self::Name);
        }
        let (path, _) = resolve(path).ok()?;
        let name = path.file_name()?;
        Some(Self::Name(folder(&path).canonicalize().ok()?.join(name)))
    }
}
