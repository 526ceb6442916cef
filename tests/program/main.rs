//! Tests of the program as its users meet it: arguments, files, messages and exit codes. They run
//! the real binary.

mod bench_command;
mod cli;
#[path = "../renderer/support/command.rs"]
mod command;
mod compare;
mod converge;
mod converge_page;
mod docs;
mod house;
mod limits;
#[cfg(unix)]
mod machines;
