//! Phalanx: Metropolis light transport with thousands of Markov chains in lockstep.
pub mod film;
pub mod formats;
pub mod scene;
