//! Running `phalanx` in a folder, and what every subcommand does with bad input.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The program in a folder, with arguments separated by spaces.
pub fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_phalanx"));
    command
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env_remove("NO_COLOR")
        .stdin(Stdio::null());
    command
}

pub fn run(folder: &Path, arguments: &str) -> Output {
    command(folder, arguments).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Ends with code 2, one error line and nothing on stdout.
#[track_caller]
pub fn refused(output: &Output) -> String {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    let errors = stderr.lines().filter(|l| l.starts_with("error: "));
    assert_eq!(errors.count(), 1, "{stderr}");
    assert!(output.stdout.is_empty() && !stderr.contains("panicked"));
    stderr
}
