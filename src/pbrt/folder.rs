//! Where the files that a scene names are, and which they have been.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder that names in a scene are relative to. It remembers every name it was asked for.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    asked: RefCell<BTreeSet<PathBuf>>,
}

impl Folder {
    /// `main` is the scene's own file, if it has one.
    pub fn new(path: &Path, main: Option<&Path>) -> Self {
        Self {
            path: path.to_owned(),
            asked: RefCell::new(main.into_iter().map(Path::to_owned).collect()),
        }
    }

    /// The file of this name; it counts as read if there is one.
    pub fn join(&self, name: impl AsRef<Path>) -> PathBuf {
        let path = self.path.join(name);
        self.asked.borrow_mut().insert(path.clone());
        path
    }

    /// The files that have been asked for and are there, in order of their names.
    pub fn files(&self) -> Vec<PathBuf> {
        let asked = self.asked.borrow();
        asked.iter().filter(|p| p.is_file()).cloned().collect()
    }
}
