//! The picture of a render by chains, while they march.

use super::{Chains, Light, Sampling, add_error, add_picture, picture};
use crate::film::{SplatFilm, Tiling};
use crate::integrate::so_far::Seen;
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
        &Tiling::new(run.scene.film.crop),
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
