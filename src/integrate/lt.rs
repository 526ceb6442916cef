//! Light tracing (Arvo 1986; Dutre, Lafortune and Willems 1993): light subpaths, each vertex of
//! which is joined to the camera, and lights that the camera sees directly. What specular surfaces
//! show the camera is out of its reach.

use super::sampled::{self, Method};
use super::{Render, Run};
use crate::checkpoint::{Malformed, Reader};
use crate::simd::Lanes;
use crate::simd::rng::Purpose;
use crate::transport::bidirectional::BidirectionalLayout;

pub(super) fn render<L: Lanes>(run: &Run, from: &mut [Reader]) -> Result<Render, Malformed> {
    let layout = BidirectionalLayout::light_tracing(run.world);
    let method = Method {
        name: "lt",
        purpose: Purpose::LightTracer,
        layout: &layout.at,
        splats: true,
        evaluate: &|samples, n, paths| {
            (run.world).evaluate_bidirectional::<L>(&layout, samples, n, paths);
        },
        collect: &|_, _| {},
    };
    let mut render = sampled::render::<L>(run, &method, from)?.render;
    let specular = (run.world.plan.kinds.iter()).filter(|kind| kind.is_delta());
    let names: Vec<&str> = specular.map(|kind| kind.name()).collect();
    if !names.is_empty() && run.settings.max_depth > 0 {
        render.warnings.push(format!(
            "light tracing cannot see what specular surfaces ({}) show the camera: that light is missing from the picture",
            names.join(", ")
        ));
    }
    if run.world.has_glowing_media() && run.settings.max_depth > 0 {
        render.warnings.push(
            "light tracing does not follow light that media emit: only what the camera sees of it directly is in the picture; pt, bdpt, pssmlt, mmlt and auto have all of it"
                .into(),
        );
    }
    Ok(render)
}
