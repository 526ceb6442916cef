//! Multiplexed Metropolis light transport (Hachisuka, Kaplanyan and Dachsbacher 2014): every depth
//! is an integral of its own, and a primary sample chooses among the bidirectional strategies of
//! that depth.

use super::chains;
use super::method::Method;
use super::{Render, Run};
use crate::checkpoint::{Malformed, Reader};
use crate::plan::Plan;
use crate::simd::Lanes;
use crate::transport::PathSampler;

/// A sampler for each depth.
pub(super) fn method(plan: &Plan) -> Method {
    Method {
        name: "mmlt",
        samplers: plan.depths.iter().map(PathSampler::from).collect(),
        combined: false,
    }
}

pub(super) fn render<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    chains::render::<L>(run, &method(&run.world.plan), from)
}
