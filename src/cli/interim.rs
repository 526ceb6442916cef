//! Pictures that are written while the render goes on, so that a crash or a power cut loses little.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::messages::Messages;
use crate::formats::Picture;
use crate::integrate::{Observer, Phase};

/// Shows a render to another observer, and asks it for a picture every so often.
pub struct Interim<'a> {
    shown: &'a dyn Observer,
    every: Duration,
    /// When the last picture was asked for.
    last: Mutex<Instant>,
    pictures: SyncSender<Picture>,
}

impl<'a> Interim<'a> {
    /// And where the pictures come out. One that nobody has taken yet stands for later ones.
    pub fn new(shown: &'a dyn Observer, every: Duration) -> (Self, Receiver<Picture>) {
        let (pictures, out) = sync_channel(1);
        let interim = Self {
            shown,
            every,
            last: Mutex::new(Instant::now()),
            pictures,
        };
        (interim, out)
    }
}

impl Observer for Interim<'_> {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        self.shown.progress(phase, done, total);
    }

    fn error(&self, relative: f64) {
        self.shown.error(relative);
    }

    fn warning(&self, text: &str) {
        self.shown.warning(text);
    }

    fn stop(&self) -> bool {
        self.shown.stop()
    }

    fn wants_picture(&self) -> bool {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let due = last.elapsed() >= self.every;
        if due {
            *last = Instant::now();
        }
        due
    }

    fn picture(&self, picture: Picture) {
        // A disk that is too slow gets fewer pictures.
        let _ = self.pictures.try_send(picture);
    }
}

/// Writes pictures until there are no more. What fails is said once: the next may succeed.
pub fn write_all(
    pictures: Receiver<Picture>,
    messages: Messages,
    write: impl Fn(&Picture) -> Result<(), String>,
) {
    let mut failed = false;
    for picture in pictures {
        let written = write(&picture);
        if let (Err(message), false) = (&written, failed) {
            messages.warning(format_args!("--output-every: {message}"));
        }
        failed = written.is_err();
    }
}
