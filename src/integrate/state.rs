//! The state of a render, packed.

use crate::checkpoint::Packed;

/// A render between two rounds of its work.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub(super) packed: Packed,
    /// How far it is.
    pub made: Made,
}

impl State {
    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.packed.len()
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Made {
    /// Of all chains.
    pub mutations: u64,
    /// Independent ones.
    pub samples: u64,
    /// Part of what was asked for, 0 to 1.
    pub part: f64,
    /// Since the scene was loaded, without what was between stops.
    pub seconds: f64,
}
