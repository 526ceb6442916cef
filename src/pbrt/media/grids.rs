//! Media with densities in a grid: v3 `heterogeneous`, v4 `uniformgrid`, `rgbgrid` and `cloud`.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::cloud;
use super::coefficients::{asymmetry, coefficients};
use super::world::{WorldGrid, WorldMedium};
use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::params::{ParamSet, Type};
use crate::pbrt::spectrum;
use crate::pbrt::textures::Deferred;
use crate::pbrt::transform::inverse;
use crate::scene::{Density, Emission, Rgb};

/// Samples along each side of a cloud, at most: its density is a function, which is looked up
/// between them.
const CLOUD_SAMPLES: f64 = 128.0;

/// Temperatures of the table of black bodies, in kelvin: beyond it they are as bright as there.
const HOTTEST: f32 = 40_000.0;

/// Where a medium's grid is.
struct Lattice {
    /// The unit cube to the world.
    to_world: DAffine3,
    /// Corners in the medium's own space.
    corners: [DVec3; 2],
    size: [u32; 3],
}

impl Lattice {
    /// Of so many samples along each side.
    fn read(set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        const MOST: i64 = 1 << 14;
        let mut size = [1; 3];
        for (n, name) in size.iter_mut().zip(["nx", "ny", "nz"]) {
            *n = set.int_in(name, 1, 1, MOST)? as u32;
        }
        let lattice = Self::bounds(set, ctm)?;
        Ok(Self { size, ..lattice })
    }

    fn bounds(set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        let mut corners = [
            set.point_or("p0", DVec3::ZERO)?,
            set.point_or("p1", DVec3::ONE)?,
        ];
        if set.dialect == Dialect::V4 {
            corners = [corners[0].min(corners[1]), corners[0].max(corners[1])];
        }
        let [low, high] = corners;
        let to_world = *ctm * DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
        Ok(Self {
            to_world,
            corners,
            size: [1; 3],
        })
    }

    fn count(&self) -> usize {
        self.size.iter().map(|n| *n as usize).product()
    }

    /// A grid of these values of its samples.
    fn grid(&self, set: &ParamSet, values: Arc<[f32]>, size: [u32; 3]) -> Deferred<WorldGrid> {
        let Some(to_unit) = inverse(&self.to_world) else {
            return Err(set.error("its bounds and the current transform leave no volume"));
        };
        let n = DVec3::from(size.map(f64::from));
        let samples = size.iter().map(|n| *n as usize).product::<usize>();
        Ok(WorldGrid {
            to_grid: DAffine3::from_translation(DVec3::splat(-0.5))
                * DAffine3::from_scale(n)
                * to_unit,
            bounds: [DVec3::splat(-0.5), n - 0.5],
            size,
            channels: (values.len() / samples.max(1)) as u32,
            values,
        })
    }

    /// The grid of a parameter with one number a sample, if it is given.
    fn floats(&self, set: &ParamSet, name: &str) -> Deferred<Option<WorldGrid>> {
        let Some(numbers) = set.floats(name)?.filter(|v| !v.is_empty()) else {
            return Ok(None);
        };
        self.check(set, name, numbers.len())?;
        let values = numbers.iter().map(|v| narrow(*v)).collect();
        self.grid(set, values, self.size).map(Some)
    }

    /// The grid of a parameter with one colour a sample, if it is given; light if `emits`.
    fn colours(&self, set: &ParamSet, name: &str, emits: bool) -> Deferred<Option<WorldGrid>> {
        let Some(param) = set.find(name).filter(|param| param.values.len() > 0) else {
            return Ok(None);
        };
        if param.ty != Type::Rgb {
            return Err(set.error_at(param, "is no list of rgb colours"));
        }
        let numbers = param.values.numbers();
        if !numbers.len().is_multiple_of(3) {
            let what = format!("has {} numbers, not a multiple of 3", numbers.len());
            return Err(set.error_at(param, what));
        }
        self.check(set, name, numbers.len() / 3)?;
        let space = param.color_space;
        let convert = |v: &[f64]| {
            let v = [v[0], v[1], v[2]];
            let rgb = if emits {
                space.emission_to_srgb(v)
            } else {
                space.to_srgb(v)
            };
            rgb.map(narrow)
        };
        let values = numbers.chunks_exact(3).flat_map(convert).collect();
        self.grid(set, values, self.size).map(Some)
    }

    fn check(&self, set: &ParamSet, name: &str, given: usize) -> Deferred<()> {
        let [x, y, z] = self.size;
        if given == self.count() {
            return Ok(());
        }
        Err(set.error(format_args!(
            "\"{name}\" has {given} values, but \"nx\", \"ny\" and \"nz\" ask for {x} x {y} x {z}"
        )))
    }
}

/// Densities below 0 mean nothing.
fn narrow(v: f64) -> f32 {
    (v as f32).clamp(0.0, f32::MAX)
}

impl WorldMedium {
    /// v3 `heterogeneous` and v4 `uniformgrid`.
    pub(super) fn grid(name: &str, set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        let lattice = Lattice::read(set, ctm)?;
        let Some(density) = lattice.floats(set, "density")? else {
            return Err(set.error("has no \"density\""));
        };
        let [absorption, scattering] = coefficients(set, set.dialect == Dialect::V3)?;
        let mut medium = Self::new(name, set, [absorption, scattering]);
        medium.g = asymmetry(set)?;
        medium.density = Density::Grid(density);
        if set.dialect == Dialect::V3 {
            // pbrt-v3 has the extinction of the first channel for all.
            let first = absorption[0] + scattering[0];
            let grey = [0, 1, 2].map(|c| absorption[c] + scattering[c]) == [first; 3];
            if !grey {
                set.note(
                    "its extinction is taken to be that of red in all channels, as in pbrt-v3",
                );
            }
            medium.extinction = [first; 3];
            return Ok(medium);
        }
        medium.emission = lattice.emission(set, absorption)?;
        Ok(medium)
    }

    /// v4 `rgbgrid`.
    pub(super) fn rgb_grid(name: &str, set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        let lattice = Lattice::read(set, ctm)?;
        let absorption = lattice.colours(set, "sigma_a", false)?;
        let scattering = lattice.colours(set, "sigma_s", false)?;
        let light = lattice.colours(set, "Le", true)?;
        if light.is_some() && absorption.is_none() {
            return Err(set.error("needs \"sigma_a\" for its \"Le\""));
        }
        let (absorption, scattering) = match (absorption, scattering) {
            (Some(absorption), Some(scattering)) => (absorption, scattering),
            // Where one is missing it is 1 throughout, to the very sides, where the other falls.
            (Some(absorption), None) => (absorption.framed(0.0), ones(&absorption)),
            (None, Some(scattering)) => (ones(&scattering), scattering.framed(0.0)),
            (None, None) => return Err(set.error("has neither \"sigma_a\" nor \"sigma_s\"")),
        };
        let scale = set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32;
        let sum = absorption.values.iter().zip(&*scattering.values);
        let extinction = WorldGrid {
            values: sum.map(|(a, s)| (a + s).min(f32::MAX)).collect(),
            ..absorption.clone()
        };
        let mut medium = Self::new(name, set, [[0.0; 3], [scale; 3]]);
        medium.g = asymmetry(set)?;
        if let Some(light) = light {
            let radiance = set.float_in("Lescale", 1.0, 0.0, f64::INFINITY)? as f32;
            medium.emission = Emission::Product {
                radiance: [radiance * scale; 3],
                grids: [absorption, light],
            };
        }
        medium.density = Density::Channels {
            extinction,
            scattering,
        };
        Ok(medium)
    }

    /// v4 `cloud`.
    pub(super) fn cloud(name: &str, set: &ParamSet, ctm: &DAffine3) -> Deferred<Self> {
        let lattice = Lattice::bounds(set, ctm)?;
        let mut of = cloud::Cloud::default();
        for (value, name) in [
            (&mut of.density, "density"),
            (&mut of.wispiness, "wispiness"),
            (&mut of.frequency, "frequency"),
        ] {
            *value = set.float_in(name, f64::from(*value), 0.0, f64::INFINITY)? as f32;
        }
        let [low, high] = lattice.corners;
        let extent = high - low;
        let step = extent.max_element() / CLOUD_SAMPLES;
        let size = extent
            .to_array()
            .map(|e| (e / step).ceil().clamp(1.0, CLOUD_SAMPLES) as u32);
        let n = DVec3::from(size.map(f64::from));
        let mut values = Vec::with_capacity(lattice.count());
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let at = (DVec3::from([x, y, z].map(f64::from)) + 0.5) / n;
                    values.push(of.at((low + at * extent).as_vec3().to_array()));
                }
            }
        }
        let [x, y, z] = size;
        set.note(format_args!(
            "its density is looked up at {x} x {y} x {z} points and interpolated between them"
        ));
        let [absorption, scattering] = coefficients_without_scale(set)?;
        let mut medium = Self::new(name, set, [absorption, scattering]);
        medium.g = asymmetry(set)?;
        medium.density = Density::Grid(lattice.grid(set, values.into(), size)?);
        Ok(medium)
    }
}

/// As large as a grid that is framed, and 1.
fn ones(grid: &WorldGrid) -> WorldGrid {
    let framed = grid.framed(1.0);
    WorldGrid {
        values: framed.values.iter().map(|_| 1.0).collect(),
        ..framed
    }
}

fn coefficients_without_scale(set: &ParamSet) -> Deferred<[Rgb; 2]> {
    let read =
        |name: &str| -> Deferred<Rgb> { Ok(set.color(name, Use::Index)?.unwrap_or([1.0; 3])) };
    Ok([read("sigma_a")?, read("sigma_s")?])
}

impl Lattice {
    /// What a v4 `uniformgrid` of this absorption emits.
    fn emission(&self, set: &ParamSet, absorption: Rgb) -> Deferred<Emission<WorldGrid>> {
        let light = set.color("Le", Use::Emission)?;
        let temperature = self.floats(set, "temperature")?;
        if light.is_some() && temperature.is_some() {
            return Err(set.error("has both \"Le\" and \"temperature\"; keep one"));
        }
        let scale = set.float_or("temperaturescale", 1.0)? as f32;
        let cutoff = set.float_or("temperaturecutoff", 0.0)?;
        let offset = set.float_or("temperatureoffset", cutoff)? as f32;
        // Without a scale for each sample pbrt-v4 interpolates a single one, which falls to a half
        // at the sides.
        let factor = match self.floats(set, "Lescale")? {
            Some(grid) => grid,
            None => self.grid(set, Arc::from(&[1.0f32][..]), [1; 3])?,
        };
        Ok(match (light, temperature) {
            (Some(radiance), _) if radiance != [0.0; 3] => Emission::Grid {
                absorption,
                radiance,
                grid: factor,
            },
            (_, Some(grid)) => Emission::BlackBody {
                absorption,
                grids: [grid, factor],
                scale,
                offset,
                table: black_bodies(),
            },
            _ => Emission::Dark,
        })
    }
}

/// The light of black bodies, whose spectra have a maximum of 1, as a pbrt-v4 film sees it.
pub(super) fn black_bodies() -> Arc<[Rgb]> {
    let steps = (HOTTEST / Emission::KELVIN_STEP) as u32;
    (0..=steps)
        .map(|i| spectrum::blackbody_medium(i as f32 * Emission::KELVIN_STEP))
        .collect()
}
