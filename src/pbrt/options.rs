//! v4's `Option "name" value`.

use super::error::{Report, SceneError, Site};
use super::lexer::{Token, TokenKind};

/// What an option does to the picture.
enum Effect {
    Seed,
    /// True or false, and the picture is the same.
    Switch,
    /// True would be another picture: why it is not made.
    Refused(&'static str),
    /// A number of what there is not.
    Number,
    Text,
    /// `camera`, `cameraworld` or `world`.
    Space,
}

fn effect(name: &str) -> Option<Effect> {
    Some(match name {
        "seed" => Effect::Seed,
        "disabletexturefiltering" | "disablewavelengthjitter" | "pixelstats" | "wavefront" => {
            Effect::Switch
        }
        "disablepixeljitter" => {
            Effect::Refused("would look at the centres of pixels alone; remove it")
        }
        "forcediffuse" => Effect::Refused("would make all surfaces diffuse; remove it"),
        "displacementedgescale" => Effect::Number,
        "msereferenceimage" | "msereferenceout" => Effect::Text,
        "rendercoordsys" => Effect::Space,
        _ => return None,
    })
}

/// Takes an option; the seed if it is that one. As in pbrt, case, hyphens and underscores of names
/// do not matter; a type before the name, as parameters have it, does not either.
pub(super) fn set(
    name: &str,
    value: &Token,
    site: &Site,
    report: &mut Report,
) -> Result<Option<u64>, SceneError> {
    let last = name.split_ascii_whitespace().last().unwrap_or("");
    let plain: String = (last.chars())
        .filter(|c| !matches!(c, '-' | '_'))
        .map(|c| c.to_ascii_lowercase())
        .collect();
    let expected = |what: &str| {
        Err(site.error(format_args!(
            "\"{last}\" must be {what}, not {}",
            value.shown()
        )))
    };
    let Some(effect) = effect(&plain) else {
        report.warn_at(site, format_args!("unknown option \"{last}\" ignored"));
        return Ok(None);
    };
    match effect {
        Effect::Seed => match value.number() {
            Ok(x) if x.fract() == 0.0 && x.abs() < 9e15 => return Ok(Some(x as i64 as u64)),
            _ => return expected("a whole number"),
        },
        Effect::Switch | Effect::Refused(_) => match (&*value.text(), effect) {
            ("true", Effect::Refused(why)) => {
                return Err(site.error(format_args!("\"{last}\" {why}")));
            }
            ("true" | "false", _) => {}
            _ => return expected("true or false"),
        },
        Effect::Number if value.number().is_err() => return expected("a number"),
        Effect::Text | Effect::Space if value.kind != TokenKind::Quoted => {
            return expected("a string in quotes");
        }
        Effect::Space if !matches!(&*value.text(), "camera" | "cameraworld" | "world") => {
            return expected("camera, cameraworld or world");
        }
        Effect::Number | Effect::Text | Effect::Space => {}
    }
    Ok(None)
}
