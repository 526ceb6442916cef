//! The tokens of a scene: the main file with the files it includes spliced in.

use std::collections::HashSet;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::error::{Pos, SceneError};
use super::lexer::{Lexer, Source, Token};

/// Bytes of scene text read in all, after decompression. Meshes of this size belong in PLY files.
const MAX_TEXT: u64 = 4 << 30;
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
}

#[derive(Debug)]
pub(super) struct TokenStream {
    frames: Vec<Frame>,
    peeked: Option<Item>,
    bytes: u64,
    includes: u32,
}

impl TokenStream {
    pub fn new(source: Rc<Source>, path: Option<&Path>) -> Self {
        let bytes = source.text.len() as u64;
        let path = path.and_then(|p| p.canonicalize().ok());
        Self {
            frames: vec![Frame {
                lexer: Lexer::new(source),
                path,
                import: None,
            }],
            peeked: None,
            bytes,
            includes: 0,
        }
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

    /// Continues with the tokens of `path`, then with what follows here. Nothing may have been peeked at.
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
        let source = read_source(path, MAX_TEXT.saturating_sub(self.bytes))?;
        self.bytes += source.text.len() as u64;
        self.frames.push(Frame {
            lexer: Lexer::new(Rc::new(source)),
            path: Some(canonical),
            import,
        });
        Ok(())
    }
}

/// Reads a scene file whole, decompressing `.gz`.
pub(super) fn read_main(path: &Path) -> Result<Source, String> {
    read_source(path, MAX_TEXT)
}

fn read_source(path: &Path, limit: u64) -> Result<Source, String> {
    let describe = |e: std::io::Error| format!("cannot read {}: {e}", path.display());
    let file = std::fs::File::open(path).map_err(describe)?;
    if !file.metadata().map_err(describe)?.is_file() {
        return Err(format!("{} is not a file", path.display()));
    }
    let mut bytes = Vec::new();
    let gzipped = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    if gzipped {
        flate2::read::MultiGzDecoder::new(file)
            .take(limit + 1)
            .read_to_end(&mut bytes)
    } else {
        file.take(limit + 1).read_to_end(&mut bytes)
    }
    .map_err(describe)?;
    if bytes.len() as u64 > limit {
        return Err(format!(
            "{} takes the scene's text beyond {MAX_TEXT} bytes; use PLY files for meshes",
            path.display()
        ));
    }
    // Comments may be in any encoding; everything that matters is ASCII or UTF-8.
    let text = match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(e) => String::from_utf8_lossy(e.as_bytes()).into_owned(),
    };
    Ok(Source {
        name: path.display().to_string().into(),
        text,
    })
}

/// Every token of a file and, on request, of the files it includes, for a look ahead that must not fail.
pub(super) fn scan(
    source: &Rc<Source>,
    dir: &Path,
    with_includes: bool,
    visit: &mut impl FnMut(&Token) -> bool,
) {
    let mut queue = vec![Rc::clone(source)];
    let mut seen = HashSet::new();
    while let Some(source) = queue.pop() {
        let mut lexer = Lexer::new(source);
        let mut include = false;
        while let Ok(Some(token)) = lexer.next() {
            if visit(&token) {
                return;
            }
            if include && with_includes && seen.len() < 64 {
                let path = dir.join(token.text().as_ref());
                if let Ok(canonical) = path.canonicalize()
                    && seen.insert(canonical)
                    && let Ok(source) = read_main(&path)
                {
                    queue.push(Rc::new(source));
                }
            }
            include = token.is_word("Include") || token.is_word("Import");
        }
    }
}
