//! `phalanx replay`: one path again, step by step. To stdout.

pub mod args;
mod document;
mod text;

use std::io::{self, Read};
use std::path::Path;
use std::process::ExitCode;

use self::args::ReplayArgs;
use self::document::{Document, Iteration};
use super::failure::Failure;
use super::input;
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use crate::integrate::{RenderError, Settings, Silent, Whose, rerun};
use crate::plan::DepthPlan;
use crate::replay::Recorder;
use crate::scene::{IntegratorKind, Projection};
use crate::transport::World;

pub fn run(args: &ReplayArgs, messages: Messages) -> Result<ExitCode, Failure> {
    // Before the scene is read: a mistyped number should not cost the minute that takes.
    let numbers = samples(args)?;
    let mut input = input::load(args.scene.as_deref(), &MemoryLimit::new(None), messages)?;
    args.picture.apply(&mut input.scene)?;
    let scene = &input.scene;
    if let Some(medium) = scene.media.list.first() {
        return Err(Failure::Input(format!(
            "{}: paths through participating media (\"{}\", {}) cannot be replayed; remove the media",
            input.name, medium.name, medium.origin
        )));
    }
    if let Some(material) = scene.materials.iter().find(|m| m.kind.is_subsurface()) {
        return Err(Failure::Input(format!(
            "{}: paths below surfaces (\"{}\", {}) cannot be replayed; use another material",
            input.name, material.name, material.origin
        )));
    }
    if !scene.instances.is_empty() {
        return Err(Failure::Input(format!(
            "{}: paths that meet instances of objects cannot be replayed; place the shapes themselves",
            input.name
        )));
    }
    if let Projection::Lenses(_) = scene.camera.projection {
        return Err(Failure::Input(format!(
            "{}: paths through the lenses of a realistic camera cannot be replayed; use a perspective camera",
            input.name
        )));
    }
    let asked = args.integrator.unwrap_or(scene.integrator.kind);
    let chained = matches!(asked, IntegratorKind::Auto | IntegratorKind::Mmlt);
    let mut settings = Settings {
        integrator: if chained { asked } else { IntegratorKind::Mmlt },
        ..Settings::of(scene)
    };
    args.chains.apply(&mut settings);
    let mut document = Document {
        scene_file: &input.name,
        ..Document::default()
    };
    if let Some(numbers) = numbers {
        for flag in args.chains.given() {
            messages.warning(format_args!("{flag} means nothing without --chain"));
        }
        let world = World::new(scene, args.depth);
        let plan = plan(&world, args.depth)?;
        check_count(&numbers, plan).map_err(Failure::Input)?;
        document.path = Some(Recorder::new(scene, &world).report(plan, &numbers));
    } else {
        if !chained {
            let who = match args.integrator {
                Some(_) => "the flag",
                None => "the scene",
            };
            messages.note(format_args!(
                "{who} asks for {}; these are chains of --integrator mmlt",
                asked.title()
            ));
        }
        if settings.max_depth >= crate::chain::counts::MAX_DEPTHS {
            // World holds a plan of every depth.
            let most = crate::chain::counts::MAX_DEPTHS - 1;
            let message = format!(
                "{}: maxdepth {} is beyond {most}",
                input.name, settings.max_depth
            );
            return Err(Failure::Input(message));
        }
        let world = World::new(scene, settings.max_depth);
        let whose = Whose {
            depth: args.depth,
            chain: args.chain.unwrap_or(0) as usize,
            iteration: args.iteration.unwrap_or(0),
        };
        let visit = rerun(scene, &world, &settings, whose, &Silent).map_err(|e| match e {
            RenderError::Settings(_) | RenderError::State(_) => {
                Failure::Input(format!("{}: {e}", input.name))
            }
            RenderError::Threads { .. } => Failure::Io(e.to_string()),
        })?;
        let recorder = Recorder::new(scene, &world);
        document.current = Some(recorder.report(&visit.plan, &visit.state.samples));
        document.proposal = Some(recorder.report(&visit.plan, &visit.step.proposal));
        document.iteration = Some(Iteration::of(&whose, &visit));
    }
    let out = if args.json {
        serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
    } else {
        text::of(&document)
    };
    outputs::print(&out)?;
    Ok(ExitCode::SUCCESS)
}

fn plan<'a>(world: &'a World, depth: u32) -> Result<&'a DepthPlan, Failure> {
    let plan = world.plan.depths.get(depth as usize);
    plan.ok_or_else(|| Failure::Input(format!("there is no depth {depth}")))
}

/// The primary samples that the flags give, if they do.
fn samples(args: &ReplayArgs) -> Result<Option<Vec<f32>>, Failure> {
    let stdin = Path::new("-");
    let (name, text) = match (&args.samples, &args.samples_file) {
        (None, None) => return Ok(None),
        (Some(list), _) if list.trim() != "-" => ("--samples".to_string(), list.clone()),
        (None, Some(path)) if path != stdin => {
            let name = path.display().to_string();
            let read = std::fs::read_to_string(path);
            let text = read.map_err(|e| Failure::Input(format!("{name}: {e}")))?;
            (name, text)
        }
        _ => {
            let mut text = String::new();
            let read = io::stdin().lock().read_to_string(&mut text);
            read.map_err(|e| Failure::Input(format!("stdin: {e}")))?;
            ("stdin".into(), text)
        }
    };
    let numbers = parse(&text).map_err(|e| Failure::Input(format!("{name}: {e}")))?;
    Ok(Some(numbers))
}

/// Numbers in `[0, 1)` between commas and white space.
fn parse(text: &str) -> Result<Vec<f32>, String> {
    let words = text.split(|c: char| c == ',' || c.is_whitespace());
    (words.filter(|w| !w.is_empty()).enumerate())
        .map(|(i, word)| {
            let place = || format!("primary sample {}, \"{word}\"", i + 1);
            let number: f32 =
                (word.parse()).map_err(|_| format!("{}: is not a number", place()))?;
            if (0.0..1.0).contains(&number) {
                // Not -0.
                Ok(number.abs())
            } else {
                Err(format!("{}: is not in [0, 1)", place()))
            }
        })
        .collect()
}

/// Refuses too many or too few primary samples, and says what they are for.
fn check_count(numbers: &[f32], plan: &DepthPlan) -> Result<(), String> {
    let wanted = plan.layout.total;
    if numbers.len() == wanted {
        return Ok(());
    }
    let parts = plan.layout.parts().into_iter();
    let parts = parts.filter(|(_, range)| !range.is_empty());
    let list: Vec<String> = parts
        .map(|(name, range)| format!("{} {name}", range.len()))
        .collect();
    Err(format!(
        "{} primary samples; a path of depth {} takes {wanted} in this scene: {}",
        numbers.len(),
        plan.depth,
        list.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers() {
        assert_eq!(parse("0.5, 0\n 1e-3,,"), Ok(vec![0.5, 0.0, 1e-3]));
        assert_eq!(parse("-0").map(|v| v[0].to_bits()), Ok(0));
        assert_eq!(parse(""), Ok(vec![]));
        for bad in ["1", "0.5,-0.1", "nan", "x", "0.99999999999", "inf"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
