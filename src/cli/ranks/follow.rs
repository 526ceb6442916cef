//! What all processes but the first do: as they are told, without a word.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use super::super::failure::Failure;
use super::super::input::{self, Input};
use super::super::memory::MemoryLimit;
use super::super::messages::Messages;
use super::super::signals::Signals;
use super::task::{Task, picture};
use crate::integrate::{self, Checkpoint, Observer, Phase, Team};

/// Goes along with the first process until it leaves.
pub fn follow(
    team: &dyn Team,
    memory: &MemoryLimit,
    messages: Messages,
) -> Result<ExitCode, Failure> {
    let signals = Signals::install()
        .map_err(|e| Failure::Io(format!("signal handlers cannot be installed: {e}")))?;
    let mut loaded = None;
    loop {
        let task = Task::from_bytes(team.tell(Vec::new()));
        match task.map_err(|e| Failure::Input(e.to_string()))? {
            Task::Load(origin) => {
                loaded = Some(input::load(
                    origin.path.as_deref(),
                    memory,
                    Messages::mute(),
                ));
            }
            Task::Render(checkpoint) => {
                let input = prepared(loaded.take(), &checkpoint);
                let problem = input.as_ref().err().cloned().unwrap_or_default();
                if !are_ready(team, problem).is_empty() {
                    continue;
                }
                let Ok(input) = input else { continue };
                let along = Along {
                    signals: &signals,
                    hold: AtomicBool::new(false),
                };
                let (scene, settings) = (&input.scene, &checkpoint.settings);
                let done = integrate::together(scene, settings, None, &along, team);
                signals.release();
                if let Err(error) = done {
                    messages.error(error);
                }
            }
            Task::Leave => return Ok(ExitCode::SUCCESS),
        }
    }
}

/// The scene as the first process has it.
fn prepared(
    loaded: Option<Result<Input, Failure>>,
    checkpoint: &Checkpoint,
) -> Result<Input, String> {
    let said = |failure: Failure| match failure {
        Failure::Input(message) | Failure::Io(message) => message,
    };
    let mut input = loaded.ok_or("no scene was loaded")?.map_err(said)?;
    let origin = &checkpoint.origin;
    let files = &input.scene.files;
    let same = origin.check_files(files).and_then(|()| origin.check());
    same.map_err(|e| format!("here it is not the scene that the first process has: {e}"))?;
    picture(checkpoint).apply(&mut input.scene).map_err(said)?;
    Ok(input)
}

/// Hears from all others what keeps them from rendering, and tells them. Empty: nothing.
pub fn are_ready(team: &dyn Team, problem: String) -> String {
    let mut problem = match problem.is_empty() {
        true => Vec::new(),
        false => format!("process {}: {problem}", team.rank()).into_bytes(),
    };
    for child in team.children() {
        let other = team.receive(child);
        if problem.is_empty() {
            problem = other;
        }
    }
    if let Some(parent) = team.parent() {
        team.send(parent, &problem);
    }
    String::from_utf8_lossy(&team.tell(problem)).into_owned()
}

/// Has a signal stop the render.
struct Along<'a> {
    signals: &'a Signals,
    hold: AtomicBool,
}

impl Observer for Along<'_> {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        if phase == Phase::Build && done == total && !self.hold.swap(true, Relaxed) {
            self.signals.hold();
        }
    }

    fn stop(&self) -> bool {
        self.signals.any()
    }
}
