//! What Phalanx says on stderr, each message on one line of a bounded length ([`brief`]). Nothing
//! here fails: a closed stderr loses messages, never a render.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;

use clap::ColorChoice;

use super::failure::Failure;
use crate::brief::brief;

/// Prints messages, one line each.
#[derive(Clone, Copy, Debug)]
pub struct Messages {
    colored: bool,
    /// Warnings and errors only.
    pub quiet: bool,
    /// Not even those.
    mute: bool,
}

impl Messages {
    pub fn new(color: ColorChoice, quiet: bool) -> Self {
        let colored = match color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => {
                // https://no-color.org: set to anything but nothing.
                let declined = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
                !declined && io::stderr().is_terminal() && !dumb_terminal()
            }
        };
        Self {
            colored,
            quiet,
            mute: false,
        }
    }

    /// Prints nothing at all.
    pub fn mute() -> Self {
        Self {
            colored: false,
            quiet: true,
            mute: true,
        }
    }

    pub fn error(&self, text: impl Display) {
        self.labelled("error", "31", text);
    }

    /// Says why a command failed, and with which exit code that ends it.
    pub fn failed(&self, failure: &Failure) -> ExitCode {
        let (message, code) = match failure {
            Failure::Input(message) => (message, 2),
            Failure::Io(message) => (message, 1),
        };
        self.error(message);
        ExitCode::from(code)
    }

    pub fn warning(&self, text: impl Display) {
        self.labelled("warning", "33", text);
    }

    pub fn note(&self, text: impl Display) {
        if !self.quiet {
            self.labelled("note", "36", text);
        }
    }

    pub fn say(&self, text: impl Display) {
        if !self.quiet {
            let _ = writeln!(io::stderr(), "{}", brief(&text.to_string()));
        }
    }

    /// What was asked for, also where the rest is not wanted.
    pub fn always(&self, text: impl Display) {
        let _ = writeln!(io::stderr(), "{}", brief(&text.to_string()));
    }

    /// `code` is the colour as in "select graphic rendition" (ECMA-48).
    fn labelled(&self, label: &str, code: &str, text: impl Display) {
        if self.mute {
            return;
        }
        let text = brief(&text.to_string());
        let mut stderr = io::stderr().lock();
        let _ = if self.colored {
            writeln!(stderr, "\x1b[1;{code}m{label}\x1b[0m: {text}")
        } else {
            writeln!(stderr, "{label}: {text}")
        };
    }
}

/// A terminal without cursor movement.
pub fn dumb_terminal() -> bool {
    std::env::var_os("TERM").is_some_and(|t| t == "dumb")
}
