//! `phalanx convert`: a picture in another format.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::args::DisplayArgs;
use super::compare::pictures::read_one;
use super::failure::Failure;
use super::messages::Messages;
use super::outputs;
use crate::film::output;

/// Write a picture in another format: an .exr as a .png, say
///
/// Layers beside the picture, and attributes, are left out.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct ConvertArgs {
    /// Picture to read: .exr, .pfm or .png
    pub picture: PathBuf,

    /// Files to write: .exr, .pfm or .png [default: a .png beside the picture]
    pub outputs: Vec<PathBuf>,

    #[command(flatten)]
    pub display: DisplayArgs,

    /// Print nothing but warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

pub fn run(args: &ConvertArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let files = match args.outputs.is_empty() {
        true => vec![args.picture.with_extension("png")],
        false => args.outputs.clone(),
    };
    outputs::check_pictures(&files)?;
    let written = outputs::once(&files);
    outputs::check_distinct(written.iter().copied(), [args.picture.as_path()])?;
    let picture = read_one(&args.picture)?.picture;
    let display = args.display.display();
    let write = |path: &Path| output::write(path, &picture, &[], &display);
    let mut whole = true;
    for path in written {
        match outputs::save_picture(path, write) {
            Ok(()) => messages.say(format_args!("wrote {}", path.display())),
            Err(message) => {
                messages.error(message);
                whole = false;
            }
        }
    }
    Ok(match whole {
        true => ExitCode::SUCCESS,
        false => ExitCode::from(1),
    })
}
