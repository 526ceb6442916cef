//! All that a replay says, as JSON has it.

use serde::Serialize;

use crate::integrate::{Visit, Whose};
use crate::replay::PathReport;

/// What is printed: a path, or an iteration of a chain.
#[derive(Default, Serialize)]
pub struct Document<'a> {
    pub scene_file: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iteration: Option<Iteration>,
    /// The chain's state before the iteration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub current: Option<PathReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proposal: Option<PathReport>,
}

/// What a chain did.
#[derive(Serialize)]
pub struct Iteration {
    pub depth: u32,
    pub chain: usize,
    pub iteration: u32,
    /// Chains of the depth; iterations of each in the whole render.
    pub chains: usize,
    pub iterations: u32,
    /// How chains of the depth mutate, as set or as tuned.
    pub sigma: f32,
    pub large_step_probability: f32,
    /// Number of the bootstrap path that the chain started from.
    pub bootstrap_path: u64,
    pub large: bool,
    pub acceptance: f32,
    pub drawn: f32,
    pub accepted: bool,
}

impl Iteration {
    pub fn of(whose: &Whose, visit: &Visit) -> Self {
        Self {
            depth: whose.depth,
            chain: whose.chain,
            iteration: whose.iteration,
            chains: visit.chains,
            iterations: visit.iterations,
            sigma: visit.proposals.sigma,
            large_step_probability: visit.proposals.large_step_probability,
            bootstrap_path: visit.start,
            large: visit.step.large,
            acceptance: visit.step.acceptance,
            drawn: visit.step.drawn,
            accepted: visit.step.accepted,
        }
    }
}
