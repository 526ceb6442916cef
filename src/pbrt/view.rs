//! What is rendered how: `Camera`, `Film`, `PixelFilter`, `Sampler` and `Integrator`.

mod aperture;
mod camera;
mod film;
mod lenses;

pub(super) use self::camera::{camera, default_camera};
pub(super) use self::film::{default_film, default_filter, film, filter, shutter_time};
pub(super) use self::lenses::{DIAGONAL, film_diagonal};

use super::error::{Report, SceneError};
use super::params::ParamSet;
use crate::scene::{IntegratorKind, IntegratorSettings};

/// Samples per pixel, and the seed if the sampler has one.
pub(super) fn sampler(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<(u32, Option<u64>), SceneError> {
    let most = i64::from(u32::MAX);
    let samples = if kind == "stratified" {
        let (x, y) = (
            set.int_in("xsamples", 4, 1, 1 << 15)?,
            set.int_in("ysamples", 4, 1, 1 << 15)?,
        );
        set.int_in("pixelsamples", x * y, 1, most)?
    } else {
        set.int_in("pixelsamples", 16, 1, most)?
    };
    set.accept(&["jitter", "dimensions", "randomization", "samplepixelcenter"]);
    let limit = i64::from(u32::MAX);
    let seed = (set
        .has("seed")
        .then(|| set.int_in("seed", 0, -limit, limit)))
    .transpose()?;
    set.finish(report);
    Ok((samples as u32, seed.map(|seed| seed as u64)))
}

pub(super) fn integrator(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<IntegratorSettings, SceneError> {
    let mut settings = IntegratorSettings::default();
    let default_depth = i64::from(settings.max_depth);
    settings.max_depth = set.int_in("maxdepth", default_depth, 0, 1 << 16)? as u32;
    let replaced = |report: &mut Report, by: &str| {
        report.warn_at(&set.site, format_args!("rendered with {by} instead"));
    };
    let count = |name: &str, default: u64, least: i64| -> Result<u64, SceneError> {
        Ok(set.int_in(name, default as i64, least, 1 << 50)? as u64)
    };
    match kind {
        "mlt" => {
            settings.mutations_per_pixel =
                count("mutationsperpixel", settings.mutations_per_pixel, 1)?;
            settings.chains = count("chains", settings.chains, 1)?;
            settings.bootstrap_samples = count("bootstrapsamples", settings.bootstrap_samples, 1)?;
            settings.large_step_probability = set.float_in(
                "largestepprobability",
                f64::from(settings.large_step_probability),
                0.0,
                1.0,
            )? as f32;
            settings.sigma =
                set.float_in("sigma", f64::from(settings.sigma), 0.0, f64::INFINITY)? as f32;
        }
        "path" => settings.kind = IntegratorKind::Pt,
        "volpath" | "directlighting" | "whitted" | "simplepath" | "simplevolpath"
        | "randomwalk" | "ao" | "ambientocclusion" | "function" => {
            settings.kind = IntegratorKind::Pt;
            if kind != "volpath" {
                replaced(report, "path tracing");
            }
        }
        "bdpt" => {
            settings.kind = IntegratorKind::Bdpt;
            // Of two pictures of each strategy pbrt writes one.
            settings.strategies = set.bool_or("visualizestrategies", false)?
                | set.bool_or("visualizeweights", false)?;
        }
        "lightpath" => settings.kind = IntegratorKind::Lt,
        "sppm" => replaced(report, "samples and chains (auto)"),
        _ => {
            return Err(set.error("this integrator is unknown; use mlt, path, bdpt or lightpath"));
        }
    }
    if set.bool_or("regularize", false)? {
        report.warn_at(
            &set.site,
            "\"regularize\" is ignored: it would alter the picture",
        );
    }
    // How samples are spent, not what the picture converges to.
    set.accept(&[
        "lightsamplestrategy",
        "lightsampler",
        "rrthreshold",
        "strategy",
        "visualizestrategies",
        "visualizeweights",
        "samplelights",
        "samplebsdf",
        "cossample",
        "maxdistance",
        "nsamples",
        "numiterations",
        "iterations",
        "photonsperiteration",
        "imagewritefrequency",
        "radius",
        "seed",
    ]);
    set.finish(report);
    Ok(settings)
}
