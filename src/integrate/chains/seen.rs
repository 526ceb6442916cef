//! The picture of a render by chains and of samples beside them, also while they march.

use crate::film::{SplatFilm, Tiling};
use crate::integrate::normalisation::{Chains, Light};
use crate::integrate::sampled::Sampling;
use crate::integrate::show::Seen;
use crate::integrate::{Run, Stats, mixing_check};
use rayon::prelude::*;

/// Pixels that a thread resolves at a time.
const PART: usize = 1 << 14;

/// The picture so far, but for what chains still hold; if it is to be `judged`, with its errors and
/// what there is to warn of.
pub(super) fn see(
    run: &Run,
    film: &SplatFilm,
    chains: &Chains,
    beside: Option<&Sampling>,
    judged: bool,
) -> Seen {
    let light = Light::of(run, film.layers(), chains);
    if !judged || !run.settings.estimate_error {
        return Seen {
            pixels: picture(film, &light, beside).0,
            deviation: None,
            warnings: None,
        };
    }
    let (pixels, deviation) = match beside.is_none_or(Sampling::is_judged) {
        true => {
            let (pixels, deviation) = with_error(run, film, &light, beside);
            (pixels, Some(deviation))
        }
        false => (picture(film, &light, beside).0, None),
    };
    let mut warnings = Vec::new();
    let sums = beside.map(|beside| (beside, beside.tile_sums()));
    let layer = sums.as_ref().map(|(beside, sums)| beside.layer(sums));
    mixing_check::judge(
        run,
        &Tiling::new(run.film.crop),
        (chains, &light),
        layer,
        &mut Stats::default(),
        &mut warnings,
    );
    Seen {
        pixels,
        deviation,
        warnings: Some(warnings),
    }
}

/// All pixels, and their standard errors.
fn with_error(
    run: &Run,
    film: &SplatFilm,
    light: &Light,
    beside: Option<&Sampling>,
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let (width, height) = run.size();
    let count = width as usize * height as usize;
    let scales = light.of_film(&light.scales);
    let part = |first: usize| {
        let pixels = first..count.min(first + PART);
        let (mut picture, mut deviation) = film.resolve_with_error(pixels.clone(), &scales);
        if let Some(beside) = beside {
            let [more, error] = beside.with_error(pixels, 1.0);
            add_picture(&mut picture, &more);
            add_error(&mut deviation, &error);
        }
        (picture, deviation)
    };
    let firsts: Vec<usize> = (0..count).step_by(PART).collect();
    let parts: Vec<_> = firsts.into_par_iter().map(part).collect();
    let (pictures, deviations): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    (pictures.concat(), deviations.concat())
}

/// The picture of chains and of the samples beside them, and the mean of what samples bring.
pub(super) fn picture(
    film: &SplatFilm,
    light: &Light,
    beside: Option<&Sampling>,
) -> (Vec<[f32; 3]>, f64) {
    let mut pixels = film.resolve(&light.scales);
    let Some(beside) = beside else {
        return (pixels, 0.0);
    };
    let more = beside.picture();
    add_picture(&mut pixels, &more);
    (pixels, mean(&more))
}

/// Adds a picture to another.
pub(super) fn add_picture(to: &mut [[f32; 3]], more: &[[f32; 3]]) {
    let values = to.as_flattened_mut().iter_mut();
    values.zip(more.as_flattened()).for_each(|(to, v)| *to += v);
}

/// Mean of all channels.
pub(super) fn mean(picture: &[[f32; 3]]) -> f64 {
    let sum: f64 = picture.as_flattened().iter().map(|v| f64::from(*v)).sum();
    sum / (3 * picture.len()).max(1) as f64
}

/// Standard errors of a sum of two that are independent.
pub(super) fn add_error(to: &mut [[f32; 3]], more: &[[f32; 3]]) {
    for (to, more) in to.as_flattened_mut().iter_mut().zip(more.as_flattened()) {
        *to = (*to * *to + *more * *more).sqrt();
    }
}
