//! Source files, read as far as it takes to see which names they use.

use std::path::Path;

/// A file of Rust.
pub struct Source {
    /// Path from the root of the package, with `/`.
    pub name: String,
    text: String,
}

/// All Rust files in a folder and below.
pub fn collect(root: &Path, folder: &Path, into: &mut Vec<Source>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if path.file_name().is_none_or(|name| name != "target") {
                collect(root, &path, into);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = path.strip_prefix(root).unwrap().display().to_string();
            into.push(Source {
                name: name.replace('\\', "/"),
                text: std::fs::read_to_string(&path).unwrap(),
            });
        }
    }
}

/// A piece of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Token {
    Word(String),
    /// `::`
    Path,
    Mark(char),
}

impl Token {
    pub fn is(&self, mark: char) -> bool {
        *self == Token::Mark(mark)
    }

    pub fn word(&self) -> Option<&str> {
        match self {
            Token::Word(word) => Some(word),
            _ => None,
        }
    }
}

/// What a piece of text is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Code,
    Comment,
    /// The inside of a literal.
    Literal,
}

impl Source {
    pub fn lines(&self) -> impl Iterator<Item = &str> {
        self.text.lines()
    }

    /// Number and width of every line: what is in literals does not count, nor do words with an
    /// address in them.
    pub fn widths(&self) -> impl Iterator<Item = (usize, usize)> {
        let mut widths = vec![0; self.text.lines().count() + 1];
        let mut line = 0;
        let mut in_address = vec![false; self.text.len() + 1];
        let mut at = 0;
        for word in self.text.split_inclusive(char::is_whitespace) {
            if word.contains("://") {
                in_address[at..at + word.len()].fill(true);
            }
            at += word.len();
        }
        let mut at = 0;
        for (c, kind) in self.kinds() {
            if c == '\n' {
                line += 1;
            } else if kind != Kind::Literal && !in_address[at] {
                widths[line] += 1;
            }
            at += c.len_utf8();
        }
        widths.into_iter().enumerate().map(|(i, w)| (i + 1, w))
    }

    /// Words and marks outside of comments and literals.
    pub fn tokens(&self) -> Vec<Token> {
        let code = self.kinds().into_iter();
        let mut code = code
            .map(|(c, kind)| if kind == Kind::Code { c } else { ' ' })
            .peekable();
        let mut tokens = Vec::new();
        while let Some(c) = code.next() {
            if c.is_alphanumeric() || c == '_' {
                let mut word = String::from(c);
                while let Some(c) = code.next_if(|c| c.is_alphanumeric() || *c == '_') {
                    word.push(c);
                }
                tokens.push(Token::Word(word));
            } else if c == ':' && code.next_if_eq(&':').is_some() {
                tokens.push(Token::Path);
            } else if !c.is_whitespace() {
                tokens.push(Token::Mark(c));
            }
        }
        tokens
    }

    /// Every character, and what it is part of.
    fn kinds(&self) -> Vec<(char, Kind)> {
        let text: Vec<char> = self.text.chars().collect();
        let mut out: Vec<(char, Kind)> = Vec::with_capacity(text.len());
        let mut i = 0;
        while i < text.len() {
            let start = i;
            let kind = match text[i] {
                '/' if text.get(i + 1) == Some(&'/') => {
                    i = (i..text.len())
                        .find(|&j| text[j] == '\n')
                        .unwrap_or(text.len());
                    Kind::Comment
                }
                '/' if text.get(i + 1) == Some(&'*') => {
                    i += 2;
                    while i < text.len() && !(text[i - 1] == '*' && text[i] == '/' && i > start + 2)
                    {
                        i += 1;
                    }
                    i = (i + 1).min(text.len());
                    Kind::Comment
                }
                '"' => {
                    i = end_of_string(&text, i);
                    Kind::Literal
                }
                'r' if is_raw(&text, i) => {
                    i = end_of_raw(&text, i);
                    Kind::Literal
                }
                '\'' if is_character(&text, i) => {
                    // The first character may be an escaped quote.
                    let first = i + if text[i + 1] == '\\' { 3 } else { 2 };
                    let quote = (first..text.len()).find(|&j| text[j] == '\'');
                    i = quote.map_or(text.len(), |j| j + 1);
                    Kind::Literal
                }
                _ => {
                    i += 1;
                    Kind::Code
                }
            };
            out.extend(text[start..i].iter().map(|&c| (c, kind)));
        }
        out
    }
}

fn end_of_string(text: &[char], start: usize) -> usize {
    let mut i = start + 1;
    while i < text.len() && text[i] != '"' {
        i += if text[i] == '\\' { 2 } else { 1 };
    }
    (i + 1).min(text.len())
}

/// `r"`, `r#"` and so on, not the end of a word.
fn is_raw(text: &[char], i: usize) -> bool {
    let ends_word =
        i > 0 && (text[i - 1].is_alphanumeric() && text[i - 1] != 'b' || text[i - 1] == '_');
    let after = text[i + 1..].iter().find(|&&c| c != '#');
    !ends_word && after == Some(&'"')
}

fn end_of_raw(text: &[char], start: usize) -> usize {
    let hashes = text[start + 1..].iter().take_while(|&&c| c == '#').count();
    let mut i = start + hashes + 2;
    while i < text.len() {
        let closes = text[i] == '"' && text[i + 1..].iter().take(hashes).all(|&c| c == '#');
        i += 1;
        if closes {
            return (i + hashes).min(text.len());
        }
    }
    text.len()
}

/// A character, not a lifetime.
fn is_character(text: &[char], i: usize) -> bool {
    text.get(i + 1) == Some(&'\\') || text.get(i + 2) == Some(&'\'')
}
