//! Pictures that are written while the render goes on, so that a crash or a power cut loses little.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::messages::Messages;
use super::viewer::Viewer;
use crate::integrate::{SoFar, Wanted};

/// Asks a render for a picture every so often.
pub struct Interim {
    every: Duration,
    /// What it asks for.
    wanted: Wanted,
    /// When the last picture was asked for.
    last: Mutex<Instant>,
    pictures: SyncSender<Arc<SoFar>>,
}

impl Interim {
    /// With errors if files have them; and where the pictures come out. One that nobody has taken
    /// yet stands for later ones.
    pub fn new(every: Duration, errors: bool) -> (Self, Receiver<Arc<SoFar>>) {
        let (pictures, out) = sync_channel(1);
        let interim = Self {
            every,
            wanted: match errors {
                true => Wanted::Judged,
                false => Wanted::Picture,
            },
            last: Mutex::new(Instant::now()),
            pictures,
        };
        (interim, out)
    }
}

impl Viewer for Interim {
    /// The last one is written with all that is known of it, but not by this.
    fn wants(&self, last: bool) -> Wanted {
        let mut asked = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last || asked.elapsed() < self.every {
            return Wanted::Nothing;
        }
        *asked = Instant::now();
        self.wanted
    }

    fn show(&self, so_far: &Arc<SoFar>) {
        // A disk that is too slow gets fewer pictures.
        let _ = self.pictures.try_send(Arc::clone(so_far));
    }
}

/// Writes pictures until there are no more. What fails is said once: the next may succeed.
pub fn write_all(
    pictures: Receiver<Arc<SoFar>>,
    messages: Messages,
    write: impl Fn(&SoFar) -> Result<(), String>,
) {
    let mut failed = false;
    for picture in pictures {
        let written = write(&picture);
        if let (Err(message), false) = (&written, failed) {
            messages.warning(format_args!(
                "--output-every: {message}; the render goes on"
            ));
        }
        failed = written.is_err();
    }
}
