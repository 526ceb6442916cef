//! How a render goes: a bar where stderr is a terminal, a line every ten per cent elsewhere.

use std::io::IsTerminal;
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::messages::{Messages, dumb_terminal};
use super::signals::Signals;
use super::units;
use crate::brief::brief;
use crate::integrate::{Made, Observer, Phase, Settings};
use crate::memory::Bytes;
use crate::pbrt::Loading;
use crate::scene::IntegratorKind;

/// Shows progress, and ends the render when a signal has come.
pub struct Progress<'a> {
    signals: &'a Signals,
    messages: Messages,
    /// What the render counts.
    unit: &'static str,
    /// End the render however much is done.
    limit: Option<Duration>,
    target: Option<f64>,
    start: Instant,
    /// What an earlier process has done of the render.
    begun: u64,
    /// Seconds that it has taken for that.
    spent: f64,
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

/// What is shown of a render.
#[derive(Clone, Debug)]
pub struct Told {
    pub phase: &'static str,
    /// Of the phase, 0 to 1.
    pub part: f64,
    /// How fast it goes, how good the picture is, and what is left.
    pub text: String,
}

struct State {
    told: Told,
    phase: Phase,
    /// When the phase began.
    since: Instant,
    last_call: Instant,
    last_line: Instant,
    /// Tenths of the phase that a line has been printed for.
    tenths: u32,
    /// The picture's latest estimated relative error.
    error: Option<Estimate>,
    /// Of the phase.
    done: u64,
}

/// An estimate of the error, and the part of the work that was done then.
#[derive(Clone, Copy)]
struct Estimate {
    error: f64,
    done: u64,
}

impl Estimate {
    /// The error after more of the same: it falls with the root of the work.
    fn after(&self, done: u64) -> f64 {
        self.error * (self.done as f64 / done.max(1) as f64).min(1.0).sqrt()
    }
}

/// Steps of the bar.
const STEPS: u64 = 1000;
/// Primitives whose tree takes as long to build as a line takes to read.
const MANY: u64 = 1_000_000;
/// Short renders need no lines, and long ones none more often.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// A bar of so many steps, where stderr is a terminal that can show one.
pub(super) fn bar(steps: u64, template: &str, messages: Messages) -> Option<ProgressBar> {
    let terminal = std::io::stderr().is_terminal() && !dumb_terminal();
    (terminal && !messages.quiet).then(|| {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
        bar.set_style(style(template));
        bar
    })
}

/// Where a phase knows no end: a sign of life in place of a bar.
const SPINNER: &str = "{prefix:9} {spinner} {msg}, {elapsed}";
const TICK: Duration = Duration::from_millis(100);

/// Does `work`, and shows how the scene comes in meanwhile: on a terminal all the time, elsewhere
/// in a line after one second, after two, after four ...
pub(super) fn while_loading<T>(
    loading: &Loading,
    messages: Messages,
    work: impl FnOnce() -> T,
) -> T {
    if messages.quiet {
        return work();
    }
    let start = Instant::now();
    let so_far = || {
        let file = (loading.file()).map_or(String::new(), |f| brief(&format!(", reading {f}")));
        let primitives = units::si(loading.primitives() as f64);
        format!("{primitives} primitives, {}{file}", Bytes(loading.bytes()))
    };
    let (done, end) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            let bar = bar(0, SPINNER, messages);
            let mut next = Duration::from_secs(1);
            // An end of another kind is that `work` is done, or has panicked.
            while end.recv_timeout(TICK) == Err(mpsc::RecvTimeoutError::Timeout) {
                let taken = start.elapsed();
                if let Some(bar) = &bar {
                    bar.set_prefix("load");
                    bar.set_message(so_far());
                    bar.tick();
                } else if taken >= next {
                    messages.say(format_args!("load: {} in {}", so_far(), units::time(taken)));
                    next *= 2;
                }
            }
            if let Some(bar) = bar {
                bar.finish_and_clear();
            }
        });
        let result = work();
        drop(done);
        result
    })
}

/// The bar of a render.
const BAR: &str = "{prefix:9} [{bar:30}] {percent:>3} %  {msg}";

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl<'a> Progress<'a> {
    /// Of a render of which an earlier process has `made` a part.
    pub fn new(signals: &'a Signals, messages: Messages, settings: &Settings, made: Made) -> Self {
        let bar = bar(STEPS, BAR, messages);
        let now = Instant::now();
        Self {
            signals,
            messages,
            unit: match settings.integrator {
                // Whichever it is that counts.
                IntegratorKind::Auto => "paths",
                kind if kind.mutates() => "mutations",
                _ => "samples",
            },
            limit: settings.time,
            target: settings.target_error,
            start: now,
            begun: match made.mutations {
                0 => made.samples,
                mutations => mutations,
            },
            bar,
            spent: made.seconds,
            state: Mutex::new(State {
                told: Told {
                    phase: "build",
                    part: 0.0,
                    text: String::new(),
                },
                phase: Phase::Build,
                since: now,
                last_call: now,
                last_line: now,
                tenths: 0,
                error: None,
                done: 0,
            }),
        }
    }

    /// What is shown now.
    pub fn told(&self) -> Told {
        self.lock().told.clone()
    }

    /// Since the render began, without what was between stops.
    pub fn seconds(&self) -> f64 {
        self.spent + self.start.elapsed().as_secs_f64()
    }

    /// Nothing between lock and release panics; a poisoned state is as good as any.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Clears the bar, so that what is printed next stands alone.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// The tree is being built, or has been. How far it has come is not known.
    fn build(&self, done: u64, total: u64) {
        let what = format!("tree over {} primitives", units::si(total as f64));
        match &self.bar {
            Some(bar) if done < total => {
                bar.set_style(style(SPINNER));
                bar.set_prefix("build");
                bar.set_message(what);
                bar.enable_steady_tick(TICK);
            }
            Some(bar) => {
                bar.disable_steady_tick();
                bar.set_style(style(BAR));
                bar.set_message("");
            }
            None if done < total && total >= MANY => {
                self.messages.say(format_args!("build: {what}"))
            }
            None => {}
        }
    }

    /// Done part of the phase, and the time left. `error` is the picture's present one.
    fn forecast(
        &self,
        phase: Phase,
        done: u64,
        total: u64,
        taken: Duration,
        error: Option<f64>,
    ) -> (f64, Duration) {
        let part = |done: f64, total: f64| {
            if total > 0.0 {
                (done / total).clamp(0.0, 1.0)
            } else {
                1.0
            }
        };
        let by_count = part(done as f64, total as f64);
        // The square of the error falls with the work. A render that is accurate enough, and goes
        // on, waits for its chains to mix.
        let by_error = match (self.target, error) {
            (Some(target), Some(error)) if phase == Phase::Render => {
                part(target * target, error * error).min(0.99)
            }
            _ => 0.0,
        };
        let by_count = by_count.max(by_error);
        let left = taken.as_secs_f64() * (1.0 / by_count.max(1e-9) - 1.0);
        let left = Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX);
        match self.limit.filter(|_| phase == Phase::Render) {
            Some(limit) => {
                let elapsed = self.start.elapsed();
                let by_time = part(elapsed.as_secs_f64(), limit.as_secs_f64());
                (
                    by_count.max(by_time),
                    left.min(limit.saturating_sub(elapsed)),
                )
            }
            None => (by_count, left),
        }
    }
}

impl Observer for Progress<'_> {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        if phase == Phase::Build && done == total {
            self.signals.hold();
        }
        if self.signals.any() {
            return;
        }
        let mut state = self.lock();
        let now = Instant::now();
        if phase != state.phase {
            state.phase = phase;
            // This call comes after the phase's first round of work; the phase began where the one
            // before it ended.
            state.since = state.last_call;
            state.tenths = 0;
        }
        state.last_call = now;
        state.done = done;
        let taken = now.duration_since(state.since);
        let error = state.error.map(|e| e.after(done));
        let here = match phase {
            Phase::Render => done.saturating_sub(self.begun).max(1),
            _ => done,
        };
        // What all of it would have taken here.
        let whole = taken.mul_f64(done as f64 / here.max(1) as f64);
        let (part, left) = self.forecast(phase, done, total, whole, error);
        let (name, unit) = match phase {
            Phase::Build => {
                self.build(done, total);
                state.told.part = f64::from(u8::from(done >= total));
                return;
            }
            Phase::Bootstrap => ("bootstrap", "paths"),
            Phase::Render => ("render", self.unit),
        };
        let rate = units::si(here as f64 / taken.as_secs_f64().max(1e-9));
        // Nothing is known of a target's distance before the first look at the error.
        let left = if self.target.is_some() && error.is_none() && self.limit.is_none() {
            String::new()
        } else {
            format!(", {} left", units::time(left))
        };
        let error = match error.filter(|_| phase == Phase::Render) {
            Some(error) => format!(", error {}", units::percent(error)),
            None => String::new(),
        };
        let text = format!("{rate} {unit}/s{error}{left}");
        if let Some(bar) = &self.bar {
            bar.set_prefix(name);
            bar.set_position((part * STEPS as f64) as u64);
            bar.set_message(text.clone());
        }
        state.told = Told {
            phase: name,
            part,
            text,
        };
        if self.bar.is_some() {
            return;
        }
        let tenths = (part * 10.0) as u32;
        if tenths > state.tenths && tenths < 10 && now - state.last_line >= LINE_INTERVAL {
            state.tenths = tenths;
            let text = &state.told.text;
            let said = format!("{name} {:>3} %: {text}", tenths * 10);
            self.messages.say(said);
            state.last_line = now;
        }
    }

    fn error(&self, relative: f64) {
        let mut state = self.lock();
        state.error = Some(Estimate {
            error: relative,
            done: state.done,
        });
    }

    fn warning(&self, text: &str) {
        match &self.bar {
            // Lines between drawings of a bar have to make room for it.
            Some(bar) => bar.suspend(|| self.messages.warning(text)),
            None => self.messages.warning(text),
        }
    }

    fn stop(&self) -> bool {
        self.signals.any()
    }
}
