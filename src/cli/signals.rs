//! SIGINT (Ctrl-C) and SIGTERM: while there is something to lose, the first asks for the picture so far and the second ends the process
//! at once; before that the first does.

use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Which signal has come, if any.
#[derive(Clone, Debug, Default)]
pub struct Signals {
    /// Number of the last signal; 0 is none.
    received: Arc<AtomicUsize>,
    /// The next signal ends the process.
    deadly: Arc<AtomicBool>,
}

impl Signals {
    /// Installs the handlers. Until [`Self::hold`] the first signal ends the process.
    pub fn install() -> io::Result<Self> {
        let signals = Self::default();
        signals.deadly.store(true, Ordering::Relaxed);
        for signal in [SIGINT, SIGTERM] {
            // Handlers of one signal run in this order: the first time after `hold`, `deadly` is still false when it is asked for.
            let status = i32::from(status(signal as usize));
            flag::register_conditional_shutdown(signal, status, Arc::clone(&signals.deadly))?;
            flag::register(signal, Arc::clone(&signals.deadly))?;
            flag::register_usize(signal, Arc::clone(&signals.received), signal as usize)?;
        }
        Ok(signals)
    }

    /// From now on there is something to lose: the next signal is remembered, and only one after it ends the process.
    pub fn hold(&self) {
        self.deadly.store(false, Ordering::Relaxed);
    }

    pub fn any(&self) -> bool {
        self.received.load(Ordering::Relaxed) != 0
    }

    /// The exit code shells give a process ended by this signal.
    pub fn exit_code(&self) -> Option<ExitCode> {
        match self.received.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(ExitCode::from(status(signal))),
        }
    }
}

/// 128 plus the number of the signal: 130 for SIGINT, 143 for SIGTERM.
fn status(signal: usize) -> u8 {
    128 + signal as u8
}
