//! What a scene calls for: effects present, strategies that can carry light, primary samples that
//! exist.
//!
//! Decided once a render. Kernels, queues and dimensions that a scene does not need do not run:
//! nothing per ray asks about it again.

mod choice;
mod effects;
mod report;
mod surfaces;

pub use self::choice::Choice;
pub use self::effects::{Effect, Effects, Forced, Member};
pub use self::report::Report;
use crate::surface::Kind;
use std::ops::Range;

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
    /// Camera subpaths can be joined to lights and light subpaths to the camera (some BSDF is not
    /// a delta).
    pub connectable: bool,
    /// Camera subpaths can be joined to light subpaths: surfaces whose BSDFs are not deltas see
    /// each other.
    pub joinable: bool,
    /// Camera subpaths can meet a light by chance.
    pub hits_lights: bool,
    /// Some material has a bump or normal map.
    pub bumps: bool,
    /// Parts of shapes are cut out: rays pass there.
    pub cutouts: bool,
    /// Some of these shapes are lights: not every point of a light emits.
    pub cut_lights: bool,
}

/// The plan for paths with `depth` scattering events.
#[derive(Clone, Debug)]
pub struct DepthPlan {
    pub depth: u32,
    /// Numbers of light vertices `s` of the strategies `(s, depth + 2 - s)` that can carry light,
    /// ascending.
    pub strategies: Vec<u32>,
    /// How paths choose among them.
    pub choice: Choice,
    pub layout: Layout,
}

/// Where primary samples live in the matrix `[dimension][path]`. Three streams in a row: camera,
/// light, connection; a change of strategy re-labels none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// First sample of the camera stream; exists if there is more than one strategy.
    pub strategy: usize,
    pub raster: usize,
    pub lens: usize,
    /// Exists if something disperses light.
    pub wavelength: usize,
    pub camera_bounce: usize,
    /// One sample per surface vertex that scatters, if there are mixtures; they choose components.
    pub camera_label: usize,
    pub light_choice: usize,
    /// Four samples: position and direction.
    pub emission: usize,
    pub light_bounce: usize,
    /// As `camera_label`; one more than there are bounces, as the tip is a mixture, too.
    pub light_label: usize,
    pub connection_choice: usize,
    /// Two samples: a point on a light (`s = 1`), on the lens, or one of several places on the
    /// film (`t = 1`).
    pub connection: usize,
    pub per_bounce: usize,
    /// Rows of the matrix.
    pub total: usize,
}

impl Layout {
    /// What the primary samples are for, in order; some parts may be empty.
    pub fn parts(&self) -> [(&'static str, Range<usize>); 12] {
        [
            ("strategy", self.strategy..self.raster),
            ("raster position", self.raster..self.lens),
            ("lens", self.lens..self.wavelength),
            ("wavelength", self.wavelength..self.camera_bounce),
            ("camera bounces", self.camera_bounce..self.camera_label),
            ("camera components", self.camera_label..self.light_choice),
            ("choice of light", self.light_choice..self.emission),
            ("emission", self.emission..self.light_bounce),
            ("light bounces", self.light_bounce..self.light_label),
            ("light components", self.light_label..self.connection_choice),
            (
                "choice of connected light",
                self.connection_choice..self.connection,
            ),
            ("connected point", self.connection..self.total),
        ]
    }
}

impl Plan {
    /// For paths of up to `max_depth` scattering events.
    pub fn new(effects: Effects, max_depth: u32) -> Self {
        let mut plan = Self {
            kinds: effects.kinds(),
            per_bounce: if effects.has(Effect::Lobes) { 3 } else { 2 },
            mixtures: effects.has(Effect::Mixtures),
            dispersion: effects.has(Effect::Dispersion),
            lens: effects.has(Effect::Lens),
            light_choice: effects.has(Effect::LightChoice),
            scatters: effects.has(Effect::Bounces),
            interreflects: effects.has(Effect::MoreBounces),
            connectable: effects.has(Effect::Connections),
            joinable: effects.has(Effect::Joins),
            hits_lights: effects.has(Effect::ChanceHits),
            bumps: effects.has(Effect::Bumps),
            cutouts: effects.has(Effect::Cutouts),
            cut_lights: effects.has(Effect::CutLights),
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
            strategies.push(depth + 1);
        }
        let layout = self.layout(depth as usize, &strategies);
        DepthPlan {
            depth,
            choice: Choice::uniform(&strategies),
            strategies,
            layout,
        }
    }

    fn layout(&self, depth: usize, strategies: &[u32]) -> Layout {
        let mut next = 0;
        let mut take = |n: usize| {
            let at = next;
            next += n;
            at
        };
        let light_subpath = strategies.iter().any(|s| *s >= 2);
        let light_bounces = if light_subpath {
            depth.saturating_sub(1)
        } else {
            0
        };
        let connects = strategies.iter().any(|s| *s >= 1);
        let choice = usize::from(self.light_choice);
        let strategy = take(usize::from(strategies.len() > 1));
        let raster = take(2);
        let lens = take(if self.lens { 2 } else { 0 });
        let wavelength = take(usize::from(self.dispersion));
        let camera_bounce = take(depth * self.per_bounce);
        let label = usize::from(self.mixtures);
        let camera_label = take(depth * label);
        let light_choice = take(if light_subpath { choice } else { 0 });
        let emission = take(if light_subpath { 4 } else { 0 });
        let light_bounce = take(light_bounces * self.per_bounce);
        let light_label = take(if light_subpath { depth * label } else { 0 });
        let connection_choice = take(if connects { choice } else { 0 });
        let connection = take(if connects { 2 } else { 0 });
        Layout {
            strategy,
            raster,
            lens,
            wavelength,
            camera_bounce,
            camera_label,
            light_choice,
            emission,
            light_bounce,
            light_label,
            connection_choice,
            connection,
            per_bounce: self.per_bounce,
            total: next,
        }
    }
}
