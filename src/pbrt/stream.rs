//! The tokens of a scene: the main file with the files it includes spliced in.

use std::cell::Cell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::error::{Pos, SceneError};
use super::lexer::{Lexer, Token};
use super::text::{OPEN_FILE_BYTES, Text};
use crate::pbrt::budget::{Budget, Charge};

/// Files included in all: files that include each other twice would multiply without bound.
const MAX_INCLUDES: u32 = 1 << 16;
/// Files open at once.
const MAX_INCLUDE_DEPTH: usize = 256;

/// What comes next in the scene.
#[derive(Debug)]
pub(super) enum Item {
    Token(Token),
    /// A file brought in by `Import` ends here.
    ImportEnd(Pos),
}

#[derive(Debug)]
struct Frame {
    lexer: Lexer,
    path: Option<PathBuf>,
    /// The directive's place, if this file was imported.
    import: Option<Pos>,
    _room: Charge,
}

#[derive(Debug)]
pub(super) struct TokenStream {
    frames: Vec<Frame>,
    peeked: Option<Item>,
    /// Bytes of text so far.
    bytes: Rc<Cell<u64>>,
    includes: u32,
    pub budget: Rc<Budget>,
}

impl TokenStream {
    pub fn new(text: &Text, budget: &Rc<Budget>) -> Result<Self, String> {
        let mut stream = Self {
            frames: Vec::new(),
            peeked: None,
            bytes: Rc::default(),
            includes: 0,
            budget: Rc::clone(budget),
        };
        let path = match text {
            Text::File(path) => path.canonicalize().ok(),
            Text::Held(..) => None,
        };
        stream.push(text, path, None)?;
        Ok(stream)
    }

    fn push(
        &mut self,
        text: &Text,
        path: Option<PathBuf>,
        import: Option<Pos>,
    ) -> Result<(), String> {
        let room = Charge::of(&self.budget, OPEN_FILE_BYTES)?;
        self.frames.push(Frame {
            lexer: Lexer::new(text.open(&self.bytes)?),
            path,
            import,
            _room: room,
        });
        Ok(())
    }

    pub fn next(&mut self) -> Result<Option<Item>, SceneError> {
        if let Some(item) = self.peeked.take() {
            return Ok(Some(item));
        }
        while let Some(frame) = self.frames.last_mut() {
            if let Some(token) = frame.lexer.next()? {
                return Ok(Some(Item::Token(token)));
            }
            if let Some(Frame {
                import: Some(pos), ..
            }) = self.frames.pop()
            {
                return Ok(Some(Item::ImportEnd(pos)));
            }
        }
        Ok(None)
    }

    /// The next token without taking it; `None` where the scene or an imported file ends.
    pub fn peek(&mut self) -> Result<Option<&Token>, SceneError> {
        if self.peeked.is_none() {
            self.peeked = self.next()?;
        }
        Ok(match &self.peeked {
            Some(Item::Token(token)) => Some(token),
            _ => None,
        })
    }

    /// The next token; `None` as for [`Self::peek`].
    pub fn next_token(&mut self) -> Result<Option<Token>, SceneError> {
        match self.next()? {
            Some(Item::Token(token)) => Ok(Some(token)),
            Some(end) => {
                self.peeked = Some(end);
                Ok(None)
            }
            None => Ok(None),
        }
    }

    /// Continues with the tokens of `path`, then with what follows here. Nothing may have been
    /// peeked at.
    pub fn include(&mut self, path: &Path, import: Option<Pos>) -> Result<(), String> {
        let canonical = path
            .canonicalize()
            .map_err(|e| format!("cannot open {}: {e}", path.display()))?;
        if self
            .frames
            .iter()
            .any(|f| f.path.as_ref() == Some(&canonical))
        {
            return Err(format!(
                "{} includes itself, directly or through other files",
                path.display()
            ));
        }
        self.includes += 1;
        if self.frames.len() >= MAX_INCLUDE_DEPTH || self.includes > MAX_INCLUDES {
            return Err(format!(
                "too many included files (limits: {MAX_INCLUDE_DEPTH} at once, {MAX_INCLUDES} in all)"
            ));
        }
        self.push(&Text::File(path.into()), Some(canonical), import)
    }
}

/// Files that a look ahead goes into, at most.
const MAX_SCANNED: usize = 64;

/// Every token of a text and, on request, of the files it includes, for a look ahead that must not
/// fail. Returns whether any are included.
pub(super) fn scan(
    text: &Text,
    dir: &Path,
    with_includes: bool,
    visit: &mut impl FnMut(&Token) -> bool,
) -> bool {
    let mut queue = vec![text.clone()];
    let mut seen = HashSet::new();
    let mut includes = false;
    while let Some(text) = queue.pop() {
        let Ok(blocks) = text.open(&Rc::default()) else {
            continue;
        };
        let mut lexer = Lexer::new(blocks);
        let mut include = false;
        while let Ok(Some(token)) = lexer.next() {
            if visit(&token) {
                return includes;
            }
            if include && with_includes && seen.len() < MAX_SCANNED {
                let path = dir.join(token.text().as_ref());
                if let Ok(canonical) = path.canonicalize()
                    && seen.insert(canonical)
                {
                    queue.push(Text::File(path));
                }
            }
            include = token.is_word("Include") || token.is_word("Import");
            includes |= include;
        }
    }
    includes
}
