//! Why there is no picture.

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    #[error("{0}")]
    Settings(String),
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        threads: usize,
        source: rayon::ThreadPoolBuildError,
    },
}
