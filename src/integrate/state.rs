//! The state of a render, packed.

use crate::checkpoint::Packed;
use serde::Serialize;

/// A render between two rounds of its work.
#[derive(Clone, Debug, Default, PartialEq)]
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

/// What the first of several processes has had from the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Gathered {
    /// How often they have handed over what they had made.
    pub times: u64,
    /// What has come to it directly.
    pub bytes: u64,
    /// Until it came: rounds end at the same time everywhere, so that this is how long others pack,
    /// and how long it is on its way.
    pub waiting_seconds: f64,
    /// Adding it up.
    pub adding_seconds: f64,
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
