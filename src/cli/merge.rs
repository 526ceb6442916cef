//! `phalanx merge`.

use std::process::ExitCode;

use super::args::PictureArgs;
use super::args::merge::MergeArgs;
use super::failure::Failure;
use super::messages::Messages;
use super::ranks::Ranks;
use super::render;
use super::resumed::Resumed;
use crate::integrate::{Checkpoint, Settings, Shard};

pub fn run(args: &MergeArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let mut shards = Vec::new();
    for path in &args.files {
        let name = path.display();
        let read = Checkpoint::read(path);
        let checkpoint = read.map_err(|e| Failure::Input(format!("{name}: {e}")))?;
        let fail = |what: &str| Err(Failure::Input(format!("{name}: {what}")));
        let Some(shard) = checkpoint.settings.shard else {
            return fail("is no shard of a render, but a whole one");
        };
        if checkpoint.state.made.part < 1.0 {
            return fail(&format!(
                "has not come to its end: `phalanx resume {name}` goes on with it"
            ));
        }
        shards.push((name.to_string(), shard, checkpoint));
    }
    shards.sort_by_key(|(_, shard, _)| shard.index);
    check(&shards)?;
    let (name, _, first) = &shards[0];
    let origin = &first.origin;
    let changed = |e| Failure::Input(format!("{name}: {e}"));
    origin.check().map_err(changed)?;
    let picture = PictureArgs {
        resolution: first.resolution.map(|[w, h]| (w, h)),
        crop: first.crop,
    };
    let flags = args.as_render(origin.path.clone(), picture);
    let resumed = Resumed {
        name: name.clone(),
        checkpoint: first,
        shards: shards.iter().map(|(_, _, c)| &c.state).collect(),
        settings: Settings {
            shard: None,
            threads: args.threads as usize,
            ..first.settings.clone()
        },
        new_effort: false,
    };
    render::resumed(&flags, &resumed, &Ranks::alone(), messages)
}

/// Whether they are all shards of one render, in order.
fn check(shards: &[(String, Shard, Checkpoint)]) -> Result<(), Failure> {
    let (first_name, first_shard, first) = &shards[0];
    let fail = |what: String| Err(Failure::Input(what));
    let of = first_shard.of;
    for (expected, (name, shard, checkpoint)) in (0..).zip(shards) {
        if shard.of != of {
            return fail(format!(
                "{name} is one of {} shards, and {first_name} one of {of}",
                shard.of
            ));
        }
        if shard.index < expected {
            return fail(format!(
                "{name} is shard {}/{of} once more",
                shard.index + 1
            ));
        }
        if shard.index > expected {
            return fail(format!("shard {}/{of} is missing", expected + 1));
        }
        // What the machines were like does not matter.
        let like_first = Settings {
            shard: first.settings.shard,
            threads: first.settings.threads,
            lanes: first.settings.lanes,
            error_layers: first.settings.error_layers,
            batch: first.settings.batch,
            ..checkpoint.settings.clone()
        };
        let same = like_first == first.settings
            && (checkpoint.resolution, checkpoint.crop) == (first.resolution, first.crop);
        if !same {
            return fail(format!(
                "{name} and {first_name} are of different renders: their settings are not the same"
            ));
        }
        if !checkpoint.origin.is_like(&first.origin) {
            return fail(format!(
                "{name} and {first_name} are of different scenes: their files are not the same"
            ));
        }
    }
    match shards.len() == of as usize {
        true => Ok(()),
        false => fail(format!("shard {}/{of} is missing", shards.len() + 1)),
    }
}
