//! The picture so far on its way from an integrator to the observer.

use super::error::{relmse, standard_errors};
use super::run::Run;
use super::scale::{bring_to_scale, mixed_deviation};
use super::so_far::{SoFar, Wanted};
use crate::formats::Picture;
use crate::scene::Film;

/// What an integrator tells of a picture, in radiance.
pub(super) struct Seen {
    pub pixels: Vec<[f32; 3]>,
    /// As [`Render::deviation`](super::Render::deviation).
    pub deviation: Option<Vec<[f32; 3]>>,
    pub warnings: Option<Vec<String>>,
}

impl Run<'_> {
    /// Hands the picture so far to the observer, as far as it is wanted. `see` is told whether the
    /// picture is to be judged.
    pub(super) fn show(&self, wanted: Wanted, see: impl FnOnce(bool) -> Seen) {
        if wanted == Wanted::Nothing {
            return;
        }
        let mut seen = see(wanted == Wanted::Judged);
        let film = self.film;
        let relative_error = relative_error(&seen, self.size(), film.scale);
        bring_to_scale(&mut seen.pixels, film.scale, film.colour.as_ref());
        let (width, height) = self.size();
        let [offset, full] = self.window();
        let errors = seen.deviation.map(|mut deviation| {
            scale_deviation(film, &mut deviation);
            standard_errors(&deviation, width as usize)
        });
        self.observer.picture(SoFar {
            picture: Picture {
                width,
                height,
                offset,
                full,
                pixels: seen.pixels,
            },
            errors,
            relative_error,
            warnings: seen.warnings,
        });
    }
}

/// Of a picture of this size in radiance that `scale` brings to the film's units.
fn relative_error(seen: &Seen, (width, height): (u32, u32), scale: f32) -> Option<f64> {
    let deviation = seen.deviation.as_ref()?;
    let (width, height) = (width as usize, height as usize);
    let error = relmse(width, height, |rows| {
        let rows = rows.start * width..rows.end * width;
        let scaled = |of: &[[f32; 3]]| of.iter().map(|p| p.map(|v| v * scale)).collect();
        (scaled(&seen.pixels[rows.clone()]), scaled(&deviation[rows]))
    });
    Some(error.sqrt())
}

/// Brings standard errors of radiance to the film's units.
pub(super) fn scale_deviation(film: &Film, deviation: &mut [[f32; 3]]) {
    bring_to_scale(deviation, film.scale, None);
    if let Some(m) = &film.colour {
        (deviation.iter_mut()).for_each(|d| *d = mixed_deviation(m, *d));
    }
}
