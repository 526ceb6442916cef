//! The command line: one file a subcommand, flags in `args.rs`.
//!
//! Everything here is a thin layer over [`pbrt::load`](crate::pbrt::load),
//! [`integrate::render`](crate::integrate::render),
//! [`integrate::measure`](crate::integrate::measure), [`metrics`](crate::metrics),
//! `converge::run` and [`replay`](crate::replay); what it adds is messages,
//! signals and files.

mod about;
mod args;
mod bench;
mod command;
mod compare;
mod converge;
mod convert;
mod cpu;
mod failure;
mod info;
mod input;
mod inspect;
mod interim;
mod keeping;
mod memory;
mod merge;
mod messages;
mod outputs;
mod preview;
mod progress;
mod ranks;
mod render;
mod replay;
mod resume;
mod resumed;
mod signals;
mod strategies;
mod table;
mod units;
mod verdict;
mod viewer;
mod watch;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::{ColorChoice, CommandFactory, FromArgMatches, ValueEnum};

use self::command::{Cli, Command};
use self::failure::Failure;
use self::messages::Messages;
use crate::brief::brief;

/// Runs the program on the arguments of this process.
pub fn main() -> ExitCode {
    cpu::check();
    signals::survive_file_limits();
    let arguments = with_command(std::env::args_os().collect());
    let command = Cli::command().color(color_before_parsing(&arguments));
    let parsed = command
        .try_get_matches_from(arguments)
        .and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(e) => {
            print_parsed(&e);
            return ExitCode::from(if e.use_stderr() { 2 } else { 0 });
        }
    };
    let quiet = match &cli.command {
        Command::Render(args) => args.quiet,
        Command::Resume(args) => args.quiet,
        Command::Merge(args) => args.quiet,
        Command::Inspect(_) | Command::Info(_) => false,
        Command::Bench(args) => args.quiet,
        Command::Compare(args) => args.quiet,
        Command::Converge(args) => args.quiet,
        Command::Replay(args) => args.quiet,
        Command::Convert(args) => args.quiet,
        Command::Completions(_) | Command::Man(_) => false,
    };
    let messages = Messages::new(cli.color, quiet);
    if let Some(note) = cpu::slow_build() {
        messages.note(note);
    }
    let done = match &cli.command {
        Command::Render(args) => render::run(args, messages),
        Command::Resume(args) => resume::run(args, messages),
        Command::Merge(args) => merge::run(args, messages),
        Command::Info(args) => info::run(args, messages),
        Command::Inspect(args) => inspect::run(args, messages),
        Command::Bench(args) => bench::run(args, messages),
        Command::Compare(args) => compare::run(args, messages),
        Command::Converge(args) => converge::run(args, messages),
        Command::Replay(args) => replay::run(args, messages),
        Command::Convert(args) => convert::run(args, messages),
        Command::Completions(args) => about::completions(args, Cli::command()),
        Command::Man(args) => about::man(args, Cli::command()),
    };
    match done {
        Ok(code) => code,
        Err(failure) => messages.failed(&failure),
    }
}

/// `phalanx scene.pbrt` renders it. No command has a name that ends so.
fn with_command(mut arguments: Vec<OsString>) -> Vec<OsString> {
    let is_scene = |name: &OsString| {
        let name = name.to_string_lossy().to_ascii_lowercase();
        name.ends_with(".pbrt") || name.ends_with(".pbrt.gz")
    };
    if arguments.get(1).is_some_and(is_scene) {
        arguments.insert(1, "render".into());
    }
    arguments
}

/// Prints what is wrong with the arguments; help and version, too, come this way. A reader that has
/// gone away is no concern.
fn print_parsed(error: &clap::Error) {
    let plain = error.render().to_string();
    let mut brief = plain.split_inclusive('\n').map(|line| {
        let text = line.trim_end_matches('\n');
        (text, brief(text))
    });
    if !error.use_stderr() || brief.clone().all(|(line, brief)| line == brief) {
        let _ = error.print();
        return;
    }
    let mut stderr = std::io::stderr().lock();
    let _ = brief.try_for_each(|(_, line)| writeln!(stderr, "{line}"));
}

/// What `--color` says, for messages about arguments that cannot be parsed.
fn color_before_parsing(arguments: &[OsString]) -> ColorChoice {
    let choice = |text: &OsString| ColorChoice::from_str(text.to_str()?, true).ok();
    let mut found = ColorChoice::Auto;
    for (i, argument) in arguments.iter().enumerate() {
        let text = argument.to_string_lossy();
        if let Some(value) = text.strip_prefix("--color=") {
            found = choice(&value.into()).unwrap_or(found);
        } else if text == "--color" {
            found = arguments.get(i + 1).and_then(choice).unwrap_or(found);
        }
    }
    found
}
