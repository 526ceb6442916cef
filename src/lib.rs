//! Phalanx: Metropolis light transport with thousands of Markov chains in lockstep.
pub mod camera;
pub mod chain;
pub mod cli;
pub mod film;
pub mod formats;
pub mod geometry;
pub mod integrate;
pub mod light;
pub mod plan;
pub mod scene;
pub mod simd;
pub mod surface;
pub mod trace;
pub mod transport;
