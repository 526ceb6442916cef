//! Whoever watches a study: is told how it goes, and can end it.

use super::plan::Turn;
use super::subject::Run;
use crate::integrate::{EndedBy, Observer, Render, RenderError, Settings, render};
use crate::scene::Scene;

/// What happens next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StudyStep {
    /// What does a variant cost?
    Trial {
        scene: usize,
        variant: usize,
    },
    Reference {
        scene: usize,
        part: u64,
    },
    Run(Turn),
}

/// Told how a study goes, and asked whether to go on.
pub trait Watch: Sync {
    /// All that is to be done, in the budgets' unit, without trial runs.
    fn total(&self, amount: f64) {
        let _ = amount;
    }
    fn begins(&self, step: StudyStep) {
        let _ = step;
    }
    /// So much of the total has been done.
    fn ended(&self, amount: f64, run: Option<&Run>) {
        let _ = (amount, run);
    }
    /// True ends the study: the run under way is dropped, the others are reported.
    fn stop(&self) -> bool {
        false
    }
}

struct Stop<'a>(&'a dyn Watch);

impl Observer for Stop<'_> {
    fn stop(&self) -> bool {
        self.0.stop()
    }
}

/// Renders; `None` if the user stopped it.
pub(super) fn whole(
    scene: &Scene,
    settings: &Settings,
    watch: &dyn Watch,
) -> Result<Option<Render>, RenderError> {
    if watch.stop() {
        return Ok(None);
    }
    let done = render(scene, settings, &Stop(watch))?;
    Ok((done.ended_by == EndedBy::Effort).then_some(done))
}
