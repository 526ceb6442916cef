//! Path tracing: the reference for everything else. Same kernels, independent samples, a fixed
//! number per pixel.

use super::sampled::{self, Method};
use super::{Render, Run};
use crate::checkpoint::{Malformed, Reader};
use crate::simd::Lanes;
use crate::simd::rng::Purpose;
use crate::transport::evaluate::UnidirectionalLayout;

pub(super) fn render<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    let layout = UnidirectionalLayout::new(&run.world.plan, run.settings.max_depth);
    let method = Method {
        name: "pt",
        purpose: Purpose::PathTracer,
        layout: layout.dimensions(),
        splats: false,
        evaluate: &|samples, n, paths| {
            (run.world).evaluate_unidirectional::<L>(&layout, samples, n, paths);
        },
        collect: &|_, _| {},
    };
    Ok(sampled::render::<L>(run, &method, from)?.render)
}
