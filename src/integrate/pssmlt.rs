//! Primary sample space Metropolis light transport (Kelemen, Szirmay-Kalos, Antal and Csonka 2002):
//! all primary samples of one path sampler, unidirectional or bidirectional, are mutated together.
//! All depths are one integral, and all that a sample contributes, wherever on the film, is one
//! state: accepted or rejected at once, splatted with one weight.
//!
//! Large steps count twice: as proposals of the chain, and as independent samples, by Kelemen's
//! weights ([`chain::splats`](crate::chain::splats) has the equations). What is dim in the picture
//! is then as certain as the sampler alone would make it.

use super::chains;
use super::method::Method;
use super::{Render, Run};
use crate::checkpoint::{Malformed, Reader};
use crate::scene::{IntegratorKind, PathSamplerKind};
use crate::simd::Lanes;
use crate::transport::bidirectional::BidirectionalLayout;
use crate::transport::evaluate::UnidirectionalLayout;
use crate::transport::{PathSampler, World};

/// One sampler for all depths.
pub(super) fn method(world: &World, max_depth: u32, kind: PathSamplerKind) -> Method {
    let sampler = match kind {
        PathSamplerKind::Bdpt => PathSampler::Bidirectional(BidirectionalLayout::new(world)),
        PathSamplerKind::Pt => {
            PathSampler::Unidirectional(UnidirectionalLayout::new(&world.plan, max_depth))
        }
    };
    Method {
        name: IntegratorKind::Pssmlt(kind).name(),
        samplers: vec![sampler],
        combined: true,
    }
}

pub(super) fn render<L: Lanes>(
    run: &Run,
    kind: PathSamplerKind,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let method = method(run.world, run.settings.max_depth, kind);
    chains::render::<L>(run, &method, from)
}
