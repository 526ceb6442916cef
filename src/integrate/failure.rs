//! Why there is no picture.

use crate::checkpoint::Malformed;

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// What is wrong with the settings.
    #[error("{0}")]
    Settings(String),
    /// A state that was to be resumed is of another render.
    #[error(transparent)]
    State(#[from] Malformed),
    /// The system gave no threads.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What it said.
        source: rayon::ThreadPoolBuildError,
    },
}
