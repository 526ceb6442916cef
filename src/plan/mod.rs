//! What a scene calls for: effects present, strategies that can carry light, primary samples that exist.
//!
//! Decided once a render. Kernels, queues and dimensions that a scene does not need do not run: nothing per ray asks about it again.

mod choice;
mod surfaces;

pub use self::choice::Choice;

use self::surfaces::Surfaces;
use crate::camera::Camera;
use crate::light::LightTable;
use crate::scene::{NONE, Scene};
use crate::surface::{Kind, MaterialTable};
use std::fmt;
use std::ops::Range;

/// The plan of a render.
#[derive(Clone, Debug)]
pub struct Plan {
    /// BSDF kernels, a queue each.
    pub kinds: Vec<Kind>,
    /// One plan per depth, `0..=max_depth`.
    pub depths: Vec<DepthPlan>,
    /// Primary samples per bounce: 2, or 3 if some BSDF has lobes to choose from.
    pub per_bounce: usize,
    /// Some surface is a mixture: choosing its component takes one primary sample per surface vertex.
    pub mixtures: bool,
    /// The index of refraction of some surface depends on the wavelength, which takes one primary sample.
    pub dispersion: bool,
    /// The lens takes two primary samples.
    pub lens: bool,
    /// Choosing a light takes one primary sample.
    pub light_choice: bool,
    /// Some surface scatters light: there are paths of more than one ray.
    pub scatters: bool,
    /// Light can scatter more than once: surfaces that scatter see each other.
    pub interreflects: bool,
    /// Camera subpaths can be joined to lights and light subpaths to the camera (some BSDF is not a delta).
    pub connectable: bool,
    /// Camera subpaths can be joined to light subpaths: surfaces whose BSDFs are not deltas see each other.
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
    /// Numbers of light vertices `s` of the strategies `(s, depth + 2 - s)` that can carry light, ascending.
    pub strategies: Vec<u32>,
    /// How paths choose among them.
    pub choice: Choice,
    pub layout: Layout,
}

/// Where primary samples live in the matrix `[dimension][path]`. Three streams in a row: camera, light, connection; a change of strategy
/// re-labels none.
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
    /// Two samples: a point on a light (`s = 1`), on the lens, or one of several places on the film (`t = 1`).
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
    pub fn new(
        scene: &Scene,
        max_depth: u32,
        materials: &MaterialTable,
        lights: &LightTable,
        camera: &Camera,
    ) -> Self {
        let mut used = vec![false; materials.entries.len()];
        for shape in &scene.shapes {
            used[shape.material as usize] = true;
        }
        let used = || (0..used.len()).filter(|i| used[*i]);
        // What surfaces are in the end: materials that are no mixtures.
        let mut parts: Vec<usize> = used().flat_map(|i| materials.components(i)).collect();
        parts.sort();
        parts.dedup();
        let mut kinds: Vec<Kind> = parts.iter().map(|i| materials.entries[*i].kind).collect();
        kinds.sort();
        kinds.dedup();
        let all = Surfaces::of(scene, materials, |_| true);
        let open = |material: usize| !materials.entries[material].kind.is_delta();
        let open = Surfaces::of(scene, materials, open);
        let mut plan = Self {
            per_bounce: if kinds.iter().any(|k| k.has_lobes()) {
                3
            } else {
                2
            },
            mixtures: used().any(|i| materials.entries[i].mixture),
            dispersion: parts.iter().any(|i| materials.entries[*i].dispersive),
            lens: camera.has_lens(),
            light_choice: lights.needs_choice(),
            scatters: all.scatter,
            interreflects: all.face,
            connectable: open.scatter && !lights.is_empty(),
            joinable: open.face,
            hits_lights: lights.any_non_delta(),
            bumps: parts.iter().any(|i| materials.is_bumped(*i)),
            cutouts: scene.shapes.iter().any(|s| s.alpha != NONE),
            cut_lights: (scene.shapes.iter()).any(|s| s.alpha != NONE && s.light != NONE),
            kinds,
            depths: Vec::new(),
        };
        plan.depths = (0..=max_depth).map(|k| plan.depth_plan(k)).collect();
        plan
    }

    fn depth_plan(&self, depth: u32) -> DepthPlan {
        // Chance (s = 0) needs a light that can be met; the rest, a surface that can be connected. Directly seen lights are left to
        // chance alone, as in pbrt. What is left out here cannot make any path that carries light, so that no weight misses it: its density
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

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.kinds.iter().map(|k| k.name()).collect();
        writeln!(
            f,
            "  kernels       {}",
            if names.is_empty() {
                "none".into()
            } else {
                names.join(", ")
            }
        )?;
        let yes = |on: bool, what: &'static str, why: &'static str| {
            format!(
                "{} ({why})",
                if on {
                    what.to_string()
                } else {
                    format!("no {what}")
                }
            )
        };
        let lens = if self.lens {
            "lensradius > 0"
        } else {
            "pinhole"
        };
        writeln!(
            f,
            "  lens          {}",
            yes(self.lens, "lens samples", lens)
        )?;
        let glass = if self.dispersion {
            "the index of a glass depends on it: such paths are spectral, all others RGB"
        } else {
            "no index of refraction depends on it"
        };
        writeln!(
            f,
            "  dispersion    {}",
            yes(self.dispersion, "wavelength sample", glass)
        )?;
        let many = if self.light_choice {
            "more than one light"
        } else {
            "at most one light"
        };
        writeln!(
            f,
            "  lights        {}",
            yes(self.light_choice, "choice sample", many)
        )?;
        let lobes = if self.per_bounce == 3 {
            "a BSDF has several lobes"
        } else {
            "every BSDF has one lobe"
        };
        writeln!(
            f,
            "  lobes         {}",
            yes(self.per_bounce == 3, "lobe sample", lobes)
        )?;
        let mixed = if self.mixtures {
            "a surface is a mixture"
        } else {
            "no surface is a mixture"
        };
        writeln!(
            f,
            "  mixtures      {}",
            yes(self.mixtures, "component sample", mixed)
        )?;
        let chance = if self.hits_lights {
            "an area or infinite light"
        } else {
            "every light is a delta light"
        };
        writeln!(
            f,
            "  s = 0         {}",
            yes(self.hits_lights, "camera subpaths meet lights", chance)
        )?;
        let join = if self.connectable {
            "a BSDF that is not a delta"
        } else {
            "no light, or only delta BSDFs and black surfaces"
        };
        writeln!(
            f,
            "  s >= 1        {}",
            yes(self.connectable, "connections", join)
        )?;
        if self.bumps {
            writeln!(f, "  bumps         shading normals from textures")?;
        }
        if self.cutouts {
            let lights = if self.cut_lights {
                "; points on lights, too"
            } else {
                ""
            };
            writeln!(f, "  alpha         rays pass what is cut out{lights}")?;
        }
        let faces = if self.joinable {
            "such surfaces can face each other"
        } else if self.connectable {
            "all such surfaces that are not black lie in one plane"
        } else {
            "no connections"
        };
        writeln!(
            f,
            "  s, t >= 2     {}",
            yes(self.joinable && self.connectable, "joined subpaths", faces)
        )?;
        if !self.interreflects {
            let why = if self.scatters {
                "no paths of two or more bounces (all surfaces that are not black lie in one plane)"
            } else {
                "no paths with bounces (no surface that is not black)"
            };
            writeln!(f, "  depth         {why}")?;
        }
        writeln!(f, "  depth  strategies s          primary samples")?;
        for d in &self.depths {
            let runs = d.strategies.chunk_by(|a, b| a + 1 == *b);
            let runs: Vec<String> = runs
                .map(|run| match run {
                    [first, .., last] => format!("{first}..{last}"),
                    run => run.iter().map(u32::to_string).collect(),
                })
                .collect();
            let list = if runs.is_empty() {
                "none".into()
            } else {
                runs.join(", ")
            };
            writeln!(f, "  {:>5}  {:<21} {}", d.depth, list, d.layout.total)?;
        }
        Ok(())
    }
}
