//! What fills the space between surfaces: fog, smoke, milk.

use std::sync::Arc;

use super::{NONE, Rgb};

/// A medium that scatters, absorbs and emits light.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// What the file calls it.
    pub name: String,
    /// Where it was made (`scene.pbrt:42`), for reports.
    pub origin: String,
    /// Absorption and scattering together per internal length, where the density is 1.
    pub extinction: Rgb,
    /// Scattering alone, per internal length, where the density is 1.
    pub scattering: Rgb,
    /// Mean cosine between the directions before and after scattering (Henyey and Greenstein
    /// 1941), in `(-1, 1)`.
    pub g: f32,
    /// How much of it is where.
    pub density: Density,
    /// Light that it emits.
    pub emission: Emission,
}

/// How dense a medium is, by grids of some kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Density<G = Grid> {
    /// 1 everywhere.
    Uniform,
    /// A number for all channels; 0 outside the grid.
    Grid(G),
    /// Of each channel its own: extinction and scattering are multiplied by grids of three
    /// channels each; 0 outside.
    Channels {
        /// Of the extinction.
        extinction: G,
        /// Of the scattering; as large as that of the extinction, and in the same place.
        scattering: G,
    },
}

/// Light that a medium emits: radiance times absorption per length, by grids of some kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Emission<G = Grid> {
    /// None.
    Dark,
    /// The same wherever the density is the same: radiance times absorption per internal length,
    /// where the density is 1.
    Even(Rgb),
    /// `absorption` times the density times a grid times `radiance`.
    Grid {
        /// Per internal length, where the density is 1.
        absorption: Rgb,
        /// Where the grid is 1.
        radiance: Rgb,
        /// One channel or three.
        grid: G,
    },
    /// `radiance` times two grids, of three channels each.
    Product {
        /// Absorption times radiance per internal length, where both grids are 1.
        radiance: Rgb,
        /// Of absorption, and of radiance.
        grids: [G; 2],
    },
    /// `absorption` times the density times the light of a black body.
    BlackBody {
        /// Per internal length, where the density is 1.
        absorption: Rgb,
        /// Of the temperature, in kelvin by `scale * (value - offset)`, up to 100 of which there is
        /// no light; and of what that is multiplied by.
        grids: [G; 2],
        /// Kelvin per unit.
        scale: f32,
        /// Value of 0 K.
        offset: f32,
        /// Radiance every [`Emission::KELVIN_STEP`], from 0 K on; beyond the last that of the last.
        table: Arc<[Rgb]>,
    },
}

impl<G> Density<G> {
    /// The grids that it needs.
    pub fn grids(&self) -> impl Iterator<Item = &G> {
        let [first, second] = match self {
            Self::Uniform => [None, None],
            Self::Grid(grid) => [Some(grid), None],
            Self::Channels {
                extinction,
                scattering,
            } => [Some(extinction), Some(scattering)],
        };
        first.into_iter().chain(second)
    }
}

impl<G> Emission<G> {
    /// The grids that it needs.
    pub fn grids(&self) -> impl Iterator<Item = &G> {
        let grids = match self {
            Self::Dark | Self::Even(_) => &[],
            Self::Grid { grid, .. } => std::slice::from_ref(grid),
            Self::Product { grids, .. } | Self::BlackBody { grids, .. } => &grids[..],
        };
        grids.iter()
    }
}

impl Emission {
    /// Temperatures between entries of a table, in kelvin.
    pub const KELVIN_STEP: f32 = 20.0;
}

/// Numbers at the points of a lattice, interpolated between them; samples beyond its sides are 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Internal space to a space where samples are at integer points: three rows of a 3x4 matrix.
    pub to_grid: [[f32; 4]; 3],
    /// Where it ends in that space, half a step beyond its samples at most: lowest and highest
    /// corner.
    pub bounds: [[f32; 3]; 2],
    /// Samples along x, y and z.
    pub size: [u32; 3],
    /// Values of a sample, 1 or 3.
    pub channels: u32,
    /// None is negative. Channels go fastest, then x, y, z.
    pub values: Arc<[f32]>,
}

impl Grid {
    /// The value at a lattice point of one channel (of a grid with one channel, of any).
    #[inline]
    pub fn sample(&self, [x, y, z]: [i32; 3], channel: usize) -> f32 {
        let [nx, ny, nz] = self.size;
        let (x, y, z) = (x as u32, y as u32, z as u32);
        if x >= nx || y >= ny || z >= nz {
            return 0.0;
        }
        let index = (z as usize * ny as usize + y as usize) * nx as usize + x as usize;
        let channels = self.channels as usize;
        self.values[index * channels + channel.min(channels - 1)]
    }

    /// The interpolated value of a channel at a point of internal space.
    pub fn at(&self, p: [f32; 3], channel: usize) -> f32 {
        let m = &self.to_grid;
        let p = [0, 1, 2]
            .map(|k| m[k][0].mul_add(p[0], m[k][1].mul_add(p[1], m[k][2] * p[2])) + m[k][3]);
        let [low, high] = &self.bounds;
        let inside = |k: usize| p[k] >= low[k] && p[k] <= high[k];
        if !(inside(0) && inside(1) && inside(2)) {
            return 0.0;
        }
        let low = p.map(f32::floor);
        let part = [0, 1, 2].map(|k| p[k] - low[k]);
        let mut sum = 0.0;
        for corner in 0..8 {
            let bit = |k: usize| corner >> k & 1;
            let weight = |k: usize| if bit(k) == 1 { part[k] } else { 1.0 - part[k] };
            let at = [0, 1, 2].map(|k| low[k] as i32 + bit(k));
            sum += weight(0) * weight(1) * weight(2) * self.sample(at, channel);
        }
        sum
    }

    /// Memory of its values, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..])
    }
}

impl Medium {
    /// Whether it ends by itself.
    pub fn has_bounds(&self) -> bool {
        self.density != Density::Uniform
    }

    /// Whether light can be scattered in it.
    pub fn scatters(&self) -> bool {
        self.scattering != [0.0; 3]
    }

    /// Whether it emits light.
    pub fn shines(&self) -> bool {
        self.emission != Emission::Dark
    }

    fn bytes(&self) -> usize {
        let density: usize = self.density.grids().map(Grid::bytes).sum();
        let emission: usize = self.emission.grids().map(Grid::bytes).sum();
        let table = match &self.emission {
            Emission::BlackBody { table, .. } => size_of_val(&table[..]),
            _ => 0,
        };
        size_of::<Self>() + density + emission + table
    }
}

/// The media of a scene, and where they are. All indices are into [`Media::list`], or
/// [`NONE`] for a vacuum.
#[derive(Clone, Debug, PartialEq)]
pub struct Media {
    /// Those that something is filled with.
    pub list: Vec<Medium>,
    /// Sides of surfaces where media change: `[outside, inside]`. The outside is where the front
    /// of a surface looks.
    pub boundaries: Vec<[u32; 2]>,
    /// That around the camera.
    pub camera: u32,
    /// Of each light the media that its front and its back shine into; empty if there are no media.
    pub lights: Vec<[u32; 2]>,
}

impl Default for Media {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            boundaries: Vec::new(),
            camera: NONE,
            lights: Vec::new(),
        }
    }
}

impl Media {
    /// Memory of its tables, in bytes.
    pub fn bytes(&self) -> usize {
        self.list.iter().map(Medium::bytes).sum::<usize>()
            + size_of_val(&self.boundaries[..])
            + size_of_val(&self.lights[..])
    }

    /// Some medium emits light.
    pub fn emits(&self) -> bool {
        self.list.iter().any(|m| m.emission != Emission::Dark)
    }
}
