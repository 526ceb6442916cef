//! `phalanx render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

mod attributes;
mod speckles;

use self::attributes::{of_figures, of_settings};
use super::args::RenderArgs;
use super::failure::Failure;
use super::input::{self, Input};
use super::keeping::{self, Keeping};
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use super::preview::{About, Previews};
use super::progress::Progress;
use super::ranks::{self, Ranks};
use super::resumed::Resumed;
use super::signals::Signals;
use super::strategies;
use super::units;
use super::verdict::verdict;
use super::watch::{Files, Watch};
use crate::film::output;
use crate::formats::Picture;
use crate::integrate::{self, Observer, Render, RenderError, Settings, State};

pub fn run(args: &RenderArgs, messages: Messages) -> Result<ExitCode, Failure> {
    match args.keep.shard {
        // Whoever has started it.
        Some(_) => every(args, &Ranks::alone(), messages),
        None => ranks::with(args.max_memory, messages, |ranks| {
            every(args, ranks, messages)
        }),
    }
}

/// Renders all scenes.
fn every(args: &RenderArgs, ranks: &Ranks, messages: Messages) -> Result<ExitCode, Failure> {
    let signals = Signals::install()
        .map_err(|e| Failure::Io(format!("signal handlers cannot be installed: {e}")))?;
    let single = match args.scenes.len() > 1 {
        true if !args.output.is_empty() => Some("-o"),
        true if args.stats.is_some() => Some("--stats"),
        true if args.keep.checkpoint.is_some() => Some("--checkpoint"),
        _ => None,
    };
    if let Some(flag) = single {
        return Err(Failure::Input(format!(
            "{flag}: files of several scenes are named after them; leave it out, or render them one by one"
        )));
    }
    let mut all = All::start(args, ranks, &signals, messages)?;
    let code = all.render(args);
    all.previews.finish();
    code
}

/// Goes on with a render of a single scene.
pub fn resumed(
    args: &RenderArgs,
    resumed: &Resumed,
    ranks: &Ranks,
    messages: Messages,
) -> Result<ExitCode, Failure> {
    let signals = Signals::install()
        .map_err(|e| Failure::Io(format!("signal handlers cannot be installed: {e}")))?;
    let scene = args.scenes.first().map(PathBuf::as_path);
    let mut all = All::start(args, ranks, &signals, messages)?;
    let code = one(args, scene, Some(resumed), &mut all);
    all.previews.finish();
    code
}

/// What the renders of a command share.
struct All<'a> {
    ranks: &'a Ranks,
    signals: &'a Signals,
    messages: Messages,
    previews: Previews,
    /// Files that have been written.
    taken: Vec<PathBuf>,
}

impl<'a> All<'a> {
    fn start(
        args: &RenderArgs,
        ranks: &'a Ranks,
        signals: &'a Signals,
        messages: Messages,
    ) -> Result<Self, Failure> {
        Ok(Self {
            ranks,
            signals,
            messages,
            previews: Previews::start(&args.preview.preview, signals, messages)?,
            taken: Vec::new(),
        })
    }

    /// One scene after the other.
    fn render(&mut self, args: &RenderArgs) -> Result<ExitCode, Failure> {
        let Some((last, scenes)) = args.scenes.split_last() else {
            return one(args, None, None, self);
        };
        let mut failed = None;
        for scene in scenes {
            match one(args, Some(scene), None, self) {
                Ok(code) if code == ExitCode::SUCCESS => {}
                Ok(code) => return Ok(code),
                // It does not keep the others from being rendered.
                Err(failure) => failed = Some(self.messages.failed(&failure)),
            }
            self.signals.release();
        }
        let code = one(args, Some(last), None, self)?;
        Ok(match failed {
            Some(failed) if code == ExitCode::SUCCESS => failed,
            _ => code,
        })
    }
}

/// Renders a scene, or goes on with it.
fn one(
    args: &RenderArgs,
    scene: Option<&Path>,
    resumed: Option<&Resumed>,
    all: &mut All,
) -> Result<ExitCode, Failure> {
    let (ranks, signals, messages) = (all.ranks, all.signals, all.messages);
    // Before the scene is read: a mistyped path should not cost the minute that takes.
    outputs::check_pictures(&args.output)?;
    if let Some(path) = &args.stats {
        outputs::check_text(path)?;
    }
    let written = outputs::once(&args.output).into_iter();
    outputs::check_distinct(written.chain(args.stats.as_deref()), scene)?;

    keeping::check(args, scene)?;
    let memory = MemoryLimit::new(args.max_memory);
    ranks.load(scene)?;
    let mut input = input::load(scene, &memory, messages)?;
    if let Some(resumed) = resumed {
        let origin = &resumed.checkpoint.origin;
        let same = origin.check_files(&input.scene.files);
        same.map_err(|e| Failure::Input(format!("{} cannot be resumed: {e}", resumed.name)))?;
        // Pictures say what they were rendered from.
        input.name = origin.name.clone();
    }
    if args.time.is_some_and(|limit| input.load_time > limit) {
        let taken = units::time(input.load_time);
        messages.note(format_args!(
            "loading took {taken}; --time counts from now on"
        ));
    }
    args.picture.apply(&mut input.scene)?;
    let shard = args.keep.shard.is_some()
        || resumed.is_some_and(|resumed| resumed.settings.shard.is_some());
    let files = match shard {
        true => Vec::new(),
        false => files(args, &input, messages)?,
    };
    if let Some(file) = files.iter().find(|file| all.taken.contains(file)) {
        return Err(Failure::Input(format!(
            "{}: {} has just been written for another scene; render this one by itself, with -o",
            input.name,
            file.display()
        )));
    }
    all.taken.extend_from_slice(&files);
    let scene = &input.scene;
    let pixels = scene.film.crop_pixels();
    let settings = match resumed {
        Some(resumed) => resumed.settings(args, pixels)?,
        None => {
            let mut settings = Settings::of(scene);
            args.apply(&mut settings, pixels);
            args.check_effort(settings.integrator)?;
            settings
        }
    };
    for flag in args.idle(settings.integrator) {
        messages.warning(format_args!("{flag} means nothing to this integrator"));
    }
    integrate::check(&settings).map_err(|e| Failure::Input(e.to_string()))?;
    let beside = strategies::files(&files, &settings);
    outputs::check_pictures(&beside)?;
    let kept = &args.keep.checkpoint;
    let written = (files.iter().chain(&beside).chain(kept)).map(PathBuf::as_path);
    let read = scene.files.iter().map(PathBuf::as_path);
    outputs::check_distinct(written.chain(args.stats.as_deref()), read)?;
    // What comes from other processes has the form of a checkpoint.
    let packed = kept.is_some() || !ranks.team().is_alone();
    memory.check(scene, &settings, packed)?;
    let layers = 1 + u64::from(args.errors.error_layers) + u64::from(args.errors.despeckle);
    let pictures = 1 + strategies::pictures(&settings);
    outputs::check_room(&files, pictures * pixels, layers)?;
    let from = resumed.map(|resumed| resumed.checkpoint);
    let keeping = Keeping::of(args, &input, &settings, from)?;

    if args.errors.error_layers && !files.iter().any(|f| output::is_exr(f)) {
        messages.warning("--error-layers means nothing without an .exr file");
    }
    let made = from.map(|from| from.state.made).unwrap_or_default();
    let progress = Progress::new(signals, messages, &settings, made);
    ranks.begin(|| keeping::plan(args, &input, &settings, from))?;
    let team = ranks.team();
    let states = resumed.map_or(&[][..], |resumed| &resumed.shards);
    let start = |observer: &dyn Observer| match states {
        [] if team.is_alone() => integrate::render(scene, &settings, observer),
        [state] if team.is_alone() => integrate::resume(scene, &settings, state, observer),
        [] | [_] => {
            let state = states.first().copied();
            let render = integrate::together(scene, &settings, state, observer, team)?;
            render.ok_or(RenderError::Settings("it leads no others".into()))
        }
        shards => integrate::merge(scene, &settings, shards, observer),
    };
    let outputs = Files {
        paths: &files,
        display: args.display.display(),
        attributes: of_settings(&input.name, &settings, scene.film.chromaticities),
        errors: args.errors.error_layers,
    };
    let watch = Watch {
        files: &outputs,
        every: args.output_every,
        previews: &all.previews,
        keeping: keeping.as_ref(),
        progress: &progress,
        messages,
    };
    all.previews.begin(&About {
        scene: &input.name,
        settings: &settings,
        display: args.display.display(),
        warnings: &scene.warnings,
    });
    let result = watch.render(start);
    progress.finish();
    let (mut render, end) = result.map_err(|e| match (&e, resumed) {
        (RenderError::State(_), Some(resumed)) => Failure::Input(format!("{}: {e}", resumed.name)),
        (RenderError::Settings(_) | RenderError::State(_), _) => Failure::Input(e.to_string()),
        (RenderError::Threads { .. }, _) => Failure::Io(e.to_string()),
    })?;
    let kept = keep_end(keeping.as_ref(), end, &render, messages);
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
    if settings.shard.is_some() {
        // Figures and warnings are of a part that is no picture.
        return Ok(match kept {
            true => signals.exit_code().unwrap_or(ExitCode::SUCCESS),
            false => ExitCode::from(1),
        });
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
    let whole = kept & write_files(args, &outputs, render, messages);
    let last = verdict.as_deref().unwrap_or(&summary);
    all.previews.ended(&match whole {
        true => format!("The render has ended, and all is written: {last}"),
        false => {
            format!("The render has ended, and not all could be written where it should be: {last}")
        }
    });
    messages.say(summary);
    if let Some(verdict) = verdict {
        messages.say(verdict);
    }
    if !whole {
        return Ok(ExitCode::from(1));
    }
    Ok(signals.exit_code().unwrap_or(ExitCode::SUCCESS))
}

/// Writes the last checkpoint of a render that is kept; false if it is not where it should be.
fn keep_end(
    keeping: Option<&Keeping>,
    end: Option<State>,
    render: &Render,
    messages: Messages,
) -> bool {
    let Some(keeping) = keeping else {
        return true;
    };
    let name = keeping.path().display();
    let Some(state) = end else {
        messages.warning(format_args!(
            "{name}: no checkpoint is written: the render was stopped before there was anything to keep"
        ));
        return true;
    };
    match keeping.write(state, render.stats.relative_error) {
        Ok(()) => {
            messages.say(format_args!("kept in {name}"));
            true
        }
        Err(message) => {
            messages.error(format_args!("--checkpoint: {message}"));
            false
        }
    }
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
fn write_files(args: &RenderArgs, files: &Files, mut render: Render, messages: Messages) -> bool {
    let raw = speckles::treat(&args.errors, &mut render, messages);
    let pixels = std::mem::take(&mut render.pixels);
    let picture = Picture {
        pixels,
        ..render.picture()
    };
    let mut attributes = files.attributes.clone();
    attributes.extend(of_figures(&render.stats));
    let errors = (render
        .deviation
        .as_ref()
        .filter(|_| args.errors.error_layers))
    .map(|deviation| integrate::standard_errors(deviation, render.width as usize));
    if args.errors.error_layers && errors.is_none() {
        messages.warning("one sample per pixel has no standard error: no error layers are written");
    }
    let layers: Vec<(&str, &[[f32; 3]])> = [("error", &errors), ("raw", &raw)]
        .into_iter()
        .filter_map(|(name, pixels)| Some((name, pixels.as_deref()?)))
        .collect();
    let write =
        |path: &Path| output::write_layers(path, &picture, &layers, &attributes, &files.display);
    let mut whole = strategies::write(
        files.paths,
        &picture,
        &render.strategies,
        &files.display,
        messages,
    );
    for path in files.paths {
        match outputs::save_picture(path, write) {
            Ok(()) => messages.say(format_args!("wrote {}", path.display())),
            Err(message) => {
                messages.error(message);
                whole = false;
            }
        }
    }
    if let Some(found) = render
        .stats
        .speckles
        .as_ref()
        .filter(|found| found.replaced)
    {
        let kept = files.paths.iter().filter(|file| output::is_exr(file));
        let kept: Vec<String> = kept.map(|file| file.display().to_string()).collect();
        let said = speckles::replaced(found, picture.pixels.len(), &kept);
        messages.always(said);
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
}
