//! Writing beside a file, and putting what is written in its place.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use tempfile::NamedTempFile;

use super::place::{Place, folder};

/// Names of temporary files begin with this.
const PREFIX: &str = ".phalanx-";

/// Temporary files that have a name. A process that ends without running destructors removes them
/// first ([`abandon`]).
static NAMED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn named() -> MutexGuard<'static, Vec<PathBuf>> {
    NAMED.lock().unwrap_or_else(|p| p.into_inner())
}

/// Removes all temporary files, and lets no other be made: the process is about to end.
pub(crate) fn abandon() {
    let mut names = ManuallyDrop::new(named());
    for name in names.drain(..) {
        let _ = std::fs::remove_file(name);
    }
}

/// Content on its way to a path. The path changes only at [`Replacement::finish`]; without it
/// nothing remains.
#[derive(Debug)]
pub(crate) struct Replacement {
    place: Place,
    content: Content,
}

#[derive(Debug)]
enum Content {
    /// A file without a name, which vanishes with the process.
    #[cfg(target_os = "linux")]
    Unnamed(File),
    Named(Temporary),
    /// For what is written into: pipes cannot be sought in.
    Buffer(Cursor<Vec<u8>>),
}

impl Replacement {
    /// # Errors
    /// The path may not be written, in words.
    pub fn of(path: &Path) -> io::Result<Self> {
        let place = Place::of(path)?;
        let content = match &place {
            Place::Replaced(path, _) => Content::beside(path)?,
            _ => Content::Buffer(Cursor::default()),
        };
        Ok(Self { place, content })
    }

    /// Puts the content in its place.
    pub fn finish(self) -> io::Result<()> {
        match (self.place, self.content) {
            (Place::Replaced(path, old), content) => content.replace(&path, old.as_ref()),
            (Place::Overwritten(path), Content::Buffer(content)) => {
                let mut file = OpenOptions::new().write(true).open(&path)?;
                if file.metadata()?.is_file() {
                    file.set_len(0)?;
                }
                write_all(&mut file, content.get_ref())
            }
            (Place::Descriptor(number, path), Content::Buffer(content)) => {
                write_all(&mut open(number, &path)?, content.get_ref())
            }
            _ => Err(io::Error::other("was neither replaced nor written into")),
        }
    }
}

impl Write for Replacement {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.content {
            #[cfg(target_os = "linux")]
            Content::Unnamed(file) => file.write(bytes),
            Content::Named(temporary) => temporary.file.write(bytes),
            Content::Buffer(buffer) => buffer.write(bytes),
        }
    }

    /// Nothing is held back here.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Replacement {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.content {
            #[cfg(target_os = "linux")]
            Content::Unnamed(file) => file.seek(to),
            Content::Named(temporary) => temporary.file.seek(to),
            Content::Buffer(buffer) => buffer.seek(to),
        }
    }
}

/// A file that the process was started with: where the last one to write it left off. Numbers that
/// are not those of the standard streams are opened again; at the end, so that what others wrote
/// through them stays.
fn open(number: u32, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::fd::AsFd;
        let own = match number {
            1 => Some(io::stdout().as_fd().try_clone_to_owned()),
            2 => Some(io::stderr().as_fd().try_clone_to_owned()),
            _ => None,
        };
        if let Some(own) = own {
            return own.map(File::from);
        }
    }
    #[cfg(not(unix))]
    let _ = number;
    OpenOptions::new().append(true).open(path)
}

fn write_all(file: &mut File, content: &[u8]) -> io::Result<()> {
    file.write_all(content)?;
    match file.metadata()?.is_file() {
        true => file.sync_all(),
        false => Ok(()),
    }
}

impl Content {
    fn beside(path: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = unnamed::open(folder(path)) {
            return Ok(Self::Unnamed(file));
        }
        Temporary::beside(path).map(Self::Named)
    }

    fn replace(self, path: &Path, old: Option<&Metadata>) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Unnamed(file) => {
                keep(&file, old)?;
                file.sync_all()?;
                unnamed::link(&file, path)
            }
            Self::Named(temporary) => {
                keep(temporary.file.as_file(), old)?;
                temporary.file.as_file().sync_all()?;
                temporary.persist(path)
            }
            Self::Buffer(_) => Err(io::Error::other("a buffer is no file")),
        }
    }
}

/// Gives a file the permissions of the one it replaces, and its owner if we may.
fn keep(file: &File, old: Option<&Metadata>) -> io::Result<()> {
    let Some(old) = old else { return Ok(()) };
    #[cfg(unix)]
    {
        use rustix::fs::{Gid, Mode, Uid, fchmod, fchown};
        use std::os::unix::fs::MetadataExt;
        let (now, mode) = (file.metadata()?, old.mode() & 0o777);
        let user = (now.uid() != old.uid()).then(|| Uid::from_raw(old.uid()));
        let group = (now.gid() != old.gid()).then(|| Gid::from_raw(old.gid()));
        if user.is_some() || group.is_some() {
            // Of a group that we are not in, the permissions for all others must do.
            let _ = fchown(file, user, group);
        }
        if now.mode() & 0o777 != mode {
            fchmod(file, Mode::from_raw_mode(mode as _))?;
        }
    }
    #[cfg(not(unix))]
    file.set_permissions(old.permissions())?;
    Ok(())
}

/// A temporary file with a name, where there are none without.
#[derive(Debug)]
struct Temporary {
    file: NamedTempFile,
}

impl Temporary {
    fn beside(path: &Path) -> io::Result<Self> {
        let mut names = named();
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder(path))?;
        names.push(file.path().to_owned());
        Ok(Self { file })
    }

    fn persist(self, path: &Path) -> io::Result<()> {
        let name = self.file.path().to_owned();
        let done = self.file.persist(path).map(drop).map_err(|e| e.error);
        named().retain(|n| *n != name);
        done
    }
}

#[cfg(target_os = "linux")]
mod unnamed {
    //! Files without a name (`O_TMPFILE`): a process killed while it writes one leaves nothing
    //! behind.

    use std::os::fd::AsRawFd;

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat};

    use super::*;

    /// `None` where the file system, or the kernel, has none, or they could get no name later.
    pub fn open(folder: &Path) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = rustix::fs::open(folder, flags, Mode::from_raw_mode(0o666)).ok()?;
        let file = File::from(file);
        Path::new(&own_name(&file)).exists().then_some(file)
    }

    fn own_name(file: &File) -> String {
        format!("/proc/self/fd/{}", file.as_raw_fd())
    }

    fn link_to(file: &File, path: &Path) -> io::Result<()> {
        let own = own_name(file);
        Ok(linkat(
            CWD,
            own.as_str(),
            CWD,
            path,
            AtFlags::SYMLINK_FOLLOW,
        )?)
    }

    /// Gives the file its name. Where that is taken, the file needs another one for a moment: a
    /// link cannot replace.
    pub fn link(file: &File, path: &Path) -> io::Result<()> {
        match link_to(file, path) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            done => return done,
        }
        let mut names = named();
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        let linked = builder.make_in(folder(path), |name| link_to(file, name))?;
        names.push(linked.path().to_owned());
        let done = linked.persist(path).map(drop).map_err(|e| e.error);
        names.pop();
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// As where files without a name cannot be had.
    fn named_file(path: &Path) -> Replacement {
        Replacement {
            place: Place::of(path).unwrap(),
            content: Content::Named(Temporary::beside(path).unwrap()),
        }
    }

    #[test]
    fn with_or_without_a_name_the_content_comes_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let start: [fn(&Path) -> Replacement; 2] =
            [|path| Replacement::of(path).unwrap(), named_file];
        for (i, start) in start.into_iter().enumerate() {
            for old in [None, Some("old")] {
                let _ = fs::remove_file(&path);
                if let Some(text) = old {
                    fs::write(&path, text).unwrap();
                }
                let mut new = start(&path);
                new.write_all(b"nxw").unwrap();
                new.seek(SeekFrom::Start(1)).unwrap();
                new.write_all(b"e").unwrap();
                assert_eq!(fs::read_to_string(&path).ok().as_deref(), old);
                new.finish().unwrap();
                assert_eq!(fs::read_to_string(&path).unwrap(), "new", "{i}");
                start(&path).write_all(b"given up").unwrap();
                assert_eq!(fs::read_to_string(&path).unwrap(), "new");
                assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
            }
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn there_is_no_name_to_be_left_behind() {
        let folder = tempfile::tempdir().unwrap();
        let new = Replacement::of(&folder.path().join("a")).unwrap();
        if matches!(new.content, Content::Unnamed(_)) {
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        }
    }

    #[test]
    fn names_are_known_while_they_last() {
        let folder = tempfile::tempdir().unwrap();
        let known = |path: &Path| named().iter().any(|name| name == path);
        let path = folder.path().join("a");
        let temporary = Temporary::beside(&path).unwrap();
        let name = temporary.file.path().to_owned();
        assert!(known(&name));
        temporary.persist(&path).unwrap();
        assert!(!known(&name) && path.exists());
    }
}
