//! Text to tokens. Both dialects share one lexical grammar: bare words (directives, numbers,
//! `true`), quoted strings, brackets, and `#` comments to the end of the line.

use std::borrow::Cow;
use std::ops::Range;
use std::rc::Rc;

use super::error::{Pos, SceneError};
use super::text::Blocks;

/// Part of a file's text.
#[derive(Debug)]
struct Block {
    file: Rc<str>,
    text: String,
}

/// Longest word or string, in bytes.
const MAX_TOKEN: usize = 1 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    Quoted,
    Open,
    Close,
}

/// A token; holds on to the text around it, so it outlives the end of an included file.
#[derive(Clone, Debug)]
pub(super) struct Token {
    pub kind: TokenKind,
    block: Rc<Block>,
    /// Without the quotes.
    range: Range<usize>,
    line: u32,
    column: u32,
}

impl Token {
    /// As it stands in the file; of a quoted string, what is between the quotes.
    pub fn raw(&self) -> &str {
        &self.block.text[self.range.clone()]
    }

    /// With the escape sequences of quoted strings replaced. An unknown one stays as it is: it is
    /// rather a path with backslashes.
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
            file: Rc::clone(&self.block.file),
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

/// Reads tokens off one text, of which it holds a block at a time.
#[derive(Debug)]
pub(super) struct Lexer {
    blocks: Blocks,
    /// No text follows the block.
    ended: bool,
    block: Rc<Block>,
    at: usize,
    /// Where the token that is being read begins in the block; the text before is not needed any
    /// more.
    start: usize,
    line: u32,
    column: u32,
}

fn is_blank(b: u8) -> bool {
    b.is_ascii_whitespace() || b == b'\x0b'
}

fn ends_word(b: u8) -> bool {
    is_blank(b) || matches!(b, b'"' | b'[' | b']' | b'#')
}

impl Lexer {
    pub fn new(blocks: Blocks) -> Self {
        Self {
            block: Rc::new(Block {
                file: Rc::clone(&blocks.name),
                text: String::new(),
            }),
            blocks,
            ended: false,
            at: 0,
            start: 0,
            line: 1,
            column: 1,
        }
    }

    /// Where the lexer has come to.
    pub fn pos(&self) -> Pos {
        self.place(self.line, self.column)
    }

    fn place(&self, line: u32, column: u32) -> Pos {
        Pos {
            file: Rc::clone(&self.blocks.name),
            line,
            column,
        }
    }

    /// The next token, `None` at the end of the text.
    pub fn next(&mut self) -> Result<Option<Token>, SceneError> {
        let first = loop {
            self.skip_while(is_blank)?;
            match self.byte()? {
                None => return Ok(None),
                Some(b'#') => self.skip_while(|b| b != b'\n')?,
                Some(b) => break b,
            }
        };
        let (line, column) = (self.line, self.column);
        self.start = self.at;
        let (kind, quotes) = match first {
            b'[' => (TokenKind::Open, 0),
            b']' => (TokenKind::Close, 0),
            b'"' => (TokenKind::Quoted, 1),
            _ => (TokenKind::Word, 0),
        };
        match kind {
            TokenKind::Word => self.advance_while(|b| !ends_word(b))?,
            TokenKind::Quoted => {
                self.advance(1);
                self.string(line, column)?;
            }
            TokenKind::Open | TokenKind::Close => self.advance(1),
        }
        Ok(Some(Token {
            kind,
            block: Rc::clone(&self.block),
            range: self.start + quotes..self.at - quotes,
            line,
            column,
        }))
    }

    /// Goes to the end of a string that begins in this place.
    fn string(&mut self, line: u32, column: u32) -> Result<(), SceneError> {
        loop {
            self.advance_while(|b| !matches!(b, b'"' | b'\\' | b'\n'))?;
            match self.byte()? {
                Some(b'"') => {
                    self.advance(1);
                    return Ok(());
                }
                Some(b'\\') => {
                    self.advance(1);
                    if self.byte()?.is_some_and(|b| matches!(b, b'"' | b'\\')) {
                        self.advance(1);
                    }
                }
                _ => {
                    let pos = self.place(line, column);
                    return Err(pos.error("string without its closing quote on the same line"));
                }
            }
        }
    }

    /// The byte here; reads on at the end of the block.
    fn byte(&mut self) -> Result<Option<u8>, SceneError> {
        while self.at == self.block.text.len() {
            if !self.refill()? {
                return Ok(None);
            }
        }
        Ok(Some(self.block.text.as_bytes()[self.at]))
    }

    /// Goes on while `keep` holds, forgetting what it passes.
    fn skip_while(&mut self, keep: impl Fn(u8) -> bool) -> Result<(), SceneError> {
        loop {
            let more = self.advance_in_block(&keep);
            self.start = self.at;
            if !more || !self.refill()? {
                return Ok(());
            }
        }
    }

    /// Goes on while `keep` holds.
    fn advance_while(&mut self, keep: impl Fn(u8) -> bool) -> Result<(), SceneError> {
        while self.advance_in_block(&keep) && self.refill()? {}
        Ok(())
    }

    /// True if the end of the block is reached.
    fn advance_in_block(&mut self, keep: impl Fn(u8) -> bool) -> bool {
        let rest = &self.block.text.as_bytes()[self.at..];
        let end = rest.iter().position(|&b| !keep(b));
        let count = end.unwrap_or(rest.len());
        self.advance(count);
        end.is_none()
    }

    fn advance(&mut self, count: usize) {
        let passed = &self.block.text.as_bytes()[self.at..self.at + count];
        self.at += count;
        let mut last_line = passed;
        if let Some(end) = passed.iter().rposition(|&b| b == b'\n') {
            let lines = passed[..=end].iter().filter(|&&b| b == b'\n').count();
            self.line = self.line.saturating_add(lines as u32);
            self.column = 1;
            last_line = &passed[end + 1..];
        }
        // Continuation bytes of UTF-8 are no columns of their own.
        let columns = last_line.iter().filter(|&&b| b & 0xC0 != 0x80).count();
        self.column = self.column.saturating_add(columns as u32);
    }

    /// Reads on, keeping the token that has begun; false at the end of the text.
    fn refill(&mut self) -> Result<bool, SceneError> {
        if self.ended {
            return Ok(false);
        }
        let kept = &self.block.text[self.start..];
        if kept.len() > MAX_TOKEN {
            let what = format_args!("a word or string of more than {MAX_TOKEN} bytes");
            return Err(self.pos().error(what));
        }
        let mut text = kept.to_owned();
        // Long tokens are not copied block by block.
        let goal = 2 * kept.len();
        loop {
            self.ended = !(self.blocks.append_to(&mut text)).map_err(|e| self.pos().error(e))?;
            if self.ended || text.len() > goal {
                break;
            }
        }
        self.at -= self.start;
        self.start = 0;
        self.block = Rc::new(Block {
            file: Rc::clone(&self.blocks.name),
            text,
        });
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::super::text::Text;
    use super::*;

    fn lexer(text: &str) -> Lexer {
        Lexer::new(
            Text::held("t", text.as_bytes())
                .open(&Rc::default())
                .expect("opens"),
        )
    }

    fn tokens(text: &str) -> Vec<Token> {
        let mut lexer = lexer(text);
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
        let mut lexer = lexer("a \"b\nc\"");
        assert!(lexer.next().is_ok());
        let error = lexer.next().expect_err("open string");
        assert!(error.to_string().starts_with("t:1:3: "), "{error}");
    }

    /// Tokens lie across the ends of blocks, wherever those are.
    #[test]
    fn blocks_cut_no_tokens() {
        let words = ["[", "\"ab\\\"é c\"", "# \"x\n", "0.125", "word", "\n", "]"];
        let mut text = String::new();
        for i in 0..40_000 {
            text += words[i % words.len()];
            text.extend(std::iter::repeat_n(' ', i % 3));
            text += if i % 7 == 3 { " " } else { "" };
        }
        for shift in 0..8 {
            let blanks = " ".repeat(shift);
            let all = tokens(&(blanks + &text));
            let of_round = 5;
            for (i, token) in all.iter().enumerate().skip(of_round) {
                assert_eq!(token.raw(), all[i - of_round].raw());
                assert_eq!(token.line, all[i - of_round].line + 2);
            }
            assert_eq!(all[1].raw(), "ab\\\"é c");
        }
    }

    #[test]
    fn tokens_have_a_longest_length() {
        assert_eq!(tokens(&"x".repeat(MAX_TOKEN))[0].raw().len(), MAX_TOKEN);
        let error = lexer(&"x".repeat(10 * MAX_TOKEN)).next().expect_err("long");
        assert!(error.to_string().len() < 100, "{error}");
    }
}
