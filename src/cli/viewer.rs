//! Who is shown a render while it goes on.

use std::sync::{Arc, Mutex, PoisonError};

use super::progress::{Progress, Told};
use crate::integrate::{Observer, Phase, SoFar, Wanted};

/// Someone who looks at the picture while it is rendered. Nothing here may wait for anybody.
pub trait Viewer: Sync {
    /// What it wants of the picture so far, or of the `last` one.
    fn wants(&self, last: bool) -> Wanted;
    /// The picture, if it wanted one.
    fn show(&self, so_far: &Arc<SoFar>);
    /// How the render goes.
    fn told(&self, told: &Told) {
        let _ = told;
    }
    /// The picture's estimated relative error, after so many seconds of the render.
    fn error(&self, seconds: f64, relative: f64) {
        let _ = (seconds, relative);
    }
}

/// Shows a render to whoever looks at it.
pub struct Watched<'a> {
    pub progress: &'a Progress<'a>,
    viewers: Vec<&'a dyn Viewer>,
    /// What each of them has just asked for.
    asked: Mutex<Vec<Wanted>>,
}

impl<'a> Watched<'a> {
    pub fn new(progress: &'a Progress<'a>, viewers: Vec<&'a dyn Viewer>) -> Self {
        Self {
            progress,
            viewers,
            asked: Mutex::default(),
        }
    }
}

impl Observer for Watched<'_> {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        self.progress.progress(phase, done, total);
        let told = self.progress.told();
        self.viewers.iter().for_each(|viewer| viewer.told(&told));
    }

    fn error(&self, relative: f64) {
        self.progress.error(relative);
        let seconds = self.progress.seconds();
        (self.viewers.iter()).for_each(|viewer| viewer.error(seconds, relative));
    }

    fn stop(&self) -> bool {
        self.progress.stop()
    }

    fn wants_picture(&self, last: bool) -> Wanted {
        let asked: Vec<Wanted> = self.viewers.iter().map(|v| v.wants(last)).collect();
        let most = asked.iter().copied().max().unwrap_or(Wanted::Nothing);
        *self.asked.lock().unwrap_or_else(PoisonError::into_inner) = asked;
        most
    }

    fn picture(&self, so_far: SoFar) {
        let so_far = Arc::new(so_far);
        let asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        for (viewer, asked) in self.viewers.iter().zip(asked.iter()) {
            if *asked > Wanted::Nothing {
                viewer.show(&so_far);
            }
        }
        if let Some(error) = so_far.relative_error {
            let seconds = self.progress.seconds();
            (self.viewers.iter()).for_each(|viewer| viewer.error(seconds, error));
        }
    }
}
