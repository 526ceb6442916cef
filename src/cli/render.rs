//! `phalanx render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use super::args::RenderArgs;
use super::failure::Failure;
use super::input::{self, Input};
use super::interim::{self, Interim};
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use super::progress::Progress;
use super::signals::Signals;
use super::strategies;
use super::units;
use super::verdict::verdict;
use crate::film::output::{self, Attribute, AttributeValue};
use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::integrate::{self, Render, RenderError, Settings, Stats};
use crate::scene::{Film, IntegratorKind};

pub fn run(args: &RenderArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let signals = Signals::install()
        .map_err(|e| Failure::Io(format!("signal handlers cannot be installed: {e}")))?;
    let single = match args.scenes.len() > 1 {
        true if !args.output.is_empty() => Some("-o"),
        true if args.stats.is_some() => Some("--stats"),
        _ => None,
    };
    if let Some(flag) = single {
        return Err(Failure::Input(format!(
            "{flag}: files of several scenes are named after them; leave it out, or render them one by one"
        )));
    }
    let mut taken = Vec::new();
    let Some((last, scenes)) = args.scenes.split_last() else {
        return one(args, None, &signals, &mut taken, messages);
    };
    let mut failed = None;
    for scene in scenes {
        match one(args, Some(scene), &signals, &mut taken, messages) {
            Ok(code) if code == ExitCode::SUCCESS => {}
            Ok(code) => return Ok(code),
            // It does not keep the others from being rendered.
            Err(failure) => failed = Some(messages.failed(&failure)),
        }
        signals.release();
    }
    let code = one(args, Some(last), &signals, &mut taken, messages)?;
    Ok(match failed {
        Some(failed) if code == ExitCode::SUCCESS => failed,
        _ => code,
    })
}

/// Renders a scene. Files in `taken` are those of the scenes before it.
fn one(
    args: &RenderArgs,
    scene: Option<&Path>,
    signals: &Signals,
    taken: &mut Vec<PathBuf>,
    messages: Messages,
) -> Result<ExitCode, Failure> {
    // Before the scene is read: a mistyped path should not cost the minute that takes.
    outputs::check_pictures(&args.output)?;
    if let Some(path) = &args.stats {
        outputs::check_text(path)?;
    }
    let written = outputs::once(&args.output).into_iter();
    outputs::check_distinct(written.chain(args.stats.as_deref()), scene)?;

    let memory = MemoryLimit::new(args.max_memory);
    let mut input = input::load(scene, &memory, messages)?;
    if args.time.is_some_and(|limit| input.load_time > limit) {
        let taken = units::time(input.load_time);
        messages.note(format_args!(
            "loading took {taken}; --time counts from now on"
        ));
    }
    args.picture.apply(&mut input.scene)?;
    let files = files(args, &input, messages)?;
    if let Some(file) = files.iter().find(|file| taken.contains(file)) {
        return Err(Failure::Input(format!(
            "{}: {} has just been written for another scene; render this one by itself, with -o",
            input.name,
            file.display()
        )));
    }
    taken.extend_from_slice(&files);
    let scene = &input.scene;
    let mut settings = Settings::of(scene);
    args.apply(&mut settings, scene.film.crop_pixels());
    args.check_effort(settings.integrator)?;
    for flag in args.idle(settings.integrator) {
        messages.warning(format_args!("{flag} means nothing to this integrator"));
    }
    integrate::check(&settings).map_err(|e| Failure::Input(e.to_string()))?;
    let beside = strategies::files(&files, &settings);
    outputs::check_pictures(&beside)?;
    let written = files.iter().chain(&beside).map(PathBuf::as_path);
    let read = scene.files.iter().map(PathBuf::as_path);
    outputs::check_distinct(written.chain(args.stats.as_deref()), read)?;
    memory.check(scene, &settings)?;
    let layers = 1 + u64::from(args.error_layers);
    let pictures = 1 + strategies::pictures(&settings);
    outputs::check_room(&files, pictures * scene.film.crop_pixels(), layers)?;

    if args.error_layers && !files.iter().any(|f| output::is_exr(f)) {
        messages.warning("--error-layers means nothing without an .exr file");
    }
    let progress = Progress::new(signals, messages, &settings);
    let result = match args.output_every {
        None => integrate::render(scene, &settings, &progress),
        Some(every) => thread::scope(|scope| {
            let (observer, pictures) = Interim::new(&progress, every);
            let display = args.display.display();
            let files = &files;
            let write =
                move |picture: &Picture| write_interim(files, &scene.film, picture, &display);
            scope.spawn(move || interim::write_all(pictures, messages, write));
            integrate::render(scene, &settings, &observer)
        }),
    };
    progress.finish();
    let mut render = result.map_err(|e| match e {
        RenderError::Settings(_) => Failure::Input(e.to_string()),
        RenderError::Threads { .. } => Failure::Io(e.to_string()),
    })?;
    let stats = &mut render.stats;
    stats.load_seconds = input.load_time.as_secs_f64();
    stats.total_seconds += stats.load_seconds;

    if let Some(limit) = args.time
        && stats.build_seconds > limit.as_secs_f64()
    {
        let taken = units::time(Duration::from_secs_f64(stats.build_seconds));
        messages.note(format_args!(
            "building the tree took {taken}, which --time does not cut short"
        ));
    }
    for warning in &render.warnings {
        messages.warning(warning);
    }
    if let Some(code) = signals.exit_code() {
        let nothing = render.stats.mutations == 0 && render.stats.samples == 0;
        if nothing {
            messages.warning("stopped before anything was rendered; no picture is written");
            return Ok(code);
        }
        messages.say("stopped; writing the picture so far");
    }
    let summary = summary(&render);
    let verdict = verdict(&render, settings.target_error);
    let whole = write_files(args, &files, &input, &settings, render, messages);
    messages.say(summary);
    if let Some(verdict) = verdict {
        messages.say(verdict);
    }
    if !whole {
        return Ok(ExitCode::from(1));
    }
    Ok(signals.exit_code().unwrap_or(ExitCode::SUCCESS))
}

/// The picture files to write, each once, all of them writable.
fn files(args: &RenderArgs, input: &Input, messages: Messages) -> Result<Vec<PathBuf>, Failure> {
    let film_name = input.scene.film.filename.as_deref();
    let mut files = args.output.clone();
    if files.is_empty() {
        let (default, remark) = outputs::default_files(input.path.as_deref(), film_name);
        if let Some(remark) = remark {
            messages.warning(remark);
        }
        outputs::check_pictures(&default)?;
        files = default;
    }
    if !args.no_png && !files.iter().any(|f| outputs::is_png(f)) {
        let beside: Vec<PathBuf> = (files.iter())
            .filter(|f| outputs::is_exr_file(f))
            .map(|f| f.with_extension("png"))
            .collect();
        // Where there is no place for it, nobody has asked for it.
        let fits = |png: &PathBuf| {
            let read = input.scene.files.iter().map(PathBuf::as_path);
            outputs::check_pictures(std::slice::from_ref(png)).is_ok()
                && outputs::check_distinct([png.as_path()], read).is_ok()
        };
        files.extend(beside.into_iter().filter(fits));
    }
    let once = outputs::once(&files).into_iter();
    Ok(once.map(Path::to_owned).collect())
}

/// One line: how much, how long, and by what.
fn summary(render: &Render) -> String {
    let stats = &render.stats;
    let time = units::time(Duration::from_secs_f64(stats.total_seconds.max(0.0)));
    let size = format!("{} x {} pixels", stats.width, stats.height);
    let rays = units::si(stats.rays_per_second);
    let mut line = if stats.mutations == 0 && stats.samples > 0 {
        format!(
            "{size} in {time}: {} samples, {} samples/s, {rays} rays/s, mean radiance {:.5}",
            units::si(stats.samples as f64),
            units::si(stats.samples_per_second),
            stats.b
        )
    } else {
        format!(
            "{size} in {time}: {}{} mutations, {} mutations/s, {rays} rays/s, b = {} ± {}, acceptance {:.1} % small, {:.1} % large",
            match stats.samples {
                0 => String::new(),
                n => format!("{} samples, ", units::si(n as f64)),
            },
            units::si(stats.mutations as f64),
            units::si(stats.mutations_per_second),
            significant(stats.b, 5),
            significant(stats.b_stderr, 2),
            100.0 * stats.acceptance_small,
            100.0 * stats.acceptance_large
        )
    };
    // Nothing where no depth carries light.
    let shares = stats.shares.as_ref().map(ToString::to_string);
    if let Some(shares) = shares.filter(|shares| !shares.is_empty()) {
        line += &format!("; {shares}");
    }
    line
}

/// A number to so many significant digits, scientific where it is far from 1.
fn significant(value: f64, digits: usize) -> String {
    let magnitude = value.abs().log10().floor();
    if value == 0.0 || !magnitude.is_finite() {
        return format!("{value}");
    }
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// Writes pictures and figures; false if something is not where it should be.
fn write_files(
    args: &RenderArgs,
    files: &[PathBuf],
    input: &Input,
    settings: &Settings,
    mut render: Render,
    messages: Messages,
) -> bool {
    let film = &input.scene.film;
    let pixels = std::mem::take(&mut render.pixels);
    let picture = Picture {
        pixels,
        ..render.picture()
    };
    let mut attributes = attributes(&input.name, settings, &render.stats);
    attributes.extend(chromaticities(film));
    let display = args.display.display();
    let errors = (render.deviation.as_ref().filter(|_| args.error_layers))
        .map(|deviation| integrate::standard_errors(deviation, render.width as usize));
    if args.error_layers && errors.is_none() {
        messages.warning("one sample per pixel has no standard error: no error layers are written");
    }
    let layers: Vec<(&str, &[[f32; 3]])> = (errors.iter())
        .map(|pixels| ("error", pixels.as_slice()))
        .collect();
    let write = |path: &Path| output::write_layers(path, &picture, &layers, &attributes, &display);
    let mut whole = strategies::write(files, &picture, &render.strategies, &display, messages);
    for path in files {
        match outputs::save_picture(path, write) {
            Ok(()) => messages.say(format_args!("wrote {}", path.display())),
            Err(message) => {
                messages.error(message);
                whole = false;
            }
        }
    }
    if let Some(path) = &args.stats {
        let json = serde_json::to_string_pretty(&render.stats).unwrap_or_default() + "\n";
        match outputs::save(path, |path| outputs::write_text(path, &json)) {
            Ok(()) => messages.say(format_args!("wrote {}", path.display())),
            Err(message) => {
                messages.error(message);
                whole = false;
            }
        }
    }
    whole
}

/// The primaries of a film that has its own.
fn chromaticities(film: &Film) -> Option<Attribute> {
    film.chromaticities.map(|c| Attribute {
        name: "chromaticities".into(),
        value: AttributeValue::Chromaticities(c),
    })
}

/// Writes a picture that is not the last one.
fn write_interim(
    files: &[PathBuf],
    film: &Film,
    picture: &Picture,
    display: &Display,
) -> Result<(), String> {
    let attributes: Vec<Attribute> = chromaticities(film).into_iter().collect();
    for path in files.iter().filter(|path| !crate::files::is_special(path)) {
        let written = output::write(path, picture, &attributes, display);
        written.map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// Figures that differ between equal renders: how long they took, and on what.
fn is_of_the_machine(figure: &str) -> bool {
    figure.ends_with("_seconds")
        || figure.ends_with("_per_second")
        || ["threads", "lanes", "peak_rss_bytes"].contains(&figure)
}

/// What an EXR file says about its making: scene, settings, and the figures of the render under the
/// names they have in `--stats`, after `phalanx:`, but for those that differ between equal renders:
/// equal renders are equal files.
fn attributes(scene: &str, settings: &Settings, stats: &Stats) -> Vec<Attribute> {
    let text = |v: &str| AttributeValue::Text(v.into());
    let tuned = |auto: bool, v: f32| match auto {
        true => text("auto"),
        false => AttributeValue::Float(v.into()),
    };
    let integer = |v: u64| AttributeValue::Integer(i64::try_from(v).unwrap_or(i64::MAX));
    let mut list = vec![("scene", text(scene))];
    match settings.integrator.mutates() {
        true => list.extend([
            ("mutations_per_pixel", integer(settings.mutations_per_pixel)),
            ("chains", integer(settings.chains)),
            ("bootstrap", integer(settings.bootstrap)),
            (
                "large_step_probability",
                tuned(settings.tune.large_step, settings.large_step_probability),
            ),
            ("mutation", text(settings.mutation.name())),
            ("sigma", tuned(settings.tune.sigma, settings.sigma)),
        ]),
        false => {
            list.push(("samples_per_pixel", integer(settings.samples_per_pixel)));
        }
    }
    if matches!(
        settings.integrator,
        IntegratorKind::Auto | IntegratorKind::Mmlt
    ) {
        list.push(("strategy_choice", text(settings.strategy_choice.name())));
    }
    // Names of our own, so that they are nobody else's.
    let own = |name: &str, value| Attribute {
        name: format!("phalanx:{name}"),
        value,
    };
    let mut list: Vec<Attribute> = (list.into_iter())
        .map(|(name, value)| own(name, value))
        .collect();
    list.push(Attribute {
        name: "software".into(),
        value: text(concat!("Phalanx ", env!("CARGO_PKG_VERSION"))),
    });
    if let Ok(serde_json::Value::Object(figures)) = serde_json::to_value(stats) {
        let figures = figures
            .into_iter()
            .filter(|(name, _)| !is_of_the_machine(name));
        list.extend(figures.filter_map(|(name, value)| {
            let value = match &value {
                serde_json::Value::String(s) => text(s),
                // A seed may need all 64 bits.
                serde_json::Value::Number(n) => match (n.as_i64(), n.as_u64()) {
                    (Some(i), _) => AttributeValue::Integer(i),
                    (None, Some(u)) => text(&u.to_string()),
                    (None, None) => AttributeValue::Float(n.as_f64()?),
                },
                _ => return None,
            };
            Some(own(&name, value))
        }));
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits() {
        assert_eq!(significant(0.123456, 5), "0.12346");
        assert_eq!(significant(12.3456, 2), "12");
        assert_eq!(significant(1.5e-9, 2), "1.5e-9");
        assert_eq!(significant(1.5e9, 2), "1.5e9");
        assert_eq!(significant(0.0, 2), "0");
    }

    #[test]
    fn every_figure_is_an_attribute() {
        let stats = Stats {
            seed: u64::MAX,
            b: 0.5,
            ..Stats::default()
        };
        let settings = Settings {
            integrator: IntegratorKind::Mmlt,
            seed: 0,
            threads: 0,
            lanes: integrate::Width::One,
            max_depth: 5,
            samples_per_pixel: 1,
            mutations_per_pixel: 1,
            chains: 1,
            bootstrap: 1,
            large_step_probability: 0.3,
            mutation: crate::chain::mutate::Mutation::Gaussian,
            sigma: 0.01,
            tune: crate::chain::tune::Tune {
                sigma: true,
                large_step: false,
            },
            strategy_choice: crate::integrate::StrategyChoice::Uniform,
            time: None,
            target_error: None,
            estimate_error: true,
            error_layers: false,
            strategies: false,
            batch: None,
            forced: Vec::new(),
        };
        let list = attributes("a.pbrt", &settings, &stats);
        let get = |name: &str| {
            let name = format!("phalanx:{name}");
            list.iter().find(|a| a.name == name).map(|a| &a.value)
        };
        assert_eq!(get("b"), Some(&AttributeValue::Float(0.5)));
        let auto = AttributeValue::Text("auto".into());
        assert_eq!(get("sigma"), Some(&auto));
        assert!(get("large_step_probability") != Some(&auto));
        assert_eq!(get("chains"), Some(&AttributeValue::Integer(1)));
        let seed = AttributeValue::Text(u64::MAX.to_string());
        assert_eq!(get("seed"), Some(&seed));
    }
}
