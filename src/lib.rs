//! Phalanx: Metropolis light transport with thousands of Markov chains in lockstep.
pub mod scene;
pub mod simd;
pub mod trace;
