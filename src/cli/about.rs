//! `phalanx completions` and `phalanx man`: what shells and `man` know of the program.

use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::Shell;

use super::failure::Failure;
use super::outputs;

/// Print a script that completes commands and flags in a shell
///
/// In bash: `phalanx completions bash > ~/.local/share/bash-completion/completions/phalanx`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Whose language the script is in
    pub shell: Shell,
}

/// Print the manual page of the program, or of one of its commands
///
/// `phalanx man render | man -l -` shows that of `render`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// A command [default: the whole program]
    pub command: Option<String>,
}

/// `program` is declared whole.
pub fn completions(args: &CompletionsArgs, mut program: Command) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "phalanx", &mut script);
    outputs::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// `program` is declared whole.
pub fn man(args: &ManArgs, mut program: Command) -> Result<ExitCode, Failure> {
    // Flags of the whole program and names with it in front.
    program.build();
    let (title, command) = match &args.command {
        None => ("phalanx".to_owned(), program),
        Some(name) => {
            let found = (program.get_subcommands()).find(|c| c.get_name() == name);
            let Some(found) = found else {
                let names: Vec<&str> = (program.get_subcommands()).map(|c| c.get_name()).collect();
                return Err(Failure::Input(format!(
                    "there is no command {name:?}; there are {}",
                    names.join(", ")
                )));
            };
            (format!("phalanx-{name}"), found.clone())
        }
    };
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command)
        .title(title)
        .render(&mut page);
    rendered.map_err(|e| Failure::Io(e.to_string()))?;
    outputs::print(&String::from_utf8_lossy(&page))?;
    Ok(ExitCode::SUCCESS)
}
