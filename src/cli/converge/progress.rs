//! How a study goes: a bar where stderr is a terminal, a line every so often elsewhere.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use crate::cli::messages::Messages;
use crate::cli::progress::bar;
use crate::cli::signals::Signals;
use crate::cli::units;
use crate::converge::subject::Run;
use crate::converge::watch::{StudyStep, Watch};

pub struct Progress<'a> {
    signals: &'a Signals,
    messages: Messages,
    /// Of the scenes.
    names: Vec<String>,
    /// Of each scene's variants.
    variants: Vec<Vec<String>>,
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

struct State {
    /// In the budgets' unit, whatever that is.
    total: f64,
    done: f64,
    /// What `done` took.
    worked: Duration,
    /// When the step under way began.
    began: Instant,
    step: String,
    last_line: Instant,
}

/// Steps of the bar.
const STEPS: f64 = 1000.0;
const LINE_INTERVAL: Duration = Duration::from_secs(5);

impl<'a> Progress<'a> {
    pub fn new(
        signals: &'a Signals,
        messages: Messages,
        names: Vec<String>,
        variants: Vec<Vec<String>>,
    ) -> Self {
        let bar = bar(STEPS as u64, "[{bar:30}] {percent:>3} %  {msg}", messages);
        let now = Instant::now();
        Self {
            signals,
            messages,
            names,
            variants,
            bar,
            state: Mutex::new(State {
                total: 0.0,
                done: 0.0,
                worked: Duration::ZERO,
                began: now,
                step: String::new(),
                last_line: now,
            }),
        }
    }

    /// Clears the bar, so that what is printed next stands alone.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn name(&self, step: StudyStep) -> String {
        let scene = |i: usize| self.names.get(i).map_or("", String::as_str);
        let variant = |scene: usize, i: usize| {
            let names = self.variants.get(scene);
            names.and_then(|n| n.get(i)).map_or("", String::as_str)
        };
        match step {
            StudyStep::Trial {
                scene: s,
                variant: v,
            } => {
                format!("{}: trial of {}", scene(s), variant(s, v))
            }
            StudyStep::Reference { scene: s, part } => {
                format!("{}: reference, part {}", scene(s), part + 1)
            }
            StudyStep::Run(turn) => format!(
                "{}: {}, budget {}, seed {}",
                scene(turn.scene),
                variant(turn.scene, turn.variant),
                turn.budget + 1,
                turn.round + 1
            ),
        }
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, State> {
        // Nothing between lock and release panics; a poisoned state is as good as any.
        self.state.lock().unwrap_or_else(|p| p.into_inner())
    }
}

impl Watch for Progress<'_> {
    fn total(&self, amount: f64) {
        self.locked().total = amount;
    }

    fn begins(&self, step: StudyStep) {
        let mut state = self.locked();
        state.began = Instant::now();
        state.step = self.name(step);
        if let Some(bar) = &self.bar {
            bar.set_message(state.step.clone());
        }
    }

    fn ended(&self, amount: f64, _: Option<&Run>) {
        if self.messages.quiet || self.signals.any() {
            return;
        }
        let mut state = self.locked();
        let now = Instant::now();
        state.done += amount;
        let taken = now.duration_since(state.began);
        state.worked += taken;
        let part = (state.done / state.total.max(1e-300)).clamp(1e-9, 1.0);
        let left = state.worked.as_secs_f64() * (1.0 / part - 1.0);
        let left = units::time(Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX));
        if let Some(bar) = &self.bar {
            bar.set_position((part * STEPS) as u64);
            bar.set_message(format!("{}, {left} left", state.step));
        } else if now - state.last_line >= LINE_INTERVAL {
            let percent = (100.0 * part) as u32;
            let step = &state.step;
            self.messages
                .say(format_args!("{percent:>3} %: {step}; {left} left"));
            state.last_line = now;
        }
    }

    fn stop(&self) -> bool {
        self.signals.any()
    }
}
