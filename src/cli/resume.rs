//! `phalanx resume`.

use std::process::ExitCode;
use std::time::Duration;

use super::args::PictureArgs;
use super::args::resume::ResumeArgs;
use super::args::values::Lanes;
use super::failure::Failure;
use super::messages::Messages;
use super::ranks::{self, Ranks};
use super::render;
use super::resumed::Resumed;
use super::units;
use crate::checkpoint::CheckpointError;
use crate::integrate::{Checkpoint, Settings, Width};

pub fn run(args: &ResumeArgs, messages: Messages) -> Result<ExitCode, Failure> {
    ranks::with(args.max_memory, messages, |ranks| {
        go_on(args, ranks, messages)
    })
}

fn go_on(args: &ResumeArgs, ranks: &Ranks, messages: Messages) -> Result<ExitCode, Failure> {
    let name = args.file.display();
    let fail = |e: CheckpointError| Failure::Input(format!("{name}: {e}"));
    let checkpoint = Checkpoint::read(&args.file).map_err(fail)?;
    // Before the scene is read, which may take minutes.
    let origin = &checkpoint.origin;
    let changed = |e| Failure::Input(format!("{name} cannot be resumed: {e}"));
    origin.check().map_err(changed)?;
    if checkpoint.settings.shard.is_some() {
        if !ranks.team().is_alone() {
            return Err(Failure::Input(format!(
                "{name} is a shard: one process alone goes on with it, without mpirun"
            )));
        }
        let flags = [
            ("-o", !args.output.is_empty()),
            ("--output-every", args.output_every.is_some()),
            ("--preview", !args.preview.preview.is_empty()),
            ("--stats", args.stats.is_some()),
            ("--error-layers", args.errors.error_layers),
            ("--despeckle", args.errors.despeckle),
            ("--firefly-report", args.errors.firefly_report),
        ];
        if let Some((flag, _)) = flags.iter().find(|(_, given)| *given) {
            return Err(Failure::Input(format!(
                "{flag}: {name} is a shard, and no picture; `phalanx merge` makes one of all shards"
            )));
        }
    }
    let settings = settings(args, &checkpoint)?;
    let picture = PictureArgs {
        resolution: checkpoint.resolution.map(|[w, h]| (w, h)),
        crop: checkpoint.crop,
    };
    let flags = args.as_render(origin.path.clone(), picture);
    let resumed = Resumed {
        name: name.to_string(),
        checkpoint: &checkpoint,
        shards: vec![&checkpoint.state],
        settings,
        new_effort: args.has_effort(),
    };
    render::resumed(&flags, &resumed, ranks, messages)
}

/// What the render was to be, here: with the threads of this machine, and what is left of its time.
fn settings(args: &ResumeArgs, checkpoint: &Checkpoint) -> Result<Settings, Failure> {
    let mut settings = checkpoint.settings.clone();
    settings.threads = args.threads as usize;
    settings.lanes = match args.lanes {
        Lanes::One => Width::One,
        Lanes::Eight => Width::Eight,
    };
    if args.has_effort() {
        return Ok(settings);
    }
    let made = checkpoint.state.made;
    if let Some(time) = settings.time {
        let spent = Duration::try_from_secs_f64(made.seconds).unwrap_or(Duration::MAX);
        let left = time.saturating_sub(spent);
        if left.is_zero() && made.part < 1.0 {
            return Err(Failure::Input(format!(
                "{} has had its time of {}; say how to go on: --time, --mutations or --spp, --target-error",
                args.file.display(),
                units::time(time)
            )));
        }
        settings.time = Some(left);
    }
    Ok(settings)
}
