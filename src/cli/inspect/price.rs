//! How long the picture takes, by a render of a second that is smaller.

use std::time::Duration;

use serde::Serialize;

use crate::cli::args::values::Quality;
use crate::cli::failure::Failure;
use crate::cli::units;
use crate::integrate::{self, Settings, Silent};
use crate::scene::Scene;

/// How long the render is that the rest is taken from.
const TRIAL: Duration = Duration::from_secs(1);

/// About how many pixels it has. The error of a pixel depends on what is spent on it alone.
const PIXELS: f64 = 4096.0;

/// Errors that are told of: a tenth, and the better ones of `--quality`.
const ERRORS: [f64; 3] = [0.1, Quality::Good.error(), Quality::Final.error()];

/// The time to a relative error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Price {
    relative_error: f64,
    seconds: f64,
}

/// Renders for a moment, as the scene asks for, and looks at the error. The scene is left as it
/// was.
///
/// # Errors
/// What keeps the scene from being rendered.
pub fn of(scene: &mut Scene, max_depth: u32) -> Result<Vec<Price>, Failure> {
    let (film, camera) = (scene.film.clone(), scene.camera.clone());
    let pixels = film.crop_pixels() as f64;
    let scale = (PIXELS / pixels).sqrt().min(1.0);
    let small = |side: u32| (f64::from(side) * scale).ceil() as u32;
    let resized = scene.set_resolution(small(film.width), small(film.height));
    let part = scene.film.crop_pixels() as f64 / pixels;
    let prices = match resized {
        Ok(()) => trial(scene, max_depth, part),
        Err(e) => Err(Failure::Input(e.to_string())),
    };
    (scene.film, scene.camera) = (film, camera);
    prices
}

/// Prices of the whole picture by a render of a part of its pixels.
fn trial(scene: &Scene, max_depth: u32, part: f64) -> Result<Vec<Price>, Failure> {
    let settings = Settings {
        max_depth,
        time: Some(TRIAL),
        samples_per_pixel: u64::from(u32::MAX),
        mutations_per_pixel: u64::from(u32::MAX),
        ..Settings::of(scene)
    };
    let render = integrate::render(scene, &settings, &Silent);
    let stats = render.map_err(|e| Failure::Input(e.to_string()))?.stats;
    let taken = stats.bootstrap_seconds + stats.render_seconds;
    Ok(prices(stats.relative_error, taken / part))
}

/// The square of an error falls with the work.
fn prices(error: Option<f64>, taken: f64) -> Vec<Price> {
    let of = |error: f64| {
        ERRORS.map(|relative_error| Price {
            relative_error,
            seconds: taken * (error / relative_error).powi(2),
        })
    };
    error.map_or(Vec::new(), |error| of(error).into())
}

/// `10 % in 1.3 s, 5 % in 5.2 s, 1 % in 2 min 10 s`
pub fn text(prices: &[Price]) -> String {
    let each = prices.iter().filter_map(|price| {
        let time = Duration::try_from_secs_f64(price.seconds).ok()?;
        let error = units::digits(100.0 * price.relative_error, 3);
        Some(format!("{error} % in {}", units::time(time)))
    });
    let list: Vec<String> = each.collect();
    match list.is_empty() {
        true => "a second is not enough to know".into(),
        false => list.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_error_takes_four_times_as_long() {
        assert_eq!(
            text(&prices(Some(0.2), 1.0)),
            "10 % in 4.0 s, 5 % in 16.0 s, 1 % in 6 min 40 s"
        );
        assert_eq!(text(&prices(None, 1.0)), "a second is not enough to know");
    }
}
