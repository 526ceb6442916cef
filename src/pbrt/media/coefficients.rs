//! How much media absorb and scatter, and where to.

use super::presets;
use crate::pbrt::color::Use;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::SceneError;
use crate::pbrt::params::ParamSet;
use crate::scene::Rgb;

/// A mean cosine beyond this is as good as a delta.
const MOST_G: f64 = 0.9999;

/// Absorption and scattering per length of the file; of a preset, if there can be one.
pub(super) fn coefficients(set: &ParamSet, presets: bool) -> Result<[Rgb; 2], SceneError> {
    let name = if presets { set.string("preset")? } else { None };
    let named = match name {
        None | Some("") => None,
        Some(name) => {
            let known = presets::preset(name);
            if known.is_none() {
                set.note(format_args!(
                    "there is no preset named \"{name}\": it is ignored"
                ));
            }
            known
        }
    };
    let given = [
        set.color("sigma_a", Use::Index)?,
        set.color("sigma_s", Use::Index)?,
    ];
    let [absorption, scattering] = match (set.dialect, named) {
        // A preset is a default in v3, and all there is in v4.
        (Dialect::V4, Some(preset)) => {
            if given.iter().any(Option::is_some) {
                set.note("its preset counts, not its \"sigma_a\" and \"sigma_s\", as in pbrt-v4");
            }
            preset
        }
        (Dialect::V4, None) => given.map(|c| c.unwrap_or([1.0; 3])),
        (Dialect::V3, named) => {
            let [a, s] = named.unwrap_or([[0.0011, 0.0024, 0.014], [2.55, 3.21, 3.77]]);
            [given[0].unwrap_or(a), given[1].unwrap_or(s)]
        }
    };
    let scale = set.float_in("scale", 1.0, 0.0, f64::INFINITY)? as f32;
    let scaled = |c: Rgb| c.map(|c| (c.max(0.0) * scale).min(f32::MAX));
    Ok([scaled(absorption), scaled(scattering)])
}

/// The mean cosine of what is scattered.
pub(super) fn asymmetry(set: &ParamSet) -> Result<f32, SceneError> {
    let g = set.float_in("g", 0.0, -1.0, 1.0)?;
    Ok(g.clamp(-MOST_G, MOST_G) as f32)
}
