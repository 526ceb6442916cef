//! Pictures of a part of the light.

use super::{Numbers, Sampled};
use crate::film::{FilterTable, SampleFilm};
use crate::integrate::Run;

/// A picture that is not judged, of a part of the light.
pub struct PartFilm {
    sums: SampleFilm,
    splats: bool,
}

impl PartFilm {
    pub fn new(run: &Run, splats: bool) -> Self {
        let film = run.film;
        let filter = FilterTable::new(&film.filter, film.crop);
        let sums = match splats {
            true => SampleFilm::splatted_part(filter),
            false => SampleFilm::part(filter),
        };
        Self { sums, splats }
    }

    /// Adds what each path of a batch brings, at raster positions.
    pub fn add(&self, light: impl Iterator<Item = ([f32; 3], [f32; 2])>, numbers: Numbers) {
        let lit = (light.enumerate()).filter(|(_, (rgb, _))| *rgb != [0.0; 3]);
        self.sums
            .add(lit.map(|(i, (rgb, raster))| match self.splats {
                true => numbers.splat(i, raster, rgb),
                false => numbers.placed(i, raster, rgb),
            }));
    }

    /// The picture, of a render of which it is a part.
    pub fn resolve(&self, of: &Sampled) -> Vec<[f32; 3]> {
        match self.splats {
            true => self.sums.resolve(&of.done.splats),
            false => (self.sums).resolve_part(of.film.placed(), &of.done.placed),
        }
    }
}
