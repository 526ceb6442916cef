//! Which file uses which: the tree of modules, and the paths in each of them.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{Source, Token};

type Path = Vec<String>;

/// The modules of the library that are files. Modules for tests are left out.
pub struct Tree {
    names: Vec<String>,
    paths: Vec<Path>,
    files: BTreeMap<Path, usize>,
    /// By module and name, where `use` has the name from.
    imports: BTreeMap<(usize, String), Path>,
    uses: BTreeSet<(usize, usize)>,
}

/// A path that a module names.
struct Named {
    path: Path,
    /// Under which name it is known from here on, if by `use`.
    alias: Option<String>,
    /// `pub use`
    public: bool,
}

impl Tree {
    pub fn new(sources: &[Source]) -> Self {
        let mut tree = Self {
            names: Vec::new(),
            paths: Vec::new(),
            files: BTreeMap::new(),
            imports: BTreeMap::new(),
            uses: BTreeSet::new(),
        };
        let tokens: Vec<_> = sources
            .iter()
            .map(|s| (s, without_tests(&s.tokens())))
            .collect();
        let mut of_tests = BTreeSet::new();
        for (source, (_, tests)) in &tokens {
            let path = module(&source.name);
            of_tests.extend(tests.iter().map(|name| joined(&path, name)));
        }
        let mut kept = Vec::new();
        for (source, (tokens, _)) in &tokens {
            let path = module(&source.name);
            let is_test = (0..=path.len()).any(|n| of_tests.contains(&path[..n]));
            if !is_test && source.name != "src/main.rs" {
                tree.files.insert(path.clone(), kept.len());
                tree.names.push(source.name.clone());
                tree.paths.push(path);
                kept.push(tokens);
            }
        }
        let named: Vec<_> = (kept.iter().enumerate())
            .map(|(i, t)| tree.named(i, t))
            .collect();
        for (i, named) in named.iter().enumerate() {
            for n in named {
                if let Some(alias) = &n.alias {
                    tree.imports.insert((i, alias.clone()), n.path.clone());
                }
            }
        }
        for (i, named) in named.iter().enumerate() {
            let is_parent = tree.names[i].ends_with("/mod.rs");
            // What a parent passes on it does not use itself.
            for n in named.iter().filter(|n| !(is_parent && n.public)) {
                if let Some(used) = tree.resolve(&n.path, 0).filter(|&used| used != i) {
                    tree.uses.insert((i, used));
                }
            }
        }
        tree
    }

    pub fn uses(&self) -> impl Iterator<Item = (usize, usize)> {
        self.uses.iter().copied()
    }

    pub fn name(&self, file: usize) -> &str {
        &self.names[file]
    }

    /// The room a file is in; none for `lib.rs`.
    pub fn room(&self, file: usize) -> Option<&str> {
        self.paths[file].first().map(String::as_str)
    }

    /// Files of one room that use each other in a circle.
    pub fn circles(&self) -> Vec<Vec<String>> {
        let count = self.names.len();
        let inside = |&(a, b): &(usize, usize)| self.room(a) == self.room(b);
        let edges: Vec<_> = self.uses().filter(inside).collect();
        let reaches = |from: usize| {
            let mut seen = vec![false; count];
            let mut todo = vec![from];
            while let Some(at) = todo.pop() {
                for &(_, to) in edges.iter().filter(|e| e.0 == at) {
                    if !std::mem::replace(&mut seen[to], true) {
                        todo.push(to);
                    }
                }
            }
            seen
        };
        let reached: Vec<_> = (0..count).map(reaches).collect();
        let mut circles = Vec::new();
        let mut done = vec![false; count];
        for a in 0..count {
            let circle: Vec<_> = (a..count)
                .filter(|&b| reached[a][b] && reached[b][a])
                .collect();
            if !done[a] && !circle.is_empty() {
                circle.iter().for_each(|&b| done[b] = true);
                circles.push(circle.iter().map(|&b| self.names[b].clone()).collect());
            }
        }
        circles
    }

    /// The file that a path leads to, through the names that parents pass on.
    fn resolve(&self, path: &[String], depth: usize) -> Option<usize> {
        let length = (1..=path.len())
            .rev()
            .find(|&n| self.files.contains_key(&path[..n]))?;
        let file = self.files[&path[..length]];
        let Some(next) = path.get(length) else {
            return Some(file);
        };
        match self.imports.get(&(file, next.clone())) {
            Some(from) if depth < 8 && self.resolve(from, depth + 1).is_some() => {
                self.resolve(from, depth + 1)
            }
            _ => Some(file),
        }
    }

    /// All paths that a file names, in full.
    fn named(&self, file: usize, tokens: &[Token]) -> Vec<Named> {
        let mut named = Vec::new();
        // Names of modules inside the file, each with the depth of braces around it.
        let mut inner: Vec<(String, usize)> = Vec::new();
        let mut braces = 0;
        let mut i = 0;
        while i < tokens.len() {
            let word = tokens[i].word();
            let before = i.checked_sub(1).map(|j| &tokens[j]);
            if tokens[i].is('{') {
                braces += 1;
            } else if tokens[i].is('}') {
                braces -= 1;
                inner.retain(|(_, depth)| *depth < braces + 1);
            } else if word == Some("mod") && tokens.get(i + 2).is_some_and(|t| t.is('{')) {
                let name = tokens[i + 1].word().unwrap_or_default().to_owned();
                inner.push((name, braces + 1));
                i += 1;
            } else if word == Some("use") && tokens.get(i + 1).is_some_and(|t| !t.is('<')) {
                let public = before.is_some_and(|t| t.word() == Some("pub") || t.is(')'));
                let here = self.here(file, &inner);
                i = self.tree(&here, tokens, i + 1, &mut Vec::new(), public, &mut named);
                continue;
            } else if word.is_some_and(|word| self.begins_path(file, word))
                && tokens.get(i + 1) == Some(&Token::Path)
                && before.is_none_or(|t| t.word() != Some("in") && *t != Token::Path)
            {
                let mut path = vec![word.unwrap_or_default().to_owned()];
                while let (Some(Token::Path), Some(Token::Word(next))) =
                    (tokens.get(i + 1), tokens.get(i + 2))
                {
                    path.push(next.clone());
                    i += 2;
                }
                let path = self.absolute(&self.here(file, &inner), &path);
                named.extend(path.map(|path| Named {
                    path,
                    alias: None,
                    public: false,
                }));
            }
            i += 1;
        }
        named
    }

    /// Whether a path of this library can begin so: also with the name of a module below.
    fn begins_path(&self, file: usize, word: &str) -> bool {
        matches!(word, "crate" | "super" | "self")
            || self.files.contains_key(&joined(&self.paths[file], word))
    }

    /// The path of the module that is being read.
    fn here(&self, file: usize, inner: &[(String, usize)]) -> Path {
        let mut here = self.paths[file].clone();
        here.extend(inner.iter().map(|(name, _)| name.clone()));
        here
    }

    /// Reads a tree of `use` from a token on; where it ends.
    fn tree(
        &self,
        here: &Path,
        tokens: &[Token],
        mut i: usize,
        prefix: &mut Path,
        public: bool,
        named: &mut Vec<Named>,
    ) -> usize {
        let length = prefix.len();
        let mut alias = None;
        let mut is_group = false;
        while let Some(token) = tokens.get(i) {
            match token {
                Token::Word(word) if word == "as" => {
                    alias = tokens.get(i + 1).and_then(|t| t.word()).map(str::to_owned);
                    i += 1;
                }
                Token::Word(word) => prefix.push(word.clone()),
                Token::Mark('{') => {
                    is_group = true;
                    i += 1;
                    while !tokens[i].is('}') {
                        i = self.tree(here, tokens, i, prefix, public, named);
                        i += usize::from(tokens[i].is(','));
                    }
                }
                Token::Mark(',' | ';' | '}') => break,
                _ => {}
            }
            i += 1;
        }
        if !is_group && prefix.len() > length {
            let mut path = prefix.clone();
            if path.len() > 1 && path.last().is_some_and(|l| l == "self") {
                path.pop();
            }
            let alias = alias.or_else(|| path.last().cloned());
            let path = self.absolute(here, &path);
            named.extend(path.map(|path| Named {
                path,
                alias,
                public,
            }));
        }
        prefix.truncate(length);
        i
    }

    /// The path from the root, if it is one of this library.
    fn absolute(&self, here: &[String], path: &[String]) -> Option<Path> {
        let mut base = here.to_vec();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => {
                base.clear();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|p| p == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            first if self.files.contains_key(&joined(here, first)) => {}
            _ => return None,
        }
        base.extend(rest.iter().cloned());
        Some(base)
    }
}

fn joined(path: &[String], name: &str) -> Path {
    let mut joined = path.to_vec();
    joined.push(name.to_owned());
    joined
}

/// The module that is a file.
fn module(name: &str) -> Path {
    let name = name.trim_start_matches("src/").trim_end_matches(".rs");
    let name = name.trim_end_matches("/mod");
    match name {
        "lib" | "main" => Vec::new(),
        _ => name.split('/').map(str::to_owned).collect(),
    }
}

/// Leaves out what is compiled for tests only; the names of modules among that which are files.
fn without_tests(tokens: &[Token]) -> (Vec<Token>, Vec<String>) {
    let (mut kept, mut tests) = (Vec::new(), Vec::new());
    let is_test = |i: usize| {
        let words = ["cfg", "test"];
        tokens.get(i).is_some_and(|t| t.is('#'))
            && tokens.get(i + 2).and_then(|t| t.word()) == Some(words[0])
            && tokens.get(i + 4).and_then(|t| t.word()) == Some(words[1])
            && tokens.get(i + 5).is_some_and(|t| t.is(')'))
    };
    let mut i = 0;
    while i < tokens.len() {
        if !is_test(i) {
            kept.push(tokens[i].clone());
            i += 1;
            continue;
        }
        i += 7;
        let mut braces = 0;
        while i < tokens.len() {
            let token = &tokens[i];
            if token.word() == Some("mod") && tokens.get(i + 2).is_some_and(|t| t.is(';')) {
                tests.extend(tokens[i + 1].word().map(str::to_owned));
            }
            let among = |marks: &str| i32::from(marks.chars().any(|mark| token.is(mark)));
            braces += among("([{") - among(")]}");
            i += 1;
            let ends_item = token.is(';') || token.is('}') || token.is(',');
            if braces == 0 && ends_item {
                break;
            }
        }
    }
    (kept, tests)
}
