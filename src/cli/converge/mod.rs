//! `phalanx converge`: error against time, as tables to stdout and a report in a folder.

pub mod args;
mod progress;
mod tables;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use self::args::ConvergeArgs;
use self::progress::Progress;
use super::failure::Failure;
use super::input::{self, Input};
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use super::signals::Signals;
use super::units;
use crate::converge::plan::{Axis, BudgetUnit, Budgets, names, variants};
use crate::converge::reference::{Reference, ReferenceFigures};
use crate::converge::report;
use crate::converge::run::{self, Study};
use crate::converge::subject::{Options, ReferenceSource, Subject};
use crate::film::output::{self, Attribute, AttributeValue};
use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::integrate::{RenderError, Settings};
use crate::scene::Scene;

pub fn run(args: &ConvergeArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let json_file = args.json.as_deref().filter(|path| *path != Path::new("-"));
    if let Some(path) = json_file {
        outputs::check_text(path)?;
    }
    check_references(args)?;
    let signals = Signals::install()
        .map_err(|e| Failure::Io(format!("signal handlers cannot be installed: {e}")))?;
    let subjects = subjects(args, messages)?;
    prepare_folder(args, &subjects, json_file)?;
    let options = options(args);
    messages.say(announcement(args, &subjects, &options));
    signals.hold();

    let progress = Progress::new(
        &signals,
        messages,
        subjects.iter().map(|s| s.name.clone()).collect(),
        subjects.iter().map(|s| names(&s.variants)).collect(),
    );
    let result = run::study(&subjects, &options, &progress);
    progress.finish();
    let study = result.map_err(|e| match e {
        RenderError::Settings(_) | RenderError::State(_) => Failure::Input(e.to_string()),
        RenderError::Threads { .. } => Failure::Io(e.to_string()),
    })?;
    let Some(study) = study.filter(|s| !s.stopped || s.scenes.iter().any(|s| !s.runs.is_empty()))
    else {
        messages.warning("stopped before any run was complete; no report is written");
        return Ok(signals.exit_code().unwrap_or(ExitCode::SUCCESS));
    };
    for warning in &study.warnings {
        messages.warning(warning);
    }
    if study.stopped {
        messages.say("stopped; reporting what is complete");
    }
    let whole = write_report(args, &subjects, &study, messages);
    let json = serde_json::to_string_pretty(&study).unwrap_or_default() + "\n";
    if args.json.is_some() && json_file.is_none() {
        outputs::print(&json)?;
    } else {
        outputs::print(&tables::text(&study))?;
    }
    if let Some(path) = json_file {
        outputs::save(path, |path| outputs::write_text(path, &json)).map_err(Failure::Io)?;
        messages.say(format_args!("wrote {}", path.display()));
    }
    if !whole {
        return Ok(ExitCode::from(1));
    }
    Ok(signals.exit_code().unwrap_or(ExitCode::SUCCESS))
}

/// Fails before any scene is read.
fn check_references(args: &ConvergeArgs) -> Result<(), Failure> {
    let scenes = args.scenes.len().max(1);
    let count = |flag: &str, given: usize, wanted: usize, of: &str| {
        if given == 0 || given == wanted {
            return Ok(());
        }
        Err(Failure::Input(format!(
            "{flag}: {given} given for {wanted} {of}"
        )))
    };
    count("--reference", args.reference.len(), scenes, "scenes")?;
    count(
        "--reference-error",
        args.reference_error.len(),
        args.reference.len(),
        "references",
    )
}

fn options(args: &ConvergeArgs) -> Options {
    let (unit, first) = match args.first_effort {
        Some(effort) => (BudgetUnit::Effort, effort as f64),
        None => (BudgetUnit::Seconds, args.first_seconds),
    };
    Options {
        budgets: Budgets {
            unit,
            first,
            count: args.budgets as usize,
        },
        seeds: args.seeds,
        first_seed: args.seed,
        reference_factor: args.reference_factor,
        reference_parts: args.reference_parts,
        exposure: args.exposure,
        command: command(),
    }
}

/// What the user typed, as a shell would read it again.
fn command() -> String {
    let quoted = |text: String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:+@%".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            text
        } else {
            format!("'{}'", text.replace('\'', "'\\''"))
        }
    };
    let arguments = std::env::args_os()
        .skip(1)
        .map(|a| quoted(a.to_string_lossy().into_owned()));
    std::iter::once("phalanx".to_string())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

/// All scenes with their variants and references.
fn subjects(args: &ConvergeArgs, messages: Messages) -> Result<Vec<Subject>, Failure> {
    let kinds = args.integrators.clone();
    let axes: Vec<Axis> = (args.axes().into_iter())
        .filter(|(flag, axis)| {
            let idle = !axis.values.is_empty() && !kinds.iter().any(|k| (axis.applies)(*k));
            if idle {
                messages.warning(format_args!("{flag} means nothing to these integrators"));
            }
            !idle
        })
        .map(|(_, axis)| axis)
        .collect();
    let paths: Vec<Option<&Path>> = match args.scenes.len() {
        0 => vec![None],
        _ => args.scenes.iter().map(|p| Some(p.as_path())).collect(),
    };
    let memory = MemoryLimit::new(None);
    let subject = |(i, path): (usize, Option<&Path>)| {
        let mut input = input::load(path, &memory, messages)?;
        if let Some((width, height)) = args.resolution {
            let set = input.scene.set_resolution(width, height);
            set.map_err(|e| Failure::Input(format!("--resolution: {e}")))?;
        }
        let base = Settings {
            seed: args.seed,
            threads: args.threads as usize,
            strategies: false,
            ..Settings::of(&input.scene)
        };
        let variants = variants(&base, &kinds, &axes);
        let reference = match args.reference.get(i) {
            Some(file) => {
                let error = args.reference_error.get(i).copied();
                ReferenceSource::Given(read_reference(file, error, &input)?)
            }
            None => ReferenceSource::Render(Settings {
                integrator: args.reference_integrator,
                max_depth: (args.max_depth.iter().copied().max()).unwrap_or(base.max_depth),
                ..base
            }),
        };
        for variant in &variants {
            memory.check(&input.scene, &variant.settings, false)?;
        }
        Ok(Subject {
            name: input.name,
            scene: input.scene,
            variants,
            reference,
        })
    };
    paths.into_iter().enumerate().map(subject).collect()
}

/// A reference of the size of the scene's picture.
fn read_reference(file: &Path, error: Option<f64>, input: &Input) -> Result<Reference, Failure> {
    let extension = file
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let picture = match extension.as_deref() {
        Some("pfm") => output::read_pfm(file),
        Some("exr") => output::read_exr(file),
        _ => {
            let name = file.display();
            return Err(Failure::Input(format!(
                "{name}: the extension must be .exr or .pfm"
            )));
        }
    };
    let picture = picture.map_err(|e| Failure::Input(e.to_string()))?;
    let fail = |what: String| Err(Failure::Input(format!("{}: {what}", file.display())));
    let (width, height) = size(&input.scene);
    if (picture.width, picture.height) != (width, height) {
        return fail(format!(
            "{} x {} pixels, and {} has {width} x {height}",
            picture.width, picture.height, input.name
        ));
    }
    if picture.pixels.as_flattened().iter().any(|v| !v.is_finite()) {
        return fail("it has pixels that are not finite".into());
    }
    Ok(Reference {
        pixels: picture.pixels,
        figures: ReferenceFigures {
            source: file.display().to_string(),
            relmse: error,
            ..ReferenceFigures::default()
        },
    })
}

/// Of the crop window.
fn size(scene: &Scene) -> (u32, u32) {
    let [x0, x1, y0, y1] = scene.film.crop;
    (x1 - x0, y1 - y0)
}

/// Fails now where writing would fail after the runs, or overwrite what has been read.
fn prepare_folder(
    args: &ConvergeArgs,
    subjects: &[Subject],
    json_file: Option<&Path>,
) -> Result<(), Failure> {
    let folder = &args.output;
    let fail = |e| Failure::Input(format!("{}: {e}", folder.display()));
    fs::create_dir_all(folder).map_err(fail)?;
    let names = || subjects.iter().map(|s| s.name.as_str());
    let files = report::file_names(names()).into_iter();
    let mut files: Vec<PathBuf> = files.map(|name| folder.join(name)).collect();
    if args.reference.is_empty() {
        let stems = report::stems(names()).into_iter();
        files.extend(stems.map(|stem| reference_path(folder, &stem)));
    }
    for file in &files {
        outputs::check_text(file)?;
    }
    let read = subjects.iter().flat_map(|s| &s.scene.files);
    let read = read.chain(&args.reference).map(PathBuf::as_path);
    outputs::check_distinct(files.iter().map(PathBuf::as_path).chain(json_file), read)
}

/// Where the reference of a scene goes that was rendered for the study.
fn reference_path(folder: &Path, stem: &str) -> PathBuf {
    folder.join(format!("{stem}-reference.exr"))
}

/// What is going to happen, and how long it takes.
fn announcement(args: &ConvergeArgs, subjects: &[Subject], options: &Options) -> String {
    let variants: usize = subjects.iter().map(|s| s.variants.len()).sum();
    let runs = variants as u64 * options.seeds * options.budgets.count as u64;
    let what = format!("{runs} runs of {variants} variants");
    if options.budgets.unit == BudgetUnit::Effort {
        return what;
    }
    let largest = options.budgets.get(options.budgets.count - 1);
    let references = if args.reference.is_empty() {
        subjects.len()
    } else {
        0
    };
    let seconds = variants as f64 * options.seeds as f64 * options.budgets.total()
        + references as f64 * options.reference_factor * largest;
    let time = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    format!(
        "{what}, about {}; leave the machine to it",
        units::time(time)
    )
}

/// Writes all files; false if one is missing.
fn write_report(
    args: &ConvergeArgs,
    subjects: &[Subject],
    study: &Study,
    messages: Messages,
) -> bool {
    let folder = &args.output;
    let mut whole = true;
    let mut done = |result: Result<(), String>| {
        if let Err(message) = result {
            messages.error(message);
            whole = false;
        }
    };
    match report::files(study) {
        Ok(files) => {
            for (name, content) in files {
                let write = |path: &Path| outputs::write_bytes(path, &content);
                done(outputs::save(&folder.join(name), write));
            }
        }
        Err(e) => done(Err(format!("the report: {e}"))),
    }
    if args.reference.is_empty() {
        let names = subjects.iter().map(|s| s.name.as_str());
        let stems = report::stems(names);
        for ((subject, scene), stem) in subjects.iter().zip(&study.scenes).zip(stems) {
            let (picture, attributes) = reference_file(subject, scene);
            let write = |path: &Path| output::write(path, &picture, &attributes, &Display::LINEAR);
            done(outputs::save(&reference_path(folder, &stem), write));
        }
    }
    if whole {
        let page = folder.join("index.html");
        messages.say(format_args!("wrote {}", page.display()));
    }
    whole
}

/// A rendered reference, to be used again with what is known of its error.
fn reference_file(subject: &Subject, scene: &run::SceneStudy) -> (Picture, Vec<Attribute>) {
    let film = &subject.scene.film;
    let (width, height) = size(&subject.scene);
    let picture = Picture {
        width,
        height,
        offset: [film.crop[0], film.crop[2]],
        full: [film.width, film.height],
        pixels: scene.reference.clone(),
    };
    let figures = &scene.figures.reference;
    let attribute = |name: &str, value| Attribute {
        name: name.into(),
        value,
    };
    let mut attributes = vec![
        attribute("scene", AttributeValue::Text(subject.name.clone())),
        attribute("integrator", AttributeValue::Text(figures.source.clone())),
    ];
    if let Some(own) = figures.relmse {
        attributes.push(attribute("relmse", AttributeValue::Float(own)));
    }
    (picture, attributes)
}
