//! Markov chains in primary sample space (Kelemen et al. 2002), a batch at a time.
//!
//! 1. [`target`] says what chains can march over; [`primary`] sample space is one.
//! 2. [`mutate`] proposes primary samples: all dimensions of eight chains at once. [`accept`]
//!    decides, and defines the scalar target.
//! 3. [`bootstrap`] estimates the target's integral per sampler and supplies the chains' first
//!    states.
//! 4. [`strategy_choice`] has them choose strategies as the bootstrap suggests.
//! 5. [`tune`] finds the size of their small steps and how often they make large ones, before they
//!    start.
//!    [`trial`] tells what they would be worth.
//! 6. [`batch`] holds chains of one target and marches them: propose, evaluate, accept, splat
//!    ([`splats`]); [`counts`] says how often.
//! 7. [`evaluator`] is for tests and benchmarks: all of it at a width known only at run time.
//!    Renders do not use it.
//! 8. [`monitor`] records what they do, and [`mixing`] judges it: split R-hat, effective sample
//!    sizes, stuck chains.
//!
//! What chains mutate is a [`PathSampler`](crate::transport::PathSampler): a path of one depth, or
//! a sample of all of them. Transport is called, and its splats and counters are read; only
//! [`primary`] looks further, at which primary samples choose strategies and places on the film.
//! The film is handed splats and not asked where they go.

pub mod accept;
pub mod batch;
pub mod bootstrap;
mod correlation;
pub mod counts;
pub mod discoveries;
pub mod evaluator;
pub mod mixing;
pub mod monitor;
pub mod mutate;
pub mod primary;
pub mod splats;
pub mod strategy_choice;
pub mod target;
pub mod trial;
pub mod tune;

#[cfg(test)]
mod tests;
