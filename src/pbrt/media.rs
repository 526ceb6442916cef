//! `MakeNamedMedium` and `MediumInterface`: media in world space, until it is known which of them
//! fill anything.

mod cloud;
mod grids;
mod presets;

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use self::grids::WorldGrid;
use super::color::Use;
use super::dialect::Dialect;
use super::error::{Report, SceneError, Site};
use super::geometry::WorldShape;
use super::params::ParamSet;
use super::textures::Deferred;
use super::transform::rows;
use crate::scene::{self, NONE, Rgb, Space};

/// A mean cosine beyond this is as good as a delta.
const MOST_G: f64 = 0.9999;

/// A medium in world space: coefficients per length of the file.
#[derive(Clone, Debug)]
pub(super) struct WorldMedium {
    name: String,
    origin: String,
    /// Where the density is 1, as all of these.
    extinction: Rgb,
    scattering: Rgb,
    g: f32,
    density: WorldDensity,
    emission: WorldEmission,
}

/// As [`scene::Density`].
#[derive(Clone, Debug)]
enum WorldDensity {
    Uniform,
    Grid(WorldGrid),
    Channels {
        extinction: WorldGrid,
        scattering: WorldGrid,
    },
}

/// As [`scene::Emission`].
#[derive(Clone, Debug)]
enum WorldEmission {
    Dark,
    Even(Rgb),
    Grid {
        absorption: Rgb,
        radiance: Rgb,
        grid: WorldGrid,
    },
    Product {
        radiance: Rgb,
        grids: [WorldGrid; 2],
    },
    BlackBody {
        absorption: Rgb,
        grids: [WorldGrid; 2],
        scale: f32,
        offset: f32,
        table: Arc<[Rgb]>,
    },
}

/// The media that a file names.
#[derive(Debug, Default)]
pub(super) struct Media {
    /// Numbers of what has a name.
    names: HashMap<String, u32>,
    /// By number; `None` if it has only been named so far (v4).
    made: Vec<Option<Deferred<WorldMedium>>>,
    /// By number: where something is filled with it, and what it is called.
    used: Vec<Option<(Rc<Site>, String)>>,
}

impl Media {
    /// Whether there is a medium of this name.
    pub fn has(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    /// The number of a name, [`NONE`] for the empty one.
    pub fn number(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return NONE;
        }
        if let Some(&number) = self.names.get(name) {
            return number;
        }
        let number = self.made.len() as u32;
        self.names.insert(name.to_owned(), number);
        self.made.push(None);
        self.used.push(None);
        number
    }

    /// What is called `name` from now on.
    pub fn make(&mut self, name: &str, made: Deferred<WorldMedium>, dialect: Dialect) {
        // What v3 has named already stays what it was.
        if dialect == Dialect::V3 {
            self.names.remove(name);
        }
        let number = self.number(name) as usize;
        self.made[number] = Some(made);
    }

    /// Whether something of this name was made, not just named.
    pub fn is_made(&self, name: &str) -> bool {
        let number = self.names.get(name);
        number.is_some_and(|number| self.made[*number as usize].is_some())
    }

    /// Something is filled with these.
    pub fn fill(&mut self, numbers: [u32; 2], site: &Rc<Site>) {
        for number in numbers.into_iter().filter(|number| *number != NONE) {
            let used = &mut self.used[number as usize];
            if used.is_none() {
                let name = self.names.iter().find(|(_, n)| **n == number);
                let name = name.map(|(name, _)| name.clone()).unwrap_or_default();
                *used = Some((Rc::clone(site), name));
            }
        }
    }

    /// The media that fill something, in internal space, and where each number went; those without
    /// any effect are a vacuum.
    pub fn finish(
        self,
        space: &Space,
        report: &mut Report,
    ) -> Result<(Vec<scene::Medium>, Vec<u32>), SceneError> {
        let (mut list, mut index) = (Vec::new(), vec![NONE; self.made.len()]);
        for (number, (made, used)) in self.made.into_iter().zip(self.used).enumerate() {
            match (made, used) {
                (Some(made), Some(_)) => {
                    let medium = made?.to_internal(space);
                    if medium.extinction != [0.0; 3] {
                        index[number] = list.len() as u32;
                        list.push(medium);
                    }
                }
                (None, Some((site, name))) => {
                    return Err(site.error(format_args!("there is no medium named \"{name}\"")));
                }
                (Some(Err(error)), None) => {
                    report.warn(format!("{error} (nothing is filled with it)"));
                }
                (_, None) => {}
            }
        }
        Ok((list, index))
    }
}

impl WorldMedium {
    fn new(name: &str, set: &ParamSet, [absorption, scattering]: [Rgb; 2]) -> Self {
        Self {
            name: name.to_owned(),
            origin: set.site.origin(),
            extinction: [0, 1, 2].map(|c| (absorption[c] + scattering[c]).min(f32::MAX)),
            scattering,
            g: 0.0,
            density: WorldDensity::Uniform,
            emission: WorldEmission::Dark,
        }
    }

    /// In internal space, where lengths are shorter by the scale.
    fn to_internal(&self, space: &Space) -> scene::Medium {
        let per_length =
            |rgb: Rgb| rgb.map(|c| ((f64::from(c) / space.scale) as f32).min(f32::MAX));
        let grid = |grid: &WorldGrid| scene::Grid {
            to_grid: rows(
                &(grid.to_grid
                    * DAffine3::from_translation(space.centre)
                    * DAffine3::from_scale(DVec3::splat(1.0 / space.scale))),
            ),
            size: grid.size,
            channels: grid.channels,
            values: Arc::clone(&grid.values),
        };
        let density = match &self.density {
            WorldDensity::Uniform => scene::Density::Uniform,
            WorldDensity::Grid(of) => scene::Density::Grid(grid(of)),
            WorldDensity::Channels {
                extinction,
                scattering,
            } => scene::Density::Channels {
                extinction: grid(extinction),
                scattering: grid(scattering),
            },
        };
        let emission = match &self.emission {
            WorldEmission::Dark => scene::Emission::Dark,
            WorldEmission::Even(rgb) => scene::Emission::Even(per_length(*rgb)),
            WorldEmission::Grid {
                absorption,
                radiance,
                grid: of,
            } => scene::Emission::Grid {
                absorption: per_length(*absorption),
                radiance: *radiance,
                grid: grid(of),
            },
            WorldEmission::Product { radiance, grids } => scene::Emission::Product {
                radiance: per_length(*radiance),
                grids: [grid(&grids[0]), grid(&grids[1])],
            },
            WorldEmission::BlackBody {
                absorption,
                grids,
                scale,
                offset,
                table,
            } => scene::Emission::BlackBody {
                absorption: per_length(*absorption),
                grids: [grid(&grids[0]), grid(&grids[1])],
                scale: *scale,
                offset: *offset,
                table: Arc::clone(table),
            },
        };
        scene::Medium {
            name: self.name.clone(),
            origin: self.origin.clone(),
            extinction: per_length(self.extinction),
            scattering: per_length(self.scattering),
            g: self.g,
            density,
            emission,
        }
    }

    /// Memory of its grids, in bytes.
    pub fn bytes(&self) -> u64 {
        let of = |grid: &WorldGrid| size_of_val(&grid.values[..]) as u64;
        let density = match &self.density {
            WorldDensity::Uniform => 0,
            WorldDensity::Grid(grid) => of(grid),
            WorldDensity::Channels {
                extinction,
                scattering,
            } => of(extinction) + of(scattering),
        };
        density
            + match &self.emission {
                WorldEmission::Dark | WorldEmission::Even(_) => 0,
                WorldEmission::Grid { grid, .. } => of(grid),
                WorldEmission::Product { grids, .. } | WorldEmission::BlackBody { grids, .. } => {
                    grids.iter().map(of).sum()
                }
            }
    }

    /// Reads a medium; `ctm` is the current transform.
    pub fn read(name: &str, set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        let Some(kind) = set.string("type")? else {
            return Err(set.error("has no \"string type\""));
        };
        let known = match set.dialect {
            Dialect::V3 => "homogeneous or heterogeneous",
            Dialect::V4 => "homogeneous, uniformgrid, rgbgrid or cloud",
        };
        match (set.dialect, kind) {
            (_, "homogeneous") => Self::homogeneous(name, set),
            (Dialect::V3, "heterogeneous") | (Dialect::V4, "uniformgrid") => {
                Self::grid(name, set, ctm)
            }
            (Dialect::V4, "rgbgrid") => Self::rgb_grid(name, set, ctm),
            (Dialect::V4, "cloud") => Self::cloud(name, set, ctm),
            (Dialect::V4, "nanovdb") => {
                set.accept_all();
                Err(set.error(format_args!(
                    "media of type \"nanovdb\" are not supported; use {known}"
                )))
            }
            _ => {
                set.accept_all();
                Err(set.error(format_args!(
                    "media of type \"{kind}\" are unknown; use {known}"
                )))
            }
        }
    }

    fn homogeneous(name: &str, set: &ParamSet) -> Deferred<Self> {
        let coefficients = coefficients(set, true)?;
        let mut medium = Self::new(name, set, coefficients);
        medium.g = asymmetry(set)?;
        if set.dialect == Dialect::V4
            && let Some(radiance) = set.color("Le", Use::Emission)?
            && radiance != [0.0; 3]
        {
            let scale = set.float_in("Lescale", 1.0, 0.0, f64::INFINITY)? as f32;
            let [absorption, _] = coefficients;
            medium.emission =
                WorldEmission::Even([0, 1, 2].map(|c| absorption[c] * radiance[c] * scale));
        }
        Ok(medium)
    }
}

/// Absorption and scattering per length of the file; of a preset, if there can be one.
fn coefficients(set: &ParamSet, presets: bool) -> Result<[Rgb; 2], SceneError> {
    let name = if presets {
        set.string("preset")?
    } else {
        None
    };
    let named = match name {
        None | Some("") => None,
        Some(name) => {
            let known = presets::preset(name);
            if known.is_none() {
                set.note(format_args!("there is no preset named \"{name}\": it is ignored"));
            }
            known
        }
    };
    let given = [
        set.color("sigma_a", Use::Index)?,
        set.color("sigma_s", Use::Index)?,
    ];
    let [absorption, scattering] = match (set.dialect, named) {
        // A preset is a default in v3, and all there is in v4.
        (Dialect::V4, Some(preset)) => {
            if given.iter().any(Option::is_some) {
                set.note("its preset counts, not its \"sigma_a\" and \"sigma_s\", as in pbrt-v4");
            }
            preset
        }
        (Dialect::V4, None) => given.map(|c| c.unwrap_or([1.0; 3])),
        (Dialect::V3, named) => {
            let [a, s] = named.unwrap_or([[0.0011, 0.0024, 0.014], [2.55, 3.21, 3.77]]);
            [given[0].unwrap_or(a), given[1].unwrap_or(s)]
        }
    };
    let scale = set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32;
    let scaled = |c: Rgb| c.map(|c| (c.max(0.0) * scale).min(f32::MAX));
    Ok([scaled(absorption), scaled(scattering)])
}

/// The mean cosine of what is scattered.
fn asymmetry(set: &ParamSet) -> Result<f32, SceneError> {
    let g = set.float_in("g", 0.0, -1.0, 1.0)?;
    Ok(g.clamp(-MOST_G, MOST_G) as f32)
}

/// The media of a scene, as its tables are made.
pub(super) struct Fillings {
    /// What the tables hold so far.
    pub media: scene::Media,
    /// Of each number, the index of its medium.
    index: Vec<u32>,
}

impl Fillings {
    /// Of all that is filled: the shapes' sides, the surroundings of the camera, those of lights
    /// that are no shapes.
    pub fn new(
        mut media: Media,
        shapes: &[WorldShape],
        (camera, lights): (u32, &[u32]),
        space: &Space,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        for shape in shapes {
            media.fill(shape.media, &shape.site);
        }
        let (list, index) = media.finish(space, report)?;
        let mut fillings = Self {
            media: scene::Media {
                list,
                ..scene::Media::default()
            },
            index,
        };
        fillings.media.camera = fillings.of(camera);
        if !fillings.media.list.is_empty() {
            fillings.media.lights = lights.iter().map(|l| [fillings.of(*l); 2]).collect();
        }
        Ok(fillings)
    }

    fn of(&self, number: u32) -> u32 {
        self.index.get(number as usize).copied().unwrap_or(NONE)
    }

    /// Index of the boundary between two media; [`NONE`] if they are one.
    pub fn boundary(&mut self, numbers: [u32; 2]) -> u32 {
        let sides = numbers.map(|n| self.of(n));
        if sides[0] == sides[1] {
            return NONE;
        }
        let known = self.media.boundaries.iter().position(|b| *b == sides);
        known.unwrap_or_else(|| {
            self.media.boundaries.push(sides);
            self.media.boundaries.len() - 1
        }) as u32
    }

    /// A further light, which shines into these.
    pub fn add_light(&mut self, numbers: [u32; 2]) {
        if !self.media.list.is_empty() {
            self.media.lights.push(numbers.map(|n| self.of(n)));
        }
    }
}
