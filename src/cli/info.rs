//! `phalanx info`: what a checkpoint or a picture holds. To stdout.

use std::fmt::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use super::args::resume::InfoArgs;
use super::failure::Failure;
use super::messages::Messages;
use super::outputs;
use super::units;
use crate::brief::brief;
use crate::checkpoint::CheckpointError;
use crate::formats::exr;
use crate::integrate::{Checkpoint, Settings, Shard};
use crate::memory::Bytes;

pub fn run(args: &InfoArgs, _: Messages) -> Result<ExitCode, Failure> {
    let path = &args.file;
    let fail = |e: &dyn fmt::Display| Failure::Input(format!("{}: {e}", path.display()));
    let mut text = String::new();
    // Writing to a string does not fail.
    match Checkpoint::look(path) {
        Ok(checkpoint) => _ = of_checkpoint(&mut text, path, &checkpoint),
        Err(CheckpointError::Foreign) if outputs::is_exr_file(path) => {
            let figures = exr::figures(path).map_err(|e| fail(&e))?;
            _ = of_picture(&mut text, path, &figures);
        }
        Err(CheckpointError::Foreign) => {
            return Err(fail(&"is neither a checkpoint of Phalanx nor an .exr"));
        }
        Err(e) => return Err(fail(&e)),
    }
    let lines: Vec<String> = text.lines().map(brief).collect();
    outputs::print(&(lines.join("\n") + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn of_checkpoint(out: &mut String, path: &Path, checkpoint: &Checkpoint) -> fmt::Result {
    let Checkpoint {
        origin,
        resolution,
        crop,
        settings,
        error,
        state,
    } = checkpoint;
    let made = state.made;
    writeln!(
        out,
        "{}: a render by Phalanx {}",
        path.display(),
        env!("CARGO_PKG_VERSION")
    )?;
    let scene = origin
        .path
        .as_deref()
        .map(|path| path.display().to_string());
    writeln!(
        out,
        "  scene         {}",
        scene.as_deref().unwrap_or("built-in")
    )?;
    if origin.files() > 0 {
        let state = origin.check().err();
        let state = state.map_or("unchanged".into(), |change| change.to_string());
        writeln!(out, "  files         {}: {state}", origin.files())?;
    }
    if let Some([width, height]) = resolution {
        writeln!(out, "  resolution    {width} x {height}")?;
    }
    if let Some([x0, x1, y0, y1]) = crop {
        writeln!(out, "  crop          {x0},{x1},{y0},{y1}")?;
    }
    writeln!(out, "  integrator    {}", settings.integrator.name())?;
    writeln!(out, "  seed          {}", settings.seed)?;
    writeln!(out, "  max depth     {}", settings.max_depth)?;
    if settings.integrator.mutates() {
        writeln!(out, "  chains        {}", settings.chains)?;
        writeln!(out, "  bootstrap     {}", settings.bootstrap)?;
    }
    if let Some(Shard { index, of }) = settings.shard {
        writeln!(out, "  shard         {}/{of}", index + 1)?;
    }
    writeln!(out, "  asked for     {}", asked_for(settings))?;
    let mut counts = Vec::new();
    for (count, name) in [(made.mutations, "mutations"), (made.samples, "samples")] {
        if count > 0 {
            counts.push(format!("{} {name}", units::si(count as f64)));
        }
    }
    let time = Duration::try_from_secs_f64(made.seconds).unwrap_or_default();
    let counts = counts.join(" and ");
    writeln!(out, "  made          {counts} in {}", units::time(time))?;
    if settings.time.is_none() && settings.target_error.is_none() {
        writeln!(out, "  done          {}", units::percent(made.part))?;
    }
    if let Some(error) = error {
        writeln!(out, "  error         {}", units::percent(*error))?;
    }
    if let Ok(metadata) = path.metadata() {
        writeln!(out, "  size          {}", Bytes(metadata.len()))?;
    }
    writeln!(out, "  go on with    phalanx resume {}", path.display())
}

/// What ends the render.
fn asked_for(settings: &Settings) -> String {
    let mut ends = Vec::new();
    if let Some(time) = settings.time {
        ends.push(units::time(time));
    }
    if let Some(error) = settings.target_error {
        ends.push(format!("an error of {}", units::percent(error)));
    }
    if ends.is_empty() {
        ends.push(match settings.integrator.mutates() {
            true => format!("{} mutations per pixel", settings.mutations_per_pixel),
            false => format!("{} samples per pixel", settings.samples_per_pixel),
        });
    }
    ends.join(", or ")
}

fn of_picture(out: &mut String, path: &Path, figures: &exr::Figures) -> fmt::Result {
    let [width, height] = figures.size;
    writeln!(
        out,
        "{}: a picture of {width} x {height} pixels",
        path.display()
    )?;
    if let Some(software) = &figures.software {
        writeln!(out, "  {:<24} {software}", "software")?;
    }
    for (name, value) in &figures.own {
        writeln!(out, "  {name:<24} {value}")?;
    }
    if figures.own.is_empty() {
        writeln!(out, "  it says nothing about its making")?;
    }
    Ok(())
}
