//! Checkpoints of a render: taken between rounds of its work, written in the background.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::args::RenderArgs;
use super::failure::Failure;
use super::input::{Input, is_stdin};
use super::messages::Messages;
use super::outputs;
use crate::checkpoint::Origin;
use crate::integrate::{Checkpoint, Observer, Phase, Settings, SoFar, State, Wanted};
use crate::scene::IntegratorKind;

/// Where a render is kept, and all of a checkpoint but the state.
pub struct Keeping {
    path: PathBuf,
    every: Duration,
    origin: Origin,
    resolution: Option<[u32; 2]>,
    crop: Option<[f32; 4]>,
    settings: Settings,
    /// A checkpoint is being written.
    busy: AtomicBool,
}

fn failure(what: &str) -> Failure {
    Failure::Input(format!("--checkpoint: {what}"))
}

/// What can be said before a scene is read.
///
/// # Errors
/// Its render cannot be kept, or not there.
pub fn check(args: &RenderArgs, scene: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = &args.keep.checkpoint else {
        return Ok(());
    };
    if scene.is_some_and(is_stdin) {
        return Err(failure(
            "a scene from standard input cannot be read again; render it from a file",
        ));
    }
    outputs::check_text(path)?;
    if crate::files::is_special(path) {
        return Err(failure(
            "a checkpoint is kept in a file, not in a pipe or a device",
        ));
    }
    Ok(())
}

/// A render that begins, as other processes are told of it.
///
/// # Errors
/// A file of the scene cannot be read again.
pub fn plan(
    args: &RenderArgs,
    input: &Input,
    settings: &Settings,
    from: Option<&Checkpoint>,
) -> Result<Checkpoint, Failure> {
    Ok(Checkpoint {
        origin: origin(input, from)?,
        resolution: args.picture.resolution.map(|(w, h)| [w, h]),
        crop: args.picture.crop,
        settings: settings.clone(),
        error: None,
        state: State::default(),
    })
}

fn origin(input: &Input, from: Option<&Checkpoint>) -> Result<Origin, Failure> {
    match from {
        Some(from) => Ok(from.origin.clone()),
        None => Origin::new(input.path.as_deref(), &input.name, &input.scene.files)
            .map_err(|e| Failure::Input(e.to_string())),
    }
}

impl Keeping {
    /// What the flags ask for, once [`check`] has passed them. `from` is what the render is resumed
    /// from.
    ///
    /// # Errors
    /// The render cannot be kept, or not there.
    pub fn of(
        args: &RenderArgs,
        input: &Input,
        settings: &Settings,
        from: Option<&Checkpoint>,
    ) -> Result<Option<Self>, Failure> {
        let Some(path) = args.keep.checkpoint.clone() else {
            return Ok(None);
        };
        if settings.strategies && settings.integrator == IntegratorKind::Bdpt {
            return Err(failure(
                "pictures of strategies (--strategies) are not kept; leave out one of them",
            ));
        }
        let origin = origin(input, from)?;
        let mut settings = settings.clone();
        // From the beginning on.
        let spent = from.map_or(0.0, |from| from.state.made.seconds);
        let spent = Duration::try_from_secs_f64(spent).unwrap_or_default();
        settings.time = settings.time.map(|time| time.saturating_add(spent));
        Ok(Some(Self {
            path,
            every: args.keep.every,
            origin,
            resolution: args.picture.resolution.map(|(w, h)| [w, h]),
            crop: args.picture.crop,
            settings,
            busy: AtomicBool::new(false),
        }))
    }

    /// Writes a checkpoint.
    ///
    /// # Errors
    /// It could not be written: the one before is still there.
    pub fn write(&self, state: State, error: Option<f64>) -> Result<(), String> {
        let checkpoint = Checkpoint {
            origin: self.origin.clone(),
            resolution: self.resolution,
            crop: self.crop,
            settings: self.settings.clone(),
            error,
            state,
        };
        let written = checkpoint.write(&self.path);
        written.map_err(|e| format!("{}: {e}", self.path.display()))
    }

    pub fn path(&self) -> &PathBuf {
        &self.path
    }
}

/// Shows a render to another observer, and takes its state every so often.
pub struct Keeper<'a> {
    shown: &'a dyn Observer,
    keeping: &'a Keeping,
    notes: Mutex<Notes>,
    states: SyncSender<(State, Option<f64>)>,
}

struct Notes {
    /// When the last state was asked for.
    last: Instant,
    /// The picture's latest error.
    error: Option<f64>,
    /// The last state of the render.
    end: Option<State>,
}

impl<'a> Keeper<'a> {
    /// And where states and errors come out.
    pub fn new(
        shown: &'a dyn Observer,
        keeping: &'a Keeping,
    ) -> (Self, Receiver<(State, Option<f64>)>) {
        let (states, out) = sync_channel(1);
        let notes = Notes {
            last: Instant::now(),
            error: None,
            end: None,
        };
        let keeper = Self {
            shown,
            keeping,
            notes: Mutex::new(notes),
            states,
        };
        (keeper, out)
    }

    /// The last state of a render that has ended; none if it was too short to be gone on with.
    pub fn end(self) -> Option<State> {
        let notes = self.notes.into_inner();
        notes.unwrap_or_else(PoisonError::into_inner).end
    }

    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Keeper<'_> {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        self.shown.progress(phase, done, total);
    }

    fn error(&self, relative: f64) {
        self.notes().error = Some(relative);
        self.shown.error(relative);
    }

    fn warning(&self, text: &str) {
        self.shown.warning(text);
    }

    fn stop(&self) -> bool {
        self.shown.stop()
    }

    fn wants_picture(&self, last: bool) -> Wanted {
        self.shown.wants_picture(last)
    }

    fn picture(&self, so_far: SoFar) {
        self.shown.picture(so_far);
    }

    fn wants_state(&self, last: bool) -> bool {
        // One at a time is in memory: a disk that is too slow gets fewer.
        let due = self.notes().last.elapsed() >= self.keeping.every;
        last || (due && !self.keeping.busy.load(Relaxed))
    }

    fn state(&self, state: State, last: bool) {
        let mut notes = self.notes();
        match last {
            true => notes.end = Some(state),
            false => {
                notes.last = Instant::now();
                self.keeping.busy.store(true, Relaxed);
                let _ = self.states.try_send((state, notes.error));
            }
        }
    }
}

/// Writes states until there are no more. What fails is said once: the next may succeed.
pub fn write_all(states: Receiver<(State, Option<f64>)>, keeping: &Keeping, messages: Messages) {
    let mut failed = false;
    for (state, error) in states {
        let written = keeping.write(state, error);
        keeping.busy.store(false, Relaxed);
        if let (Err(message), false) = (&written, failed) {
            messages.warning(format_args!("--checkpoint: {message}; the render goes on"));
        }
        failed = written.is_err();
    }
}
