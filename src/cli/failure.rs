//! How a command fails.

/// Why a command failed: the message, and which exit code it means.
#[derive(Debug)]
pub(super) enum Failure {
    /// Bad arguments, or a scene that cannot be used: exit code 2.
    Input(String),
    /// The system would not: exit code 1.
    Io(String),
}
