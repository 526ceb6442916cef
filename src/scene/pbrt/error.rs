//! Where something stands in a scene file, and what is wrong with it.

use std::fmt;
use std::rc::Rc;

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
        SceneError(one_line(format!("{self}: {what}")))
    }
}

impl SceneError {
    /// An error of no place.
    pub(super) fn plain(what: impl fmt::Display) -> Self {
        Self(one_line(what.to_string()))
    }
}

/// Longest name in a message, longest word outside of quotes, such as a path, and longest message, in characters.
const MAX_NAME: usize = 80;
const MAX_WORD: usize = 200;
const MAX_MESSAGE: usize = 600;

/// A message as it is shown: names in a scene may hold line ends and other control characters, and may be of any length. What is too long
/// loses its middle: the end of a path says more than the rest of it.
fn one_line(message: String) -> String {
    let plain = !message.contains(char::is_control);
    if plain && message.len() <= MAX_NAME {
        return message;
    }
    // What is in quotes is a name, blanks and all.
    let pieces = message.split('"').enumerate().map(|(i, piece)| {
        if i % 2 == 1 {
            return shortened(piece, MAX_NAME);
        }
        let words: Vec<String> = piece.split(' ').map(|w| shortened(w, MAX_WORD)).collect();
        words.join(" ")
    });
    let mut line = String::new();
    for (i, piece) in pieces.enumerate() {
        if i > 0 {
            line.push('"');
        }
        for c in piece.chars() {
            if c.is_control() {
                line.extend(c.escape_default());
            } else {
                line.push(c);
            }
        }
    }
    shortened(&line, MAX_MESSAGE)
}

/// A text without its middle if it is longer than so many characters.
fn shortened(text: &str, most: usize) -> String {
    let count = text.chars().count();
    if count <= most {
        return text.to_owned();
    }
    let half = most / 2 - 2;
    let head = text.chars().take(half);
    let tail = text.chars().skip(count - half);
    head.chain("...".chars()).chain(tail).collect()
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
            label: one_line(label.into()),
        }
    }

    pub fn error(&self, what: impl fmt::Display) -> SceneError {
        SceneError(one_line(format!("{}: {}: {what}", self.pos, self.label)))
    }

    /// `scene.pbrt:42`, for reports on materials and lights.
    pub fn origin(&self) -> String {
        format!("{}:{}", self.pos.file, self.pos.line)
    }
}

/// Warnings in the order they arose, bounded so that a broken file of millions of lines does not fill memory.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_lines() {
        let path = "folder/".repeat(20) + "scene.pbrt:1:2: ";
        let message = path + "there is no \"texture\nof a name\" here";
        let shown = one_line(message.clone());
        assert_eq!(shown, message.replace('\n', "\\n"));
        let name = "a long name ".repeat(1000);
        let shown = one_line(format!(
            "f:1:2: Texture \"{name}\": \"{name}\" is unknown; use x"
        ));
        assert!(
            shown.starts_with("f:1:2: Texture \"a long name "),
            "{shown}"
        );
        assert!(
            shown.ends_with("a long name \" is unknown; use x"),
            "{shown}"
        );
        assert!(shown.len() < 250, "{shown}");
        let word = "é\"\u{1}".repeat(10_000);
        for text in [format!("x {word} y"), format!("\"{word} y"), word] {
            assert!(one_line(text).chars().count() <= MAX_MESSAGE);
        }
        let shown = one_line(format!("{}/scene.pbrt:7:1: what", "x".repeat(10_000)));
        assert!(shown.ends_with("x/scene.pbrt:7:1: what"), "{shown}");
    }
}
