//! What a scene calls for: effects present, strategies that can carry light, primary samples that
//! exist.
//!
//! Decided once a render. Kernels, queues and dimensions that a scene does not need do not run:
//! nothing per ray asks about it again.

pub mod chance;
mod choice;
mod effects;
mod forced;
mod layout;
mod report;
mod surfaces;

pub use self::chance::Chance;
pub use self::choice::Choice;
pub use self::effects::{Effect, Effects, Member};
pub use self::forced::Forced;
pub use self::layout::{BELOW_BOUNCE, BELOW_CHOICE, BELOW_RADIUS, Layout, Pair, Strides, Vertices};
pub use self::report::PlanReport;
use crate::surface::Kind;

/// The plan of a render.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What all the rest follows from.
    pub effects: Effects,
    /// BSDF kernels, a queue each.
    pub kinds: Vec<Kind>,
    /// One plan per depth, `0..=max_depth`.
    pub depths: Vec<DepthPlan>,
    /// Primary samples per bounce: 2, or 3 if some BSDF has lobes to choose from.
    pub per_bounce: usize,
    /// Some surface is a mixture: choosing its component takes one primary sample per surface
    /// vertex.
    pub mixtures: bool,
    /// Something is filled with a medium: where a vertex lies in it takes one primary sample per
    /// ray of a subpath.
    pub media: bool,
    /// Light comes out of some surfaces elsewhere than it went in: there are no multiplexed paths,
    /// and path-traced ones take primary samples for it.
    pub subsurface: bool,
    /// The index of refraction of some surface depends on the wavelength, which takes one primary
    /// sample.
    pub dispersion: bool,
    /// The lens takes two primary samples.
    pub lens: bool,
    /// Choosing a light takes one primary sample.
    pub light_choice: bool,
    /// Some surface scatters light: there are paths of more than one ray.
    pub scatters: bool,
    /// Light can scatter more than once: surfaces that scatter see each other.
    pub interreflects: bool,
    /// Camera subpaths can be joined to lights, and light subpaths to the camera if they can at all
    /// (some BSDF is not a delta).
    pub connectable: bool,
    /// Light subpaths can be joined to the camera: it has no system of lenses.
    pub seen: bool,
    /// Rays can be blocked within the camera: it has a system of lenses.
    pub lens_system: bool,
    /// Camera subpaths can be joined to light subpaths: surfaces whose BSDFs are not deltas see
    /// each other.
    pub joinable: bool,
    /// Camera subpaths can meet a light by chance.
    pub hits_lights: bool,
    /// Some material has a bump or normal map.
    pub bumps: bool,
    /// Parts of shapes are cut out: rays pass there.
    pub alpha_masks: bool,
    /// Some of these shapes are lights: not every point of a light emits.
    pub masked_lights: bool,
}

/// The plan for paths with `depth` scattering events.
#[derive(Clone, Debug)]
pub struct DepthPlan {
    /// Scattering events `k` of a path; 0 sees lights directly.
    pub depth: u32,
    /// Numbers of light vertices `s` of the strategies `(s, depth + 2 - s)` that can carry light,
    /// ascending.
    pub strategies: Vec<u32>,
    /// How paths choose among them.
    pub choice: Choice,
    /// The most of a contribution's mean channel that independent samples keep where they share
    /// the light of this depth with chains, see `transport::share`; 0 if they do not.
    pub kept: f32,
    /// Where each primary sample of a multiplexed path of this depth lies.
    pub layout: Layout,
}

impl Plan {
    /// For paths of up to `max_depth` scattering events.
    pub fn new(effects: Effects, max_depth: u32) -> Self {
        let mut plan = Self {
            kinds: effects.kinds(),
            per_bounce: if effects.has(Effect::Lobes) { 3 } else { 2 },
            mixtures: effects.has(Effect::Mixtures),
            media: effects.has(Effect::Media),
            subsurface: effects.has(Effect::Subsurface),
            dispersion: effects.has(Effect::Dispersion),
            lens: effects.has(Effect::Lens),
            light_choice: effects.has(Effect::LightChoice),
            scatters: effects.has(Effect::Bounces),
            interreflects: effects.has(Effect::MoreBounces),
            connectable: effects.has(Effect::Connections),
            seen: effects.has(Effect::Connections) && !effects.has(Effect::LensSystem),
            lens_system: effects.has(Effect::LensSystem),
            joinable: effects.has(Effect::Joins),
            hits_lights: effects.has(Effect::EmitterHits),
            bumps: effects.has(Effect::Bumps),
            alpha_masks: effects.has(Effect::AlphaMasks),
            masked_lights: effects.has(Effect::MaskedLights),
            effects,
            depths: Vec::new(),
        };
        plan.depths = (0..=max_depth).map(|k| plan.depth_plan(k)).collect();
        plan
    }

    fn depth_plan(&self, depth: u32) -> DepthPlan {
        // Chance (s = 0) needs a light that can be met; the rest, a surface that can be connected.
        // Directly seen lights are left to chance alone, as in pbrt. What is left out here
        // cannot make any path that carries light, so that no weight misses it: its density
        // is 0 in every sum of densities.
        let exists = match depth {
            _ if self.subsurface => false,
            0 => true,
            1 => self.scatters,
            _ => self.interreflects,
        };
        let mut strategies = Vec::new();
        if self.hits_lights && exists {
            strategies.push(0);
        }
        if self.connectable && exists && depth > 0 {
            strategies.push(1);
            if self.joinable {
                strategies.extend(2..=depth);
            }
            if self.seen {
                strategies.push(depth + 1);
            }
        }
        let layout = Layout::multiplexed(self, depth as usize, &strategies);
        DepthPlan {
            depth,
            choice: Choice::uniform(&strategies),
            kept: 0.0,
            strategies,
            layout,
        }
    }
}
