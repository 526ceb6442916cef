//! SIGINT (Ctrl-C), SIGTERM and SIGHUP (a closed terminal): while there is something to lose, the
//! first asks for the picture so far and the second ends the process at once; before that the first
//! does. SIGUSR1 is one of them for processes that MPI has started. And SIGXFSZ, which is only
//! worth an error where it comes from.

use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

#[cfg(unix)]
use super::ranks::launched;

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
        let watched = watched();
        signals.end_at_the_second(&watched)?;
        for signal in watched {
            flag::register_usize(signal, Arc::clone(&signals.received), signal as usize)?;
        }
        Ok(signals)
    }

    /// From now on there is nothing to lose: the next signal ends the process at once.
    pub fn release(&self) {
        self.deadly.store(true, Ordering::Relaxed);
    }

    /// A thread ends the process, not a handler: temporary files must go first.
    #[cfg(unix)]
    fn end_at_the_second(&self, watched: &[i32]) -> io::Result<()> {
        let mut coming = signal_hook::iterator::Signals::new(watched)?;
        let deadly = Arc::clone(&self.deadly);
        let watch = move || {
            for signal in coming.forever() {
                if deadly.swap(true, Ordering::Relaxed) {
                    crate::files::abandon();
                    signal_hook::low_level::exit(status(signal as usize).into());
                }
            }
        };
        let thread = std::thread::Builder::new().name("signals".into());
        thread.spawn(watch).map(drop)
    }

    #[cfg(not(unix))]
    fn end_at_the_second(&self, watched: &[i32]) -> io::Result<()> {
        for &signal in watched {
            // Handlers of one signal run in this order: the first time after `hold`, `deadly` is
            // still false when it is asked for.
            let status = i32::from(status(signal as usize));
            flag::register_conditional_shutdown(signal, status, Arc::clone(&self.deadly))?;
            flag::register(signal, Arc::clone(&self.deadly))?;
        }
        Ok(())
    }

    /// From now on there is something to lose: the next signal is remembered, and only one after it
    /// ends the process.
    pub fn hold(&self) {
        self.deadly.store(false, Ordering::Relaxed);
    }

    /// As if Ctrl-C had been pressed: a signal after it ends the process at once.
    pub fn ask(&self) {
        self.received.store(SIGINT as usize, Ordering::Relaxed);
        self.deadly.store(true, Ordering::Relaxed);
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

/// What is written to a file beyond the limit on the size of files becomes an error of that write;
/// left alone, the signal ends the process.
pub fn survive_file_limits() {
    // Where this fails, all is as it was.
    #[cfg(unix)]
    let _ = flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// The signals that end a render.
fn watched() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    {
        if !hangup_is_ignored() {
            signals.push(signal_hook::consts::SIGHUP);
        }
        // `mpirun` passes it on and leaves it at that, where SIGTERM is followed by SIGKILL.
        if launched().is_some() {
            signals.push(signal_hook::consts::SIGUSR1);
        }
    }
    signals
}

/// Whether the process was started not to mind that its terminal is closed, as by `nohup`. Only
/// Linux says so.
#[cfg(unix)]
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal_hook::consts::SIGHUP - 1) & 1 == 1)
}

/// 128 plus the number of the signal: 129 for SIGHUP, 130 for SIGINT, 138 for SIGUSR1, 143 for
/// SIGTERM.
fn status(signal: usize) -> u8 {
    128 + signal as u8
}
