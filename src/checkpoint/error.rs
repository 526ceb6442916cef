//! Why a checkpoint cannot be used.

use std::io;

/// Values are not what was expected: they come from another program, or from somebody who made them
/// up. What a file has lost is found out before, by its checksums.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("is not a state of this render: {0}")]
pub struct Malformed(pub String);

impl Malformed {
    /// What is wrong, for people.
    pub fn new(what: impl Into<String>) -> Self {
        Self(what.into())
    }

    /// Fails unless all is right.
    pub fn unless(right: bool, what: &str) -> Result<(), Self> {
        if right { Ok(()) } else { Err(Self::new(what)) }
    }
}

/// Why a file is no checkpoint that a render can go on from.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The system says no.
    #[error("cannot be read: {0}")]
    Io(#[from] io::Error),
    /// It does not begin like one.
    #[error("is no checkpoint of Phalanx")]
    Foreign,
    /// Another version of the program wrote it: renders go on to the same bits with the same
    /// program only.
    #[error("was written by {by}, and this is {this}: go on with the version that began")]
    Version {
        /// What wrote it.
        by: String,
        /// What was to read it.
        this: String,
    },
    /// It is not as it was written.
    #[error("is damaged: {0}")]
    Damaged(&'static str),
    /// All is there, but it does not fit.
    #[error(transparent)]
    Malformed(#[from] Malformed),
}
