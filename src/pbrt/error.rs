//! Where something stands in a scene file, and what is wrong with it.

use std::fmt;
use std::rc::Rc;

use crate::brief::brief;

/// Why a scene could not be loaded. Displays as one line,
/// `file:line:column: Directive: what is wrong; what could be used instead`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(pub(super) String);

/// A place in a scene file, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pos {
    pub file: Rc<str>,
    pub line: u32,
    pub column: u32,
}

impl fmt::Display for Pos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

impl Pos {
    pub fn error(&self, what: impl fmt::Display) -> SceneError {
        SceneError(brief(&format!("{self}: {what}")))
    }
}

impl SceneError {
    /// An error of no place.
    pub(super) fn plain(what: impl fmt::Display) -> Self {
        Self(brief(&what.to_string()))
    }
}

/// A directive in a file, as messages name it: `Shape "sphere"`.
#[derive(Clone, Debug)]
pub(super) struct Site {
    pub pos: Pos,
    pub label: String,
}

impl Site {
    pub fn new(pos: Pos, label: impl Into<String>) -> Self {
        Self {
            pos,
            label: brief(&label.into()),
        }
    }

    pub fn error(&self, what: impl fmt::Display) -> SceneError {
        SceneError(brief(&format!("{}: {}: {what}", self.pos, self.label)))
    }

    /// `scene.pbrt:42`, for reports on materials and lights.
    pub fn origin(&self) -> String {
        format!("{}:{}", self.pos.file, self.pos.line)
    }
}

/// Warnings in the order they arose, bounded so that a broken file of millions of lines does not
/// fill memory.
#[derive(Debug, Default)]
pub(super) struct Report {
    warnings: Vec<String>,
    suppressed: u64,
    said: std::collections::HashSet<String>,
}

const MAX_WARNINGS: usize = 200;

impl Report {
    pub fn warn(&mut self, message: String) {
        if self.warnings.len() < MAX_WARNINGS {
            self.warnings.push(message);
        } else {
            self.suppressed += 1;
        }
    }

    pub fn warn_at(&mut self, site: &Site, what: impl fmt::Display) {
        self.warn(site.error(what).0);
    }

    /// As `warn_at`, the first time `topic` comes up only.
    pub fn warn_once(&mut self, topic: &str, site: &Site, what: impl fmt::Display) {
        if self.said.insert(topic.to_owned()) {
            self.warn_at(site, what);
        }
    }

    pub fn finish(mut self) -> Vec<String> {
        if self.suppressed > 0 {
            self.warnings
                .push(format!("{} further warnings not shown", self.suppressed));
        }
        self.warnings
    }
}
