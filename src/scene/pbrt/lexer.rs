//! Text to tokens. Both dialects share one lexical grammar: bare words (directives, numbers, `true`), quoted strings,
//! brackets, and `#` comments to the end of the line.

use std::borrow::Cow;
use std::ops::Range;
use std::rc::Rc;

use super::error::{Pos, SceneError};

/// One file's text.
#[derive(Debug)]
pub(super) struct Source {
    pub name: Rc<str>,
    pub text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    Quoted,
    Open,
    Close,
}

/// A token; holds on to its source, so it outlives the end of an included file.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub kind: TokenKind,
    source: Rc<Source>,
    /// Without the quotes.
    range: Range<usize>,
    line: u32,
    column: u32,
}

impl Token {
    /// As it stands in the file; of a quoted string, what is between the quotes.
    pub fn raw(&self) -> &str {
        &self.source.text[self.range.clone()]
    }

    /// With the escape sequences of quoted strings replaced. An unknown one stays as it is: it is rather a path with
    /// backslashes.
    pub fn text(&self) -> Cow<'_, str> {
        let raw = self.raw();
        if self.kind != TokenKind::Quoted || !raw.contains('\\') {
            return Cow::Borrowed(raw);
        }
        let mut out = String::with_capacity(raw.len());
        let mut chars = raw.chars();
        while let Some(c) = chars.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            match chars.next() {
                Some('n') => out.push('\n'),
                Some('t') => out.push('\t'),
                Some('r') => out.push('\r'),
                Some(c @ ('"' | '\\' | '\'')) => out.push(c),
                Some(c) => out.extend(['\\', c]),
                None => out.push('\\'),
            }
        }
        Cow::Owned(out)
    }

    pub fn pos(&self) -> Pos {
        Pos {
            file: self.source.name.clone(),
            line: self.line,
            column: self.column,
        }
    }

    /// The token as messages show it, cut to a readable length.
    pub fn shown(&self) -> String {
        let mut text: String = self.raw().chars().take(40).collect();
        if text.len() < self.raw().len() {
            text.push_str("...");
        }
        match self.kind {
            TokenKind::Quoted => format!("\"{text}\""),
            _ => format!("'{text}'"),
        }
    }

    pub fn is_word(&self, word: &str) -> bool {
        self.kind == TokenKind::Word && self.raw() == word
    }

    /// A finite number. `nan` and `inf` are no numbers in a scene, nor is what overflows `f64`.
    pub fn number(&self) -> Result<f64, SceneError> {
        let raw = self.raw();
        let numeric = self.kind == TokenKind::Word
            && raw
                .bytes()
                .all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b'e' | b'E'));
        match raw.parse::<f64>() {
            Ok(x) if numeric && x.is_finite() => Ok(x),
            Ok(_) if numeric => Err(self
                .pos()
                .error(format!("number {} is out of range", self.shown()))),
            Ok(_) if self.kind == TokenKind::Word => Err(self
                .pos()
                .error(format!("{} is not a finite number", self.shown()))),
            _ => Err(self
                .pos()
                .error(format!("expected a number, found {}", self.shown()))),
        }
    }
}

/// Reads tokens off one source.
#[derive(Debug)]
pub(super) struct Lexer {
    source: Rc<Source>,
    at: usize,
    line: u32,
    column: u32,
}

impl Lexer {
    pub fn new(source: Rc<Source>) -> Self {
        // A byte order mark is no part of the text.
        let at = if source.text.starts_with('\u{feff}') {
            3
        } else {
            0
        };
        Self {
            source,
            at,
            line: 1,
            column: 1,
        }
    }

    /// The next token, `None` at the end of the file.
    pub fn next(&mut self) -> Result<Option<Token>, SceneError> {
        let source = Rc::clone(&self.source);
        let bytes = source.text.as_bytes();
        while let Some(&b) = bytes.get(self.at) {
            match b {
                b'#' => self.advance_while(bytes, |b| b != b'\n'),
                b if b.is_ascii_whitespace() || b == b'\x0b' => self.advance(b),
                _ => break,
            }
        }
        let Some(&first) = bytes.get(self.at) else {
            return Ok(None);
        };
        let (line, column, start) = (self.line, self.column, self.at);
        let token = |kind, range| Token {
            kind,
            source: Rc::clone(&source),
            range,
            line,
            column,
        };
        match first {
            b'[' | b']' => {
                self.advance(first);
                let kind = if first == b'[' {
                    TokenKind::Open
                } else {
                    TokenKind::Close
                };
                Ok(Some(token(kind, start..self.at)))
            }
            b'"' => {
                self.advance(first);
                let mut escaped = false;
                while let Some(&b) = bytes.get(self.at) {
                    match b {
                        b'"' if !escaped => break,
                        b'\n' => break,
                        _ => escaped = b == b'\\' && !escaped,
                    }
                    self.advance(b);
                }
                if bytes.get(self.at) != Some(&b'"') {
                    let pos = Pos {
                        file: source.name.clone(),
                        line,
                        column,
                    };
                    return Err(pos.error("string without its closing quote on the same line"));
                }
                let range = start + 1..self.at;
                self.advance(b'"');
                Ok(Some(token(TokenKind::Quoted, range)))
            }
            _ => {
                let ends = |b: u8| {
                    b.is_ascii_whitespace() || matches!(b, b'"' | b'[' | b']' | b'#' | b'\x0b')
                };
                self.advance_while(bytes, |b| !ends(b));
                Ok(Some(token(TokenKind::Word, start..self.at)))
            }
        }
    }

    fn advance(&mut self, b: u8) {
        self.at += 1;
        if b == b'\n' {
            self.line = self.line.saturating_add(1);
            self.column = 1;
        } else if b & 0xC0 != 0x80 {
            // Continuation bytes of UTF-8 are no columns of their own.
            self.column = self.column.saturating_add(1);
        }
    }

    fn advance_while(&mut self, bytes: &[u8], keep: impl Fn(u8) -> bool) {
        while let Some(&b) = bytes.get(self.at) {
            if !keep(b) {
                break;
            }
            self.advance(b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Vec<Token> {
        let mut lexer = Lexer::new(Rc::new(Source {
            name: "t".into(),
            text: text.into(),
        }));
        let mut out = vec![];
        while let Some(token) = lexer.next().expect("lexes") {
            out.push(token);
        }
        out
    }

    #[test]
    fn words_strings_brackets_and_comments() {
        let t = tokens("Shape\"sphere\" # a \"comment\"\n \"float r\"[1 -.5]");
        let seen: Vec<_> = t
            .iter()
            .map(|t| (t.kind, t.raw().to_owned(), t.line, t.column))
            .collect();
        use TokenKind::*;
        assert_eq!(
            seen,
            [
                (Word, "Shape".into(), 1, 1),
                (Quoted, "sphere".into(), 1, 6),
                (Quoted, "float r".into(), 2, 2),
                (Open, "[".into(), 2, 11),
                (Word, "1".into(), 2, 12),
                (Word, "-.5".into(), 2, 14),
                (Close, "]".into(), 2, 17),
            ]
        );
    }

    #[test]
    fn columns_count_characters() {
        assert_eq!(tokens("\"é\" x")[1].column, 5);
    }

    #[test]
    fn escapes() {
        assert_eq!(tokens(r#""a\"b\\c\d""#)[0].text(), r#"a"b\c\d"#);
    }

    #[test]
    fn numbers() {
        for (text, value) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("5.", 5.0),
            ("+1e-007", 1e-7),
            ("-0", 0.0),
        ] {
            assert_eq!(tokens(text)[0].number().expect("a number"), value);
        }
        for text in [
            "nan", "inf", "-inf", "infinity", "NaN", "1e400", "1-2", "x", "e",
        ] {
            assert!(tokens(text)[0].number().is_err(), "{text}");
        }
    }

    #[test]
    fn open_string_is_an_error_where_it_begins() {
        let mut lexer = Lexer::new(Rc::new(Source {
            name: "t".into(),
            text: "a \"b\nc\"".into(),
        }));
        assert!(lexer.next().is_ok());
        let error = lexer.next().expect_err("open string");
        assert!(error.to_string().starts_with("t:1:3: "), "{error}");
    }
}
