//! Why there is no picture.

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// What is wrong with the settings.
    #[error("{0}")]
    Settings(String),
    /// The system gave no threads.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What it said.
        source: rayon::ThreadPoolBuildError,
    },
}
