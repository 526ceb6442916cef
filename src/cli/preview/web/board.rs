//! What pages show: written by the render, read by the threads that answer them.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::super::about::About;
use super::super::pace::Pace;
use crate::cli::progress::Told;
use crate::cli::signals::Signals;
use crate::integrate::{SoFar, Wanted};

/// Points of the curve of errors, at most.
const POINTS: usize = 400;
/// How long a question waits for its answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// A page that has asked for something within this time is open.
const OPEN: Duration = Duration::from_secs(3);
/// How long the program waits for open pages to hear of the end.
const LAST: Duration = Duration::from_millis(800);

pub struct Board {
    signals: Signals,
    state: Mutex<State>,
    changed: Condvar,
}

/// What a page is told.
#[derive(Clone, Debug, Default, Serialize)]
struct Status {
    /// Of this status; one that is larger is later.
    version: u64,
    scene: String,
    integrator: &'static str,
    phase: &'static str,
    /// Of the phase, 0 to 1.
    part: f64,
    /// How fast it goes and what is left.
    text: String,
    /// Seconds, and the estimated relative error then.
    errors: Vec<[f64; 2]>,
    /// Errors are estimated.
    judged: bool,
    /// Relative error that ends the render.
    target: Option<f64>,
    warnings: Vec<String>,
    /// Number of the newest picture; 0 is none.
    picture: u64,
    /// Stops that the picture is brightened by; `None` is by its own brightness.
    exposure: Option<f32>,
    tonemap: &'static str,
    /// Somebody has asked for the end.
    stopping: bool,
    /// How it has ended.
    ended: Option<String>,
}

#[derive(Default)]
struct State {
    status: Status,
    /// Warnings from before the render.
    before: Vec<String>,
    picture: Option<Arc<SoFar>>,
    pace: Pace,
    /// Somebody waits for a picture that is not there yet.
    wanted: bool,
    /// When a page last asked for anything.
    seen: Option<Instant>,
    /// The newest version of a status, and number of a picture, that has been handed out.
    handed: [u64; 2],
    /// There will be nothing more.
    closed: bool,
}

impl Board {
    /// Whoever stops the render stops it by `signals`.
    pub fn new(signals: Signals) -> Self {
        let state = State {
            status: Status {
                version: 1,
                phase: "load",
                ..Status::default()
            },
            ..State::default()
        };
        Self {
            signals,
            state: Mutex::new(state),
            changed: Condvar::new(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.lock();
        change(&mut state);
        state.status.version += 1;
        self.changed.notify_all();
    }

    pub fn begin(&self, about: &About) {
        self.change(|state| {
            state.before = about.warnings.to_vec();
            state.picture = None;
            state.pace = Pace::default();
            state.status = Status {
                version: state.status.version,
                // Numbers go on: a page has those of another picture.
                picture: state.status.picture,
                scene: about.scene.into(),
                integrator: about.settings.integrator.name(),
                phase: "build",
                judged: about.settings.estimate_error,
                target: about.settings.target_error,
                warnings: about.warnings.to_vec(),
                exposure: about.display.exposure,
                tonemap: about.display.tonemap.name(),
                stopping: state.status.stopping,
                ..Status::default()
            };
        });
    }

    pub fn told(&self, told: &Told) {
        self.change(|state| {
            state.status.phase = told.phase;
            state.status.part = told.part;
            state.status.text.clone_from(&told.text);
        });
    }

    pub fn error(&self, seconds: f64, relative: f64) {
        if !relative.is_finite() {
            return;
        }
        self.change(|state| {
            let points = &mut state.status.errors;
            if points.len() >= POINTS {
                let mut index = 0;
                points.retain(|_| {
                    index += 1;
                    index % 2 == 0
                });
            }
            points.push([seconds, relative]);
        });
    }

    pub fn wants(&self, last: bool) -> Wanted {
        let mut state = self.lock();
        let open = state.seen.is_some_and(|seen| seen.elapsed() < OPEN);
        match state.wanted {
            _ if last && open => Wanted::Judged,
            true => state.pace.ask(),
            false => Wanted::Nothing,
        }
    }

    pub fn show(&self, so_far: &Arc<SoFar>) {
        self.change(|state| {
            state.pace.shown();
            state.wanted = false;
            state.picture = Some(Arc::clone(so_far));
            state.status.picture += 1;
            if let Some(warnings) = &so_far.warnings {
                let before = state.before.iter();
                state.status.warnings = before.chain(warnings).cloned().collect();
            }
        });
    }

    pub fn ended(&self, said: &str) {
        self.change(|state| {
            state.status.phase = "end";
            state.status.part = 1.0;
            state.status.text.clear();
            state.status.ended = Some(said.into());
        });
    }

    pub fn finish(&self) {
        self.change(|state| state.closed = true);
        let state = self.lock();
        if state.seen.is_none_or(|seen| seen.elapsed() > OPEN) {
            return;
        }
        let waits =
            |state: &mut State| state.handed != [state.status.version, state.status.picture];
        drop(self.changed.wait_timeout_while(state, LAST, waits));
    }

    /// The version of the status, and all of it as JSON, as soon as it is later than `after`; what
    /// there is, if it does not come.
    pub fn status(&self, after: u64) -> (u64, String) {
        let mut state = self.lock();
        state.seen = Some(Instant::now());
        let waits = |state: &mut State| state.status.version <= after && !state.closed;
        let waited = self.changed.wait_timeout_while(state, PATIENCE, waits);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner).0;
        state.seen = Some(Instant::now());
        let status = state.status.clone();
        drop(state);
        (
            status.version,
            serde_json::to_string(&status).unwrap_or_default(),
        )
    }

    /// The newest picture and its number, as soon as that is above `after`; `None` if it does not
    /// come.
    pub fn picture(&self, after: u64) -> Option<(u64, Arc<SoFar>)> {
        let mut state = self.lock();
        state.seen = Some(Instant::now());
        state.wanted |= state.status.picture <= after;
        let waits = |state: &mut State| {
            (state.status.picture <= after || state.picture.is_none()) && !state.closed
        };
        let waited = self.changed.wait_timeout_while(state, PATIENCE, waits);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner).0;
        state.seen = Some(Instant::now());
        let number = state.status.picture;
        state
            .picture
            .clone()
            .filter(|_| number > after)
            .map(|picture| (number, picture))
    }

    /// A status of this version and a picture of this number, or 0 in place of them, have got to
    /// where they were asked for.
    pub fn handed(&self, handed: [u64; 2]) {
        let mut state = self.lock();
        let all = state.handed.iter_mut().zip(handed);
        all.for_each(|(to, handed)| *to = (*to).max(handed));
        self.changed.notify_all();
    }

    /// Ends the render as Ctrl-C does.
    pub fn stop(&self) {
        self.signals.ask();
        self.change(|state| state.status.stopping = true);
    }
}
