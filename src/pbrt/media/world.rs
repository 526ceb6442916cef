//! Media in world space.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::pbrt::params::ParamSet;
use crate::pbrt::transform::rows;
use crate::scene::{self, Density, Emission, Rgb, Space};

/// A medium in world space: coefficients per length of the file.
#[derive(Clone, Debug)]
pub(in crate::pbrt) struct WorldMedium {
    name: String,
    origin: String,
    /// Where the density is 1, as all of these.
    pub(super) extinction: Rgb,
    scattering: Rgb,
    pub(super) g: f32,
    pub(super) density: Density<WorldGrid>,
    pub(super) emission: Emission<WorldGrid>,
}

/// Numbers at the points of a lattice, in world space.
#[derive(Clone, Debug)]
pub(super) struct WorldGrid {
    /// World to a space where samples are at integer points.
    pub to_grid: DAffine3,
    /// Where it ends in that space.
    pub bounds: [DVec3; 2],
    pub size: [u32; 3],
    pub channels: u32,
    pub values: Arc<[f32]>,
}

impl WorldGrid {
    /// A number that is the same everywhere: all points are that of its one sample.
    pub fn even(value: f32) -> Self {
        Self {
            to_grid: DAffine3::from_scale(DVec3::ZERO),
            bounds: [DVec3::splat(-0.5), DVec3::splat(0.5)],
            size: [1; 3],
            channels: 1,
            values: Arc::from(&[value][..]),
        }
    }

    /// With samples of `value` all around it; it ends where it ended.
    pub fn framed(&self, value: f32) -> Self {
        let size = self.size.map(|n| n + 2);
        let channels = self.channels as usize;
        let row = self.size[0] as usize * channels;
        let wide = row + 2 * channels;
        let count = size[1] as usize * size[2] as usize * wide;
        let mut values = vec![value; count];
        for (i, from) in self.values.chunks_exact(row.max(1)).enumerate() {
            let (y, z) = (i % self.size[1] as usize, i / self.size[1] as usize);
            let at = ((z + 1) * size[1] as usize + y + 1) * wide + channels;
            values[at..at + row].copy_from_slice(from);
        }
        Self {
            to_grid: DAffine3::from_translation(DVec3::ONE) * self.to_grid,
            bounds: self.bounds.map(|corner| corner + 1.0),
            size,
            channels: self.channels,
            values: values.into(),
        }
    }
}

impl WorldMedium {
    pub(super) fn new(name: &str, set: &ParamSet, [absorption, scattering]: [Rgb; 2]) -> Self {
        Self {
            name: name.to_owned(),
            origin: set.site.origin(),
            extinction: [0, 1, 2].map(|c| (absorption[c] + scattering[c]).min(f32::MAX)),
            scattering,
            g: 0.0,
            density: Density::Uniform,
            emission: Emission::Dark,
        }
    }

    /// In internal space, where lengths are shorter by the scale.
    pub(super) fn to_internal(&self, space: &Space) -> scene::Medium {
        let per_length =
            |rgb: Rgb| rgb.map(|c| ((f64::from(c) / space.scale) as f32).min(f32::MAX));
        let grid = |grid: &WorldGrid| scene::Grid {
            to_grid: rows(
                &(grid.to_grid
                    * DAffine3::from_translation(space.centre)
                    * DAffine3::from_scale(DVec3::splat(1.0 / space.scale))),
            ),
            bounds: grid.bounds.map(|corner| corner.as_vec3().to_array()),
            size: grid.size,
            channels: grid.channels,
            values: Arc::clone(&grid.values),
        };
        let density = match &self.density {
            Density::Uniform => Density::Uniform,
            Density::Grid(of) => Density::Grid(grid(of)),
            Density::Channels {
                extinction,
                scattering,
            } => Density::Channels {
                extinction: grid(extinction),
                scattering: grid(scattering),
            },
        };
        let emission = match &self.emission {
            Emission::Dark => Emission::Dark,
            Emission::Even(rgb) => Emission::Even(per_length(*rgb)),
            Emission::Grid {
                absorption,
                radiance,
                grid: of,
            } => Emission::Grid {
                absorption: per_length(*absorption),
                radiance: *radiance,
                grid: grid(of),
            },
            Emission::Product { radiance, grids } => Emission::Product {
                radiance: per_length(*radiance),
                grids: [grid(&grids[0]), grid(&grids[1])],
            },
            Emission::BlackBody {
                absorption,
                grids,
                scale,
                offset,
                table,
            } => Emission::BlackBody {
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
        let grids = self.density.grids().chain(self.emission.grids());
        grids.map(|grid| size_of_val(&grid.values[..]) as u64).sum()
    }
}
