//! v4 `nanovdb`: densities and temperatures from a file.

use std::path::Path;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DVec3};

use super::coefficients::{asymmetry, coefficients};
use super::grids::black_bodies;
use super::world::{WorldGrid, WorldMedium};
use crate::formats::nanovdb::{self, FloatGrid};
use crate::pbrt::budget::{Budget, Charge};
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::Deferred;
use crate::pbrt::transform::inverse;
use crate::scene::{Density, Emission};

impl WorldMedium {
    /// v4 `nanovdb`; the file takes of `budget` while it is read.
    pub(super) fn nanovdb(
        name: &str,
        set: &ParamSet,
        ctm: &DAffine3,
        budget: &Rc<Budget>,
    ) -> Deferred<Self> {
        let Some(file) = set.string("filename")?.filter(|file| !file.is_empty()) else {
            return Err(set.error("a nanovdb medium needs a \"string filename\""));
        };
        let path = set.dir.join(file);
        let called = |name: &str, default: &'static str| -> Deferred<String> {
            Ok(set.string(name)?.unwrap_or(default).to_owned())
        };
        let density_name = called("gridname", "density")?;
        let temperature_name = called("temperaturename", "temperature")?;
        let coefficients = coefficients(set, false)?;
        let mut medium = Self::new(name, set, coefficients);
        medium.g = asymmetry(set)?;
        let brightness = set.float_in("Lescale", 1.0, 0.0, f64::INFINITY)? as f32;
        let scale = set.float_or("temperaturescale", 1.0)? as f32;
        let cutoff = set.float_or("temperaturecutoff", 0.0)?;
        let offset = set.float_or("temperatureoffset", cutoff)? as f32;

        let mut room = Charge::none(budget);
        let mut read = |grid: &str| read(set, &path, grid, &mut room);
        let Some(density) = read(&density_name)? else {
            let what = format!("{}: it has no grid \"{density_name}\"", path.display());
            return Err(set.error(what));
        };
        let temperature = read(&temperature_name)?;
        // Where pbrt-v4 looks for the medium: the bounds of both, in its own space.
        let [mut low, mut high] = density.bounds.map(DVec3::from);
        if let Some(temperature) = &temperature {
            low = low.min(DVec3::from(temperature.bounds[0]));
            high = high.max(DVec3::from(temperature.bounds[1]));
        }
        medium.density = Density::Grid(place(set, ctm, density, Some([low, high]))?);
        if let Some(temperature) = temperature {
            let [absorption, _] = coefficients;
            medium.emission = Emission::BlackBody {
                absorption,
                grids: [
                    place(set, ctm, temperature, None)?,
                    WorldGrid::even(brightness),
                ],
                scale,
                offset,
                table: black_bodies(),
            };
        }
        if brightness == 0.0 {
            medium.emission = Emission::Dark;
        }
        Ok(medium)
    }
}

/// A grid of a file, if it has one of this name.
fn read(set: &ParamSet, path: &Path, name: &str, room: &mut Charge) -> Deferred<Option<FloatGrid>> {
    let grid = nanovdb::read(path, name, &mut |bytes| room.add(bytes));
    let fail = |what: String| set.error(format_args!("{}: {what}", path.display()));
    let grid = grid.map_err(fail)?;
    // It would be so beyond all that is in the file.
    match &grid {
        Some(grid) if grid.background != 0.0 => Err(fail(format!(
            "its grid \"{name}\" is {} where it has no voxels; only 0 is supported",
            grid.background
        ))),
        _ => Ok(grid),
    }
}

/// A grid of a file in the world; where its axes are those of the file's world, it ends where that
/// says.
fn place(
    set: &ParamSet,
    ctm: &DAffine3,
    grid: FloatGrid,
    ends: Option<[DVec3; 2]>,
) -> Deferred<WorldGrid> {
    let [x, y, z] = grid.to_world;
    let matrix = DMat3::from_cols_array(&[x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]]);
    let to_medium = DAffine3::from_mat3_translation(matrix, DVec3::new(x[3], y[3], z[3]));
    let to_voxels = inverse(&to_medium);
    let (Some(to_voxels), Some(to_own)) = (to_voxels, inverse(&(*ctm * to_medium))) else {
        return Err(set.error("its grid and the current transform leave no volume"));
    };
    // The first sample is that of the voxel before the lowest one that is active.
    let shift = DVec3::from(grid.low.map(|v| -(v as f64)));
    let size = DVec3::from(grid.size.map(f64::from));
    // Beyond its first and last samples, which are not active, there is nothing of it.
    let mut bounds = [DVec3::ZERO, size - 1.0];
    let is_straight = matrix == DMat3::from_diagonal(matrix.diagonal());
    if let Some(ends) = ends.filter(|_| is_straight) {
        let ends = ends.map(|end| to_voxels.transform_point3(end) + shift);
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        bounds = [bounds[0].max(low), bounds[1].min(high)];
    }
    // Some files have numbers below 0, or none, where they have nothing.
    let clean = |v: &f32| if *v > 0.0 { v.min(f32::MAX) } else { 0.0 };
    Ok(WorldGrid {
        to_grid: DAffine3::from_translation(shift) * to_own,
        bounds,
        size: grid.size,
        channels: 1,
        values: grid.values.iter().map(clean).collect(),
    })
}
